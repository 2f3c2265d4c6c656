"""A path in axis space with a continuous second derivative, for controls that limit jerk.

On a polygon's parabolas (`rounding`) q'' jumps. Here the change of direction ``Δd`` at a corner is spread
over an arm a on both sides of it as a bell, a cubic B-spline, so that q''' is continuous; a corner is passed
at ``7 a |Δd| / 60``. What all corners add to the polygon is summed up: arms may overlap. Those of rows of a
sampled curve reach over several sides: there q''' hardly depends on where rows lie and on their rounding. As
that draws a curve inward, by ``q'' a² / 24``, its rows are moved outward by as much first, and what is left
is of fourth order.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.model.motion.rounding import RoundedPath

# mm: a corner whose widest rounding passes it within this is a point of a sampled curve.
SMOOTH = 0.01
# mm and sides: arms on a curve are this long, but reach over no fewer and no more sides.
REACH, FEWEST_SIDES, MOST_SIDES = 3.0, 4, 32
# By how much an arm may be longer than the next, per mm; over how many rows to either side arms are evened.
LENGTHENING, EVENED = 0.5, 4
# Arms of which the path leaves the polygon too far shrink by this factor, at most so many times.
SHRINKING, MOST_SHRINKINGS = 0.7, 40
# A bell of arm a passes its corner at a |Δd| times this.
BELL = 7.0 / 60.0


@dataclass(frozen=True, eq=False)
class SmoothPath(RoundedPath):
    """A polygon with all that its corners add to it.

    Near a stop the corners have mirror images beyond it, of the opposite turn: so the path keeps to the stop.
    The polygon's corners are moved outward where they are rows of a curve.

    Parameters
    ----------
    place, reach : (b,), mm, station and arm of each corner and mirror image, stop by stop
    turn : (b, k), change of q'
    own : (m,), index of each corner among these
    first, last : (m − 1,), of each side, indices of what may reach it
    """

    place: Array
    reach: Array
    turn: Array
    own: IntArray
    first: IntArray
    last: IntArray

    def derivatives(self, station: Array) -> Array:
        """Compute axis values and three derivatives with respect to the station, (4, s, k)."""
        side = self.side(station)
        straight = self.corners[side] + (station - self.station[side])[:, None] * self.directions[side]
        first, last = self.first[side], self.last[side]
        added = _added(station, first, last, self.place, self.reach, self.turn)
        added[0] += straight
        added[1] += self.directions[side]
        return added

    def at(self, station: Array) -> tuple[Array, Array, Array]:
        """Compute axis values and two derivatives, as `RoundedPath.at`."""
        position, slope, bend, _ = self.derivatives(station)
        return position, slope, bend


def smooth_corners(path: RoundedPath, lever: Array, *, tolerance: float, smooth: float) -> SmoothPath:
    """Give a path with rounded corners a continuous second derivative, within the tolerances.

    Parameters
    ----------
    path : its arms say which corners are passed; it rests at the others
    lever : (k,), as `round_corners`
    tolerance : mm, within which real corners are passed
    smooth : mm, the same for rows of a sampled curve, but no more than `path` leaves them or `SMOOTH`
    """
    turns = np.zeros_like(path.corners)
    turns[1:-1] = np.diff(path.directions, axis=0)
    size = np.linalg.norm(turns * lever, axis=1)
    off = 0.25 * path.arm * size
    curve = (path.arm > 0.0) & (off <= smooth)
    allowed = np.where(curve, np.maximum(tolerance, np.minimum(smooth, np.maximum(off, SMOOTH))), tolerance)
    stops = np.flatnonzero(path.arm == 0.0)
    corners, parts, begun = path.corners.copy(), [], 0
    own, first, last = np.zeros((3, len(corners)), dtype=np.int64)
    for start, end in pairwise(stops):
        run = slice(start, end + 1)
        points, part = _smooth_run(path.corners[run], path.station[run], lever, curve[run], allowed[run])
        corners[run] = points
        parts.append(part)
        first[start:end], last[start:end] = (begun + i for i in _covering(path.station[run], *part[:2]))
        own[run] = begun + (len(part[0]) - len(points)) // 2 + np.arange(len(points))
        begun += len(part[0])
    directions = np.diff(corners, axis=0) / np.diff(path.station)[:, None]
    place, reach, turn = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    sides = first[:-1], last[:-1]
    return SmoothPath(corners, path.station, directions, path.arm, place, reach, turn, own, *sides)


def _smooth_run(
    points: Array, station: Array, lever: Array, curve: BoolArray, allowed: Array
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Find the polygon's corners and what they add, from one stop to the next.

    Parameters
    ----------
    points, station, curve : (m, k) mm and rad, (m,) mm, (m,) rows of a curve
    allowed : (m,), mm, how far the path may leave each

    Returns
    -------
    The corners, moved outward on a curve; ``place``, ``reach`` and ``turn`` as of `SmoothPath`
    """
    m = len(points)
    images = min(MOST_SIDES + 1, m - 1)

    def mirrored(values: Array, sign: float) -> Array:
        """Add images at both ends: of the opposite sign for the distance from the end itself, or alike."""
        before, after = values[images:0:-1], values[-2 : -images - 2 : -1]
        centred = (1.0 - sign) * values[0], (1.0 - sign) * values[-1]
        return np.concatenate([centred[0] + sign * before, values, centred[1] + sign * after])

    def turned(points: Array) -> Array:
        turns = np.zeros_like(points)
        turns[1:-1] = np.diff(np.diff(points, axis=0) / np.diff(station)[:, None], axis=0)
        return turns

    def left(points: Array, reach: Array) -> Array:
        turn = mirrored(turned(points), -1.0)
        sides = np.minimum(np.arange(m), m - 2)
        arms = mirrored(reach, 1.0)
        first, last = _covering(station, place, arms)
        return _added(station, first[sides], last[sides], place, arms, turn)[0]

    place = mirrored(station, -1.0)
    size = np.linalg.norm(turned(points) * lever, axis=1)
    sides = np.diff(station)
    shorter = np.minimum(np.append(sides, np.inf), np.append(np.inf, sides))
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = np.where(size > 0.0, allowed / (size * BELL), 0.0)
    shortest = np.minimum(alone, shorter)
    many, few = (_over_sides(place, images, count) for count in (MOST_SIDES, FEWEST_SIDES))
    wanted = np.where(curve, np.maximum(few, np.minimum(many, REACH)), alone)
    reach = np.where(size > 0.0, np.maximum(np.minimum(wanted, station[-1] - station[0]), shortest), 0.0)
    for _ in range(MOST_SHRINKINGS):
        arms = _evened(reach, station, curve)
        moved = points - np.where(curve[:, None], left(points, arms), 0.0)
        off = np.linalg.norm((moved + left(moved, arms) - points) * lever, axis=1)
        wide = np.append(0, np.cumsum(off > allowed))
        near = np.searchsorted(station, station + arms), np.searchsorted(station, station - arms, "right")
        shrinking = (wide[near[0]] > wide[near[1]]) & (reach > shortest)
        if not shrinking.any():
            break
        reach = np.where(shrinking, np.maximum(SHRINKING * reach, shortest), reach)
    return moved, (place, mirrored(arms, 1.0), mirrored(turned(moved), -1.0))


def _evened(reach: Array, station: Array, curve: BoolArray) -> Array:
    """Let arms on curves change but slowly from row to row: what rounding adds to rows then cancels out."""
    from scipy.ndimage import uniform_filter1d  # slow to load

    arms = np.where(curve, reach, np.inf)
    after = np.minimum.accumulate(arms - LENGTHENING * station) + LENGTHENING * station
    before = np.minimum.accumulate((arms + LENGTHENING * station)[::-1])[::-1] - LENGTHENING * station
    arms = np.where(curve, np.minimum(before, after), 0.0)
    rows = 2 * EVENED + 1
    weight = uniform_filter1d(curve.astype(float), rows, mode="constant")
    mean = np.divide(uniform_filter1d(arms, rows, mode="constant"), weight, out=arms, where=weight > 0.0)
    return np.where(curve, mean, reach)


def _over_sides(place: Array, images: int, count: int) -> Array:
    """Return the distance over a number of sides on the nearer side of every corner of a run, mm."""
    own = np.arange(images, len(place) - images)
    before, after = np.maximum(own - count, 0), np.minimum(own + count, len(place) - 1)
    return np.minimum(place[own] - place[before], place[after] - place[own])


@compiled
def _covering(station: Array, place: Array, reach: Array) -> tuple[IntArray, IntArray]:
    """Find the first and the last of what may reach each side of a polygon; (m − 1,) each."""
    n = len(station) - 1
    first, last = np.full(n, len(place)), np.full(n, -1)
    for i in range(len(place)):
        if reach[i] <= 0.0:
            continue
        s = np.searchsorted(station, place[i] - reach[i], "right") - 1
        s = max(s, 0)
        while s < n and station[s] < place[i] + reach[i]:
            first[s] = min(first[s], i)
            last[s] = max(last[s], i)
            s += 1
    return first, last


@compiled
def _added(station: Array, first: IntArray, last: IntArray, place: Array, reach: Array, turn: Array) -> Array:
    """Add up what corners add to the axis values and three derivatives, (4, s, k).

    That is ``Δd a ((2 − 2 x)⁵ − 4 (1 − 2 x)₊⁵) / 240`` with ``x = |u − U| / a`` and ``(·)₊ = max(·, 0)``.
    """
    added = np.zeros((4, len(station), turn.shape[1]))
    for p in range(len(station)):
        for i in range(first[p], last[p] + 1):
            a, offset = reach[i], station[p] - place[i]
            if not abs(offset) < a:
                continue
            sign = 1.0 if offset < 0.0 else -1.0
            t = 2.0 - 2.0 * abs(offset) / a
            v = max(t - 1.0, 0.0)
            t2, v2 = t * t, v * v
            w0 = (t2 * t2 * t - 4.0 * v2 * v2 * v) * a / 240.0
            w1 = (t2 * t2 - 4.0 * v2 * v2) * sign / 24.0
            w2 = (t2 * t - 4.0 * v2 * v) / (3.0 * a)
            w3 = (t2 - 4.0 * v2) * 2.0 * sign / (a * a)
            for j in range(turn.shape[1]):
                added[0, p, j] += turn[i, j] * w0
                added[1, p, j] += turn[i, j] * w1
                added[2, p, j] += turn[i, j] * w2
                added[3, p, j] += turn[i, j] * w3
    return added
