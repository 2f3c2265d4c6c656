"""Paths that pass the end of an axis's range only to come back: held at the end, they need no rewinds there.

What a path saves by going a few degrees past the seam is nothing against two rewinds, which the optimiser of
the endless path doesn't know.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine
from fiveaxis.posture.rewinding import Rewind, Rewound
from fiveaxis.posture.seams import give_way
from fiveaxis.toolpath import TiltBounds


def unreversed(
    machine: Machine, rotary: Array, found: Rewound, tilt: TiltBounds | None = None
) -> Iterator[Array]:
    """Give paths without one of the pairs of rewinds that undo each other, the shortest stretch first.

    From the first rewind of the pair to the second the axis stays at the end of its range; the other angle
    gives way where a bound on the lean asks for it. Other bounds may break: ask for them.

    Parameters
    ----------
    machine : with its limits
    rotary : (n, 2), rad, chain order, wound
    found : the path with its rewinds
    tilt : bounds on the lean of the path's locations

    Returns
    -------
    (n, 2), rad, wound
    """
    for one, two in sorted(_pairs(found), key=lambda pair: pair[1].place - pair[0].place):
        column = machine.column(one.axis)
        which, limits = machine.rotary_columns.index(column), machine.axes[column].limits
        rows = np.arange(int(np.ceil(one.place)), int(np.floor(two.place)) + 1)
        # The turn that the axis was on before it was turned back.
        before = int(np.flatnonzero(found.place >= one.place)[0])
        shift = found.rotary[before, which] - np.interp(one.place, np.arange(len(rotary)), rotary[:, which])
        held = rotary[rows].copy()
        held[:, which] = np.clip(held[:, which], limits.low - shift, limits.high - shift)
        if tilt is not None:
            bounds = tilt.at(rows)
            # A posture that is admitted stays as it is.
            moved = ~bounds.admits(tool_axes(machine, held))
            held[moved] = give_way(machine, held[moved], 1 - which, bounds.at(np.flatnonzero(moved)))
        path = rotary.copy()
        path[rows] = held
        yield path


def _pairs(found: Rewound) -> Iterator[tuple[Rewind, Rewind]]:
    """Give the rewinds that the next one of the same axis undoes."""
    for axis in sorted({r.axis for r in found.rewinds}):
        for one, two in pairwise(r for r in found.rewinds if r.axis == axis):
            if one.turns == -two.turns:
                yield one, two
