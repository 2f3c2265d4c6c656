"""The motion of a machine along a path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.machine import Machine
from fiveaxis.motion.timing import block_times
from fiveaxis.toolpath import MoveKind, Toolpath, refined


@dataclass(frozen=True, eq=False)
class Motion:
    """Axis values along a path, one row per cutter location.

    Parameters
    ----------
    letters : axis letters, one per column
    positions : (n, k), mm and rad, tool relative to workpiece; rotary axes accumulate their turns
    feed : (n,), mm/s, programmed along the move that ends at the row
    time : (n,), s, duration of that move; 0 for the first row
    kind : (n,), `MoveKind` values
    source : (n,), line of the source
    location : (n,), where each row lies among the locations of the path that was given: 3.25 lies a quarter
        of the way from 3 to 4; None for a row at each of them
    """

    letters: str
    positions: Array
    feed: Array
    time: Array
    kind: IntArray
    source: IntArray
    location: Array | None = None

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def moves(self) -> Array:
        """(n, k), mm and rad: change of each axis in the move that ends at the row, 0 for the first."""
        return np.diff(self.positions, axis=0, prepend=self.positions[:1])

    @property
    def cutting(self) -> BoolArray:
        """(n,), where the move that ends at the row cuts."""
        return self.kind == MoveKind.CUT

    @property
    def rapid(self) -> BoolArray:
        """(n,), where the move that ends at the row is a rapid move."""
        return self.kind == MoveKind.RAPID

    def at(self, rows: IntArray) -> Motion:
        """Return some of the rows, given by their indices in order, as a motion without a name."""
        return Motion(
            self.letters,
            self.positions[rows],
            self.feed[rows],
            self.time[rows],
            self.kind[rows],
            self.source[rows],
            None if self.location is None else self.location[rows],
        )


def located(toolpath: Toolpath, motion: Motion) -> Toolpath:
    """Give a path a location for each row of a motion along it, where the motion says where its rows lie.

    Raises
    ------
    ToolpathError
        The motion's rows lie on a path of another length, or not at all of its locations.
    """
    place = motion.location
    if place is None or len(motion) == len(toolpath):
        return toolpath
    given = place[place == np.floor(place)]
    if not np.array_equal(given, np.arange(len(toolpath))):
        raise ToolpathError(
            f"has {len(toolpath)} locations, and the motion has rows at {len(given)}, the last at number "
            f"{place[-1]:g}: it is along another path",
            file=toolpath.name,
        )
    return refined(toolpath, place)


def follow(toolpath: Toolpath, machine: Machine, rotary: Array) -> Motion:
    """Make the motion that takes the tool along a path with given rotary angles.

    Parameters
    ----------
    toolpath : the cutter locations
    machine : two rotary and three linear axes
    rotary : (n, 2), rad, chain order; turns count

    Returns
    -------
    The motion; its tool turns about the path's pivots.
    """
    tips = toolpath.tips(tool_axes(machine, rotary))
    positions = linear_positions(machine, tips, rotary)
    return Motion(
        letters=machine.letters,
        positions=positions,
        feed=toolpath.feed,
        time=block_times(toolpath, machine, positions),
        kind=toolpath.kind,
        source=toolpath.source,
    )
