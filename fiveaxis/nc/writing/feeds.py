"""F of every block: the inverse of its duration, or the speed along its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.motion import Motion
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.writing.numbers import feed_text
from fiveaxis.nc.writing.places import Wording
from fiveaxis.nc.writing.table_parts import Feed, FeedMode
from fiveaxis.nc.writing.turns import Moves

# Steps of the last decimal of the linear words: a way as short is rounding beside a turn of the rotary axes,
# and a feed along it would be no number that means anything.
ROUNDING = 2.0

SECONDS = 60.0

# Of F: a rounding to the control's decimals that changes a block's duration by more is said.
COARSE = 0.01

_REMEDY: dict[tuple[FeedMode, bool], str] = {
    ("inverse_time", True): "join short moves, or write tip positions, whose F is a speed",
    ("inverse_time", False): "cut long moves into parts",
    ("per_minute", True): "lower the feed",
    ("per_minute", False): "the tip hardly moves there; write axes, whose F is a duration, or raise the feed",
}


def without_creep(moves: Moves, wording: Wording) -> Moves:
    """Let the linear axes stand where they move by rounding beside a turn of the rotary axes.

    The words that stand are those of the last block that moves them, so that what is left out never adds up
    to more than `ROUNDING` steps of the last decimal.

    Parameters
    ----------
    moves : with numbers of words, not yet rounded
    """
    linear = wording.is_linear
    values = wording.rounded(moves.values)
    steps = np.diff(values, axis=0, prepend=values[:1])
    least = ROUNDING * 10.0 ** -float(wording.decimals[linear].max(initial=0)) * (1.0 + 1e-6)
    way = np.linalg.norm(steps[:, linear], axis=1)
    turns = (steps[:, ~linear] != 0.0).any(axis=1)
    creeping = np.flatnonzero((way > 0.0) & (way <= least) & turns)
    if len(creeping) == 0:
        return moves
    values = moves.values.copy()
    for row in creeping.tolist():
        held = values[row - 1, linear]
        if np.linalg.norm(values[row, linear] - held) <= least:
            values[row, linear] = held
    return replace(moves, values=values)


def ways(values: Array, wording: Wording) -> tuple[Array, BoolArray]:
    """Measure the way of each move that F counts along.

    Parameters
    ----------
    values : (m, c), rounded, turns counted on and on

    Returns
    -------
    way : (m,), in the unit of the words; deg where only rotary words change, or the direction
    along : (m,), whether the linear words change
    """
    steps = np.diff(values, axis=0, prepend=values[:1])
    linear = wording.is_linear
    way = np.linalg.norm(steps[:, linear], axis=1)
    if wording.coordinates == "vector":
        half = np.clip(np.linalg.norm(steps[:, ~linear], axis=1) / 2.0, 0.0, 1.0)
        turn = np.degrees(2.0 * np.arcsin(half))
    else:
        turn = np.linalg.norm(steps[:, ~linear], axis=1)
    along = way > 0.0
    return np.where(along, way, turn), along


def feeds_of(values: Array, time: Array, wording: Wording) -> Array:
    """Give F of each move, (m,), in the units of the control, not yet rounded.

    Parameters
    ----------
    values : (m, c), rounded, turns counted on and on
    time : (m,), s, above 0
    """
    if wording.mode.feed == "inverse_time":
        return SECONDS / time
    way, along = ways(values, wording)
    per_unit = 1.0 if wording.unit == "mm" else 1.0 / wording.dialect.inch_feed
    return way / time * SECONDS * np.where(along, per_unit, 1.0)


def feed_form(wording: Wording) -> Feed:
    """Give the form of F in the coordinates that are written."""
    return wording.dialect.feed[wording.mode.feed]


def rounded_feeds(feeds: Array, form: Feed) -> Array:
    """Round F as it is printed; significant digits are left to the print."""
    return feeds if form.decimals is None else np.round(feeds, form.decimals)


def raised_feeds(feeds: Array, values: Array, wording: Wording) -> tuple[Array, BoolArray]:
    """Raise F to the least that the control reads where the linear axes creep alone.

    They then get there earlier, at a speed that is nearly none all the same. Rotary axes that turn with them
    would be driven, so such blocks stay as they are, and are refused.

    Parameters
    ----------
    values : (m, c), rounded

    Returns
    -------
    feeds, (m,), and where they were raised, (m,)
    """
    least = feed_form(wording).least
    if least is None or wording.mode.feed == "inverse_time":
        return feeds, np.zeros(len(feeds), dtype=bool)
    steps = np.diff(values, axis=0, prepend=values[:1])
    raised = (feeds < least) & ~(steps[:, ~wording.is_linear] != 0.0).any(axis=1)
    return np.where(raised, least, feeds), raised


def require_range(feeds: Array, moves: Moves, motion: Motion, wording: Wording) -> None:
    """Refuse a feed that the control doesn't read.

    Parameters
    ----------
    feeds : (m,), rounded; the first row has none

    Raises
    ------
    ToolpathError
        F of a block is out of range; the message has its location.
    """
    form = feed_form(wording)
    low = form.least or 0.0
    high = np.inf if form.most is None else form.most
    bad = ((feeds[1:] < low) | (feeds[1:] > high) | (feeds[1:] <= 0.0)) & ~moves.rapid[1:]
    if not bad.any():
        return
    row = int(np.argmax(bad)) + 1
    above = feeds[row] > high
    bound = f"above the most, {high:.9g}" if above else f"below the least, {low:g}"
    where = int(moves.row[row])
    raise ToolpathError(
        f"location {where}: F{feeds[row]:g} {_unit(wording.mode.feed, wording.unit)} of a block of "
        f"{moves.time[row]:g} s is {bound}, that control {wording.dialect.name!r} reads ({int(bad.sum())} "
        f"such blocks); {_REMEDY[wording.mode.feed, above]}",
        line=int(motion.source[where]),
    )


def note_floor(values: Array, raised: BoolArray, moves: Moves, wording: Wording) -> list[Finding]:
    """Say how many blocks the control runs quicker than they were planned, because it knows no slower way.

    Parameters
    ----------
    values : (m, c), rounded
    raised : (m,), where F was raised to the least
    """
    form = feed_form(wording)
    floor = form.least_speed or form.least or 0.0
    way, along = ways(values, wording)
    speed = way[1:] * MILLIMETRES[wording.unit] / moves.time[1:] * SECONDS
    slow = raised[1:] | (along[1:] & (form.least_speed is not None) & (speed < floor))
    slow &= ~moves.rapid[1:]
    if not slow.any():
        return []
    row = int(np.argmax(slow)) + 1
    return [
        Finding(
            Severity.WARNING,
            "feed-floor",
            f"{int(slow.sum())} blocks go slower than {floor:g} mm/min along X, Y and Z (here at "
            f"{speed[row - 1]:.3g}); the control runs them at that speed, and rotary axes quicker with it",
            Place(location=int(moves.row[row])),
            float(slow.sum()),
        )
    ]


def note_rounding(wanted: Array, feeds: Array, moves: Moves, wording: Wording) -> list[Finding]:
    """Say how many blocks take another time than planned, because F has too few decimals for so slow a way.

    Parameters
    ----------
    wanted, feeds : (m,), as planned and as printed; the first row has none
    """
    error = feeds[1:] / wanted[1:] - 1.0
    coarse = (np.abs(error) > COARSE) & ~moves.rapid[1:]
    if not coarse.any():
        return []
    row = int(np.argmax(np.where(coarse, np.abs(error), 0.0))) + 1
    time, text = moves.time[row], feed_text(feeds[row], feed_form(wording))
    return [
        Finding(
            Severity.WARNING,
            "feed-rounded",
            f"{int(coarse.sum())} blocks have an F so small that its decimals change their time by more than "
            f"{100.0 * COARSE:g} % (here F{wanted[row]:.3g} is written as {text}: "
            f"{time / (1.0 + error[row - 1]):.4g} s for {time:.4g} s); {_REMEDY[wording.mode.feed, False]}",
            Place(location=int(moves.row[row])),
            float(coarse.sum()),
        )
    ]


def _unit(mode: FeedMode, unit: str) -> str:
    return "1/min" if mode == "inverse_time" else f"{unit}/min"
