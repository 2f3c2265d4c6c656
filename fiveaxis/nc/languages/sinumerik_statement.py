"""One block of a Sinumerik program, read word by word."""

from __future__ import annotations

import re

from fiveaxis.base import Severity
from fiveaxis.nc.languages.block import SPINDLE_M, BlockError, Hole, m_number, number_of, put_word
from fiveaxis.nc.languages.expressions import evaluate, evaluate_prefix
from fiveaxis.nc.languages.planes import AXES, Statement
from fiveaxis.nc.languages.sinumerik_cycles import (
    HOLES,
    Swivel,
    Value,
    read_hole,
    read_swivel,
    split_arguments,
)
from fiveaxis.nc.languages.sinumerik_state import (
    IGNORED,
    IGNORED_G,
    IGNORED_SETTINGS,
    MACHINE_COORDINATES,
    REFUSED_G,
    ROTARY,
    ROUNDING_G,
    SAME_IN_ISO,
    State,
    refusal,
)

_ASSIGN = re.compile(r"([A-Z_$][A-Z_][A-Z0-9_]*|[A-Z][0-9]*)\s*(\[[^\]\"]*\])?\s*=(?!=)")
_WORD = re.compile(r"([A-Z])\s?([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?![0-9.])")
_NAME = re.compile(r"[A-Z_$][A-Z0-9_]*")
_LABEL = re.compile(r"[A-Z_][A-Z0-9_]*:(?!=)")
_MODE = re.compile(r"\s*(IC|AC|DC|ACP|ACN)\s*\(")
_CLOSE = re.compile(r"\s*\)")
_TEXT = re.compile(r'\s*"[^"]*"')

_CENTRE = {"I": "X", "J": "Y", "K": "Z"}
_TOOL_AXIS = {"G17": "Z", "G18": "Y", "G19": "X"}
_VECTORS = {"A3": "X", "B3": "Y", "C3": "Z"}
_NORMALS = {"A5": "X", "B5": "Y", "C5": "Z"}
_END = {2: "M2", 30: "M30"}
_TRANSFORMS = ("TRANS", "ATRANS", "ROT", "AROT")

_NO_WORDS = {
    "L": "calls a subprogram, whose file isn't beside the program or which has no block of its own",
    "P": "repeats a subprogram, and names none; write it behind the name",
    "E": "isn't an axis, and numbers have no exponent here; write the number out",
    **dict.fromkeys("NOQR", "isn't a word here; look up what the post-processor meant, and correct it"),
}


class SinumerikStatement(Statement):
    """One block, read from left to right and then as a whole."""

    state: State
    machine = modal_call = apart = returns = False
    transform: str | None = None
    plane_angle: float | None = None
    hole: Hole | None = None

    def read(self) -> None:
        """Read all words, then interpret them together; `BlockError` for anything that isn't supported."""
        label = _LABEL.match(self.code)
        at = 0
        if label is not None:
            self.draft.ignored.append("label")
            at = label.end()
        while at < len(self.code):
            at = at + 1 if self.code[at].isspace() else self._take(at)
        self._complete()

    def _take(self, at: int) -> int:
        """Read what begins at an index; return the index after it."""
        found = _ASSIGN.match(self.code, at)
        if found is not None:
            return self._assign(found[1], found[2], found.end())
        found = _WORD.match(self.code, at)
        if found is not None:
            self._word(found[1], number_of(found[1], found[2]))
            return found.end()
        found = _NAME.match(self.code, at)
        if found is None:
            raise BlockError(f"{self.code[at : at + 20]!r} isn't a word; correct it")
        return self._name(found[0], found.end())

    # Values after ``=``

    def _assign(self, name: str, index: str | None, at: int) -> int:
        """Read the value after ``=`` and assign it; return the index after it."""
        text = _TEXT.match(self.code, at)
        if text is not None:
            if name != "T" and name not in self.state.texts:
                raise BlockError(
                    f"{name} is assigned a text, which isn't supported; look up what it sets, and "
                    "post without it"
                )
            self.draft.ignored.append(name)
            if name == "T":
                self.draft.tool = f"T={text[0].strip()}"
            return text.end()
        mode = _MODE.match(self.code, at)
        value, end = evaluate_prefix(
            self.code, at if mode is None else mode.end(), self.state.variables.__getitem__
        )
        if mode is not None:
            close = _CLOSE.match(self.code, end)
            if close is None:
                raise BlockError(f"the bracket of {mode[1]} isn't closed")
            end = close.end()
        if name in IGNORED_SETTINGS or (len(name) > 1 and name[0] in "SMHTD" and name[1:].isdigit()):
            self.draft.ignored.append(name)
            self.draft.stated.append(f"{name}{index or ''}={value:g}")
        elif self.apart and name[0] in "XYZABCUVW" and name[1:].isdigit():
            pass  # G74 X1=0: a machine axis that moves to a fixed point
        elif index is not None and name[0] != "$":
            raise BlockError(f"{name}{index} is an array element, which isn't supported; write the number")
        else:
            self._set(name, value, None if mode is None else mode[1])
        return end

    def _set(self, name: str, value: float, mode: str | None) -> None:
        draft = self.draft
        if len(name) == 1:
            if name in _CENTRE and mode == "AC":
                put_word(draft.centre, _CENTRE[name], value)
            else:
                self._word(name, value, mode)
        elif mode is not None:
            raise BlockError(f"{mode} applies to axes and centres, not to {name}; write the number")
        elif name in _VECTORS:
            put_word(draft.vector, _VECTORS[name], value)
        elif name in _NORMALS:
            put_word(draft.normal, _NORMALS[name], value)
        elif name == "CR":
            put_word(draft.words, "R", value)
        elif name == "TURN":
            if value != int(value) or not 0 <= value <= 999:
                raise BlockError(f"TURN={value:g}; a helix has 0 to 999 full turns")
            self.draft.turns = int(value)
        elif name == "RPL" and self.transform in ("ROT", "AROT"):
            self.plane_angle = value
        elif name in ("A4", "B4", "C4") or (name in ("OFFN", "RNDM") and value == 0.0):
            draft.ignored.append(name)
        elif name in self.state.variables or name[0] == "_" or re.fullmatch("R[0-9]+", name):
            self.state.variables[name] = value
            draft.ignored.append("=")
            draft.stated.append(f"variable {name}={value:g}")
        else:
            raise BlockError(refusal(name))

    # Words of a letter and a number

    def _word(self, letter: str, value: float, mode: str | None = None) -> None:
        draft = self.draft
        if mode is not None and letter not in "XYZABCUVWIJK":
            raise BlockError(f"{mode} applies to axes and centres, not to {letter}; write the number")
        if letter in _NO_WORDS:
            raise BlockError(f"{letter}{value:g} {_NO_WORDS[letter]}")
        if letter == "G":
            self._g(value)
        elif letter == "M":
            self._m(value)
        elif letter in _CENTRE:
            put_word(draft.words, letter, value)
        else:
            if mode in ("DC", "ACP", "ACN"):
                value = self._turned(letter, value, mode)
            if mode == "IC":
                draft.increments += letter
            elif mode is not None:
                draft.absolutes += letter
            put_word(draft.words, letter, value)

    def _turned(self, letter: str, value: float, mode: str) -> float:
        if letter not in ROTARY:
            raise BlockError(f"{mode} is for rotary axes, and {letter} is none")
        if not 0.0 <= value <= 360.0:
            raise BlockError(f"{letter}={mode}({value:g}) must be an angle from 0 to 360 deg")
        return self.state.turned(letter, value, mode)

    def _g(self, number: float) -> None:
        draft, word = self.draft, f"G{number:g}"
        if number in REFUSED_G:
            raise BlockError(f"{word} {REFUSED_G[int(number)]}")
        if number in MACHINE_COORDINATES:
            self.machine = True
        elif number in (25, 26, 74, 75):
            self.apart = True
            draft.ignored.append(word)
        elif number == 500 or 505 <= number <= 599:
            draft.work_offset = word
            draft.ignored.append(word)
        elif number in IGNORED_G:
            draft.ignored.append(word)
            draft.cancels += ["rounding of corners (G60, G64, G642)"] if number in ROUNDING_G else []
        elif number in SAME_IN_ISO:
            self._iso(SAME_IN_ISO[int(number)])
            if number == 70:
                draft.note(
                    Severity.NOTE,
                    "feed-unit-assumed",
                    "under G70 F is taken as inch/min, like lengths in inch; post with G700, which says so",
                )
        else:
            raise BlockError(f"{word} isn't supported; post the program without it")

    def _iso(self, word: str) -> None:
        state = self.state
        if word in ("G0", "G1", "G2", "G3"):
            state.motion = word
        elif word in _TOOL_AXIS:
            state.tool_axis = _TOOL_AXIS[word]
        elif word in ("G90", "G91"):
            state.incremental = word == "G91"
        self.draft.g.append(word)
        self.draft.cancels += ["cutter compensation (G41, G42)"] if word == "G40" else []

    def _m(self, number: float) -> None:
        if m_number(number) == 17:
            self.returns = True
        elif number in _END:
            self.draft.m.append(_END[int(number)])
        elif number in SPINDLE_M:
            self.draft.m.append(f"M{number:g}")
        else:
            # No M word moves an axis here; those of TCP or calls in ISO belong to the machine builder.
            self.draft.ignored.append(f"M{number:g}")

    # Words of several letters

    def _name(self, name: str, at: int) -> int:
        """Read a word of several letters with its brackets; return the index after them."""
        if name == "DEF":
            self.state.declare(self.code[at:])
            self.draft.ignored.append("DEF")
            return len(self.code)
        parts, end = split_arguments(self.code, at) if self.code[at : at + 1] == "(" else ([], at)
        values = [self._argument(part) for part in parts]
        if name in ("TRAORI", "TRAFOOF"):
            self.switch_tcp(on=name == "TRAORI")
            written = self._written(name, at, end)
            self.draft.stated.append("TRAORI" if written == "TRAORI(1)" else written)
        elif name == "SUPA":
            self.machine = True
        elif name in _TRANSFORMS:
            self.transform = name
        elif name in ("SCALE", "MIRROR") and not self.code[at:].strip():
            self.transform = "TRANS"  # alone, each deletes the whole frame
        elif name == "MCALL":
            self.modal_call = True
        elif name == "RET":
            self.returns = True
        elif name in HOLES or name == "CYCLE800":
            self._cycle(name, values)
        elif name in IGNORED:
            self.draft.ignored.append(name)
            self.draft.stated.append(self._written(name, at, end))
            return len(self.code) if name in ("PROC", "EXTERN") else end
        else:
            raise BlockError(refusal(name))
        return end

    def _written(self, name: str, at: int, end: int) -> str:
        """Return a name with its arguments, without blanks."""
        return name + "".join(self.code[at:end].split())

    def _argument(self, text: str) -> Value:
        """Return the value of an argument; text that isn't arithmetic is returned as it is."""
        if not text:
            return None
        try:
            return evaluate(text, self.state.variables.__getitem__)
        except BlockError:
            return text.strip('"')

    # Cycles and frames

    def _cycle(self, name: str, values: list[Value]) -> None:
        self.draft.ignored.append(name)
        if name == "CYCLE800":
            self._swivel(read_swivel(values))
            return
        self.hole = read_hole(name, values)
        for code, message in self.hole.doubts:
            self.draft.note(Severity.WARNING, code, message)

    def _swivel(self, swivel: Swivel | None) -> None:
        state, draft = self.state, self.draft
        draft.frame = state.swivel_plane(swivel)
        if swivel is None:
            draft.cancels.append("swivelled plane (CYCLE800)")
            draft.tip_control = state.tip_control
        elif swivel.positions:
            self.stand_upright("CYCLE800", follows=swivel.follows)

    def _change_frame(self, name: str) -> None:
        draft = self.draft
        alone = not (draft.g or draft.m or self.machine or self.hole or draft.vector or draft.centre)
        if not alone or not set(draft.words) <= set(AXES) or draft.increments or draft.absolutes:
            raise BlockError(f"{name} takes numbers for X, Y, Z (ROT: or RPL) and no other words; correct it")
        draft.frame = self.state.change_frame(name, draft.words, self.plane_angle)
        if name in ("TRANS", "ROT") and not any(draft.words.values()) and not self.plane_angle:
            draft.cancels.append("shift, rotation, mirror and scaling (TRANS, ROT, MIRROR, SCALE)")
        draft.words = {}
        draft.ignored.append(name)

    # The block as a whole

    def _complete(self) -> None:
        draft, state = self.draft, self.state
        if self.transform is not None:
            self._change_frame(self.transform)
        elif self.apart:
            self._omit_move()
        elif "G4" in draft.g:
            self._dwell()
        if draft.centre and any(letter in draft.words for letter in _CENTRE):
            raise BlockError("the centre is partly absolute, partly incremental; write I, J, K all alike")
        self.end_positioning()
        called = self.hole is not None
        if self.modal_call:
            draft.cancels += [] if self.hole else ["modal cycle (MCALL)"]
            state.hole, self.hole = self.hole, None
            draft.ignored.append("MCALL")
        if self.machine:
            draft.g.append("G53")
        elif not called and any(letter in draft.words for letter in AXES):
            self.hole = state.hole
        state.remember(draft.words, draft.increments, draft.absolutes)
        if draft.vector:
            state.angles.clear()

    def _dwell(self) -> None:
        words = self.draft.words
        if set(words) != {"F"}:
            raise BlockError("G4 takes F in seconds, in its own block; write it like that")
        words["P"] = words.pop("F")

    def _omit_move(self) -> None:
        """Omit working area limits (G25, G26) and moves to fixed points of the machine (G74, G75)."""
        draft = self.draft
        if "G74" in draft.ignored or "G75" in draft.ignored:
            draft.note(
                Severity.NOTE,
                "fixed-point-left-out",
                "G74 and G75 go to fixed points of the machine; these moves aren't in the path",
            )
        draft.words = {}
