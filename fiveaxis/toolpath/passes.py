"""What whoever laid a path knows of its passes, and what the file of its locations doesn't tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fiveaxis.errors import ToolpathError
from fiveaxis.geometry import Array, IntArray


@dataclass(frozen=True, eq=False)
class PassEnd:
    """Where a pass begins or ends.

    Parameters
    ----------
    pivot : (3,), mm, workpiece frame
    normal : (3,), unit vector out of the material
    outward : (3,), mm, from the pass's next location (or the one before its end) to here
    """

    pivot: Array
    normal: Array
    outward: Array


# Lays the link from where a pass ends to where another begins, clear of the part: pivots, (k, 3) mm,
# workpiece frame, without the two ends; or None if there is no such way. In place of an end, None stands for
# the air before the first pass, or behind the last one.
Relink = Callable[[PassEnd | None, PassEnd | None], Array | None]


@dataclass(frozen=True, eq=False)
class Passes:
    """The passes of a path, and how to lay links between other starts of them.

    Parameters
    ----------
    first, last : (m,), rows of the path at which each pass begins and ends, in order; what lies between two
        of them, before or behind them is a link
    locations : of the path
    relink : lays another link

    Raises
    ------
    ToolpathError
        Rows out of order.
    """

    first: IntArray
    last: IntArray
    locations: int
    relink: Relink

    def __post_init__(self) -> None:
        if len(self.first) != len(self.last) or (self.first > self.last).any():
            raise ToolpathError("a pass ends before it begins; give the rows of both, for every pass")
        if len(self.last) and (self.first[0] < 0 or self.last[-1] >= self.locations):
            raise ToolpathError(f"passes end at row {self.last[-1]} of {self.locations} locations")
        if (self.first[1:] <= self.last[:-1]).any():
            raise ToolpathError("a pass begins before the one before it ends; give passes in their order")
