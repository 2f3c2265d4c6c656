"""The path that the lower bound is the cost of, as a start for the refinement.

It touches a box of the lattice at every visit, and keeps the contact only as far as the boxes do: its rotary
angles are those of corners of boxes. But it is the cheapest of all such paths, so near it are good ones.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.geometry import Array, IntArray, product
from fiveaxis.posture.bound.climb import Level
from fiveaxis.posture.bound.corners import FAR, Corners
from fiveaxis.posture.bound.crossing import reach_visits
from fiveaxis.posture.bound.lower_bound import THREADS, hull_of, lay_lattice
from fiveaxis.posture.bound.sweep import Prices, Sources, quantum_of
from fiveaxis.posture.bound.visits import Visits
from fiveaxis.posture.problem import Problem
from fiveaxis.toolpath import TiltBounds, Toolpath

# rad, steps of the lattice, and cells in a step; about how many locations are visited.
STEP, CELLS, VISITS = np.radians(8.0), 4, 400


def relaxed_path(problem: Problem, toolpath: Toolpath, tilt: TiltBounds) -> Array | None:
    """Trace back the cheapest path over corners of boxes.

    Parameters
    ----------
    problem, toolpath, tilt : n locations

    Returns
    -------
    (n, 2), rad, chain order, straight between the visits; None if some visit has no admissible posture
    """
    # What a drive returns could be earned without end by moving to and fro.
    prices = np.maximum(problem.plus, 0.0), np.maximum(problem.minus, 0.0)
    turns = np.where(problem.strict, problem.max_turn.max(axis=1), np.inf)
    visits = Visits.of(toolpath, problem.machine, tilt, prices, turns)
    level = Level(STEP, CELLS, max(len(visits.row) // VISITS, 1))
    chosen = visits.every(level.stride)
    with threadpool_limits(limits=1), ThreadPoolExecutor(THREADS) as pool:
        cells, lattice = lay_lattice(visits, level, hull_of(chosen))
        steps: list[tuple[Sources, Prices]] = []
        quantum = quantum_of(lattice, chosen.plus, chosen.minus)
        for visit in reach_visits(chosen, cells, lattice, quantum, pool):
            if visit.sources is not None and visit.prices is not None:
                steps.append((visit.sources, visit.prices))
            last = visit
    if last.least >= FAR:
        return None
    at = _traced(last.corners, steps)
    angles = np.array([side.low for side in cells.sides]) + lattice.steps[:2] * at
    for axis, side in enumerate(cells.sides):
        if side.wraps:
            angles[:, axis] = np.unwrap(angles[:, axis])
    every = np.arange(len(toolpath))
    return np.column_stack([np.interp(every, chosen.row, column) for column in angles.T])


def _traced(last: Corners, steps: list[tuple[Sources, Prices]]) -> IntArray:
    """Follow the least costs back from the last visit; (m, 2), corners of the rotary angles."""
    at, corner = _cheapest(last)
    path = [at]
    for sources, prices in reversed(steps):
        at, corner = _source_of(at, corner, sources, prices)
        path.append(at)
    return np.array(path[::-1])


def _cheapest(corners: Corners) -> tuple[IntArray, IntArray]:
    """Find the cheapest corner: of the rotary angles, (2,), and of the linear axes, (3,)."""
    n = int(np.argmin(corners.cost))
    group = int(np.searchsorted(corners.start, n, side="right")) - 1
    inside = np.unravel_index(n - corners.start[group], corners.extent[group])
    return corners.at[group], corners.first[group] + np.array(inside)


def _source_of(at: IntArray, corner: IntArray, sources: Sources, prices: Prices) -> tuple[IntArray, IntArray]:
    """Find the source from which a corner is reached at its least cost."""
    first, second = (at - sources.at).T
    turns = prices.first[first + len(prices.first) // 2] + prices.second[second + len(prices.second) // 2]
    step = corner - sources.corner
    linear = product(np.maximum(step, 0), prices.up[2:]) + product(np.maximum(-step, 0), prices.down[2:])
    n = int(np.argmin(sources.cost + np.repeat(turns, np.diff(sources.start)) + linear))
    group = int(np.searchsorted(sources.start, n, side="right")) - 1
    return sources.at[group], sources.corner[n]
