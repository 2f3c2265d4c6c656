"""Where a part is set up on a table that turns decides where the axis is at the end of its range."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.posture.turns.rewinding import Rewound
from fiveaxis.posture.turns.turn_changes import passed_seams
from fiveaxis.posture.turns.winding import plan_turns, winding_columns
from fiveaxis.toolpath import Toolpath

# Angles, in turns, by which the part is turned in thought; on longer paths it isn't looked at.
PHASES = np.arange(1, 24) / 24.0
MOST_LOCATIONS = 20_000
# A rewind between cuts is dear as well, next to one within a cut.
BETWEEN = 1e-3


def better_phases(toolpath: Toolpath, machine: Machine, rotary: Array, found: Rewound) -> list[Finding]:
    """Say by how much the part would have to be turned on the table for fewer rewinds within cuts.

    The axis that carries the part then stands that much further at every location, and all else stays where
    it is: the room to back off, too.

    Parameters
    ----------
    toolpath : without rewinds
    machine : with its limits
    rotary : (n, 2), rad, chain order, unwrapped
    found : the path with its rewinds

    Returns
    -------
    One finding at most, code ``rewind-phase``; its value the angle in degrees
    """
    letter = machine.chain.joints[0].letter
    marks = sum(r.in_cut for r in found.rewinds if r.axis == letter)
    column = machine.column(letter)
    if not marks or column not in winding_columns(machine) or len(toolpath) > MOST_LOCATIONS:
        return []
    angles, limits = rotary[:, machine.rotary_columns.index(column)], machine.axes[column].limits
    counted = [count_rewinds(toolpath, angles + TURN * phase, limits) for phase in PHASES]
    best = min(range(len(PHASES)), key=lambda i: counted[i])
    fewer, others = counted[best]
    if fewer >= marks:
        return []
    angle = 360.0 * PHASES[best] - (360.0 if PHASES[best] > 0.5 else 0.0)
    message = (
        f"{letter} is turned back within a cut {_times(marks)}; with the part set up on the table so that "
        f"{letter} is {angle:+g} deg more everywhere it would be {_times(fewer)}, and {_times(others)} "
        "between cuts"
    )
    return [Finding(Severity.NOTE, "rewind-phase", message, toolpath.place(0), float(angle))]


def count_rewinds(toolpath: Toolpath, angles: Array, limits: Limits) -> tuple[float, float]:
    """Count the rewinds that an axis needs within cuts and between them; infinite where there is no way.

    Parameters
    ----------
    angles : (n,), rad, unwrapped
    """
    cutting = toolpath.cutting
    in_cut = np.append(cutting[1:] & cutting[:-1], False)
    stop = np.where(in_cut, 1.0, BETWEEN)
    stop[[0, -1]] = np.inf
    rows, seam = passed_seams(angles, limits)
    order = np.argsort(np.concatenate([np.arange(len(angles)), rows]), kind="stable")
    passing = np.where(cutting[np.ceil(rows).astype(np.int64)], 1.0, BETWEEN)
    price = np.concatenate([stop, passing])[order]
    nothing = np.zeros(len(price))
    turns = plan_turns(
        np.concatenate([angles, seam])[order], (limits.low, limits.high), price, nothing, nothing
    )
    if turns is None:
        return np.inf, np.inf
    taken = price[turns[1] != turns[0]]
    return float((taken == 1.0).sum()), float((taken < 1.0).sum())


def _times(count: float) -> str:
    return "once" if count == 1 else f"{count:.0f} times"
