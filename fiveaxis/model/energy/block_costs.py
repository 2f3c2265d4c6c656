"""Energy that a block costs each drive, and the least that travel costs at whatever speed.

A block costs a constant part while the axis moves at a measured speed, and a part for its travel.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Array, BoolArray, MachineError
from fiveaxis.model.energy.drives import (
    constant_share,
    gravity_forces,
    measured_line,
    moved_weights,
    moving_powers,
    require_drive,
    travel_costs,
)
from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.drives import FrictionDrive
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.toolpath.steps import StepTable, per_step


@dataclass(frozen=True, eq=False)
class BlockCosts(StepTable):
    """Energy of n blocks by axis: ``slope |Δ| + standing · max(min(1, |Δ| / slow), |Δ| / measured)``.

    The measured power of a linear drive doesn't depend on its speed: between the slowest and the fastest
    measured speed an axis pays for the whole block, however far it travels. A slower or faster one pays for
    its travel as at the nearest of these speeds. It is what `drive_power` adds up to over the block, except
    that a power that grows with the square of speed is linearised at the programmed feed, that gravity's
    torques are those at the axes' zero, and that nothing is refunded for power that a drive returns.

    Parameters
    ----------
    slope : (2, n, k), J/mm and J/rad, while the axis value grows and while it falls
    standing : (2, n, k), J, constant part of a block in which the axis moves at a measured speed
    slow : (n, k), mm and rad, travel in the block at the slowest measured speed
    measured : (n, k), mm and rad, travel in the block at the fastest measured speed; infinite where unknown
    step : (n, k), mm and rad, travel at the programmed feed
    """

    slope: Array = field(metadata=per_step(axis=1, spread=1))
    standing: Array = field(metadata=per_step(axis=1))
    slow: Array = field(metadata=per_step())
    measured: Array = field(metadata=per_step())
    step: Array = field(metadata=per_step())

    @classmethod
    def of_travel(cls, plus: Array, minus: Array) -> BlockCosts:
        """Make costs in proportion to travel, (n, k) J/mm and J/rad."""
        none = np.zeros_like(plus)
        return cls(np.stack([plus, minus]), np.zeros((2, *plus.shape)), none, none, none)

    def near(self, travel: Array, sharpness: float) -> tuple[Array, Array]:
        """Compute prices of travel near a solution, (n, k) J/mm and J/rad: what moves has all but paid.

        At the solution itself, price times travel tends to what a block costs as the sharpness tends to 0; it
        is exact for an axis that is slower or faster than was measured.

        Parameters
        ----------
        travel : (n, k), mm and rad, absolute travel of the solution
        sharpness : share of the travel at the programmed feed at which half of the constant part is paid

        References
        ----------
        Candès, Wakin & Boyd, "Enhancing sparsity by reweighted l1 minimization", 2008, section 2.
        """
        over = np.where(travel > self.slow, travel + sharpness * self.step, self.slow)
        over = np.where(travel > self.measured, self.measured, over)
        plus, minus = self.slope + np.divide(
            self.standing, over, out=np.zeros_like(self.standing), where=over > 0.0
        )
        return plus, minus


def block_costs(machine: Machine, feed: Array, rapid: BoolArray | None = None, *, time: Array) -> BlockCosts:
    """Compute what blocks cost each drive; `MachineError` where the power of an axis isn't known.

    A rapid move has no feed, and its duration depends on the posture, so its whole cost is in proportion to
    travel, as in `travel_costs`.

    Parameters
    ----------
    feed, time : (n,), mm/s, programmed, and s of each block at that feed
    rapid : (n,), which blocks are rapid moves; none by default

    References
    ----------
    Hayashi et al. (2018), power table: the power of X, Y and Z is the same from 250 to 1000 mm/min. Edem &
    Balogun (2018), Eqs. (1) and (5), for drives with an offset and a slope.
    """
    rapid = np.zeros(len(feed), dtype=bool) if rapid is None else rapid
    travel = np.stack(travel_costs(machine, feed, rapid))
    speed = np.where(machine.is_rotary, np.radians(feed)[:, None], feed[:, None])
    moving = np.where(rapid[:, None], 0.0, moving_powers(machine)[:, None])
    drives = [require_drive(machine, axis) for axis in machine.axes]
    shares = [constant_share(v, d.measured_from, d.measured_to) for v, d in zip(speed.T, drives, strict=True)]
    # What the travel metric charges beyond the constant part grows with speed.
    slope = np.maximum(travel - moving * np.stack(shares, axis=1) / speed, 0.0)
    slow = np.stack([(d.measured_from or 0.0) * time for d in drives], axis=1)
    unknown = np.full(len(time), np.inf)
    measured = np.stack([unknown if d.measured_to is None else d.measured_to * time for d in drives], axis=1)
    return BlockCosts(slope, moving * time[:, None], slow, measured, speed * time[:, None])


def least_travel_costs(machine: Machine) -> tuple[Array, Array, float]:
    """Compute the least energy of travel by axis at any speed up to the axis's highest.

    A power that doesn't depend on speed costs the least at the highest speed, or beyond the fastest measured
    one, and nothing where neither is known. Of a friction drive counts what it does against friction and
    gravity: between two standstills the work of acceleration is zero at best, and heat of the motor and
    viscous friction only add to it.

    Returns
    -------
    plus, minus : (k,), J/mm and J/rad, while an axis value grows and falls; their sum isn't below 0, one of
        them is where a braking drive returns power
    standing : W, drawn at all times

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
        # Least time for a mm or rad that the constant part is charged for.
        slowness = max(1.0 / speed if speed else 0.0 for speed in (axis.max_speed, drive.measured_to))
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
            lines = [measured_line(drive, side, float(weights[column])) for side in (0, 1)]
            costs[:, column] = [slope + offset * slowness for slope, offset in lines]
    return costs[0], costs[1], standing


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
