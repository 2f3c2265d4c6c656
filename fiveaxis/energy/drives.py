"""Feed drives: power while an axis moves, and energy per unit of travel."""

from __future__ import annotations

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.geometry import Array
from fiveaxis.machine import Axis, DirectionalDrive, Machine


def travel_costs(machine: Machine, feed: Array) -> tuple[Array, Array]:
    """Compute the energy per unit of axis travel at a programmed feed.

    ``W = 60·P/v`` with P in W and v in mm/min or deg/min (form-shaping Eq. 1). A drive whose power is
    proportional to its own speed costs the same at every feed. A rotary axis whose power doesn't depend on
    its speed takes the programmed number as deg/min, as the equation does.

    Parameters
    ----------
    machine : every axis with a drive
    feed : (n,), mm/s

    Returns
    -------
    plus, minus : (n, k), J/mm and J/rad, while the axis value grows or falls

    Raises
    ------
    MachineError
        An axis without known power.

    References
    ----------
    Hayashi et al. (2018), Eq. (1).
    """
    drives = [_require_drive(machine, axis) for axis in machine.axes]
    plus = [_travel_cost(d.plus, d, a, feed) for d, a in zip(drives, machine.axes, strict=True)]
    minus = [_travel_cost(d.minus, d, a, feed) for d, a in zip(drives, machine.axes, strict=True)]
    return np.stack(plus, axis=1), np.stack(minus, axis=1)


def drive_power(drive: DirectionalDrive, speed: Array) -> Array:
    """Compute the electrical power of a drive at an axis speed.

    Parameters
    ----------
    drive : power by direction
    speed : (n,), mm/s or rad/s, signed; exactly 0 is standstill

    Returns
    -------
    (n,), W
    """
    level = np.where(speed > 0.0, drive.plus, drive.minus)
    return level * (np.abs(speed) if drive.proportional else np.sign(np.abs(speed)))


def _require_drive(machine: Machine, axis: Axis) -> DirectionalDrive:
    if axis.drive is None:
        missing = ", ".join(a.letter for a in machine.axes if a.drive is None)
        raise MachineError(
            f"machine {machine.name!r} has no power for axis {missing}; add [axes.{axis.letter}.drive] "
            "to its file or take the powers of another machine (--drives NAME)"
        )
    return axis.drive


def _travel_cost(power: float, drive: DirectionalDrive, axis: Axis, feed: Array) -> Array:
    if drive.proportional:
        return np.full_like(feed, power)
    # The programmed number means deg/min for a rotary axis: feed in mm/s counts as deg/s.
    return power / (np.radians(feed) if axis.is_rotary else feed) if power else np.zeros_like(feed)
