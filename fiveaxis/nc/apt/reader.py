"""APT cutter locations: the CLSF files of NX, NCL of Creo, APT of SolidWorks and CAMWorks, and of CATIA.

What is read: ``GOTO``, ``FROM`` and ``GOHOME`` (3 numbers, or 6 with a tool vector), ``GODLTA``, ``RAPID``
(for the next move only), arcs (`fiveaxis.nc.apt.arcs`), drilling cycles (`fiveaxis.nc.apt.cycles`), frames
(`fiveaxis.nc.apt.frames`), tools (`fiveaxis.nc.apt.tools`), ``FEDRAT``, ``SPINDL`` (for feeds per
revolution), ``UNITS``. A tool vector stays in force until the next one, ``TLAXIS`` or ``MULTAX/OFF``; before
the first it is 0, 0, 1. In files of Creo a ``GOTO`` of 3 numbers always means 0, 0, 1. Words that may move
the tool in a way that isn't read are refused, all others are counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from fiveaxis.findings import Finding
from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.apt.feedrate import Feeds
from fiveaxis.nc.apt.frames import FRAME_WORDS, Frames
from fiveaxis.nc.apt.moves import Moves
from fiveaxis.nc.apt.remarks import assumed_axis, assumed_feeds, assumed_unit, doubtful_arcs, note
from fiveaxis.nc.apt.statements import CREO, LONGEST_SHOWN, Statement, statements
from fiveaxis.nc.apt.tools import Tools
from fiveaxis.nc.apt.words import require_harmless
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.remarks import remark_on
from fiveaxis.nc.rows import MILLIMETRES, require_finite, scale_positions, unit_axes
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units
from fiveaxis.toolpath import Toolpath


def read_apt(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from APT statements.

    A location before the first ``FEDRAT`` takes the feed of that first one, a rapid move the feed in force;
    1000 mm/min where the file has no feed. Whatever is assumed is among the path's findings.

    Parameters
    ----------
    source : the file
    options : tool, feed and unit

    Raises
    ------
    ToolpathError
        With file and line: no ``GOTO``, a statement that can't be understood, one that moves the tool in a
        way that isn't read, mixed units, arcs that don't fit.
    ToolError
        Neither the caller nor the file names a tool that can be made.
    """
    reader = _Reader(source, Units(source, options.unit), Feeds(source, options.feed_mm_min))
    for statement in statements(source):
        reader.take(statement)
    return reader.finish(options)


@dataclass
class _Reader:
    """What a file has stated while it is read, statement by statement."""

    source: Source
    units: Units
    feeds: Feeds
    ignored: Counter[str] = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)
    compensated: bool = False

    def __post_init__(self) -> None:
        self.frames = Frames(self.source)
        self.tools = Tools(self.source)
        self.moves = Moves(self.source, self.units, self.feeds, self.frames)

    def take(self, statement: Statement) -> None:
        """Act on a statement; one without an action is counted, unless that would lose a move."""
        word = statement.word
        if word == "GOTO":
            self.moves.go(statement)
            return
        self.moves.end_turn()
        if word.startswith(CREO):
            self.moves.creo = True
        action = ACTIONS.get(word)
        if action is None:
            require_harmless(statement, self.source)
        else:
            action(self, statement)
        if action is None or word in COUNTED:
            self.ignored[word[:LONGEST_SHOWN]] += 1

    def set_axis(self, statement: Statement) -> None:
        """Take ``TLAXIS``, the tool vector of what isn't multi-axis."""
        numbers = statement.numbers(self.source)
        if len(numbers) != 3:
            raise statement.error(self.source, "needs a tool vector of 3 numbers")
        self.moves.upright = numbers
        self.moves.set_vector(numbers)

    def set_multiaxis(self, statement: Statement) -> None:
        """Take ``MULTAX``."""
        if statement.minors == ["OFF"]:
            self.moves.vector = self.moves.upright

    def go_home(self, statement: Statement) -> None:
        """Take ``GOHOME``, which moves if it has a place."""
        if statement.minors:
            self.moves.jump(statement)
        else:
            self.ignored[statement.word] += 1

    def set_compensation(self, statement: Statement) -> None:
        """Take ``CUTCOM``: remark on its first use."""
        if statement.minors[:1] not in ([], ["OFF"]) and not self.compensated:
            self.compensated = True
            text = "CUTCOM is on; positions are read as they are written"
            self.findings.append(note("cutter-compensation", text, statement.line, self.source))

    @property
    def _begun(self) -> bool:
        return len(self.moves.rows) > 0

    def finish(self, options: ReadOptions) -> Toolpath:
        """Make the path of all that was read."""
        moves = self.moves
        moves.end_turn()
        if not moves.moved:
            raise self.source.error("no GOTO: the file holds no cutter locations")
        if moves.turn is not None:
            raise moves.turn.statement.error(self.source, "has no GOTO to end at")
        positions, vectors, kinds, feeds, lines = moves.rows.columns()
        require_finite(positions, ["x", "y", "z"], lines, self.source)
        axes = unit_axes(vectors, lines, self.source)
        self.frames.apply(positions, axes)
        unit = self.units.settle()
        tool, findings = self.tools.settle(options, MILLIMETRES[unit])
        assumed = self._assumed(kinds, feeds, lines)
        path = Toolpath.from_tips(
            scale_positions(positions, unit, lines, self.source),
            axes,
            tool,
            feed_mm_min=self.feeds.fill(feeds),
            kind=kinds,
            source=lines,
            name=self.source.name,
            ignored=self.ignored,
            findings=(*findings, *self.frames.findings, *moves.findings, *self.findings, *assumed),
        )
        return replace(path, findings=path.findings + remark_on(path))

    def _assumed(self, kinds: IntArray, feeds: Array, lines: IntArray) -> list[Finding]:
        """Say what the file left open."""
        moves = self.moves
        without_vector = 0 if moves.creo else moves.vector_row or 0
        return [
            *assumed_unit(self.units),
            *assumed_feeds(self.feeds, feeds, kinds, lines),
            *assumed_axis(without_vector, int(lines[0]), self.source),
            *doubtful_arcs(moves.along, moves.against, self.source),
        ]


Action = Callable[[_Reader, Statement], object]
ACTIONS: dict[str, Action] = {
    "FROM": lambda r, s: r.moves.jump(s),
    "GOHOME": _Reader.go_home,
    "GODLTA": lambda r, s: r.moves.go_on(s),
    "RAPID": lambda r, s: setattr(r.moves, "rapid", s.minors != ["OFF"]),
    "CIRCLE": lambda r, s: r.moves.start_turn(s),
    "MOVARC": lambda r, s: r.moves.start_turn(s),
    "INDIRV": lambda r, s: r.moves.set_direction(s),
    "TLON,GOFWD": lambda r, s: r.moves.follow(s),
    "CYCLE": lambda r, s: r.moves.set_cycle(s),
    "TLAXIS": _Reader.set_axis,
    "MULTAX": _Reader.set_multiaxis,
    "FEDRAT": lambda r, s: r.feeds.state(s.minors, s.line, r.units),
    "SPINDL": lambda r, s: r.feeds.turn(s.minors),
    "CUTCOM": _Reader.set_compensation,
    "TRNTYP": lambda r, s: r.frames.set_type(s),
    **dict.fromkeys(("UNIT", "UNITS"), lambda r, s: r.units.state(s.minors, s.line)),
    **dict.fromkeys(("CUTTER", "TLDATA", f"{CREO}CUTTER"), lambda r, s: r.tools.state(s, moved=r._begun)),
    **dict.fromkeys(("LOAD", "LOADTL"), lambda r, s: r.tools.load(s, moved=r._begun)),
    **dict.fromkeys(FRAME_WORDS, lambda r, s: r.frames.state(s, len(r.moves.rows))),
}

# Words whose meaning is used only in part: they are counted all the same.
COUNTED = {"SPINDL", "MULTAX", "CUTCOM", "TRNTYP", "LOAD", "LOADTL", *FRAME_WORDS}
