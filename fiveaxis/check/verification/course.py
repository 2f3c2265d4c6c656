"""Where a path lets the tool's pivot be between two locations: between the curve through them and the chord.

The curve is found here from the given locations alone, by other means than `fiveaxis.model.toolpath.curve`,
which planned the program: each location has the circle through it and its neighbours, and between two
locations the height over the chord goes evenly from the one circle's to the other's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between, arctan2
from fiveaxis.model import ALIKE, LEAST_BOW, LONGEST_RATIO, MOST_BOW, MOST_TURN, SHORTEST, Toolpath

# By how much a cubic and arcs with the same tangents may differ, as a share of their height, and mm.
CURVES_DIFFER, ROUNDING = 0.03, 5e-4


@dataclass(frozen=True, eq=False)
class Course:
    """The moves between the g given locations of a path of n.

    Parameters
    ----------
    move : (n,), the given location at which the move that each row is part of ends
    begin, end : (g, 3), mm, of the move that ends at each given location
    circles : (g, 2, 3), 1/mm, curvature of the circles at begin and end of the move, across the chord
    """

    move: IntArray
    begin: Array
    end: Array
    circles: Array

    @classmethod
    def of(cls, path: Toolpath) -> Course:
        """Find the curves of a path's moves."""
        given = np.flatnonzero(~path.inserted)
        pivot = path.pivot[given]
        begin = np.vstack([pivot[:1], pivot[:-1]])
        cuts = path.cutting[given] & (path.shape == "smooth")
        if path.straight is not None:
            cuts &= ~path.straight[given]
        move = np.searchsorted(given, np.arange(len(path)))
        return cls(move, begin, pivot, _circles(pivot, path.normal[given], cuts, bool(path.zone.offset)))

    @property
    def curved(self) -> BoolArray:
        """(n,), rows in or at the end of moves along a curve."""
        return np.asarray(self.circles.any(axis=(1, 2)))[self.move]

    def distances(self, rows: IntArray | int, point: Array) -> Array:
        """Measure how far points, (m, 3) mm, are from where the pivot may be in the moves to rows, mm.

        The rows are (m,), or one for all points.
        """
        move = self.move[rows]
        begin, chord = self.begin[move], self.end[move] - self.begin[move]
        square = np.sum(chord**2, axis=-1)
        share = np.sum((point - begin) * chord, axis=-1) / np.where(square > 0.0, square, 1.0)
        share = np.clip(share, 0.0, 1.0)
        aside = point - begin - share[..., None] * chord
        most = _heights(self.circles[move], square, share) * (1.0 + CURVES_DIFFER)
        reach = np.sum(most**2, axis=-1)
        along = np.clip(np.sum(aside * most, axis=-1) / np.where(reach > 0.0, reach, 1.0), 0.0, 1.0)
        off = np.linalg.norm(aside - along[..., None] * most, axis=-1)
        return np.asarray(np.where(reach > 0.0, np.maximum(off - ROUNDING, 0.0), off))

    def along(self, rows: IntArray, vector: Array) -> Array:
        """Measure vectors, (m, 3) mm, along the chords of the moves to rows, (m,); (m,) mm."""
        chord = self.end[self.move[rows]] - self.begin[self.move[rows]]
        length = np.maximum(np.linalg.norm(chord, axis=-1), SHORTEST)
        return np.asarray(np.sum(vector * chord, axis=-1) / length)


def _heights(circles: Array, square: Array, share: Array) -> Array:
    """Compute how far the curves are from their chords, of (m,) mm², at shares, (m,); (m, 3) mm.

    A circle of curvature k is higher than its chord c by ``c² s (1 − s) k / (√(1 − k² c² (s − ½)²) +
    √(1 − k² c² / 4))``.
    """
    out = np.zeros((*share.shape, 3))
    for end, weight in enumerate((1.0 - share, share)):
        circle = circles[..., end, :]
        bend = np.sum(circle**2, axis=-1) * square
        root = np.sqrt(1.0 - bend * (share - 0.5) ** 2) + np.sqrt(1.0 - bend / 4.0)
        out -= (weight * square * share * (1.0 - share) / root)[..., None] * circle
    return out


def _circles(pivot: Array, normal: Array, cuts: BoolArray, needs_normal: bool) -> Array:
    """Find the circles at both ends of g moves, (g, 2, 3) 1/mm; zero along chords."""
    count = len(pivot)
    circles = np.zeros((count, 2, 3))
    if count < 3:
        return circles
    length = np.linalg.norm(np.diff(pivot, axis=0), axis=1)
    turned = angle_between(normal[:-1], normal[1:])
    curved = cuts[1:] & (length > SHORTEST) & ~(turned > MOST_TURN)
    if needs_normal:
        curved &= np.isfinite(turned)
    back, ahead = pivot[:-2] - pivot[1:-1], pivot[2:] - pivot[1:-1]
    own = np.zeros((count, 3))
    own[1:-1] = _curvatures(back, ahead)
    shorter, longer = np.minimum(length[:-1], length[1:]), np.maximum(length[:-1], length[1:])
    smooth = np.zeros(count, dtype=bool)
    smooth[1:-1] = curved[:-1] & curved[1:] & (longer <= LONGEST_RATIO * shorter)
    smooth[1:-1] &= math.pi - _angles(back, ahead) <= MOST_TURN
    own[~smooth] = 0.0
    square = np.sum(own**2, axis=1)
    beside = np.sum(own[1:] * own[:-1], axis=1)
    like = np.maximum(np.append(beside, -np.inf), np.append(-np.inf, beside)) >= ALIKE * square
    flat = np.zeros(count, dtype=bool)
    flat[1:-1] = np.sqrt(square[1:-1]) * longer**2 / 8.0 < LEAST_BOW
    smooth &= like | flat
    ends = np.stack([own[:-1], own[1:]], axis=1)
    # An end without a circle of its own has that of the other end.
    known = np.stack([smooth[:-1], smooth[1:]], axis=1)[..., None]
    circles[1:] = np.where(known, ends, np.where(known[:, ::-1], ends[:, ::-1], 0.0))
    size = np.linalg.norm(circles, axis=2, keepdims=True)
    straight = ~curved | (size[1:, :, 0].max(axis=1) * length**2 / 8.0 > MOST_BOW)
    circles[1:][straight] = 0.0
    # Of the direction to a circle's centre that part which is across the chord.
    unit = np.zeros((count, 1, 3))
    unit[1:, 0] = np.diff(pivot, axis=0) / np.maximum(length, SHORTEST)[:, None]
    across = circles - np.sum(circles * unit, axis=2, keepdims=True) * unit
    long = np.linalg.norm(across, axis=2, keepdims=True)
    return np.divide(size * across, long, out=np.zeros_like(across), where=long > 0.0)


def _angles(one: Array, other: Array) -> Array:
    """Measure the angles between rows of vectors of any length, (m,) rad."""
    return arctan2(np.linalg.norm(np.cross(one, other), axis=1), np.sum(one * other, axis=1))


def _curvatures(back: Array, ahead: Array) -> Array:
    """Compute the curvature of the circles through points and both neighbours, (m, 3) 1/mm to the centre.

    `back` and `ahead`, (m, 3) mm, lead from the point to the one before and the one after.
    """
    one, two = np.sum(back**2, axis=1, keepdims=True), np.sum(ahead**2, axis=1, keepdims=True)
    across = np.cross(back, ahead)
    size = one * two * np.sum((back - ahead) ** 2, axis=1, keepdims=True)
    towards = 2.0 * np.cross(one * ahead - two * back, across)
    return np.divide(towards, size, out=np.zeros_like(towards), where=size > 0.0)
