"""How steadily axes run: starts, reversals, changes of speed, and the rotary axes' peak speeds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.motion import Motion

# mm/s, rad/s: slower axes count as standing. That exceeds rounding in a program (1e-5 mm in a block of 20 ms
# is half of it), residuals of an optimiser and effects of dividing moves.
STANDING, STANDING_TURN = 1e-3, 2e-5


def standing_speeds(machine: Machine) -> Array:
    """Return the speeds below which an axis counts as standing, (k,) mm/s and rad/s."""
    return np.where(machine.is_rotary, STANDING_TURN, STANDING)


@dataclass(frozen=True)
class SpeedChange:
    """A change of an axis's speed from one cutting block to the next.

    Parameters
    ----------
    size : mm/s or rad/s, of the blocks' mean speeds
    block : row of the block before which the speed changes
    """

    size: float
    block: int

    def shown(self, letter: str) -> tuple[float, str]:
        """Return the size for people, and its unit: mm/s, or deg/s of a rotary axis."""
        return (float(np.degrees(self.size)), "deg/s") if letter in "ABC" else (self.size, "mm/s")


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Starts, reversals and changes of speed of the axes in a program's blocks.

    An axis *moves* in a block if its mean speed reaches `standing_speeds`; else it stands.
    A *start* is a block in which an axis moves after one in which it stood, or its first one. A *reversal* is
    a block in which it moves against its direction in the block before: a start is none, so each counts once.
    Rapid moves count like others. A block without duration costs nothing, and its neighbours follow each
    other.

    Parameters
    ----------
    letters : axis letters, one per column
    block, column : (e,), row and axis of each start and reversal, row by row
    reverses : (e,), whether it is a reversal
    time : (e,), s, from the first row to the beginning of its block
    changes : largest change of speed by axis letter; an axis whose speed never changes, by as much as
        `standing_speeds`, has none
    """

    letters: str
    block: IntArray
    column: IntArray
    reverses: BoolArray
    time: Array
    changes: dict[str, SpeedChange]

    @property
    def starts(self) -> dict[str, int]:
        """Number of starts by axis letter."""
        return self._count(~self.reverses)

    @property
    def reversals(self) -> dict[str, int]:
        """Number of reversals by axis letter."""
        return self._count(self.reverses)

    @property
    def events(self) -> int:
        """Number of starts and reversals of all axes."""
        return len(self.block)

    def _count(self, some: BoolArray) -> dict[str, int]:
        counts = np.bincount(self.column[some], minlength=len(self.letters))
        return dict(zip(self.letters, counts.tolist(), strict=True))

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON; rotary axes in degrees."""
        starts, reversals = self.starts, self.reversals
        return {
            "starts": sum(starts.values()),
            "starts_by_axis": starts,
            "reversals": sum(reversals.values()),
            "reversals_by_axis": reversals,
            "speed_changes": {
                c: dict(zip(("change", "unit"), change.shown(c), strict=True)) | {"block": change.block}
                for c, change in self.changes.items()
            },
        }


def measure_steadiness(
    machine: Machine, blocks: Motion, rounding: float = 0.0, ends: BoolArray | None = None
) -> Steadiness:
    """Find the starts, the reversals and the largest changes of speed in a program's blocks, one a row.

    Parameters
    ----------
    rounding : mm, travel of a linear axis up to which it counts as standing
    ends : (n,), rows at which a block ends, where one has several: what an axis swings by in the middle of a
        block, because the control moves the tip straight, is no event of the program
    """
    if ends is not None:
        rows = np.flatnonzero(ends)
        time = np.diff(np.cumsum(blocks.time)[rows], prepend=0.0)
        whole = measure_steadiness(machine, replace(blocks.at(rows), time=time, location=None), rounding)
        changes = {c: replace(change, block=int(rows[change.block])) for c, change in whole.changes.items()}
        return replace(whole, block=rows[whole.block], changes=changes)
    lasting = 1 + np.flatnonzero(blocks.time[1:] > 0.0)
    moves, least = blocks.moves[lasting], standing_speeds(machine)
    speed = moves / blocks.time[lasting, None]
    moving = np.abs(speed) >= least
    moving &= (np.abs(moves) > rounding) | machine.is_rotary
    way = np.where(moving, np.sign(speed), 0.0)
    before = np.vstack([np.zeros_like(way[:1]), way[:-1]])
    row, column = np.nonzero((way != 0.0) & (way != before))
    return Steadiness(
        letters=blocks.letters,
        block=lasting[row],
        column=column,
        reverses=before[row, column] != 0.0,
        time=(np.cumsum(blocks.time) - blocks.time)[lasting[row]],
        changes=_largest_changes(blocks, lasting, speed, least),
    )


def _largest_changes(blocks: Motion, lasting: IntArray, speed: Array, least: Array) -> dict[str, SpeedChange]:
    """Find the largest change of each axis's speed, (b, k) in lasting blocks, (b,), between two cuts."""
    cuts = blocks.cutting[lasting]
    change = np.abs(np.diff(speed, axis=0)) * (cuts[1:] & cuts[:-1])[:, None]
    if not len(change):
        return {}
    rows, sizes = np.argmax(change, axis=0), change.max(axis=0)
    return {
        c: SpeedChange(float(size), int(lasting[row + 1]))
        for c, row, size, smallest in zip(blocks.letters, rows, sizes, least, strict=True)
        if size >= smallest
    }


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
    speed = motion.speeds[:, machine.rotary_columns]
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


def axis_uses(machine: Machine, motion: Motion, reached: Array | None = None) -> dict[str, dict[str, Any]]:
    """Measure how far each axis travels, and how near it comes to its limits, as plain data by letter.

    That is ``travel`` and ``margin`` in ``unit``, mm or deg; the margin, infinite for an axis without limits,
    is that of the positions reached, (m, k) mm and rad, by default those of the motion.
    """
    positions = motion.positions if reached is None else reached
    travel = np.abs(motion.moves).sum(axis=0)
    margin = np.minimum(positions - machine.low, machine.high - positions).min(axis=0)
    shown = zip(machine.axes, machine.shown(travel).tolist(), machine.shown(margin).tolist(), strict=True)
    return {axis.letter: {"travel": far, "margin": near, "unit": axis.unit} for axis, far, near in shown}


def _peak(values: Array) -> tuple[float, int | None]:
    """Return the largest value and its row, None if all are 0."""
    if not values.any():
        return 0.0, None
    row = int(np.argmax(values))
    return float(values[row]), row
