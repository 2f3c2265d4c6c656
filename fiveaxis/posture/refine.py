"""The exact local optimum: CasADi writes the problem, IPOPT solves it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
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
# IPOPT's word for a converged problem.
SOLVED = "Solve_Succeeded"
# Its words when a Ctrl-C reached it.
INTERRUPTED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")
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


def refine(
    problem: Problem,
    start: Array,
    *,
    iterations: int,
    barrier: float,
    held: tuple[bool, bool] = (False, False),
) -> Refinement:
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
    held : whether the first and the last posture stay as they are

    Returns
    -------
    The refined path; the start itself where the solver didn't better it, or left what is allowed.
    """
    nlp = _write(problem)
    for row, is_held in zip((0, len(start) - 1), held, strict=True):
        if is_held:
            nlp.low[2 * row : 2 * row + 2] = nlp.high[2 * row : 2 * row + 2] = start[row]
    options = {**IPOPT, "max_iter": iterations, "mu_init": barrier}
    solver = ca.nlpsol("refine", "ipopt", nlp.functions, {"print_time": False, "ipopt": options})
    guess = starting_point(problem, start)
    answer = solver(x0=guess, lbx=nlp.low, ubx=nlp.high, lbg=nlp.least, ubg=nlp.most)
    stats = solver.stats()
    _require_uninterrupted(str(stats["return_status"]))
    found = np.array(answer["x"])[: start.size, 0].reshape(start.shape)
    kept = _better(problem, found, start)
    cost = problem.cost(problem.positions(slice(None), kept))
    return Refinement(kept, cost, str(stats["return_status"]), int(stats["iter_count"]))


def starting_point(problem: Problem, start: Array) -> Array:
    """Give the variables of the NLP, (v,), that a path, (n, 2) rad, stands for."""
    step = np.diff(problem.positions(slice(None), start), axis=0)
    wait = problem.delay(step) if problem.is_timed else np.empty(0)
    return np.concatenate(
        [start.ravel(), np.maximum(step, 0.0).ravel(), np.maximum(-step, 0.0).ravel(), wait]
    )


def _require_uninterrupted(status: str) -> None:
    """Pass a Ctrl-C on: CasADi catches it inside the solver and returns as if that were an answer."""
    if status in INTERRUPTED:
        raise KeyboardInterrupt(f"IPOPT was interrupted ({status})")


def refine_windows(
    problem: Problem, start: Array, *, size: int, iterations: int, barrier: float
) -> Refinement:
    """Refine a long path window by window, each between postures that it holds.

    Two sweeps, the second with the windows shifted by half, so that what one sweep held the other frees. No
    window makes the path dearer, and one that doesn't converge leaves its part as it was: on a path with many
    edges the solver's trouble with one of them doesn't spoil the rest.

    Parameters
    ----------
    size : locations in a window; the rest as for `refine`

    Returns
    -------
    The refined path; its status counts the windows that converged.
    """
    rotary, taken, solved, windows = start.copy(), 0, 0, 0
    for first in (0, size // 2):
        edges = [0, *range(first or size, len(problem) - 1, size), len(problem) - 1]
        for begin, end in pairwise(edges):
            rows = np.arange(begin, end + 1)
            held = (begin > 0, end < len(problem) - 1)
            part = problem.between(begin, end)
            found = refine(part, rotary[rows], iterations=iterations, barrier=barrier, held=held)
            rotary[rows] = found.rotary
            taken += found.iterations
            solved += found.status == SOLVED
            windows += 1
    cost = problem.cost(problem.positions(slice(None), rotary))
    return Refinement(rotary, cost, f"{solved} of {windows} windows converged", taken)


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
    wait = ca.MX.sym("wait", n - 1 if problem.is_timed else 0)
    references = np.nan_to_num(np.hstack([b.reference for b in problem.bounds])).T
    positions, cosines = _location(problem).map(n)(problem.pivot.T, problem.normal.T, references, rotary)
    constraints: list[tuple[ca.MX, float, Any]] = [
        (ca.vec(positions[:, 1:] - positions[:, :-1] - grow + fall), 0.0, 0.0)
    ]
    for number, bound in enumerate(problem.bounds):
        rows = np.flatnonzero(np.isfinite(bound.reference).all(axis=1)).tolist()
        constraints.append((ca.vec(cosines[number, rows]), *_inside(bound.cosines)))
    for column in machine.linear_columns:
        limits = machine.axes[column].limits
        if not limits.unlimited:
            constraints.append((ca.vec(positions[column, :]), limits.low, limits.high))
    # A step that takes longer than at the feed, because an axis has so far to go at its highest speed.
    for column in np.flatnonzero(np.isfinite(problem.top_speed)).tolist() if problem.is_timed else []:
        late = (grow[column, :] + fall[column, :]).T / problem.top_speed[column] - wait
        constraints.append((late, -np.inf, problem.least_time))
    plus, minus = np.maximum(problem.plus, LEAST_COST), np.maximum(problem.minus, LEAST_COST)
    turns = rotary[:, 1:] - rotary[:, :-1]
    functions = {
        "x": ca.veccat(rotary, grow, fall, wait),
        "f": ca.dot(plus.T, grow)
        + ca.dot(minus.T, fall)
        + problem.time_price * ca.sum1(wait)
        + (
            ca.dot(np.repeat(problem.bend_price[None], 2, axis=0), turns**2)
            if problem.bend_price.any()
            else 0.0
        ),
        "g": ca.vertcat(*(expression for expression, _, _ in constraints)),
    }
    longest = np.full((n - 1, k), np.inf)
    longest[:, machine.rotary_columns] = problem.max_turn
    columns = machine.rotary_columns
    return _Nlp(
        functions,
        low=np.concatenate([np.tile(machine.low[columns], n), np.zeros(2 * longest.size + wait.shape[0])]),
        high=np.concatenate(
            [
                np.tile(machine.high[columns], n),
                longest.ravel(),
                longest.ravel(),
                np.full(wait.shape[0], np.inf),
            ]
        ),
        least=np.concatenate([np.broadcast_to(least, e.shape[0]) for e, least, _ in constraints]),
        most=np.concatenate([np.broadcast_to(most, e.shape[0]) for e, _, most in constraints]),
    )


def _inside(cosines: tuple[float, float]) -> tuple[float, float]:
    """Give the bounds of a cosine, a margin inside its range."""
    low, high = cosines
    # A range from 0 has no upper cosine to keep: it would cut off the reference itself.
    return low + MARGIN, high - MARGIN if high < 1.0 else np.inf


def _location(problem: Problem) -> ca.Function:
    """Write one location: (pivot, normal, references, rotary) → (axis values, cosines to the references)."""
    machine, count = problem.machine, len(problem.bounds)
    pivot, normal, rotary = (ca.SX.sym(*name) for name in (("pivot", 3), ("normal", 3), ("rotary", 2)))
    references = ca.SX.sym("references", 3 * count)
    linear = linear_axes_of_posture(machine, pivot, rotary, problem.zone, normal)
    values = dict(zip(machine.linear_columns, ca.vertsplit(linear), strict=True))
    values |= dict(zip(machine.rotary_columns, ca.vertsplit(rotary), strict=True))
    positions = ca.vertcat(*(values[column] for column in range(len(machine.axes))))
    cosines = ca.reshape(references, 3, count).T @ tool_axis_of_posture(machine, rotary)
    return ca.Function("location", [pivot, normal, references, rotary], [positions, cosines])


def _better(problem: Problem, found: Array, start: Array) -> Array:
    """Keep the start unless the solver's answer is cheaper and allowed, or the start wasn't allowed."""
    if not np.isfinite(found).all():
        return start
    faults = problem.violation(found), problem.violation(start)
    if max(faults) > ALLOWED:
        return found if faults[0] < faults[1] else start
    costs = [problem.cost(problem.positions(slice(None), path)) for path in (found, start)]
    return found if costs[0] < costs[1] else start
