"""The check that a program follows a path: nowhere off it, and past every location of it.

A program has other rows than the path: locations inserted, blocks removed, an approach before. So rows aren't
compared one by one: the track of the tool's centre is compared with the path, in order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between, product, risk
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.course import Course
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.moves import segment_distances
from fiveaxis.check.verification.report import Result, violated
from fiveaxis.model import PATH_TOLERANCE, Band, MoveKind, Toolpath, across, divided_rows, interpolate, turned

# Points per block at which it is compared: with joint interpolation at least 4, under TCP at least its end;
# more if it passes several of the path's shortest chords (longer than SHORTEST_CHORD, mm), or if the tool
# turns so far that its centre swings out beside the tip.
LEAST_POINTS, MOST_POINTS = 4, 400
SHORTEST_CHORD = 1e-2
# A location is searched over the path's own length to it times DETOUR, plus SPARE mm.
DETOUR, SPARE = 2.0, 1.0
# Points of the track in the first block of a search.
FIRST_BLOCK = 64
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


@dataclass(frozen=True, eq=False)
class Track:
    """The track of a program's tool, as points.

    Parameters
    ----------
    centre, axis : (m, 3), mm and unit vectors
    row : (m,), of the program, where the block ends
    place : (m,), fractional row of the program: 3.25 lies in the block to row 4
    linking, rapid : (m,), whether the block is a link, which leaves the path on purpose, or a rapid move
    """

    centre: Array
    axis: Array
    row: IntArray
    place: Array
    linking: BoolArray
    rapid: BoolArray

    @classmethod
    def of(
        cls, context: CheckContext, path: Toolpath, *, tcp_height: float | None, in_planes: bool = False
    ) -> Track:
        """Sample a program's moves, with all axes linear in time or a point of the tool moving straight.

        Parameters
        ----------
        tcp_height : height of that point above the tip, mm; None with joint interpolation
        in_planes : whether the tool turns in the plane of its two directions meanwhile, instead of with the
            rotary axes in proportion
        """
        tip, axis = context.tip, context.axis
        height = context.toolpath.zone.height
        length = np.nan_to_num(np.linalg.norm(np.diff(tip + height * axis, axis=0), axis=1))
        chords = path.lengths[path.lengths > SHORTEST_CHORD]
        passed = length / (chords.min() if len(chords) else np.inf)
        # A pivot off the axis swings about the centre, and the centre about a tip that moves straight.
        arm = abs(path.zone.offset) + (abs(height - tcp_height) if tcp_height is not None else 0.0)
        turn = np.nan_to_num(angle_between(axis[:-1], axis[1:]))
        swings = np.ceil(turn * np.sqrt(arm / (8.0 * PATH_TOLERANCE)))
        least, points = (LEAST_POINTS, np.ceil(2.0 * passed)) if tcp_height is None else (1, np.round(passed))
        parts = np.clip(np.maximum(points, swings), least, MOST_POINTS)
        place = divided_rows(parts.astype(np.int64))
        row = np.ceil(place).astype(np.int64)
        before, share = np.maximum(row - 1, 0), (place - row + 1.0)[:, None]
        positions = context.positions[before] + share * (context.positions[row] - context.positions[before])
        point, axes = tool_poses(context.machine, positions)
        if tcp_height is not None:
            axes = turned(axis, place) if in_planes else axes
            ends = tip + tcp_height * axis
            point = ends[before] + share * (ends[row] - ends[before]) - tcp_height * axes
        kind = context.toolpath.kind[row]
        linking, rapid = np.asarray(kind == MoveKind.LINK), np.asarray(kind == MoveKind.RAPID)
        return cls(point + height * axes, axes, row, place, linking, rapid)


def follow(
    context: CheckContext, path: Toolpath, *, tcp_height: float | None = None, by_direction: bool = False
) -> Match:
    """Follow a path with a program.

    Parameters
    ----------
    context : the program, with tool and zone of the path
    path : the path to follow
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
    yield violated(
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
    yield violated(
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
    return violated(
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

    With joint interpolation rapid moves of both may take any course between locations.

    Returns
    -------
    row, place : (n,), of the locations, as in `Match`
    off : (m,), mm, of the track's points from the chord between the locations before and after; NaN before
        the first location, and in the lead-out from the last one
    """
    count, course = len(path), Course.of(path)
    rows = np.full(count, -1, dtype=np.int64)
    places, axes = np.full(count, np.nan), np.full((count, 3), np.nan)
    off = np.full(len(track.row), np.nan)
    steps = np.linalg.norm(np.diff(track.centre, axis=0), axis=1)
    # Links return to where they left and make no progress along the path.
    steps[track.linking[1:]] = 0.0
    # With joint interpolation a rapid move may be a long detour.
    steps[track.rapid[1:] & (not straight)] = 0.0
    travelled = np.append(0.0, np.cumsum(np.nan_to_num(steps)))
    # Beside a link the centre of a cutter whose pivot is off its axis goes from one to the other.
    lengths, spare = path.lengths, SPARE + 2.0 * abs(path.zone.offset)
    at, allowed, last = 0, np.inf, -1
    for i in range(count):
        if last < 0 and i >= MOST_LOST:
            break
        allowed += DETOUR * lengths[i] + spare if i else 0.0
        end = int(np.searchsorted(travelled, travelled[at] + allowed, side="right"))
        point = _pass(track, path, i, at, max(end, at + 1), tolerance)
        if point is None:
            continue
        nearest = _nearest(track, path, i, point, at)
        # Only the two points around it, for speed.
        first = int(nearest[0])
        around = slice(first, first + 2)
        places[i] = interpolate(track.place[around, None], nearest - first)[0, 0]
        axes[i] = interpolate(track.axis[around], nearest - first)[0]
        # The point may be on the next chord already: the location is somewhere before it.
        stop = min(i + 1, count - 1)
        before, begin = (last, at + 1) if last >= 0 else (i, point)
        off[begin : point + 1] = _off(track, path, course, axes, before, stop, begin, point + 1)
        rows[i] = track.row[_nearer_end(track, path, i, point, at)]
        at, last, allowed = point, i, 0.0
    if last >= 0:
        stop = min(last + 1, count - 1)
        off[at + 1 :] = _off(track, path, course, axes, last, stop, at + 1, len(track.row))
    if last == count - 1:
        # The lead-out from the path: one block, and rapid moves.
        out = np.floor(places[last] + NEXT) + 1.0
        off[(track.place > places[last]) & ((track.row <= out) | track.rapid)] = np.nan
    return rows, places, off


def _pass(track: Track, path: Toolpath, i: int, begin: int, end: int, tolerance: float) -> int | None:
    """Find where the track, chords included, first passes a location: the nearest point."""
    first, block = begin, FIRST_BLOCK
    while first < end:
        points = np.arange(first, min(first + block, end))
        first, block = first + block, 2 * block
        after, before = (_aside(track, path, i, p) for p in (points, np.maximum(points - 1, begin)))
        gap = segment_distances(np.zeros_like(after), before, after)
        near = np.flatnonzero(gap <= tolerance)
        if not len(near):
            continue
        best = int(near[0])
        # The next points may be nearer still.
        while best + 1 < len(gap) and gap[best + 1] < gap[best]:
            best += 1
        return int(points[best])
    return None


def _nearer_end(track: Track, path: Toolpath, i: int, point: int, begin: int) -> int:
    """Find the end of the chord to a point that is nearer to a location."""
    ends = np.array([point, max(point - 1, begin)])
    return int(ends[np.argmin(np.linalg.norm(_aside(track, path, i, ends), axis=1))])


def _nearest(track: Track, path: Toolpath, i: int, point: int, begin: int) -> Array:
    """Find where the chord to a point is nearest to a location, (1,), as a fractional point of the track."""
    before = max(point - 1, begin)
    start, end = _aside(track, path, i, np.array([before, point]))
    step = end - start
    square = float(product(step, step))
    share = float(np.clip(product(-start, step) / square, 0.0, 1.0)) if square else 1.0
    return np.array([before + share * (point - before)])


def _aside(track: Track, path: Toolpath, i: int, points: IntArray) -> Array:
    """Measure how far the centre at points is from where the axis there has it at a location, (m, 3) mm.

    An inserted location on a curve may be passed anywhere from there to the chord.
    """
    wanted = _centre(path, i, track.axis[points])
    if path.curve is None:
        return np.asarray(track.centre[points] - wanted)
    return Band(wanted, np.broadcast_to(path.curve.chord[i], wanted.shape)).asides(track.centre[points])


def _centre(path: Toolpath, i: int, axis: Array) -> Array:
    """Compute the tool's centre at a location for tool axes, (m, 3)."""
    pivot, zone = path.pivot[i], path.zone
    if not zone.offset:
        return np.broadcast_to(pivot, axis.shape)
    normal = np.broadcast_to(path.normal[i], axis.shape)
    return np.asarray(pivot + zone.offset * across(normal, axis))


def _off(
    track: Track, path: Toolpath, course: Course, axes: Array, i: int, k: int, begin: int, end: int
) -> Array:
    """Measure the distance of points of the track from the path through locations i to k, (m,) mm.

    Between two locations the tool's centre goes straight, or the pivot does while the tool turns and the
    surface normal with it; where locations tell a curve, it goes between that and the chord (`course`).
    At a location the centre follows from the program's tool axis there, `axes`, (n, 3); at one not reached
    yet, from the axis at each point. In the air there is more than one course: a point of a rapid move beside
    one of the path's has no distance (NaN), nor has one of a cutter whose pivot is off its axis beside a
    link, where no normal tells where its pivot is.
    """
    points = slice(begin, end)
    axis, centre = track.axis[points], track.centre[points]
    if begin >= end:
        return np.empty(0)
    ends = [
        _centre(path, j, axis if np.isnan(axes[j]).any() else np.broadcast_to(axes[j], axis.shape))
        for j in range(i, k + 1)
    ]
    gaps = [segment_distances(centre, a, b) for a, b in pairwise(ends)]
    if not path.zone.offset:
        bent = [j for j in range(i, k) if course.curved[j + 1]]
        gaps += [course.distances(j + 1, centre) for j in bent]
    near = np.linalg.norm(centre - ends[0], axis=1)
    least = np.min([near, *gaps], axis=0)
    far = np.flatnonzero(least > PATH_TOLERANCE) if path.zone.offset else ()
    if len(far):
        for j in range(i, k):
            by_pivot, _ = pivot_shares(path, course, np.full(len(far), j), centre[far], axis[far])
            least[far] = np.fmin(least[far], by_pivot)
    air = path.kind[i : k + 1]
    if path.zone.offset and (air == MoveKind.LINK).any():
        least[:] = np.nan
    elif (air == MoveKind.RAPID).any():
        least[track.rapid[points]] = np.nan
    # Inserted locations keep the centre's path to this.
    # What the program's own blocks leave the path by is no fault of others in their place.
    own = 0.0 if path.slack is None else float(path.slack[i + 1 : k + 1].max(initial=0.0))
    return np.asarray(np.maximum(least - max(PATH_TOLERANCE, own), 0.0))


def pivot_shares(
    path: Toolpath, course: Course, i: IntArray, centre: Array, axis: Array
) -> tuple[Array, Array]:
    """Find where in the moves from locations i the pivot is, for centres and tool axes.

    Where along the chord it is follows from the normal, which turns uniformly: the nearest of some places,
    then of some around it.

    Parameters
    ----------
    i : (m,), locations at which the chords begin
    centre, axis : (m, 3), mm and unit vectors, of the tool

    Returns
    -------
    gap : (m,), mm, distance of the pivot from its path; NaN beside a location without a normal
    share : (m,), of the chord, where it is
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
