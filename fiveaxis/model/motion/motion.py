"""The motion of a machine along a path, and its digest."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, HasColumns, IntArray, ToolpathError
from fiveaxis.model.kinematics.poses import linear_positions, tool_axes, tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.timing import block_times
from fiveaxis.model.toolpath.dividing import refined
from fiveaxis.model.toolpath.operation import MoveKind, kind_names
from fiveaxis.model.toolpath.path import Toolpath

# mm: a motion whose tool passes a location of a path at a larger distance belongs to another path.
BELONGS = 0.05


@dataclass(frozen=True, eq=False)
class Motion(HasColumns):
    """Axis values along a path, one row per cutter location.

    Parameters
    ----------
    letters : axis letters, one per column
    positions : (n, k), mm and rad, tool relative to workpiece; rotary axes accumulate their turns
    feed : (n,), mm/s, programmed along the move that ends at the row
    time : (n,), s, duration of that move; 0 for the first row
    kind : (n,), `MoveKind` values
    source : (n,), line of the source
    location : (n,), of each row among the locations of the given path: 3.25 is a quarter of the move from 3
        to 4; None for one row at each location
    """

    letters: str
    positions: Array
    feed: Array
    time: Array
    kind: IntArray
    source: IntArray
    location: Array | None = None

    def __repr__(self) -> str:
        kind, seconds = type(self).__name__, float(np.sum(self.time))
        return f"<{kind}: {len(self)} rows of {' '.join(self.letters)}, {seconds:.1f} s>"

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def moves(self) -> Array:
        """(n, k), mm and rad: change of each axis in the move that ends at the row, 0 for the first."""
        return np.diff(self.positions, axis=0, prepend=self.positions[:1])

    @property
    def speeds(self) -> Array:
        """(n, k), mm/s and rad/s: mean speeds in the move that ends at the row, 0 if it takes no time."""
        timed = self.time > 0.0
        return np.where(timed[:, None], self.moves / np.where(timed, self.time, 1.0)[:, None], 0.0)

    @property
    def given(self) -> IntArray:
        """(g,), the rows at given locations; the others were inserted."""
        if self.location is None:
            return np.arange(len(self))
        return np.flatnonzero(self.location == np.floor(self.location))

    @property
    def cutting(self) -> BoolArray:
        """(n,), whether the move that ends at the row cuts."""
        return self.kind == MoveKind.CUT

    @property
    def rapid(self) -> BoolArray:
        """(n,), whether the move that ends at the row is a rapid move."""
        return self.kind == MoveKind.RAPID

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the rows by columns, (n,) each, with the numbers of ``motion.csv``.

        They are ``X_mm``, ``A_deg`` and so on by axis, ``feed_mm_min``, ``time_s``, ``line`` (of the source)
        and ``kind`` (``cut``, ``link`` or ``rapid``); of a motion with inserted rows also ``location``, which
        is fractional for these.
        """
        axes = {
            f"{c}_deg" if c in "ABC" else f"{c}_mm": np.degrees(values) if c in "ABC" else values
            for c, values in zip(self.letters, self.positions.T, strict=True)
        }
        moves = {"feed_mm_min": self.feed * 60.0, "time_s": self.time, "line": self.source}
        placed = {} if self.location is None else {"location": self.location}
        return {**axes, **moves, "kind": kind_names(self.kind), **placed}

    def at(self, rows: IntArray) -> Motion:
        """Return the motion of some rows, given by their indices in order."""
        location = None if self.location is None else self.location[rows]
        columns = ("positions", "feed", "time", "kind", "source")
        return Motion(self.letters, **{c: getattr(self, c)[rows] for c in columns}, location=location)


def located(toolpath: Toolpath, motion: Motion) -> Toolpath:
    """Refine a path to one location for each row of a motion along it, if the motion has `location`.

    `ToolpathError` if the path has another length, or the motion has no row at some of its locations.
    """
    location = motion.location
    if location is None or len(motion) == len(toolpath):
        return toolpath
    given = location[location == np.floor(location)]
    if not np.array_equal(given, np.arange(len(toolpath))):
        raise ToolpathError(
            f"has {len(toolpath)} locations, and the motion has rows at {len(given)}, the last at number "
            f"{location[-1]:g}: it is along another path",
            file=toolpath.name,
        )
    return refined(toolpath, location)


def require_along(motion: Motion, machine: Machine, toolpath: Toolpath) -> None:
    """Raise `ToolpathError` unless a motion follows a path: as many locations, and tools at them."""
    if len(motion) != len(toolpath):
        raise ToolpathError(
            f"the path has {len(toolpath)} locations and the motion {len(motion)}, so it belongs to another "
            "path; give the path that it was made for",
            file=toolpath.name,
        )
    tip, axis = tool_poses(machine, motion.positions)
    reached = toolpath.zone.pivot_of_tip(tip, toolpath.normal, axis)
    off = np.nan_to_num(np.linalg.norm(reached - toolpath.pivot, axis=1))
    row = int(np.argmax(off))
    if off[row] > BELONGS:
        raise ToolpathError(
            f"the motion has the tool {off[row]:.4g} mm from location {toolpath.numbered[row]} of this path "
            f"(at most {BELONGS:g} mm): it belongs to another path, tool, machine or work offset; give those "
            "that it was made for",
            file=toolpath.name,
            line=toolpath.place(row).line,
        )


def follow(toolpath: Toolpath, machine: Machine, rotary: Array) -> Motion:
    """Compute the motion along a path with given rotary angles; the tool turns about the path's pivots.

    The angles, (n, 2) rad, are in chain order, and their turns count.
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


def motion_digest(motion: Motion, machine: Machine) -> str:
    """Compute a digest, sha256 in hexadecimal, of the motion and machine that a verdict is about.

    It covers positions, kinds of moves and the kinematic chain with the tool's length, but no durations: the
    same motion at another speed takes the same path.
    """
    digest = hashlib.sha256(f"{motion.letters} {machine.code.text} {len(motion)}".encode())
    lines = [(*joint.line.direction, *joint.line.point) for joint in machine.chain.joints]
    for figures in (motion.positions, np.array(lines), machine.chain.tool_home):
        digest.update(_bytes(figures))
    digest.update(np.ascontiguousarray(motion.kind, dtype="<i8").tobytes())
    return digest.hexdigest()


def _bytes(figures: Array) -> bytes:
    # Adding 0 turns −0 into 0.
    return np.ascontiguousarray(np.asarray(figures, dtype="<f8") + 0.0).tobytes()
