"""Programs of the tool's tip as motions of the axes: what a control with tool centre point control does.

Between two blocks the control leads the tip along a straight way while the rotary axes turn in proportion to
it. The linear axes then don't run straight, so such moves are cut into parts until axes that do run straight
keep the tip on its way.
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

# Rounds of measuring and cutting; each divides a deviation by the square of the parts.
MOST_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class _Places:
    """Rows: tip (n, 3) mm, axis values (n, k) mm and rad, and the program's row that each is part of (n,)."""

    tip: Array
    positions: Array
    row: IntArray


def axes_of_tips(columns: Columns, scale: float, source: Source) -> Columns:
    """Replace rows of the tip by rows of the axes that lead it there.

    Parameters
    ----------
    columns : rows of axes and of the tip
    scale : mm that a linear feed of 1 means, `Modes.feed_scale`
    source : the program, for errors

    Returns
    -------
    Rows of axes, with the times and feeds of cuts in s and mm/s (deg/s), whatever the program's unit; moves
    of the tip are in as many parts of equal time as keep it within `PATH_TOLERANCE` of its straight way

    Raises
    ------
    ToolpathError
        With file and line: a tool direction in place of angles; a posture in which the linear axes don't
        reach the tip.
    """
    _require_angles(columns, source)
    machine, of_tip = columns.machine, columns.of_tip
    places = _solve(columns, columns.positions(), np.arange(len(of_tip)), source)
    by_axes = replace(
        columns,
        values=control_values(machine, places.positions),
        counting=np.full(len(of_tip), Counting.AXES),
    )
    moves = of_tip & np.concatenate([[False], of_tip[:-1]])
    ways, axis_ways = travel_of(columns, scale), travel_of(by_axes, scale)
    time = np.where(moves, ways.time, axis_ways.time)
    feed = np.where(moves, ways.feed, axis_ways.feed)
    cuts = columns.kinds == MoveKind.CUT
    places = _cut_up(columns, places, moves, source)
    parts = np.bincount(places.row, minlength=len(time))
    with np.errstate(invalid="ignore"):
        time = np.where(cuts, time, columns.times) / parts
    row = places.row
    return Columns(
        machine,
        control_values(machine, places.positions),
        columns.lines[row],
        columns.kinds[row],
        time[row],
        np.where(cuts, feed, np.nan)[row],
        np.full(len(row), Counting.AXES),
        columns.vectors[row],
        columns.normals[row],
    )


def _require_angles(columns: Columns, source: Source) -> None:
    row = first_row(np.isfinite(columns.vectors[:, 0]))
    if row is not None:
        raise source.error(
            "the block gives the tool's direction, and which angles the control takes for it isn't in the "
            "program; post it with rotary words",
            int(columns.lines[row]),
        )


def _solve(columns: Columns, positions: Array, row: IntArray, source: Source) -> _Places:
    """Put axis values in place of the tip's X, Y and Z, which stand in the columns of the linear axes."""
    machine, of_tip = columns.machine, columns.of_tip[row]
    xyz = [machine.column(c) for c in "XYZ"]
    tip, solved = positions[:, xyz].copy(), positions.copy()
    if of_tip.any():
        solved[of_tip] = linear_positions(machine, tip[of_tip], positions[of_tip][:, machine.rotary_columns])
    bad = first_row(np.any(np.isnan(solved), axis=1))
    if bad is not None:
        raise source.error(
            f"no position of the linear axes of machine {machine.name!r} leads the tip there at these "
            "angles; check the machine",
            int(columns.lines[row[bad]]),
        )
    return _Places(tip, solved, row)


def _cut_up(columns: Columns, places: _Places, moves: BoolArray, source: Source) -> _Places:
    """Cut moves of the tip into parts; each part belongs to the row at the end of its move."""
    machine = columns.machine
    xyz = [machine.column(c) for c in "XYZ"]
    for _ in range(MOST_ROUNDS):
        middle, _axis = tool_poses(machine, (places.positions[1:] + places.positions[:-1]) / 2.0)
        off = np.linalg.norm(middle - (places.tip[1:] + places.tip[:-1]) / 2.0, axis=1)
        off[~moves[places.row[1:]]] = 0.0
        # A parabola's height falls with the square of the parts that its chord is cut into.
        parts = np.maximum(np.ceil(np.sqrt(off / PATH_TOLERANCE)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        where = divided_rows(parts)
        mixed = places.positions.copy()
        mixed[:, xyz] = places.tip
        owner = places.row[np.ceil(where).astype(np.int64)]
        mixed = interpolate(mixed, where)
        # Rows of axes aren't cut, and keep their own values.
        whole = where == np.floor(where)
        fresh = _solve(columns, mixed, owner, source)
        kept = fresh.positions.copy()
        kept[whole] = places.positions[where[whole].astype(np.int64)]
        places = replace(fresh, positions=kept)
    return places
