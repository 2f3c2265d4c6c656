"""Programs under TCP as motions of the axes.

Between two blocks the control moves the tip along a straight line, and the rotary axes in proportion. The
linear axes don't run straight then, so such moves are divided until straight moves of the axes keep the tip
on its line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_poses
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.nc.control.axis_track import Columns, Counting
from fiveaxis.nc.control.travel import travel_of
from fiveaxis.nc.rows import first_row
from fiveaxis.nc.source import Source
from fiveaxis.nc.words import control_values
from fiveaxis.toolpath import MoveKind, divided_rows, interpolate

# Rounds of dividing; each divides a deviation by the square of the number of parts.
MOST_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class _Divided:
    """Rows: tip (n, 3) mm, axis values (n, k) mm and rad, and the program's row that each belongs to (n,)."""

    tip: Array
    positions: Array
    row: IntArray


def axes_of_tips(columns: Columns, scale: float, source: Source) -> Columns:
    """Replace rows of the tip by rows of the axes.

    Parameters
    ----------
    columns : rows of axes, and of the tip by angles
    scale : mm of a linear feed of 1, `Modes.feed_scale`
    source : the program, for errors

    Returns
    -------
    Rows of axes, with times and feeds of cuts in s and mm/s (deg/s); moves of the tip are divided into parts
    of equal time that keep it within `PATH_TOLERANCE` of its line

    Raises
    ------
    ToolpathError
        With file and line: a posture in which the linear axes can't
        reach the tip.
    """
    machine, of_tip = columns.machine, columns.of_tip
    rows = _solve(columns, columns.positions(), np.arange(len(of_tip)), source)
    by_axes = replace(
        columns,
        values=control_values(machine, rows.positions),
        counting=np.full(len(of_tip), Counting.AXES),
    )
    moves = of_tip & np.concatenate([[False], of_tip[:-1]])
    of_tip_moves, of_axes = travel_of(columns, scale), travel_of(by_axes, scale)
    time = np.where(moves, of_tip_moves.time, of_axes.time)
    feed = np.where(moves, of_tip_moves.feed, of_axes.feed)
    cuts = columns.kinds == MoveKind.CUT
    rows = _divide(columns, rows, moves, source)
    parts = np.bincount(rows.row, minlength=len(time))
    with np.errstate(invalid="ignore"):
        time = np.where(cuts, time, columns.times) / parts
    row = rows.row
    return Columns(
        machine,
        control_values(machine, rows.positions),
        columns.lines[row],
        columns.kinds[row],
        time[row],
        np.where(cuts, feed, np.nan)[row],
        np.full(len(row), Counting.AXES),
        columns.vectors[row],
        columns.normals[row],
    )


def require_angles(columns: Columns, source: Source) -> None:
    """Raise if a row gives the tool direction: the control chooses the angles."""
    row = first_row(np.isfinite(columns.vectors[:, 0]))
    if row is not None:
        raise source.error(
            "the block gives the tool direction, and the angles that the control chooses aren't in the "
            "program; post it with rotary words",
            int(columns.lines[row]),
        )


def _solve(columns: Columns, positions: Array, row: IntArray, source: Source) -> _Divided:
    """Replace the tip's X, Y and Z, in the columns of the linear axes, by axis values."""
    machine, of_tip = columns.machine, columns.of_tip[row]
    xyz = [machine.column(c) for c in "XYZ"]
    tip, solved = positions[:, xyz].copy(), positions.copy()
    if of_tip.any():
        solved[of_tip] = linear_positions(machine, tip[of_tip], positions[of_tip][:, machine.rotary_columns])
    bad = first_row(np.any(np.isnan(solved), axis=1))
    if bad is not None:
        raise source.error(
            f"no position of the linear axes of machine {machine.name!r} puts the tip there at these angles; "
            "check the machine",
            int(columns.lines[row[bad]]),
        )
    return _Divided(tip, solved, row)


def _divide(columns: Columns, rows: _Divided, moves: BoolArray, source: Source) -> _Divided:
    """Divide moves of the tip; each part belongs to the row at the end of its move."""
    machine = columns.machine
    xyz = [machine.column(c) for c in "XYZ"]
    for _ in range(MOST_ROUNDS):
        middle, _axis = tool_poses(machine, (rows.positions[1:] + rows.positions[:-1]) / 2.0)
        off = np.linalg.norm(middle - (rows.tip[1:] + rows.tip[:-1]) / 2.0, axis=1)
        off[~moves[rows.row[1:]]] = 0.0
        # The deviation falls with the square of the number of parts.
        parts = np.maximum(np.ceil(np.sqrt(off / PATH_TOLERANCE)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        where = divided_rows(parts)
        mixed = rows.positions.copy()
        mixed[:, xyz] = rows.tip
        owner = rows.row[np.ceil(where).astype(np.int64)]
        mixed = interpolate(mixed, where)
        # Existing rows keep their values.
        whole = where == np.floor(where)
        fresh = _solve(columns, mixed, owner, source)
        kept = fresh.positions.copy()
        kept[whole] = rows.positions[where[whole].astype(np.int64)]
        rows = replace(fresh, positions=kept)
    return rows
