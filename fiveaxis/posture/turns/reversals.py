"""Reversals: paths that pass the end of an axis range only to come back need no rewinds if held at the end.

A few degrees past the end save far less than two rewinds cost, but the optimiser of the unwrapped path
doesn't see rewinds.
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
from fiveaxis.posture.turns.turn_changes import keep_lean
from fiveaxis.toolpath import TiltBounds

# Most pairs that are left out one at a time.
MOST_ALONE = 20


def paths_without_reversals(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, tilt: TiltBounds | None = None
) -> Iterator[Array]:
    """Yield paths without some of the pairs of rewinds that undo each other.

    Between the rewinds of a pair the axis stays at the end of its range, and the other angle changes where a
    bound on the lean requires it.

    Parameters
    ----------
    problem : on the endless machine; paths that break its bounds are left out
    machine : with its limits
    rotary : (n, 2), rad, chain order, unwrapped
    found : the path with its rewinds
    tilt : bounds on the lean of the path's locations

    Returns
    -------
    (n, 2), rad, unwrapped: first the path without all pairs that can be left out at once, then without one
    pair each, the shortest first
    """
    alone, together, taken = [], rotary.copy(), set[float]()
    for one, two in sorted(_pairs(found), key=lambda pair: (pair[1].row - pair[0].row, pair[0].row)):
        rows, held = _hold(machine, rotary, found, (one, two), tilt)
        path = rotary.copy()
        path[rows] = held
        first, last = max(0, rows[0] - 1), min(len(rotary) - 1, rows[-1] + 1)
        if problem.between(first, last).violation(path[first : last + 1]) > ALLOWED:
            continue
        alone.append((rows, held))
        if taken.isdisjoint((one.row, two.row)):
            taken |= {one.row, two.row}
            together[rows] = held
    if len(alone) > 1:
        yield together
    for rows, held in alone[:MOST_ALONE]:
        path = rotary.copy()
        path[rows] = held
        yield path


def _hold(
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
    rows = np.arange(int(np.ceil(one.row)), int(np.floor(two.row)) + 1)
    # The turn of the axis before the rewind.
    before = int(np.searchsorted(found.row, one.row))
    shift = found.rotary[before, which] - np.interp(one.row, np.arange(len(rotary)), rotary[:, which])
    held = rotary[rows].copy()
    held[:, which] = np.clip(held[:, which], limits.low - shift, limits.high - shift)
    if tilt is not None:
        bounds = tilt.at(rows)
        # Admitted postures stay as they are.
        moved = ~bounds.admits(tool_axes(machine, held))
        held[moved] = keep_lean(machine, held[moved], 1 - which, bounds.at(np.flatnonzero(moved)))
    return rows, held


def _pairs(found: Rewound) -> Iterator[tuple[Rewind, Rewind]]:
    """Yield pairs of consecutive rewinds of one axis that undo each other."""
    for axis in sorted({r.axis for r in found.rewinds}):
        for one, two in pairwise(r for r in found.rewinds if r.axis == axis):
            if one.turns == -two.turns:
                yield one, two
