"""Feed moves of a program that don't cut: where it takes the tool back to turn a rotary axis anew."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.toolpath import MoveKind, Toolpath

# mm: a tool that goes back this far along its axis is clear of what it cuts.
LEAST_RETREAT = 1.0
# mm and rad: rounded words put the tool back at its place within this.
SAME_PLACE, SAME_ANGLE = 0.01, 1e-4
# Rows of a rewind at most.
MOST_ROWS = 5000


def find_rewinds(path: Toolpath, machine: Machine, positions: Array) -> BoolArray:
    """Find feed moves that cut nothing, because they take the tool away and back to where it was.

    The tool goes back along its axis, rotary axes turn, and it returns along its axis to the same place and
    direction. A program that is read doesn't say that these aren't cuts.

    Parameters
    ----------
    path : of the tip, which knows the tool axis everywhere
    machine : whose axes they are
    positions : (n, k), mm and rad

    Returns
    -------
    (n,), rows that belong to a rewind
    """
    tip, axis = path.tips(path.axis), path.axis
    steps = np.diff(tip, axis=0, prepend=tip[:1])
    along = np.sum(steps * axis, axis=1)
    turns = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))[:, machine.rotary_columns]
    turned = turns.max(axis=1, initial=0.0) > SAME_ANGLE
    plain = ~turned & (np.linalg.norm(steps - along[:, None] * axis, axis=1) <= SAME_PLACE)
    cuts = path.kind == MoveKind.CUT
    found = np.zeros(len(tip), dtype=bool)
    for row in np.flatnonzero(plain & cuts & (along >= LEAST_RETREAT)).tolist():
        later = slice(row + 1, row + MOST_ROWS)
        back = (
            (plain & (along <= -LEAST_RETREAT))[later]
            & (np.linalg.norm(tip[later] - tip[row - 1], axis=1) <= SAME_PLACE)
            & (np.linalg.norm(axis[later] - axis[row - 1], axis=1) <= SAME_ANGLE)
        )
        if not back.any():
            continue
        end = row + 1 + int(np.argmax(back))
        if turned[row + 1 : end].any() and cuts[row : end + 1].all():
            found[row : end + 1] = True
    return found
