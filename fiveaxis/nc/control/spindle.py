"""The spindle while a program is read: how fast it turns, and which way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.choice import split_program
from fiveaxis.nc.source import Source

# M word -> the sense in which the spindle turns.
SENSES = {"M3": 1.0, "M13": 1.0, "M4": -1.0, "M14": -1.0, "M5": 0.0}
STOP = "M5"


@dataclass
class Spindle:
    """The speed and the sense that the blocks so far put in force.

    Parameters
    ----------
    speed : S, rev/min; None before the first
    sense : 1 for M3, -1 for M4, 0 while it stands
    changes : lines from which on the spindle turns otherwise, and its signed speed, rev/min; NaN where it
        turns at no stated speed
    """

    speed: float | None = None
    sense: float = 0.0
    changes: list[tuple[int, float]] = field(default_factory=list)

    def take(self, block: Block) -> None:
        """Take S, M3, M4 and M5 of a block; M5 acts once the block's move is done."""
        said = [word for word in block.m if word in SENSES]
        if not said and "S" not in block.words:
            return
        self.speed = block.words.get("S", self.speed)
        self.sense = SENSES[said[-1]] if said else self.sense
        turning = np.nan if self.speed is None else self.speed
        begin = block.line + (said[-1:] == [STOP])
        self.changes.append((begin, self.sense * turning if self.sense else 0.0))

    def at(self, lines: IntArray) -> Array:
        """Give the signed speed, (n,) rev/min, in the blocks of lines, (n,)."""
        begins = [line for line, _ in self.changes]
        speeds = np.array([0.0, *(speed for _, speed in self.changes)])
        return np.asarray(speeds[np.searchsorted(begins, lines, side="right")])


def spindle_of(source: Source, lines: IntArray) -> Array:
    """Find how the spindle turns in the blocks of a program's lines, (n,) rev/min, as `Spindle.at` does."""
    spindle = Spindle()
    for block in split_program(source):
        spindle.take(block)
    return spindle.at(lines)
