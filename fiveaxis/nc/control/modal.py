"""Meaning of G and M words, and modal state.

There are four kinds of words: those that act (`ACTING`), those that don't change the path (`HARMLESS`),
those that would change it and aren't supported (`REFUSED`), and all others: unknown G words are refused, and
M words are looked at in `fiveaxis.nc.control.machine_functions`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fiveaxis.model import Machine
from fiveaxis.nc.control.reading_rules import ControlRules
from fiveaxis.nc.control.technology import (
    DEFAULT_OFFSET,
    FEED_MODES,
    LENGTH_ON,
    NUMBERED_OFFSETS,
    WORK_OFFSETS,
    TechnologyReader,
    selected_offset,
)
from fiveaxis.nc.languages.block import Block, BlockError
from fiveaxis.nc.languages.iso import FRAME_WORDS, TIP_WORDS
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.units import Units
from fiveaxis.nc.writing.table_parts import Cycles
from fiveaxis.nc.writing.tables import Dialect

MOTION = ("G0", "G1", "G2", "G3")
UNIT = {"G20": "INCH", "G70": "INCH", "G21": "MM", "G71": "MM"}
# Axes of an arc's plane, in the order in which G3 turns.
PLANES = {"G17": "XY", "G18": "ZX", "G19": "YZ"}
# Drilling, boring and tapping: word -> whether the tool returns at feed. Pecking (G73, G83) is omitted, as is
# everything that doesn't move the tip (dwells, spindle orientation in G76 and G87, spindle reversal).
CYCLES = {
    **dict.fromkeys(("G73", "G81", "G82", "G83", "G86", "G88"), False),
    **dict.fromkeys(("G74", "G84", "G85", "G89"), True),
    **dict.fromkeys(("G76", "G87"), False),
}
# G92 shifts axes, G92.1 and G92.2 cancel the shifts.
G92_WORDS = frozenset(("G92", "G92.1", "G92.2"))
# Haas: the zero goes with the table, and X, Y, Z stay along the machine's axes.
TABLE_ZERO_WORDS = frozenset(("G254", "G255"))
LEVELS = ("G98", "G99")
# Word -> key of `ReadingRules` that it states.
_STATES = {
    **dict.fromkeys(PLANES, "plane"),
    **dict.fromkeys(("G90", "G91"), "positions"),
    **dict.fromkeys(FEED_MODES, "feed_mode"),
}

# Words of one group exclude each other in a block.
GROUPS: tuple[tuple[str, ...], ...] = (
    (*MOTION, *CYCLES),
    tuple(PLANES),
    tuple(UNIT),
    ("G90", "G91"),
    ("G90.1", "G91.1"),
    FEED_MODES,
    (*WORK_OFFSETS, *NUMBERED_OFFSETS),
    (*LENGTH_ON, "G49"),
    ("G4", "G10", "G28", "G30", *sorted(G92_WORDS)),
)

# Word -> why it doesn't move an axis or shift a position.
HARMLESS = {
    **dict.fromkeys(("G15", "G40", "G50", "G269"), "switches off what isn't supported when it is on"),
    **dict.fromkeys(("G140", "G174"), "switches TCP off if it is on"),
    "G80": "cancels a cycle, and the motion in force",
    **dict.fromkeys(("G43", "G49"), "adds the tool's length to Z, or ends that"),
    **dict.fromkeys(("G9", "G61", "G61.1", "G64"), "corners are read as programmed, without blending"),
    **dict.fromkeys(("G5.1", "G187"), "smoothing within the control's tolerance"),
    **dict.fromkeys(LEVELS, "return level of cycles"),
    "G97": "S in revolutions per minute",
    "G8": "look-ahead (Fanuc), or radius programming on a lathe (LinuxCNC): neither moves the tip",
}

# Word -> letters that are its parameters.
PARAMETERS = {
    "G4": "P",
    "G5.1": "PQR",
    "G8": "P",
    "G64": "PQ",
    "G187": "EP",
    "G43.4": "PQ",
    "G43.5": "PQ",
    **NUMBERED_OFFSETS,
    "G10": "LPQRIJ",
    "G30": "P",
    "M19": "PRQ",
    # LinuxCNC's outputs and inputs, and M words of its users.
    **dict.fromkeys(("M62", "M63", "M64", "M65"), "P"),
    **dict.fromkeys(("M66", "M67", "M68"), "PLEQ"),
    **{f"M{number}": "PQ" for number in range(100, 200)},
    **dict.fromkeys(CYCLES, "RPQIJKL"),
}

_RADIUS = "offsets the path by the tool radius; post the path of the tool centre"
_CURVE = "is a curve or a thread, which isn't supported; post G1, G2 and G3"
_PROBE = "moves until a probe touches, so its end isn't in the program; post without probing"
_SHIFT = "shifts, rotates or scales the coordinates, which isn't supported; post without it"
_CALL = "calls or ends a subprogram, which isn't run; post one program with all moves"
_USER = "switches to user-defined kinematics on LinuxCNC, which isn't supported; use M428 (TCP) or M429"

REFUSED = {
    **dict.fromkeys(("G41", "G42", "G41.1", "G42.1", "G41.2", "G42.2"), _RADIUS),
    **dict.fromkeys(("G5", "G5.2", "G5.3", "G6.2", "G33", "G33.1", "G33.2"), _CURVE),
    **dict.fromkeys(("G31", "G38.2", "G38.3", "G38.4", "G38.5"), _PROBE),
    **dict.fromkeys(("G7", "G16", "G50.1", "G51", "G51.1", "G54.2"), _SHIFT),
    **dict.fromkeys(("G68", "G68.1", "G92.3"), _SHIFT),
    **dict.fromkeys(
        ("G68.3", "G68.4"), "puts a plane where a parameter of the control says; post G68.2 X Y Z I J K"
    ),
    "G54.4": "applies the measured error of the workpiece, which only the control knows; post without it",
    **dict.fromkeys(("G65", "G66", "G67", "M96", "M97", "M98", "M198"), _CALL),
    "M430": _USER,
}

# Words of one kind of control, and what they do there; refused as any unknown word is.
UNSUPPORTED = {
    **dict.fromkeys(("G268", "G269"), "tilts the coordinates, or ends that (Haas)"),
    **dict.fromkeys(("G12.1", "G13.1", "G112", "G113"), "switches polar coordinates on or off (Fanuc, Haas)"),
    **dict.fromkeys(("G7.1", "G107"), "wraps the path around a cylinder (Fanuc, Haas)"),
    **dict.fromkeys(("G100", "G101"), "mirrors axes, or ends that (Haas)"),
    **dict.fromkeys(("G151", "G152"), "turns a rotary axis normal to the path in the plane (Fanuc)"),
}

ACTING = {
    *(word for group in GROUPS for word in group if word not in HARMLESS),
    *(*TIP_WORDS, *FRAME_WORDS, *TABLE_ZERO_WORDS, "G53"),
}


@dataclass
class Modes:
    """Modal words in force.

    Parameters
    ----------
    units : the length unit of the file
    motion : one of `MOTION` or `CYCLES`, None before the first and after G80
    plane : of arcs
    incremental : G91
    feed_mode : G93, G94 or G95
    feed : F in the unit of its mode, None before the first and after a change of mode
    feed_step : length units per minute of F1; 1 except for Heidenhain in inches
    technology : spindle, tool, offsets and coolant, line by line
    work_offset : in force
    to_initial : G98, cycles return to the initial level instead of R; None where nobody says it
    compensated : the control adds the tool's length to Z, by the rule of its language (`Language.length`)
    vectors : G43.5, I, J and K of a straight move are the tool direction
    absolute_centres : G90.1, I, J and K are the centre of an arc, not the way to it
    knows_motion : whether G0, G1 or another word of motion has been read
    rules : of the program's control
    control : whose program it is; None where nothing tells it
    """

    units: Units
    motion: str | None = None
    plane: str = "G17"
    incremental: bool = False
    feed_mode: str = "G94"
    feed: float | None = None
    feed_step: float = 1.0
    technology: TechnologyReader = field(default_factory=TechnologyReader)
    work_offset: str = DEFAULT_OFFSET
    to_initial: bool | None = True
    compensated: bool = False
    vectors: bool = False
    absolute_centres: bool = False
    knows_motion: bool = False
    rules: ControlRules = field(default_factory=ControlRules)
    control: Dialect | None = None

    @property
    def feed_scale(self) -> float:
        """Millimetres of a linear feed of 1, as returned by `pace`."""
        return MILLIMETRES[self.units.now] * self.feed_step

    def take(self, block: Block) -> None:
        """Apply the modal words of a block.

        `BlockError` or `ToolpathError` for an unsupported or unknown word, two of a group, mixed units, or F
        not above 0.
        """
        if block.g or block.m:
            self._require_read(block)
        if "G80" in block.g:
            self.motion = None  # in a head it cancels nothing
        for word in block.g:
            self._set(word, block)
        if block.feed_step is not None:
            self.feed_step = block.feed_step
        if block.work_offset:
            self.work_offset = block.work_offset
        before = self.technology.now
        self.technology.take(block)
        now = self.technology.now
        self._count_length(block, changed=(now.tool, now.loaded) != (before.tool, before.loaded))
        if "F" in block.words:
            self.feed = block.words["F"]
            if self.feed <= 0.0:
                raise BlockError(f"F{self.feed:g}: a feed must be above 0; correct it")

    def _count_length(self, block: Block, *, changed: bool) -> None:
        """Follow whether the control adds the tool's length; `changed`, whether the block changes the tool.

        G43, G49: RS274/NGC 3.5.10, B-64484EN 14.1. D: 6FC5398-1BP10-2BA0, where D0 adds none, and a tool
        change sets D1 (MD20270). TOOL CALL: TNC 640, where every tool has its length.
        """
        rule = self.technology.language.length
        if rule == "tool" and changed:
            self.compensated = self.technology.now.tool != "0"
        elif rule == "D" and (changed or "D" in block.words):
            self.compensated = block.words.get("D", 1.0) != 0.0
        elif rule == "G43" and not {"G43", "G49"}.isdisjoint(block.g):
            self.compensated = "G43" in block.g

    def pace(self, block: Block) -> tuple[float | None, float | None]:
        """Return the duration, s, or else the feed of a feed move, in units of `feed_step` or degrees per s.

        Per minute or revolution, F is along the linear axes, and in degrees if only rotary axes turn,
        whatever the length unit (Kramer, Proctor, Messina: The NIST RS274/NGC Interpreter, Version 3, 2000,
        2.1.2.5). `BlockError` for a feed move without F, or G95 without S.
        """
        if self.feed_mode != "G93":
            return None, self._feed_now() / 60.0
        if "F" not in block.words:
            raise BlockError("a feed move without F; G93 needs F in each one")
        return 60.0 / block.words["F"], None

    @property
    def lowest_speed(self) -> float:
        """Units or deg per minute below which the control runs no block of a duration (G93); 0 if unknown."""
        form = None if self.control is None else self.control.feed.get("inverse_time")
        return 0.0 if form is None else form.least_speed or 0.0

    @property
    def _clears(self) -> bool:
        form = None if self.control is None else self.control.feed.get("per_minute")
        return form is not None and form.clears

    def _feed_now(self) -> float:
        """Return F per minute."""
        if self.feed is None:
            why = ", which clears F even where it is in force" if self._clears else ""
            fact = f"a feed move without F in force for {self.feed_mode}{why}; write F here or before"
            raise BlockError(fact)
        if self.feed_mode == "G94":
            return self.feed
        speed = self.technology.now.speed
        if speed is None or speed <= 0.0:
            raise BlockError("F per revolution (G95) without S above 0 in force; write S, or post with G94")
        return self.feed * speed

    def _require_read(self, block: Block) -> None:
        for word in (*block.g, *block.m):
            reason = REFUSED.get(word)
            if reason is not None:
                raise BlockError(f"{word} {reason}")
            if word[0] == "G" and word not in ACTING and word not in HARMLESS:
                raise BlockError(
                    f"{word} {UNSUPPORTED.get(word, 'is unknown')}: what comes after it may be elsewhere, in "
                    "another plane or with other tool data; look up what it does on this control, and post "
                    "the program so that it doesn't need it"
                )
        for group in GROUPS if len(block.g) > 1 else ():
            present = sorted({word for word in block.g if word in group})
            if len(present) > 1:
                raise BlockError(f"{' and '.join(present)} in one block; write one of them")

    def _set(self, word: str, block: Block) -> None:
        line = block.line
        self.rules.unstated.discard(_STATES.get(word, ""))
        if word in MOTION or word in CYCLES:
            self.motion, self.knows_motion = word, True
        elif word in PLANES:
            self.plane = word
        elif word in ("G90", "G91"):
            self.incremental = word == "G91"
        elif word in ("G90.1", "G91.1"):
            self.absolute_centres = word == "G90.1"
        elif word in FEED_MODES:
            # F has another meaning in another mode, so controls reset it; some do in the same one, too.
            self.feed = self.feed if word == self.feed_mode and not self._clears else None
            self.feed_mode = word
        elif word in UNIT:
            self.units.state([UNIT[word]], line)
        elif (offset := selected_offset(word, block)) is not None:
            self.work_offset = "".join(offset.split())
        elif word in LEVELS:
            self.to_initial = word == "G98"
        elif word in ("G43", "G49"):
            self.vectors = False
        elif word in TIP_WORDS:
            self.vectors = word == "G43.5"


def unknown_word(machine: Machine, letter: str, block: Block, *, stand_in: bool) -> BlockError:
    """Return the error for a letter that is no axis and belongs to nothing in its block.

    With `stand_in` the machine is a placeholder, because none was given.
    """
    if letter in "ABC" and stand_in:
        fact = "is a rotary axis, and no machine is given; give the one of the program (--machine)"
    elif letter in "ABCUVWXYZ":
        fact = (
            f"machine {machine.name!r} has the axes {', '.join(machine.letters)} and no {letter}; read "
            "the program with the machine that it was posted for, or rename the axis in its file"
        )
    elif letter in "IJKR":
        fact = "belongs to an arc, and neither G2 nor G3 is in force; write the arc, or look up what it means"
    elif letter == "P" and not block.words.keys().isdisjoint("IJKR"):
        fact = (
            "counts the turns of an arc on LinuxCNC; say that it is one (control of the machine file), or "
            "write one arc for each turn"
        )
    elif letter == "E" and "G92" in block.g:
        fact = "sets the extruder of a 3D printer, which no machine here has; leave the block out"
    elif letter == "E":
        fact = (
            "extrusion isn't read, and numbers of G-code have no exponent; leave the word out, or write the "
            "number out"
        )
    else:
        fact = "doesn't belong to anything in its block; look up what it means on this control"
    return BlockError(f"{letter}{block.words[letter]:g}: {fact}")


@dataclass
class DrillingCycle:
    """A series of cycles at successive positions, until G80 or a straight or circular move.

    R and Z stay in force throughout, even if the cycle word changes (LinuxCNC requires them again then,
    Fanuc doesn't), and G98 returns to the level before the first cycle (Kramer, Proctor, Messina: The NIST
    RS274/NGC Interpreter, Version 3, 2000, 3.5.16 and 3.5.20).

    Parameters
    ----------
    word : key of `CYCLES`
    initial : mm, level before the first cycle; None if unknown
    level, depth : mm, R and Z
    """

    word: str
    initial: float | None
    level: float | None = None
    depth: float | None = None

    def take(self, block: Block, scale: float, *, incremental: bool) -> None:
        """Read the levels of a block; under G91, R is relative to the initial level, and Z to R.

        `BlockError` for repetitions, or an increment from an unknown level.
        """
        for letter in "KL":
            if block.words.get(letter, 1.0) != 1.0:
                raise BlockError(
                    f"{self.word} {letter}{block.words[letter]:g} repeats the cycle, which isn't supported; "
                    "write one block for each hole"
                )
        if "R" in block.words:
            self.level = self._level(block.words["R"] * scale, self.initial, incremental=incremental)
        if "Z" in block.words:
            self.depth = self._level(block.words["Z"] * scale, self.level, incremental=incremental)

    def levels(self, now: float | None, *, to_initial: bool, rules: Cycles) -> list[tuple[float, bool]]:
        """Return the levels of Z, mm, and whether each is reached at feed; the first move positions X and Y.

        Z is at `now`, mm, None if unknown; `to_initial` is G98, not G99.
        """
        if self.level is None or self.depth is None:
            raise BlockError(f"{self.word} needs depth Z and level R; write both")
        if to_initial and self.initial is None:
            raise BlockError(
                f"{self.word} under G98 returns to the initial level, which isn't in the program; move Z "
                "before, or write G99"
            )
        # A tool that started below R doesn't return below it.
        back = max(self.initial, self.level) if to_initial and self.initial is not None else self.level
        over = self.level if now is None else max(now, self.level)
        at_feed, fed = CYCLES[self.word], self.word in rules.fed_to_initial
        moves = [(over, False), (self.level, False), (self.depth, True)]
        moves += [(back, True)] if fed else [(self.level, at_feed), (back, False)]
        return [move for i, move in enumerate(moves) if i == 0 or move[0] != moves[i - 1][0]]

    def _level(self, value: float, begin: float | None, *, incremental: bool) -> float:
        if not incremental:
            return value
        if begin is None:
            raise BlockError(f"{self.word} under G91 from a level that isn't in the program; write G90")
        return begin + value
