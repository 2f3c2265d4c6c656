"""The straight ways that a program adds: to a first cut, and out of the last one."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import linear_positions, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.timing import STANDSTILL
from fiveaxis.toolpath import MoveKind

# mm: the way along the tool axis on which a first cut is approached, and a last one left, at its own feed.
APPROACH = 5.0
# mm: a leg of Z begins, or ends, so far above the workpiece where Z has no limit.
ABOVE = 100.0
# Rows of a motion: where the way in ends, and where the way out begins.
FIRST, LAST = 0, -1


def clear_way(
    motion: Motion,
    machine: Machine,
    direction: Array | None = None,
    length: float = APPROACH,
    *,
    row: int = FIRST,
) -> Array:
    """Find the way, (k,) mm, from the first or last location off the part, inside the axis limits.

    Zero where the path doesn't begin, or end, with a cut. The linear axes are linear in the tip while the
    rotary axes stand, so the limits cut the way at a fraction of it.

    Parameters
    ----------
    direction : (3,), unit vector, workpiece frame, in place of the tool axis
    length : mm
    row : `FIRST` or `LAST`
    """
    place = motion.positions[row : row + 1 or None]
    if motion.kind[row] != MoveKind.CUT:
        return np.zeros(place.shape[1])
    tip, axis = tool_poses(machine, place)
    along = axis if direction is None else direction
    way = (linear_positions(machine, tip + length * along, place[:, machine.rotary_columns]) - place)[0]
    room = np.where(way > 0.0, machine.high - place[0], place[0] - machine.low)
    moving = np.abs(way) > STANDSTILL
    fraction = float(np.min(room[moving] / np.abs(way[moving]), initial=1.0))
    return max(fraction, 0.0) * np.where(moving, way, 0.0)


def lead_places(motion: Motion, machine: Machine, way: Array, *, row: int = FIRST) -> Array:
    """Give the places of an approach, (3, k): where its leg of Z begins and ends, and the location.

    The way out passes the same places in reverse.

    Parameters
    ----------
    way : (k,), mm, from the location to where the leg of Z ends
    row : `FIRST` or `LAST`
    """
    place = motion.positions[row]
    start = place + way
    return np.array([raised(start, machine), start, place])


def raised(place: Array, machine: Machine) -> Array:
    """Lift a place, (k,), along Z to the end of its travel, or by `ABOVE` where it has none."""
    if "Z" not in machine.letters:
        return place.copy()
    column, above = machine.column("Z"), place.copy()
    top = float(machine.high[column])
    above[column] = max(top, place[column]) if np.isfinite(top) else place[column] + ABOVE
    return above
