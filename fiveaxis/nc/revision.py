"""Lines of a program in place of its own, and the positions that they are for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.nc.source import Source


@dataclass(frozen=True, eq=False)
class Revision:
    """Lines in place of those of a program.

    Parameters
    ----------
    source : the program
    replaced : line -> the lines in its place
    row_lines : for each new position, its line among all new lines, from 1
    first, last : lines of the program between which positions differ from what they were
    """

    source: Source
    replaced: Mapping[int, tuple[str, ...]]
    row_lines: IntArray
    first: int
    last: int

    @cached_property
    def revised(self) -> Source:
        """The program with its new lines."""
        return revised(self.source, self.replaced)

    @cached_property
    def begins(self) -> IntArray:
        """(n + 1,), where each line of the program begins in the revised one, from 1, and where it ends."""
        counts = [len(self.replaced.get(line + 1, ("",))) for line in range(len(self.source.lines))]
        return np.concatenate([[1], 1 + np.cumsum(counts)])


def revised(source: Source, replaced: Mapping[int, tuple[str, ...]]) -> Source:
    """Return a program with other lines in place of some of its own."""
    lines = [
        text for number, own in enumerate(source.lines, start=1) for text in replaced.get(number, (own,))
    ]
    return replace(source, lines=lines)


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the axes are to be at the locations of an operation's cuts, and at those between them.

    Parameters
    ----------
    row : (m,), rows of the operation's path: 3.25 is between 3 and 4
    tip : (m, 3), mm, in the frame of the path
    rotary : (m, r), rad, chain order
    time : (m,), s, of the move to each
    """

    row: Array
    tip: Array
    rotary: Array
    time: Array
