"""Statements of APT that move the tool, and what they leave in force."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.findings import Finding
from fiveaxis.geometry import Array
from fiveaxis.nc.apt.arcs import (
    Turn,
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
from fiveaxis.nc.apt.remarks import note
from fiveaxis.nc.apt.rows import AptRows
from fiveaxis.nc.apt.statements import Statement
from fiveaxis.nc.control.arcs import ROUNDING
from fiveaxis.nc.rows import LARGEST_POSITION, MILLIMETRES
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units
from fiveaxis.toolpath import MoveKind

UPRIGHT = [0.0, 0.0, 1.0]

# Points that continue an arc of Creo are evenly spaced; a longer step is a straight move to a point of the
# circle.
LONGER_STEP = 1.05

# Cosine of the angle, 26 deg, within which a move is taken to lead into an arc.
TANGENT = 0.9


@dataclass
class Moves:
    """The locations read so far, and what decides the next one.

    Parameters
    ----------
    source, units, feeds, frames : of the file
    rows : the locations
    vector, upright : the tool vector in force, and the one of a path that isn't multi-axis
    creo : whether the file comes from Creo
    rapid : whether the next move is one
    moved : whether there is a location besides ``FROM``
    vector_row : the first row with a tool vector of the file's own
    turn, step : the arc that the next ``GOTO`` ends; rad, the step of the one before, if it may go on
    direction : of ``INDIRV``
    cycle, last_cycle : that is on; that ``CYCLE/ON`` would turn on again
    along, against : arcs that moves lead into, and that they lead into against the arc's direction
    findings : what was assumed about cycles and arcs
    """

    source: Source
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
    turn: Turn | None = None
    step: float | None = None
    direction: Array | None = None
    cycle: Cycle | None = None
    last_cycle: Cycle | None = None
    along: int = 0
    against: int = 0
    findings: list[Finding] = field(default_factory=list)

    @property
    def scale(self) -> float:
        """Mm in the unit of the file."""
        return MILLIMETRES[self.units.now]

    def go(self, statement: Statement) -> None:
        """Take ``GOTO``: a straight move, the end of an arc, or a hole of the cycle that is on."""
        numbers = self._position(statement)
        kind, line = self._begin_move(), statement.line
        if self.cycle is not None:
            self._drill(self.cycle, numbers, line)
        elif self.turn is not None:
            self._turn_to(self.turn, numbers, kind, statement)
        else:
            self.rows.add(numbers, self.vector, kind, self.feeds.now, line)

    def jump(self, statement: Statement) -> None:
        """Take ``FROM`` or ``GOHOME``: a place where the tool is, or where it goes at rapid."""
        place = self._position(statement)
        self.rows.add(place, self.vector, MoveKind.RAPID, self.feeds.now, statement.line)

    def go_on(self, statement: Statement) -> None:
        """Take ``GODLTA``: increments, or one number along the tool axis."""
        if self.cycle is not None or self.turn is not None:
            raise statement.error(self.source, "can't end an arc or follow CYCLE; write a GOTO, or CYCLE/OFF")
        numbers = statement.numbers(self.source)
        if len(numbers) == 1:
            numbers = [numbers[0] * component for component in self.vector]
        elif len(numbers) == 6:
            self.set_vector(numbers[3:])
        elif len(numbers) != 3:
            raise statement.error(self.source, f"has {len(numbers)} numbers; it needs 1, 3 or 6")
        place = [a + b for a, b in zip(self._here(statement).tolist(), numbers, strict=False)]
        self.rows.add(place, self.vector, self._begin_move(), self.feeds.now, statement.line)

    def _begin_move(self) -> MoveKind:
        """Tell what kind of move comes now; ``RAPID`` ends with it."""
        kind = MoveKind.RAPID if self.rapid else MoveKind.CUT
        self.rapid, self.moved = False, True
        return kind

    def _position(self, statement: Statement) -> list[float]:
        """Read 3 numbers, or 6 of which the last ones are the tool vector in force from here on."""
        try:
            numbers = [float(f) for f in statement.minor.split(",")]
        except ValueError:
            numbers = []
        if not numbers or "_" in statement.minor:
            raise statement.error(self.source, "has a field that isn't a number")
        if len(numbers) == 6:
            self.set_vector(numbers[3:])
        elif len(numbers) != 3:
            raise statement.error(
                self.source, f"has {len(numbers)} numbers; it needs 3, or 6 with a tool vector"
            )
        elif self.creo:
            self.vector = self.upright
        if self.units.used_line is None:
            self.units.use(statement.line)
        return numbers[:3]

    def set_vector(self, vector: list[float]) -> None:
        """Put a tool vector in force, as it is written."""
        self.vector = vector
        if self.vector_row is None:
            self.vector_row = len(self.rows)

    def _here(self, statement: Statement) -> Array:
        """Give the location where a move begins that depends on it, (3,) in the unit of the file."""
        if not len(self.rows):
            raise statement.error(self.source, "has no location before it to begin at; add a GOTO or FROM")
        if self.frames.changes and self.frames.changes[-1][0] == len(self.rows):
            raise statement.error(
                self.source, "begins at a location of another frame; add a GOTO in this one before it"
            )
        return self.rows.here

    # Arcs: their figures are in mm, because tolerances are.

    def start_turn(self, statement: Statement) -> None:
        """Take ``CIRCLE`` or ``MOVARC``."""
        if self.cycle is not None or self.turn is not None:
            what = "CYCLE" if self.turn is None else "an arc that has no GOTO to end at"
            raise statement.error(self.source, f"can't follow {what}; end that first")
        self._here(statement)
        self.turn = read_circle(statement, self.source, self.scale)

    def end_turn(self) -> None:
        """Let no further point continue the arc before."""
        if self.step is not None:
            self.turn = self.step = None

    def set_direction(self, statement: Statement) -> None:
        """Take ``INDIRV``."""
        numbers = statement.numbers(self.source)
        if len(numbers) != 3 or not 0.0 < max(map(abs, numbers)) <= LARGEST_POSITION:
            raise statement.error(self.source, "needs a direction of 3 numbers")
        self.direction = np.array(numbers)

    def follow(self, statement: Statement) -> None:
        """Take ``TLON,GOFWD/(CIRCLE/…``, which brings its own end."""
        if self.cycle is not None or self.turn is not None:
            raise statement.error(self.source, "can't end an arc or follow CYCLE; write a GOTO, or CYCLE/OFF")
        begin = self._here(statement) * self.scale
        require_reachable(begin, statement, self.source)
        turn, end = read_tlon(statement, self.direction, begin, self.source, self.scale)
        self.direction = None
        self._add_arc(turn, begin, end, self._begin_move(), statement.line)

    def _turn_to(self, turn: Turn, place: list[float], kind: MoveKind, statement: Statement) -> None:
        """Add the points of an arc that ends at a place, in the unit of the file."""
        begin, end = self._here(turn.statement) * self.scale, np.array(place) * self.scale
        self.turn = None
        require_reachable(end, statement, self.source)
        require_reachable(begin, turn.statement, self.source)
        sweep = sweep_to(turn, begin, end) if self.creo else None
        if self.step is not None and (sweep is None or sweep > LONGER_STEP * self.step):
            self.step = None
            self.rows.add(place, self.vector, kind, self.feeds.now, statement.line)
            return
        before = np.array(self.rows.positions[-6:-3]) * self.scale
        if self.step is None and len(before) and np.all(np.abs(before) <= LARGEST_POSITION):
            fit = agreement(turn, before, begin)
            self.along += fit > TANGENT
            self.against += fit < -TANGENT
        chord = math.dist(begin, end)
        if 0.0 < chord < ROUNDING and self.step is None:
            text = (
                f"the arc begins and ends {chord:.2g} mm apart; as its direction has it, it turns by "
                f"{math.degrees(sweep_to(turn, begin, end) or 0.0):.4g} deg"
            )
            self.findings.append(note("arc-nearly-closed", text, statement.line, self.source))
        self._add_arc(turn, begin, end, kind, statement.line)
        self.rows.positions[-3:] = array("d", place)
        if sweep is not None:
            # Creo writes several points for each arc, and its CIRCLE holds for all of them.
            self.turn, self.step = replace(turn, angle=None), sweep

    def _add_arc(self, turn: Turn, begin: Array, end: Array, kind: MoveKind, line: int) -> None:
        points = arc_points(turn, begin, end, self.source) / self.scale
        vectors = arc_vectors(list(self.rows.vectors[-3:]), self.vector, len(points))
        self.rows.add_all(points, vectors, kind, self.feeds.now, line)

    # Drilling

    def set_cycle(self, statement: Statement) -> None:
        """Take ``CYCLE``; ``CYCLE/OFF`` ends it, and ``CYCLE/ON`` takes up the last one."""
        if statement.minors in (["OFF"], ["NOMORE"]):
            self.cycle = None
            return
        if self.turn is not None:
            raise statement.error(self.source, "can't follow an arc that has no GOTO to end at")
        if statement.minors == ["ON"] and self.last_cycle is not None:
            self.cycle = self.last_cycle
            return
        self.cycle = self.last_cycle = read_cycle(statement, self.source)
        self.findings += remark_on_cycle(self.cycle, self.source)

    def _drill(self, cycle: Cycle, point: list[float], line: int) -> None:
        feed = self.feeds.now
        if cycle.feed is not None:
            number, unit = cycle.feed
            feed = self.feeds.convert([f"{number!r}", unit], cycle.statement.line, self.units) or feed
        for place, kind in hole_points(cycle, point, self.vector):
            self.rows.add(place, self.vector, kind, feed, line)
