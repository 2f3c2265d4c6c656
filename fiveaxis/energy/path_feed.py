"""The programmed feed of a program's moves: that of the tool along its way in the workpiece.

The travel metric charges an axis for its travel at the programmed feed (form-shaping Eq. 1), and the feed is
the tool's along its path. The word F says it only where the control leads the tool: in a block with a
duration of its own (G93), and where words are the axes', F depends on how far the table turns under the tool.
So the feed is worked out from what every program says, where the axes are and when: the way of the tool's
centre over the duration of the move.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion import STANDSTILL, Motion
from fiveaxis.toolpath import MoveKind, Tool

# A block in which an axis is this near its highest speed may be a stretched one: rounding of its words.
NEAR_HIGHEST = 1e-3


def path_feed(
    machine: Machine, motion: Motion, tool: Tool | None = None, *, rounding: float = 0.0
) -> tuple[Array, BoolArray]:
    """Work out the programmed feed of every move from its way and its duration.

    As in `block_times`, a move in which the tool's centre stands still takes the number as deg/min of the
    axis that turns farthest. The number isn't known where an axis runs at its highest speed, which stretches
    a block, where nothing moves, and where a rotary axis stands and the way is no more than rounding: there
    it is that of the nearest cut before, or after, that knows its own.

    Parameters
    ----------
    machine : whose axes move
    motion : axis values and times; feeds of rapid moves stay as they are
    tool : whose centre goes along the path (a ball's; else the point of its axis at the height of the arc
        that cuts); the tip's way counts without one
    rounding : mm, a way that rounding of the words may make

    Returns
    -------
    feed : (n,), mm/s, or deg/s of a turn on the spot
    taken_over : (n,), moving rows that take it from another cut

    References
    ----------
    Hayashi et al. (2018), Eq. (1), for the metric that counts it.
    """
    tip, axis = tool_poses(machine, motion.positions)
    centre = tip + (0.0 if tool is None else tool.zone.height) * axis
    way = np.linalg.norm(np.diff(centre, axis=0, prepend=centre[:1]), axis=1)
    turn = np.degrees(np.abs(motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0))
    moved = (np.abs(motion.moves) > STANDSTILL).any(axis=1)
    travels = way > max(STANDSTILL, rounding)
    known = moved & (travels | (turn > 0.0)) & (motion.time > 0.0) & ~_stretched(machine, motion)
    known &= motion.kind != MoveKind.RAPID
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(travels, way, turn) / motion.time
    feed = np.where(known, feed, motion.feed)
    wanting = ~known & (motion.kind != MoveKind.RAPID)
    rows = np.flatnonzero(known)
    if len(rows):
        before = np.searchsorted(rows, np.flatnonzero(wanting), side="right") - 1
        feed[wanting] = feed[rows[np.maximum(before, 0)]]
    return feed, wanting & moved


def _stretched(machine: Machine, motion: Motion) -> BoolArray:
    """Find moves in which an axis runs at its highest speed, (n,)."""
    at_most = np.zeros(len(motion), dtype=bool)
    for column, axis in enumerate(machine.axes):
        if axis.max_speed is not None:
            way = np.abs(motion.moves[:, column])
            at_most |= way >= axis.max_speed * motion.time * (1.0 - NEAR_HIGHEST)
    return at_most & (motion.time > 0.0)
