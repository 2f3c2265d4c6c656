"""What the loops of the search over exact postures (`successor_kernel`) read, and what they fill in.

Columns of one array where arrays would have the same rows: each array of a record is handed on as seven to
eleven numbers, which takes longer to compile than what is done with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray

# What a move asks of a posture, columns of `moves`: a row of the model, the shift of its value, the multiple
# of the largest turn added to it, and the end of a bound that it lies on (0 low, 1 high; -1 for none).
ROW, SHIFT, LARGEST, END = range(4)
# Rows of axes' prices: of two, the first is while an axis value grows, and the second while it falls.
STANDING, SLOPE, START, SLOW, REACH, LEAST, PACE = 0, 2, 4, 6, 7, 8, 9
# Columns of candidates' numbers: the state that it comes from, how, its cell, and its place in the table.
PARENT, MOVE, KEY, SLOT = range(4)
# Columns of the model of second order, after those of `set_model`: the direction that a lean is measured
# from, and how far a row may go. And of an axis, after how far it travels up and down, its value there.
DIRECTION, FARTHEST, THERE = 6, 9, 2
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
    bounds : (n, b, 5), direction, and smallest and largest cosine to it; zero and infinite where the tool is
        free
    limits : (2, k), low and high, mm and rad
    rotary : columns of the rotary axes
    turn : (n − 1, 3), rad, largest of both axes in each step, and of the first within the cone
    singular : direction of the tool axis along which the first rotary axis turns nothing but the part
    cone : cosine of the angle to it within which that axis is bounded; above 1 for none
    link_turn : rad, of an axis that turns as far as allowed in a link, which allows any turn; NaN for none
    """

    given: Array
    bounds: Array
    limits: Array
    rotary: tuple[int, int]
    turn: Array
    singular: tuple[float, float, float]
    cone: float
    link_turn: float


class Prices(NamedTuple):
    """Prices of n − 1 steps.

    Parameters
    ----------
    axis : (n − 1, 10, k), by row: `STANDING` and `SLOPE` as in `BlockCosts`; `START`, J, of an axis that
        didn't move this way in the step before; `SLOW` and `REACH`, 1/mm and 1/rad, inverse of its travel at
        the slowest and the fastest speed; `LEAST`, mm and rad, travel that counts as none; `PACE`, s/mm and
        s/rad at the highest speed
    step : (n − 1, 2), J/rad² of turning, and time, s
    delay : J/s of what takes longer
    """

    axis: Array
    step: Array
    delay: float


class Corridor(NamedTuple):
    """The path that a search stays near, and how near, rad; infinite, and (0, 3 + k) for none.

    Parameters
    ----------
    path : (n, 3 + k), both angles, rad; by how much, mm, rad or cosine, it breaks a bound that holds at a
        location; and axis values, mm and rad: what stands on it is counted so
    free : (n,), where the search may leave the path
    """

    path: Array
    radius: tuple[float, float]
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


class Layers(NamedTuple):
    """States of the last two locations: those of location i have the first index ``i % 2``.

    Angles (2, s, 2), axis values (2, s, k), cost so far (2, s), axes that moved (2, s).
    """

    rotary: Array
    positions: Array
    cost: Array
    moved: IntArray


class Found(NamedTuple):
    """Candidates for the next location, and the cells that they compete in.

    Parameters
    ----------
    cost, rest : (m,), J, the second for costs in another order
    stays : (m,), whatever they cost
    numbers : (m, 4), see `PARENT`
    rotary : (m, 2), rad, by the model
    table : (t,), by a hash of the cell, its candidate + 1; 0 for none
    """

    cost: Array
    rest: Array
    stays: BoolArray
    numbers: IntArray
    rotary: Array
    table: IntArray


class Space(NamedTuple):
    """Work space of a step, for k axes, b bounds, m moves and s states.

    Parameters
    ----------
    model : (k + 2 b, 10), what `set_model` and `set_bounds` compute
    targets : (m, 2), what `targets_of_rows` computes
    axes : (k, 3), how far axes travel up and down to a posture, and their values there
    given : (s + `MOST_COURSE_PARTS`, 8), inputs of both tapes
    values : outputs of the tape of first order
    quantities : (s, 6 (k + 3)), those of the tape of second order
    """

    model: Array
    targets: Array
    axes: Array
    given: Array
    values: Array
    quantities: Array


class Trail(NamedTuple):
    """All states kept, and work space: those of location i are rows ``begin[i]`` to ``begin[i + 1]``.

    Parameters
    ----------
    states, parents : (t, 2) rad, and (t,), row of the state that each comes from
    begin : (n + 1,)
    regions : (2, `REGIONS`²), the candidates of wide cells, 0 for none, and the cells that have any
    chosen : (2, s), the candidates chosen, and the states that they come from
    """

    states: Array
    parents: IntArray
    begin: IntArray
    layers: Layers
    found: Found
    regions: IntArray
    chosen: IntArray
    space: Space


def trail_of(problem: SearchProblem, first: Array, start: Array, most: int) -> Trail:
    """Make room for a search over the `most` best states of each location.

    The postures of the first location, (s, 2) rad, are given with their axis values, (s, k).
    """
    n, axes, bounds = len(problem.locations.given), start.shape[1], problem.locations.bounds.shape[1]
    size, room = len(first), max(most, len(first))
    layers = Layers(
        np.empty((2, room, 2)), np.empty((2, room, axes)), np.zeros((2, room)), np.empty((2, room), np.int64)
    )
    layers.rotary[0, :size], layers.positions[0, :size], layers.moved[0, :size] = first, start, ALL_MOVED
    states, begin = np.empty((size + (n - 1) * most, 2)), np.zeros(n + 1, np.int64)
    states[:size], begin[1] = first, size
    many = room * (len(problem.moves) + 2)
    found = Found(
        np.empty(many),
        np.empty(many),
        np.empty(many, np.bool_),
        np.empty((many, 4), np.int64),
        np.empty((many, 2)),
        np.zeros(1 << int(2 * many).bit_length(), np.int64),
    )
    space = Space(
        np.empty((axes + 2 * bounds, 10)),
        np.empty((len(problem.moves), 2)),
        np.empty((axes, 3)),
        np.empty((room + MOST_COURSE_PARTS, 8)),
        np.empty((room + MOST_COURSE_PARTS, 3 * (axes + 3))),
        np.empty((room, 6 * (axes + 3))),
    )
    return Trail(
        states,
        np.empty(len(states), np.int32),
        begin,
        layers,
        found,
        np.zeros((2, REGIONS * REGIONS), np.int64),
        np.empty((2, room), np.int64),
        space,
    )


def keep_only(trail: Trail, i: int, stays: BoolArray) -> None:
    """Keep some of the states of location i, the last one; (s,)."""
    begin, size = int(trail.begin[i]), int(np.count_nonzero(stays))
    rows = begin + np.flatnonzero(stays)
    for column in (trail.states, trail.parents):
        column[begin : begin + size] = column[rows]
    for column in trail.layers:
        column[i % 2, :size] = column[i % 2, : len(stays)][stays]
    trail.begin[i + 1] = begin + size


def traced(trail: Trail, n: int) -> Array:
    """Trace the cheapest path back, (n, 2) rad."""
    size = int(trail.begin[n] - trail.begin[n - 1])
    at = int(trail.begin[n - 1]) + int(np.argmin(trail.layers.cost[(n - 1) % 2, :size]))
    path = np.empty((n, 2))
    for i in range(n - 1, -1, -1):
        path[i], at = trail.states[at], int(trail.parents[at])
    return path
