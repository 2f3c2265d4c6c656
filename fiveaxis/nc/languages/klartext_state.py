"""Vocabulary of Heidenhain Klartext, modal state of a program, and the base of its blocks.

The vocabulary, of what has no effect on the path and what is refused, is after the *User's Manual Klartext
Programming* of the TNC 640 (Heidenhain 892903-29) and of the iTNC 530 (737759-23). A line that matches
nothing here and doesn't consist of words is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Array
from fiveaxis.nc.languages.block import (
    IS_CYCLE,
    IS_JUMP,
    NUMBER,
    Block,
    BlockError,
    Plane,
    put_word,
    reasons,
)
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.klartext_cycles import Cycle
from fiveaxis.nc.languages.planes import CoordinateState, Statement, turns

VALUE = rf"(?:{NUMBER}|[+-]?Q[LR]?[0-9]+)(?![0-9.])"

_AXIS = re.compile(rf"\s*(I?)([XYZABCUVW]) ?({VALUE})")

# Beginnings of lines without effect on the path.
IGNORED_LINES = re.compile(
    r"\*|BLK FORM|TOOL DEF|STOP\b|SEL (?:CORR-)?TABLE|FUNCTION MODE MILL|FUNCTION RESET (?!TCPM)[A-Z]+"
    r"|FUNCTION (?:S-PULSE|FEED|COUNT|DCM|FIXTURE|LIFTOFF|STRLEN|CORRDATA RESET|PROG PATH OFF|AFC)\b"
    r"|FN ?1[56] ?:|FUNCTION PROG PATH IS TCP|MONITORING|QS[0-9]+ ?= ?\"[^\"]*\"$"
)

_EXTRA = "generates moves, which isn't supported; post L, C and CR"
_TURN = "sets a coordinate system that isn't supported; post PLANE SPATIAL"
_SYSTEM = "reads data of the control, which the program doesn't contain; write the number"

# The first pattern that matches the beginning of a line gives the reason.
REFUSED_LINES = reasons(
    (r"CALL LBL|CALL PGM", "takes a number or a name, and REP a number; correct it"),
    (r"PGM CALL|CALL SELECTED|SEL PGM|CALL|IF\b", IS_JUMP),
    (r"FN ?(?:9|1[012]) ?:", IS_JUMP),
    (r"CYCL CALL PAT|CYCL DEF|TCH PROBE|PATTERN DEF|SEL PATTERN|CONTOUR DEF|SEL CONTOUR", IS_CYCLE),
    (r"RND|CHF|APPR|DEP|CT\b|FPOL|FL\b|FC\b|FLT|FCT|FSELECT|SPL", _EXTRA),
    (r"PLANE|TRANS", _TURN),
    (r"FN|SYSREAD|QS", _SYSTEM),
    (r"FUNCTION (?:TURNDATA|MODE TURN|PARAX|POLARKIN|PROG PATH)", "changes what the words mean"),
)

# M words that change the path or the meaning of other words.
REFUSED_M = {
    103: "reduces the feed of plunging moves, which isn't supported; write the feeds",
    112: "rounds the path, which isn't supported; post without it",
    114: "compensates the tilted axes as on older controls; post with M128",
    118: "superimposes handwheel moves; post without it",
    144: "contains the tilted axes in the positions; post with M128",
    130: "means positions in untilted coordinates, which isn't supported; write PLANE RESET before",
    **dict.fromkeys((200, 201, 202, 203, 204), "controls a laser, which isn't supported; post for a mill"),
}

END_M = (2, 30)

# inch/min: unit of F in inch programs (TNC 640 and TNC7 user's manuals, feed rate F).
INCH_FEED = 0.1

# Numbers of cycles that only set up the control.
IGNORED_CYCLES = frozenset((13, 32, 239, 247, 332))


def refusal(line: str) -> str:
    """Return the reason why a line is refused."""
    for pattern, reason in REFUSED_LINES:
        found = pattern.match(line)
        if found is not None:
            return f"{found[0]} {reason}"
    first = line.split(maxsplit=1)[0][:20]
    return f"{first!r} begins no supported line; post the program with L, LN, CC, C, CR, LP and CP"


@dataclass
class State(CoordinateState):
    """Modal state of the control.

    Methods raise BlockError for what the program leaves undetermined, or what isn't supported.

    Program coordinates are shifted by the datum shift, rotated by PLANE, shifted again by a datum shift that
    follows PLANE, and rotated by cycle 10, in this order (coordinate systems W-CS, WPL-CS and I-CS of the
    TNC 640 manual).

    Parameters
    ----------
    unit : of BEGIN PGM; empty before
    parameters : values of the Q parameters
    tool_feed, speed : of the last TOOL CALL, for F AUTO and taps
    feed : F in force, restored after a drilled hole
    per_revolution : whether F is per revolution (M136)
    cycle : drilling cycle that CYCL CALL, M99 and M89 call
    drilling : whether every positioning calls it (M89)
    preset : of the last CYCL DEF 247
    from_table : whether the datum is shifted by a table, whose values only the control knows
    spatial : A, B and C, deg, if FUNCTION TCPM takes them as spatial angles (AXIS SPAT); else None
    now : last value of each axis word in the frame in force, if known
    pole : X and Y of the last CC
    datum, tilt, shift, spin : the four parts of the frame
    at_datum : letters whose datum shift the program has set to 0
    """

    unit: str = ""
    parameters: dict[str, float] = field(default_factory=dict)
    tool_feed: float | None = None
    speed: float | None = None
    feed: float | None = None
    per_revolution: bool = False
    cycle: Cycle | None = None
    drilling: bool = False
    preset: str = ""
    from_table: bool = False
    spatial: dict[str, float] | None = None
    now: dict[str, float] = field(default_factory=dict)
    pole: tuple[float, float] | None = None
    datum: Array = field(default_factory=lambda: np.zeros(3))
    tilt: Array = field(default_factory=lambda: np.eye(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))
    spin: float = 0.0
    at_datum: set[str] = field(default_factory=set)

    @property
    def clearance(self) -> float | None:
        """Height from which the cycle in force feeds down; None without one."""
        hole = None if self.cycle is None else self.cycle.hole(self.speed, 1.0)
        return None if hole is None else hole.near

    def drill(self, line: int) -> Iterator[Block]:
        """Yield the moves of the hole at the present position, then restore the feed that was in force."""
        if self.cycle is None:
            raise BlockError("calls a cycle, and none is defined; write CYCL DEF before")
        if self.per_revolution:
            raise BlockError("a cycle under M136 isn't supported; write M137 before")
        hole = self.cycle.hole(self.speed, 1.0 / INCH_FEED if self.unit == "INCH" else 1.0)
        if hole is None:
            return
        for word, words in hole.moves("Z"):
            yield Block(line, (word,), (), words, drills=True)
        self.now["Z"] = hole.back
        if self.feed is not None:
            yield Block(line, words={"F": self.feed})

    @property
    def is_tilted(self) -> bool:
        """Whether PLANE rotates the coordinates."""
        return not np.array_equal(self.tilt, np.eye(3))

    def frame(self, word: str) -> Plane:
        """Return the combined frame, set by `word`; positions known in the frame before are discarded."""
        self.now.clear()
        self.pole = None
        plane = Plane(self.datum, self.tilt).then(Plane(self.shift, turns("Z", [self.spin])))
        return plane.by(word)

    def shift_datum(self, words: Mapping[str, float], increments: str) -> None:
        """Shift the datum along axes of the workpiece, or of the tilted plane if there is one."""
        if self.spin:
            raise BlockError("a datum shift while cycle 10 rotates isn't supported; reset cycle 10 before")
        if self.is_tilted and self.datum.any():
            raise BlockError(
                "a datum shift in a tilted plane, with one from before the plane in force, isn't supported; "
                "write PLANE RESET before"
            )
        self.at_datum -= words.keys()
        self.at_datum |= {c for c, value in words.items() if not value and c not in increments}
        part = self.shift if self.is_tilted else self.datum
        for letter, value in words.items():
            column = "XYZ".index(letter)
            part[column] = value + (part[column] if letter in increments else 0.0)

    def tilt_plane(self, rotation: Array) -> None:
        """Tilt the working plane, unless the one before is shifted or rotated."""
        if self.shift.any() or self.spin:
            raise BlockError("a new plane while the last one is shifted or rotated; reset that before")
        self.tilt = rotation

    def remember(self, words: Mapping[str, float], increments: str = "") -> None:
        """Update the axis positions by a block's words."""
        if not increments:
            self.now.update(words)
            return
        for letter, value in words.items():
            if letter not in increments:
                self.now[letter] = value
            elif letter in self.now:
                self.now[letter] += value

    def position(self) -> tuple[float, float]:
        """Return X and Y of the tool."""
        if "X" not in self.now or "Y" not in self.now:
            raise BlockError("X and Y of the position before aren't in the program yet; write them")
        return self.now["X"], self.now["Y"]

    def polar_position(self) -> tuple[float, float]:
        """Return radius and angle, deg, of the tool about the pole."""
        x, y = self.position()
        px, py = self.need_pole()
        return math.hypot(x - px, y - py), math.degrees(math.atan2(y - py, x - px))

    def need_pole(self) -> tuple[float, float]:
        """Return the pole of the last CC."""
        if self.pole is None:
            raise BlockError("there is no pole in these coordinates; write CC with X and Y before")
        return self.pole


class Line(Statement):
    """One block with its continuation lines: single blanks, decimal points."""

    state: State
    # A block to insert after this one, and whether it calls the cycle.
    after: Block | None = None
    calls: bool = False

    def value(self, text: str) -> float:
        """Evaluate a number, a Q parameter or arithmetic."""
        return evaluate(text, self.state.parameters.__getitem__)

    def turn_into_plane(self, word: str, *, follows: bool = False) -> None:
        """Turn the tool along the plane's Z; under TCP the control holds the tip meanwhile."""
        self.stand_upright(word, follows=follows or self.state.tip_control)
        self.draft.frame = self.state.frame(word)

    def switch_tcp(self, *, on: bool) -> None:
        """Switch TCP."""
        super().switch_tcp(on=on)
        self.state.spatial = None

    def axes_of(self, text: str) -> tuple[dict[str, float], str]:
        """Read a text of axis words only; return their values and the letters of increments."""
        words: dict[str, float] = {}
        increments, at = "", 0
        while at < len(text.rstrip()):
            found = _AXIS.match(text, at)
            if found is None:
                raise BlockError(f"{text[at:].strip()[:20]!r} isn't a word of an axis; correct it")
            increments += found[2] if found[1] else ""
            put_word(words, found[2], self.value(found[3]))
            at = found.end()
        return words, increments
