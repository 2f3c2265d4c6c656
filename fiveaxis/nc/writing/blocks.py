"""A motion's moves as blocks, thousands at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, ToolpathError
from fiveaxis.model import STANDSTILL, Machine, Motion, turns_on_the_spot
from fiveaxis.nc.words import feed_text
from fiveaxis.nc.writing.feeds import (
    feed_form,
    feeds_of,
    note_floor,
    note_rounding,
    path_feeds,
    raised_feeds,
    require_range,
    stated_rows,
    without_creep,
)
from fiveaxis.nc.writing.turns import Moves, Words, count_turns, modulo_templates, shortened, split_moves
from fiveaxis.nc.writing.word_writer import WordWriter

# s: shorter durations count as 0; no control reads their inverse time.
SHORTEST = 1e-9

# rad: chords of this angle are within 0.1 mm of the tip's circle, half a metre from the axis.
PART_OF_TURN = np.radians(2.0)

# The word of the feed in the template of a move.
_FEED_WORD = re.compile(r"\s?[^\s{}]*\{feed\}[^\s{}]*")


def block_lines(
    motion: Motion, writer: WordWriter, winding: str
) -> tuple[list[tuple[str, int]], int, list[Finding]]:
    """Write the blocks of all moves but the first, which belongs to the approach.

    Each line has the row of the motion at which its block ends. Returned are also the number of moves
    omitted because none of their words changes, and findings where the control deviates from the plan.
    `ToolpathError` for a move without duration, or a feed out of the control's range.
    """
    moves, dropped = _moves(motion, writer)
    if winding == "modulo":
        moves = shortened(moves, writer.machine)
    moves = without_creep(moves, writer)
    words = count_turns(moves, writer, winding)
    _require_numbers(words.values, moves, motion, writer)
    plain = writer.rounded(moves.values)
    feeds = np.ones(len(moves))
    # The first row has no move and any duration.
    times = np.append(1.0, moves.time[1:])
    of_path, at_feed = path_feeds(moves, motion, writer)
    wanted = np.where(at_feed, of_path, feeds_of(plain, times, writer))
    wanted, raised = raised_feeds(wanted, plain, writer)
    # Significant digits are applied when F is formatted.
    decimals = feed_form(writer).decimals
    feeds[1:] = wanted[1:] if decimals is None else np.round(wanted[1:], decimals)
    require_range(feeds, moves, motion, writer)
    # Beside linear words, controls that count F along X, Y and Z would see a path of length 0.
    steps = np.diff(plain, axis=0, prepend=plain[:1])
    moved = (steps[:, writer.is_linear] != 0.0).any(axis=1)
    kept = words.kept & (moved[:, None] | ~writer.is_linear)
    feeds = np.where(moves.rapid, np.nan, feeds)
    texts = _texts(words, kept, feeds, stated_rows(feeds, moves.kind, writer), writer, winding)
    lines = [(line, row) for row, text in zip(moves.row[1:].tolist(), texts, strict=True) for line in text]
    notes = note_floor(plain, raised, moves, writer) + note_rounding(wanted, feeds, moves, writer)
    return lines, dropped, notes


def moving(motion: Motion, values: Array, writer: WordWriter) -> BoolArray:
    """Mark the moves to write, (n,): those in which a word changes, but for the first, the approach.

    A move without duration, shorter than `STANDSTILL`, may still change the last decimal; it becomes part of
    the next one. Values, (n, c), are numbers of words.
    """
    words = writer.rounded(values)
    steps = np.abs(np.diff(words, axis=0, prepend=words[:1]))
    timeless = motion.time < SHORTEST
    bad = timeless & (steps > 2.0 * np.maximum(STANDSTILL, 10.0**-writer.decimals)).any(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise ToolpathError(
            f"location {row}: an axis moves by {steps[row].max():g} mm or deg in {motion.time[row]:g} s; "
            "every move needs a duration (block_times)",
            line=int(motion.source[row]),
        )
    return (steps > 0.0).any(axis=1) & ~timeless


def _moves(motion: Motion, writer: WordWriter) -> tuple[Moves, int]:
    """Select the moves to write; one below the decimals adds its duration to the next."""
    whole, owner = motion, np.arange(len(motion))
    if writer.coordinates == "tip":
        motion, owner = turned_on_the_spot(motion, writer.machine)
    values = writer.values(motion.positions)
    written = moving(motion, values, writer)
    creeps = ~written & (motion.moves != 0.0).any(axis=1)
    kept = np.append(0, np.flatnonzero(written))
    spent = np.cumsum(np.where(written | creeps, motion.time, 0.0))
    spent[0] = 0.0
    time = np.diff(spent[kept], prepend=0.0)
    # Without an addition the duration is exactly the motion's.
    alone = np.diff(np.cumsum(creeps)[kept], prepend=0) == 0
    time = np.where(alone, motion.time[kept], time)
    rows = owner[kept]
    return Moves(values[kept], time, motion.kind[kept], rows), len(whole) - len(np.unique(rows))


def turned_on_the_spot(motion: Motion, machine: Machine) -> tuple[Motion, IntArray]:
    """Divide rewinds, moves in which only a rotary axis turns, by whole turns; with each row's given one.

    The tip's position is the same after a whole turn, so TCP control would hold the tip there and make the
    linear axes follow the table. The parts' tip positions keep the linear axes at rest.
    """
    most = np.abs(motion.moves[:, machine.rotary_columns]).max(axis=1, initial=0.0)
    rewinds = turns_on_the_spot(machine, motion.moves) & (most > np.pi)
    if not rewinds.any():
        return motion, np.arange(len(motion))
    parts = np.where(rewinds, np.ceil(most / PART_OF_TURN), 1.0).astype(np.int64)
    owner, left = split_moves(parts)
    return (
        replace(
            motion,
            positions=motion.positions[owner] - left[:, None] * motion.moves[owner],
            feed=motion.feed[owner],
            time=motion.time[owner] / parts[owner],
            kind=motion.kind[owner],
            source=motion.source[owner],
        ),
        owner,
    )


def _require_numbers(values: Array, moves: Moves, motion: Motion, writer: WordWriter) -> None:
    """Raise if a number is beyond the control's range."""
    most = writer.dialect.number.most
    bad = np.abs(values) > most
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        where = int(moves.row[row])
        raise ToolpathError(
            f"location {where}: {writer.names[column]}{values[row, column]:g} is beyond {most:g}, the most "
            f"that control {writer.dialect.name!r} reads in a word; unwind the axis (winding, or a rewind)",
            line=int(motion.source[where]),
        )


def _texts(
    words: Words, kept: BoolArray, feeds: Array, stated: BoolArray, writer: WordWriter, winding: str
) -> Iterator[list[str]]:
    """Write the lines of each row but the first: its block, after that of `words.before`.

    Feeds, (m,), are NaN in rapid moves; `stated`, (m,), is whether the block states its feed.
    """
    form, numbers = feed_form(writer), writer.formats(modulo_templates(writer, winding))
    texts = [feed_text(f, form) if s else "" for f, s in zip(feeds.tolist(), stated.tolist(), strict=True)]
    linear, quick = writer.linear, writer.mode.rapid or writer.dialect.rapid
    feedless = _FEED_WORD.sub("", linear)
    rows = zip(words.values.tolist(), kept.tolist(), texts, np.isnan(feeds).tolist(), strict=True)
    for row, (values, written, feed, is_rapid) in enumerate(islice(rows, 1, None), start=1):
        template = quick if is_rapid else linear if feed else feedless
        shown = " ".join([n % v for n, v, keep in zip(numbers, values, written, strict=True) if keep])
        block = template.format(words=shown, feed=feed)
        yield [*words.before.get(row, "").splitlines(), *block.split("\n")]
