"""A certified lower bound of what every posture costs, without any search.

At some locations of the path, the visits, interval arithmetic encloses every admissible posture in boxes of a
lattice over all five axes. Any path touches one of these boxes at every visit, and the least cost of doing so
is found exactly, on corners of boxes (`sweep`). Leaving locations out only lowers it.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.base import (
    STAGES,
    Array,
    Finding,
    IntArray,
    MachineError,
    Objective,
    Progress,
    Severity,
    product,
    unheard,
)
from fiveaxis.model import (
    LEAST_OF_PIVOT,
    Constraints,
    Interpolation,
    Machine,
    TiltBounds,
    Toolpath,
    feed_times,
    least_travel_costs,
    travel_costs,
)
from fiveaxis.posture.bound.cells import HUGE, AngleCells, Window, cut_cells, enclose
from fiveaxis.posture.bound.climb import FIRST_CELLS, FIRST_STEP, Climb, Crossed, Level
from fiveaxis.posture.bound.corners import FAR, Corners, Lattice
from fiveaxis.posture.bound.sweep import ACROSS, Neighbours, Prices, find_sources, grouped, reach
from fiveaxis.posture.strategy.rotary_bounds import turn_bounds

if TYPE_CHECKING:
    from fiveaxis.posture.solution import Optimum

    Found = TypeVar("Found", bound=Optimum)

# Parts into which the groups of a visit are divided for threads; locations that are enclosed at once, so that
# their cells stay in the processor's cache, and how many such chunks ahead.
SLICES, CHUNK, AHEAD = 8, 4, 3
# Work is counted in times of a source that is looked at, 6 ns where they were measured. As many times take: a
# cell of the rotary angles in all, at each visit, and where postures are enclosed in it; a corner; a visit.
CUT, CELL, ENCLOSED, CORNER, VISIT = 900, 1, 13, 8, 130_000
# Work in all.
WORK = 1.6e10
# Mean step of the linear axes, in times of the rotary step on the radius of the path; and the power of an
# axis' price by which its step is finer.
LINEAR, FINENESS = 0.4, 0.75
# Steps of the first level over the range of a linear axis, at most.
MOST_STEPS = 64
# Share of cells beyond each end of the linear axes' range that may be left out.
LEFT_OUT = 0.02
# rad: rounding of a turn.
THREADS, SAME_TURN = 2, 1e-6


@dataclass(frozen=True)
class LowerBound:
    """A cost that no admissible path is below.

    Parameters
    ----------
    total : J; infinite if some location has no admissible posture
    of : what is bounded, the ``travel`` metric or the feed drives' ``energy``
    visits : number of locations used
    """

    total: float
    of: Literal["travel", "energy"]
    visits: int

    def gap(self, cost: float) -> float:
        """Compute the share of a cost above the bound: 0 proves an optimum."""
        return 1.0 - self.total / cost if cost > 0.0 else 0.0

    def in_words(self, cost: float) -> str:
        """Say how much of a cost any posture could save at most."""
        what = "the travel metric" if self.of == "travel" else "the feed drives' energy"
        if self.total <= 0.0:
            return f"nothing is known of how much any posture could still save of {what}"
        return f"at most {self.gap(cost):.1%} of {what} could still be saved by any posture"

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return asdict(self)


def bound_travel(
    toolpath: Toolpath,
    machine: Machine,
    tilt: TiltBounds,
    turns: Array | None = None,
    *,
    work: float = WORK,
    progress: Progress = unheard,
) -> LowerBound:
    """Bound from below the travel metric of every path that keeps the lean, the axis limits and the turns.

    It is infinite if some location has no admissible posture. An axis of more than a turn counts as endless;
    collisions, which only raise the cost, aren't looked at.

    Parameters
    ----------
    toolpath, machine, tilt : the problem, n locations; inserted ones aren't visited
    turns : (n − 1,), rad, largest turn of each rotary axis in a move; unbounded by default
    work : corners and cells that may be looked at; more give a higher bound
    progress : called with what is being done, visits done and visits in all

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    """
    plus, minus = travel_costs(machine, toolpath.feed, toolpath.rapid)
    path = Visits.of(toolpath, machine, tilt, (plus[1:], minus[1:]), turns)
    total, used = _least_cost(path, work, progress)
    return LowerBound(max(total, 0.0), "travel", used)


def bound_energy(
    toolpath: Toolpath,
    machine: Machine,
    tilt: TiltBounds,
    turns: Array | None = None,
    *,
    by_tip: bool = False,
    work: float = WORK,
    progress: Progress = unheard,
) -> LowerBound:
    """Bound from below ∫P dt of the feed drives over every such path, however fast it is followed.

    Travel is charged as little as it can cost (`fiveaxis.model.least_travel_costs`), and what drives draw at
    standstill for the least time at the programmed feed, which is that of the tip with `by_tip`. A drive's
    constant power is charged where its highest speed is known. `MachineError` if nothing can be said about an
    axis's power. For the rest see `bound_travel`.
    """
    *costs, standing = least_travel_costs(machine)
    plus, minus = (np.tile(price, (len(toolpath) - 1, 1)) for price in costs)
    path = Visits.of(toolpath, machine, tilt, (plus, minus), turns)
    total, used = _least_cost(path, work, progress)
    least = LEAST_OF_PIVOT if by_tip else 1.0
    # Of a pivot beside the tool's axis the feed holds in cuts only.
    held = toolpath.cutting[1:] | (not toolpath.zone.offset)
    total += standing * least * float(feed_times(toolpath)[1:][held].sum())
    return LowerBound(max(total, 0.0), "energy", used)


def with_bound(
    found: Found, constraints: Constraints, objective: Objective, progress: Progress = unheard
) -> Found:
    """Add a certified lower bound of a solution's energy, or of its travel metric if that is the objective.

    It holds for every posture that keeps the constraints on lean and turns, and the axis limits; collisions,
    mask and singular cone only raise the cost. A machine whose drives allow no bound gets a finding.
    """
    by_tip = found.filling.interpolation is Interpolation.TCP
    bound = bound_travel if objective == "travel" else partial(bound_energy, by_tip=by_tip)
    path, turns = found.toolpath, _largest_turns(found, constraints)
    try:
        return replace(found, bound=bound(path, found.machine, found.tilt, turns, progress=progress))
    except MachineError as error:
        finding = Finding(Severity.NOTE, "no-bound", f"has no lower bound: {error}", path.place(0))
        return replace(found, toolpath=replace(path, findings=(*path.findings, finding)))


def _largest_turns(found: Optimum, constraints: Constraints) -> Array | None:
    """Largest turn in each move of a solution, rad; on links, and where an axis rewinds, there is none."""
    if found.unwrapped is not None:
        return None
    path, location = found.toolpath, found.motion.location
    turns = turn_bounds(path, constraints, location)
    own = np.abs(found.motion.moves[1:, found.machine.rotary_columns]).max(axis=1, initial=0.0)
    if constraints.max_turn is None and (path.cutting[1:] & (own > turns + SAME_TURN)).any():
        turns = turn_bounds(path, constraints, location, found.machine)
    return np.where(path.cutting[1:], turns, np.inf)


def _least_cost(path: Visits, work: float, progress: Progress) -> tuple[float, int]:
    """Find the highest bound on the cost of travel, J, that an amount of work gives; also count the visits.

    Where a drive returns power in one direction, the least prices of all moves are taken, and what it returns
    is charged to the other direction; what is left is in proportion to the way from begin to end.
    """
    plus, minus = path.plus, path.minus
    least_plus, least_minus = plus.min(axis=0, initial=np.inf), minus.min(axis=0, initial=np.inf)
    returns = np.minimum(least_plus, least_minus) < 0.0
    if (returns & (least_plus + least_minus < 0.0)).any():
        return 0.0, 0  # going up and down would pay
    shift = np.where(returns, np.where(least_plus < 0.0, least_plus, -least_minus), 0.0)
    plus = np.where(returns, least_plus - shift, plus)
    minus = np.where(returns, least_minus + shift, minus)
    visits = replace(path, plus=plus, minus=minus).binding
    first = Level.first(len(visits.toolpath))
    hull = hull_of(visits.every(first.stride))
    with threadpool_limits(limits=1), ThreadPoolExecutor(THREADS) as pool:

        def bound(level: Level) -> Crossed:
            cells = cut_cells(visits.machine, visits.toolpath.zone, level.step / level.cells, level.cells)
            lattice = Lattice(cells.sides, level.cells, *hull, _linear_steps(visits, level.step, hull))
            return cross(visits.every(level.stride), cells, lattice, pool, progress)

        best, found = Climb(bound, work).best(first)
    way = _least_way(path, shift) if np.isfinite(found.total) and returns.any() else 0.0
    return found.total + way, len(visits.every(best.stride).toolpath)


def _least_way(path: Visits, shift: Array) -> float:
    """Least of ``Σ shift·(end − begin)`` over the axes, J, from the first location to the last one."""
    machine = path.machine
    columns = [*machine.rotary_columns, *machine.linear_columns]
    spans = np.array([machine.axes[column].limits.span for column in columns])
    way, ends = -np.sign(shift) * np.where(shift == 0.0, 0.0, spans), np.array([0, len(path.toolpath) - 1])
    (low, high), (last_low, last_high) = _ranges(machine, path.toolpath.at(ends), path.tilt.at(ends))
    fall, rise = last_low.min(axis=0) - high.max(axis=0), last_high.max(axis=0) - low.min(axis=0)
    way[2:] = np.where(shift[2:] > 0.0, fall, rise)
    return float((shift * way)[shift != 0.0].sum())


def _ranges(machine: Machine, toolpath: Toolpath, tilt: TiltBounds) -> list[tuple[Array, Array]]:
    """Enclose the linear axes in every cell that may be admissible at each location, (c, 3) mm each."""
    cells = cut_cells(machine, toolpath.zone, FIRST_STEP / FIRST_CELLS)
    window = Window.of(cells, tilt, machine, toolpath.zone.offset)
    return [(low, high) for _cell, low, high in enclose(cells, window, toolpath, tilt)]


def hull_of(visits: Visits) -> tuple[Array, Array]:
    """Find between which values the linear axes are in most cells at some visits, (3,) mm each.

    Paths are moved onto this hull, which makes none longer, so a few cells with far axes may be left out.
    """
    ranges = _ranges(visits.machine, visits.toolpath, visits.tilt)
    low, high = (np.concatenate(ends) for ends in zip(*ranges, strict=True))
    if len(low) == 0:
        return np.zeros(3), np.zeros(3)
    least, most = np.quantile(low, LEFT_OUT, axis=0), np.quantile(high, 1.0 - LEFT_OUT, axis=0)
    known = (least > -0.5 * HUGE) & (most < 0.5 * HUGE)
    return np.where(known, least, 0.0), np.where(known, most, 0.0)


def _linear_steps(visits: Visits, step: float, hull: tuple[Array, Array]) -> Array:
    """Choose the linear axes' steps, (3,) mm: each reversal costs the bound about price × step."""
    price = (visits.plus + visits.minus)[:, 2:].mean(axis=0) if len(visits.plus) else np.ones(3)
    fineness = np.array([p**FINENESS for p in np.maximum(price, 1e-3 * price.max() or 1.0).tolist()])
    radius = np.linalg.norm(visits.toolpath.pivot, axis=1).max()
    steps = LINEAR * step * max(float(radius), 1.0) * np.prod(fineness) ** (1.0 / 3.0) / fineness
    return np.maximum(steps, (hull[1] - hull[0]) / MOST_STEPS * step / FIRST_STEP)


@dataclass(frozen=True, eq=False)
class Visits:
    """Locations that a path has to visit, in order; both rotary axes come before the linear ones.

    Prices, (m − 1, 5) J/rad and J/mm, are the least of travel between a visit and the next; turns, (m − 1,)
    rad, the most of each rotary axis there, infinite where unbounded.
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    plus: Array
    minus: Array
    turn: Array

    @classmethod
    def of(
        cls,
        path: Toolpath,
        machine: Machine,
        tilt: TiltBounds,
        prices: tuple[Array, Array],
        turns: Array | None,
    ) -> Visits:
        """Take all locations of a path; turns are as for `bound_travel`.

        Prices are (n − 1, k) each, J/mm and J/rad, while axis values grow and fall, in machine axis order.
        """
        plus, minus = (price[:, [*machine.rotary_columns, *machine.linear_columns]] for price in prices)
        turn = np.full(len(path) - 1, np.inf) if turns is None else turns
        return cls(machine, path, tilt, plus, minus, turn)

    @property
    def binding(self) -> Visits:
        """The given locations at which a direction binds the tool axis."""
        binds = np.any([np.isfinite(bound.reference[:, 0]) for bound in self.tilt.all], axis=0)
        return self.at(np.flatnonzero(binds & ~self.toolpath.inserted))

    def at(self, rows: IntArray) -> Visits:
        """Return some of the visits, given by their indices in ascending order."""
        between = slice(rows[0], rows[-1])
        plus, minus, turn = self.plus[between], self.minus[between], self.turn[between]
        if len(rows) > 1:
            begin = rows[:-1] - rows[0]
            plus, minus = np.minimum.reduceat(plus, begin), np.minimum.reduceat(minus, begin)
            turn = np.add.reduceat(turn, begin)
        some = self.toolpath.at(rows), self.tilt.at(rows)
        return Visits(self.machine, *some, plus, minus, turn)

    def every(self, stride: int) -> Visits:
        """Return each `stride`-th visit, and the last."""
        count = len(self.turn) + 1
        return self.at(np.unique(np.append(np.arange(0, count, stride), count - 1)))


def cross(
    visits: Visits, cells: AngleCells, lattice: Lattice, pool: ThreadPoolExecutor, progress: Progress
) -> Crossed:
    """Find the least cost of touching a box at every visit; prices are rounded down, so it isn't too high."""
    count = len(visits.toolpath)
    dearest = np.maximum(visits.plus, visits.minus).max(axis=0, initial=0.0)
    # From one end of the lattice to the other, or more.
    across = np.array([*lattice.counts, *np.ceil((lattice.high - lattice.low) / lattice.step) + 1.0])
    quantum = float(product(lattice.steps * across, dearest)) / ACROSS or 1.0
    total, most, work = 0, 0, CUT * len(cells.axis) + (VISIT + CELL * len(cells.axis)) * count
    before: Corners | None = None
    for i, corners in enumerate(_touched(visits, cells, lattice, pool)):
        progress(STAGES["bound"], i, count)
        work += ENCLOSED * corners.cells + CORNER * len(corners.cost)
        most = max(most, len(corners.cost))
        if before is None:
            corners.cost[corners.touched] = 0
        else:
            step = visits.plus[i - 1], visits.minus[i - 1], float(visits.turn[i - 1])
            prices = Prices.of(lattice, *step, quantum)
            near = Neighbours.of(lattice, prices, corners.group)
            found = [pool.submit(find_sources, before, prices, near, *part) for part in _parts(before)]
            columns = zip(*(job.result() for job in found), strict=True)
            sources = grouped(before, *(np.concatenate(column) for column in columns))
            jobs = [pool.submit(reach, corners, sources, prices, *part) for part in _parts(corners)]
            work += sum(job.result() for job in jobs)
        least = int(corners.cost.min(initial=FAR))
        if least >= FAR:
            return Crossed(np.inf, work, most, len(cells.axis))
        total, before = total + least, corners
    return Crossed(total * quantum, work, most, len(cells.axis))


def _parts(corners: Corners) -> list[tuple[int, int]]:
    """Divide the groups of a visit for threads."""
    ends = np.linspace(0, len(corners.at), SLICES + 1).astype(int).tolist()
    return [(a, b) for a, b in itertools.pairwise(ends) if b > a]


def _touched(
    visits: Visits, cells: AngleCells, lattice: Lattice, pool: ThreadPoolExecutor
) -> Iterator[Corners]:
    """Find the corners that each visit touches; those of the next chunks while one is worked on."""
    window = Window.of(cells, visits.tilt, visits.machine, visits.toolpath.zone.offset)

    def find(rows: IntArray) -> list[Corners]:
        some = visits.toolpath.at(rows), visits.tilt.at(rows)
        return [lattice.touch(enclosed) for enclosed in enclose(cells, window, *some)]

    count = len(visits.toolpath)
    chunks = iter(np.array_split(np.arange(count), -(-count // CHUNK)))
    coming = deque(pool.submit(find, chunk) for chunk in itertools.islice(chunks, AHEAD))
    while coming:
        found = coming.popleft().result()
        coming.extend(pool.submit(find, chunk) for chunk in itertools.islice(chunks, 1))
        yield from found
