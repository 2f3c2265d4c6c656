"""The exact local optimum: CasADi writes the problem, IPOPT solves it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics.symbolic import linear_axes_of_posture, tool_axis_of_posture
from fiveaxis.posture.problem import ALLOWED, Problem

IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-6,
    # Results must lie inside the bounds, not within a tolerance of them.
    "bound_relax_factor": 0.0,
    "nlp_scaling_method": "none",
}
# Cosines stay this far inside the tilt range, so that the solver's rounding doesn't carry them out.
MARGIN = 1e-9
# An axis that costs nothing would leave its pair of slacks undetermined (J/mm, J/rad).
LEAST_COST = 1e-6


@dataclass(frozen=True, eq=False)
class Refinement:
    """A path after the NLP; never worse than its start.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    cost : J
    status : IPOPT's own word
    """

    rotary: Array
    cost: float
    status: str
    iterations: int


def refine(problem: Problem, start: Array, *, iterations: int, barrier: float) -> Refinement:
    """Minimise the travel cost from a start.

    The directional cost is written exactly: ``Δq_a = s_a − t_a`` with ``s, t ≥ 0`` at ``W⁺s + W⁻t``. Every
    step couples two neighbours only, so the problem is banded and CasADi maps one small expression over all
    locations.

    Parameters
    ----------
    problem : what to solve
    start : (n, 2), rad, chain order
    iterations : most that IPOPT may take
    barrier : IPOPT's first barrier parameter; small for a start that is nearly right

    Returns
    -------
    The refined path; the start itself where the solver didn't better it, or left what is allowed.
    """
    nlp = _write(problem)
    options = {**IPOPT, "max_iter": iterations, "mu_init": barrier}
    solver = ca.nlpsol("refine", "ipopt", nlp.functions, {"print_time": False, "ipopt": options})
    step = np.diff(problem.positions(slice(None), start), axis=0).ravel()
    guess = np.concatenate([start.ravel(), np.maximum(step, 0.0), np.maximum(-step, 0.0)])
    answer = solver(x0=guess, lbx=nlp.low, ubx=nlp.high, lbg=nlp.least, ubg=nlp.most)
    stats = solver.stats()
    found = np.array(answer["x"])[: start.size, 0].reshape(start.shape)
    kept = _better(problem, found, start)
    cost = problem.cost(problem.positions(slice(None), kept))
    return Refinement(kept, cost, str(stats["return_status"]), int(stats["iter_count"]))


@dataclass(frozen=True, eq=False)
class _Nlp:
    """CasADi's functions of the problem, and the bounds of variables and constraints."""

    functions: dict[str, Any]
    low: Array
    high: Array
    least: Array
    most: Array


def _write(problem: Problem) -> _Nlp:
    machine = problem.machine
    n, k = len(problem), len(machine.axes)
    rotary, grow, fall = ca.MX.sym("rotary", 2, n), ca.MX.sym("grow", k, n - 1), ca.MX.sym("fall", k, n - 1)
    reference = np.nan_to_num(problem.reference.T)
    positions, cosine = _location(problem).map(n)(problem.pivot.T, reference, rotary)
    constraints = [(ca.vec(positions[:, 1:] - positions[:, :-1] - grow + fall), 0.0, 0.0)]
    bound = np.flatnonzero(problem.bound_rows).tolist()
    low, high = problem.cosines
    # A range from 0 has no upper cosine to keep: it would cut off the reference itself.
    most = high - MARGIN if high < 1.0 else np.inf
    constraints.append((ca.vec(cosine[bound]), low + MARGIN, most))
    for column in machine.linear_columns:
        limits = machine.axes[column].limits
        if not limits.unlimited:
            constraints.append((ca.vec(positions[column, :]), limits.low, limits.high))
    plus, minus = np.maximum(problem.plus, LEAST_COST), np.maximum(problem.minus, LEAST_COST)
    functions = {
        "x": ca.veccat(rotary, grow, fall),
        "f": ca.dot(plus.T, grow) + ca.dot(minus.T, fall),
        "g": ca.vertcat(*(expression for expression, _, _ in constraints)),
    }
    longest = np.full((n - 1, k), np.inf)
    longest[:, machine.rotary_columns] = problem.max_turn
    columns = machine.rotary_columns
    return _Nlp(
        functions,
        low=np.concatenate([np.tile(machine.low[columns], n), np.zeros(2 * longest.size)]),
        high=np.concatenate([np.tile(machine.high[columns], n), longest.ravel(), longest.ravel()]),
        least=np.concatenate([np.full(e.shape[0], least) for e, least, _ in constraints]),
        most=np.concatenate([np.full(e.shape[0], most) for e, _, most in constraints]),
    )


def _location(problem: Problem) -> ca.Function:
    """Write one location: (pivot, reference, rotary) → (axis values, cosine of the tilt)."""
    machine = problem.machine
    pivot, reference, rotary = ca.SX.sym("pivot", 3), ca.SX.sym("reference", 3), ca.SX.sym("rotary", 2)
    linear = linear_axes_of_posture(machine, pivot, rotary, problem.pivot_to_tip)
    values = dict(zip(machine.linear_columns, ca.vertsplit(linear), strict=True))
    values |= dict(zip(machine.rotary_columns, ca.vertsplit(rotary), strict=True))
    positions = ca.vertcat(*(values[column] for column in range(len(machine.axes))))
    cosine = ca.dot(tool_axis_of_posture(machine, rotary), reference)
    return ca.Function("location", [pivot, reference, rotary], [positions, cosine])


def _better(problem: Problem, found: Array, start: Array) -> Array:
    """Keep the start unless the solver's answer is cheaper and allowed, or the start wasn't allowed."""
    if not np.isfinite(found).all():
        return start
    faults = problem.violation(found), problem.violation(start)
    if max(faults) > ALLOWED:
        return found if faults[0] < faults[1] else start
    costs = [problem.cost(problem.positions(slice(None), path)) for path in (found, start)]
    return found if costs[0] < costs[1] else start
