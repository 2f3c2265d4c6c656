"""Spans of rows, each as long as possible, that may be one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fiveaxis.geometry import BoolArray, IntArray

# Spans are searched in parallel within sections of this many rows. Each section ends with a truncated span,
# so sections grow by the second factor while they hold fewer spans than that on average.
SECTION, LONGER = 64, 8

# Tells which spans, from first to last rows, (s,) each, may be one. A single step always may.
Fits = Callable[[IntArray, IntArray], BoolArray]


def longest_spans(count: int, fits: Fits) -> IntArray:
    """Find the rows, (m,) of 0 … `count`, at which spans end, 0 among them.

    Each span is as long as possible from its start, and no two neighbouring spans could be one.
    """
    pair, section = _next_pair(count, fits), SECTION
    kept = _spans_within(count, fits, pair, section)
    while section < count and LONGER * count > section * (len(kept) - 1):
        section *= LONGER
        kept = _spans_within(count, fits, pair, section)
    while True:
        before = len(kept)
        for parity in (0, 1):
            between = np.arange(parity + 1, len(kept) - 1, 2)
            if len(between):
                kept = np.delete(kept, between[fits(kept[between - 1], kept[between + 1])])
        if len(kept) == before:
            return kept


def _next_pair(end: int, fits: Fits) -> IntArray:
    """Find the first row from each one on at which two steps can be one, (end + 1,); else the last row."""
    first = np.arange(max(end - 1, 0))
    rows = np.full(end + 1, end)
    rows[first] = np.where(fits(first, first + 2), first, end)
    return np.asarray(np.minimum.accumulate(rows[::-1])[::-1])


def _spans_within(end: int, fits: Fits, pair: IntArray, section: int) -> IntArray:
    """Find the spans in all sections in parallel."""
    at = np.arange(0, max(end, 1), section)
    stops = np.minimum(at + section, end)
    kept = np.zeros(end + 1, dtype=bool)
    kept[at] = kept[end] = True
    while (going := at < stops).any():
        at, stops = at[going], stops[going]
        # Rows before the next pair that can be one stay one after the other.
        begins = np.minimum(pair[at], stops)
        kept |= _between_rows(at, begins, end + 1)
        kept[begins] = True
        going = begins < stops
        at, stops = begins[going], stops[going]
        at = _farthest(fits, at, stops)
        kept[at] = True
    return np.flatnonzero(kept)


def _between_rows(first: IntArray, last: IntArray, count: int) -> BoolArray:
    """Mark the rows of ranges that don't overlap, (count,), without their last rows."""
    edges = np.zeros(count + 1, dtype=np.int64)
    np.add.at(edges, first, 1)
    np.add.at(edges, last, -1)
    return np.asarray(np.cumsum(edges[:-1]) > 0)


def _farthest(fits: Fits, at: IntArray, stops: IntArray) -> IntArray:
    """Find the last row of the longest span from each row, (s,): by doubled strides, then by bisection."""
    good, bad = at + 1, stops + 1
    stride, going = 1, good < stops
    while going.any():
        some = np.flatnonzero(going)
        trial = np.minimum(good[some] + stride, stops[some])
        ok = fits(at[some], trial)
        good[some[ok]], bad[some[~ok]] = trial[ok], trial[~ok]
        going[some] = ok & (good[some] < stops[some])
        stride *= 2
    while (going := bad - good > 1).any():
        some = np.flatnonzero(going)
        trial = (good[some] + bad[some]) // 2
        ok = fits(at[some], trial)
        good[some[ok]], bad[some[~ok]] = trial[ok], trial[~ok]
    return good
