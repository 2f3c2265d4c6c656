"""The check of durations: whether moves take as long as the path's feed asks for."""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, BoolArray, Gap, IntArray, Severity, risk
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.following import NEXT, Match, passed_numbers, step_lengths
from fiveaxis.check.verification.report import Result, left_out
from fiveaxis.model import MoveKind, interpolate

# Allowed relative difference of a block's duration, and of the whole, from what the path's feed asks for.
BLOCK, WHOLE = 0.1, 0.03
# mm, s: smaller differences of a block are rounding: of its ends, and of its duration.
ENDS, MOMENT = 0.04, 2e-3
# mm: by which rounding of words changes a move.
WORDS = 2e-3
# mm: shorter moves only turn.
STANDSTILL = 1e-6


def check_feeds(context: CheckContext) -> Result:
    """Check the durations of a motion whose rows are the locations of its path.

    A cut may take longer than its length at the path's feed only where an axis is at its highest speed.
    """
    path, time = context.toolpath, context.motion.time
    length = path.lengths
    if path.zone.offset:
        # In a link a pivot beside the tool's axis touches nothing.
        length = np.where(path.kind == MoveKind.LINK, step_lengths(context.centre), length)
    low = feed_durations(length, path.feed, context, context.positions)
    high = np.maximum(low, axis_durations(context, context.positions))
    rows = 1 + np.flatnonzero(~path.rapid[1:])
    return _compare(rows, time[rows], low[rows], high[rows], path.feed[rows])


def check_feeds_along(context: CheckContext, match: Match, *, knows_axes: bool = True) -> Result:
    """Check the durations of a program whose rows aren't the locations of its path; `match` has those.

    Controls count F along the tip, others' paths along the tool's centre, and ours along the pivot: anything
    between them is as asked for. Where the program doesn't state the rotary angles, a block may take twice as
    long, as axes that the control chooses may be at their highest speed.
    """
    path, row = match.path, match.passed
    place = match.place[row]
    positions = interpolate(context.positions, place)
    if path.feed_is_assumed:
        return left_out("feed-differs", {"feed_off_share": None}, Gap("feed: the path states none"))
    if len(row) < 2:
        return left_out(
            "feed-differs", {"feed_off_share": None}, risk("feed: the program doesn't pass the path")
        )
    along, feed, time = np.cumsum(path.lengths)[row], path.feed[row], context.motion.time
    at_feed = feed_durations(np.diff(along, prepend=along[:1]), feed, context, positions)
    limited = np.maximum(at_feed, axis_durations(context, positions))
    ends = np.arange(len(time), dtype=float)
    number = passed_numbers(context, match)
    every = np.arange(len(row), dtype=float)
    low, high = (np.diff(np.interp(number, every, np.cumsum(s)), prepend=0.0) for s in (at_feed, limited))
    last = np.ceil(number - NEXT).astype(np.int64)
    first = np.floor(np.append(0.0, number[:-1]) + NEXT).astype(np.int64)
    # Rows that lie on the path wholly, and at feed: in cuts and links.
    others = np.cumsum(path.rapid[row])
    inside = (ends - 1.0 >= place[0] - NEXT) & (ends <= place[-1] + NEXT) & (last > first)
    inside &= (others[last] == others[first]) & ~context.toolpath.rapid
    # A rewind within a cut is a link of the program alone, and the path asks nothing of it.
    inside &= context.toolpath.cutting | ~path.cutting[row][last]
    by_tip, by_centre = step_lengths(context.tip) / feed[last], step_lengths(context.centre) / feed[last]
    by_axes = axis_durations(context, context.positions)
    if path.zone.offset:
        # In a link no normal tells where a pivot beside the tool's axis is: F counts along the tool itself.
        # Where a cut begins at one, nothing is known.
        links = ~path.cutting[row][last]
        points = context.tip, context.centre
        own = [feed_durations(step_lengths(p), feed[last], context, context.positions) for p in points]
        low, high = np.where(links, np.minimum(*own), low), np.where(links, np.maximum(*own), high)
        inside &= links | path.cutting[row][first]
    low, high = np.min([low, by_tip, by_centre], axis=0), np.max([high, by_tip, by_centre, by_axes], axis=0)
    rows = np.flatnonzero(inside)
    high = high if knows_axes else 2.0 * high
    return _compare(rows, time[rows], low[rows], high[rows], feed[last][rows])


def check_cutter_speed(context: CheckContext, known: BoolArray) -> Result:
    """Tell by how much centre and contact of the tool go faster along the part than F says.

    F is the speed of one point, or of the axes; a tool that turns, or follows a hollow, moves others faster.
    `known`, (n,), is whether the motion's feed is what F says.
    """
    path, programmed = context.toolpath, context.motion.feed * context.motion.time
    points = {"tool's centre": context.centre, "contact": path.contact}
    steps = np.nan_to_num([step_lengths(point) for point in points.values()])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = steps.max(axis=0) / programmed - 1.0
    # Where the tip stands F counts degrees.
    cuts = context.cutting & known & (step_lengths(context.tip) > STANDSTILL) & (programmed > 0.0)
    fast = np.flatnonzero(cuts & (share > BLOCK) & (steps.max(axis=0) > programmed * (1.0 + BLOCK) + WORDS))
    worst = fast[np.argmax(share[fast])][None] if len(fast) else fast

    def message(_: int) -> str:
        row = worst[0]
        name, feed = list(points)[int(np.argmax(steps[:, row]))], 60.0 * context.motion.feed[row]
        return (
            f"the {name} moves at {feed * (1.0 + share[row]):.4g} mm/min along the part, "
            f"{share[row]:.0%} above F ({feed:.4g} mm/min), which it exceeds by more than {BLOCK:.0%} in "
            f"{len(fast)} of {cuts.sum()} moves; lower F if the cutter can't bear it"
        )

    return Result("cutter-speed", worst, message, values=share[worst], severity=Severity.NOTE)


def check_stated_feeds(context: CheckContext, match: Match) -> Result:
    """Check the feeds that a table or a list of locations states for the cuts of its path."""
    path, place, known = match.path, match.place, match.passed
    rows = np.flatnonzero(context.toolpath.kind == MoveKind.CUT)
    # Each row is on the move to the location that it passes next.
    number = np.searchsorted(place[known], rows - NEXT)
    rows, location = rows[number < len(known)], known[number[number < len(known)]]
    rows, location = rows[path.cutting[location]], location[path.cutting[location]]
    stated, wanted = context.motion.feed[rows], path.feed[location]
    bad = np.flatnonzero(np.abs(stated / wanted - 1.0) > BLOCK)
    return Result(
        code="feed-differs",
        rows=rows[bad],
        values=60.0 * np.abs(stated - wanted)[bad],
        message=lambda i: (
            f"the feed stated here is {60.0 * stated[bad[i]]:.6g} mm/min, but the path asks for "
            f"{60.0 * wanted[bad[i]]:.6g} mm/min; compute the motion again"
        ),
        checked=("stated feeds: those of the path",),
    )


def feed_durations(length: Array, feed: Array, context: CheckContext, positions: Array) -> Array:
    """Compute the duration of each move at the path's feed, (m,) s; one that only turns counts degrees."""
    moves = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))[:, context.machine.rotary_columns]
    turn = np.degrees(moves.max(axis=1, initial=0.0))
    return np.asarray(np.where(length > STANDSTILL, length, turn) / feed)


def axis_durations(context: CheckContext, positions: Array) -> Array:
    """Compute the duration of each move with the slowest axis at its highest speed, (n,) s."""
    moves = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))
    speeds = [np.inf if axis.max_speed is None else axis.max_speed for axis in context.machine.axes]
    return np.asarray((moves / np.array(speeds)).max(axis=1, initial=0.0))


def _compare(rows: IntArray, found: Array, low: Array, high: Array, feed: Array) -> Result:
    """Compare durations of rows, (m,) s, with the shortest and the longest that are as asked for."""
    # A duration that isn't a number, or is negative, is a finding of its own (`check_finite`).
    valid = np.isfinite(found) & (found >= 0.0)
    rows, found, low, high, feed = rows[valid], found[valid], low[valid], high[valid], feed[valid]
    spare = MOMENT + ENDS / feed
    short = found < low * (1.0 - BLOCK) - spare
    long = found > high * (1.0 + BLOCK) + spare
    off = np.maximum(low - found, found - high)
    bad = np.flatnonzero(short | long)
    total, least, most = float(found.sum()), float(low.sum()), float(high.sum())
    whole = total < least * (1.0 - WHOLE) or total > most * (1.0 + WHOLE)
    if whole and not len(bad) and len(rows):
        bad = np.array([int(np.argmax(off))])

    def message(i: int) -> str:
        k = bad[i]
        wanted = low[k] if found[k] < low[k] else high[k]
        share = f"{total:.4g} s in all cuts and links, instead of {least if total < least else most:.4g} s"
        return (
            f"the move takes {found[k]:.4g} s, but the path's feed asks for {wanted:.4g} s ({share}); "
            "correct F, its unit or its mode (G93, G94, G95)"
        )

    return Result(
        code="feed-differs",
        rows=rows[bad],
        values=np.nan_to_num(off[bad]),
        message=message,
        figures={"feed_off_share": max(0.0, 1.0 - total / least, total / most - 1.0) if least else None},
        checked=(
            f"feed: every cut and link takes as long as the path's feed asks for within {100 * BLOCK:g} %, "
            f"all of them within {100 * WHOLE:g} %, longer only where an axis is at its highest speed",
        ),
    )
