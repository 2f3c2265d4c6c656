"""Phase of the set-up: turning the part on a rotary table shifts the ends of the axis range on the path."""

from __future__ import annotations

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.posture.turns.rewinding import Rewound
from fiveaxis.posture.turns.turn_changes import find_turn_changes
from fiveaxis.posture.turns.winding import plan_turns, winding_columns
from fiveaxis.toolpath import Toolpath

# Angles to try, in turns; longer paths aren't examined.
PHASES = np.arange(1, 24) / 24.0
MOST_LOCATIONS = 20_000
# Price of a rewind between cuts, of one within a cut.
BETWEEN = 1e-3


def better_phases(toolpath: Toolpath, machine: Machine, rotary: Array, found: Rewound) -> list[Finding]:
    """Find by how much to turn the part on the table for fewer rewinds within cuts.

    The axis that carries the part is then further by that angle at every location; everything else stays as
    it is, including the room to back off.

    Parameters
    ----------
    toolpath : without rewinds
    machine : with its limits
    rotary : (n, 2), rad, chain order, unwrapped
    found : the path with its rewinds

    Returns
    -------
    At most one finding, code ``rewind-phase``; its value is the angle in degrees
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
        f"{letter} rewinds {_times(marks)} within a cut; with the part turned on the table so that {letter} "
        f"is {angle:+g} deg more everywhere, it would rewind {_times(fewer)} within a cut and "
        f"{_times(others)} between cuts"
    )
    return [Finding(Severity.NOTE, "rewind-phase", message, toolpath.place(0), float(angle))]


def count_rewinds(toolpath: Toolpath, angles: Array, limits: Limits) -> tuple[float, float]:
    """Count an unwrapped axis's rewinds within cuts and between them; infinite if it can't be rewound."""
    cutting = toolpath.cutting
    in_cut = np.append(cutting[1:] & cutting[:-1], False)
    stop = np.where(in_cut, 1.0, BETWEEN)
    stop[[0, -1]] = np.inf
    rows, changes = find_turn_changes(angles, limits)
    order = np.argsort(np.concatenate([np.arange(len(angles)), rows]), kind="stable")
    passing = np.where(cutting[np.ceil(rows).astype(np.int64)], 1.0, BETWEEN)
    price = np.concatenate([stop, passing])[order]
    turns = plan_turns(np.concatenate([angles, changes])[order], limits, price)
    if turns is None:
        return np.inf, np.inf
    taken = price[turns[1] != turns[0]]
    return float((taken == 1.0).sum()), float((taken < 1.0).sum())


def _times(count: float) -> str:
    return "once" if count == 1 else f"{count:.0f} times"
