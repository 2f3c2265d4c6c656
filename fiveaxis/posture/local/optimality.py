"""How far a path is from a local optimum, whoever found it.

A path is an optimum to first order if multipliers of its rows exist that balance the objective: within
``−W⁻ … W⁺`` where a step stands still, at its end elsewhere, of the right sign on a bound. Here the ones are
found that leave the least, with CasADi's derivatives at the path: they are those of the step that would
better the linearised problem, held back by a stiff spring. No solver's own multipliers are taken on trust.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture.local.interior import minimise, parted
from fiveaxis.posture.local.quantities import chained
from fiveaxis.posture.local.rows import Rows, rows_of
from fiveaxis.posture.problem import ALLOWED, Problem

# J/rad² and J/s²: a step of 1e-6 rad, as much as the last barrier may leave, weighs a tenth of a J/rad.
SPRING = 1e5
ITERATIONS, BARRIER = 200, 1e-2
# J/rad and J/s: how well the multipliers are found.
FLAT = 1e-3
# Multipliers of this mean size aren't scaled down (Wächter and Biegler).
USUAL = 100.0


@dataclass(frozen=True)
class Optimality:
    """The residual of the Karush-Kuhn-Tucker conditions, scaled as IPOPT's: 0 at a local optimum.

    Parameters
    ----------
    dual : J/rad and J/s, largest entry of the Lagrangian's gradient
    primal : mm, rad or cosine, largest violation of a bound
    complementarity : J, largest product of a multiplier and the room that it should have closed
    """

    dual: float
    primal: float
    complementarity: float

    def as_dict(self) -> dict[str, float]:
        """Return the figures as plain data for JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class _Linear:
    """Quantities linear in small steps, (n, d), which are quantities themselves, behind the others."""

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
    """Measure how far an admissible path, (n, 2) rad, is from a local optimum."""
    # What stands on a bound must not be taken for beyond it.
    rows = rows_of(problem, margin=-ALLOWED)
    x = rows.start(problem, rotary)
    weights = np.zeros((len(x), rows.count))
    quantities, slope, _ = chained(rows).derivatives(x, weights)
    linear = _sprung(rows)
    found = minimise(
        linear,
        _Linear(quantities, slope),
        np.zeros_like(x),
        iterations=ITERATIONS,
        barrier=BARRIER,
        flat=FLAT,
    )
    multiplier = found.multiplier[: len(rows.first)]
    value = np.sum(rows.coefficient * quantities.ravel()[rows.place] * (rows.place >= 0), axis=1)
    force = (multiplier + 2.0 * rows.square * value)[:, None] * rows.coefficient * (rows.place >= 0)
    weight = np.bincount(rows.place.ravel() % quantities.size, force.ravel(), quantities.size)
    gradient = np.einsum("nmd,nm->nd", slope, weight.reshape(quantities.shape))
    v = parted(rows, value, 0.0, 0.0)
    pull = rows.price - rows.sign * multiplier[rows.row]
    moves = rows.low < rows.high
    room = np.where(pull > 0.0, v - rows.low, rows.high - v)
    # A pull towards where there is no bound is an error of the gradient.
    endless = moves & ~np.isfinite(room)
    closed = np.abs(pull) * np.where(moves & ~endless, room, 0.0)
    dual = max(float(np.abs(gradient).max()), float(np.max(np.abs(pull), initial=0.0, where=endless)))
    scale = max(USUAL, float(np.abs(multiplier).mean())) / USUAL
    return Optimality(dual / scale, problem.violation(rotary), float(closed.max(initial=0.0)) / scale)


def _sprung(rows: Rows) -> Rows:
    """Give every unknown that moves a row of its own: a spring; places count `_Linear`'s quantities."""
    (at, unknown), wide = np.nonzero(rows.free), rows.count + rows.unknowns
    place = np.where(rows.place >= 0, rows.place // rows.count * wide + rows.place % rows.count, -1)
    springs = np.full((len(at), place.shape[1]), -1)
    springs[:, 0] = at * wide + rows.count + unknown
    return replace(
        rows,
        first=np.concatenate([rows.first, at]),
        place=np.vstack([place, springs]),
        coefficient=np.vstack([rows.coefficient, np.ones(springs.shape)]),
        square=np.concatenate([rows.square, np.full(len(at), SPRING / 2.0)]),
        begin=np.concatenate([rows.begin, np.full(len(at), rows.begin[-1])]),
        count=wide,
    )
