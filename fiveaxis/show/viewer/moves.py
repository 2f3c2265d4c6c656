"""The motions shown: every move of the result's program and of its baselines, with what is read off them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, Severity, angle_between
from fiveaxis.model import (
    Energy,
    Fill,
    Machine,
    Motion,
    ProgramMotion,
    Steadiness,
    TiltBounds,
    Toolpath,
    interpolate,
    move_powers,
    tool_poses,
)
from fiveaxis.nc import Program
from fiveaxis.posture import RESULT

if TYPE_CHECKING:
    from fiveaxis.check import Report
    from fiveaxis.posture import Optimum

# Most rows of the result, and of a baseline, in a page; more are thinned evenly in time.
MOST_ROWS, MOST_BASELINE_ROWS = 200_000, 20_000
# Paths of contacts are lifted by this share of the tool's radius, or the part would hide half of every line.
LIFT = 0.04
NO_LINE = -1
# Rows: findings of one code that are nearer to each other are one run of them.
RUN = 8


class ShownProgram(Protocol):
    """A program to show: its moves, its text, and the locations that the path's blocks stand for."""

    @property
    def motion(self) -> ProgramMotion:
        """Its moves."""

    @property
    def text(self) -> Program:
        """Its lines."""

    @property
    def fill(self) -> Fill | None:
        """The locations that the blocks stand for; None for a motion without a path."""

    @property
    def report(self) -> Report:
        """What verification found in it, with the stock that it has cut."""


@dataclass(frozen=True, eq=False)
class Side:
    """A motion to show, and the path that it follows.

    Parameters
    ----------
    name : `RESULT`, or that of a baseline
    motion : m rows
    toolpath, tilt : n locations and the bounds on the tool axis there
    place : (m,), row of the path at each row of the motion: 3.25 is a quarter of the move from 3 to 4
    energy, time : J, s; of the program without approach and retract
    steadiness : of the same blocks, with times from the first row
    line : (m,), of the program's text, where the move ends; `NO_LINE` for none
    tool : (m,), which of several tools moves; None for one
    """

    name: str
    motion: Motion
    toolpath: Toolpath
    tilt: TiltBounds
    place: Array
    energy: float
    time: float
    steadiness: Steadiness
    line: IntArray
    tool: IntArray | None = None

    @property
    def clock(self) -> Array:
        """(m,), s: when each row is reached; a second a row if no move takes time."""
        clock: Array = np.cumsum(self.motion.time)
        return clock if clock[-1] > 0.0 else np.arange(len(clock), dtype=float)

    @property
    def on_path(self) -> BoolArray:
        """(m,), whether a row is on the path, and not before it or after it."""
        moving = np.diff(self.place, prepend=self.place[0] - 1.0) > 0.0
        return np.asarray(moving)

    def at(self, rows: IntArray) -> Side:
        """Return some rows, with the time of those left out added to the next."""
        motion = replace(self.motion.at(rows), time=np.diff(self.clock[rows], prepend=0.0))
        tool = None if self.tool is None else self.tool[rows]
        return replace(self, motion=motion, place=self.place[rows], line=self.line[rows], tool=tool)

    def row_of(self, finding: Finding) -> int | None:
        """Return the row at which a finding's location is reached; None if it has none."""
        location = finding.place.location
        if location is None or not 0 <= location < len(self.toolpath):
            return None
        return int(np.searchsorted(self.place, location).clip(0, len(self.place) - 1))


def choose_sides(solution: Optimum, program: ShownProgram | None = None) -> tuple[Side, ...]:
    """Return the result, as its program moves if one is given, and its baselines; the dearest ones last."""
    path, tilt = solution.toolpath, solution.tilt
    sides = [thinned(whole_result(solution, program), MOST_ROWS)]
    for name, baseline in sorted(solution.compared.items(), key=lambda item: item[1].energy.total):
        own, bounds = baseline.toolpath, tilt
        if own is not None:
            # The bounds belong to the locations of the result's path.
            reference = own.normal if tilt.name == "normal" else np.full_like(own.normal, np.nan)
            bounds = replace(tilt, reference=reference, beside=())
        side = _side(name, solution.timed(name), own or path, bounds, baseline.energy)
        sides.append(thinned(side, MOST_BASELINE_ROWS))
    return tuple(sides)


def whole_result(solution: Optimum, program: ShownProgram | None) -> Side:
    """Return all rows of the result, as its program moves if one is given."""
    path, tilt = solution.toolpath, solution.tilt
    return _program_side(solution, program) or _side(RESULT, solution.timed(), path, tilt, solution.energy)


def _side(name: str, motion: Motion, path: Toolpath, tilt: TiltBounds, energy: Energy) -> Side:
    rows, line = np.arange(len(motion), dtype=float), np.full(len(motion), NO_LINE)
    return Side(name, motion, path, tilt, rows, energy.total, energy.time, energy.steadiness, line)


def _program_side(solution: Optimum, program: ShownProgram | None) -> Side | None:
    """Return the moves of the result's program; None without one that stands for the result's path."""
    if program is None or program.fill is None:
        return None
    moves, fill = program.motion, program.fill
    if len(fill.given) != len(solution.toolpath):
        return None
    inner = np.clip(np.arange(len(moves)) - moves.first, 0, len(fill.kept) - 1)
    line = np.full(len(moves), NO_LINE)
    rows = np.array(program.text.rows, dtype=np.int64)
    # The first line at a row is the block that moves there.
    numbers = np.flatnonzero(rows >= 0)[::-1]
    line[rows[numbers]] = numbers + 1
    place = fill.row[fill.kept[inner]]
    motion = solution.clock.timed(moves.motion, solution.machine)
    found = _side(RESULT, motion, solution.toolpath, solution.tilt, solution.energy)
    # Events are counted once, where the program is priced: in an operation's text also before its path.
    events, begin = solution.energy.steadiness, motion.time[: moves.first + 1].sum()
    at = np.clip(begin + events.time, 0.0, motion.time.sum())
    return replace(found, place=place, line=line, steadiness=replace(events, time=at))


def thinned(side: Side, most: int) -> Side:
    """Return a side with at most so many rows, evenly in time."""
    if len(side.motion) <= most:
        return side
    clock = side.clock
    wanted = np.linspace(clock[0], clock[-1], most)
    rows = np.unique(np.searchsorted(clock, wanted).clip(0, len(clock) - 1))
    rows[0], rows[-1] = 0, len(clock) - 1
    return side.at(rows)


@dataclass(frozen=True, eq=False)
class Stop:
    """Where a motion may stop: the first row of a run of errors, or of warnings, of one code."""

    row: int
    finding: Finding
    count: int

    def as_list(self) -> list[Any]:
        """Return row, rank of the severity and text, as plain data for JSON."""
        finding = self.finding.portable()
        more = f" (and {self.count - 1} more in a row)" if self.count > 1 else ""
        return [self.row, finding.severity.rank, f"{finding.severity}: {finding.message}{more}"]


def find_stops(findings: Sequence[Finding], side: Side) -> list[Stop]:
    """List where errors and warnings begin, along the motion."""
    found: dict[str, dict[int, Finding]] = {}
    for finding in findings:
        row = side.row_of(finding)
        if row is not None and finding.severity is not Severity.NOTE:
            found.setdefault(finding.code, {}).setdefault(row, finding)
    stops = []
    for of_code in found.values():
        rows = np.array(sorted(of_code))
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > RUN) + 1):
            stops.append(Stop(int(run[0]), of_code[int(run[0])], len(run)))
    return sorted(stops, key=lambda stop: (stop.row, stop.finding.severity.rank))


def read_off(side: Side, machine: Machine) -> dict[str, Array]:
    """Compute what is read off a side at each row, of the move that ends there.

    Returns
    -------
    points : (m, 3), mm, workpiece frame, where the path is drawn
    powers : (m, k), W, of each drive
    programmed, actual : (m,), mm/min, feed along the path: programmed, and by the move's duration; 0 for a
        rapid move or none
    lean : (m,), deg, between tool axis and the reference of the tilt; NaN where there is none
    """
    motion, path = side.motion, side.toolpath
    tip, axis = tool_poses(machine, motion.positions)
    points = interpolate(shown_points(path), side.place)
    off = _off_path(side)
    points[off] = tip[off]
    travelled = interpolate(np.cumsum(path.lengths)[:, None], side.place)[:, 0]
    length = np.where(off, np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1), 0.0)
    length += np.where(off, 0.0, np.diff(travelled, prepend=travelled[:1]))
    moving = (motion.time > 0.0) & ~motion.rapid
    actual = np.divide(60.0 * length, motion.time, out=np.zeros(len(length)), where=moving)
    lean = np.degrees(angle_between(interpolate(side.tilt.reference, side.place), axis))
    lean[off] = np.nan
    powers = move_powers(machine, motion) if machine.has_powers else np.zeros_like(motion.positions)
    programmed = np.where(moving, 60.0 * motion.feed, 0.0)
    return {"points": points, "powers": powers, "programmed": programmed, "actual": actual, "lean": lean}


def _off_path(side: Side) -> Array:
    """Find the rows, (m,), before the first location and after the last."""
    first, last = np.flatnonzero(side.place == side.place[0]), np.flatnonzero(side.place == side.place[-1])
    off = np.zeros(len(side.place), dtype=bool)
    off[first[:-1]] = True
    off[last[1:]] = len(last) < len(side.place)
    return off


def shown_points(path: Toolpath) -> Array:
    """Return the points to draw, (n, 3) mm: contacts, slightly lifted, or pivots if a cut has none."""
    lifted: Array = path.contact + LIFT * path.tool.radius * path.normal
    if not np.isfinite(lifted[path.cutting]).all():
        return path.pivot
    return np.where(np.isfinite(lifted).all(axis=1, keepdims=True), lifted, path.pivot)
