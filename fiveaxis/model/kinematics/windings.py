"""Turns and limits: which of the angles that differ by whole turns are within an axis's limits."""

from __future__ import annotations

import itertools
import math

import numpy as np

from fiveaxis.base import Array, BoolArray
from fiveaxis.model.kinematics.inverse import axis_positions
from fiveaxis.model.machine.axes import Limits
from fiveaxis.model.machine.model import Machine

TURN = 2.0 * np.pi
# mm, rad: an axis value this far past a limit counts as on it, from rounding of the inverse.
ON_LIMIT = 1e-9
# Recommended limits are rounded outwards to this many decimals.
DECIMALS = 1


def reachable_positions(machine: Machine, tip: Array, axis: Array) -> Array:
    """Solve all axes for given tool tips and tool axes, inside the limits, on every turn there.

    Parameters
    ----------
    tip, axis : (n, 3) mm and unit vectors, workpiece frame

    Returns
    -------
    (m, n, k), mm and rad; an unlimited axis is in (−π, π]. NaN rows where there are fewer than m. Ordered by
    branch, then by increasing turn. `DegenerateChain` as `axis_positions`.
    """
    columns, repeated = machine.rotary_columns, []
    branches = axis_positions(machine, tip, axis)
    choices = [_turns(branches[..., c], machine.axes[c].limits) for c in columns]
    for b, branch in enumerate(branches):
        for angles in itertools.product(*(choice[:, b] for choice in choices)):
            repeated.append(branch.copy())
            # By shape, as without rotary axes there is nothing to stack.
            repeated[-1][:, columns] = np.reshape(angles, (len(columns), len(branch))).T
    found = np.stack(repeated)
    found[~within_limits(machine, found)] = np.nan
    return found[np.isfinite(found).all(axis=-1).any(axis=-1)]


def _turns(angle: Array, limits: Limits) -> Array:
    """Return an angle on every turn inside the limits, (turns, ...); one turn where an end is open."""
    if limits.unlimited:
        return angle[None]
    if np.isfinite(limits.low):
        first = angle + TURN * np.ceil((limits.low - ON_LIMIT - angle) / TURN)
    else:
        first = angle + TURN * np.floor((limits.high + ON_LIMIT - angle) / TURN)
    whole = limits.span / TURN
    count = int(whole) + 1 if np.isfinite(whole) else 1
    return np.stack([first + TURN * turn for turn in range(count)])


def within_limits(machine: Machine, positions: Array) -> BoolArray:
    """Check which axis values, (..., k), lie within all limits; NaN doesn't."""
    return np.all(machine.limit_excess(positions) <= ON_LIMIT, axis=-1)


def into_limits(machine: Machine, rotary: Array) -> Array:
    """Shift angles, (..., r) rad in chain order, by whole turns into their limits where possible."""
    columns = machine.rotary_columns
    low, high = machine.low[columns] - ON_LIMIT, machine.high[columns] + ON_LIMIT
    floor = np.where(np.isfinite(low), low, -np.pi)
    shifted = rotary + TURN * np.ceil((floor - rotary) / TURN)
    outside = (rotary < low) | (rotary > high)
    return np.where(outside & (shifted <= high), shifted, rotary)


def nearest_turn(angle: Array, previous: Array, low: Array, high: Array) -> Array:
    """Shift an angle by whole turns to the one nearest the previous angle within the limits."""
    least = np.ceil((low - ON_LIMIT - angle) / TURN)
    most = np.floor((high + ON_LIMIT - angle) / TURN)
    turns = np.clip(np.round((previous - angle) / TURN), least, most)
    return np.where(least > most, angle, angle + TURN * turns)


def one_turn_from(limits: Limits) -> float:
    """Return the lower end, rad, of the limits, or of the whole turn nearest 0 if they contain one."""
    return limits.low if limits.span < TURN else float(np.clip(-np.pi, limits.low, limits.high - TURN))


def fit_turns(angles: Array, low: float, high: float) -> Array | None:
    """Shift an unwrapped angle, (n,) rad, into its limits by the fewest whole turns; None if none fit."""
    least = np.ceil((low - ON_LIMIT - angles.min()) / TURN)
    most = np.floor((high + ON_LIMIT - angles.max()) / TURN)
    return None if least > most else angles + TURN * np.clip(0.0, least, most)


def outwards(value: float, side: float) -> str:
    """Write a limit, mm or deg, rounded up or, with −1, down."""
    scale = 10.0**DECIMALS
    # Adding 0 makes −0 a 0.
    return f"{side * math.ceil(side * value * scale - ON_LIMIT) / scale + 0.0:g}"
