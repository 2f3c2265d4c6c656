"""Paths that pass the end of an axis's range only to come back: held at the end, they need no rewinds there.

What a path saves by going a few degrees past the seam is nothing against two rewinds, which the optimiser of
the endless path doesn't know.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.turns.rewinding import Rewind, Rewound
from fiveaxis.posture.turns.turn_changes import give_way
from fiveaxis.toolpath import TiltBounds

# No more pairs than this are offered one by one.
MOST_ALONE = 20


def unreversed(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, tilt: TiltBounds | None = None
) -> Iterator[Array]:
    """Give paths without some of the pairs of rewinds that undo each other.

    From the first rewind of a pair to the second the axis stays at the end of its range; the other angle
    gives way where a bound on the lean asks for it.

    Parameters
    ----------
    problem : on the endless machine; what breaks its bounds isn't given
    machine : with its limits
    rotary : (n, 2), rad, chain order, unwrapped
    found : the path with its rewinds
    tilt : bounds on the lean of the path's locations

    Returns
    -------
    (n, 2), rad, unwrapped: the path without all pairs that can be left out at once, then without one of
    those, the shortest first
    """
    alone, together, taken = [], rotary.copy(), set[float]()
    for one, two in sorted(_pairs(found), key=lambda pair: (pair[1].place - pair[0].place, pair[0].place)):
        rows, held = _held(machine, rotary, found, (one, two), tilt)
        path = rotary.copy()
        path[rows] = held
        first, last = max(0, rows[0] - 1), min(len(rotary) - 1, rows[-1] + 1)
        if problem.between(first, last).violation(path[first : last + 1]) > ALLOWED:
            continue
        alone.append((rows, held))
        if taken.isdisjoint((one.place, two.place)):
            taken |= {one.place, two.place}
            together[rows] = held
    if len(alone) > 1:
        yield together
    for rows, held in alone[:MOST_ALONE]:
        path = rotary.copy()
        path[rows] = held
        yield path


def _held(
    machine: Machine,
    rotary: Array,
    found: Rewound,
    pair: tuple[Rewind, Rewind],
    tilt: TiltBounds | None,
) -> tuple[IntArray, Array]:
    """Hold an axis at the end of its range between two rewinds: rows, (m,), and their angles, (m, 2) rad."""
    one, two = pair
    column = machine.column(one.axis)
    which, limits = machine.rotary_columns.index(column), machine.axes[column].limits
    rows = np.arange(int(np.ceil(one.place)), int(np.floor(two.place)) + 1)
    # The turn that the axis was on before it was turned back.
    before = int(np.searchsorted(found.place, one.place))
    shift = found.rotary[before, which] - np.interp(one.place, np.arange(len(rotary)), rotary[:, which])
    held = rotary[rows].copy()
    held[:, which] = np.clip(held[:, which], limits.low - shift, limits.high - shift)
    if tilt is not None:
        bounds = tilt.at(rows)
        # A posture that is admitted stays as it is.
        moved = ~bounds.admits(tool_axes(machine, held))
        held[moved] = give_way(machine, held[moved], 1 - which, bounds.at(np.flatnonzero(moved)))
    return rows, held


def _pairs(found: Rewound) -> Iterator[tuple[Rewind, Rewind]]:
    """Give the rewinds that the next one of the same axis undoes."""
    for axis in sorted({r.axis for r in found.rewinds}):
        for one, two in pairwise(r for r in found.rewinds if r.axis == axis):
            if one.turns == -two.turns:
                yield one, two
