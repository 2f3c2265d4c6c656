"""Statements of APT that move the tool, and their modal state."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import Array, Finding, IntArray
from fiveaxis.model import MoveKind
from fiveaxis.nc.apt.arcs import (
    StatedArc,
    agreement,
    arc_points,
    arc_vectors,
    read_circle,
    read_tlon,
    require_reachable,
    sweep_to,
)
from fiveaxis.nc.apt.cycles import Cycle, hole_points, read_cycle, remark_on_cycle
from fiveaxis.nc.apt.feedrate import Feeds
from fiveaxis.nc.apt.frames import Frames
from fiveaxis.nc.apt.statements import Statement
from fiveaxis.nc.control.arcs import USUAL
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.units import Units

UPRIGHT = [0.0, 0.0, 1.0]

# Points that continue an arc of Creo are evenly spaced; a longer step is a straight move.
LONGER_STEP = 1.05

# Cosine of the angle, 26 deg, within which a move leads into an arc.
TANGENT = 0.9


@dataclass
class AptRows:
    """The locations read so far: a list of lists takes ten times the memory.

    Parameters
    ----------
    numbers : nine for each location: position and vector, in unit and frame of the file; `MoveKind`; feed,
        mm/min, NaN where none is in force; line of the statement
    """

    numbers: array[float] = field(default_factory=lambda: array("d"))

    def __len__(self) -> int:
        return len(self.numbers) // 9

    def add(
        self, position: list[float], vector: list[float], kind: MoveKind, feed: float | None, line: int
    ) -> None:
        """Append a location."""
        self.numbers.extend((*position, *vector, kind, np.nan if feed is None else feed, line))

    def position(self, back: int = 1) -> Array:
        """Return the position of the last location, or of one before it, (3,); empty if there is none."""
        return np.array(self.numbers[-9 * back : 3 - 9 * back])

    def columns(self) -> tuple[Array, Array, IntArray, Array, IntArray]:
        """Return positions and vectors, (n, 3), kinds, feeds and lines, (n,)."""
        rows = np.array(self.numbers).reshape(-1, 9)
        kinds, lines = rows[:, 6].astype(np.int64), rows[:, 8].astype(np.int64)
        return rows[:, :3].copy(), rows[:, 3:6].copy(), kinds, rows[:, 7].copy(), lines


@dataclass
class Moves:
    """The locations read so far, and the modal state for the next one.

    Parameters
    ----------
    units, feeds, frames : of the file
    rows : the locations
    vector, upright : the tool vector in force, and that of moves that aren't multi-axis
    creo : whether the file comes from Creo
    rapid : whether the next move is rapid
    moved : whether there is a location besides ``FROM``
    vector_row : the first row with a tool vector from the file
    arc, step : the arc that the next ``GOTO`` ends; rad, step of the previous point of the same arc
    direction : of ``INDIRV``
    cycle, last_cycle : the active cycle; the one that ``CYCLE/ON`` resumes
    along, against : numbers of arcs that begin in the direction of the move before them, and opposite to it
    findings : what was assumed about cycles and arcs
    drilled : lines that drill a hole
    """

    units: Units
    feeds: Feeds
    frames: Frames
    rows: AptRows = field(default_factory=AptRows)
    vector: list[float] = field(default_factory=UPRIGHT.copy)
    upright: list[float] = field(default_factory=UPRIGHT.copy)
    creo: bool = False
    rapid: bool = False
    moved: bool = False
    vector_row: int | None = None
    arc: StatedArc | None = None
    step: float | None = None
    direction: Array | None = None
    cycle: Cycle | None = None
    last_cycle: Cycle | None = None
    along: int = 0
    against: int = 0
    findings: list[Finding] = field(default_factory=list)
    drilled: set[int] = field(default_factory=set)

    @property
    def scale(self) -> float:
        """Mm in the unit of the file."""
        return MILLIMETRES[self.units.now]

    def go(self, statement: Statement) -> None:
        """Process ``GOTO``: a straight move, the end of an arc, or a hole of the active cycle."""
        numbers = self._position(statement)
        kind, line = self._begin_move(), statement.line
        if self.cycle is not None:
            self._drill(self.cycle, numbers, line)
        elif self.arc is not None:
            self._go_along(self.arc, numbers, kind, statement)
        else:
            self.rows.add(numbers, self.vector, kind, self.feeds.now, line)

    def jump(self, statement: Statement) -> None:
        """Process ``FROM`` or ``GOHOME``: a start position, or a rapid move."""
        position = self._position(statement)
        self.rows.add(position, self.vector, MoveKind.RAPID, self.feeds.now, statement.line)

    def go_by(self, statement: Statement) -> None:
        """Process ``GODLTA``: increments, or one number along the tool axis."""
        if self.cycle is not None or self.arc is not None:
            raise statement.error("can't end an arc or follow CYCLE; write a GOTO, or CYCLE/OFF")
        numbers = statement.numbers()
        if len(numbers) == 1:
            numbers = [numbers[0] * component for component in self.vector]
        elif len(numbers) == 6:
            self.set_vector(numbers[3:])
        elif len(numbers) != 3:
            raise statement.error(f"has {len(numbers)} numbers; it needs 1, 3 or 6")
        position = [a + b for a, b in zip(self._here(statement).tolist(), numbers, strict=False)]
        self.rows.add(position, self.vector, self._begin_move(), self.feeds.now, statement.line)

    def _begin_move(self) -> MoveKind:
        """Return the kind of the next move; ``RAPID`` holds for that one only."""
        kind = MoveKind.RAPID if self.rapid else MoveKind.CUT
        self.rapid, self.moved = False, True
        return kind

    def _position(self, statement: Statement) -> list[float]:
        """Read 3 numbers, or 6 of which the last three are the new tool vector."""
        numbers = statement.numbers()
        if len(numbers) == 6:
            self.set_vector(numbers[3:])
        elif len(numbers) != 3:
            raise statement.error(f"has {len(numbers)} numbers; it needs 3, or 6 with a tool vector")
        elif self.creo:
            self.vector = self.upright
        if self.units.used_line is None:
            self.units.use(statement.line)
        return numbers[:3]

    def set_vector(self, vector: list[float]) -> None:
        """Set the tool vector, as written."""
        self.vector = vector
        if self.vector_row is None:
            self.vector_row = len(self.rows)

    def _here(self, statement: Statement) -> Array:
        """Return the last location, (3,) in the unit of the file, for a statement that depends on it."""
        if not len(self.rows):
            raise statement.error("has no location before it to begin at; add a GOTO or FROM")
        if self.frames.changes and self.frames.changes[-1][0] == len(self.rows):
            raise statement.error("begins at a location of another frame; add a GOTO in this one before it")
        return self.rows.position()

    # Arcs are computed in mm, as the tolerances are.

    def start_arc(self, statement: Statement) -> None:
        """Process ``CIRCLE`` or ``MOVARC``."""
        if self.cycle is not None or self.arc is not None:
            what = "CYCLE" if self.arc is None else "an arc that has no GOTO to end at"
            raise statement.error(f"can't follow {what}; end that first")
        self._here(statement)
        self.arc = read_circle(statement, self.scale)

    def end_arc(self) -> None:
        """End an arc of several points."""
        if self.step is not None:
            self.arc = self.step = None

    def set_direction(self, statement: Statement) -> None:
        """Process ``INDIRV``."""
        numbers = statement.numbers()
        if len(numbers) != 3 or not 0.0 < max(map(abs, numbers)) <= LARGEST_POSITION:
            raise statement.error("needs a direction of 3 numbers")
        self.direction = np.array(numbers)

    def follow(self, statement: Statement) -> None:
        """Process ``TLON,GOFWD/(CIRCLE/…``, which states its own end."""
        if self.cycle is not None or self.arc is not None:
            raise statement.error("can't end an arc or follow CYCLE; write a GOTO, or CYCLE/OFF")
        begin = self._here(statement) * self.scale
        require_reachable(begin, statement)
        arc, end = read_tlon(statement, self.direction, begin, self.scale)
        self.direction = None
        self._add_arc(arc, begin, end, self._begin_move(), statement.line)

    def _go_along(self, arc: StatedArc, position: list[float], kind: MoveKind, statement: Statement) -> None:
        """Add the points of an arc that ends at a position in the unit of the file."""
        begin, end = self._here(arc.statement) * self.scale, np.array(position) * self.scale
        self.arc = None
        require_reachable(end, statement)
        require_reachable(begin, arc.statement)
        sweep = sweep_to(arc, begin, end) if self.creo else None
        if self.step is not None and (sweep is None or sweep > LONGER_STEP * self.step):
            self.step = None
            self.rows.add(position, self.vector, kind, self.feeds.now, statement.line)
            return
        before = self.rows.position(2) * self.scale
        if self.step is None and len(before) and np.all(np.abs(before) <= LARGEST_POSITION):
            fit = agreement(arc, before, begin)
            self.along += fit > TANGENT
            self.against += fit < -TANGENT
        chord = math.dist(begin, end)
        if 0.0 < chord < USUAL.rounding and self.step is None:
            text = (
                f"the arc begins and ends {chord:.2g} mm apart; by its direction it turns by "
                f"{math.degrees(sweep_to(arc, begin, end) or 0.0):.4g} deg"
            )
            self.findings.append(statement.note("arc-nearly-closed", text))
        self._add_arc(arc, begin, end, kind, statement.line)
        self.rows.numbers[-9:-6] = array("d", position)
        if sweep is not None:
            # Creo writes several points for one CIRCLE.
            self.arc, self.step = replace(arc, angle=None), sweep

    def _add_arc(self, arc: StatedArc, begin: Array, end: Array, kind: MoveKind, line: int) -> None:
        points = arc_points(arc, begin, end) / self.scale
        vectors = arc_vectors(list(self.rows.numbers[-6:-3]), self.vector, len(points))
        for point, vector in zip(points.tolist(), vectors.tolist(), strict=True):
            self.rows.add(point, vector, kind, self.feeds.now, line)

    # Drilling

    def set_cycle(self, statement: Statement) -> None:
        """Process ``CYCLE``; ``CYCLE/OFF`` ends it, and ``CYCLE/ON`` resumes the last one."""
        if statement.minors in (["OFF"], ["NOMORE"]):
            self.cycle = None
            return
        if self.arc is not None:
            raise statement.error("can't follow an arc that has no GOTO to end at")
        if statement.minors == ["ON"] and self.last_cycle is not None:
            self.cycle = self.last_cycle
            return
        self.cycle = self.last_cycle = read_cycle(statement)
        self.findings += remark_on_cycle(self.cycle)

    def _drill(self, cycle: Cycle, point: list[float], line: int) -> None:
        feed = self.feeds.now
        if cycle.feed is not None:
            number, unit = cycle.feed
            feed = self.feeds.convert([f"{number!r}", unit], cycle.statement.line) or feed
        self.drilled.add(line)
        for position, kind in hole_points(cycle, point, self.vector):
            self.rows.add(position, self.vector, kind, feed, line)
