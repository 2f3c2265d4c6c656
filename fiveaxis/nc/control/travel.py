"""How long the moves of a program take: F as the program means it, rapid moves at the axes' speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.motion import STANDSTILL
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import MoveKind


@dataclass(frozen=True, eq=False)
class Travel:
    """The moves of a program, each ending at its row; the first row has none.

    Parameters
    ----------
    steps : (n, k), mm and deg
    along : (n,), whether F counts along the linear axes; else in degrees, where only rotary axes turn
    length : (n,), mm or deg
    time : (n,), s, NaN where the program doesn't say it
    feed : (n,), mm/s or deg/s, NaN likewise
    """

    steps: Array
    along: BoolArray
    length: Array
    time: Array
    feed: Array


def travel_of(columns: Columns, scale: float) -> Travel:
    """Measure the moves of a program, with times and feeds as it states them.

    F counts along the way of the linear axes, and in degrees where only rotary axes turn. Rounding of the
    linear axes beside a turn is no way (`STANDSTILL`).

    Parameters
    ----------
    columns : the rows
    scale : mm that a linear feed of 1 means, `Modes.feed_scale`
    """
    is_linear = np.array([not a.is_rotary for a in columns.machine.axes])
    # Where the tool's direction is given, no angle is known.
    steps = np.nan_to_num(np.diff(columns.values, axis=0, prepend=columns.values[:1]))
    way = np.linalg.norm(steps[:, is_linear], axis=1)
    turn = np.linalg.norm(steps[:, ~is_linear], axis=1)
    along = ~((way <= STANDSTILL) & (turn > 0.0)) & (way > 0.0)
    length = np.where(along, way, turn)
    feed = columns.feeds * np.where(along, scale, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(np.isnan(columns.times), length / feed, columns.times)
        feed = np.where(np.isnan(feed), length / time, feed)
    return Travel(steps, along, length, time, feed)


def motion_times(columns: Columns, scale: float, rapid: float | None, source: Source) -> tuple[Array, Array]:
    """Compute duration and feed of each move of a motion, rapid moves among them.

    Parameters
    ----------
    columns, scale : as for `travel_of`
    rapid : mm/s or deg/s, of axes in rapid moves whose highest speed isn't known
    source : the program, for errors

    Returns
    -------
    time : (n,), s
    feed : (n,), mm/s or deg/s; `rapid` in rapid moves, where it is given, else what their way and time come
        to; rows without a move have that of the one before

    Raises
    ------
    ToolpathError
        A rapid move of an axis whose speed isn't known.
    """
    travel = travel_of(columns, scale)
    quick = (columns.kinds == MoveKind.RAPID) & np.isnan(columns.times)
    time = np.where(quick, _rapid_times(columns, travel.steps, quick, rapid, source), travel.time)
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(quick, travel.length / time if rapid is None else rapid, travel.feed)
    return time, filled(np.where(travel.length > 0.0, feed, np.nan))


def _rapid_times(
    columns: Columns, steps: Array, quick: BoolArray, rapid: float | None, source: Source
) -> Array:
    """Give each row the time of its slowest axis, (n,) s."""
    axes = columns.machine.axes
    speeds = np.array(
        [(np.nan if rapid is None else rapid) if a.max_speed is None else a.shown(a.max_speed) for a in axes]
    )
    unknown = quick[:, None] & (steps != 0.0) & np.isnan(speeds)
    if unknown.any():
        row, column = np.argwhere(unknown)[0]
        raise source.error(
            f"a rapid move of {axes[column].letter}, whose highest speed machine {columns.machine.name!r} "
            "doesn't tell, has no duration; give rapid_mm_min (--rapid), or max_speed in the machine file",
            int(columns.lines[row]),
        )
    return np.max(np.where(steps == 0.0, 0.0, np.abs(steps) / speeds), axis=1)


def filled(feed: Array) -> Array:
    """Give rows without feed that of the row before, and the first ones that of the first move."""
    known = np.flatnonzero(np.isfinite(feed) & (feed > 0.0))
    if len(known) == 0:
        return feed
    place = np.searchsorted(known, np.arange(len(feed)), side="right") - 1
    return feed[known[np.maximum(place, 0)]]
