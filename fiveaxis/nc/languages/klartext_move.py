"""Klartext blocks of words: moves, and blocks of M words only."""

from __future__ import annotations

import math
import re

from fiveaxis.base import Severity
from fiveaxis.nc.languages.block import SPINDLE_M, Block, BlockError, m_number, put_word
from fiveaxis.nc.languages.klartext_state import END_M, REFUSED_M, VALUE, Line
from fiveaxis.nc.languages.planes import TCP, turns

_WORD = re.compile(
    rf"(?P<fast>F ?MAX)(?![A-Z0-9])|(?P<auto>F ?AUTO)|(?P<direction>DR ?[+-])|(?P<side>R[0LR+-])(?![0-9A-Z.])"
    rf"|(?P<retract>MB ?(?:MAX|{VALUE}))|(?P<axes>M138(?: +[ABCUVW])*)(?![0-9])"
    r"|(?P<reduced>M94(?: +[ABC](?= |$))*)(?![0-9.])"
    rf"|(?P<key>I?P[AR]|I?[XYZABCUVW]|[NT][XYZ]|LA|[FMSRT]) ?(?P<value>{VALUE})"
)
_FUNCTION = re.compile(r"(LN|LP|CP|CC|CR|L|C)(?: |$)|(L)(?=I?[XYZABCUVW][-+.0-9Q])")
MOVES = re.compile(
    r"(?:LN|LP|CP|CC|CR|L|C)(?: |$)|L?I?[XYZABCUVW] ?[-+.0-9Q]|[MSFR] ?[-+.0-9Q]|F ?MAX|R[0LR]"
)

# Q120 to Q122 hold the angles A, B and C that PLANE computes.
_PLANE_ANGLES = {"A": "Q120", "B": "Q121", "C": "Q122"}


class Move(Line):
    """A block of words."""

    function = direction = ""
    rapid = machine = omitted = follows_m128 = ends_tcp = False

    def read(self) -> None:
        """Read all words, then interpret them together."""
        self.polar: dict[str, float] = {}
        code, at = self.code, 0
        found = _FUNCTION.match(code)
        if found is not None:
            self.function, at = found[1] or found[2], found.end()
        while at < len(code):
            word = _WORD.match(code, at)
            if word is None:
                raise BlockError(_explain(code[at:]))
            self._take(word)
            at = word.end()
            while at < len(code) and code[at] == " ":
                at += 1
        self._complete()

    def _take(self, word: re.Match[str]) -> None:
        draft, state = self.draft, self.state
        kind = word.lastgroup
        if kind == "fast":
            self.rapid = True
        elif kind == "auto":
            if state.tool_feed is None:
                raise BlockError("F AUTO is the feed of TOOL CALL, and none was given; write F")
            put_word(draft.words, "F", state.tool_feed)
        elif kind == "direction":
            self.direction = word[0][-1]
        elif kind == "side":
            if word[0] != "R0":
                raise BlockError(
                    f"{word[0]} offsets the path by the tool radius; post the offset path with R0"
                )
        elif kind in ("retract", "axes"):
            draft.ignored.append("M138" if kind == "axes" else "MB")
            draft.stated.append(word[0])
        elif kind == "reduced":
            draft.reduced = word[0][len("M94") :].replace(" ", "") or "ABC"
            draft.ignored.append("M94")
        elif self.follows_m128 and word["key"] == "F":
            draft.ignored.append("M128 F")  # feed of the compensating moves, not of the path
        else:
            self._take_value(word["key"], word["value"])
        self.follows_m128 = word["key"] == "M" and re.fullmatch(r"\+?0*128", word["value"]) is not None

    def _take_value(self, key: str, text: str) -> None:
        draft = self.draft
        letter = key[-1]
        if letter in _PLANE_ANGLES and text.lstrip("+") == _PLANE_ANGLES[letter]:
            draft.ignored.append(_PLANE_ANGLES[letter])
            self.turn_into_plane(_PLANE_ANGLES[letter])
            return
        value = self.value(text)
        if key == "M":
            self._take_m(value)
        elif key == "R" and self.function != "CR":
            raise BlockError(f"R{value:g} belongs to CR; correct it")
        elif key in ("S", "T", "LA"):
            draft.ignored.append(key)
            draft.stated.append(f"{key}{value:g}")
        elif key[0] == "N" or (key[0] == "T" and len(key) == 2):
            put_word(draft.normal if key[0] == "N" else draft.vector, letter, value)
        elif key in ("PA", "PR", "IPA", "IPR"):
            if self.function not in ("LP", "CP"):
                raise BlockError(f"{key} belongs to LP and CP; correct it")
            put_word(self.polar, key, value)
        else:
            draft.increments += letter if key[0] == "I" else ""
            put_word(draft.words, letter, value)

    def _take_m(self, value: float) -> None:
        draft = self.draft
        number = m_number(value)
        if number in REFUSED_M:
            raise BlockError(f"M{number} {REFUSED_M[number]}")
        if number in END_M or number in SPINDLE_M:
            draft.m.append(f"M{number}")
        elif number in (128, 129):
            draft.stated.append(f"L M{number}")
            if number == 128:
                self.switch_tcp(on=True)
            self.ends_tcp = number == 129
        elif number == 91:
            self.machine = True
        elif number in (136, 137):
            self.state.per_revolution = number == 136
            draft.g.append("G95" if number == 136 else "G94")
        elif number in (89, 99):
            # M99 in the last positioning ends what M89 began.
            self.state.drilling = number == 89
            self.calls = True
            draft.ignored.append("CYCL CALL")
        else:
            draft.ignored.append(f"M{number}")
            self.omitted = self.omitted or number in (92, 140)
            if number in (126, 127):
                draft.shorter = number == 126
                draft.cancels.append("direction of rotary axes (M126)")

    # The move as a whole

    def _complete(self) -> None:
        draft, state = self.draft, self.state
        if self.function == "CC":
            self._set_pole()
            return
        if self.function in ("LP", "CP"):
            self._place_polar()
        if self.omitted:
            self._omit_move()
        if state.spatial is not None and not self.machine:
            self._read_spatial(state.spatial)
        if self.function == "LN":
            self._follow_normal()
        self.end_positioning()
        axes = [letter for letter in draft.words if letter != "F"]
        if axes or draft.vector or self.function in ("C", "CR", "CP"):
            self._name_motion()
        elif self.machine:
            draft.ignored.append("M91")
        if self.ends_tcp:
            self._end_tcp()
        state.feed = draft.words.get("F", state.feed)
        self.calls = self.calls or (state.drilling and bool(axes))
        if not self.machine:
            state.remember({c: draft.words[c] for c in axes if c != "R"}, draft.increments)

    def _name_motion(self) -> None:
        draft, state = self.draft, self.state
        if self.function in ("C", "CR", "CP"):
            if self.direction not in ("+", "-"):
                raise BlockError(f"{self.function} needs its direction, DR+ or DR-; write it")
            if self.rapid or self.machine:
                raise BlockError(f"{self.function} is a move at feed in program coordinates; correct it")
            draft.g.append("G3" if self.direction == "+" else "G2")
            if self.function == "CR" and "R" not in draft.words:
                raise BlockError("CR needs its radius R; write it")
            if self.function != "CR":
                draft.centre = dict(zip("XY", state.need_pole(), strict=True))
            return
        draft.g.append("G0" if self.rapid else "G1")
        if self.machine:
            draft.g.append("G53")
            state.now.clear()

    def _set_pole(self) -> None:
        """Read CC: the pole is at its words, or at the tool if there are none."""
        words, state = self.draft.words, self.state
        if not set(words) <= {"X", "Y"} or self.draft.g or self.draft.m:
            raise BlockError("CC takes X and Y only; correct it")
        if not words:
            state.pole = state.position()
        else:
            before = dict(zip("XY", state.pole, strict=True)) if state.pole is not None else {}
            pole = []
            for letter in "XY":
                value = words.get(letter, before.get(letter))
                if value is None:
                    raise BlockError(f"the pole has no {letter} yet; write it")
                if letter in self.draft.increments:
                    value += state.position()["XY".index(letter)]
                pole.append(value)
            state.pole = (pole[0], pole[1])
        self.draft.words, self.draft.increments = {}, ""
        self.draft.ignored.append("CC")

    def _place_polar(self) -> None:
        """Compute X and Y from radius and angle about the pole, and the turns of a helix."""
        draft, state, polar = self.draft, self.state, self.polar
        twice = {"PA", "IPA"} <= set(polar) or {"PR", "IPR"} <= set(polar)
        if twice or "X" in draft.words or "Y" in draft.words:
            raise BlockError(f"{self.function} takes one radius and one angle; correct it")
        px, py = state.need_pole()
        known = "PR" in polar and "PA" in polar
        radius, angle = (0.0, 0.0) if known else state.polar_position()
        radius = polar.get("PR", radius) + polar.get("IPR", 0.0)
        angle = polar.get("PA", angle) + polar.get("IPA", 0.0)
        if self.function == "CP":
            sweep = polar.get("IPA", 0.0)
            if sweep and (sweep > 0.0) != (self.direction == "+"):
                raise BlockError(f"IPA{sweep:+g} contradicts DR{self.direction}; correct one of them")
            draft.turns = max(0, math.ceil(abs(sweep) / 360.0 - 1e-9) - 1)
        turn = math.radians(angle)
        draft.words |= {"X": px + radius * math.cos(turn), "Y": py + radius * math.sin(turn)}

    def _omit_move(self) -> None:
        """Omit moves that depend on the machine: M140 along the tool axis, M92 from the builder's datum."""
        draft = self.draft
        if "M140" in draft.ignored and any(letter in "XYZABC" for letter in draft.words):
            raise BlockError("M140 together with a move isn't supported; write it in its own block")
        draft.words, draft.increments = {}, ""
        self.state.now.clear()
        draft.note(
            Severity.NOTE,
            "fixed-point-left-out",
            "M140 and M92 go to positions that depend on the machine; they aren't in the path",
        )

    def _read_spatial(self, angles: dict[str, float]) -> None:
        """Read A, B and C as rotations about X, Y and Z of the workpiece: a direction on any machine."""
        draft = self.draft
        given = [letter for letter in "ABC" if letter in draft.words]
        for letter in given:
            value = draft.words.pop(letter)
            angles[letter] = value + (angles.get(letter, 0.0) if letter in draft.increments else 0.0)
            draft.increments = draft.increments.replace(letter, "")
        if given and len(angles) < 3:
            raise BlockError("the first angles after AXIS SPAT must be all three, A, B and C; write them")
        if given:
            x, y, z = turns("ZYX", [angles["C"], angles["B"], angles["A"]])[:, 2]
            draft.vector = {"X": float(x), "Y": float(y), "Z": float(z)}

    def _follow_normal(self) -> None:
        """Point the tool along the normal if TCP is on and the block gives no other orientation."""
        draft = self.draft
        turned = any(letter in "ABC" for letter in draft.words)
        if draft.normal and not draft.vector and not turned and self.state.tip_control:
            draft.vector = dict(draft.normal)
            draft.note(
                Severity.NOTE,
                "axis-from-normal",
                "LN gives a normal and no tool direction: under M128 the tool points along the normal",
            )

    def _end_tcp(self) -> None:
        """Read M129, which takes effect at the end of its block; M128 does at the start."""
        if self.draft.words:
            self.after = Block(self.draft.line, tip_control=False)
        else:
            self.draft.tip_control = False
            self.draft.cancels.append(TCP)
        self.state.tip_control, self.state.spatial, self.state.positioned = False, None, False


def _explain(rest: str) -> str:
    """Return the reason why the rest of a block doesn't begin with a word."""
    if re.match("F ?[UZT]", rest):
        return f"{rest[:2]} is a feed per revolution or tooth, or a time, which isn't supported; write F"
    if re.match(r"E[-+]?[0-9]", rest):
        return f"{rest[:20]!r} would be an exponent, which Klartext numbers don't have; write the number out"
    return f"{rest[:20]!r} isn't a word; correct it"
