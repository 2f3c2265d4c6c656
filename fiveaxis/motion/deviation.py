"""Deviation of tool and tool axis from the path within blocks, by the interpolation of the control."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion.planes import AxisPlanes
from fiveaxis.motion.timing import STANDSTILL
from fiveaxis.toolpath import Band, Toolpath

# mm: largest deviation of the pivot from its path in a block.
PATH_TOLERANCE = 0.005
# mm: the same when blocks are inserted and removed; the rest is for the rounding of the written words.
WRITTEN_TOLERANCE = 0.0045
# Shares of a block at which deviations are measured: one that changes sides is zero in the middle.
SHARES = (0.25, 0.5, 0.75)
# rad: below this total turn of the rotary axes only the middle is measured, as a deviation that changes sides
# is then below 0.2 µm with the tool half a metre from the axes.
FAR = np.radians(2.0)
# rad: turns this close to whole ones, or to none, leave the tool where it was.
WHOLE_TURN = 1e-9


def joint_deviation(toolpath: Toolpath, machine: Machine, rotary: Array, blocks: IntArray) -> Array:
    """Measure how far the tool's centre leaves its path under joint interpolation.

    Its path between locations is a `Band`, of a chord alone where the path has no curve. A turn on the spot,
    by which an axis rewinds whole turns, has no path and no deviation.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    blocks : (m,), rows at which the measured blocks begin

    Returns
    -------
    (3, m), mm, at `SHARES`; 0 where only the middle is measured
    """
    zone = toolpath.zone
    axes = tool_axes(machine, rotary)
    positions = linear_positions(machine, toolpath.tips(axes), rotary)
    off = np.zeros((len(SHARES), len(blocks)))
    for i, share in enumerate(SHARES):
        some = _measured(rotary, blocks, share)
        if some.any():
            tip, axis = tool_poses(machine, between(positions, blocks[some], share))
            band = Band.of(toolpath, axes, np.asarray(blocks[some] + share), axis)
            off[i, some] = band.distances(tip + zone.height * axis)
    spot = turns_on_the_spot(machine, positions[blocks + 1] - positions[blocks])
    return np.where(spot, 0.0, off)


def tcp_deviation(toolpath: Toolpath, machine: Machine, rotary: Array, blocks: IntArray) -> Array:
    """Measure how far the tool's centre leaves its path under TCP interpolation.

    The tip goes straight. A ball's centre lies ``h`` above it along the tool axis, so it is off by ``h``
    times the deviation of the axis from its linear blend.

    Returns
    -------
    (3, m), mm, at `SHARES`
    """
    axes = tool_axes(machine, rotary)
    tip = toolpath.tips(axes)
    off = np.zeros((len(SHARES), len(blocks)))
    for i, share in enumerate(SHARES):
        some = _measured(rotary, blocks, share)
        axis = tool_axes(machine, between(rotary, blocks[some], share))
        centre = between(tip, blocks[some], share) + toolpath.zone.height * axis
        off[i, some] = Band.of(toolpath, axes, np.asarray(blocks[some] + share), axis).distances(centre)
    return np.where(_whole_turns(rotary[blocks + 1] - rotary[blocks]), 0.0, off)


def axis_deviation(
    planes: AxisPlanes, row: Array, rotary: Array, blocks: IntArray, moves: BoolArray
) -> Array:
    """Measure how far the tool axis leaves the planes of its directions at the given rows.

    Parameters
    ----------
    row : (k,), of the filled path, in rows of the given one
    rotary : (k, 2), rad, chain order, there
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
