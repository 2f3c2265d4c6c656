"""Between which locations the tool would have to turn too far, and how far."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.lattice import spin_angles
from fiveaxis.toolpath import Toolpath

# Grid of both rotary angles (rad): as fine as a share of the bound asks, within these.
SHARE, FINEST, COARSEST = 1.0 / 3.0, np.radians(3.0), np.radians(5.0)
# Longer paths aren't looked at: each pair of locations costs the square of its postures.
MOST_LOCATIONS = 3000


@dataclass(frozen=True, eq=False)
class _Layer:
    """Admissible postures of a location, (m, 2) rad, what it takes to get there, and from where (m,)."""

    rotary: Array
    cost: Array
    came: Array


def long_turns(problem: Problem, toolpath: Toolpath) -> list[Finding]:
    """Name the cutting moves on which a rotary axis has to turn further than it may.

    Of all ways through a grid of admissible postures it is the one whose turns beyond their bounds add up to
    the smallest sum of squares. A grid is coarse: angles are good to a few degrees.

    Returns
    -------
    One finding a move, code ``no-posture``, at the location where it ends, its value the turn in degrees;
    none where the grid is too coarse to tell, or has a way within the bounds
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
    allowed = np.degrees(problem.max_turn[row].min())
    return Finding(
        Severity.ERROR,
        "no-posture",
        f"no posture here is within {allowed:g} deg of one that location {row} can have: {letter} has to "
        f"turn by about {turns.max():.0f} deg in between; allow turns of {needed} deg (--max-turn {needed}) "
        "or put the locations closer together",
        toolpath.place(row + 1),
        float(turns.max()),
    )


def _layers(problem: Problem, step: float) -> list[_Layer] | None:
    """Work out the postures of every location with the least that it takes to reach each."""
    grids = [spin_angles(problem, axis, step)[0] for axis in (0, 1)]
    every = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 2)
    layers: list[_Layer] = []
    for row in range(len(problem)):
        positions, excess = problem.placed(np.array([row]), every[None])
        allowed = (excess[0] <= ALLOWED) & (problem.limit_excess(positions[0]) <= ALLOWED)
        rotary = every[allowed]
        if not len(rotary):
            return None
        if not row:
            layers.append(_Layer(rotary, np.zeros(len(rotary)), np.zeros(len(rotary))))
            continue
        last = layers[-1]
        past = (_turns(problem, last.rotary[None], rotary[:, None]) - problem.max_turn[row - 1]).max(axis=-1)
        total = last.cost + (np.maximum(past, 0.0) ** 2 if problem.strict[row - 1] else 0.0 * past)
        # Among equals the shortest turn: a way that needn't turn shouldn't.
        came = np.argmin(total + 1e-9 * np.maximum(past + np.pi, 0.0), axis=1)
        layers.append(_Layer(rotary, total[np.arange(len(rotary)), came], came.astype(float)))
    return layers


def _turns(problem: Problem, here: Array, there: Array) -> Array:
    """Measure turns between angles, (..., 2) rad, the short way round where an axis has a turn or more."""
    turns = np.abs(there - here)
    columns = problem.machine.rotary_columns
    wraps = problem.machine.high[columns] - problem.machine.low[columns] >= 2.0 * np.pi
    around = np.mod(turns, 2.0 * np.pi)
    return np.where(wraps, np.minimum(around, 2.0 * np.pi - around), turns)


def _traced(layers: list[_Layer]) -> Array:
    """Follow the cheapest way back, (n, 2) rad."""
    path = np.empty((len(layers), 2))
    state = int(np.argmin(layers[-1].cost))
    for row in range(len(layers) - 1, -1, -1):
        path[row] = layers[row].rotary[state]
        state = int(layers[row].came[state])
    return path
