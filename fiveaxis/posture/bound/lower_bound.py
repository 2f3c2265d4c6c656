"""A certified lower bound of what every posture costs, without any search.

A lattice is laid over all five axes. At some locations of the path, the visits, interval arithmetic encloses
every admissible posture in boxes of the lattice. Any path touches one of these boxes at every visit, and the
least cost of doing so is found exactly on corners of boxes (`sweep`), all axes together. Leaving locations
out only lowers it. More visits and a finer lattice raise the bound, so both grow while a fixed amount of work
lasts.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import least_travel_costs, travel_costs
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import feed_times
from fiveaxis.posture.bound.cells import HUGE, Cells, cut_cells
from fiveaxis.posture.bound.corners import Lattice
from fiveaxis.posture.bound.crossing import CHUNK, Crossed, cross
from fiveaxis.posture.bound.enclosures import enclose
from fiveaxis.posture.bound.visits import Visits
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import TiltBounds, Toolpath

# Corners, sources and cells that may be looked at, in all.
WORK = 1e10
# The first level: rad, width of its cells, and its number of visits.
FIRST_CELL, FIRST_VISITS = np.radians(4.0), 60
# Cells in a step of a rotary angle.
FACTOR = 4
# Mean step of the linear axes, in times of a cell's width on the radius of the path; and the power of an
# axis' price by which its step is finer.
LINEAR, FINENESS = 1.6, 0.75
# Width of a finer level's cells, in times of the level before; its work, and that of half the stride, at
# least.
FINER, COSTS = 0.7, {"finer": 2.5, "denser": 2.0}
# Corners of a visit, and cells of the rotary angles, that fit into memory; how many times as many a finer
# level may have.
MOST_CORNERS, MOST_CELLS = 2e7, 6e5
MORE_CORNERS, MORE_CELLS = {"finer": 4.0, "denser": 1.0}, {"finer": FINER**-2, "denser": 1.0}
# Steps of the first level over the range of a linear axis, at most.
MOST_STEPS = 64
# Share of cells beyond each end of the linear axes' range that may be left out.
LEFT_OUT = 0.02
# Share by which a level has to raise the bound for another one of its kind.
WORTHWHILE = 2e-3
THREADS = 2


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
        return {"total": self.total, "of": self.of, "visits": self.visits}


@dataclass(frozen=True)
class Level:
    """How finely a path is bounded.

    Parameters
    ----------
    cell : rad, width of the cells in which postures are enclosed
    stride : of the visits
    """

    cell: float
    stride: int

    def next(self, kind: str) -> Level:
        """Take smaller cells, with the linear steps (``finer``), or half the stride (``denser``)."""
        if kind == "finer":
            return replace(self, cell=FINER * self.cell)
        return replace(self, stride=max(self.stride // 2, 1))


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

    An axis of more than a turn counts as endless. Collisions aren't looked at; they only raise the cost.

    Parameters
    ----------
    toolpath, machine, tilt : the problem, n locations; inserted ones aren't visited
    turns : (n − 1,), rad, largest turn of each rotary axis in a move; unbounded by default
    work : corners, sources and cells that may be looked at; more give a higher bound
    progress : called with what is being done, visits done and visits in all

    Returns
    -------
    The bound; infinite if some location has no admissible posture

    Raises
    ------
    MachineError
        The power of an axis isn't known.
    """
    plus, minus = travel_costs(machine, toolpath.feed, toolpath.rapid)
    total, used = _least_cost(toolpath, machine, tilt, turns, (plus[1:], minus[1:]), work, progress)
    return LowerBound(max(total, 0.0), "travel", used)


def bound_energy(
    toolpath: Toolpath,
    machine: Machine,
    tilt: TiltBounds,
    turns: Array | None = None,
    *,
    work: float = WORK,
    progress: Progress = unheard,
) -> LowerBound:
    """Bound from below ∫P dt of the feed drives over every such path, however fast it is followed.

    Travel is charged as little as it can cost (`fiveaxis.energy.least_travel_costs`), and what drives draw at
    standstill for the time at the programmed feed. Drives with a constant power can't be charged where their
    highest speed isn't known.

    Parameters
    ----------
    toolpath, machine, tilt, turns, work, progress : as for `bound_travel`

    Raises
    ------
    MachineError
        The power of an axis isn't known, or nothing can be said about it (`least_travel_costs`).
    """
    costs = least_travel_costs(machine)
    each = (len(toolpath) - 1, 1)
    prices = np.tile(costs.plus, each), np.tile(costs.minus, each)
    total, used = _least_cost(toolpath, machine, tilt, turns, prices, work, progress)
    total += costs.standing * float(feed_times(toolpath)[1:].sum())
    return LowerBound(max(total, 0.0), "energy", used)


def _least_cost(
    toolpath: Toolpath,
    machine: Machine,
    tilt: TiltBounds,
    turns: Array | None,
    prices: tuple[Array, Array],
    work: float,
    progress: Progress,
) -> tuple[float, int]:
    """Bound the cost of travel at prices, (n − 1, k) J/mm and J/rad up and down, of each move.

    Where a drive returns power in one direction, the least prices of all moves are taken, and what it returns
    is charged to the other direction; what is left is in proportion to the way from begin to end.

    Returns
    -------
    The bound, J, and how many locations it visited
    """
    plus, minus = prices
    least_plus, least_minus = plus.min(axis=0, initial=np.inf), minus.min(axis=0, initial=np.inf)
    returns = np.minimum(least_plus, least_minus) < 0.0
    if (returns & (least_plus + least_minus < 0.0)).any():
        return 0.0, 0  # going up and down would pay
    shift = np.where(returns, np.where(least_plus < 0.0, least_plus, -least_minus), 0.0)
    plus = np.where(returns, least_plus - shift, plus)
    minus = np.where(returns, least_minus + shift, minus)
    total, used = _climb(Visits.of(toolpath, machine, tilt, (plus, minus), turns), work, progress)
    if np.isfinite(total) and returns.any():
        total += _least_way(toolpath, machine, tilt, shift)
    return total, used


def _least_way(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, shift: Array) -> float:
    """Least of ``Σ shift·(end − begin)`` over the axes, J, from the first location to the last one."""
    way = np.array(
        [-np.sign(s) * a.limits.span if s else 0.0 for s, a in zip(shift, machine.axes, strict=True)]
    )
    linear = machine.linear_columns
    ends = np.array([0, len(toolpath) - 1])
    (low, high), (last_low, last_high) = _ranges(toolpath.at(ends), machine, tilt.at(ends))
    fall, rise = last_low.min(axis=0) - high.max(axis=0), last_high.max(axis=0) - low.min(axis=0)
    way[linear] = np.where(shift[linear] > 0.0, fall, rise)
    return float((shift * way)[shift != 0.0].sum())


def _climb(visits: Visits, most: float, progress: Progress) -> tuple[float, int]:
    """Raise the bound by finer lattices or more visits, whichever promises more, while the work lasts.

    Returns
    -------
    The highest bound, J, and how many locations it visited
    """
    count = len(visits.toolpath)
    if count == 0:
        return 0.0, 0
    first = Level(FIRST_CELL, max(count // FIRST_VISITS, 1))
    hull = hull_of(visits.every(first.stride))
    with threadpool_limits(limits=1), ThreadPoolExecutor(THREADS) as pool:

        def bound(level: Level) -> Crossed:
            chosen = visits.every(level.stride)
            return cross(chosen, *lay_lattice(visits, level.cell, hull), pool, progress)

        climb = _Climb(most, first, {first: bound(first)})
        while (step := climb.step()) is not None:
            climb.take(*step, bound)
    best = max(climb.known, key=lambda level: climb.known[level].total)
    return climb.known[best].total, len(visits.every(best.stride).toolpath)


@dataclass
class _Climb:
    """Levels whose bounds are known, and which one is worth the work next.

    Parameters
    ----------
    most : work in all
    here : level from which the next ones are tried
    known : the bound of each level
    rates : what the last step of each kind gave, growth of the bound per growth of the work, in logarithms
    costs : work of the last step of each kind, in times of the level before
    """

    most: float
    here: Level
    known: dict[Level, Crossed]
    rates: dict[str, float] = field(default_factory=lambda: dict.fromkeys(COSTS, np.inf))
    costs: dict[str, float] = field(default_factory=COSTS.copy)

    def step(self) -> tuple[Level, str] | None:
        """Choose the next step: from the present level, else from any one that promises a higher bound."""
        best = max(found.total for found in self.known.values())
        if not 0.0 < best < np.inf:
            return None
        kinds = [kind for kind in COSTS if self._is_possible(self.here, kind)]
        kind = max(kinds, key=self.rates.__getitem__, default=None)
        if kind is not None and self.rates[kind] >= WORTHWHILE:
            return self.here, kind
        others = {
            (level, kind): found.total * self.costs[kind] ** self.rates[kind]
            for level, found in self.known.items()
            for kind in COSTS
            if np.isfinite(self.rates[kind]) and self._is_possible(level, kind)
        }
        promising = max(others, key=others.__getitem__, default=None)
        worth = promising is not None and others[promising] > best * self.costs[promising[1]] ** WORTHWHILE
        return promising if worth else None

    def take(self, level: Level, kind: str, bound: Callable[[Level], Crossed]) -> None:
        """Take a step, and go on from its level unless another kind of step gave more."""
        there = level.next(kind)
        before, found = self.known[level], bound(there)
        self.known[there] = found
        self.costs[kind] = max(found.work / before.work, COSTS[kind])
        self.rates[kind] = np.log(max(found.total / before.total, 1.0)) / np.log(self.costs[kind])
        finite = [rate for rate in self.rates.values() if np.isfinite(rate)]
        if level != self.here or self.rates[kind] >= max(finite):
            self.here = there

    def _is_possible(self, level: Level, kind: str) -> bool:
        """Check whether a step leads to a level that isn't known, and its work and memory are there."""
        found, spent = self.known[level], sum(each.work for each in self.known.values())
        enough = spent + self.costs[kind] * found.work <= self.most
        fits = (
            MORE_CORNERS[kind] * found.most <= MOST_CORNERS and MORE_CELLS[kind] * found.cells <= MOST_CELLS
        )
        return enough and fits and level.next(kind) not in self.known


def _ranges(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> list[tuple[Array, Array]]:
    """Enclose the linear axes in every cell that may be admissible at each location, (c, 3) mm each."""
    cells = cut_cells(machine, toolpath.zone, FIRST_CELL)
    chunks = np.array_split(np.arange(len(toolpath)), -(-len(toolpath) // CHUNK))
    every = (one for rows in chunks for one in enclose(cells, toolpath.at(rows), tilt.at(rows), machine))
    return [(one.low, one.high) for one in every]


def lay_lattice(visits: Visits, cell: float, hull: tuple[Array, Array]) -> tuple[Cells, Lattice]:
    """Cut the rotary angles into cells of a width, rad, and lay the lattice over them and a hull."""
    cells = cut_cells(visits.machine, visits.toolpath.zone, cell, FACTOR)
    return cells, Lattice(cells.sides, (FACTOR, FACTOR), *hull, _linear_steps(visits, cell, hull))


def hull_of(visits: Visits) -> tuple[Array, Array]:
    """Find between which values the linear axes are in most cells at some visits, (3,) mm each.

    Paths are moved onto this hull, which makes none longer, so it may leave something out: cells in which
    the axes go far, next to postures in which they can't reach the part.
    """
    low, high = (
        np.concatenate(ends)
        for ends in zip(*_ranges(visits.toolpath, visits.machine, visits.tilt), strict=True)
    )
    if len(low) == 0:
        return np.zeros(3), np.zeros(3)
    least, most = np.quantile(low, LEFT_OUT, axis=0), np.quantile(high, 1.0 - LEFT_OUT, axis=0)
    known = (least > -0.5 * HUGE) & (most < 0.5 * HUGE)
    return np.where(known, least, 0.0), np.where(known, most, 0.0)


def _linear_steps(visits: Visits, cell: float, hull: tuple[Array, Array]) -> Array:
    """Choose steps of the linear axes, (3,) mm: fine ones where travel is dear.

    The bound falls short by about price × step at every reversal of an axis.
    """
    price = (visits.plus + visits.minus)[:, 2:].mean(axis=0) if len(visits.plus) else np.ones(3)
    fineness = np.maximum(price, 1e-3 * price.max() or 1.0) ** FINENESS
    radius = np.linalg.norm(visits.toolpath.pivot, axis=1).max()
    steps = LINEAR * cell * max(float(radius), 1.0) * np.prod(fineness) ** (1.0 / 3.0) / fineness
    return np.maximum(steps, (hull[1] - hull[0]) / MOST_STEPS * cell / FIRST_CELL)
