"""Moves on which the tool would have to turn too far, and how far."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.lattice import spin_angles
from fiveaxis.toolpath import Toolpath

# Grid of both rotary angles (rad): a share of the bound, between these limits.
SHARE, FINEST, COARSEST = 1.0 / 3.0, np.radians(3.0), np.radians(5.0)
# Longer paths aren't analysed: each pair of locations costs the square of its postures.
MOST_LOCATIONS = 3000


@dataclass(frozen=True, eq=False)
class _Layer:
    """Admissible postures of a location, (m, 2) rad, the least cost to reach each, and from which, (m,)."""

    rotary: Array
    cost: Array
    came: IntArray


def long_turns(problem: Problem, toolpath: Toolpath) -> list[Finding]:
    """List the cutting moves on which a rotary axis has to turn farther than allowed.

    They are those of the path through a grid of admissible postures with the smallest sum of squares of turns
    beyond their bounds. The grid is coarse: angles are accurate to a few degrees.

    Returns
    -------
    One finding per move, code ``no-posture``, at the location where it ends, with the turn in degrees; none
    if the grid is too coarse, or has a path within the bounds
    """
    bounds = problem.max_turn[problem.strict]
    smallest = float(bounds.min(initial=np.inf))
    step = SHARE * smallest
    if not FINEST <= step < np.inf or len(problem) > MOST_LOCATIONS:
        return []
    layers = _layers(problem, min(step, COARSEST))
    if layers is None:
        return []
    path = _traced(layers)
    turns = _turns(problem, path[:-1, None], path[1:, None])[:, 0]
    past = (turns - problem.max_turn).max(axis=1)
    rows = np.flatnonzero(problem.strict & (past > ALLOWED))
    needed = math.ceil(max((float(np.degrees(turns[row].max())) for row in rows), default=0.0))
    return [_finding(problem, toolpath, int(row), np.degrees(turns[row]), needed) for row in rows]


def _finding(problem: Problem, toolpath: Toolpath, row: int, turns: Array, needed: int) -> Finding:
    column = problem.machine.rotary_columns[int(np.argmax(turns))]
    letter = problem.machine.axes[column].letter
    most = np.degrees(problem.max_turn[row].min())
    return Finding(
        Severity.ERROR,
        "no-posture",
        f"no posture here is within {most:g} deg of an admissible one at location {row}: {letter} has to "
        f"turn by about {turns.max():.0f} deg in between; allow turns of {needed} deg (--max-turn {needed}) "
        "or put the locations closer together",
        toolpath.place(row + 1),
        float(turns.max()),
    )


def _layers(problem: Problem, step: float) -> list[_Layer] | None:
    """Find the postures of every location with the least cost to reach each; None if a location has none."""
    grids = [spin_angles(problem, axis, step)[0] for axis in (0, 1)]
    every = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 2)
    layers: list[_Layer] = []
    for row in range(len(problem)):
        positions, excess = problem.placed(np.array([row]), every[None])
        rotary = every[(excess[0] <= ALLOWED) & (problem.limit_excess(positions[0]) <= ALLOWED)]
        if not len(rotary):
            return None
        if not row:
            layers.append(_Layer(rotary, np.zeros(len(rotary)), np.zeros(len(rotary), dtype=np.int64)))
            continue
        last = layers[-1]
        past = (_turns(problem, last.rotary[None], rotary[:, None]) - problem.max_turn[row - 1]).max(axis=-1)
        total = last.cost + (np.maximum(past, 0.0) ** 2 if problem.strict[row - 1] else 0.0 * past)
        # Of equals the one with the smallest turn.
        came = np.argmin(total + 1e-9 * np.maximum(past + np.pi, 0.0), axis=1)
        layers.append(_Layer(rotary, total[np.arange(len(rotary)), came], came))
    return layers


def _turns(problem: Problem, here: Array, there: Array) -> Array:
    """Compute turns between angles, (..., 2) rad, the shorter ones for axes with at least a full turn."""
    turns = np.abs(there - here)
    columns = problem.machine.rotary_columns
    wraps = problem.machine.high[columns] - problem.machine.low[columns] >= 2.0 * np.pi
    around = np.mod(turns, 2.0 * np.pi)
    return np.where(wraps, np.minimum(around, 2.0 * np.pi - around), turns)


def _traced(layers: list[_Layer]) -> Array:
    """Trace the cheapest path back, (n, 2) rad."""
    path = np.empty((len(layers), 2))
    state = int(np.argmin(layers[-1].cost))
    for row in range(len(layers) - 1, -1, -1):
        path[row] = layers[row].rotary[state]
        state = int(layers[row].came[state])
    return path
