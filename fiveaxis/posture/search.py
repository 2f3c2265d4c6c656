"""Global search: the cheapest way through a lattice of postures, layer by layer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics.windings import fit_turns
from fiveaxis.posture.kernel import relax_layer
from fiveaxis.posture.lattice import Coordinates, Lattice, tube_lattice
from fiveaxis.posture.problem import Problem

Layer = tuple[IntArray, IntArray, Array]


def shortest_path(
    problem: Problem, lattice: Lattice, progress: Callable[[int, int], None] | None = None
) -> Array | None:
    """Find the cheapest path through a lattice.

    Parameters
    ----------
    problem : gives the costs of the steps
    lattice : gives the states
    progress : called with the locations done and all

    Returns
    -------
    (n, k), mm and rad, the spin angle unwound; None where the lattice has no way through, or only one that
    winds the spin axis further than its limits allow
    """
    n = len(problem)
    layers: list[Layer] = []
    cost = before = np.empty(0)
    for begin in range(0, n, lattice.chunk):
        rows = np.arange(begin, min(begin + lattice.chunk, n))
        for row, states, price in zip(rows, *lattice.states(rows), strict=True):
            cost, back = _step(problem, lattice, int(row), cost, before, states, price)
            before, alive = states, np.flatnonzero(np.isfinite(cost))
            if not len(alive):
                return None
            layers.append((alive, back.ravel()[alive], states.reshape(-1, states.shape[-1])[alive]))
        if progress is not None:
            progress(int(rows[-1]) + 1, n)
    return _within_limits(problem, lattice, _trace(layers, int(np.argmin(cost)), cost.size, lattice))


def _step(
    problem: Problem, lattice: Lattice, row: int, cost: Array, before: Array, states: Array, price: Array
) -> tuple[Array, IntArray]:
    back = np.zeros(price.shape, dtype=np.int64)
    if row == 0:
        return price, back
    best = np.empty_like(price)
    max_turn = np.full(states.shape[-1], np.inf)
    max_turn[problem.machine.rotary_columns] = problem.max_turn[row - 1]
    bend = np.zeros(states.shape[-1])
    bend[problem.machine.rotary_columns] = problem.bend_price[row - 1]
    relax_layer(
        cost,
        cost.min(axis=(1, 2)),
        before,
        states,
        price,
        lattice.spin_column,
        lattice.period,
        lattice.reach,
        problem.plus[row - 1],
        problem.minus[row - 1],
        max_turn,
        np.inf if lattice.turns_forbidden else problem.turn_prices[row - 1],
        bend,
        1.0 / problem.top_speed,
        problem.least_time[row - 1],
        problem.time_price,
        best,
        back,
    )
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


def thin(problem: Problem, stride: int) -> IntArray:
    """Choose every stride-th location, both ends, and both sides of every change between cut and link."""
    n = len(problem)
    ends = np.flatnonzero(np.diff(problem.bound_rows.astype(np.int8)))
    return np.unique(np.concatenate([np.arange(0, n, stride), ends, ends + 1, [n - 1]]))


def refill(
    problem: Problem,
    coordinates: Coordinates,
    rows: IntArray,
    path: Array,
    widths: tuple[tuple[float, float], ...],
    find: Callable[[Problem, Lattice], Array | None] | None = None,
) -> Array:
    """Extend a path that is known at some locations to all of them, then tighten it in narrowing tubes.

    Between two known locations the spin angle may stay, slide or turn at once: a fast turn takes one step,
    and sliding through it would cost more. The other angle is solved from the interpolated level.

    Parameters
    ----------
    rows : (m,), the known locations
    path : (m, k), mm and rad
    widths : lattice steps of the tubes, widest first
    find : finds the path through a tube; `shortest_path` by default

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
        count = 2 if number else 1
        lattice = tube_lattice(problem, coordinates, strands, full[:, second], width, count)
        found = (find or shortest_path)(problem, lattice)
        full = full if found is None else found
        strands = full[:, [spin]]
    return full
