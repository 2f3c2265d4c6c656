"""Turns: which turn each location is run on, where an axis has several but not all.

The optimiser winds such an axis without end first. Whole turns move neither the tool nor any other axis, so
which turn each location is run on is a problem of its own: dynamic programming over the turn number, in which
changing the turn costs what backing off, turning and coming back cost. That is exact for the path given.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Limits, Machine


def winding_columns(machine: Machine) -> list[int]:
    """Columns of the rotary axes that have a whole turn or more, but not without end."""
    axes = machine.axes
    return [
        c
        for c in machine.rotary_columns
        if not axes[c].limits.unlimited and axes[c].limits.high - axes[c].limits.low >= TURN - ON_LIMIT
    ]


def endless(machine: Machine) -> Machine:
    """Return the machine with axes of a whole turn or more turning without end."""
    free = set(winding_columns(machine))
    axes = tuple(replace(a, limits=Limits()) if c in free else a for c, a in enumerate(machine.axes))
    return replace(machine, axes=axes)


def plan_turns(
    angles: Array, limits: tuple[float, float], stop: Array, up: Array, down: Array
) -> tuple[IntArray, IntArray] | None:
    """Choose the turn of every location so that the rewinds cost least.

    Parameters
    ----------
    angles : (n,), rad, wound
    limits : rad
    stop : (n,), J, of rewinding at a location at all; infinite where that can't be
    up, down : (n,), J, of each turn forwards and back

    Returns
    -------
    before, after : (n,), whole turns to add on the way to each location and on the way from it; they differ
        where the axis rewinds. None where there is no way
    """
    low, high = limits
    least = np.ceil((low - ON_LIMIT - angles) / TURN).astype(np.int64)
    most = np.floor((high + ON_LIMIT - angles) / TURN).astype(np.int64)
    # Of paths that cost the same, the first in this order is taken: the one next to 0.
    turns = np.array(sorted(range(least.min(), most.max() + 1), key=lambda k: (abs(k), k)), dtype=np.int64)
    change = (turns[None, :] - turns[:, None]).astype(float)
    n, itself = len(angles), np.arange(len(turns))
    came = np.tile(itself, (n, 1))
    cost = np.zeros(len(turns))
    for i in range(n):
        allowed = (turns >= least[i]) & (turns <= most[i])
        cost = np.where(allowed, cost, np.inf)
        if np.isfinite(stop[i]) and allowed.sum() > 1:
            turning = stop[i] + up[i] * np.maximum(change, 0.0) - down[i] * np.minimum(change, 0.0)
            np.fill_diagonal(turning, 0.0)
            total = cost[:, None] + np.where(allowed[None, :], turning, np.inf)
            came[i] = np.argmin(total, axis=0)
            cost = total[came[i], itself]
        if not np.isfinite(cost).any():
            return None
    before, after = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    at = int(np.argmin(cost))
    for i in range(n - 1, -1, -1):
        after[i], at = turns[at], int(came[i, at])
        before[i] = turns[at]
    return before, after
