"""The check that a program follows a path: nowhere off it, and past every location of it.

A program has other rows than the path: locations inserted, blocks removed, an approach before. So rows aren't
compared one by one: the track of the tool's centre is compared with the path, in order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, risk
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.course import Course
from fiveaxis.check.verification.moves import segment_distances
from fiveaxis.check.verification.report import Result
from fiveaxis.check.verification.tool_track import Track
from fiveaxis.model import PATH_TOLERANCE, Band, MoveKind, Toolpath, across, turned

# A location is searched over the path's own length to it times DETOUR, plus SPARE mm.
DETOUR, SPARE = 2.0, 1.0
# Points of the track in the first block of a search.
FIRST_BLOCK = 64
# Pairs of a point and a chord that are measured at once.
MOST_CHORDS = 20_000
# Places on a chord at which a pivot off the tool's axis is looked for, and how often around the nearest.
PLACES, ROUNDS = 17, 5
# A point this near to the end of a block, as a share of it, is that end.
NEXT = 1e-3
# A turn of 1 rad where the tool's centre stands counts as this much of its course, mm.
TURN = 1e-3
# A program that passes none of the path's first locations, this many, follows another path.
MOST_LOST = 20


@dataclass(frozen=True, eq=False)
class Match:
    """The path that a program follows, and the program's row for each of its locations.

    Parameters
    ----------
    path : to follow
    row : (n,), of the program, the first that passes the location; −1 for none
    place : (n,), fractional row of the program: 3.25 lies in the block to row 4
    off : (m,), mm, largest distance from the path in each block of the program; NaN where it isn't compared
    """

    path: Toolpath
    row: IntArray
    place: Array
    off: Array

    @classmethod
    def planned(cls, path: Toolpath, row: IntArray) -> Match:
        """Return the match of a path whose locations were planned at rows, (n,), the last at the end."""
        return cls(path, row, row.astype(float), np.full(int(row[-1]) + 1, np.nan))

    @property
    def passed(self) -> IntArray:
        """Locations that the program passes, (m,)."""
        return np.flatnonzero(self.row >= 0)

    @property
    def ends(self) -> tuple[int, int] | None:
        """Rows of the program at its first and last passed location; None if it passes none."""
        row = self.row[self.passed]
        return (int(row[0]), int(row[-1])) if len(row) else None


def follow(
    context: CheckContext, path: Toolpath, *, tcp_height: float | None = None, by_direction: bool = False
) -> Match:
    """Follow a path with a program, whose context has the tool and the zone of the path.

    Parameters
    ----------
    tcp_height : mm above the tip, of the point that moves straight between rows under TCP; None with joint
        interpolation
    by_direction : whether the program gives directions of the tool: some controls turn it from one to the
        next in their plane, others turn the rotary axes in proportion, so that it is followed both ways
    """
    track, straight = Track.of(context, path, tcp_height=tcp_height), tcp_height is not None
    row, place, off = _follow(track, path, context.tolerances.deviation, straight=straight)
    if by_direction:
        other = Track.of(context, path, tcp_height=tcp_height, in_planes=True)
        off = np.fmax(off, _follow(other, path, context.tolerances.deviation, straight=straight)[2])
    worst = np.full(len(context.positions), np.nan)
    np.fmax.at(worst, track.row, np.where(track.linking, np.nan, off))
    return Match(path, row, place, worst)


def check_following(context: CheckContext, match: Match) -> Iterator[Result]:
    """Check that a program keeps to its path, and passes all of its locations."""
    path, tolerance, worst = match.path, context.tolerances.deviation, match.off
    rows = np.flatnonzero(worst > tolerance)
    swerves = bool(path.rapid.any() and context.toolpath.rapid.any())
    yield Result(
        code="off-path",
        rows=rows,
        values=worst[rows],
        message=lambda i: (
            f"the tool's centre is {worst[rows[i]]:.3g} mm off the path {path.name} (at most {tolerance:g} "
            "mm); compare zero, unit and this block with the path"
        ),
        figures={"off_path_mm": largest(worst)},
        checked=(f"track of the tool's centre: within {tolerance:g} mm of the path {path.name}",),
        not_checked=(
            risk("the program before the first location of the path, and its lead-out from the last one"),
            *((risk("the course of rapid moves between locations of the path"),) if swerves else ()),
        ),
    )
    missed = np.flatnonzero(match.row < 0)
    yield Result(
        code="path-missed",
        rows=missed,
        message=(
            f"the program doesn't pass within {tolerance:g} mm of this location, in order; compare zero, "
            "unit and blocks with the path"
        ),
        checked=(f"the program passes all {len(path)} locations of the path {path.name} in order",),
        path=path,
    )


def check_rapids(context: CheckContext, match: Match) -> Result:
    """Check that no rapid move lies on a cut of the path, or ends where a cut begins.

    Where the path itself has a rapid move to the begin of a cut, so may the program.
    """
    path, known = match.path, match.passed
    rapid, row = context.toolpath.rapid, _reaching(context, match)
    touches = row[path.bounding[known] & ~path.rapid[known]]
    quick = np.flatnonzero(rapid)
    number = np.searchsorted(row, quick)
    between = (number > 0) & (number < len(known))
    between[between] = path.cutting[known[number[between]]]
    rows = np.union1d(touches[rapid[touches] & (touches > 0)], quick[between])
    return Result(
        code="rapid-in-cut",
        rows=rows,
        message="a rapid move where the path cuts, or down to it; write G1 and F",
        checked=("no rapid move where the path cuts, or down to it",),
    )


def _reaching(context: CheckContext, match: Match) -> IntArray:
    """Find the blocks that reach the locations that are passed, (p,), by the program's row at which they end.

    That is the block of `Match.row`, or the next one where the location is farther beyond its end than the
    tolerance.
    """
    known = match.passed
    row = match.row[known]
    centre = context.tip + match.path.zone.height * context.axis
    length = np.append(np.linalg.norm(np.diff(centre, axis=0), axis=1), 0.0)
    beyond = (match.place[known] - row) * length[row]
    return np.asarray(row + (beyond > context.tolerances.deviation))


def cutting_rows(context: CheckContext, match: Match | None) -> IntArray:
    """Return the rows of a program that cut: those of the path, or without one all at feed."""
    rows = np.flatnonzero(context.toolpath.cutting)
    if match is None or match.ends is None:
        return rows
    known, (first, last) = match.passed, match.ends
    number = np.searchsorted(match.place[known], rows - NEXT)
    cutting = match.path.cutting[known[np.clip(number, 0, len(known) - 1)]]
    return rows[(rows >= first) & (rows <= last) & cutting]


def _follow(
    track: Track, path: Toolpath, tolerance: float, *, straight: bool
) -> tuple[IntArray, Array, Array]:
    """Follow both: find the program's point at each location, and the distance of the others from the chords.

    With joint interpolation rapid moves of both may take any course between locations. Return row and place
    of the locations, (n,), as in `Match`, and how far the track's points are off the chord between the
    locations before and after, (m,) mm: NaN before the first location, and in the lead-out from the last one.
    """
    count = len(path)
    rows, places = np.full(count, -1, dtype=np.int64), np.full(count, np.nan)
    off = np.full(len(track.row), np.nan)
    known, begin, point = _passed(track, path, tolerance, straight=straight)
    if not len(known):
        return rows, places, off
    # Where the chord to a point is nearest to the location, and which of its ends is nearer.
    before = np.maximum(point - 1, begin)
    start, end = (_aside(track, path, known, points) for points in (before, point))
    step = end - start
    square = np.sum(step * step, axis=1)
    along = np.sum(-start * step, axis=1) / np.where(square > 0.0, square, 1.0)
    share = np.where(square > 0.0, np.clip(along, 0.0, 1.0), 1.0)
    nearer = np.linalg.norm(start, axis=1) < np.linalg.norm(end, axis=1)
    rows[known] = track.row[np.where(nearer, before, point)]
    places[known] = track.place[before] + share * (track.place[point] - track.place[before])
    axes = np.full((count, 3), np.nan)
    axes[known] = track.axis[before] + share[:, None] * (track.axis[point] - track.axis[before])
    off[point[0] :] = _off(track, path, axes, known, point)
    if known[-1] == count - 1:
        # The lead-out from the path: one block, and rapid moves.
        out = np.floor(places[-1] + NEXT) + 1.0
        off[(track.place > places[-1]) & ((track.row <= out) | track.rapid)] = np.nan
    return rows, places, off


def _passed(
    track: Track, path: Toolpath, tolerance: float, *, straight: bool
) -> tuple[IntArray, IntArray, IntArray]:
    """Find the locations that the track passes in order, and at which of its points, (p,) each.

    After the locations come the point where the search begins, and that to which the chord passes it.
    """
    steps = step_lengths(track.centre)
    # Links return to where they left and make no progress along the path.
    steps[track.linking] = 0.0
    # With joint interpolation a rapid move may be a long detour.
    steps[track.rapid & (not straight)] = 0.0
    travelled = np.cumsum(np.nan_to_num(steps))
    # Beside a link the centre of a cutter whose pivot is off its axis goes from one to the other.
    lengths, spare = path.lengths, SPARE + 2.0 * abs(path.zone.offset)
    found: list[tuple[int, int, int]] = []
    at, allowed = 0, np.inf
    for i in range(len(path)):
        if not found and i >= MOST_LOST:
            break
        allowed += DETOUR * lengths[i] + spare if i else 0.0
        end = int(np.searchsorted(travelled, travelled[at] + allowed, side="right"))
        point = _pass(track, path, i, at, max(end, at + 1), tolerance)
        if point is not None:
            found.append((i, at, point))
            at, allowed = point, 0.0
    known, begin, points = np.array(found, dtype=np.int64).reshape(-1, 3).T
    return known, begin, points


def _pass(track: Track, path: Toolpath, i: int, begin: int, end: int, tolerance: float) -> int | None:
    """Find where the track, chords included, first passes a location: the nearest point."""
    first, block = begin, FIRST_BLOCK
    while first < end:
        last = min(first + block, end)
        aside = _aside(track, path, i, np.maximum(np.arange(first - 1, last), begin))
        gap = segment_distances(np.zeros((last - first, 3)), aside[:-1], aside[1:])
        near = np.flatnonzero(gap <= tolerance)
        if len(near):
            best = int(near[0])
            # The next points may be nearer still.
            while best + 1 < len(gap) and gap[best + 1] < gap[best]:
                best += 1
            return first + best
        first, block = last, 2 * block
    return None


def _aside(track: Track, path: Toolpath, i: IntArray | int, points: IntArray) -> Array:
    """Measure how far the centre at points is from where the axis there has it at locations, (m, 3) mm.

    An inserted location on a curve may be passed anywhere from there to the chord.
    """
    wanted = _centre(path, i, track.axis[points])
    if path.curve is None:
        return np.asarray(track.centre[points] - wanted)
    return Band(wanted, np.broadcast_to(path.curve.chord[i], wanted.shape)).asides(track.centre[points])


def _centre(path: Toolpath, i: IntArray | int, axis: Array) -> Array:
    """Compute the tool's centre at locations for tool axes, (m, 3)."""
    pivot, zone = path.pivot[i], path.zone
    if not zone.offset:
        return np.broadcast_to(pivot, axis.shape)
    normal = np.broadcast_to(path.normal[i], axis.shape)
    return np.asarray(pivot + zone.offset * across(normal, axis))


def _off(track: Track, path: Toolpath, axes: Array, known: IntArray, point: IntArray) -> Array:
    """Measure the distance of the track from the path, from the first passed location on, (m,) mm.

    A point is compared with the chords from the location that was passed before it to the one after that
    which is passed next: it may be on that chord already. Between two locations the tool's centre goes
    straight, or the pivot does while the tool turns and the surface normal with it; where locations tell a
    curve, it goes between that and the chord (`Course`). At a location the centre follows from the program's
    tool axis there, `axes`, (n, 3); at one not reached yet, from the axis at each point. In the air there is
    more than one course: a point of a rapid move beside one of the path's has no distance (NaN), nor has one
    of a cutter whose pivot is off its axis beside a link, where no normal tells where its pivot is.
    """
    points = np.arange(point[0], len(track.row))
    turn = np.searchsorted(point, points)
    reached = known[np.minimum(turn, len(known) - 1)]
    first, last = known[np.maximum(turn - 1, 0)], np.minimum(reached + 1, len(path) - 1)
    # Beside locations that the program misses a point has many chords: not all of them are held at once.
    part = np.cumsum(last - first) // MOST_CHORDS
    parts = np.split(np.arange(len(points)), np.flatnonzero(np.diff(part)) + 1)
    course = Course.of(path)
    off = [_off_chords(track, path, course, axes, points[k], first[k], reached[k]) for k in parts]
    return np.concatenate(off)


def _off_chords(
    track: Track,
    path: Toolpath,
    course: Course,
    axes: Array,
    points: IntArray,
    first: IntArray,
    reached: IntArray,
) -> Array:
    """Measure how far points, (m,), are off the chords from `first`, (m,), to after `reached`, (m,); mm."""
    centre, axis, off_axis = track.centre[points], track.axis[points], bool(path.zone.offset)
    last = np.minimum(reached + 1, len(path) - 1)
    # Each point with each of its chords, by the location at which that begins.
    chords = last - first
    of = np.repeat(np.arange(len(points)), chords)
    move = first[of] + np.arange(len(of)) - np.repeat(np.cumsum(chords) - chords, chords)

    def wanted(j: IntArray, points: IntArray) -> Array:
        own = np.isnan(axes[j]).any(axis=1) | (j > reached[points])
        return _centre(path, j, np.where(own[:, None], axis[points], axes[j]))

    gaps = segment_distances(centre[of], wanted(move, of), wanted(move + 1, of))
    if not off_axis:
        bent = np.flatnonzero(course.curved[move + 1])
        gaps[bent] = np.minimum(gaps[bent], course.distances(move[bent] + 1, centre[of[bent]]))
    least = np.linalg.norm(centre - wanted(first, np.arange(len(points))), axis=1)
    np.minimum.at(least, of, gaps)
    if off_axis:
        far = np.flatnonzero(least[of] > PATH_TOLERANCE)
        by_pivot, _ = pivot_shares(path, course, move[far], centre[of[far]], axis[of[far]])
        np.fmin.at(least, of[far], by_pivot)
    links, rapids = (_any_within(path.kind == kind, first, last) for kind in (MoveKind.LINK, MoveKind.RAPID))
    least[(off_axis & links) | (rapids & track.rapid[points])] = np.nan
    # Inserted locations keep the centre's path to this.
    allowed = np.full(len(least), PATH_TOLERANCE)
    if path.slack is not None:
        # What the program's own blocks leave the path by is no fault of others in their place.
        np.maximum.at(allowed, of, path.slack[move + 1])
    return np.asarray(np.maximum(least - allowed, 0.0))


def _any_within(marked: BoolArray, first: IntArray, last: IntArray) -> BoolArray:
    """Tell whether any of the rows from first to last, both included, is marked; (m,)."""
    count = np.append(0, np.cumsum(marked))
    return np.asarray(count[last + 1] > count[first])


def pivot_shares(
    path: Toolpath, course: Course, i: IntArray, centre: Array, axis: Array
) -> tuple[Array, Array]:
    """Find where in the moves from locations i, (m,), the pivot is, for the tool's centres and axes, (m, 3).

    Where along the chord it is follows from the normal, which turns uniformly: the nearest of some places,
    then of some around it. Return the distance of the pivot from its path, (m,) mm, NaN beside a location
    without a normal, and the share of the chord, (m,).
    """
    begin, width = np.zeros(len(centre)), 1.0
    gap, found = np.full(len(centre), np.inf), np.zeros(len(centre))
    start, step = path.pivot[i][:, None], (path.pivot[i + 1] - path.pivot[i])[:, None]
    for _ in range(ROUNDS):
        share = np.clip(begin[:, None] + width * np.linspace(0.0, 1.0, PLACES), 0.0, 1.0)
        normal = turned(path.normal, (i[:, None] + share).ravel()).reshape(*share.shape, 3)
        pivot = centre[:, None] - path.zone.offset * across(normal, axis[:, None])
        move = np.repeat(i[:, None] + 1, PLACES, axis=1)
        along = course.along(move, pivot - start - share[..., None] * step)
        gaps = np.hypot(course.distances(move, pivot), along)
        gaps = np.where(np.isfinite(normal).all(axis=2), gaps, np.nan)
        best = np.argmin(gaps, axis=1)
        gap, found = (a[np.arange(len(a)), best] for a in (gaps, share))
        width *= 2.0 / (PLACES - 1)
        begin = found - 0.5 * width
    return gap, found


def passed_numbers(context: CheckContext, match: Match) -> Array:
    """Tell how many of the passed locations lie before the end of each row of a program, (n,), fractional.

    Between two locations it is in proportion to the course of the tool's centre, or to its turn where it
    stands; for a cutter whose pivot is off its axis, where the pivot is on its chord.
    """
    path, row = match.path, match.passed
    place, steps = match.place[row], step_lengths(context.centre)
    ends, every = np.arange(len(steps), dtype=float), np.arange(len(row), dtype=float)
    turns = context.steps[:, context.machine.rotary_columns].max(axis=1, initial=0.0)
    course = np.cumsum(np.nan_to_num(steps + TURN * turns))
    number = np.interp(course, np.interp(place, ends, course), every)
    if not path.zone.offset:
        return number
    before = np.clip(np.searchsorted(place, ends, side="right") - 1, 0, len(row) - 2)
    inner = (place[before] < ends) & (ends < place[before + 1]) & (row[before + 1] == row[before] + 1)
    some = np.flatnonzero(inner)
    gap, share = pivot_shares(
        path, Course.of(path), row[before[some]], context.centre[some], context.axis[some]
    )
    number[some] = np.where(np.isfinite(gap), before[some] + share, number[some])
    return number


def step_lengths(points: Array) -> Array:
    """Measure the step to each point, (n,) mm, from the one before."""
    return np.asarray(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1))
