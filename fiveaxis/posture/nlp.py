"""The problem as CasADi writes it: variables, objective and constraints, banded along the path.

The directional cost is written exactly, ``Δq_a = s_a − t_a`` with ``s, t ≥ 0`` at ``W⁺s + W⁻t``; a smoothed
absolute value fails. Terms that a problem doesn't have add no variables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics.symbolic import linear_axes_of_posture, tool_axis_of_posture
from fiveaxis.posture.problem import JOLT_PRICE, Problem

# Cosines stay this far inside the tilt range, so that the solver's rounding doesn't carry them out.
MARGIN = 1e-9
# An axis that costs nothing would leave its pair of slacks undetermined (J/mm, J/rad).
LEAST_COST = 1e-6

# An expression and the bounds of its elements.
Constraint = tuple[ca.MX, Any, Any]


@dataclass(frozen=True, eq=False)
class Nlp:
    """CasADi's functions of the problem, and the bounds of variables and constraints."""

    functions: dict[str, Any]
    low: Array
    high: Array
    least: Array
    most: Array


def write_nlp(problem: Problem) -> Nlp:
    """Write a problem: first the rotary angles, (n, 2) row by row, then what the terms need."""
    machine = problem.machine
    n, k = len(problem), len(machine.axes)
    rotary, grow, fall = ca.MX.sym("rotary", 2, n), ca.MX.sym("grow", k, n - 1), ca.MX.sym("fall", k, n - 1)
    references = np.nan_to_num(np.hstack([b.reference for b in problem.bounds])).T
    positions, cosines = _location(problem).map(n)(problem.pivot.T, problem.normal.T, references, rotary)
    plus, minus = np.maximum(problem.plus, LEAST_COST), np.maximum(problem.minus, LEAST_COST)
    wait, late = _delay(problem, grow + fall)
    turns = rotary[:, 1:] - rotary[:, :-1]
    jolt, sudden = _jolts(problem, turns)
    objective = ca.dot(plus.T, grow) + ca.dot(minus.T, fall)
    objective += problem.time_price * ca.sum1(wait) + JOLT_PRICE * ca.sum1(jolt)
    if problem.bend_price.any():
        objective += ca.dot(np.repeat(problem.bend_price[None], 2, axis=0), turns**2)
    steps: Constraint = (ca.vec(positions[:, 1:] - positions[:, :-1] - grow + fall), 0.0, 0.0)
    constraints = [steps, *_leans(problem, cosines), *_limits(problem, positions), *late, *sudden]
    low, high = _angles_and_steps(problem)
    waits = wait.shape[0] + jolt.shape[0]
    return Nlp(
        {
            "x": ca.veccat(rotary, grow, fall, wait, jolt),
            "f": objective,
            "g": ca.vertcat(*(expression for expression, _, _ in constraints)),
        },
        low=np.concatenate([low, np.zeros(waits)]),
        high=np.concatenate([high, np.full(waits, np.inf)]),
        least=np.concatenate([np.broadcast_to(least, e.shape[0]) for e, least, _ in constraints]),
        most=np.concatenate([np.broadcast_to(most, e.shape[0]) for e, _, most in constraints]),
    )


def starting_point(problem: Problem, start: Array) -> Array:
    """Give the variables of the NLP, (v,), that a path, (n, 2) rad, stands for."""
    step = np.diff(problem.positions(slice(None), start), axis=0)
    wait = problem.delay(step) if problem.is_timed else np.empty(0)
    jolts = problem.jolts(step[:, problem.machine.rotary_columns])
    rise, drop = np.maximum(step, 0.0), np.maximum(-step, 0.0)
    return np.concatenate([start.ravel(), rise.ravel(), drop.ravel(), wait, jolts.ravel()])


def _angles_and_steps(problem: Problem) -> tuple[Array, Array]:
    """Bound the rotary angles by their limits, and steps by the largest turns."""
    machine, n = problem.machine, len(problem)
    columns = machine.rotary_columns
    longest = np.full((n - 1, len(machine.axes)), np.inf)
    longest[:, columns] = problem.max_turn
    low = np.concatenate([np.tile(machine.low[columns], n), np.zeros(2 * longest.size)])
    return low, np.concatenate([np.tile(machine.high[columns], n), longest.ravel(), longest.ravel()])


def _leans(problem: Problem, cosines: ca.MX) -> list[Constraint]:
    """Keep the cosines to every reference inside their ranges, where there is a reference."""
    constraints: list[Constraint] = []
    for number, bound in enumerate(problem.bounds):
        rows = np.flatnonzero(np.isfinite(bound.reference).all(axis=1)).tolist()
        low, high = bound.cosines
        # A range from 0 has no upper cosine to keep: it would cut off the reference itself.
        most = high - MARGIN if high < 1.0 else np.inf
        constraints.append((ca.vec(cosines[number, rows]), low + MARGIN, most))
    return constraints


def _limits(problem: Problem, positions: ca.MX) -> list[Constraint]:
    """Keep the linear axes inside their limits; those of the rotary ones bound variables."""
    machine = problem.machine
    limited = [c for c in machine.linear_columns if not machine.axes[c].limits.unlimited]
    return [
        (ca.vec(positions[column, :]), machine.axes[column].limits.low, machine.axes[column].limits.high)
        for column in limited
    ]


def _delay(problem: Problem, way: ca.MX) -> tuple[ca.MX, list[Constraint]]:
    """Let steps, (k, n − 1), wait beyond the feed's time for the axis that has farthest to go."""
    if not problem.is_timed:
        return ca.MX(0, 1), []
    wait = ca.MX.sym("wait", len(problem) - 1)
    timed = np.flatnonzero(np.isfinite(problem.top_speed)).tolist()
    return wait, [
        (way[column, :].T / problem.top_speed[column] - wait, -np.inf, problem.least_time) for column in timed
    ]


def _jolts(problem: Problem, turns: ca.MX) -> tuple[ca.MX, list[Constraint]]:
    """Let rotary axes, turning by (2, n − 1), change their speed faster than they can, for a price."""
    first = problem.jolted
    if not len(first):
        return ca.MX(0, 1), []
    jolt = ca.MX.sym("jolt", 2 * len(first))
    pace = 1.0 / np.where(problem.least_time > 0.0, problem.least_time, 1.0)
    rate = turns * np.repeat(pace[None], 2, axis=0)
    change = ca.vec(rate[:, (first + 1).tolist()] - rate[:, first.tolist()])
    # An axis without a known acceleration has no bound to keep.
    allowed = problem.speed_changes.ravel()
    return jolt, [(sign * change - jolt, -np.inf, allowed) for sign in (1.0, -1.0)]


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
