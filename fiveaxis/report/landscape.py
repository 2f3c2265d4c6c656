"""What the machine would pay for the postures that were not chosen: the data behind the maps.

Both maps hold the *contact* where it is, because that is what stays when a posture changes, and a ball's
centre stays with it. `energy.power_surface` holds the tool tip; so the same costs are computed for the tip
that each posture needs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fiveaxis.energy import posture_costs
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.machine import Axis, Machine
from fiveaxis.posture import Solution

# Tells for locations (m,) and rotary angles (m, 2), rad, which postures are clear of collisions, (m,).
Admits = Callable[[IntArray, Array], BoolArray]

FULL_TURN = 2.0 * math.pi
# Grid of the maps: wide enough to be quick, fine enough to show every region (deg).
FIRST_STEP = 3.0
SECOND_STEP = 2.0
SURFACE_STEP = 1.5
MOST_LOCATIONS = 240
# Locations evaluated at once: 16 × 121 × 181 postures of five axes take 14 MB.
CHUNK = 16


@dataclass(frozen=True, eq=False)
class Surface:
    """Power surface at one location, contact held.

    Parameters
    ----------
    location : index of the location, from 0
    first, second : (g,), (h,), rad, grid of the rotary axes in chain order
    cost : (g, h), J, S_W: energy of a move from axis zero
    allowed : (g, h), where tilt and axis limits hold
    """

    location: int
    first: Array
    second: Array
    cost: Array
    allowed: BoolArray


@dataclass(frozen=True, eq=False)
class PostureMap:
    """Path × first rotary axis.

    Parameters
    ----------
    locations : (m,), indices of the locations, from 0
    first : (g,), rad, grid of the first rotary axis
    cost : (m, g), J, least S_W over the admissible angles of the second axis; NaN where there is none
    colliding : (m, g), where there would be one, but for a collision
    """

    locations: IntArray
    first: Array
    cost: Array
    colliding: BoolArray


def surface_at(solution: Solution, location: int) -> Surface:
    """Compute the power surface and the admissible region at one location."""
    grid = _grid(solution.machine, SURFACE_STEP, SURFACE_STEP)
    cost, allowed = _evaluate(solution, np.array([location]), grid)
    return Surface(location, *grid, cost[0], allowed[0])


def posture_map(solution: Solution, admits: Admits | None = None) -> PostureMap:
    """Compute what each angle of the first rotary axis costs at best, along the path.

    A path of more than `MOST_LOCATIONS` is sampled evenly, both ends included.

    Parameters
    ----------
    solution : the result
    admits : tells which postures are clear of collisions; None where nobody knows
    """
    n = len(solution.toolpath)
    locations = np.unique(np.linspace(0, n - 1, min(n, MOST_LOCATIONS)).round().astype(np.int64))
    grid = _grid(solution.machine, FIRST_STEP, SECOND_STEP)
    pieces = np.array_split(locations, math.ceil(len(locations) / CHUNK))
    parts = [_least(solution, piece, grid, admits) for piece in pieces]
    cost, colliding = (np.concatenate(part) for part in zip(*parts, strict=True))
    return PostureMap(locations, grid[0], cost, colliding)


def modulo_turn(angles: Array, axis: Axis) -> Array:
    """Bring angles into the range that the maps show, rad: whole turns don't change where the tool is."""
    low, high = shown_range(axis)
    middle = (low + high) / 2.0
    return middle - math.pi + np.mod(angles - middle + math.pi, FULL_TURN)


def shown_range(axis: Axis) -> tuple[float, float]:
    """Choose the range of a rotary axis to show, rad: its limits, or one turn where it can make one."""
    low, high = axis.limits.low, axis.limits.high
    return (low, high) if high - low < FULL_TURN else (-math.pi, math.pi)


def _grid(machine: Machine, *steps: float) -> tuple[Array, Array]:
    """Lay a grid over the shown ranges with steps of about so many degrees."""
    first, second = (
        _angles(shown_range(machine.axis(letter)), step)
        for letter, step in zip(machine.rotaries, steps, strict=True)
    )
    return first, second


def _angles(bounds: tuple[float, float], step: float) -> Array:
    low, high = bounds
    return np.linspace(low, high, max(2, round(math.degrees(high - low) / step) + 1))


def _least(
    solution: Solution, locations: IntArray, grid: tuple[Array, Array], admits: Admits | None
) -> tuple[Array, BoolArray]:
    """Give the least cost of each first angle, (m, g) J, and where only collisions leave none."""
    cost, allowed = _evaluate(solution, locations, grid)
    clear = allowed
    if admits is not None:
        row, first, second = np.nonzero(allowed)
        rotary = np.column_stack([grid[0][first], grid[1][second]])
        clear = np.zeros_like(allowed)
        clear[row, first, second] = admits(locations[row], rotary)
    least = np.where(clear, cost, np.inf).min(axis=2)
    colliding = np.asarray(allowed.any(axis=2) & ~clear.any(axis=2))
    return np.where(np.isinf(least), np.nan, least), colliding


def _evaluate(solution: Solution, locations: IntArray, grid: tuple[Array, Array]) -> tuple[Array, BoolArray]:
    """Compute S_W, (m, g, h) J, and where it is admissible, at some locations."""
    machine, path = solution.machine, solution.toolpath.at(locations)
    angles = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1)
    axes = tool_axes(machine, angles)
    tips = path.zone.tip(path.pivot[:, None, None], path.normal[:, None, None], axes)
    positions = linear_positions(machine, tips, angles)
    cost = np.sum(posture_costs(machine, positions, feed_mm_min(solution)), axis=-1)
    return cost, _tilt_holds(solution, locations, axes) & _limits_hold(machine, positions)


def feed_mm_min(solution: Solution) -> float:
    """Give the one feed that both maps are drawn for: the median along the path, mm/min."""
    return float(np.median(solution.toolpath.feed)) * 60.0


def _tilt_holds(solution: Solution, locations: IntArray, axes: Array) -> BoolArray:
    """Compare cosines, which need no cross product; a location without reference allows everything."""
    holds = np.ones((len(locations), *axes.shape[:2]), dtype=bool)
    for bound in solution.tilt.all:
        cosine = np.einsum("ghk,mk->mgh", axes, bound.reference[locations])
        holds &= np.isnan(cosine) | ((cosine >= bound.cosines[0]) & (cosine <= bound.cosines[1]))
    return holds


def _limits_hold(machine: Machine, positions: Array) -> BoolArray:
    """Check the linear axes: the grid itself stays inside the limits of the rotary ones."""
    columns = machine.linear_columns
    values = positions[..., columns]
    inside = (values >= machine.low[columns]) & (values <= machine.high[columns])
    return np.all(inside, axis=-1)
