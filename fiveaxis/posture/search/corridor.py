"""The cheapest path through a narrow corridor around a known path."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import one_turn_from
from fiveaxis.posture.problem import VIOLATION_PRICE, Problem
from fiveaxis.posture.search.corridor_kernel import Corridor, corridor_path, corridor_postures
from fiveaxis.posture.search.kernel import step_prices
from fiveaxis.posture.search.lattice import Coordinates
from fiveaxis.posture.search.trigonometric import TrigonometricCoefficients

# J, price of a posture that a mask refuses: high enough for detours around many of them.
REFUSED_PRICE = 1e3


class Admission(Protocol):
    """Which postures, (m, 2) rad, at locations, (m,), a mask admits: exactly, or roughly and quickly."""

    def exactly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Evaluate the mask itself."""
        ...

    def roughly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Estimate from what is known about the mask."""
        ...


def path_through_corridor(
    problem: Problem,
    coordinates: Coordinates,
    strands: Array,
    second: Array,
    width: tuple[float, float],
    count: int,
    trigonometric: TrigonometricCoefficients,
    clear: Admission | None = None,
    looks: int = 0,
) -> Array:
    """Find the cheapest path through the states of `corridor_lattice`, as `shortest_path` would.

    Parameters
    ----------
    strands, second, width, count : as for `corridor_lattice`
    trigonometric : of the problem (`Problem.trigonometric`)
    clear : what a mask admits; states that it roughly refuses have a price
    looks : how often the path found and the states around it are checked exactly, and the search repeated

    Returns
    -------
    (n, k), mm and rad
    """
    machine = problem.machine
    columns = [*machine.linear_columns, *machine.rotary_columns]
    limits = machine.axes[machine.rotary_columns[coordinates.other]].limits
    spin, level = coordinates.spin, -1 if coordinates.level is None else columns.index(coordinates.level)
    corridor = Corridor(
        trigonometric.linear_coefficients,
        trigonometric.cosines,
        np.array([bound.cosines for bound in problem.bounds]),
        np.stack([machine.low[columns], machine.high[columns]]),
        spin,
        level,
        one_turn_from(limits),
        np.ascontiguousarray(strands),
        np.ascontiguousarray(second),
        np.array(width),
        VIOLATION_PRICE,
    )
    prices = step_prices(problem, columns)

    def cheapest(refused: Array) -> tuple[Array, IntArray]:
        return corridor_path(corridor, prices, refused, count)

    if clear is None:
        found, _ = cheapest(np.zeros((len(problem), 0)))
    else:
        postures = corridor_postures(corridor, count)
        rows = np.repeat(np.arange(len(problem)), postures.shape[1])
        rough = clear.roughly(rows, postures.reshape(-1, 2)).reshape(postures.shape[:2])
        refused = np.where(rough, 0.0, REFUSED_PRICE)
        found, chosen = cheapest(refused)
        seen = np.zeros(rough.shape, dtype=bool)
        for _ in range(looks):
            if not _check_path(clear, postures, chosen, seen, refused):
                break
            found, chosen = cheapest(refused)
    path = np.empty_like(found)
    path[:, columns] = found
    return path


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
