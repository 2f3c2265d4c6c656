"""Spindle speed and direction while a program is read."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.choice import split_program
from fiveaxis.nc.source import Source

# M word -> direction of the spindle.
SENSES = {"M3": 1.0, "M13": 1.0, "M4": -1.0, "M14": -1.0, "M5": 0.0}
STOP = "M5"


@dataclass
class Spindle:
    """Speed and direction in force.

    Parameters
    ----------
    speed : S, rev/min; None before the first
    sense : 1 for M3, -1 for M4, 0 for a stopped spindle
    changes : first line and signed speed, rev/min, of each change; NaN if the speed isn't stated
    """

    speed: float | None = None
    sense: float = 0.0
    changes: list[tuple[int, float]] = field(default_factory=list)

    def take(self, block: Block) -> None:
        """Read S, M3, M4 and M5 of a block; M5 takes effect after the block's move."""
        words = [word for word in block.m if word in SENSES]
        if not words and "S" not in block.words:
            return
        self.speed = block.words.get("S", self.speed)
        self.sense = SENSES[words[-1]] if words else self.sense
        turning = np.nan if self.speed is None else self.speed
        begin = block.line + (words[-1:] == [STOP])
        self.changes.append((begin, self.sense * turning if self.sense else 0.0))

    def at(self, lines: IntArray) -> Array:
        """Return the signed speed, (n,) rev/min, on lines, (n,)."""
        begins = [line for line, _ in self.changes]
        speeds = np.array([0.0, *(speed for _, speed in self.changes)])
        return np.asarray(speeds[np.searchsorted(begins, lines, side="right")])


def spindle_of(source: Source, lines: IntArray) -> Array:
    """Return the signed spindle speed, (n,) rev/min, on lines of a program, (n,)."""
    spindle = Spindle()
    for block in split_program(source):
        spindle.take(block)
    return spindle.at(lines)
