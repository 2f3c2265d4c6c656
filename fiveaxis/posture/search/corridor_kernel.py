"""The cheapest path through the states of `lattice.corridor_lattice`, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array
from fiveaxis.posture.search.kernel import Prices, relax_layer
from fiveaxis.posture.search.trigonometric import LinearCoefficients, bound_excess, linear_values

TURN = 2.0 * np.pi
# Rotary axes' columns come last: linear, first and second rotary axis.
FIRST, SECOND = 3, 4
# mm: excess of a posture without axis values over the limits.
NO_POSTURE = 1e6


class Corridor(NamedTuple):
    """The states of all locations, and their bounds.

    Parameters
    ----------
    linear, cosines : coefficients of all locations (`TrigonometricCoefficients`)
    within, limits : (b, 2) and (2, 5), bounds of cosines and axes
    spin : 0 or 1, the rotary axis that is the first coordinate
    level : row of the linear axis that is the second coordinate; −1 for the other rotary angle
    low : rad, where the turn of the other angle begins
    strands, second : (n, s) rad and (n,) mm or rad, centre lines of the corridor in both coordinates
    width : (2,), its steps, rad and mm or rad
    fault : J per unit of violation
    """

    linear: LinearCoefficients
    cosines: Array
    within: Array
    limits: Array
    spin: int
    level: int
    low: float
    strands: Array
    second: Array
    width: Array
    fault: float


@compiled
def swing(coefficients: Array, spin: int, angle: float) -> tuple[float, float, float]:
    """Compute middle, amplitude and phase of a linear axis over the other rotary angle, at a spin angle.

    `coefficients`, (9,), are those of the linear axis; `spin`, 0 or 1, is the rotary axis of the given angle.
    """
    c, s = math.cos(angle), math.sin(angle)
    if spin == 0:
        still = coefficients[0] + coefficients[3] * c + coefficients[6] * s
        cosine = coefficients[1] + coefficients[4] * c + coefficients[7] * s
        sine = coefficients[2] + coefficients[5] * c + coefficients[8] * s
    else:
        still = coefficients[0] + coefficients[1] * c + coefficients[2] * s
        cosine = coefficients[3] + coefficients[4] * c + coefficients[5] * s
        sine = coefficients[6] + coefficients[7] * c + coefficients[8] * s
    return still, max(math.hypot(cosine, sine), 1e-12), math.atan2(sine, cosine)


@compiled
def other_angle(swung: tuple[float, float, float], level: float, sign: float, low: float) -> float:
    """Solve the other rotary angle for a level of a linear axis (`swing`), in the turn from `low`, rad.

    The sign, −1 or 1, is the branch.
    """
    half = math.acos(min(max((level - swung[0]) / swung[1], -1.0), 1.0))
    found = swung[2] + sign * half
    return low + (found - low) % TURN


@compiled
def fill_states(corridor: Corridor, i: int, states: Array, price: Array) -> None:
    """Compute the states of location i, (a, b, c, 5), and their prices, (a, b, c)."""
    cosines, limits, within = corridor.cosines[i], corridor.limits, corridor.within
    spin, level, width = corridor.spin, corridor.level, corridor.width
    strands, second = corridor.strands[i], corridor.second[i]
    linear, beside = corridor.linear[0][i], corridor.linear[1][i]
    along, offset = corridor.linear[2], corridor.linear[3]
    per_strand, count = states.shape[0] // len(strands), states.shape[1] // 2
    swung = (0.0, 1.0, 0.0)
    for a in range(states.shape[0]):
        angle = strands[a // per_strand] + width[0] * (a % per_strand - per_strand // 2)
        if level >= 0:
            swung = swing(linear[level], spin, angle)
        cosine, sine = math.cos(angle), math.sin(angle)
        for b in range(states.shape[1]):
            stand = second + width[1] * (b - count)
            for c in range(states.shape[2]):
                other = stand if level < 0 else other_angle(swung, stand, 2.0 * c - 1.0, corridor.low)
                state = states[a, b, c]
                state[FIRST], state[SECOND] = (angle, other) if spin == 0 else (other, angle)
                c1, s1, c2, s2 = cosine, sine, math.cos(other), math.sin(other)
                if spin == 1:
                    c1, s1, c2, s2 = c2, s2, c1, s1
                past = 0.0
                linear_values(linear, beside, along, offset, c1, s1, c2, s2, state)
                for m in range(len(state)):
                    past += max(limits[0, m] - state[m], state[m] - limits[1, m], 0.0)
                # A torus has no contact along the normal of its axis.
                past = past if past < np.inf else NO_POSTURE
                price[a, b, c] = corridor.fault * (bound_excess(cosines, within, c1, s1, c2, s2) + past)


def corridor_path(
    corridor: Corridor,
    prices: Prices,
    refused: Array,
    count: int,
) -> tuple[Array, NDArray[np.int64]]:
    """Find the cheapest path through a corridor.

    Parameters
    ----------
    corridor : its states
    prices : of the steps
    refused : (n, states), J, additional prices of the states; (n, 0) for none
    count : lattice steps to each side of every strand

    Returns
    -------
    path : (n, 5), mm and rad
    chosen : (n,), index of its state at each location
    """
    n, across = len(corridor.second), 2 * count + 1
    shape = (corridor.strands.shape[1] * across, across, 1 if corridor.level < 0 else 2)
    # Allocated here: numba takes a second to compile each allocation.
    states, before = np.zeros((*shape, 5)), np.zeros((*shape, 5))
    price, cost, best, back = (
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape, dtype=np.int64),
    )
    trail, row_least = np.zeros((n, price.size), dtype=np.int32), np.empty(shape[0])
    sweep(corridor, prices, refused, states, before, price, cost, best, back, trail, row_least)
    path, chosen = np.empty((n, 5)), np.empty(n, dtype=np.int64)
    chosen[-1] = np.argmin(cost)
    trace(corridor, trail, states, price, path, chosen)
    return path, chosen


@compiled
def sweep(
    corridor: Corridor,
    prices: Prices,
    refused: Array,
    states: Array,
    before: Array,
    price: Array,
    cost: Array,
    best: Array,
    back: NDArray[np.int64],
    trail: NDArray[np.int32],
    row_least: Array,
) -> None:
    """Relax all layers of a corridor from the first location to the last.

    Parameters
    ----------
    states, before, price, best, back, row_least : work space
    cost : filled in, J, of the cheapest path to each state of the last location
    trail : (n, states), filled in: predecessor of each state
    """
    reach = (cost.shape[0], cost.shape[1])
    row, size = cost.shape[1] * cost.shape[2], cost.size
    # Flat views, copied element by element: numba compiles ``a[:] = b`` slowly.
    flat, costs, bests, backs = price.reshape(-1), cost.reshape(-1), best.reshape(-1), back.reshape(-1)
    for i in range(len(corridor.second)):
        fill_states(corridor, i, states, price)
        if refused.shape[1]:
            for s in range(size):
                flat[s] += refused[i, s]
        if i == 0:
            for s in range(size):
                costs[s] = flat[s]
        else:
            for a in range(len(row_least)):
                row_least[a] = np.inf
                for s in range(a * row, (a + 1) * row):
                    row_least[a] = min(row_least[a], costs[s])
            relax_layer(
                cost, row_least, before, states, price, FIRST + corridor.spin, 0.0, reach, prices, i - 1,
                best, back,
            )  # fmt: skip
            for s in range(size):
                costs[s] = bests[s]
                # An offset of the layer's size stands for no winding.
                trail[i, s] = backs[s] - size
        states, before = before, states


@compiled
def trace(
    corridor: Corridor,
    trail: NDArray[np.int32],
    states: Array,
    price: Array,
    path: Array,
    chosen: NDArray[np.int64],
) -> None:
    """Follow the predecessors back; the states are computed again, not stored.

    `path`, (n, 5), and `chosen`, (n,), are filled in from the last element of `chosen`, which is given.
    """
    listed = states.reshape(-1, 5)
    for i in range(len(corridor.second) - 1, -1, -1):
        fill_states(corridor, i, states, price)
        for m in range(5):
            path[i, m] = listed[chosen[i], m]
        if i > 0:
            chosen[i - 1] = trail[i, chosen[i]]


@compiled
def corridor_postures(corridor: Corridor, count: int) -> Array:
    """Compute the rotary angles of all states in the order of `fill_states`: (n, states, 2) rad."""
    spin, level, width = corridor.spin, corridor.level, corridor.width
    strands, linear = corridor.strands, corridor.linear[0]
    n, across, branches = len(strands), 2 * count + 1, 1 if level < 0 else 2
    postures = np.empty((n, strands.shape[1] * across * across * branches, 2))
    for i in range(n):
        state = 0
        for a in range(strands.shape[1] * across):
            angle = strands[i, a // across] + width[0] * (a % across - count)
            swung = swing(linear[i, max(level, 0)], spin, angle)
            for b in range(across):
                stand = corridor.second[i] + width[1] * (b - count)
                for c in range(branches):
                    other = stand if level < 0 else other_angle(swung, stand, 2.0 * c - 1.0, corridor.low)
                    postures[i, state, spin], postures[i, state, 1 - spin] = angle, other
                    state += 1
    return postures
