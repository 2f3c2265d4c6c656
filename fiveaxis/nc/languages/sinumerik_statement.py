"""One block of a Sinumerik program, read word by word."""

from __future__ import annotations

import re

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Severity
from fiveaxis.nc.languages.block import SPINDLE_M, Block
from fiveaxis.nc.languages.draft import Draft
from fiveaxis.nc.languages.expressions import ExpressionError, evaluate, evaluate_prefix
from fiveaxis.nc.languages.planes import Plane, forget_place, turns
from fiveaxis.nc.languages.sinumerik_cycles import (
    HOLES,
    CycleError,
    Hole,
    Swivel,
    Value,
    read_hole,
    read_swivel,
)
from fiveaxis.nc.languages.sinumerik_state import ROTARY, State
from fiveaxis.nc.languages.sinumerik_words import (
    IGNORED,
    IGNORED_G,
    IGNORED_SETTINGS,
    MACHINE_COORDINATES,
    REFUSED_G,
    SAME_IN_ISO,
    refusal,
)
from fiveaxis.nc.source import Source

_ASSIGN = re.compile(r"([A-Z_$][A-Z_][A-Z0-9_]*|[A-Z][0-9]*)\s*(\[[^\]\"]*\])?\s*=(?!=)")
_WORD = re.compile(r"([A-Z])\s?([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?![0-9.])")
_NAME = re.compile(r"[A-Z_$][A-Z0-9_]*")
_LABEL = re.compile(r"[A-Z_][A-Z0-9_]*:(?!=)")
_WAY = re.compile(r"\s*(IC|AC|DC|ACP|ACN)\s*\(")
_CLOSE = re.compile(r"\s*\)")
_TEXT = re.compile(r'\s*"[^"]*"')
_TYPE = re.compile(r"\s*(?:REAL|INT|BOOL|(CHAR|STRING|AXIS)\s*(?:\[[^\]]*\])?)(?![A-Z0-9_])")
_DECLARED = re.compile(r"\s*([A-Z_][A-Z0-9_]*)\s*(?:\[[^\]]*\])?\s*(?:=\s*([^,]*))?(?:,|$)\s*")
_BLANK = re.compile(r"\s*")

_LINEAR, _CENTRE = "XYZ", {"I": "X", "J": "Y", "K": "Z"}
_TOOL_AXIS = {"G17": "Z", "G18": "Y", "G19": "X"}
_VECTORS = {"A3": "X", "B3": "Y", "C3": "Z"}
_NORMALS = {"A5": "X", "B5": "Y", "C5": "Z"}
_END = {2: "M2", 17: "M30", 30: "M30"}
_TRANSFORMS = ("TRANS", "ATRANS", "ROT", "AROT")
_LONGEST_NUMBER, _LONGEST_SHOWN = 40, 60

_NO_WORDS = {
    "L": "calls a subprogram, which isn't run; post one program with all moves",
    "P": "repeats a subprogram, which isn't run; post one program with all moves",
    "E": "isn't an axis, and numbers have no exponent here; write it out",
    **dict.fromkeys("NOQR", "is no word here; take it out"),
}


class Statement:
    """One block, read from left to right and then as a whole.

    Parameters
    ----------
    source, line : where it stands
    code : in capitals, without block number and comment
    state : what is in force before it, and after `read`
    """

    def __init__(self, source: Source, line: int, code: str, state: State) -> None:
        self.code, self.state, self.draft = code, state, Draft(source, line)
        self.machine = self.modal_call = self.apart = False
        self.transform: str | None = None
        self.plane_angle: float | None = None
        self.hole: Hole | None = None
        self.before: Block | None = None

    def read(self) -> None:
        """Read all words, and settle what they mean together.

        Raises
        ------
        ToolpathError
            With file, line and text: whatever isn't read.
        """
        label = _LABEL.match(self.code)
        at = 0
        if label is not None:
            self.draft.ignored.append("label")
            at = label.end()
        at = self._skip(at)
        while at < len(self.code):
            at = self._skip(self._take(at))
        self._complete()

    def _fail(self, fact: str) -> ToolpathError:
        source, line = self.draft.source, self.draft.line
        return source.error(f"{source.lines[line - 1].strip()[:_LONGEST_SHOWN]!r}: {fact}", line)

    def _skip(self, at: int) -> int:
        blank = _BLANK.match(self.code, at)
        return at if blank is None else blank.end()

    def _take(self, at: int) -> int:
        """Read what begins at a place; give where it ends."""
        found = _ASSIGN.match(self.code, at)
        if found is not None:
            return self._assign(found[1], found[2], found.end())
        found = _WORD.match(self.code, at)
        if found is not None:
            if len(found[2]) > _LONGEST_NUMBER:
                raise self._fail(f"{found[0][:_LONGEST_NUMBER]}… isn't a number that a control takes")
            self._word(found[1], float(found[2]))
            return found.end()
        found = _NAME.match(self.code, at)
        if found is None:
            raise self._fail(f"{self.code[at : at + 20]!r} isn't a word; correct it")
        return self._name(found[0], found.end())

    # Values behind ``=``

    def _assign(self, name: str, index: str | None, at: int) -> int:
        """Read a value behind ``=`` and give it to its name."""
        text = _TEXT.match(self.code, at)
        if text is not None:
            if name != "T" and name not in self.state.texts:
                raise self._fail(f"{name} is given a text, which isn't read; take it out")
            self.draft.ignored.append(name)
            if name == "T":
                self.draft.tool = f"T={text[0].strip()}"
            return text.end()
        way = _WAY.match(self.code, at)
        value, end = self._value(at if way is None else way.end())
        if way is not None:
            close = _CLOSE.match(self.code, end)
            if close is None:
                raise self._fail(f"the bracket of {way[1]} isn't closed")
            end = close.end()
        if name in IGNORED_SETTINGS or (len(name) > 1 and name[0] in "SMHTD" and name[1:].isdigit()):
            self.draft.ignored.append(name)
        elif self.apart and name[0] in "XYZABCUVW" and name[1:].isdigit():
            pass  # G74 X1=0: a machine axis on its way to a point that the program doesn't know
        elif index is not None and name[0] != "$":
            raise self._fail(f"{name}{index} is a field, which isn't read; write the number")
        else:
            self._set(name, value, None if way is None else way[1])
        return end

    def _value(self, at: int) -> tuple[float, int]:
        try:
            return evaluate_prefix(self.code, at, self.state.variables.__getitem__)
        except ExpressionError as fault:
            raise self._fail(str(fault)) from None

    def _set(self, name: str, value: float, way: str | None) -> None:
        draft = self.draft
        if len(name) == 1:
            if name in _CENTRE and way == "AC":
                draft.put(draft.centre, _CENTRE[name], value)
            else:
                self._word(name, value, way)
        elif way is not None:
            raise self._fail(f"{way} belongs to axes and centres, not to {name}; write the number")
        elif name in _VECTORS:
            draft.put(draft.vector, _VECTORS[name], value)
        elif name in _NORMALS:
            draft.put(draft.normal, _NORMALS[name], value)
        elif name == "CR":
            draft.put(draft.words, "R", value)
        elif name == "TURN":
            self._set_turns(value)
        elif name == "RPL" and self.transform in ("ROT", "AROT"):
            self.plane_angle = value
        elif name in ("A4", "B4", "C4") or (name in ("OFFN", "RNDM") and value == 0.0):
            draft.ignored.append(name)
        elif name in self.state.variables or name[0] == "_" or re.fullmatch("R[0-9]+", name):
            self.state.variables[name] = value
            draft.ignored.append("=")
        else:
            raise self._fail(refusal(name))

    def _set_turns(self, value: float) -> None:
        if value != int(value) or not 0 <= value <= 999:
            raise self._fail(f"TURN={value:g}; a helix makes 0 to 999 more turns")
        self.draft.turns = int(value)

    # Words of a letter and a number

    def _word(self, letter: str, value: float, way: str | None = None) -> None:
        draft = self.draft
        if way is not None and letter not in "XYZABCUVWIJK":
            raise self._fail(f"{way} belongs to axes and centres, not to {letter}; write the number")
        if letter in _NO_WORDS:
            raise self._fail(f"{letter}{value:g} {_NO_WORDS[letter]}")
        if letter == "G":
            self._g(value)
        elif letter == "M":
            self._m(value)
        elif letter in _CENTRE:
            draft.put(draft.words, letter, value)
        else:
            if way in ("DC", "ACP", "ACN"):
                value = self._turned(letter, value, way)
            if way == "IC":
                draft.increments += letter
            elif way is not None:
                draft.absolutes += letter
            draft.put(draft.words, letter, value)

    def _turned(self, letter: str, value: float, way: str) -> float:
        if letter not in ROTARY:
            raise self._fail(f"{way} is for rotary axes, and {letter} is none")
        if not 0.0 <= value <= 360.0:
            raise self._fail(f"{letter}={way}({value:g}) must be an angle from 0 to 360 deg")
        return self.state.turned(letter, value, way)

    def _g(self, number: float) -> None:
        draft, word = self.draft, f"G{number:g}"
        if number in REFUSED_G:
            raise self._fail(f"{word} {REFUSED_G[int(number)]}")
        if number in MACHINE_COORDINATES:
            self.machine = True
        elif number in (25, 26, 74, 75):
            self.apart = True
            draft.ignored.append(word)
        elif number == 500 or 505 <= number <= 599:
            self._use_zero(word)
            draft.ignored.append(word)
        elif number in IGNORED_G:
            draft.ignored.append(word)
        elif number in SAME_IN_ISO:
            self._iso(SAME_IN_ISO[int(number)])
            if number == 70:
                draft.note(
                    Severity.NOTE,
                    "feed-unit-assumed",
                    "G70 makes lengths inch, and F is taken as inch/min too; where the control counts feeds "
                    "in mm all the same, G700 says so",
                )
        else:
            raise self._fail(f"{word} isn't read; post the program without it")

    def _iso(self, word: str) -> None:
        state = self.state
        if word in ("G0", "G1", "G2", "G3"):
            state.motion = word
        elif word in _TOOL_AXIS:
            state.tool_axis = _TOOL_AXIS[word]
        elif word in ("G90", "G91"):
            state.incremental = word == "G91"
        elif word in ("G54", "G55", "G56", "G57"):
            self._use_zero(word)
        self.draft.g.append(word)

    def _use_zero(self, word: str) -> None:
        before = self.state.zero or "where the program began"
        if not self.state.change_zero(word):
            raise self._fail(
                f"{word} moves the program's zero away from {before}, and only the control knows how far; "
                "write one program for each"
            )

    def _m(self, number: float) -> None:
        if number != int(number):
            raise self._fail(f"M{number:g} isn't an M word; correct it")
        if number in _END:
            self.draft.m.append(_END[int(number)])
        elif number in SPINDLE_M:
            self.draft.m.append(f"M{number:g}")
        else:
            # No M word moves an axis here, and numbers that mean TCP or calls in ISO are the builder's own.
            self.draft.ignored.append(f"M{number:g}")

    # Words of several letters

    def _name(self, name: str, at: int) -> int:
        """Read a word of several letters and its brackets; give where they end."""
        if name == "DEF":
            self._declare(self.code[at:])
            return len(self.code)
        values, end = self._values(at) if self.code[at : at + 1] == "(" else ([], at)
        if name in ("TRAORI", "TRAFOOF"):
            self.state.tip_control = self.draft.tip_control = name == "TRAORI"
            self.state.positioned = False
        elif name == "SUPA":
            self.machine = True
        elif name in _TRANSFORMS:
            self.transform = name
        elif name in ("SCALE", "MIRROR") and not self.code[at:].strip():
            self.transform = "TRANS"  # each of them alone deletes the whole frame
        elif name == "MCALL":
            self.modal_call = True
        elif name == "RET":
            self.draft.m.append("M30")
        elif name in HOLES or name == "CYCLE800":
            self._cycle(name, values)
        elif name in IGNORED:
            self.draft.ignored.append(name)
            return len(self.code) if name in ("PROC", "EXTERN") else end
        else:
            raise self._fail(refusal(name))
        return end

    def _values(self, at: int) -> tuple[list[Value], int]:
        """Read what stands between brackets, separated by commas, and give where they end."""
        parts, begin, end, depth, quoted = [], at + 1, at, 0, False
        for end in range(at, len(self.code)):
            sign = self.code[end]
            if sign == '"':
                quoted = not quoted
            elif not quoted:
                depth += (sign == "(") - (sign == ")")
                if depth == 0:
                    break
                if sign == "," and depth == 1:
                    parts.append(self.code[begin:end])
                    begin = end + 1
        if depth:
            raise self._fail("a bracket isn't closed")
        parts.append(self.code[begin:end])
        return [self._argument(part.strip()) for part in parts], end + 1

    def _argument(self, text: str) -> Value:
        """Read one value; what isn't arithmetic stays a text, for functions that don't count."""
        if not text:
            return None
        try:
            return evaluate(text, self.state.variables.__getitem__)
        except ExpressionError:
            return text.strip('"')

    def _declare(self, text: str) -> None:
        """Read ``DEF REAL a, b=2``: what is declared begins with 0."""
        kind = _TYPE.match(text)
        if kind is None:
            raise self._fail("DEF is read with REAL, INT, BOOL, CHAR, STRING or AXIS; correct it")
        at = kind.end()
        while at < len(text):
            found = _DECLARED.match(text, at)
            if found is None:
                raise self._fail(f"{text[at : at + 20].strip()!r} isn't a name that can be declared")
            if kind[1]:
                self.state.texts.add(found[1])
            else:
                self.state.variables[found[1]] = self._initial((found[2] or "0").strip())
            at = found.end()
        self.draft.ignored.append("DEF")

    def _initial(self, text: str) -> float:
        if text in ("TRUE", "FALSE"):
            return float(text == "TRUE")
        try:
            return evaluate(text, self.state.variables.__getitem__)
        except ExpressionError as fault:
            raise self._fail(str(fault)) from None

    # Cycles and frames

    def _cycle(self, name: str, values: list[Value]) -> None:
        draft = self.draft
        draft.ignored.append(name)
        try:
            if name == "CYCLE800":
                self._swivel(read_swivel(values))
                return
            self.hole = read_hole(name, values)
        except CycleError as fault:
            raise self._fail(str(fault)) from None
        for code, message in self.hole.doubts:
            draft.note(Severity.WARNING, code, message)

    def _swivel(self, swivel: Swivel | None) -> None:
        """Lay the plane of CYCLE800; a new one, and none, delete the frames of TRANS and ROT."""
        state, draft = self.state, self.draft
        if swivel is not None and swivel.additive:
            state.swivel = state.swivel.then(state.program).then(swivel.plane)
        else:
            state.swivel = Plane() if swivel is None else swivel.plane
        state.program = Plane()
        draft.frame = state.frame("CYCLE800")
        if swivel is None:
            draft.tip_control = state.tip_control
        elif swivel.positions:
            # The control turns its rotary axes until the tool stands along the plane's Z, whatever they are.
            draft.tip_control, draft.vector = True, {"Z": 1.0}
            if not swivel.follows:
                self.before = forget_place(draft.line, "CYCLE800")
        state.positioned = swivel is not None and swivel.positions

    def _change_frame(self, name: str) -> None:
        """Read TRANS, ATRANS, ROT or AROT; those with A add to the frame, the others replace it."""
        draft, state, words = self.draft, self.state, self.draft.words
        alone = not (draft.g or draft.m or self.machine or self.hole or draft.vector or draft.centre)
        if not alone or not set(words) <= set(_LINEAR) or draft.increments or draft.absolutes:
            raise self._fail(
                f"{name} is read with numbers for X, Y, Z (ROT: or RPL), in a block of its own; write it so"
            )
        x, y, z = (words.get(c, 0.0) for c in _LINEAR)
        if name in ("TRANS", "ATRANS"):
            step = Plane(origin=np.array([x, y, z]))
        elif self.plane_angle is not None:
            step = Plane(rotation=turns(state.tool_axis, [self.plane_angle]))
        else:
            # RPY angles, as controls are delivered (machine data 10600 = 1): about Z, then Y', then X''.
            step = Plane(rotation=turns("ZYX", [z, y, x]))
        state.program = step if name in ("TRANS", "ROT") else state.program.then(step)
        draft.frame = state.frame(name)
        draft.words = {}
        draft.ignored.append(name)

    # The block as a whole

    def _complete(self) -> None:
        draft, state = self.draft, self.state
        if self.transform is not None:
            self._change_frame(self.transform)
        elif self.apart:
            self._leave_out()
        elif "G4" in draft.g:
            self._dwell()
        if draft.centre and any(letter in draft.words for letter in _CENTRE):
            raise self._fail("the centre is half absolute, half an increment; write I, J, K all in one way")
        if state.positioned and any(letter in draft.words for letter in ROTARY):
            # From here on the program names its angles again, and its positions are what they were before.
            state.positioned, draft.tip_control = False, state.tip_control
        called = self.hole is not None
        if self.modal_call:
            state.hole, self.hole = self.hole, None
            draft.ignored.append("MCALL")
        if self.machine:
            draft.g.append("G53")
        elif any(letter in draft.words for letter in _LINEAR):
            state.moved = True
            if not called:
                self.hole = state.hole
        state.remember(draft.words, draft.increments, draft.absolutes)
        if draft.vector:
            state.angles.clear()

    def _dwell(self) -> None:
        words = self.draft.words
        if set(words) != {"F"}:
            raise self._fail("G4 is read as a dwell of F seconds, in a block of its own; write it so")
        words["P"] = words.pop("F")

    def _leave_out(self) -> None:
        """Leave out limits of the working area, and ways to points that only the machine knows."""
        draft = self.draft
        if "G74" in draft.ignored or "G75" in draft.ignored:
            draft.note(
                Severity.NOTE,
                "fixed-point-left-out",
                "G74 and G75 go to points that only the machine knows; they aren't in the path",
            )
        draft.words = {}
