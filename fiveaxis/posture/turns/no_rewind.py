"""Why an axis can't be rewound along a path, and which limits would be enough."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.turns.stops import clear_retracts, retract_ends
from fiveaxis.posture.turns.turn_changes import UnwrappedPath
from fiveaxis.posture.turns.winding import plan_turns

# Suggested limits are rounded outwards to this many decimals.
DECIMALS = 1


def why_no_rewind(
    course: UnwrappedPath, machine: Machine, column: int, clearance: float
) -> tuple[str, tuple[Finding, ...]]:
    """Explain that an axis winds too far, and which limits would allow rewinds or make them needless.

    Each remedy is checked: linear limits by a plan of turns with its retracts, the axis's own limits by the
    path's angles.

    Parameters
    ----------
    column : of the axis among the machine's axes
    clearance : mm, between tool and part during a rewind

    Returns
    -------
    A message, and a finding with the code ``no-rewind``
    """
    axis = machine.axes[column]
    angles = course.rotary[:, machine.rotary_columns.index(column)]
    span, has = np.degrees(np.ptp(angles)), np.degrees(axis.limits.span)
    remedies = [*_linear_remedy(course, machine, column, clearance), _own_remedy(angles, machine, column)]
    message = (
        f"{axis.letter} winds through {span:.0f} deg and has {has:.0f} deg, and it can't be rewound on this "
        f"path: where {axis.letter} could be on two turns, the tool can't back off from the part within its "
        f"bounds and the limits of the linear axes; {' or '.join(remedies)} would be enough; or set the part "
        "up lower"
    )
    furthest = int(np.ceil(course.row[int(np.argmax(np.abs(angles - angles[0])))]))
    place = course.toolpath.place(furthest)
    return message, (Finding(Severity.ERROR, "no-rewind", message, place, float(span)),)


def _own_remedy(angles: Array, machine: Machine, column: int) -> str:
    """Name the limits of the axis within which the whole path would fit without a rewind."""
    axis = machine.axes[column]
    low, high = axis.limits.low, axis.limits.high
    # The path begins on the turn that widens the limits least.
    turns = np.arange(math.floor((low - angles.max()) / TURN), math.ceil((high - angles.min()) / TURN) + 1)
    ends = np.minimum(low, angles.min() + TURN * turns), np.maximum(high, angles.max() + TURN * turns)
    best = int(np.argmin(ends[1] - ends[0]))
    least, most = (_outwards(axis.shown(float(e[best])), s) for e, s in zip(ends, (-1.0, 1.0), strict=True))
    return f"{axis.letter} from {least} to {most} deg"


def _linear_remedy(course: UnwrappedPath, machine: Machine, column: int, clearance: float) -> Iterator[str]:
    """Name the linear limits for the rewinds that need the least additional travel."""
    inner = 1 + np.flatnonzero(course.admitted[1:-1])
    if not len(inner):
        return
    distance = clear_retracts(course, machine, column, inner, clearance)
    known = np.isfinite(distance)
    ends = retract_ends(course, machine, inner, np.where(known, distance, 0.0))
    low, high = machine.low[machine.linear_columns], machine.high[machine.linear_columns]
    past = np.maximum(np.maximum(low - ends, ends - high), 0.0).max(axis=(0, 2))
    stop = np.full(len(course.row), np.inf)
    stop[inner] = np.where(known & np.isfinite(past), past, np.inf)
    angles = course.rotary[:, machine.rotary_columns.index(column)]
    turns = plan_turns(angles, machine.axes[column].limits, stop)
    if turns is None:
        return
    chosen = np.searchsorted(inner, np.flatnonzero(turns[1] - turns[0]))
    yield " and ".join(_limits_for(machine, ends[:, chosen]))


def _limits_for(machine: Machine, ends: Array) -> Iterator[str]:
    """Name the linear limits that positions, (2, m, linear axes) mm, would need."""
    for number, column in enumerate(machine.linear_columns):
        axis, values = machine.axes[column], ends[..., number]
        if values.max() > axis.limits.high + ON_LIMIT:
            yield f"{axis.letter} to {_outwards(float(values.max()), 1.0)} mm"
        if values.min() < axis.limits.low - ON_LIMIT:
            yield f"{axis.letter} to {_outwards(float(values.min()), -1.0)} mm"


def _outwards(value: float, side: float) -> str:
    """Write a limit rounded up or, with −1, down."""
    scale = 10.0**DECIMALS
    # Adding 0 makes −0 a 0.
    return f"{side * math.ceil(side * value * scale - ON_LIMIT) / scale + 0.0:g}"
