"""Whether a program of its own blocks follows a path: nowhere off it, and by every location of it.

A program read back has other rows than the path: locations inserted, blocks left out, an approach before.
So rows aren't compared one by one: the way of the tool's centre is held against the path's, in order.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.toolpath import MoveKind, Toolpath, across, divided_rows, interpolate
from fiveaxis.verification.check_context import CheckContext
from fiveaxis.verification.checks import largest
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.moves import segment_distances
from fiveaxis.verification.report import MOST_LISTED, Result

# A block with joint interpolation is compared at so many places, one under TCP at its end; at more where it
# passes several of the path's shortest chords (those next to nothing, mm, left out), or where
# the tool turns so far that its centre swings out beside the tip.
LEAST_PLACES, MOST_PLACES = 4, 400
SHORTEST_CHORD = 1e-2
# A location is looked for this much farther on than the path's own way to it, as a share of that and in mm.
DETOUR, SPARE = 2.0, 1.0
# Places of the track that are looked at first.
FIRST_BLOCK = 64
# A place so near to the end of a block, as a share of it, is that end.
NEXT = 1e-3
# A program that comes by none of so many locations at the path's begin follows another path.
MOST_LOST = 20


@dataclass(frozen=True, eq=False)
class Match:
    """Which of a program's rows stands for which location.

    Parameters
    ----------
    row : (n,), of the program, the first that comes by the location; −1 for none
    gap : (n,), mm, how far it passes from the location; NaN for none
    place : (n,), in rows of the program, where it comes by: 3.25 lies in the block to row 4
    """

    row: IntArray
    gap: Array
    place: Array

    @property
    def missed(self) -> dict[str, int]:
        """How many locations the program doesn't come by, under their code; empty where it is none."""
        count = int((self.row < 0).sum())
        return {"path-missed": count} if count else {}


@dataclass(frozen=True, eq=False)
class Track:
    """The way of a program's tool.

    Parameters
    ----------
    centre, axis : (m, 3), mm and unit vectors, at the shares of every block
    row : (m,), of the program, where the block ends
    place : (m,), the same with shares of the block: 3.25 lies in the block to row 4
    linking, rapid : (m,), whether the block is a link, which leaves the path on purpose, or a rapid move
    """

    centre: Array
    axis: Array
    row: IntArray
    place: Array
    linking: BoolArray
    rapid: BoolArray

    @classmethod
    def of(cls, context: CheckContext, path: Toolpath, *, tcp_height: float | None) -> Track:
        """Follow all axes linearly in time, or a point of the tool straight, place by place.

        Parameters
        ----------
        tcp_height : height of that point above the tip, mm; None where all axes run linearly
        """
        tip, axis = context.tip, context.axis
        height = context.toolpath.zone.height
        way = np.nan_to_num(np.linalg.norm(np.diff(tip + height * axis, axis=0), axis=1))
        chords = path.lengths[path.lengths > SHORTEST_CHORD]
        passed = way / (chords.min() if len(chords) else np.inf)
        if tcp_height is None:
            parts = np.clip(np.ceil(2.0 * passed), LEAST_PLACES, MOST_PLACES)
        else:
            parts = np.clip(np.maximum(np.round(passed), _swings(axis, height - tcp_height)), 1, MOST_PLACES)
        place = divided_rows(parts.astype(np.int64))
        row = np.ceil(place).astype(np.int64)
        before, share = np.maximum(row - 1, 0), (place - row + 1.0)[:, None]
        positions = context.positions[before] + share * (context.positions[row] - context.positions[before])
        point, axes = tool_poses(context.machine, positions)
        if tcp_height is not None:
            ends = tip + tcp_height * axis
            point = ends[before] + share * (ends[row] - ends[before]) - tcp_height * axes
        kind = context.toolpath.kind[row]
        linking, rapid = np.asarray(kind == MoveKind.LINK), np.asarray(kind == MoveKind.RAPID)
        return cls(point + height * axes, axes, row, place, linking, rapid)


def _swings(axis: Array, arm: float) -> Array:
    """Count the parts of each block, (n - 1,), in which a point beside a straight one keeps near to chords.

    Parameters
    ----------
    axis : (n, 3), of the tool at the ends of blocks
    arm : mm, from the one point to the other along it
    """
    turn = np.nan_to_num(angle_between(axis[:-1], axis[1:]))
    return np.asarray(np.ceil(turn * np.sqrt(abs(arm) / (8.0 * PATH_TOLERANCE))))


def check_following(
    context: CheckContext, path: Toolpath, *, tcp_height: float | None = None
) -> tuple[Result, tuple[Finding, ...], Match]:
    """Check that a program follows a path.

    Parameters
    ----------
    context : the program, its tool and zone those of the path
    path : that it should follow
    tcp_height : mm above the tip, of the point that goes straight between rows under TCP; None with joint
        interpolation

    Returns
    -------
    The result, on rows of the program; findings on locations that the program doesn't come by; the match
    """
    tolerance = context.tolerances.deviation
    track, straight = Track.of(context, path, tcp_height=tcp_height), tcp_height is not None
    match, off = _follow(track, path, tolerance, straight=straight)
    off = np.where(track.linking, np.nan, off)
    swerves = bool((path.rapid.any() and track.rapid.any()) and not straight)
    worst = np.zeros(len(context.positions))
    np.maximum.at(worst, track.row, np.nan_to_num(off))
    rows = np.flatnonzero(worst > tolerance)

    def message(i: int) -> str:
        return (
            f"the tool's centre goes {worst[rows[i]]:.3g} mm off the path {path.name} (at most {tolerance:g} "
            "mm); compare zero, unit and this block with the path"
        )

    leaving = Result(
        code="off-path",
        severity=Severity.ERROR,
        rows=rows,
        values=worst[rows],
        message=message,
        figures={"off_path_mm": largest(off)},
        checked=(
            f"way of the tool's centre against the path {path.name}, within {tolerance:g} mm, by all "
            f"{len(path)} locations in order",
        ),
        not_checked=(
            "the way before the first location of the path, and out of its last one",
            *(("the way of rapid moves from one location of the path to the next",) if swerves else ()),
        ),
    )
    return leaving, _missed(match, path, tolerance), match


def _missed(match: Match, path: Toolpath, tolerance: float) -> tuple[Finding, ...]:
    missed = np.flatnonzero(match.row < 0)
    return tuple(
        Finding(
            Severity.ERROR,
            "path-missed",
            f"the program doesn't come within {tolerance:g} mm of this location, in order; compare zero, "
            "unit and blocks with the path",
            path.place(int(row)),
        )
        for row in missed[:MOST_LISTED]
    )


def _follow(track: Track, path: Toolpath, tolerance: float, *, straight: bool) -> tuple[Match, Array]:
    """Walk along both: the program's place beside each location, and how far the rest is off the chords.

    Where axes run straight, rapid moves of both go from location to location, and anywhere between.

    Returns
    -------
    match : of the locations
    off : (m,), mm, of the track's places from the chord between the locations before and after; NaN before
        the first location, and on the way out of the last one
    """
    count = len(path)
    rows, gaps = np.full(count, -1, dtype=np.int64), np.full(count, np.nan)
    free = path.rapid & (not straight)
    places, axes = np.full(count, np.nan), np.full((count, 3), np.nan)
    off = np.full(len(track.row), np.nan)
    steps = np.linalg.norm(np.diff(track.centre, axis=0), axis=1)
    # Links come back to where they left: they are no way along the path.
    steps[track.linking[1:]] = 0.0
    # Axes that run straight take the tool wherever it goes, and that may be far about.
    steps[track.rapid[1:] & (not straight)] = 0.0
    way = np.append(0.0, np.cumsum(np.nan_to_num(steps)))
    lengths = path.lengths
    at, allowed, last = 0, np.inf, -1
    for i in range(count):
        if last < 0 and i >= MOST_LOST:
            break
        allowed += DETOUR * lengths[i] + SPARE if i else 0.0
        end = int(np.searchsorted(way, way[at] + allowed, side="right"))
        found = _pass(track, path, i, at, max(end, at + 1), tolerance)
        if found is None:
            continue
        place, gap = found
        beside = _beside(track, path, i, place, at)
        # Of the two places around it: all of the track would be looked at for each location.
        first = int(beside[0])
        around = slice(first, first + 2)
        places[i] = interpolate(track.place[around, None], beside - first)[0, 0]
        axes[i] = interpolate(track.axis[around], beside - first)[0]
        # A place may be on the next chord already, that of the first location too: the location is somewhere
        # on the way to it.
        stop = min(i + 1, count - 1)
        before, begin, reached = (last, at + 1, i) if last >= 0 else (i, place, stop)
        off[begin : place + 1] = _off(track, path, axes, before, stop, begin, place + 1)
        if free[reached]:
            off[begin : place + 1][track.rapid[begin : place + 1]] = np.nan
        rows[i], gaps[i] = track.row[_nearer(track, path, i, place, at)], gap
        at, last, allowed = place, i, 0.0
    if last >= 0:
        stop = min(last + 1, count - 1)
        off[at + 1 :] = _off(track, path, axes, last, stop, at + 1, len(track.row))
    if last == count - 1:
        off[_leaves(track, places[last])] = np.nan
    return Match(rows, gaps, places), off


def _leaves(track: Track, last: float) -> BoolArray:
    """Find places, (m,), at which the program is on its way out of the path: one block, and rapid moves.

    What it cuts after them is no way out.

    Parameters
    ----------
    last : where the track comes by the last location, in rows of the program
    """
    out = np.floor(last + NEXT) + 1.0
    return np.asarray((track.place > last) & ((track.row <= out) | track.rapid))


def _pass(
    track: Track, path: Toolpath, i: int, begin: int, end: int, tolerance: float
) -> tuple[int, float] | None:
    """Find the first place of the track, its chords included, that comes by a location; its nearest."""
    first, block = begin, FIRST_BLOCK
    while first < end:
        places = np.arange(first, min(first + block, end))
        first, block = first + block, 2 * block
        wanted = _centre(path, i, track.axis[places])
        before = track.centre[np.maximum(places - 1, begin)]
        gap = segment_distances(wanted, before, track.centre[places])
        near = np.flatnonzero(gap <= tolerance)
        if not len(near):
            continue
        best = int(near[0])
        # It may come nearer yet in the places that follow.
        while best + 1 < len(gap) and gap[best + 1] < gap[best]:
            best += 1
        return int(places[best]), float(gap[best])
    return None


def _nearer(track: Track, path: Toolpath, i: int, place: int, begin: int) -> int:
    """Give the end of the chord to a place that is nearer to a location."""
    ends = np.array([place, max(place - 1, begin)])
    gaps = np.linalg.norm(_centre(path, i, track.axis[ends]) - track.centre[ends], axis=1)
    return int(ends[np.argmin(gaps)])


def _beside(track: Track, path: Toolpath, i: int, place: int, begin: int) -> Array:
    """Find where the track is nearest to a location, (1,), in places of the track."""
    before = max(place - 1, begin)
    wanted = _centre(path, i, track.axis[[place]])[0]
    step = track.centre[place] - track.centre[before]
    length = float(step @ step)
    share = (
        1.0 if length == 0.0 else float(np.clip((wanted - track.centre[before]) @ step / length, 0.0, 1.0))
    )
    return np.array([before + share * (place - before)])


def _centre(path: Toolpath, i: int, axis: Array) -> Array:
    """Place the tool's centre over a location for tool axes, (m, 3)."""
    pivot, zone = path.pivot[i], path.zone
    if not zone.offset:
        return np.broadcast_to(pivot, axis.shape)
    normal = np.broadcast_to(path.normal[i], axis.shape)
    return np.asarray(pivot + zone.offset * across(normal, axis))


def _off(track: Track, path: Toolpath, axes: Array, i: int, k: int, begin: int, end: int) -> Array:
    """Measure how far places of the track are from the way through locations i to k, (m,) mm.

    The way of the tool's centre is straight between locations: there it is where the tool's axis puts it that
    the program has there, `axes`, (n, 3). Of a location not reached yet the axis is taken as it is.
    """
    places = slice(begin, end)
    axis = track.axis[places]
    if begin >= end:
        return np.empty(0)
    ends = [
        _centre(path, j, axis if np.isnan(axes[j]).any() else np.broadcast_to(axes[j], axis.shape))
        for j in range(i, k + 1)
    ]
    gaps = [segment_distances(track.centre[places], a, b) for a, b in pairwise(ends)]
    near = np.linalg.norm(track.centre[places] - ends[0], axis=1)
    least = np.min([near, *gaps], axis=0)
    # Inserted locations hold the way of the centre within this.
    return np.asarray(np.maximum(least - PATH_TOLERANCE, 0.0))
