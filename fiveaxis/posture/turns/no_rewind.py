"""Why an axis can't be rewound along a path, and what limits would do."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.turns.retreat import way_ends, ways_clear
from fiveaxis.posture.turns.turn_changes import Course
from fiveaxis.posture.turns.winding import plan_turns

# Limits that would do are said to this many decimals, rounded outwards.
DECIMALS = 1


def why_no_rewind(
    course: Course, machine: Machine, column: int, clearance: float
) -> tuple[str, tuple[Finding, ...]]:
    """Say that an axis winds too far, and which limits would let it be rewound or make that needless.

    Each remedy is verified: the linear limits on a plan of the turns with its ways off the part, the axis's
    own on the path's angles.

    Parameters
    ----------
    course : the path, unwrapped
    column : the axis, in the order of the machine's axes
    clearance : mm, between tool and part while it rewinds

    Returns
    -------
    A message, and a finding of the code ``no-rewind``
    """
    axis = machine.axes[column]
    angles = course.rotary[:, machine.rotary_columns.index(column)]
    span, has = np.degrees(np.ptp(angles)), np.degrees(axis.limits.high - axis.limits.low)
    remedies = [*_roomier(course, machine, column, clearance), _wider(angles, machine, column)]
    message = (
        f"{axis.letter} winds through {span:.0f} deg and has {has:.0f} deg, and there is no place to turn it "
        "back: nowhere can the tool back off from the part, within its bounds and the limits of the linear "
        f"axes, while two turns are open to it; {' or '.join(remedies)} would do; or set the part up lower"
    )
    furthest = int(np.ceil(course.place[int(np.argmax(np.abs(angles - angles[0])))]))
    place = course.toolpath.place(furthest)
    return message, (Finding(Severity.ERROR, "no-rewind", message, place, float(span)),)


def _wider(angles: Array, machine: Machine, column: int) -> str:
    """Say to where the axis would have to turn so that the whole path fits without a rewind."""
    axis = machine.axes[column]
    low, high = (axis.limits.low, axis.limits.high)
    # Of the turns on which the path could begin the one that widens the limits least.
    turns = np.arange(math.floor((low - angles.max()) / TURN), math.ceil((high - angles.min()) / TURN) + 1)
    ends = np.minimum(low, angles.min() + TURN * turns), np.maximum(high, angles.max() + TURN * turns)
    best = int(np.argmin(ends[1] - ends[0]))
    least, most = (_outwards(axis.shown(float(e[best])), s) for e, s in zip(ends, (-1.0, 1.0), strict=True))
    return f"{axis.letter} from {least} to {most} deg"


def _roomier(course: Course, machine: Machine, column: int, clearance: float) -> Iterator[str]:
    """Say how far the linear axes would have to go for the rewinds that take the least more."""
    inner = 1 + np.flatnonzero(course.admitted[1:-1])
    if not len(inner):
        return
    path, rotary = course.toolpath, course.rotary
    way = ways_clear(path, machine, rotary, column, inner, clearance)
    known = np.isfinite(way)
    ends = way_ends(path, machine, rotary, inner, np.where(known, way, 0.0))
    low, high = machine.low[machine.linear_columns], machine.high[machine.linear_columns]
    past = np.maximum(np.maximum(low - ends, ends - high), 0.0).max(axis=(0, 2))
    stop = np.full(len(course.place), np.inf)
    stop[inner] = np.where(known & np.isfinite(past), past, np.inf)
    limits, nothing = machine.axes[column].limits, np.zeros(len(stop))
    angles = rotary[:, machine.rotary_columns.index(column)]
    turns = plan_turns(angles, (limits.low, limits.high), stop, nothing, nothing)
    if turns is None:
        return
    chosen = np.searchsorted(inner, np.flatnonzero(turns[1] - turns[0]))
    yield " and ".join(_limits_for(machine, ends[:, chosen]))


def _limits_for(machine: Machine, ends: Array) -> Iterator[str]:
    """Name the linear limits that positions, (2, m, linear axes) mm, lie past."""
    for number, column in enumerate(machine.linear_columns):
        axis, values = machine.axes[column], ends[..., number]
        if values.max() > axis.limits.high + ON_LIMIT:
            yield f"{axis.letter} to {_outwards(float(values.max()), 1.0)} mm"
        if values.min() < axis.limits.low - ON_LIMIT:
            yield f"{axis.letter} to {_outwards(float(values.min()), -1.0)} mm"


def _outwards(value: float, side: float) -> str:
    """Write a bound that would do, rounded up or, with −1, down."""
    scale = 10.0**DECIMALS
    # Adding 0 makes −0 a 0.
    return f"{side * math.ceil(side * value * scale - ON_LIMIT) / scale + 0.0:g}"
