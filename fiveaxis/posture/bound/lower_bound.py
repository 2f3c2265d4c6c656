"""A certified lower bound of what every posture costs, without any search.

A lattice is laid over all five axes. At some locations of the path, the visits, interval arithmetic encloses
every admissible posture in boxes of the lattice. Any path touches one of these boxes at every visit, and the
least cost of doing so is found exactly on corners of boxes (`sweep`), all axes together. Leaving locations
out only lowers it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.base import Array, Progress, unheard
from fiveaxis.model import (
    LEAST_OF_PIVOT,
    Machine,
    TiltBounds,
    Toolpath,
    feed_times,
    least_travel_costs,
    travel_costs,
)
from fiveaxis.posture.bound.cells import HUGE, AngleCells, Window, cut_cells, enclose
from fiveaxis.posture.bound.climb import FIRST_CELLS, FIRST_STEP, Climb, Level
from fiveaxis.posture.bound.corners import Lattice
from fiveaxis.posture.bound.crossing import Crossed, Visits, cross

# Work in all (`crossing`).
WORK = 1.6e10
# Mean step of the linear axes, in times of the rotary step on the radius of the path; and the power of an
# axis' price by which its step is finer.
LINEAR, FINENESS = 0.4, 0.75
# Steps of the first level over the range of a linear axis, at most.
MOST_STEPS = 64
# Share of cells beyond each end of the linear axes' range that may be left out.
LEFT_OUT = 0.02
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

    An axis of more than a turn counts as endless. Collisions aren't looked at; they only raise the cost. The
    bound is infinite if some location has no admissible posture.

    Parameters
    ----------
    toolpath, machine, tilt : the problem, n locations; inserted ones aren't visited
    turns : (n − 1,), rad, largest turn of each rotary axis in a move; unbounded by default
    work : corners and cells that may be looked at (`crossing`); more give a higher bound
    progress : called with what is being done, visits done and visits in all

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
    by_tip: bool = False,
    work: float = WORK,
    progress: Progress = unheard,
) -> LowerBound:
    """Bound from below ∫P dt of the feed drives over every such path, however fast it is followed.

    Travel is charged as little as it can cost (`fiveaxis.model.least_travel_costs`), and what drives draw at
    standstill for the least time at the programmed feed, which is that of the tip with `by_tip`. Drives with
    a constant power can't be charged where their highest speed isn't known. `MachineError` if the power of an
    axis isn't known, or nothing can be said about it. For the rest see `bound_travel`.
    """
    *costs, standing = least_travel_costs(machine)
    plus, minus = (np.tile(price, (len(toolpath) - 1, 1)) for price in costs)
    total, used = _least_cost(toolpath, machine, tilt, turns, (plus, minus), work, progress)
    least = LEAST_OF_PIVOT if by_tip else 1.0
    # Of a pivot beside the tool's axis the feed holds in cuts only.
    held = toolpath.cutting[1:] | (not toolpath.zone.offset)
    total += standing * least * float(feed_times(toolpath)[1:][held].sum())
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
    """Bound the cost of travel, J, at prices, (n − 1, k) J/mm and J/rad up and down, of each move.

    Where a drive returns power in one direction, the least prices of all moves are taken, and what it returns
    is charged to the other direction; what is left is in proportion to the way from begin to end. How many
    locations were visited is returned too.
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


def _climb(visits: Visits, work: float, progress: Progress) -> tuple[float, int]:
    """Find the highest bound, J, that an amount of work gives, and how many locations it visited."""
    count = len(visits.toolpath)
    if count == 0:
        return 0.0, 0
    first = Level.first(count)
    hull = hull_of(visits.every(first.stride))
    with threadpool_limits(limits=1), ThreadPoolExecutor(THREADS) as pool:

        def bound(level: Level) -> Crossed:
            return cross(visits.every(level.stride), *lay_lattice(visits, level, hull), pool, progress)

        best, found = Climb(bound, work).best(first)
    return found.total, len(visits.every(best.stride).toolpath)


def _ranges(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> list[tuple[Array, Array]]:
    """Enclose the linear axes in every cell that may be admissible at each location, (c, 3) mm each."""
    cells = cut_cells(machine, toolpath.zone, FIRST_STEP / FIRST_CELLS)
    window = Window.of(cells, tilt, machine, toolpath.zone.offset)
    return [(low, high) for _cell, low, high in enclose(cells, window, toolpath, tilt)]


def lay_lattice(visits: Visits, level: Level, hull: tuple[Array, Array]) -> tuple[AngleCells, Lattice]:
    """Cut the rotary angles into a level's cells, and lay its lattice over them and a hull."""
    width = level.step / level.cells
    cells = cut_cells(visits.machine, visits.toolpath.zone, width, level.cells)
    steps = _linear_steps(visits, level.step, hull)
    return cells, Lattice(cells.sides, (level.cells, level.cells), *hull, steps)


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


def _linear_steps(visits: Visits, step: float, hull: tuple[Array, Array]) -> Array:
    """Choose steps of the linear axes, (3,) mm, for one of the rotary angles: fine ones where travel is dear.

    The bound falls short by about price × step at every reversal of an axis.
    """
    price = (visits.plus + visits.minus)[:, 2:].mean(axis=0) if len(visits.plus) else np.ones(3)
    fineness = np.array([p**FINENESS for p in np.maximum(price, 1e-3 * price.max() or 1.0).tolist()])
    radius = np.linalg.norm(visits.toolpath.pivot, axis=1).max()
    steps = LINEAR * step * max(float(radius), 1.0) * np.prod(fineness) ** (1.0 / 3.0) / fineness
    return np.maximum(steps, (hull[1] - hull[0]) / MOST_STEPS * step / FIRST_STEP)
