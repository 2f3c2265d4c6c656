"""The spindle while a program is read: its speed, direction and tools."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.choice import split_program
from fiveaxis.nc.source import Source

# M word -> direction of the spindle.
SENSES = {"M3": 1.0, "M13": 1.0, "M4": -1.0, "M14": -1.0, "M5": 0.0}
STOP = "M5"

# Words that load the selected tool, in any language.
CHANGES = ("M6", "TOOL CALL")
# An empty spindle.
EMPTY = ("T0", "TOOL CALL 0")

# Line, name of the tool, word.
_Change = tuple[int, str | None, str]


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
        if isinstance(block, Block):  # a run has no words of the spindle
            spindle.take(block)
    return spindle.at(lines)


@dataclass
class Tools:
    """The tools of a program, in order.

    T selects a tool and M6 loads it. In a program without M6, as for turrets and some Sinumerik machines, T
    changes the tool. TOOL CALL does both.

    Parameters
    ----------
    selected : lines and names of selected tools
    changed : lines, names and words of changes; the name is None if the program doesn't give it
    """

    selected: list[tuple[int, str]] = field(default_factory=list)
    changed: list[_Change] = field(default_factory=list)

    def take(self, block: Block) -> None:
        """Read the tool words of a block."""
        name = block.tool or (f"T{block.words['T']:g}" if "T" in block.words else None)
        if name is not None:
            self.selected.append((block.line, name))
        for word in CHANGES:
            if word in block.m or word in block.ignored:
                # The tool is that of the last T; without T it is unknown.
                latest = self.selected[-1][1] if self.selected else None
                self.changed.append((block.line, latest, word))

    def findings(self, source: Source, last: int) -> list[Finding]:
        """Return a warning at the first change to a second tool: a path has one tool only.

        Parameters
        ----------
        last : line of the last move; later tools and an empty spindle don't count
        """
        found: list[_Change] = self.changed or [(line, name, name) for line, name in self.selected]
        found = [new for new in found if new[0] <= last and new[1] not in EMPTY]
        others = [new for old, new in pairwise(found) if new[1] is None or new[1] != old[1]]
        if not others:
            return []
        line, name, word = others[0]
        what = word if name is None else name if word in name else f"{name} {word}"
        more = f", the first of {len(others)} changes" if len(others) > 1 else ""
        return [
            Finding(
                Severity.WARNING,
                "several-tools",
                f"{what} loads another tool{more}, and the whole program is read with one tool; split it "
                "into one program per tool",
                Place(line=line, file=source.name),
            )
        ]
