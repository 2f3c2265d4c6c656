"""The programmed feed of a program's moves: that of the tool along its path in the workpiece.

The travel metric charges an axis for its travel at the programmed feed (form-shaping Eq. 1), and the feed is
the tool's along its path. The word F states it only with TCP interpolation: with inverse-time feed (G93) or
with axis words, F depends on how far the table turns under the tool. The feed is therefore computed from the
axis values and times that every program has: the path length of the tool's centre over the move's duration.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, BoolArray
from fiveaxis.model.kinematics.poses import tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.timing import STANDSTILL, axis_times
from fiveaxis.model.toolpath.tool import Tool

# A block in which an axis comes this near its highest speed counts as stretched: its words are rounded.
NEAR_HIGHEST = 1e-3


def path_feed(
    machine: Machine, motion: Motion, tool: Tool | None = None, *, rounding: float = 0.0
) -> tuple[Array, BoolArray]:
    """Compute the programmed feed of every move from its path length and duration.

    As in `block_times`, the feed of a move in which the tool's centre stands still is in deg/min of the axis
    that turns farthest. Three kinds of moves don't show their feed: one in which an axis runs at its highest
    speed, which stretches the block; one in which nothing moves; one in which no rotary axis turns and the
    path is no longer than rounding. These take the feed of the last cut before them that shows its own, or
    else of the first after them.

    Parameters
    ----------
    motion : axis values and times; feeds of rapid moves stay as they are
    tool : its centre follows the path (of a ball end; otherwise the point of its axis at the height of the
        cutting arc); without a tool, its tip does
    rounding : mm, path length that rounding of the words may cause

    Returns
    -------
    feed : (n,), mm/s, or deg/s of a turn on the spot
    taken_over : (n,), moving rows that take the feed of another cut
    """
    length = path_lengths(machine, motion, 0.0 if tool is None else tool.zone.height)
    turn = np.degrees(np.abs(motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0))
    moved = (np.abs(motion.moves) > STANDSTILL).any(axis=1)
    travels = length > max(STANDSTILL, rounding)
    stretched = axis_times(machine, motion.moves) >= motion.time * (1.0 - NEAR_HIGHEST)
    known = moved & (travels | (turn > 0.0)) & (motion.time > 0.0) & ~stretched & ~motion.rapid
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(travels, length, turn) / motion.time
    feed = np.where(known, feed, motion.feed)
    wanting = ~known & ~motion.rapid
    rows = np.flatnonzero(known)
    if len(rows):
        before = np.searchsorted(rows, np.flatnonzero(wanting), side="right") - 1
        feed[wanting] = feed[rows[np.maximum(before, 0)]]
    return feed, wanting & moved


def path_lengths(machine: Machine, motion: Motion, height: float) -> Array:
    """Measure how far a point of the tool's axis, `height` mm above the tip, moves in each block, (n,) mm."""
    tip, axis = tool_poses(machine, motion.positions)
    centre = tip + height * axis
    return np.asarray(np.linalg.norm(np.diff(centre, axis=0, prepend=centre[:1]), axis=1))
