"""The passes of a planned path, and how to replan the links between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fiveaxis.errors import ToolpathError
from fiveaxis.geometry import Array, IntArray


@dataclass(frozen=True, eq=False)
class PassEnd:
    """Start or end of a pass.

    Parameters
    ----------
    pivot : (3,), mm, workpiece frame
    normal : (3,), unit vector out of the material
    outward : (3,), mm, from the neighbouring location of the pass to this one
    """

    pivot: Array
    normal: Array
    outward: Array


# Plans the link from the end of a pass to the start of another, clear of the part: pivots, (k, 3) mm,
# workpiece frame, without the two ends; None if there is no clear route. An end of None is the air before the
# first pass or after the last one.
Relink = Callable[[PassEnd | None, PassEnd | None], Array | None]


@dataclass(frozen=True, eq=False)
class Passes:
    """The passes of a path, and how to plan links between them when they start elsewhere.

    Parameters
    ----------
    first, last : (m,), rows of the path at which each pass begins and ends, in order; all other rows belong
        to links
    locations : their number in the path
    relink : plans another link

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
            raise ToolpathError("a pass ends before it begins; give first and last row of every pass")
        if len(self.last) and (self.first[0] < 0 or self.last[-1] >= self.locations):
            raise ToolpathError(f"passes end at row {self.last[-1]} of {self.locations} locations")
        if (self.first[1:] <= self.last[:-1]).any():
            raise ToolpathError("a pass begins before the one before it ends; give passes in their order")
