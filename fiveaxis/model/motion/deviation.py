"""Deviation of tool and tool axis from the path within blocks, by the interpolation of the control."""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model.kinematics.poses import linear_positions, tool_axes, tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.planes import AxisPlanes
from fiveaxis.model.motion.timing import STANDSTILL
from fiveaxis.model.toolpath.dividing import Band
from fiveaxis.model.toolpath.path import Toolpath

# mm: largest deviation of the pivot from its path in a block.
PATH_TOLERANCE = 0.005
# mm: the same when blocks are inserted and removed; the rest is for the rounding of the written words.
WRITTEN_TOLERANCE = 0.0045
# Shares of a block at which deviations are measured: one that changes sides is zero in the middle.
SHARES = (0.25, 0.5, 0.75)
# rad: below this total turn of the rotary axes only the middle is measured, as a deviation that changes sides
# is then below 0.2 µm with the tool half a metre from the axes.
FAR = np.radians(2.0)
# Blocks that are measured at once.
PART = 100_000
# rad: turns this close to whole ones, or to none, leave the tool where it was.
WHOLE_TURN = 1e-9


def path_deviation(
    toolpath: Toolpath, machine: Machine, rotary: Array, blocks: IntArray, *, tcp: bool = False
) -> Array:
    """Measure how far the tool's centre leaves its path under joint or TCP interpolation.

    Its path between locations is a `Band`, of a chord alone where the path has no curve. Under TCP
    interpolation the tip goes straight, and a ball's centre, ``h`` above it along the tool axis, is off by
    ``h`` times the deviation of the axis from its linear blend. A turn on the spot, by which an axis rewinds
    whole turns, has no path and no deviation.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    blocks : (m,), rows at which the measured blocks begin

    Returns
    -------
    (3, m), mm, at `SHARES`; 0 where only the middle is measured
    """
    axes = tool_axes(machine, rotary)
    tips = toolpath.tips(axes)
    positions = rotary if tcp else linear_positions(machine, tips, rotary)
    moves = positions[blocks + 1] - positions[blocks]
    off = np.zeros((len(SHARES), len(blocks)))

    def distances(some: IntArray, share: float) -> Array:
        if tcp:
            tip, axis = between(tips, some, share), tool_axes(machine, between(rotary, some, share))
        else:
            tip, axis = tool_poses(machine, between(positions, some, share))
        band = Band.of(toolpath, axes, np.asarray(some + share), axis)
        return band.distances(tip + toolpath.zone.height * axis)

    for i, share in enumerate(SHARES):
        measured = _measured(rotary, blocks, share)
        if measured.any():
            # In parts, as a path may be long.
            parts = np.array_split(blocks[measured], 1 + len(blocks) // PART)
            off[i, measured] = np.concatenate([distances(part, share) for part in parts])
    return np.where(_whole_turns(moves) if tcp else turns_on_the_spot(machine, moves), 0.0, off)


def axis_deviation(
    planes: AxisPlanes, row: Array, rotary: Array, blocks: IntArray, moves: BoolArray
) -> Array:
    """Measure how far the tool axis leaves the planes of its directions at the given rows.

    Parameters
    ----------
    row, rotary : (k,), of the filled path, in rows of the given one, and (k, 2), rad, chain order, there
    blocks : (m,), rows of the filled path at which the measured blocks begin
    moves : (n − 1,), moves of the given path whose blocks are measured

    Returns
    -------
    (3, m), rad, at `SHARES`; 0 in other moves
    """
    move = np.floor(row[blocks]).astype(np.int64)
    some = moves[move]
    off = np.zeros((len(SHARES), len(blocks)))
    for i, share in enumerate(SHARES) if some.any() else ():
        axis = tool_axes(planes.machine, between(rotary, blocks[some], share))
        off[i, some] = planes.angles(move[some], axis)
    return off


def turns_on_the_spot(machine: Machine, moves: Array) -> BoolArray:
    """Find moves, (m, k) mm and rad, that only turn rotary axes by whole turns."""
    stands = (np.abs(moves[:, machine.linear_columns]) < STANDSTILL).all(axis=1)
    return np.asarray(stands & _whole_turns(moves[:, machine.rotary_columns]))


def between(columns: Array, blocks: IntArray, share: float) -> Array:
    """Interpolate columns, (n, k), at a share of the blocks that begin at rows, (m, k)."""
    return np.asarray(columns[blocks] + share * (columns[blocks + 1] - columns[blocks]))


def _whole_turns(turn: Array) -> BoolArray:
    """Find rows of rotary moves, (m, r) rad, that are whole turns or none."""
    whole = np.abs(np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi)
    return np.asarray((whole < WHOLE_TURN).all(axis=1))


def _measured(rotary: Array, blocks: IntArray, share: float) -> BoolArray:
    """Find the blocks, (m,), in which a share is measured: the middle in all, the others in far turns."""
    turn = np.abs(rotary[blocks + 1] - rotary[blocks]).sum(axis=1)
    return np.asarray((turn > FAR) | (share == 0.5))
