"""F of every block: the inverse of its duration, or the speed along its path, which stays in force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, Place, Severity, ToolpathError, arcsin
from fiveaxis.model import Motion
from fiveaxis.nc.control.axis_track import fed_lengths
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.words import feed_text
from fiveaxis.nc.writing.table_parts import Feed, FeedMode
from fiveaxis.nc.writing.turns import Moves
from fiveaxis.nc.writing.word_writer import WordWriter

# Steps of the last decimal of the linear words: with a turn of the rotary axes, a shorter linear move is
# rounding, and a feed along it is meaningless.
ROUNDING = 2.0
# mm: where the control runs no block below some speed along X, Y and Z, whatever its duration, a shorter move
# below that speed is left out, too: beside it the rotary axes would turn many times faster than planned. This
# is a tenth of the tolerance of paths.
HELD = 5e-4

SECONDS = 60.0

# Share of a block's duration by which rounding of F may change it without a finding.
COARSE = 0.01
# A block whose duration differs by a smaller share from that at the path's feed has this feed.
AT_FEED = 1e-6

_REMEDY: dict[tuple[FeedMode, bool], str] = {
    ("inverse_time", True): "join short moves, or write tip positions, whose F is a speed",
    ("inverse_time", False): "cut long moves into parts",
    ("per_minute", True): "lower the feed",
    ("per_minute", False): "the tip hardly moves there; write axes, whose F is a duration, or raise the feed",
}


def without_creep(moves: Moves, writer: WordWriter) -> Moves:
    """Hold the linear axes where they move only by rounding while rotary axes turn.

    They keep the values of the last block that moves them, so omitted moves never add up to more than
    `ROUNDING` steps of the last decimal, or `HELD`. The numbers of words in the moves aren't rounded yet.
    """
    linear = writer.is_linear
    values = writer.rounded(moves.values)
    steps = np.diff(values, axis=0, prepend=values[:1])
    rounding = ROUNDING * 10.0 ** -float(writer.decimals[linear].max(initial=0)) * (1.0 + 1e-6)
    slowest = lowest_speed(writer) * np.append(0.0, moves.time[1:]) / SECONDS
    least = np.maximum(rounding, np.minimum(slowest, HELD / MILLIMETRES[writer.unit]))
    length = np.linalg.norm(steps[:, linear], axis=1)
    turns = (steps[:, ~linear] != 0.0).any(axis=1)
    creeping = np.flatnonzero((length > 0.0) & (length <= least) & turns)
    if len(creeping) == 0:
        return moves
    values = moves.values.copy()
    for row in creeping.tolist():
        # Beside a held row the next one may creep, too.
        while row < len(values) and turns[row]:
            way = values[row, linear] - values[row - 1, linear]
            if not 0.0 < np.linalg.norm(way, axis=-1) <= least[row]:
                break
            values[row, linear] = values[row - 1, linear]
            row += 1
    return replace(moves, values=values)


def path_lengths(values: Array, writer: WordWriter) -> tuple[Array, BoolArray]:
    """Compute the path length of each move that F refers to, (m,), in the unit of the words.

    It is deg where only rotary words or the direction change; the second value, (m,), is whether it is a
    length. Values are (m, c), rounded, turns unwrapped.
    """
    steps = np.diff(values, axis=0, prepend=values[:1])
    degree = writer.dialect.mixed_feed.degree if writer.coordinates == "axes" else 0.0
    length, along = fed_lengths(steps, np.where(writer.is_linear, 1.0, degree or 0.0), writer.is_linear)
    if writer.coordinates != "vector":
        return length, along
    half = np.clip(np.linalg.norm(steps[:, ~writer.is_linear], axis=1) / 2.0, 0.0, 1.0)
    return np.where(along, length, np.degrees(2.0 * arcsin(half))), along


def feeds_of(values: Array, time: Array, writer: WordWriter) -> Array:
    """Compute F of each move, (m,), in the units of the control, not yet rounded.

    Values are (m, c), rounded, turns unwrapped; times are (m,), s, above 0.
    """
    if writer.mode.feed == "inverse_time":
        return SECONDS / time
    length, is_linear = path_lengths(values, writer)
    per_unit = MILLIMETRES[writer.unit] / feed_millimetres(writer)
    return length / time * SECONDS * np.where(is_linear, per_unit, 1.0)


def path_feeds(moves: Moves, motion: Motion, writer: WordWriter) -> tuple[Array, BoolArray]:
    """Find the moves that take as long as at the feed of the path, which F then states exactly.

    An operator can edit it: of a block as printed, F would differ by the rounding of its words. Returned are
    the feeds of the path, (m,), in the units of the control, and which moves these are, (m,). The numbers of
    words in the moves aren't rounded yet.
    """
    feeds = motion.feed[moves.row] * SECONDS / feed_millimetres(writer)
    if writer.mode.feed == "inverse_time":
        return feeds, np.zeros(len(moves), dtype=bool)
    length, is_linear = path_lengths(moves.values, writer)
    times = np.append(1.0, moves.time[1:])
    found = feeds_of(moves.values, times, writer)
    return feeds, is_linear & (length > 0.0) & (np.abs(found / feeds - 1.0) < AT_FEED)


def stated_rows(feeds: Array, kind: IntArray, writer: WordWriter) -> BoolArray:
    """Find the moves whose blocks state F, (m,): elsewhere that of the block before stays in force.

    Every pass begins with its F, so that a program can be entered there. The inverse of a duration isn't
    modal. Feeds are (m,), as printed, NaN in rapid moves; kinds are (m,), `MoveKind` values.
    """
    stated = np.ones(len(feeds), dtype=bool)
    if writer.mode.feed != "inverse_time":
        stated[2:] = (feeds[2:] != feeds[1:-1]) | (kind[2:] != kind[1:-1])
    return stated & ~np.isnan(feeds)


def feed_form(writer: WordWriter) -> Feed:
    """Return the form of F in the chosen coordinates."""
    return writer.dialect.feed[writer.mode.feed]


def lowest_speed(writer: WordWriter) -> float:
    """Return the speed along X, Y and Z, units/min, below which the control runs no block of a duration."""
    return feed_form(writer).least_speed or 0.0


def feed_millimetres(writer: WordWriter) -> float:
    """Return mm of a linear F of 1 per minute."""
    inches = 1.0 if writer.unit == "mm" else writer.dialect.inch_feed
    return MILLIMETRES[writer.unit] * inches


def raised_feeds(feeds: Array, values: Array, writer: WordWriter) -> tuple[Array, BoolArray]:
    """Raise F to the control's lowest where the linear axes creep alone.

    The feeds, (m,), are returned with where they were raised, (m,). Blocks arrive earlier then, still at
    nearly no speed. Blocks that also turn rotary axes are unchanged, and refused, as those axes would be
    faster too. Values are (m, c), rounded.
    """
    least = feed_form(writer).least
    if least is None or writer.mode.feed == "inverse_time":
        return feeds, np.zeros(len(feeds), dtype=bool)
    steps = np.diff(values, axis=0, prepend=values[:1])
    raised = (feeds < least) & ~(steps[:, ~writer.is_linear] != 0.0).any(axis=1)
    return np.where(raised, least, feeds), raised


def require_range(feeds: Array, moves: Moves, motion: Motion, writer: WordWriter) -> None:
    """Raise if a feed, (m,) and rounded, is out of the control's range; the first row has none."""
    form = feed_form(writer)
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
        f"location {where}: F{feeds[row]:g} {_unit(writer.mode.feed, writer.unit)} of a block of "
        f"{moves.time[row]:g} s is {bound}, that control {writer.dialect.name!r} reads ({int(bad.sum())} "
        f"such blocks); {_REMEDY[writer.mode.feed, above]}",
        line=int(motion.source[where]),
    )


def note_floor(values: Array, raised: BoolArray, moves: Moves, writer: WordWriter) -> list[Finding]:
    """Return a finding on blocks slower than the control's lowest speed, which it runs faster than planned.

    Values are (m, c), rounded; `raised`, (m,), is where F was raised to the lowest.
    """
    form = feed_form(writer)
    unit = MILLIMETRES[writer.unit]
    floor = lowest_speed(writer) * unit or form.least or 0.0
    length, is_linear = path_lengths(values, writer)
    speed = length[1:] * unit / moves.time[1:] * SECONDS
    slow = raised[1:] | (is_linear[1:] & (form.least_speed is not None) & (speed < floor))
    slow &= ~moves.rapid[1:]
    if not slow.any():
        return []
    row = int(np.argmax(slow)) + 1
    return [
        Finding(
            Severity.WARNING,
            "feed-floor",
            f"{int(slow.sum())} blocks go slower than {floor:g} mm/min along X, Y and Z (here at "
            f"{speed[row - 1]:.3g}); the control runs them at that speed, and rotary axes faster too",
            Place(location=int(moves.row[row])),
            float(slow.sum()),
        )
    ]


def note_rounding(wanted: Array, feeds: Array, moves: Moves, writer: WordWriter) -> list[Finding]:
    """Return a finding on blocks whose time differs from the plan because F has too few decimals.

    The wanted feeds and those that are printed are (m,); the first row has none.
    """
    error = feeds[1:] / wanted[1:] - 1.0
    coarse = (np.abs(error) > COARSE) & ~moves.rapid[1:]
    if not coarse.any():
        return []
    row = int(np.argmax(np.where(coarse, np.abs(error), 0.0))) + 1
    time, text = moves.time[row], feed_text(feeds[row], feed_form(writer))
    return [
        Finding(
            Severity.WARNING,
            "feed-rounded",
            f"{int(coarse.sum())} blocks have an F so small that its decimals change their time by more than "
            f"{100.0 * COARSE:g} % (here F{wanted[row]:.3g} is written as {text}: "
            f"{time / (1.0 + error[row - 1]):.4g} s for {time:.4g} s); {_REMEDY[writer.mode.feed, False]}",
            Place(location=int(moves.row[row])),
            float(coarse.sum()),
        )
    ]


def _unit(mode: FeedMode, unit: str) -> str:
    return "1/min" if mode == "inverse_time" else f"{unit}/min"
