"""APT cutter locations: the APT source and CLSF files of CAM systems.

What is read: ``GOTO`` and ``FROM`` (3 numbers, or 6 with a tool vector, which stays in force until the
next one; before the first it is 0, 0, 1 as NX means it), ``RAPID`` (for the next ``GOTO`` only), ``FEDRAT``,
``SPINDL`` (for feeds per revolution), ``UNITS``, ``$`` and ``$$``. Coordinates are in the frame of ``MSYS``
or ``CSYS``, which must be the same for all of the file. Words that move the tool in a way that isn't read are
refused, all others are counted.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.nc.feedrate import Feeds
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import parse_number, require_finite, scale_positions, unit_axes
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units
from fiveaxis.toolpath import MoveKind, Toolpath

_ARC = "is an arc or a curve, and a chord would be wrong; let the CAM system write it as GOTO points"
_CYCLE = "is a cycle, which isn't expanded; let the CAM system write its moves as GOTO points"
_STEP = "moves by increments, which isn't read; let the CAM system write GOTO points"
_COPY = "repeats or moves other statements, which isn't expanded; let the CAM system write GOTO points"

REFUSED = {
    **dict.fromkeys(("CIRCLE", "ARC", "HELIX", "HELICAL", "MOVARC", "TLON", "INDIRV"), _ARC),
    **dict.fromkeys(("GOFWD", "GOBACK", "GOLFT", "GORGT", "GOUP", "GODOWN"), _ARC),
    **dict.fromkeys(("NURBS", "SPLINE", "BSPLIN", "BSPLINE", "POLYNOMIAL"), _ARC),
    "CYCLE": _CYCLE,
    "GODLTA": _STEP,
    **dict.fromkeys(("COPY", "TRACUT", "CALL", "MACRO", "LOOPST"), _COPY),
}

# After these comes text for people, which may hold slashes of its own.
FREE_TEXT = ("PARTNO", "PPRINT", "INSERT", "REMARK")


@dataclass(frozen=True)
class Statement:
    """One statement, put together from its continuation lines.

    Parameters
    ----------
    line : its first line
    word : what stands before the slash, in upper case
    minor : what stands after it
    """

    line: int
    word: str
    minor: str

    @property
    def minors(self) -> list[str]:
        """The parts after the slash, in upper case."""
        return [part.strip().upper() for part in self.minor.split(",")] if self.minor.strip() else []

    def __str__(self) -> str:
        return f"{self.word}/{self.minor.strip()}"


@dataclass
class Rows:
    """The locations read so far, column by column."""

    positions: list[list[float]] = field(default_factory=list)
    vectors: list[list[float]] = field(default_factory=list)
    kinds: list[int] = field(default_factory=list)
    feeds: list[float | None] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def read_apt(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from APT statements.

    A location before the first ``FEDRAT`` takes the feed of that first one, a rapid move the feed in force;
    1000 mm/min where the file has no feed.

    Parameters
    ----------
    source : the file
    options : tool, feed and unit

    Raises
    ------
    ToolpathError
        With file and line: no ``GOTO``, a statement that can't be understood, one that moves the tool in a
        way that isn't read, mixed units or frames.
    """
    reader = _Reader(source, Units(source, options.unit), Feeds(source, options.feed_mm_min))
    for statement in statements(source):
        reader.take(statement)
    rows = reader.rows
    if not reader.moved:
        raise source.error("no GOTO: the file holds no cutter locations")
    lines = np.array(rows.lines, dtype=np.int64)
    positions = np.array(rows.positions)
    require_finite(positions, ["x", "y", "z"], lines, source)
    return Toolpath.from_tips(
        scale_positions(positions, reader.units.settle(), lines, source),
        unit_axes(np.array(rows.vectors), lines, source),
        options.tool_or(None, source),
        feed_mm_min=reader.feeds.fill(rows.feeds),
        kind=np.array(rows.kinds),
        source=lines,
        name=source.name,
        ignored=reader.ignored,
    )


def statements(source: Source) -> Iterator[Statement]:
    """Split a file into statements: ``$`` continues one on the next line, ``$$`` starts a comment.

    Raises
    ------
    ToolpathError
        The file ends where a statement should continue.
    """
    begun, first = "", 0
    for number, line in enumerate(source.lines, start=1):
        code, continued = (line, False) if "$" not in line else _without_comment(line)
        if not begun:
            first = number
        if continued or (begun and not code.strip()):
            begun += code
            continue
        text = (begun + code).strip()
        begun = ""
        if text:
            yield _parse_statement(text, first)
    if begun:
        raise source.error(f"the file ends inside the statement {begun.strip()!r}, after its $", first)


def _without_comment(line: str) -> tuple[str, bool]:
    """Cut a line at its ``$`` or ``$$``; tell whether it continues on the next one."""
    code, _, rest = line.partition("$")
    return code, not rest.startswith("$")


def _parse_statement(text: str, line: int) -> Statement:
    word, slash, minor = text.partition("/")
    word = word.strip().upper()
    if slash and word == "GOTO":
        return Statement(line, word, minor)
    first, _, rest = text.partition(" ")
    lead = first.partition("/")[0].upper()
    if lead in FREE_TEXT or not slash:
        return Statement(line, lead, minor or rest)
    return Statement(line, word, minor)


@dataclass
class _Reader:
    """What is in force while the statements are read one by one."""

    source: Source
    units: Units
    feeds: Feeds
    rows: Rows = field(default_factory=Rows)
    ignored: Counter[str] = field(default_factory=Counter)
    vector: list[float] = field(default_factory=lambda: [0.0, 0.0, 1.0])
    rapid: bool = False
    moved: bool = False
    frames: dict[str, Statement] = field(default_factory=dict)

    def take(self, statement: Statement) -> None:
        """Act on a statement; one without an action is counted, unless that would lose a move."""
        if statement.word == "GOTO":
            self._add(statement, MoveKind.RAPID if self.rapid else MoveKind.CUT)
            self.rapid, self.moved = False, True
            return
        action = ACTIONS.get(statement.word)
        if action is not None:
            action(self, statement)
            return
        self._require_harmless(statement)
        self.ignored[statement.word] += 1

    def _add(self, statement: Statement, kind: MoveKind) -> None:
        """Append a location; 6 numbers bring the tool vector that is in force from here on."""
        numbers = self._numbers(statement)
        if len(numbers) == 6:
            self.vector = numbers[3:]
        elif len(numbers) != 3:
            raise self._error(statement, f"has {len(numbers)} numbers; it needs 3, or 6 with a tool vector")
        rows = self.rows
        rows.positions.append(numbers[:3])
        rows.vectors.append(self.vector)
        rows.kinds.append(kind)
        rows.feeds.append(self.feeds.now)
        rows.lines.append(statement.line)
        self.units.use(statement.line)

    def _numbers(self, statement: Statement) -> list[float]:
        fields = statement.minor.split(",")
        try:
            return [parse_number(f) for f in fields]
        except ValueError:
            raise self._error(statement, "has a field that isn't a number") from None

    def _error(self, statement: Statement, fact: str) -> ToolpathError:
        return self.source.error(f"{str(statement)!r} {fact}", statement.line)

    def _start(self, statement: Statement) -> None:
        self._add(statement, MoveKind.RAPID)

    def _go_rapid(self, _statement: Statement) -> None:
        self.rapid = True

    def _set_unit(self, statement: Statement) -> None:
        self.units.state(statement.minors, statement.line)

    def _set_feed(self, statement: Statement) -> None:
        self.feeds.state(statement.minors, statement.line, self.units)

    def _set_spindle(self, statement: Statement) -> None:
        self.feeds.turn(statement.minors)
        self.ignored[statement.word] += 1

    def _set_frame(self, statement: Statement) -> None:
        """Count a frame; another one after the first location would mix coordinates of two frames."""
        before = self.frames.setdefault(statement.word, statement)
        if before.minors != statement.minors:
            if self.rows.lines:
                raise self._error(
                    statement,
                    f"changes the frame given on line {before.line}; write one file for each frame",
                )
            self.frames[statement.word] = statement
        self.ignored[statement.word] += 1

    def _require_harmless(self, statement: Statement) -> None:
        for part in statement.word.split(","):
            reason = REFUSED.get(part.strip())
            # CYCLE/OFF ends a cycle, and posts write it to be sure: nothing moves.
            if reason is not None and not (part == "CYCLE" and statement.minors == ["OFF"]):
                raise self._error(statement, reason)
        if "GOTO" in statement.word:
            raise self._error(statement, "isn't understood; write GOTO/x,y,z or GOTO/x,y,z,i,j,k")


ACTIONS: dict[str, Callable[[_Reader, Statement], None]] = {
    "FROM": _Reader._start,
    "RAPID": _Reader._go_rapid,
    "UNIT": _Reader._set_unit,
    "UNITS": _Reader._set_unit,
    "FEDRAT": _Reader._set_feed,
    "SPINDL": _Reader._set_spindle,
    "MSYS": _Reader._set_frame,
    "CSYS": _Reader._set_frame,
}
