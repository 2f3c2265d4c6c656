"""Global search: the cheapest path through a lattice of postures, layer by layer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, IntArray, angle_between
from fiveaxis.kinematics.windings import fit_turns
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.corridor import Admission, Corridor, path_through_corridor
from fiveaxis.posture.search.kernel import Prices, relax_layer, step_prices
from fiveaxis.posture.search.lattice import Coordinates, Lattice

# Paths of more locations are searched as densely as their turning requires, shorter ones as the effort says.
LONG = 10_000
# rad per location for which the strides of the efforts are made, and the largest density by that measure.
USUAL_TURN, MOST_DENSE = np.radians(1.0), 4.0
# How often the last corridor is searched again after a mask refused some of its states.
MOST_LOOKS = 8

Layer = tuple[NDArray[np.int32], NDArray[np.int32], Array]


def shortest_path(
    problem: Problem, lattice: Lattice, progress: Callable[[int, int], None] | None = None
) -> Array | None:
    """Find the cheapest path through a lattice.

    Parameters
    ----------
    problem : prices the steps
    lattice : the states
    progress : called with the number of locations done, and of all

    Returns
    -------
    (n, k), mm and rad, the spin angle unwrapped; None if the lattice has no path, or only one that winds the
    spin axis beyond its limits
    """
    n = len(problem)
    prices = step_prices(problem, range(problem.plus.shape[1]))
    if lattice.turns_forbidden:
        prices = prices._replace(turn_price=np.full(n - 1, np.inf))
    layers: list[Layer] = []
    cost = before = np.empty(0)
    for begin in range(0, n, lattice.chunk):
        rows = np.arange(begin, min(begin + lattice.chunk, n))
        for row, states, price in zip(rows, *lattice.states(rows), strict=True):
            cost, back = _step(lattice, prices, int(row), cost, before, states, price)
            before, alive = states, np.flatnonzero(np.isfinite(cost))
            if not len(alive):
                return None
            # A long path has thousands of layers: indices of 32 bits halve the memory.
            kept = states.reshape(-1, states.shape[-1])[alive]
            layers.append((alive.astype(np.int32), back.ravel()[alive].astype(np.int32), kept))
        if progress is not None:
            progress(int(rows[-1]) + 1, n)
    return _within_limits(problem, lattice, _trace(layers, int(np.argmin(cost)), cost.size, lattice))


def _step(
    lattice: Lattice, prices: Prices, row: int, cost: Array, before: Array, states: Array, price: Array
) -> tuple[Array, IntArray]:
    best, back = price.copy(), np.zeros(price.shape, dtype=np.int64)
    if row:
        relax_layer(
            cost, cost.min(axis=(1, 2)), before, states, price, lattice.spin_column, lattice.period,
            lattice.reach, prices, row - 1, best, back,
        )  # fmt: skip
    return best, back


def _trace(layers: list[Layer], state: int, size: int, lattice: Lattice) -> Array:
    """Follow the predecessors back from the last state; the spin angle accumulates its turns."""
    path = np.empty((len(layers), layers[0][2].shape[1]))
    winding = np.zeros(len(layers))
    for i in range(len(layers) - 1, -1, -1):
        alive, back, states = layers[i]
        at = int(np.searchsorted(alive, state))
        path[i] = states[at]
        if i:
            turns, state = divmod(int(back[at]), size)
            winding[i] = turns - 1
    path[:, lattice.spin_column] += lattice.period * np.cumsum(winding)
    return path


def _within_limits(problem: Problem, lattice: Lattice, path: Array) -> Array | None:
    spin = lattice.spin_column
    limits = problem.machine.axes[spin].limits
    angles = fit_turns(path[:, spin], limits.low, limits.high) if lattice.period else path[:, spin]
    if angles is None:
        return None
    path[:, spin] = angles
    return path


def density(problem: Problem) -> int:
    """Estimate how many times more densely than `USUAL_TURN` a long path is sampled; 1 for others.

    Searches may use strides larger by this factor: what counts is how far the surface turns in a stride.
    """
    if len(problem) <= LONG:
        return 1
    reference = problem.bounds[0].reference
    turn = angle_between(reference[1:], reference[:-1])
    typical = float(np.median(turn[np.isfinite(turn)]))
    return round(min(max(USUAL_TURN / max(typical, USUAL_TURN / MOST_DENSE), 1.0), MOST_DENSE))


def thin(problem: Problem, stride: int) -> IntArray:
    """Select every stride-th location, both ends, and both sides of every change between cut and link."""
    n = len(problem)
    ends = np.flatnonzero(np.diff(problem.bound_rows.astype(np.int8)))
    return np.unique(np.concatenate([np.arange(0, n, stride), ends, ends + 1, [n - 1]]))


def refill(
    problem: Problem,
    coordinates: Coordinates,
    rows: IntArray,
    path: Array,
    widths: tuple[tuple[float, float], ...],
    clear: Admission | None = None,
) -> Array:
    """Extend a path from some locations to all of them, then improve it in narrowing corridors.

    Between two known locations the spin angle may stay, change evenly or turn at once: a fast turn takes one
    step, and spreading it would cost more. The other angle is solved from the interpolated level.

    Parameters
    ----------
    rows : (m,), the known locations
    path : (m, k), mm and rad
    widths : lattice steps of the corridors, widest first
    clear : what a mask admits; states that it refuses have a price, and the last corridor is checked exactly

    Returns
    -------
    (n, k), mm and rad
    """
    every = np.arange(len(problem))
    after = np.searchsorted(rows, every)
    before = np.maximum(after - (rows[after] != every), 0)
    slide = np.stack([np.interp(every, rows, column) for column in path.T], axis=1)
    spin = problem.machine.rotary_columns[coordinates.spin]
    second = coordinates.second_column(problem)
    strands = np.stack([path[before, spin], slide[:, spin], path[after, spin]], axis=1)
    full = slide
    for number, width in enumerate(widths):
        corridor = Corridor(problem, coordinates, strands, full[:, second], width, 2 if number else 1)
        looks = MOST_LOOKS if number == len(widths) - 1 else 0
        found = path_through_corridor(corridor, clear, looks)
        full = full if found is None else found
        strands = full[:, [spin]]
    return full
