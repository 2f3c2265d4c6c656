"""The distance of a path from a local optimum, whichever solver found it.

A path is a first-order optimum if multipliers of its rows exist that balance the objective: within
``−W⁻ … W⁺`` where an axis stands still, at an end of that range where it moves, of the right sign on a bound.
The multipliers with the least residual are found with CasADi's derivatives at the path: they are those of the
step that improves the linearised problem, held back by a stiff spring. The solvers' own multipliers aren't
used.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture.local import kernel
from fiveaxis.posture.local.interior import minimise, split_rows
from fiveaxis.posture.local.quantities import ChainModel
from fiveaxis.posture.local.rows import Rows, build_rows
from fiveaxis.posture.problem import ALLOWED, Problem

# J/rad² and J/s²: a step of 1e-6 rad, the error that the last barrier may leave, gives a tenth of a J/rad.
SPRING = 1e5
ITERATIONS, BARRIER = 200, 1e-2
# J/rad and J/s: accuracy of the multipliers.
FLAT = 1e-3
# Multipliers of this mean size aren't scaled down (Wächter and Biegler).
USUAL = 100.0


@dataclass(frozen=True)
class Optimality:
    """Residuals of the Karush-Kuhn-Tucker conditions, scaled like IPOPT's: 0 at a local optimum.

    Parameters
    ----------
    dual : J/rad and J/s, largest entry of the Lagrangian's gradient
    primal : mm, rad or cosine, largest violation of a bound
    complementarity : J, largest product of a multiplier and the distance to its bound
    """

    dual: float
    primal: float
    complementarity: float

    def as_dict(self) -> dict[str, float]:
        """Return the figures as plain data for JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class _LinearModel:
    """Quantities linear in small steps, (n, d), followed by the steps themselves."""

    values_there: Array
    slope: Array

    def values(self, x: Array) -> Array:
        moved = np.einsum("nmd,nd->nm", self.slope, x)
        return np.hstack([self.values_there + moved, x])

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        n, d = x.shape
        own = np.broadcast_to(np.eye(d), (n, d, d))
        return self.values(x), np.concatenate([self.slope, own], axis=1), np.zeros((n, d, d))


def optimality(problem: Problem, rotary: Array) -> Optimality:
    """Measure the distance of an admissible path, (n, 2) rad, from a local optimum."""
    # Values on a bound must not count as beyond it.
    rows = build_rows(problem, margin=-ALLOWED)
    x = rows.start(problem, rotary)
    weights = np.zeros((len(x), rows.count))
    quantities, slope, _ = ChainModel(rows).derivatives(x, weights)
    model, still = _LinearModel(quantities, slope), np.zeros_like(x)
    found = minimise(
        _with_springs(rows), still, model=model, iterations=ITERATIONS, barrier=BARRIER, flat=FLAT
    )
    multiplier = found.multiplier[: len(rows.first)]
    value = np.empty_like(multiplier)
    kernel.row_values(rows.quantity, rows.coefficient, quantities.ravel(), value)
    force = multiplier + 2.0 * rows.square * value
    kernel.row_weights(rows.quantity, rows.coefficient, force, weights.ravel())
    gradient = np.einsum("nmd,nm->nd", slope, weights)
    v = split_rows(rows, value, 0.0, 0.0)
    pull = rows.price - rows.sign * multiplier[rows.row]
    moves = rows.low < rows.high
    room = np.where(pull > 0.0, v - rows.low, rows.high - v)
    # A pull without a bound to stop it is an error of the gradient.
    endless = moves & ~np.isfinite(room)
    closed = np.abs(pull) * np.where(moves & ~endless, room, 0.0)
    dual = max(float(np.abs(gradient).max()), float(np.max(np.abs(pull), initial=0.0, where=endless)))
    scale = max(USUAL, float(np.abs(multiplier).mean())) / USUAL
    return Optimality(dual / scale, problem.violation(rotary), float(closed.max(initial=0.0)) / scale)


def _with_springs(rows: Rows) -> Rows:
    """Add a spring to each unknown that moves, as a row; rows then read `_LinearModel`'s quantities."""
    (at, unknown), wide = np.nonzero(rows.free), rows.count + rows.unknowns
    location, number = np.divmod(rows.quantity, rows.count)
    quantity = np.where(rows.quantity >= 0, location * wide + number, -1)
    springs = np.full((len(at), quantity.shape[1]), -1)
    springs[:, 0] = at * wide + rows.count + unknown
    return replace(
        rows,
        first=np.concatenate([rows.first, at]),
        quantity=np.vstack([quantity, springs]),
        coefficient=np.vstack([rows.coefficient, np.ones(springs.shape)]),
        square=np.concatenate([rows.square, np.full(len(at), SPRING / 2.0)]),
        begin=np.concatenate([rows.begin, np.full(len(at), rows.begin[-1])]),
        count=wide,
    )
