"""Peak speeds and accelerations of the rotary axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion


@dataclass(frozen=True)
class PeakRate:
    """The peaks of one rotary axis in a motion.

    Parameters
    ----------
    speed : rad/s, mean over a move
    acceleration : rad/s², its change from one cutting move to the next, over the mean of their durations
    fastest, most_sudden : rows at which these moves end; None if the axis doesn't turn
    """

    speed: float
    acceleration: float
    fastest: int | None
    most_sudden: int | None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures in degrees, as plain data for JSON."""
        return {
            "speed_deg_s": float(np.degrees(self.speed)),
            "acceleration_deg_s2": float(np.degrees(self.acceleration)),
            "fastest": self.fastest,
            "most_sudden": self.most_sudden,
        }


def peak_rates(machine: Machine, motion: Motion) -> dict[str, PeakRate]:
    """Find the highest speed and acceleration of every rotary axis, by letter.

    Speeds are means over moves; a time law has those within a move (`time_motion`).
    """
    timed = motion.time > 0.0
    turns = motion.moves[:, machine.rotary_columns]
    speed = np.where(timed[:, None], turns / np.where(timed, motion.time, 1.0)[:, None], 0.0)
    both = timed[1:] & timed[:-1] & motion.cutting[1:] & motion.cutting[:-1]
    both[:1] = False  # no move ends at the first row
    between = (motion.time[1:] + motion.time[:-1]) / 2.0
    change = np.abs(np.diff(speed, axis=0)) / np.where(both, between, 1.0)[:, None] * both[:, None]
    rates = {}
    for i, letter in enumerate(machine.rotaries):
        top, fastest = _peak(np.abs(speed[:, i]))
        sudden, row = _peak(change[:, i])
        rates[letter] = PeakRate(top, sudden, fastest, None if row is None else row + 1)
    return rates


def _peak(values: Array) -> tuple[float, int | None]:
    """Return the largest value and its row, None if all are 0."""
    if not values.any():
        return 0.0, None
    row = int(np.argmax(values))
    return float(values[row]), row
