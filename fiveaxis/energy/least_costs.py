"""The least energy that travel costs a drive, at whatever speed: what a bound from below may charge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy.drives import gravity_forces, moved_weights, require_drive
from fiveaxis.errors import MachineError
from fiveaxis.geometry import Array
from fiveaxis.machine import (
    AffineDrive,
    Axis,
    DirectionalDrive,
    Drive,
    FrictionDrive,
    Machine,
    WeightDrive,
)


@dataclass(frozen=True, eq=False)
class LeastCosts:
    """Least energy of travel, however fast.

    Parameters
    ----------
    plus, minus : (k,), J/mm and J/rad, while an axis value grows and falls; their sum isn't below 0, one of
        them is where a braking drive returns power
    standing : W, drawn at all times
    """

    plus: Array
    minus: Array
    standing: float


def least_travel_costs(machine: Machine) -> LeastCosts:
    """Compute the least energy of travel by axis at any speed up to the axis's highest.

    A power that doesn't depend on speed costs the least at the highest speed, and nothing where that isn't
    known. Of a friction drive counts what it does against friction and gravity: between two standstills the
    work of acceleration is zero at best, and heat of the motor and viscous friction only add to it.

    Raises
    ------
    MachineError
        The power of an axis isn't known, or gravity's load on a drive that returns power depends on the
        posture.
    """
    forces = gravity_forces(machine, np.zeros((1, len(machine.axes))))[0]
    weights = moved_weights(machine)
    costs = np.zeros((2, len(machine.axes)))
    standing = 0.0
    for column, axis in enumerate(machine.axes):
        drive = require_drive(machine, axis)
        slowness = 1.0 / axis.max_speed if axis.max_speed else 0.0
        if isinstance(drive, FrictionDrive):
            standing += drive.hold
            costs[:, column] = drive.moving * slowness
            if _is_constant(machine, axis):
                costs[:, column] += _mechanical(drive, float(forces[column]))
            elif drive.regeneration > 0.0:
                raise MachineError(
                    f"the drive of {axis.letter} of machine {machine.name!r} returns power, and gravity's "
                    "load on it depends on the posture: no lower bound of its energy is known; set its "
                    "regeneration to 0 or minimise travel"
                )
        else:
            costs[:, column] = [_tabled(drive, side, slowness, float(weights[column])) for side in (0, 1)]
    return LeastCosts(costs[0], costs[1], standing)


def _tabled(drive: Drive, side: int, slowness: float, weight: float) -> float:
    """Least cost of a drive whose power depends on its speed only; slowness is that of the highest speed."""
    if isinstance(drive, DirectionalDrive):
        level = (drive.plus, drive.minus)[side]
        return level if drive.proportional else level * slowness
    if isinstance(drive, AffineDrive):
        slope, offset = (drive.plus, drive.minus)[side]
        return slope + offset * slowness
    if isinstance(drive, WeightDrive):
        return weight * (drive.a / 1000.0 + drive.b * slowness)
    raise TypeError(f"no least cost for {type(drive).__name__}")


def _mechanical(drive: FrictionDrive, gravity: float) -> list[float]:
    """Least electrical energy of a steady load, J/mm or J/rad, upwards and downwards."""
    held = gravity - drive.counterbalance
    loads = drive.friction + held, drive.friction - held
    return [load / drive.efficiency if load > 0.0 else load * drive.regeneration for load in loads]


def _is_constant(machine: Machine, axis: Axis) -> bool:
    """Check whether gravity's load on an axis is the same in every posture."""
    table, head = machine.code.table, machine.code.head
    on_table = axis.letter in table
    if axis.is_rotary:
        own = bool(axis.moved_mass) and axis.mass_centre is not None
        return not own and not (on_table and machine.load.mass > 0.0)
    # Axes between this one and the bed, which turn its direction.
    before = table[table.index(axis.letter) + 1 :] if on_table else head[: head.index(axis.letter)]
    return not any(machine.axes[machine.column(letter)].is_rotary for letter in before)
