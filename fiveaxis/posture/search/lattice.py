"""Candidate postures for the global search.

A lattice has two coordinates: the angle of the *spin* axis, the rotary axis with the wider range, and either
the other rotary angle or, better, the *level* of the most expensive linear axis. At a fixed spin angle this
axis is at ``a + b cos ρ + c sin ρ`` of the other angle ρ, so ρ follows from the level in closed form (two
branches), and a path of constant level costs exactly nothing in this axis. A grid over both angles carries
rounding noise in the axis, which hides the good basin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray, arccos, arctan2
from fiveaxis.kinematics.windings import TURN, one_turn_from
from fiveaxis.posture.problem import Problem

# A rotary axis with no more turns than this is searched over its whole range, including its ends; one with
# more over one turn, and the path is shifted into the range afterwards.
MOST_TURNS = 3
# mm: a linear axis that the other rotary angle moves by less has no levels to choose from.
SMALLEST_SWING = 1e-3
# rad: bounds closer together hold too few states of a lattice for a path.
NARROW = np.radians(12.0)
# A lattice for narrow bounds admits cosines this far outside, at a price (J per unit).
SLACK, SLACK_PRICE = 0.08, 100.0
# mm; a smaller swing is rounding.
NO_SWING = 1e-12

Swing = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Coordinates:
    """The two coordinates of a lattice.

    Parameters
    ----------
    spin : the rotary axis of the first coordinate, 0 or 1 in chain order
    level : column of the linear axis of the second coordinate; None for the other rotary angle
    """

    spin: int
    level: int | None

    @property
    def other(self) -> int:
        """The rotary axis that isn't the spin axis, 0 or 1 in chain order."""
        return 1 - self.spin

    def angles(self, spin: Array, other: Array) -> Array:
        """Stack both angles in chain order, (..., 2) rad."""
        pair = (spin, other) if self.spin == 0 else (other, spin)
        return np.stack(np.broadcast_arrays(*pair), axis=-1)

    def second_column(self, problem: Problem) -> int:
        """Column of the second coordinate in arrays of axis values."""
        return problem.machine.rotary_columns[self.other] if self.level is None else self.level


@dataclass(frozen=True, eq=False)
class Lattice:
    """Candidate postures of every location.

    Parameters
    ----------
    states : computes for rows (m,) axis values (m, a, b, c, k) and the price of each state (m, a, b, c), J
    spin_column : column of the spin axis
    period : rad, of its angle; 0 for none
    reach : largest distance to a predecessor, in lattice steps of both coordinates
    chunk : locations whose states are computed at once: enough for numpy, little memory
    turns_forbidden : whether turns beyond the largest are forbidden, or have the problem's price
    """

    states: Callable[[IntArray], tuple[Array, Array]]
    spin_column: int
    period: float
    reach: tuple[int, int]
    chunk: int = 8
    turns_forbidden: bool = False


def is_narrow(problem: Problem) -> bool:
    """Check whether the bounds on the lean are so narrow somewhere that a lattice may have no state there."""
    if any(bound.high - bound.low < NARROW for bound in problem.bounds):
        return True
    # Two half-spaces back to back, as of a range of lead, leave a wedge between them.
    pairs = combinations((b.reference for b in problem.bounds if b.high >= np.pi / 2.0), 2)
    facing = [np.nanmin(np.sum(a * b, axis=1), initial=1.0) for a, b in pairs]
    return bool(facing and min(facing) < -np.cos(NARROW))


def choose_coordinates(problem: Problem) -> Coordinates:
    """Choose the rotary axis with the wider range as spin axis, and levels of the most expensive linear axis.

    Levels are chosen only if that axis is a sinusoid of the other angle along the whole path; for chains with
    a linear axis between the rotary ones it may not be, and the lattice is a grid over both angles.
    """
    machine = problem.machine
    columns = machine.rotary_columns
    spin = int(np.argmax(machine.high[columns] - machine.low[columns]))
    if machine.axes[columns[1 - spin]].limits.is_fixed:
        return Coordinates(spin, None)
    linear = machine.linear_columns
    dearest = linear[int(np.argmax((problem.plus + problem.minus)[:, linear].sum(axis=0)))]
    levelled = Coordinates(spin, dearest)
    return levelled if _is_sinusoid(problem, levelled) else Coordinates(spin, None)


def spin_angles(problem: Problem, spin: int, step: float) -> tuple[Array, float]:
    """Sample the range of a rotary axis, (a,) rad; of one with many turns, the turn next to 0.

    The period, rad, is 0 for an axis that is sampled over its whole range.
    """
    column = problem.machine.rotary_columns[spin]
    limits = problem.machine.axes[column].limits
    if limits.span <= MOST_TURNS * TURN:
        count = int(np.ceil((limits.span) / step)) + 1
        return np.linspace(limits.low, limits.high, count), 0.0
    low, count = one_turn_from(limits), int(np.ceil(TURN / step))
    return np.linspace(low, low + TURN, count, endpoint=False), TURN


def grid_lattice(
    problem: Problem,
    coordinates: Coordinates,
    steps: tuple[float, float],
    reach: tuple[float, float],
    slack: float = 0.0,
) -> Lattice:
    """Make a grid over both rotary angles.

    Parameters
    ----------
    steps : rad, of the spin angle and of the other one
    reach : rad, largest distance to a predecessor in each
    slack : cosine by which bounds on the lean may be broken, at `SLACK_PRICE`
    """
    spin, period = spin_angles(problem, coordinates.spin, steps[0])
    other, other_period = spin_angles(problem, coordinates.other, steps[1])

    def states(rows: IntArray) -> tuple[Array, Array]:
        possible = np.ones((len(rows), len(spin), len(other), 1), dtype=bool)
        return _admit(problem, coordinates, rows, spin, other[:, None], possible, slack)

    hops = (_hops(reach[0], steps[0], spin, period), _hops(reach[1], steps[1], other, other_period))
    column = problem.machine.rotary_columns[coordinates.spin]
    return Lattice(states, column, period, hops)


def level_lattice(
    problem: Problem,
    coordinates: Coordinates,
    step: float,
    count: int,
    reach: tuple[float, int],
    slack: float = 0.0,
) -> Lattice:
    """Make a grid over the spin angle and the level of a linear axis.

    Parameters
    ----------
    step : rad, of the spin angle
    count : levels over all that the axis can reach
    reach : largest distance to a predecessor, in rad and in levels
    slack : as for `grid_lattice`
    """
    machine, axis = problem.machine, coordinates.second_column(problem)
    spin, period = spin_angles(problem, coordinates.spin, step)
    everywhere = np.broadcast_to(spin, (len(problem), len(spin)))
    a, b, c = swing(problem, coordinates, slice(None), everywhere)
    amplitude = np.hypot(b, c)
    low = max((a - amplitude).min(), machine.low[axis])
    level = np.linspace(low, min((a + amplitude).max(), machine.high[axis]), count)

    def states(rows: IntArray) -> tuple[Array, Array]:
        swung = (a[rows, :, None], b[rows, :, None], c[rows, :, None])
        other, reached = other_angle(problem, coordinates, swung, level)
        highest = machine.high[machine.rotary_columns[coordinates.other]]
        possible = reached[..., None] & (other <= highest)
        return _admit(problem, coordinates, rows, spin, other, possible, slack)

    column = machine.rotary_columns[coordinates.spin]
    hops = (_hops(reach[0], step, spin, period), reach[1])
    return Lattice(states, column, period, hops)


def swing(problem: Problem, coordinates: Coordinates, rows: IntArray | slice, spin: Array) -> Swing:
    """Express the level axis as ``a + b cos ρ + c sin ρ``, (m, ...) mm, of the other angle ρ.

    The spin angle, (m, ...) rad, is given for m locations.
    """
    column = coordinates.second_column(problem)
    return problem.model.swing(np.arange(len(problem))[rows], column, coordinates.other, spin)


def other_angle(
    problem: Problem, coordinates: Coordinates, swung: Swing, level: Array
) -> tuple[Array, BoolArray]:
    """Solve the other rotary angle for a level of the linear axis.

    Returns both branches, (..., 2) rad, from the lower limit on, and whether the level is reached, (...);
    where it isn't, the angle is the nearest one.
    """
    a, b, c = swung
    # Without any swing, on the rotary axis itself, a single level is reached.
    ratio = (level - a) / np.maximum(np.hypot(b, c), NO_SWING)
    middle, half = arctan2(c, b), arccos(np.clip(ratio, -1.0, 1.0))
    angles = np.stack(np.broadcast_arrays(middle - half, middle + half), axis=-1)
    column = problem.machine.rotary_columns[coordinates.other]
    limits = problem.machine.axes[column].limits
    # An axis of a turn or more stays near 0; its turns aren't searched.
    low = one_turn_from(limits)
    return low + np.mod(angles - low, TURN), np.abs(ratio) <= 1.0


def _is_sinusoid(problem: Problem, coordinates: Coordinates) -> bool:
    """Check the swing at another angle, with a different spin angle for each location."""
    spin = np.linspace(-2.0, 2.0, len(problem))
    a, b, c = swing(problem, coordinates, slice(None), spin)
    angle = 1.0
    angles = coordinates.angles(spin, np.full_like(spin, angle))
    seen = problem.positions(slice(None), angles)[:, coordinates.second_column(problem)]
    fits = np.allclose(a + b * np.cos(angle) + c * np.sin(angle), seen, rtol=0.0, atol=1e-6)
    return bool(fits and np.hypot(b, c).max() > SMALLEST_SWING)


def _admit(
    problem: Problem,
    coordinates: Coordinates,
    rows: IntArray,
    spin: Array,
    other: Array,
    possible: BoolArray,
    slack: float,
) -> tuple[Array, Array]:
    """Solve the possible axis values; the price of all others, and of those out of bounds, is infinite."""
    at = np.nonzero(possible)
    angles = coordinates.angles(spin[at[1]], np.broadcast_to(other, possible.shape)[at])
    found, excess = problem.placed(rows[at[0]], angles)
    allowed = (excess <= slack) & (problem.limit_excess(found) == 0.0)
    positions = np.zeros((*possible.shape, found.shape[-1]))
    # The kernel reads the spin angle of every row of a layer, even if all its states are forbidden.
    positions[..., problem.machine.rotary_columns[coordinates.spin]] = spin[:, None, None]
    positions[at] = found
    price = np.full(possible.shape, np.inf)
    price[at] = np.where(allowed, SLACK_PRICE * excess, np.inf)
    return positions, price


def _hops(reach: float, step: float, angle: Array, period: float) -> int:
    """Convert a reach to lattice steps, at most half a turn where the angle wraps around."""
    return min(round(reach / step), len(angle) // 2 if period else len(angle))
