"""The turn of every location, for axes with a whole turn or more but not without end.

The optimiser first winds such an axis without end. Whole turns move neither the tool nor any other axis, so
the turns are a separate problem: dynamic programming over the turn number, in which changing the turn costs
what backing off, turning and returning cost. That is exact for the given path.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.model import ON_LIMIT, TURN, Limits, Machine

# Stands for: no turn is possible.
NO_TURN = np.iinfo(np.int64).max


def winding_columns(machine: Machine) -> list[int]:
    """Find the columns of the rotary axes that have a whole turn or more, but not without end."""
    axes = machine.axes
    return [
        c
        for c in machine.rotary_columns
        if not axes[c].limits.unlimited and axes[c].limits.span >= TURN - ON_LIMIT
    ]


def endless(machine: Machine) -> Machine:
    """Free the axes that have a whole turn or more of their limits."""
    free = set(winding_columns(machine))
    axes = tuple(replace(a, limits=Limits()) if c in free else a for c, a in enumerate(machine.axes))
    return replace(machine, axes=axes)


def plan_turns(
    angles: Array, limits: Limits, stop: Array, up: float = 0.0, down: float = 0.0
) -> tuple[IntArray, IntArray] | None:
    """Choose the turn of every location so that the rewinds of an axis with limits cost least.

    Its angles, (n,) rad, are unwrapped. To stop at a location for a rewind costs (n,) J, infinite where that
    is impossible, and each turn costs `up` or `down`, J. Return the whole turns to add on the moves to each
    location and from it, (n,) each, which differ where the axis rewinds; None if the path can't be rewound.
    """
    # Towards an open end no path needs more turns than it makes.
    room = np.ceil(np.ptp(angles) / TURN) + 1.0
    first, final = (
        np.ceil((limits.low - ON_LIMIT - angles) / TURN),
        np.floor((limits.high + ON_LIMIT - angles) / TURN),
    )
    least = np.where(np.isfinite(first), first, final - room).astype(np.int64)
    most = np.where(np.isfinite(final), final, first + room).astype(np.int64)
    came, last = _cheapest_turns(least, most, stop.astype(float), float(up), float(down))
    if last == NO_TURN:
        return None
    before, after = np.empty(len(angles), dtype=np.int64), np.empty(len(angles), dtype=np.int64)
    for i in range(len(angles) - 1, -1, -1):
        after[i], last = last, int(came[i, last - least[i]])
        before[i] = last
    return before, after


@compiled
def _cheapest_turns(
    least: IntArray, most: IntArray, stop: Array, up: float, down: float
) -> tuple[IntArray, int]:
    """Find the turn before each turn of each location, counted from its least one, and the last turn.

    Of paths with the same cost the one with turns nearest to 0 is taken.
    """
    n, width = len(least), max(1, np.max(most - least) + 1)
    came = np.zeros((n, width), dtype=np.int64)
    cost, arrived = np.full(width, np.inf), np.full(width, np.inf)
    for i in range(n):
        for w in range(width):
            k = least[i] + w
            arrived[w] = np.inf
            if k > most[i]:
                continue
            if i == 0:
                arrived[w] = 0.0
            elif least[i - 1] <= k <= most[i - 1]:
                arrived[w] = cost[k - least[i - 1]]
        for w in range(width):
            cost[w], came[i, w] = arrived[w], least[i] + w
            if least[i] + w > most[i] or stop[i] == np.inf:
                continue
            for v in range(width):
                turns = w - v
                if turns == 0 or arrived[v] == np.inf:
                    continue
                total = arrived[v] + stop[i] + (turns * up if turns > 0 else -turns * down)
                nearer = abs(least[i] + v) < abs(came[i, w])
                if total < cost[w] or (total == cost[w] and nearer):
                    cost[w], came[i, w] = total, least[i] + v
    last, best = NO_TURN, np.inf
    for w in range(width):
        k = least[n - 1] + w
        if cost[w] < best or (cost[w] == best and cost[w] < np.inf and abs(k) < abs(last)):
            last, best = k, cost[w]
    return came, last
