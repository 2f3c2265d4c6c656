"""Pieces of a log between its gaps: steps of any length, derivatives within a piece, the time of each row."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from fiveaxis.energy.log_units import quantities
from fiveaxis.errors import InputError
from fiveaxis.geometry import Array, BoolArray, IntArray, product

GAP = 10.0  # multiple of the median step above which rows are missing
FASTER = 1.5  # multiple of the log's highest speed; where a position changes faster, rows are missing too
FAST = 0.25  # share of the longest step: travel of shorter ones is often below a position's last digit
AGREEING = (0.6, 1.6)  # travel by position over travel by speed, which is sampled


@dataclass(frozen=True, eq=False)
class Pieces:
    """Rows of a log, in pieces without gaps.

    Parameters
    ----------
    time : (n,), s
    broken : (n − 1,), steps that are gaps
    reasons : why steps are gaps → how many
    """

    time: Array
    broken: BoolArray
    reasons: Mapping[str, int]

    @classmethod
    def of_time(cls, time: Array, longest: float | None) -> Pieces:
        """Split where a step is longer than a bound, s; by default `GAP` median steps."""
        steps = np.diff(time)
        bound = GAP * float(np.median(steps)) if longest is None else longest
        broken = steps > bound
        count = int(broken.sum())
        lost = float(steps[broken].sum())
        return cls(
            time, broken, {f"steps longer than {bound:.3g} s, {lost:.4g} s in all": count} if count else {}
        )

    def split(self, broken: BoolArray, reason: str) -> Pieces:
        """Split at more steps, (n − 1,)."""
        count = int((broken & ~self.broken).sum())
        return Pieces(
            self.time, self.broken | broken, dict(self.reasons) | ({reason: count} if count else {})
        )

    @property
    def durations(self) -> Array:
        """Time of each row, (n,) s: half of the steps on both sides; beside a gap, half a median step."""
        steps = np.diff(self.time)
        whole = steps[~self.broken]
        usual = float(np.median(whole if len(whole) else steps))
        inner = np.where(self.broken, usual, steps)
        return 0.5 * (np.concatenate([[usual], inner]) + np.concatenate([inner, [usual]]))

    def derivative(self, values: Array) -> Array:
        """Differentiate within pieces, (n,); NaN where a row stands alone between gaps.

        Central differences of second order for uneven steps, one-sided at the ends of a piece.
        """
        result = np.full(len(values), np.nan)
        ends = [0, *(np.flatnonzero(self.broken) + 1), len(values)]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for start, end in pairwise(ends):
                if end - start > 1:
                    result[start:end] = np.gradient(values[start:end], self.time[start:end])
        return result


def split_at_jumps(
    pieces: Pieces, position: Array, speed: Array, *, unit: str, rotary: bool, file: Path
) -> Pieces:
    """Split where a position changes faster than the log's highest speed; check the speed by the position.

    Parameters
    ----------
    pieces : of the log
    position : (n,), mm or rad
    speed : (n,), mm/s or rad/s, from a column of its own
    unit : of the speed, as stated

    Raises
    ------
    InputError
        Position and speed disagree in size or direction.
    """
    least = np.radians(1.0) if rotary else 1.0
    if np.ptp(position) < least and np.abs(speed).max() < least:
        return pieces  # a log of a standstill has noise only
    time = np.diff(pieces.time)
    travel, mean = np.diff(position), 0.5 * (speed[1:] + speed[:-1]) * time
    fast = ~pieces.broken & (np.abs(mean) > FAST * np.abs(mean[~pieces.broken]).max(initial=0.0))
    if not fast.any():
        return pieces
    # A rounded position changes by its last digit.
    finest = float(np.abs(travel[travel != 0.0]).min()) if travel.any() else 0.0
    jumps = ~pieces.broken & (np.abs(travel) > FASTER * np.abs(speed).max() * time + finest)
    # Where most steps are jumps the speed is too small throughout.
    whole = fast if (fast & jumps).sum() > 0.5 * fast.sum() else fast & ~jumps
    ratio = float(np.abs(travel[whole]).sum() / np.abs(mean[whole]).sum())
    if not AGREEING[0] <= ratio <= AGREEING[1]:
        raise InputError(
            f"position and velocity disagree: the axis travels {ratio:.3g} times what its velocity gives; "
            f"{_likely_unit(ratio, unit, rotary=rotary)}",
            file=file,
        )
    if float(product(travel[whole], mean[whole])) < 0.0:
        raise InputError("position falls while velocity is positive; reverse the sign of one", file=file)
    return pieces.split(jumps, "jumps of position that the velocity doesn't explain")


def _likely_unit(ratio: float, unit: str, *, rotary: bool) -> str:
    units = quantities(rotary=rotary)["velocity"].units
    nearest = (
        min(units, key=lambda other: abs(math.log(ratio * units[unit] / units[other]))) if ratio else unit
    )
    if nearest != unit and AGREEING[0] <= ratio * units[unit] / units[nearest] <= AGREEING[1]:
        return f"the likely unit of the velocity is {nearest}, not {unit}"
    return "check the columns and units of position, velocity and time"


def require_growing(time: Array, lines: IntArray, name: str, file: Path) -> None:
    """Raise if time, (n,) s, doesn't grow from row to row."""
    stuck = np.flatnonzero(np.diff(time) <= 0.0)
    if len(stuck):
        i = int(stuck[0])
        raise InputError(
            f"{name} goes from {time[i]:g} to {time[i + 1]:g} s; time must grow from row to row: sort the "
            "log, or split it where the clock was set",
            file=file,
            line=int(lines[i + 1]),
        )
