"""Turns and limits: which of the angles that differ by whole turns an axis may take."""

from __future__ import annotations

import itertools

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics.inverse import axis_positions
from fiveaxis.kinematics.orientation import Held
from fiveaxis.machine import Limits, Machine

TURN = 2.0 * np.pi
# How far past a limit an axis value may lie and still count as on it (mm, rad): rounding of the inverse.
ON_LIMIT = 1e-9


def reachable_positions(
    machine: Machine, tip: Array, axis: Array, *, near: Array | None = None, held: Held | None = None
) -> Array:
    """Solve all axes for wanted tool tips and tool axes, inside the limits.

    Parameters
    ----------
    tip : (n, 3), mm, workpiece frame
    axis : (n, 3), unit vectors, workpiece frame
    near : (k,) or (n, k), mm and rad: each branch takes, of the turns inside the limits, the one next to
        these axis values. Without it every turn inside the limits is given, and for an axis that turns
        without end the one in (−π, π]
    held : as for `axis_positions`

    Returns
    -------
    (m, n, k), mm and rad; NaN rows where there are fewer than m. Branch by branch, turns growing.

    Raises
    ------
    DegenerateChain
        As `axis_positions`.
    """
    branches = axis_positions(machine, tip, axis, held=held)
    if near is None:
        found = _every_turn(machine, branches)
    else:
        found = branches.copy()
        columns = machine.rotary_columns
        low, high = machine.low[columns], machine.high[columns]
        target = np.asarray(near, dtype=float)[..., columns]
        found[..., columns] = nearest_turn(branches[..., columns], target, low, high)
    found[~within_limits(machine, found)] = np.nan
    return found[np.isfinite(found).all(axis=-1).any(axis=-1)]


def _every_turn(machine: Machine, branches: Array) -> Array:
    """Repeat branches, (b, n, k), for every turn that may lie inside the limits, (m, n, k)."""
    choices = [_turns(branches[..., c], machine.axes[c].limits) for c in machine.rotary_columns]
    repeated = []
    for b, branch in enumerate(branches):
        for angles in itertools.product(*(choice[:, b] for choice in choices)):
            repeated.append(branch.copy())
            for column, angle in zip(machine.rotary_columns, angles, strict=True):
                repeated[-1][:, column] = angle
    return np.stack(repeated)


def _turns(angle: Array, limits: Limits) -> Array:
    """Give an angle on every turn inside the limits, (turns, ...); one turn where an end is open."""
    if limits.unlimited:
        return angle[None]
    if np.isfinite(limits.low):
        first = angle + TURN * np.ceil((limits.low - ON_LIMIT - angle) / TURN)
    else:
        first = angle + TURN * np.floor((limits.high + ON_LIMIT - angle) / TURN)
    whole = (limits.high - limits.low) / TURN
    count = int(whole) + 1 if np.isfinite(whole) else 1
    return np.stack([first + TURN * turn for turn in range(count)])


def within_limits(machine: Machine, positions: Array) -> BoolArray:
    """Tell which axis values, (..., k), lie within all limits; NaN doesn't."""
    inside = (positions >= machine.low - ON_LIMIT) & (positions <= machine.high + ON_LIMIT)
    return np.all(inside, axis=-1)


def into_limits(machine: Machine, rotary: Array) -> Array:
    """Shift angles, (..., r) rad in chain order, by whole turns into their limits where that is possible."""
    columns = machine.rotary_columns
    low, high = machine.low[columns] - ON_LIMIT, machine.high[columns] + ON_LIMIT
    floor = np.where(np.isfinite(low), low, -np.pi)
    shifted = rotary + TURN * np.ceil((floor - rotary) / TURN)
    outside = (rotary < low) | (rotary > high)
    return np.where(outside & (shifted <= high), shifted, rotary)


def nearest_turn(angle: Array, previous: Array, low: Array, high: Array) -> Array:
    """Shift an angle by whole turns next to the previous one, as far as the limits let it."""
    least = np.ceil((low - ON_LIMIT - angle) / TURN)
    most = np.floor((high + ON_LIMIT - angle) / TURN)
    turns = np.clip(np.round((previous - angle) / TURN), least, most)
    return np.where(least > most, angle, angle + TURN * turns)


def one_turn_from(limits: Limits) -> float:
    """Give the lower end, rad, of the whole turn next to 0 within the limits of an axis that has one."""
    return float(np.clip(-np.pi, limits.low, limits.high - TURN))


def fit_turns(angles: Array, low: float, high: float) -> Array | None:
    """Shift an unwrapped angle, (n,) rad, by as few whole turns as possible into its limits.

    Returns
    -------
    (n,), rad; None where it winds further than the limits are apart
    """
    least = np.ceil((low - ON_LIMIT - angles.min()) / TURN)
    most = np.floor((high + ON_LIMIT - angles.max()) / TURN)
    return None if least > most else angles + TURN * np.clip(0.0, least, most)
