"""The cheapest path through a narrow corridor around a known path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.problem import VIOLATION_PRICE, Problem
from fiveaxis.posture.search.kernel import Prices, relax_layer, step_prices
from fiveaxis.posture.search.lattice import Coordinates, other_angle, swing

# J, price of a posture that a mask refuses: high enough for detours around many of them.
REFUSED_PRICE = 1e3
# Locations whose states are computed at once.
CHUNK = 256


class Admission(Protocol):
    """Which postures, (m, 2) rad, at locations, (m,), a mask admits: exactly, or roughly and quickly."""

    def exactly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Evaluate the mask itself."""
        ...

    def roughly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Estimate from what is known about the mask."""
        ...


@dataclass(frozen=True, eq=False)
class Corridor:
    """A narrow lattice around a known path.

    Violations have a price instead of being forbidden, so there is always a path, except through a location
    where no posture has axis values.

    Parameters
    ----------
    problem, coordinates : of the path, and what its states are a grid over
    strands : (n, s), rad, spin angles to stay near
    second : (n,), mm or rad, second coordinate to stay near
    width : lattice step in both coordinates
    count : steps to each side of every strand
    """

    problem: Problem
    coordinates: Coordinates
    strands: Array
    second: Array
    width: tuple[float, float]
    count: int

    def postures(self, rows: IntArray) -> Array:
        """Compute the rotary angles of all states, (m, a, b, c, 2) rad, at locations, (m,)."""
        problem, coordinates = self.problem, self.coordinates
        offsets = np.arange(-self.count, self.count + 1.0)
        spin = (self.strands[rows][:, :, None] + self.width[0] * offsets).reshape(len(rows), -1, 1)
        other = (self.second[rows][:, None, None] + self.width[1] * offsets)[..., None]
        if coordinates.level is not None:
            other, _ = other_angle(
                problem, coordinates, swing(problem, coordinates, rows, spin), other[..., 0]
            )
        return coordinates.angles(spin[..., None], other)

    def states(self, rows: IntArray, postures: Array) -> tuple[Array, Array]:
        """Compute axis values, (m, a, b, c, k), and prices of postures, (m, a, b, c, 2) rad."""
        positions, excess = self.problem.placed(rows, postures)
        price = VIOLATION_PRICE * (excess + self.problem.limit_excess(positions))
        return positions, np.where(np.isnan(price), np.inf, price)


def path_through_corridor(corridor: Corridor, clear: Admission | None = None, looks: int = 0) -> Array | None:
    """Find the cheapest path through a corridor, as `shortest_path` would.

    Parameters
    ----------
    clear : what a mask admits; states that it roughly refuses have a price
    looks : how often the path found and the states around it are checked exactly, and the search repeated

    Returns
    -------
    (n, k), mm and rad; None if there is none
    """
    n = len(corridor.problem)
    chunks = np.array_split(np.arange(n), -(-n // CHUNK))
    postures = np.concatenate([corridor.postures(rows) for rows in chunks])
    listed = postures.reshape(n, -1, 2)
    refused = np.zeros(listed.shape[:2])
    if clear is not None:
        rows = np.repeat(np.arange(n), listed.shape[1])
        refused[~clear.roughly(rows, listed.reshape(-1, 2)).reshape(refused.shape)] = REFUSED_PRICE
    chosen = _cheapest(corridor, postures, refused)
    seen = np.zeros(refused.shape, dtype=bool)
    for _ in range(looks):
        if clear is None or chosen is None or not _check_path(clear, listed, chosen, seen, refused):
            break
        chosen = _cheapest(corridor, postures, refused)
    return None if chosen is None else corridor.problem.positions(slice(None), listed[np.arange(n), chosen])


def _cheapest(corridor: Corridor, postures: Array, refused: Array) -> IntArray | None:
    """Find the states, (n,), of the cheapest path; `refused`, (n, states), are additional prices, J."""
    problem, (n, *shape, _) = corridor.problem, postures.shape
    prices, spin = step_prices(problem, range(problem.plus.shape[1])), corridor.coordinates.spin
    column = problem.machine.rotary_columns[spin]
    trail = np.zeros((n, refused.shape[1]), dtype=np.int32)
    cost = np.empty(shape)
    for begin in range(0, n, CHUNK):
        # With the last location of the chunk before.
        rows = np.arange(max(begin - 1, 0), min(begin + CHUNK, n))
        states, price = corridor.states(rows, postures[rows])
        price += refused[rows].reshape(price.shape)
        if begin == 0:
            cost[...] = price[0]
        work = cost.copy(), np.zeros(cost.shape, dtype=np.int64), np.empty(len(cost))
        sweep(states, price, column, prices, int(rows[0]), cost, trail, *work)
    if not np.isfinite(cost).any():
        return None
    chosen = np.empty(n, dtype=np.int64)
    chosen[-1] = np.argmin(cost)
    for i in range(n - 1, 0, -1):
        chosen[i - 1] = trail[i, chosen[i]]
    return chosen


@compiled
def sweep(
    states: Array,
    price: Array,
    spin: int,
    prices: Prices,
    first: int,
    cost: Array,
    trail: NDArray[np.int32],
    best: Array,
    back: NDArray[np.int64],
    row_least: Array,
) -> None:
    """Relax the layers of consecutive locations, the first of which is known.

    Parameters
    ----------
    states, price : (m, a, b, c, k), mm and rad, and (m, a, b, c), J
    spin : column of the spin axis
    prices, first : of the steps, and the first location
    cost : (a, b, c), J, of the cheapest path to each state of the first location; then of the last one
    trail : (n, states), filled in: predecessor of each state
    best, back, row_least : work space
    """
    reach = (cost.shape[0], cost.shape[1])
    row, size = cost.shape[1] * cost.shape[2], cost.size
    # Flat views, copied element by element: numba compiles ``a[:] = b`` slowly.
    costs, bests, backs = cost.reshape(-1), best.reshape(-1), back.reshape(-1)
    for i in range(1, len(states)):
        for a in range(len(row_least)):
            row_least[a] = np.inf
            for s in range(a * row, (a + 1) * row):
                row_least[a] = min(row_least[a], costs[s])
        relax_layer(
            cost, row_least, states[i - 1], states[i], price[i], spin, 0.0, reach, prices, first + i - 1,
            best, back,
        )  # fmt: skip
        for s in range(size):
            costs[s] = bests[s]
            # An offset of the layer's size stands for no winding.
            trail[first + i, s] = backs[s] - size


def _check_path(clear: Admission, postures: Array, chosen: IntArray, seen: BoolArray, refused: Array) -> bool:
    """Check the states of a path exactly, and all states of a location where the path's is refused.

    Parameters
    ----------
    postures : (n, s, 2), rad, of all states
    chosen : (n,), the states of the path
    seen, refused : (n, s), which states were checked, and the price of each; both updated

    Returns
    -------
    Whether an unchecked state of the path is refused
    """
    fresh = np.flatnonzero(~seen[np.arange(len(chosen)), chosen])
    at = chosen[fresh]
    clean = clear.exactly(fresh, postures[fresh, at])
    seen[fresh, at], refused[fresh, at] = True, np.where(clean, 0.0, REFUSED_PRICE)
    rows, states = np.nonzero(~seen[fresh[~clean]])
    rows = fresh[~clean][rows]
    around = clear.exactly(rows, postures[rows, states])
    seen[rows, states], refused[rows, states] = True, np.where(around, 0.0, REFUSED_PRICE)
    return not clean.all()
