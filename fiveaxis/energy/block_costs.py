"""Energy that a block costs each drive: a constant part while the axis moves, and a part for its travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy.drives import axis_powers, travel_costs
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.motion import standing_speeds


@dataclass(frozen=True, eq=False)
class BlockCosts:
    """Energy of n blocks by axis: ``slope |Δ| + max(standing, standing |Δ| / reach)`` where an axis moves.

    The measured power of a linear drive doesn't depend on its speed, so an axis that moves at all pays for
    the whole block. This holds up to the fastest measured speed; a faster axis pays for its travel as at that
    speed, or as at the programmed feed where the file doesn't state the measured speeds.

    Parameters
    ----------
    slope : (2, n, k), J/mm and J/rad, while the axis value grows and while it falls
    standing : (2, n, k), J, constant part of a block in which the axis moves
    reach : (n, k), mm and rad, travel in the block at the fastest measured speed
    step : (n, k), mm and rad, travel at the programmed feed
    """

    slope: Array
    standing: Array
    reach: Array
    step: Array

    def prices(self, travel: Array, sharpness: float) -> tuple[Array, Array]:
        """Compute linear prices of travel that match the cost at the last solution and majorise it elsewhere.

        The constant part is divided by the axis's last travel: an axis that moved little pays a high price
        per millimetre, and soon stands. The cost isn't convex (iteratively reweighted ℓ1; Candès, Wakin &
        Boyd 2008, J. Fourier Anal. Appl. 14, 877).

        Parameters
        ----------
        travel : (n, k), mm and rad, absolute travel of the last solution
        sharpness : share of `step` below which travel counts as none

        Returns
        -------
        plus, minus : (n, k), J/mm and J/rad
        """
        least = travel + sharpness * self.step
        shared = np.divide(self.standing, least, out=np.zeros_like(self.standing), where=least > 0.0)
        fast = np.divide(self.standing, self.reach, out=np.zeros_like(self.standing), where=self.reach > 0.0)
        plus, minus = self.slope + np.maximum(shared, fast)
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
    moving = np.where(rapid[:, None], 0.0, _moving_powers(machine)[:, None])
    # What the travel metric charges beyond the constant part grows with speed.
    slope = np.maximum(travel - moving / speed, 0.0)
    drives = [axis.drive for axis in machine.axes]
    fastest = [drive.measured_to if drive is not None else None for drive in drives]
    most = np.where([v is not None for v in fastest], [v or 0.0 for v in fastest], speed)
    return BlockCosts(slope, moving * time[:, None], most * time[:, None], speed * time[:, None])


def _moving_powers(machine: Machine) -> Array:
    """Compute the constant part of each drive's power in motion beyond standstill, axes at 0; (2, k) W."""
    home, slow = np.zeros((1, len(machine.axes))), standing_speeds(machine)[None]
    still = axis_powers(machine, home, 0.0 * slow)
    # The straight line through two speeds near standstill, extrapolated to 0.
    lines = [
        2.0 * axis_powers(machine, home, sign * slow) - axis_powers(machine, home, 2.0 * sign * slow)
        for sign in (1.0, -1.0)
    ]
    return np.maximum(np.concatenate(lines) - still, 0.0)
