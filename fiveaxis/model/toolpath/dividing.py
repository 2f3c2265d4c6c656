"""Inserting locations into a path, and spans of rows, each as long as possible, that may be one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, ToolpathError, angle_between, normalise
from fiveaxis.model.toolpath.cutter import across
from fiveaxis.model.toolpath.path import Toolpath

# Spans are searched in parallel within sections of this many rows. Each section ends with a truncated span,
# so sections grow by the second factor while they hold fewer spans than that on average.
SECTION, LONGER = 64, 8

# Tells which spans, from first to last rows, (s,) each, may be one. A single step always may.
Fits = Callable[[IntArray, IntArray], BoolArray]
# Of one move: a table that turns a hundred times, to micrometres at its rim, takes a quarter of it.
MOST_PARTS = 200_000
# Of all moves: their rows take a gigabyte or two.
MOST_IN_ALL = 10_000_000
# mm: a length that is none.
TINY = 1e-12
# rad: an angle whose arc is its chord; from opposite directions, between which no way is the shortest.
SMALL, OPPOSITE = 1e-6, 1e-9


def divide(toolpath: Toolpath, parts: IntArray) -> Toolpath:
    """Divide every move into equal parts, (n − 1,), at least 1, with locations as `through` inserts them."""
    return through(toolpath, divided_rows(parts))


def through(toolpath: Toolpath, row: Array, along: Array | None = None) -> Toolpath:
    """Sample a path at fractional rows, (m,) increasing: 3.25 lies between locations 3 and 4.

    The pivot of an inserted location lies on the path's curve (`Toolpath.curve`), or on the straight line
    between points `along`, (n, 3) mm, of the tool axis; its contact, normal and tool axis are unknown. Kind,
    feed and source are those of the end of the divided move.
    """
    owner = np.ceil(row).astype(np.int64)
    path = toolpath.at(owner)
    given = (row == owner)[:, None]
    unknown = np.where(given, 0.0, np.nan)
    curve, between = None, interpolate(toolpath.pivot if along is None else along, row)
    if along is None and toolpath.curve is not None:
        between, curve = toolpath.curve.refined(toolpath.pivot, row)
    return replace(
        path,
        pivot=np.where(given, path.pivot, between),
        contact=path.contact + unknown,
        normal=path.normal + unknown,
        axis=path.axis + unknown,
        rotary=None if path.rotary is None else path.rotary + unknown,
        shape=path.shape if along is None else "chord",
        given=given[:, 0] & ~path.inserted,
        inserted_on=curve,
    )


def refined(toolpath: Toolpath, row: Array) -> Toolpath:
    """Insert full cutter locations between those of a path, at fractional rows, its own among them.

    As `through`, but surface normals and programmed axes turn evenly from one given location to the next, so
    the tool touches in between with the same zone of its profile. The contact follows from pivot and normal.
    Findings on an inserted location have the number of the next given one.
    """
    path = through(toolpath, row)
    cut = path.cutting[:, None]
    # Off a contact, and back to one, a link keeps the normal.
    normal = np.where(cut, _turned_or_nearest(toolpath.normal, row), turned(toolpath.normal, row))
    axis = _turned_or_nearest(toolpath.axis, row)
    touching = np.where(np.isfinite(path.contact), path.contact, path.pivot - path.zone.radius * normal)
    contact = np.where(np.isfinite(_nearest(toolpath.contact, row)), touching, path.contact)
    numbers = toolpath.numbered[np.ceil(row).astype(np.int64)]
    return replace(path, contact=contact, normal=normal, axis=axis, numbers=numbers)


def filled(toolpath: Toolpath, row: Array, axes: Array) -> Toolpath:
    """Insert cutter locations that follow from those of a path and their tool axes, (n, 3).

    As `through`, but with surface normals where `Band` tells them, and elsewhere with the point of the tool
    axis at the height of the touching arc in place of the pivot.
    """
    path = through(toolpath, row)
    if not toolpath.zone.offset:
        return path
    normal = turned(toolpath.normal, row)
    known = np.isfinite(normal).all(axis=1, keepdims=True)
    straight = through(toolpath, row, toolpath.centres(axes)).pivot
    return replace(path, pivot=np.where(known, path.pivot, straight), normal=normal)


@dataclass(frozen=True, eq=False)
class Band:
    """Where the tool's centre may be at m places of a path: between the curve and the chord.

    The centre is the point of the tool axis at the height of the touching arc. The pivot goes along the curve
    (or chord) from one location to the next while the surface normal turns evenly. Beside a location without
    a normal the centre of a cutter whose pivot is off its axis goes straight.

    Parameters
    ----------
    curve : (m, 3), mm, on the curve
    chord : (m, 3), mm, from there to the chord between the given locations; zero where there is no curve
    """

    curve: Array
    chord: Array

    @classmethod
    def of(cls, toolpath: Toolpath, axes: Array, row: Array, axis: Array) -> Band:
        """Compute the band at fractional rows, (m,), and tool axes there, (m, 3); `axes` are at locations."""
        if toolpath.curve is None:
            pivot, chord = interpolate(toolpath.pivot, row), np.zeros((len(row), 3))
        else:
            pivot, chord = toolpath.curve.between(toolpath.pivot, row)
        offset = toolpath.zone.offset
        if not offset:
            return cls(pivot, chord)
        normal = turned(toolpath.normal, row)
        known = np.isfinite(normal).all(axis=1, keepdims=True)
        straight = interpolate(toolpath.centres(axes), row)
        return cls(
            np.where(known, pivot + offset * across(normal, axis), straight), np.where(known, chord, 0.0)
        )

    def distances(self, centre: Array) -> Array:
        """Measure how far points, (m, 3) mm, are from the band; (m,) mm."""
        return np.linalg.norm(self.asides(centre), axis=1)

    def asides(self, centre: Array) -> Array:
        """Return the vectors from the nearest points of the band to points, (m, 3) mm."""
        aside = centre - self.curve
        square = np.sum(self.chord**2, axis=1)
        share = np.sum(aside * self.chord, axis=1) / np.where(square > 0.0, square, 1.0)
        return np.asarray(aside - np.clip(share, 0.0, 1.0)[:, None] * self.chord)


def knots(toolpath: Toolpath, apart: float, tilted: float, most: int) -> IntArray:
    """Select locations, (m,), between which the path is nearly straight and its directions turn evenly.

    Both ends of the path and of every link, and each change of feed are among them.

    Parameters
    ----------
    apart : mm, of a location that is left out from the chord between those beside it
    tilted : of its normal and its tool axis from what lies between theirs there, ends of unit vectors
    most : moves from one to the next
    """
    run, single = np.cumsum(toolpath.lengths), ~toolpath.cutting
    single[:-1] |= single[1:] | (np.diff(toolpath.feed) != 0.0)
    alone = np.cumsum(single)
    columns = (toolpath.pivot, apart), (toolpath.normal, tilted), (toolpath.axis, tilted)

    def fits(first: IntArray, last: IntArray) -> BoolArray:
        ok = (alone[last - 1] == alone[first]) & (last - first <= most)
        at = np.flatnonzero(ok)
        first, last = first[at], last[at]
        inside = last - first - 1
        span = np.repeat(np.arange(len(at)), inside)
        row = first[span] + 1 + np.arange(len(span)) - (np.cumsum(inside) - inside)[span]
        begin, end = first[span], last[span]
        share = ((run[row] - run[begin]) / np.maximum(run[end] - run[begin], TINY))[:, None]
        off = np.zeros(len(row), dtype=bool)
        for column, tolerance in columns:
            aside = column[begin] + share * (column[end] - column[begin]) - column[row]
            off |= np.einsum("ni,ni->n", aside, aside) > tolerance**2
        ok[at[span[off]]] = False
        return ok

    return longest_spans(len(toolpath) - 1, fits)


def turned(direction: Array, row: Array) -> Array:
    """Turn directions, (n, 3), evenly at fractional rows; NaN beside an unknown one and between opposites."""
    before = np.floor(row).astype(np.int64)
    first, last, share = direction[before], direction[np.ceil(row).astype(np.int64)], row - before
    return np.where((share == 0.0)[:, None], first, normalise(blended(first, last, share)))


def blended(first: Array, last: Array, share: Array) -> Array:
    """Turn unit vectors, (m, 3), towards others by a share, (m,), of the angle between them (Shoemake 1985).

    ``(sin((1 − s)θ) a + sin(sθ) b) / sin θ``; NaN between opposite ones.
    """
    angle = angle_between(first, last)
    # By the sines of the parts of the angle, and by the parts where it is too small for that.
    small = angle < SMALL
    parts = np.stack([1.0 - share, share])
    weights = np.where(small, parts, np.sin(parts * angle) / np.where(small, 1.0, np.sin(angle)))
    blend = weights[0, :, None] * first + weights[1, :, None] * last
    blend[angle > np.pi - OPPOSITE] = np.nan
    return np.asarray(blend)


def _turned_or_nearest(direction: Array, row: Array) -> Array:
    """Interpolate directions; beside an unknown one take that of the other end."""
    return np.where(np.isnan(found := turned(direction, row)), _nearest(direction, row), found)


def _nearest(columns: Array, row: Array) -> Array:
    """Take the values at the next rows; beside an unknown one those at the rows before."""
    after, before = (columns[end(row).astype(np.int64)] for end in (np.ceil, np.floor))
    return np.where(np.isnan(after), before, after)


def divided_rows(parts: IntArray) -> Array:
    """Return the fractional row in the undivided path of each location of a divided one."""
    row, share = part_places(parts)
    return np.append(row + share, float(len(parts)))


def part_places(parts: IntArray) -> tuple[IntArray, Array]:
    """Return for each part its row, (m,), and the share of the row at which it begins, (m,), in [0, 1).

    `ToolpathError` for a row of more than `MOST_PARTS` parts, or more than `MOST_IN_ALL` beside one for every
    row: no machine turns hundreds of times in one block.
    """
    total = int(parts.sum())
    if parts.max(initial=0) > MOST_PARTS or total > MOST_IN_ALL + len(parts):
        raise ToolpathError(
            f"moves turn so far, or are so long, that they would be divided into {total} parts, the worst, "
            f"move {int(np.argmax(parts)) + 1}, into {parts.max()} (at most {MOST_PARTS} each, {MOST_IN_ALL} "
            "in all); check their axis values"
        )
    row = np.repeat(np.arange(len(parts)), parts)
    order = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    return row, order / parts[row]


def interpolate(columns: Array, row: Array) -> Array:
    """Interpolate columns, (n, k), linearly at fractional rows, (m,); (m, k)."""
    every = np.arange(len(columns))
    return np.stack([np.interp(row, every, column) for column in columns.T], axis=1)


def longest_spans(count: int, fits: Fits) -> IntArray:
    """Find the rows, (m,) of 0 … `count`, at which spans end, 0 among them.

    Each span is as long as possible from its start, and no two neighbouring spans could be one.
    """
    section = SECTION
    kept = _spans_within(count, fits, section)
    while section < count and LONGER * count > section * (len(kept) - 1):
        section *= LONGER
        kept = _spans_within(count, fits, section)
    while True:
        before = len(kept)
        for parity in (0, 1):
            between = np.arange(parity + 1, len(kept) - 1, 2)
            if len(between):
                kept = np.delete(kept, between[fits(kept[between - 1], kept[between + 1])])
        if len(kept) == before:
            return kept


def _spans_within(end: int, fits: Fits, section: int) -> IntArray:
    """Find the spans in all sections in parallel."""
    at = np.arange(0, max(end, 1), section)
    stops = np.minimum(at + section, end)
    kept = np.zeros(end + 1, dtype=bool)
    kept[at] = kept[end] = True
    while (going := at < stops).any():
        at, stops = at[going], stops[going]
        at = _farthest(fits, at, stops)
        kept[at] = True
    return np.flatnonzero(kept)


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
