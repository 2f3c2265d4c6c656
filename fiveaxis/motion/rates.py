"""How fast rotary axes turn, and how suddenly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion


@dataclass(frozen=True)
class PeakRate:
    """What a motion asks of one rotary axis at most.

    Parameters
    ----------
    speed : rad/s, mean over a move
    acceleration : rad/s², change of that from one cutting move to the next, over the mean of their times
    fastest, most_sudden : rows at which the moves end; None where nothing turns
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
    """Find the highest speed and change of speed of every rotary axis, by letter.

    Speeds are means over moves: what the axes do between two locations is for a time law to say
    (`time_motion`).
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
    """Give the largest value and its row, None where all are 0."""
    if not values.any():
        return 0.0, None
    row = int(np.argmax(values))
    return float(values[row]), row
