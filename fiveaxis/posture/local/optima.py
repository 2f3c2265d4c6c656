"""The exact local optimum near a start, by either solver, and the distance of a path from one.

A path is a first-order optimum if multipliers of its rows exist that balance the objective: within
``−W⁻ … W⁺`` where an axis stands still, at an end of that range where it moves, of the right sign on a bound.
The multipliers with the least residual are found with CasADi's derivatives at the path: they are those of the
step that improves the linearised problem, held back by a stiff spring. The solvers' own multipliers aren't
used.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from fiveaxis.base import Array, SettingError
from fiveaxis.posture.local import kernel
from fiveaxis.posture.local.interior import LAST_BARRIER, LocalOptimum, minimise, split_rows
from fiveaxis.posture.local.ipopt import SOLVED, minimise_by_ipopt
from fiveaxis.posture.local.rows import ChainModel, Rows, build_rows
from fiveaxis.posture.problem import ALLOWED, VIOLATION_PRICE, Problem

# The method made for paths, and IPOPT.
STRUCTURED, IPOPT = "structured", "ipopt"
SOLVERS = (STRUCTURED, IPOPT)
# Iterations of the structured method for one of IPOPT's, each in a tenth of the time.
ITERATIONS = 3
# First barrier parameters, as multiples of IPOPT's. The large one leads further from the start, the small one
# stays near it, and either may end in the better optimum; long paths use only the first. A start that is near
# but outside of its bounds needs a little more than the small one to come in.
BARRIERS, OUTSIDE, LONG = (25.0, 2.5), 5.0, 5000
# From outside the bounds: first barrier parameter and price of a violation, for a J/rad of the dearer axis;
# and mm, rad and cosine by which bounds are narrower at last, as what isn't solved ends past them by little.
LEEWAY, STEEPEST, INSIDE = 3e-4, 1000.0, 1e-6
UNSOLVED = "Maximum_Iterations_Exceeded"
# J/rad² and J/s²: a step of 1e-6 rad, the error that the last barrier may leave, gives a tenth of a J/rad.
SPRING = 1e5
# Iterations and first barrier parameter, J, for the multipliers.
MULTIPLIER_ITERATIONS, MULTIPLIER_BARRIER = 200, 1e-2
# J/rad and J/s: accuracy of the multipliers.
FLAT = 1e-3
# Multipliers of this mean size aren't scaled down (Wächter and Biegler).
USUAL = 100.0


@dataclass(frozen=True, eq=False)
class Refinement:
    """A path refined by the NLP, (n, 2) rad, chain order, and its cost, J; never worse than its start.

    The status is `SOLVED`, or the solver's own.
    """

    rotary: Array
    cost: float
    status: str
    iterations: int


def refine(
    problem: Problem,
    start: Array,
    *,
    iterations: int,
    barrier: float,
    held: tuple[bool, bool] = (False, False),
    near: bool = False,
    last: float = LAST_BARRIER,
    solver: str = STRUCTURED,
) -> Refinement:
    """Minimise a problem's cost from a start, which is returned if it isn't improved or a bound is broken.

    `SettingError` if the solver is none of `SOLVERS`.

    Parameters
    ----------
    start : (n, 2), rad, chain order
    iterations : largest number for IPOPT
    barrier : IPOPT's first barrier parameter, J; small for a start near an optimum
    held : whether the first and the last posture stay as they are
    near : whether the start is near an optimum, and one of many: the structured method then uses only its
        small barrier, or `OUTSIDE`
    last : the structured method's last barrier parameter, J
    """
    if solver not in SOLVERS:
        raise SettingError(f"unknown solver {solver!r}; use {' or '.join(SOLVERS)}")
    rows = build_rows(problem, held)
    x = rows.start(problem, start)
    if solver == IPOPT:
        tried = [minimise_by_ipopt(rows, x, iterations=iterations, barrier=barrier)]
    else:
        if near:
            factors = (OUTSIDE,) if problem.violation(start) > ALLOWED else BARRIERS[::-1]
        else:
            factors = BARRIERS[:1] if len(problem) > LONG else BARRIERS
        tried = []
        for factor in factors:
            most, first = ITERATIONS * iterations, factor * barrier
            tried.append(minimise(rows, x, iterations=most, barrier=first, last=last))
            if near and (tried[-1].solved or _choose(problem, tried[-1].rotary, start) is not start):
                break
    kept = start
    for found in tried:
        kept = _choose(problem, found.rotary, kept)
    unsolved = solver == STRUCTURED and not any(found.solved for found in tried)
    # Attempts may end past a bound by hardly more than rounding, far cheaper than the start.
    if unsolved and (not near or kept is start or problem.violation(kept) > ALLOWED):
        tried.append(_minimise_from_outside(problem, x, held, iterations, barrier, last))
        kept = _choose(problem, tried[-1].rotary, kept)
    return Refinement(
        kept,
        problem.cost(problem.positions(slice(None), kept)),
        SOLVED if any(found.solved for found in tried) else UNSOLVED,
        sum(found.iterations for found in tried),
    )


def _minimise_from_outside(
    problem: Problem, x: Array, held: tuple[bool, bool], iterations: int, barrier: float, last: float
) -> LocalOptimum:
    """Bring unknowns, (n, d), within bounds that first have a price: outside the filter may stall."""
    most, rotary = ITERATIONS * iterations, problem.machine.rotary_columns
    dearest = float(np.median(np.maximum(problem.plus, problem.minus)[:, rotary], axis=0).max())
    # Else a bound that is dear to keep is left broken, or the path stays on the wrong side of it.
    elastic = build_rows(problem, held, elastic=max(VIOLATION_PRICE, STEEPEST * dearest))
    first = BARRIERS[0] * max(barrier, LEEWAY * dearest)
    led = minimise(elastic, x, iterations=most, barrier=first, last=last)
    if problem.violation(led.rotary) <= ALLOWED:
        return led
    rows = build_rows(problem, held, margin=INSIDE)
    found = minimise(rows, led.x, iterations=most, barrier=BARRIERS[-1] * barrier, last=last)
    return replace(found, iterations=led.iterations + found.iterations)


def _choose(problem: Problem, found: Array, start: Array) -> Array:
    """Choose between result and start: the smaller violation, or the lower cost if both are allowed."""
    if not np.isfinite(found).all():
        return start
    faults = problem.violation(found), problem.violation(start)
    if max(faults) > ALLOWED:
        return found if faults[0] < faults[1] else start
    costs = [problem.cost(problem.positions(slice(None), path)) for path in (found, start)]
    return found if costs[0] < costs[1] else start


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
        _with_springs(rows),
        still,
        model=model,
        iterations=MULTIPLIER_ITERATIONS,
        barrier=MULTIPLIER_BARRIER,
        flat=FLAT,
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
