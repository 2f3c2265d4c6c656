"""Energy that a block costs each drive: a constant part while the axis moves, and a part for its travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy.drives import moving_powers, require_drive, travel_costs
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine

# Share of a block's cost that is rounding.
ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class BlockCosts:
    """Energy of n blocks by axis: ``slope |Δ| + max(standing, standing |Δ| / reach)`` where an axis moves.

    The measured power of a linear drive doesn't depend on its speed, so an axis that moves at all pays for
    the whole block. This holds up to the fastest measured speed; a faster axis pays for its travel as at that
    speed. It is what `drive_power` adds up to over the block, except that a power that grows with the square
    of speed is linearised at the programmed feed, that gravity's torques are those at the axes' zero, and
    that nothing is refunded for power that a drive returns.

    Parameters
    ----------
    slope : (2, n, k), J/mm and J/rad, while the axis value grows and while it falls
    standing : (2, n, k), J, constant part of a block in which the axis moves
    reach : (n, k), mm and rad, travel in the block at the fastest measured speed; infinite where unknown
    step : (n, k), mm and rad, travel at the programmed feed
    """

    slope: Array
    standing: Array
    reach: Array
    step: Array

    @classmethod
    def of_travel(cls, plus: Array, minus: Array) -> BlockCosts:
        """Make costs in proportion to travel, (n, k) J/mm and J/rad."""
        none = np.zeros_like(plus)
        return cls(np.stack([plus, minus]), np.zeros((2, *plus.shape)), none, none)

    def thinned(self, rows: IntArray) -> BlockCosts:
        """Return the costs of moves between some of the locations, (m,), each of several blocks."""

        def summed(steps: Array) -> Array:
            return np.add.reduceat(steps[..., : rows[-1], :], rows[:-1], axis=-2)

        slope = summed(self.slope) / np.diff(rows)[:, None]
        return BlockCosts(slope, summed(self.standing), summed(self.reach), summed(self.step))

    def backwards(self) -> BlockCosts:
        """Return the costs of the same blocks on the way back, the last one first."""
        steps = np.arange(len(self.step))[::-1]
        slope, standing = (np.ascontiguousarray(part[::-1, steps]) for part in (self.slope, self.standing))
        return BlockCosts(slope, standing, self.reach[steps], self.step[steps])

    @property
    def has_constant_power(self) -> bool:
        """Whether a drive draws power for moving at all, but for rounding."""
        return bool((self.standing > ROUNDING * self.slope * self.step).any())

    def near(self, travel: Array, sharpness: float) -> tuple[Array, Array]:
        """Compute prices of travel near a solution: what stands is dear, what moves has all but paid.

        At the solution itself, price times travel tends to what a block costs as the sharpness tends to 0.

        Parameters
        ----------
        travel : (n, k), mm and rad, absolute travel of the solution
        sharpness : share of the travel at the programmed feed at which half of the constant part is paid

        Returns
        -------
        plus, minus : (n, k), J/mm and J/rad

        References
        ----------
        Candès, Wakin & Boyd, "Enhancing sparsity by reweighted l1 minimization", 2008, section 2.
        """
        over = np.where(travel > self.reach, self.reach, travel + sharpness * self.step)
        plus, minus = self.slope + np.divide(
            self.standing, over, out=np.zeros_like(self.standing), where=over > 0.0
        )
        return plus, minus


def block_costs(machine: Machine, feed: Array, rapid: BoolArray | None = None, *, time: Array) -> BlockCosts:
    """Compute what blocks cost each drive.

    A rapid move has no feed, and its duration depends on the posture, so its whole cost is in proportion to
    travel, as in `travel_costs`.

    Parameters
    ----------
    machine : every axis with a drive
    feed : (n,), mm/s, programmed
    rapid : (n,), which blocks are rapid moves; none by default
    time : (n,), s, of each block at the programmed feed

    Raises
    ------
    MachineError
        The power of an axis isn't known.

    References
    ----------
    Hayashi et al. (2018), power table: the power of X, Y and Z is the same from 250 to 1000 mm/min. Edem &
    Balogun (2018), Eqs. (1) and (5), for drives with an offset and a slope.
    """
    rapid = np.zeros(len(feed), dtype=bool) if rapid is None else rapid
    travel = np.stack(travel_costs(machine, feed, rapid))
    rotary = np.array([axis.is_rotary for axis in machine.axes])
    speed = np.where(rotary, np.radians(feed)[:, None], feed[:, None])
    moving = np.where(rapid[:, None], 0.0, moving_powers(machine)[:, None])
    fastest = [require_drive(machine, axis).measured_to for axis in machine.axes]
    most = np.array([np.inf if v is None else v for v in fastest])
    # What the travel metric charges beyond the constant part grows with speed.
    slope = np.maximum(travel - moving / np.minimum(speed, most), 0.0)
    reach = np.array([np.full(len(time), np.inf) if v is None else v * time for v in fastest]).T
    return BlockCosts(slope, moving * time[:, None], reach, speed * time[:, None])
