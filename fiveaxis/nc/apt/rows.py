"""Locations of an APT file while it is read, column by column."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath import MoveKind


def _doubles() -> array[float]:
    return array("d")


def _integers() -> array[int]:
    return array("q")


@dataclass
class AptRows:
    """The locations read so far; arrays of numbers, because a list of lists takes ten times the memory.

    Parameters
    ----------
    positions, vectors : three numbers for each location, unit and frame of the file
    kinds : `MoveKind` values
    feeds : mm/min, NaN where none was in force
    lines : of the statements
    """

    positions: array[float] = field(default_factory=_doubles)
    vectors: array[float] = field(default_factory=_doubles)
    kinds: array[int] = field(default_factory=_integers)
    feeds: array[float] = field(default_factory=_doubles)
    lines: array[int] = field(default_factory=_integers)

    def __len__(self) -> int:
        return len(self.lines)

    def add(
        self, position: list[float], vector: list[float], kind: MoveKind, feed: float | None, line: int
    ) -> None:
        """Append a location."""
        self.positions.extend(position)
        self.vectors.extend(vector)
        self.kinds.append(kind)
        self.feeds.append(np.nan if feed is None else feed)
        self.lines.append(line)

    def add_all(
        self, positions: Array, vectors: Array, kind: MoveKind, feed: float | None, line: int
    ) -> None:
        """Append the locations of one statement, (n, 3) each."""
        count = len(positions)
        self.positions.frombytes(np.ascontiguousarray(positions).tobytes())
        self.vectors.frombytes(np.ascontiguousarray(vectors).tobytes())
        self.kinds.extend([kind] * count)
        self.feeds.extend([np.nan if feed is None else feed] * count)
        self.lines.extend([line] * count)

    @property
    def here(self) -> Array:
        """(3,), the position of the last location."""
        return np.array(self.positions[-3:])

    def columns(self) -> tuple[Array, Array, IntArray, Array, IntArray]:
        """Give positions and vectors, (n, 3), kinds, feeds and lines, (n,)."""
        return (
            np.array(self.positions).reshape(-1, 3),
            np.array(self.vectors).reshape(-1, 3),
            np.array(self.kinds, dtype=np.int64),
            np.array(self.feeds),
            np.array(self.lines, dtype=np.int64),
        )
