"""The compiled loops of the baselines.

Rows are copied element by element: for ``a[:] = b`` numba would spend seconds on compiling the broadcasting
error.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.location_model import Locations, place


@compiled
def best_move(
    locations: Locations,
    i: int,
    limits: Array,
    plus: Array,
    minus: Array,
    here: Array,
    around: Array,
    offsets: Array,
    found: Array,
    there: Array,
) -> bool:
    """Find the cheapest admissible move from one posture to another near an angle pair.

    Parameters
    ----------
    i : location
    limits : (2, k), mm and rad
    plus, minus : (k,), J/mm and J/rad
    here : (k,), mm and rad, start of the move
    around : (2,), rad, chain order
    offsets : (m, 2), rad
    found, there : (2,) and (k,), output: the posture

    Returns
    -------
    Whether any of the offsets is admissible.
    """
    count, least, best = len(offsets), np.inf, -1
    rows, tried = np.empty(count, dtype=np.int64), np.empty((count, 2))
    positions, excess = np.empty((count, len(here))), np.empty(count)
    for m in range(count):
        rows[m] = i
        for r in range(2):
            tried[m, r] = around[r] + offsets[m, r]
    place(locations, rows, tried, positions, excess)
    for m in range(count):
        cost = 0.0 if excess[m] == 0.0 else np.inf
        for a in range(len(here)):
            if not limits[0, a] <= positions[m, a] <= limits[1, a]:
                cost = np.inf
                break
            step = positions[m, a] - here[a]
            cost += plus[a] * step if step > 0.0 else -minus[a] * step
        if cost < least:
            least, best = cost, m
    if best < 0:
        return False
    found[0], found[1] = tried[best, 0], tried[best, 1]
    for a in range(len(here)):
        there[a] = positions[best, a]
    return True


@compiled
def walk(
    locations: Locations,
    limits: Array,
    columns: IntArray,
    plus: Array,
    minus: Array,
    anchor: Array,
    anchored: Array,
    coarse: Array,
    fine: Array,
) -> Array:
    """Take the cheapest move at every location, first coarse then fine, or the one to the anchor.

    Parameters
    ----------
    limits : as for `best_move`
    columns : (2,), of the rotary axes, chain order
    plus, minus : (n, k), of the move into each location
    anchor, anchored : (n, 2) rad and (n, k), a path that is admissible everywhere
    coarse, fine : (m, 2), rad, offsets

    Returns
    -------
    (n, 2), rad
    """
    rotary, here, there = anchor.copy(), anchored[0].copy(), anchored[0].copy()
    around = np.empty(2)
    for i in range(1, len(anchor)):
        around[0], around[1] = here[columns[0]], here[columns[1]]
        for offsets in (coarse, fine):
            near = best_move(locations, i, limits, plus[i], minus[i], here, around, offsets, rotary[i], there)
            to_anchor, least = 0.0, 0.0
            for a in range(len(here)):
                step = anchored[i, a] - here[a]
                to_anchor += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
                step = there[a] - here[a]
                least += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
            if not near or to_anchor < least:
                rotary[i, 0], rotary[i, 1] = anchor[i, 0], anchor[i, 1]
                for a in range(len(here)):
                    there[a] = anchored[i, a]
            around[0], around[1] = rotary[i, 0], rotary[i, 1]
        for a in range(len(here)):
            here[a] = there[a]
    return rotary


@compiled
def cheapest_branches(
    positions: Array,
    allowed: BoolArray,
    columns: IntArray,
    low: Array,
    high: Array,
    slack: float,
    plus: Array,
    minus: Array,
) -> Array:
    """Choose branches and turns by dynamic programming.

    Parameters
    ----------
    positions, allowed : (2, n, k) and (2, n), as `Postures`
    columns : (2,), of the rotary axes
    low, high : (2,), rad; the shorter turn is taken within these limits
    slack : rad, by which limits may be exceeded
    plus, minus : (n, k), J/mm and J/rad, of the move into each location

    Returns
    -------
    (n, 2), rad, chain order
    """
    n, k = positions.shape[1], positions.shape[2]
    turn = 2.0 * np.pi
    came = np.zeros((n, 2), dtype=np.int8)
    trail = np.empty((n, 2, 2))
    cost, reached = np.empty(2), np.empty(2)
    here, there, moved = np.empty((2, k)), np.empty(k), np.empty((2, k))
    for b in range(2):
        cost[b] = 0.0 if allowed[b, 0] else np.inf
        for a in range(k):
            here[b, a] = positions[b, 0, a]
        for r in range(2):
            trail[0, b, r] = positions[b, 0, columns[r]]
    for i in range(1, n):
        for b in range(2):
            reached[b] = np.inf
            for d in range(2):
                if not allowed[b, i] or cost[d] == np.inf:
                    continue
                for a in range(k):
                    there[a] = positions[b, i, a]
                for r in range(2):
                    angle, before = there[columns[r]], here[d, columns[r]]
                    least = np.ceil((low[r] - slack - angle) / turn)
                    most = np.floor((high[r] + slack - angle) / turn)
                    if least <= most:
                        there[columns[r]] = angle + turn * min(
                            max(np.rint((before - angle) / turn), least), most
                        )
                total = cost[d]
                for a in range(k):
                    step = there[a] - here[d, a]
                    total += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
                if total < reached[b]:
                    reached[b], came[i, b] = total, d
                    for a in range(k):
                        moved[b, a] = there[a]
                    for r in range(2):
                        trail[i, b, r] = there[columns[r]]
        for b in range(2):
            cost[b] = reached[b]
            for a in range(k):
                here[b, a] = moved[b, a]
    rotary = np.empty((n, 2))
    branch = 0 if cost[0] <= cost[1] else 1
    for i in range(n - 1, -1, -1):
        rotary[i, 0], rotary[i, 1] = trail[i, branch, 0], trail[i, branch, 1]
        branch = int(came[i, branch])
    return rotary
