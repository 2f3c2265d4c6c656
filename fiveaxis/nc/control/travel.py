"""Duration of a program's moves: feed moves by F, rapid moves by the axes' speeds."""

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
    """Moves of a program, each ending at its row; the first row has none.

    Parameters
    ----------
    steps : (n, k), mm and deg
    along : (n,), whether F is along the linear axes; else deg/min, as only rotary axes turn
    length : (n,), mm or deg
    time : (n,), s, NaN if unknown
    feed : (n,), mm/s or deg/s, NaN if unknown
    """

    steps: Array
    along: BoolArray
    length: Array
    time: Array
    feed: Array


def travel_of(columns: Columns, scale: float) -> Travel:
    """Compute the moves of a program, with times and feeds as stated.

    F is along the linear axes, or in degrees if only rotary axes turn. A linear distance of at most
    `STANDSTILL` beside a rotation is rounding.

    Parameters
    ----------
    columns : the rows
    scale : mm of a linear feed of 1, `Modes.feed_scale`
    """
    is_linear = np.array([not a.is_rotary for a in columns.machine.axes])
    # With tool directions, the angles are NaN.
    steps = np.nan_to_num(np.diff(columns.values, axis=0, prepend=columns.values[:1]))
    distance = np.linalg.norm(steps[:, is_linear], axis=1)
    turn = np.linalg.norm(steps[:, ~is_linear], axis=1)
    along = ~((distance <= STANDSTILL) & (turn > 0.0)) & (distance > 0.0)
    length = np.where(along, distance, turn)
    feed = columns.feeds * np.where(along, scale, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        time = np.where(np.isnan(columns.times), length / feed, columns.times)
        feed = np.where(np.isnan(feed), length / time, feed)
    return Travel(steps, along, length, time, feed)


def motion_times(columns: Columns, scale: float, rapid: float | None, source: Source) -> tuple[Array, Array]:
    """Compute duration and feed of each move of a motion, including rapid moves.

    Parameters
    ----------
    columns, scale : as for `travel_of`
    rapid : mm/s or deg/s, in rapid moves of axes without `max_speed`
    source : the program, for errors

    Returns
    -------
    time : (n,), s
    feed : (n,), mm/s or deg/s; in rapid moves `rapid` if given, else distance over time; in rows without a
        move the feed of the row before

    Raises
    ------
    ToolpathError
        A rapid move of an axis without a speed.
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
    """Return the time of each row's slowest axis, (n,) s."""
    axes = columns.machine.axes
    speeds = np.array(
        [(np.nan if rapid is None else rapid) if a.max_speed is None else a.shown(a.max_speed) for a in axes]
    )
    unknown = quick[:, None] & (steps != 0.0) & np.isnan(speeds)
    if unknown.any():
        row, column = np.argwhere(unknown)[0]
        raise source.error(
            f"a rapid move of {axes[column].letter}, which has no max_speed in machine "
            f"{columns.machine.name!r}; set rapid (--rapid), or max_speed in the machine file",
            int(columns.lines[row]),
        )
    return np.max(np.where(steps == 0.0, 0.0, np.abs(steps) / speeds), axis=1)


def filled(feed: Array) -> Array:
    """Fill in feeds: rows without one have that of the row before, the first ones that of the first move."""
    known = np.flatnonzero(np.isfinite(feed) & (feed > 0.0))
    if len(known) == 0:
        return feed
    last = np.searchsorted(known, np.arange(len(feed)), side="right") - 1
    return feed[known[np.maximum(last, 0)]]
