"""From wanted tool axes to rotary angles: branch by branch, turn by turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy import travel_costs
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, rotary_angles
from fiveaxis.machine import Limits, Machine
from fiveaxis.toolpath import Toolpath

TURN = 2.0 * np.pi
# How far past a limit an axis value may lie and still count as on it (mm, rad): rounding of the inverse.
ON_LIMIT = 1e-9


@dataclass(frozen=True, eq=False)
class Postures:
    """Axis values that give wanted tool axes, branch by branch.

    Parameters
    ----------
    positions : (2, n, k), mm and rad; angles brought into the limits by whole turns where that is possible
    allowed : (2, n), whether the branch exists and lies within every limit
    """

    positions: Array
    allowed: BoolArray


def postures(machine: Machine, toolpath: Toolpath, axis: Array) -> Postures:
    """Solve both branches for wanted tool axes and check the limits.

    Parameters
    ----------
    axis : (n, 3), unit vectors, workpiece frame; NaN rows give no posture
    """
    rotary = hold_singular(rotary_angles(machine, axis), axis, machine)
    rotary = into_limits(machine, rotary)
    positions = linear_positions(machine, toolpath.tips(axis)[None], rotary)
    return Postures(positions, within_limits(machine, positions))


def within_limits(machine: Machine, positions: Array) -> BoolArray:
    """Tell which axis values, (..., k), lie within all limits; NaN doesn't."""
    inside = (positions >= machine.low - ON_LIMIT) & (positions <= machine.high + ON_LIMIT)
    return np.all(inside, axis=-1)


def into_limits(machine: Machine, rotary: Array) -> Array:
    """Shift angles, (..., 2) rad in chain order, by whole turns into their limits where that is possible."""
    columns = machine.rotary_columns
    low, high = machine.low[columns] - ON_LIMIT, machine.high[columns] + ON_LIMIT
    floor = np.where(np.isfinite(low), low, -np.pi)
    shifted = rotary + TURN * np.ceil((floor - rotary) / TURN)
    outside = (rotary < low) | (rotary > high)
    return np.where(outside & (shifted <= high), shifted, rotary)


def hold_singular(rotary: Array, axis: Array, machine: Machine) -> Array:
    """Hold the first rotary angle where the tool axis lies along that rotary axis and any angle will do."""
    direction = next(j.line.direction for j in machine.chain.joints if j.is_rotary)
    singular = np.linalg.norm(np.cross(direction, axis), axis=1) < ON_LIMIT
    if not singular.any():
        return rotary
    kept = np.where(singular, 0, np.arange(len(axis)))
    held = rotary.copy()
    held[..., 0] = rotary[:, np.maximum.accumulate(kept), 0]
    return held


def cheapest_sequence(machine: Machine, toolpath: Toolpath, found: Postures) -> Array | None:
    """Choose the branch of every location so that the travel metric is least.

    Each turn of a rotary axis goes the short way, unless its limits forbid that; turns accumulate.

    Returns
    -------
    (n, 2), rad, chain order; None where some location has no allowed branch
    """
    if not found.allowed.any(axis=0).all():
        return None
    columns = machine.rotary_columns
    low, high = machine.low[columns], machine.high[columns]
    # Which turn an axis with several of them starts on is free: it is wound first and shifted as a whole.
    winding = high - low >= TURN
    wound = _cheapest(
        machine, toolpath, found, np.where(winding, -np.inf, low), np.where(winding, np.inf, high)
    )
    fitted = [fit_turns(angles, *limits) for angles, *limits in zip(wound.T, low, high, strict=True)]
    if all(angles is not None for angles in fitted):
        return np.stack([angles for angles in fitted if angles is not None], axis=1)
    return _cheapest(machine, toolpath, found, low, high)


def _cheapest(machine: Machine, toolpath: Toolpath, found: Postures, low: Array, high: Array) -> Array:
    """Choose branches and turns location by location, remembering the cheapest way to each."""
    plus, minus = travel_costs(machine, toolpath.feed)
    columns = machine.rotary_columns
    n = found.positions.shape[1]
    cost = np.where(found.allowed[:, 0], 0.0, np.inf)
    here = found.positions[:, 0]
    came, trail = np.zeros((n, 2), dtype=np.int64), np.empty((n, 2, 2, 2))
    for i in range(1, n):
        # [from, to, axis]: the same target angle has another turn for each predecessor.
        there = np.repeat(found.positions[None, :, i], 2, axis=0)
        there[..., columns] = nearest_turn(there[..., columns], here[:, None, columns], low, high)
        move = there - here[:, None]
        step = (plus[i] * np.maximum(move, 0.0) - minus[i] * np.minimum(move, 0.0)).sum(axis=-1)
        total = np.where(found.allowed[None, :, i], cost[:, None] + step, np.inf)
        came[i] = np.argmin(total, axis=0)
        cost = total[came[i], [0, 1]]
        trail[i] = there[..., columns]
        here = there[came[i], [0, 1]]
    return _trace(found.positions[:, 0][:, columns], came, trail, int(np.argmin(cost)))


def nearest_turn(angle: Array, previous: Array, low: Array, high: Array) -> Array:
    """Shift an angle by whole turns next to the previous one, as far as the limits let it."""
    turned = angle + TURN * np.round((previous - angle) / TURN)
    turned = np.where(turned > high + ON_LIMIT, turned - TURN, turned)
    turned = np.where(turned < low - ON_LIMIT, turned + TURN, turned)
    return np.where(turned > high + ON_LIMIT, angle, turned)


def one_turn_from(limits: Limits) -> float:
    """Give the lower end, rad, of the whole turn next to 0 within the limits of an axis that has one."""
    return float(np.clip(-np.pi, limits.low, limits.high - TURN))


def fit_turns(angles: Array, low: float, high: float) -> Array | None:
    """Shift a wound angle, (n,) rad, by as few whole turns as possible into its limits.

    Returns
    -------
    (n,), rad; None where it winds further than the limits are apart
    """
    least = np.ceil((low - ON_LIMIT - angles.min()) / TURN)
    most = np.floor((high + ON_LIMIT - angles.max()) / TURN)
    return None if least > most else angles + TURN * np.clip(0.0, least, most)


def _trace(first: Array, came: IntArray, trail: Array, branch: int) -> Array:
    rotary = np.empty((len(came), 2))
    for i in range(len(came) - 1, 0, -1):
        previous = int(came[i, branch])
        rotary[i] = trail[i, previous, branch]
        branch = previous
    rotary[0] = first[branch]
    return rotary


def spread_over_links(toolpath: Toolpath, rows: IntArray, rotary: Array) -> Array:
    """Give the locations between known ones angles in proportion to the way.

    Parameters
    ----------
    rows : (m,), indices of the known locations
    rotary : (m, 2), rad, their angles

    Returns
    -------
    (n, 2), rad; before the first and after the last known location the angles are held
    """
    way = np.cumsum(toolpath.lengths)
    spread = np.stack([np.interp(way, way[rows], rotary[:, k]) for k in range(2)], axis=1)
    # Where the pivot stands still, as in an inside corner, several locations share one place on the way.
    spread[rows] = rotary
    return spread
