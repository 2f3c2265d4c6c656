"""What the loops of the search over exact postures (`successor_kernel`) read, and what they fill in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray

# What a move asks of a posture, columns of `moves`: a row of the model, the shift of its value, the multiple
# of the largest turn added to it, and the end of a bound that it lies on (0 low, 1 high; -1 for none).
ROW, SHIFT, LARGEST, END = range(4)
# Moves of a corridor: to the path's posture, and to its spin angle with the level held.
ONTO_PATH, BESIDE_PATH = -1, -2
# J, and J per mm, rad or cosine: prices of the path of a corridor where it breaks a bound.
BREACH_PRICE, EXCESS_PRICE = 1e7, 1e6
# mm, rad or cosine: excess that is rounding.
ROUNDING = 1e-9
# Room for regions of each of both angles (`Trail.wide`).
REGIONS = 128
# A long turn is priced in no more than so many parts.
MOST_COURSE_PARTS = 9
# A state of which nothing is known moved every axis, so that nothing starts.
ALL_MOVED = (1 << 62) - 1


class Locations(NamedTuple):
    """What holds at n locations, for k axes and b bounds.

    Parameters
    ----------
    given : (n, 6), pivot, mm, and normal
    references : (n, b, 3); zero where the tool is free
    cosines : (n, b, 2), smallest and largest cosine; infinite where the tool is free
    low, high : (k,), mm and rad
    rotary : (2,), columns of the rotary axes
    turn : (n − 1, 2), rad, largest of each step
    singular : (3,), direction of the tool axis along which the first rotary axis turns nothing but the part
    cone : cosine of the angle to it within which that axis is bounded; above 1 for none
    cone_turn : (n − 1,), rad, its largest turn there
    """

    given: Array
    references: Array
    cosines: Array
    low: Array
    high: Array
    rotary: IntArray
    turn: Array
    singular: Array
    cone: float
    cone_turn: Array


class Prices(NamedTuple):
    """Prices of n − 1 steps; the first index is 0 while an axis value grows, and 1 while it falls.

    Parameters
    ----------
    standing, slope : as in `BlockCosts`
    slow, reach : (n − 1, k), 1/mm and 1/rad, inverse of its travel at the slowest and the fastest speed
    least : (n − 1, k), mm and rad, travel that counts as none
    start : (2, n − 1, k), J, of an axis that didn't move this way in the step before
    bend : (n − 1,), J/rad²
    pace, time, delay : (k,) s/mm and s/rad at the highest speed; (n − 1,) s; J/s of what takes longer
    """

    standing: Array
    slope: Array
    slow: Array
    reach: Array
    least: Array
    start: Array
    bend: Array
    pace: Array
    time: Array
    delay: float


class Corridor(NamedTuple):
    """The path that a search stays near, (n, 2) rad, and how near, (2,) rad; (0, 2) for none.

    Parameters
    ----------
    positions : (n, k), mm and rad, the path's axis values: what stands on it is counted so
    excess : (n,), mm, rad and cosine, by which it breaks a bound that holds at a location
    free : (n,), where the search may leave the path
    """

    path: Array
    positions: Array
    excess: Array
    radius: Array
    free: BoolArray


class Cells(NamedTuple):
    """Cells, of which each keeps the cheapest of its states.

    Parameters
    ----------
    level : column of the costliest other axis
    spin : the rotary axis with the wider range, 0 or 1 in chain order
    level_step, spin_step : mm or rad, and rad
    around : cells of a turn of the spin axis; 0 for an axis with limits
    phase : rad, where cells of the spin axis begin
    """

    level: int
    spin: int
    level_step: float
    spin_step: float
    around: int
    phase: float


class SearchProblem(NamedTuple):
    """What is searched: tapes of a location's quantities, axis values and tool axis, and the moves of `ROW`.

    The tapes are with first derivatives, and with both (`LocationTapes.slopes`, `.bows`).
    """

    first_order: tuple[IntArray, Array, int]
    second_order: tuple[IntArray, Array, int]
    locations: Locations
    prices: Prices
    corridor: Corridor
    cells: Cells
    moves: Array


class Layer(NamedTuple):
    """States of one location: angles (s, 2), axis values (s, k), cost so far (s,), axes that moved (s,)."""

    rotary: Array
    positions: Array
    cost: Array
    moved: IntArray


class Found(NamedTuple):
    """Candidates for the next location, and the cells that they compete in.

    Parameters
    ----------
    cost : (m,), J
    parent, move : (m,), the state that it comes from, and how
    rotary : (m, 2), rad, by the model
    key : (m,), its cell
    table : (t,), by a hash of the cell, its candidate + 1; 0 for none
    slots : (m,), the places used in the table
    """

    cost: Array
    parent: IntArray
    move: IntArray
    rotary: Array
    key: IntArray
    table: IntArray
    slots: IntArray


class Space(NamedTuple):
    """Work space of a step, for k axes, b bounds, m moves, c candidates and s states.

    Parameters
    ----------
    model, directions, reach, targets : (k + 2 b, 6), (2 b, 3), (k + b,) and (m, 2): what `set_model`,
        `bound_directions`, `reach_of_rows` and `targets_of_rows` compute
    there, up, down : (k,), axis values of a posture, and the way to them
    stays, rest : (c,), candidates that stay whatever they cost, and costs
    given, values : inputs and values of the tape of first order, for s states
    course, along_it : the same for the parts of a long turn
    """

    model: Array
    directions: Array
    reach: Array
    targets: Array
    there: Array
    up: Array
    down: Array
    stays: BoolArray
    rest: Array
    given: Array
    values: Array
    course: Array
    along_it: Array


class Trail(NamedTuple):
    """All states kept, and work space: those of location i are rows ``begin[i]`` to ``begin[i + 1]``.

    Parameters
    ----------
    states, parents : (t, 2) rad, and (t,), row of the state that each comes from
    begin : (n + 1,)
    layers : states of the last two locations; those of location i are in ``layers[i % 2]``
    found, wide, used, keep, origin : see `candidates`, `kept` and `solved`
    given, quantities : inputs and values of the tape of second order
    space : of the step that is searched
    """

    states: Array
    parents: IntArray
    begin: IntArray
    layers: tuple[Layer, Layer]
    found: Found
    wide: IntArray
    used: IntArray
    keep: IntArray
    origin: IntArray
    given: Array
    quantities: Array
    space: Space


def trail_of(problem: SearchProblem, first: Array, start: Array, most: int) -> Trail:
    """Make room for a search over the `most` best states of each location.

    The postures of the first location, (s, 2) rad, are given with their axis values, (s, k).
    """
    n, axes, size = len(problem.locations.given), len(problem.locations.low), len(first)
    room = max(most, size)
    here, then = (
        Layer(np.empty((room, 2)), np.empty((room, axes)), np.empty(room), np.empty(room, np.int64))
        for _ in range(2)
    )
    here.rotary[:size], here.positions[:size], here.cost[:size], here.moved[:size] = (
        first,
        start,
        0.0,
        ALL_MOVED,
    )
    states, begin = np.empty((size + (n - 1) * most, 2)), np.zeros(n + 1, np.int64)
    states[:size], begin[1] = first, size
    many = room * (len(problem.moves) + 2)
    places = 1 << int(2 * many).bit_length()
    found = Found(
        np.empty(many),
        np.empty(many, np.int64),
        np.empty(many, np.int64),
        np.empty((many, 2)),
        np.empty(many, np.int64),
        np.zeros(places, np.int64),
        np.empty(many, np.int64),
    )
    return Trail(
        states,
        np.empty(len(states), np.int32),
        begin,
        (here, then),
        found,
        np.zeros(REGIONS * REGIONS, np.int64),
        np.empty(REGIONS * REGIONS, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty((room, 8)),
        np.empty((room, 6 * (axes + 3))),
        _space(problem, room, many),
    )


def _space(problem: SearchProblem, states: int, candidates: int) -> Space:
    """Make work space."""
    axes, bounds = len(problem.locations.low), problem.locations.references.shape[1]
    return Space(
        np.empty((axes + 2 * bounds, 6)),
        np.empty((2 * bounds, 3)),
        np.empty(axes + bounds),
        np.empty((len(problem.moves), 2)),
        np.empty(axes),
        np.empty(axes),
        np.empty(axes),
        np.empty(candidates, np.bool_),
        np.empty(candidates),
        np.empty((states, 8)),
        np.empty((states, 3 * (axes + 3))),
        np.empty((MOST_COURSE_PARTS, 8)),
        np.empty((MOST_COURSE_PARTS, 3 * (axes + 3))),
    )


def keep_only(trail: Trail, i: int, stays: BoolArray) -> None:
    """Keep some of the states of location i, the last one; (s,)."""
    begin, size = int(trail.begin[i]), int(np.count_nonzero(stays))
    rows = begin + np.flatnonzero(stays)
    for column in (trail.states, trail.parents):
        column[begin : begin + size] = column[rows]
    for column in trail.layers[i % 2]:
        column[:size] = column[: len(stays)][stays]
    trail.begin[i + 1] = begin + size


def traced(trail: Trail, n: int) -> Array:
    """Trace the cheapest path back, (n, 2) rad."""
    size = int(trail.begin[n] - trail.begin[n - 1])
    at = int(trail.begin[n - 1]) + int(np.argmin(trail.layers[(n - 1) % 2].cost[:size]))
    path = np.empty((n, 2))
    for i in range(n - 1, -1, -1):
        path[i], at = trail.states[at], int(trail.parents[at])
    return path
