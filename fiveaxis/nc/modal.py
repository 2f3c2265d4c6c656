"""What G and M words mean to the reader of machine-axis programs, and what stays in force.

Words fall into four kinds: those that act (motion, plane, unit, distance, feed mode, G4, G28, G53), those
that change nothing in what is read (`HARMLESS`), those that would change the way and aren't read (`REFUSED`),
and all others, which are refused as unknown. An M word moves no axis here, but those of `REFUSED` do.
"""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.nc.block import Block
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units

MOTION = ("G0", "G1", "G2", "G3")
UNIT = {"G20": "INCH", "G70": "INCH", "G21": "MM", "G71": "MM"}
FRAMES = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
END = ("M2", "M30")

# Words of one group contradict each other in one block.
GROUPS: tuple[tuple[str, ...], ...] = (
    MOTION,
    ("G17", "G18", "G19"),
    tuple(UNIT),
    ("G90", "G91"),
    ("G93", "G94", "G95"),
    FRAMES,
    ("G43", "G49"),
    ("G4", "G28"),
)

# Word -> what it is taken for. None of these moves an axis or shifts a position.
HARMLESS = {
    **dict.fromkeys(("G40", "G15", "G69"), "switches off what isn't read when it is on"),
    "G80": "ends a cycle, and the motion in force with it",
    **dict.fromkeys(("G43", "G49"), "the words count for the tool length that the machine model has"),
    **dict.fromkeys(("G9", "G61", "G61.1", "G64"), "corners are taken as programmed, not as blended"),
    **dict.fromkeys(("G5.1", "G187"), "smoothing, which stays within the control's tolerance"),
    "G91.1": "I, J, K count from the begin of the arc, as they are read",
    **dict.fromkeys(("G98", "G99"), "the level to which cycles return"),
}

# Letters that may stand beside a word and belong to it.
PARAMETERS = {"G4": "P", "G5.1": "PQ", "G64": "PQ", "G187": "EP"}

_CYCLE = "is a cycle, which isn't expanded; let the CAM system write its moves"
_RADIUS = "shifts the way by the tool's radius; let the CAM system write the way of the tool's centre"
_CURVE = "is a curve or a thread, which isn't read; let the CAM system write G1, G2 and G3"
_PROBE = "stops where a probe touches, so its end isn't in the program; take it out"
_SHIFT = "shifts, turns or scales the coordinates, which isn't read; post without it"
_CALL = "calls or ends a subprogram, which isn't run; post one program with all moves"
_TIP = (
    "switches tool centre point control on: the program gives positions of the tool's tip on the workpiece, "
    "not of the machine's axes; post it in machine coordinates"
)

REFUSED = {
    **dict.fromkeys(("G41", "G42", "G41.1", "G42.1", "G41.2", "G42.2"), _RADIUS),
    **dict.fromkeys(("G73", "G74", "G76", *(f"G{n}" for n in range(81, 90))), _CYCLE),
    **dict.fromkeys(("G5", "G5.2", "G5.3", "G6.2", "G33", "G33.1", "G33.2"), _CURVE),
    **dict.fromkeys(("G31", "G38.2", "G38.3", "G38.4", "G38.5"), _PROBE),
    **dict.fromkeys(("G7", "G10", "G16", "G50.1", "G51", "G51.1", "G52", "G54.1", "G54.2"), _SHIFT),
    **dict.fromkeys(("G68", "G68.1", "G68.2", "G68.3", "G68.4", "G92", "G92.1", "G92.2", "G92.3"), _SHIFT),
    **dict.fromkeys(("G65", "G66", "G67", "M96", "M97", "M98", "M99", "M198"), _CALL),
    "G30": "goes to a second reference, whose place isn't in the program; write G0 with its coordinates",
    "G90.1": "makes I, J, K absolute, which isn't read; post them as the way from the begin of the arc",
    **dict.fromkeys(("G43.4", "G43.5", "G141", "G234", "M128", "M428", "M430", "TRAORI", "TCPM"), _TIP),
}

ACTING = frozenset(
    (*MOTION, "G4", "G17", "G18", "G19", *UNIT, "G28", "G53", *FRAMES, "G90", "G91", "G93", "G94", "G95")
)


@dataclass
class Modes:
    """What is in force while a program is read.

    Parameters
    ----------
    source, units : the file, and what is known of its unit
    motion : one of `MOTION`, None before the first and after G80
    plane : of arcs
    incremental : G91
    feed_mode : G93, G94 or G95
    feed : F in the units of its mode, None before the first and after a change of mode
    spindle : S, rev/min
    frame, frame_line : the work offset and where it was chosen
    """

    source: Source
    units: Units
    motion: str | None = None
    plane: str = "G17"
    incremental: bool = False
    feed_mode: str = "G94"
    feed: float | None = None
    spindle: float | None = None
    frame: str = "G54"
    frame_line: int | None = None

    def take(self, block: Block) -> None:
        """Take what a block puts in force; nothing moves yet.

        Raises
        ------
        ToolpathError
            With file and line: a word that isn't read or isn't known, two of a group, mixed units or work
            offsets, F that isn't above 0.
        """
        if block.g or block.m:
            self._require_read(block)
        if "G80" in block.g:
            self.motion = None
        for word in block.g:
            self._set(word, block.line)
        if "S" in block.words:
            self.spindle = block.words["S"]
        if "F" in block.words:
            self.feed = block.words["F"]
            if self.feed <= 0.0:
                raise self.source.error(f"F{self.feed:g}; a feed must be above 0", block.line)

    def pace(self, block: Block, way: float, turn: float) -> tuple[float, float]:
        """Compute duration, s, and feed, mm/s or deg/s, of a feed move.

        Per minute or revolution, F counts along the way of the linear axes as if the rotary ones stood, and
        in degrees where only rotary axes turn, whatever the unit of lengths.

        Parameters
        ----------
        way : mm, of the linear axes
        turn : deg, of the rotary axes; one of them counts

        Raises
        ------
        ToolpathError
            No F where one is needed, G95 without S.

        References
        ----------
        Kramer, Proctor, Messina: The NIST RS274/NGC Interpreter, Version 3 (2000), 2.1.2.5.
        """
        length = way if way > 0.0 else turn
        if self.feed_mode == "G93":
            if "F" not in block.words:
                raise self.source.error("a feed move without F; G93 needs one in each", block.line)
            time = 60.0 / block.words["F"]
            return time, length / time
        feed = self._feed_now(block.line) / 60.0 * (MILLIMETRES[self.units.now] if way > 0.0 else 1.0)
        return length / feed, feed

    def _feed_now(self, line: int) -> float:
        """Give F as a number per minute."""
        if self.feed is None:
            raise self.source.error(
                f"a feed move, and no F in force for {self.feed_mode}; give F here or before", line
            )
        if self.feed_mode == "G94":
            return self.feed
        if self.spindle is None or self.spindle <= 0.0:
            raise self.source.error(
                "F counts per revolution (G95), and no S above 0 is in force; give S, or post with G94", line
            )
        return self.feed * self.spindle

    def _require_read(self, block: Block) -> None:
        for word in (*block.g, *block.m):
            if word in REFUSED:
                raise self.source.error(f"{word} {REFUSED[word]}", block.line)
            if word[0] == "G" and word not in ACTING and word not in HARMLESS:
                raise self.source.error(
                    f"{word} isn't known; if it moves nothing, take it out of the program", block.line
                )
        for group in GROUPS if len(block.g) > 1 else ():
            present = sorted({word for word in block.g if word in group})
            if len(present) > 1:
                raise self.source.error(
                    f"{' and '.join(present)} in one block; write one of them", block.line
                )

    def _set(self, word: str, line: int) -> None:
        if word in MOTION:
            self.motion = word
        elif word in ("G17", "G18", "G19"):
            self.plane = word
        elif word in ("G90", "G91"):
            self.incremental = word == "G91"
        elif word in ("G93", "G94", "G95"):
            # The same number means another feed in another mode, so controls forget it.
            self.feed = self.feed if word == self.feed_mode else None
            self.feed_mode = word
        elif word in UNIT:
            self.units.state([UNIT[word]], line)
        elif word in FRAMES:
            self._set_frame(word, line)

    def _set_frame(self, word: str, line: int) -> None:
        begun = self.frame_line is not None or self.units.used_line is not None
        if begun and word != self.frame:
            where = f"since line {self.frame_line}" if self.frame_line is not None else "before"
            raise self.source.error(
                f"{word} here and {self.frame} {where}: how far apart they are isn't in the program; write "
                "one program for each",
                line,
            )
        self.frame, self.frame_line = word, self.frame_line or line
