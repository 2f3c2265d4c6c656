"""What a program cuts of the stock, move by move and over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, IntArray

# s over which rates are means: what single short moves remove is known to a few rays only.
STEP = 0.1


@dataclass(frozen=True, eq=False)
class Engaged:
    """What the moves of a motion take away of a stock: the engagement as it is, instead of one for all.

    Parameters
    ----------
    volume : (n,), mm³ that each move removes
    contact : (n,), mm² of the cutter's surface in the material, mean over the move
    """

    volume: Array
    contact: Array

    @classmethod
    def of_rows(cls, volume: Array, contact: Array, ends: IntArray) -> Engaged:
        """Join the rows of a motion that was cut to moves.

        Parameters
        ----------
        volume : (m,), mm³ that the move to each row removes
        contact : (m,), mm², of the cutter at each row
        ends : (n,), ascending, the row at which each move ends
        """
        cuts = volume > 0.0
        mean = np.where(cuts, (contact + np.roll(contact, 1) * np.roll(cuts, 1)) / 2.0, 0.0)
        volumes, means = (np.diff(np.cumsum(c)[ends], prepend=0.0) for c in (volume, mean))
        return cls(volumes, means / np.maximum(np.diff(ends, prepend=-1), 1))


@dataclass(frozen=True, eq=False)
class CutCourse:
    """What is removed over a program's time, and the power that it takes.

    Parameters
    ----------
    time : (n,), s, of each move
    volume : (n,), mm³ that each move removes
    energy : (n,), J that the cut takes in each move; None without figures of the process
    """

    time: Array
    volume: Array
    energy: Array | None

    @property
    def ends(self) -> Array:
        """Ends of steps of `STEP`, (m,) s, up to the program's."""
        return STEP * np.arange(1.0, np.ceil(float(self.time.sum()) / STEP) + 1.0)

    @property
    def rate(self) -> Array:
        """Material removal rate, mean over each step, (m,) mm³/s."""
        return self._mean(self.volume)

    @property
    def power(self) -> Array | None:
        """Power of the cut, mean over each step, (m,) W."""
        return None if self.energy is None else self._mean(self.energy)

    def _mean(self, amounts: Array) -> Array:
        sums = np.interp(self.ends, np.cumsum(self.time), np.cumsum(amounts))
        return np.diff(sums, prepend=0.0) / STEP

    def as_dict(self) -> dict[str, float | None]:
        """Return its figures as plain data for JSON."""
        power = self.power
        return {
            "volume_mm3": float(self.volume.sum()),
            "largest_rate_mm3_s": float(self.rate.max(initial=0.0)),
            "largest_power_W": None if power is None else float(power.max(initial=0.0)),
        }
