"""Energy of the postures that were not chosen, along a path.

The *contact* is held, which stays when a posture changes, and with it a ball's centre.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, every_pair
from fiveaxis.lab import posture_costs
from fiveaxis.model import Axis, Machine, Toolpath, linear_positions, tool_axes
from fiveaxis.posture import Optimum

# Check, for locations (m,) and rotary angles (m, 2), rad, of which postures are clear of collisions, (m,).
Admits = Callable[[IntArray, Array], BoolArray]

FULL_TURN = 2.0 * math.pi
# Grid steps of the maps, deg: wide enough to be quick, fine enough to show every region.
FIRST_STEP = 3.0
SECOND_STEP = 2.0
MOST_LOCATIONS = 240
# Locations evaluated at once: 16 × 121 × 181 postures of five axes take 14 MB.
CHUNK = 16


@dataclass(frozen=True, eq=False)
class PostureMap:
    """Least cost over the path and the first rotary axis.

    Parameters
    ----------
    locations : (m,), indices of the locations, from 0
    first : (g,), rad, grid of the first rotary axis
    cost : (m, g), J, least S_W over the admissible angles of the second axis; NaN where there is none
    colliding : (m, g), whether only collisions make it NaN
    """

    locations: IntArray
    first: Array
    cost: Array
    colliding: BoolArray


def posture_map(solution: Optimum, admits: Admits | None = None) -> PostureMap:
    """Compute the least cost of each angle of the first rotary axis along the path, clear as `admits` says.

    A path of more than `MOST_LOCATIONS` is sampled evenly, both ends included.
    """
    n = len(solution.toolpath)
    locations = np.unique(np.linspace(0, n - 1, min(n, MOST_LOCATIONS)).round().astype(np.int64))
    grid = rotary_grid(solution.machine, FIRST_STEP, SECOND_STEP)
    pieces = np.array_split(locations, math.ceil(len(locations) / CHUNK))
    parts = [_least(solution, piece, grid, admits) for piece in pieces]
    cost, colliding = (np.concatenate(part) for part in zip(*parts, strict=True))
    return PostureMap(locations, grid[0], cost, colliding)


def modulo_turn(angles: Array, axis: Axis) -> Array:
    """Reduce angles by whole turns, which don't move the tool, to the range of the maps, rad."""
    low, high = shown_range(axis)
    middle = (low + high) / 2.0
    return middle - math.pi + np.mod(angles - middle + math.pi, FULL_TURN)


def shown_range(axis: Axis) -> tuple[float, float]:
    """Choose the range of a rotary axis to show, rad: its limits, or one turn if it can make one."""
    limits = axis.limits
    return (limits.low, limits.high) if limits.span < FULL_TURN else (-math.pi, math.pi)


def rotary_grid(machine: Machine, *steps: float) -> tuple[Array, Array]:
    """Divide the shown ranges of the rotary axes by steps of about so many degrees."""
    ranges = [shown_range(machine.axis(letter)) for letter in machine.rotaries]
    first, second = (
        np.linspace(low, high, max(2, round(math.degrees(high - low) / step) + 1))
        for (low, high), step in zip(ranges, steps, strict=True)
    )
    return first, second


def _least(
    solution: Optimum, locations: IntArray, grid: tuple[Array, Array], admits: Admits | None
) -> tuple[Array, BoolArray]:
    """Compute the least cost of each first angle, (m, g) J, and where only collisions leave none."""
    angles = every_pair(*grid)
    axes = tool_axes(solution.machine, angles)
    # Most of the grid leans too far; linear axes are solved for the rest only.
    every = np.broadcast_to(axes, (len(locations), *axes.shape))
    row, first, second = np.nonzero(solution.tilt.admits(every, locations))
    if not len(row):
        # A range of the lean that is narrower than the grid.
        none = np.zeros((len(locations), len(grid[0])), dtype=bool)
        return np.full(none.shape, np.nan), none
    rotary = angles[first, second]
    paid, allowed = _evaluate(solution, solution.toolpath.at(locations[row]), axes[first, second], rotary)
    row, first, rotary, paid = row[allowed], first[allowed], rotary[allowed], paid[allowed]
    # Ascending, as postures are in the grid's order.
    cell = row * len(grid[0]) + first
    reached = np.unique(cell)
    if admits is not None:
        # Sorted, the first posture of a cell that is clear is its cheapest one.
        order = np.lexsort((paid, cell))
        clear = order[_first_clear(cell[order], locations[row[order]], rotary[order], admits)]
        cell, paid = cell[clear], paid[clear]
    cells, begins = np.unique(cell, return_index=True)
    least = np.full(len(locations) * len(grid[0]), np.nan)
    least[cells] = np.minimum.reduceat(paid, begins) if len(cells) else paid
    colliding = np.zeros(len(least), dtype=bool)
    colliding[np.setdiff1d(reached, cells)] = True
    shape = len(locations), len(grid[0])
    return least.reshape(shape), colliding.reshape(shape)


def _first_clear(cell: IntArray, locations: IntArray, rotary: Array, admits: Admits) -> IntArray:
    """Find the first clear posture of each cell, in rows sorted by cell.

    Most cells are clear at their first posture, so the next ones are only looked up where it isn't: one of
    each cell, then two, four and so on.
    """
    _, begins, counts = np.unique(cell, return_index=True, return_counts=True)
    rank = np.arange(len(cell)) - np.repeat(begins, counts)
    open_rows, clear, least = np.ones(len(cell), dtype=bool), [], 0
    while open_rows.any():
        rows = np.flatnonzero(open_rows & (rank <= 2 * least))
        found = rows[admits(locations[rows], rotary[rows])]
        clear.append(found)
        open_rows[rows] = False
        open_rows &= ~np.isin(cell, cell[found])
        least = 2 * least + 1
    return np.sort(np.concatenate(clear)) if clear else np.empty(0, dtype=np.int64)


def _evaluate(solution: Optimum, path: Toolpath, axis: Array, rotary: Array) -> tuple[Array, BoolArray]:
    """Compute S_W, (m,) J, of one posture per location, and check the linear axes' limits.

    The grid itself keeps the limits of the rotary axes.
    """
    positions = linear_positions(solution.machine, path.tips(axis), rotary)
    cost = np.sum(posture_costs(solution.machine, positions, feed_mm_min(solution)), axis=-1)
    return cost, within_limits(solution.machine, positions)


def within_limits(machine: Machine, positions: Array) -> BoolArray:
    """Check whether the linear axes of positions, (..., k), keep their limits, (...)."""
    excess = machine.limit_excess(positions)[..., machine.linear_columns]
    return np.asarray(np.all(excess <= 0.0, axis=-1))


def feed_mm_min(solution: Optimum) -> float:
    """Compute the feed for which both maps are drawn: the median along the path, mm/min."""
    return float(np.median(solution.toolpath.feed)) * 60.0
