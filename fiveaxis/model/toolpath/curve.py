"""The smooth curve through cutter locations.

Locations are samples of a designed path. Where they lie densely enough on a smooth curve to tell it, the
path between two of them is not their chord but a cubic that continues from move to move without a corner.
The curve is stored as its *bow*, the cubic's distance from the chord at the same share s of the move::

    bow(s) = s (1 − s) [(1 − s) b₀ − s b₁]

A chord is the curve whose b are zero. The tangent at a location is that of the circle through it and its
neighbours, so an arc that is sampled evenly or not is met to within a millionth of its radius at 15° a step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between, cross, normalise

# Bounds within which locations tell a curve; round figures, which real paths have, lie beside each of them.
# rad: chords that meet at a larger angle, and normals that turn by more in one move, are a corner's.
MOST_TURN = math.radians(31.0)
# A move longer than its neighbour by more than this factor is a straight line beside a curve.
LONGEST_RATIO = 2.6
# Least component of the neighbour's curvature along a location's own, as a share of it. A corner has no such
# neighbour, nor has a zigzag; where a line meets an arc the curvature is at least halved.
ALIKE = 0.3
# mm, of an arc of a location's curvature over a move: below the first it is rounding of the coordinates;
# beyond the second, samples are too far apart to tell the curve. Below the third the chord is the curve.
LEAST_BOW, MOST_BOW, NO_BOW = 5e-4, 0.056, 1e-6
# mm: shorter moves have no direction.
SHORTEST = 1e-6
# Weights by share of Gauss and Legendre's rule: it gives the length of an arc of 31° to 1e-10 of it.
NEAR, FAR = (math.sqrt(5.0 + sign * 2.0 * math.sqrt(10.0 / 7.0)) / 6.0 for sign in (-1.0, 1.0))
HEAVY, LIGHT = ((322.0 + sign * 13.0 * math.sqrt(70.0)) / 1800.0 for sign in (1.0, -1.0))
NODES = {0.5: 64.0 / 225.0, 0.5 - NEAR: HEAVY, 0.5 + NEAR: HEAVY, 0.5 - FAR: LIGHT, 0.5 + FAR: LIGHT}


@dataclass(frozen=True, eq=False)
class Curve:
    """How the pivot's path leaves the chords between n locations.

    Parameters
    ----------
    bows : (n, 2, 3), mm, b₀ and b₁ of the move that ends at each row; zero for a chord
    chord : (n, 3), mm: from each location to the point of the chord that it was inserted beside; zero at
        given locations, which lie on their chords
    """

    bows: Array
    chord: Array

    @classmethod
    def through(cls, pivot: Array, normal: Array, smooth: BoolArray) -> Curve:
        """Find the curve through pivots, (n, 3) mm; `smooth` says of moves whether they may be curved."""
        bows = np.zeros((len(pivot), 2, 3))
        bows[1:] = _bows(pivot, normal, smooth[1:])
        return cls(bows, np.zeros_like(pivot))

    @property
    def bent(self) -> BoolArray:
        """(n,), whether the move that ends at each row isn't a chord."""
        return np.asarray(self.bows.any(axis=(1, 2)))

    def at(self, rows: IntArray) -> Curve:
        """Return the curve of some locations; moves that aren't whole become chords."""
        whole = np.diff(rows, prepend=-1) == 1
        return Curve(np.where(whole[:, None, None], self.bows[rows], 0.0), self.chord[rows])

    def between(self, pivot: Array, row: Array) -> tuple[Array, Array]:
        """Compute the curve at fractional rows, (m, 3) mm, and how far the given chord is from there."""
        move, share = _places(row)
        before = np.maximum(move - 1, 0)
        straight = pivot[before] + share * (pivot[move] - pivot[before])
        aside = self.chord[before] + share * (self.chord[move] - self.chord[before])
        bow = share * (1.0 - share) * ((1.0 - share) * self.bows[move, 0] - share * self.bows[move, 1])
        return straight + bow, aside - bow

    def lengths(self, pivot: Array) -> Array:
        """Compute the lengths of the moves to locations, (n,) mm; 0 for the first."""
        step = np.diff(pivot, axis=0, prepend=pivot[:1])
        length = np.linalg.norm(step, axis=1)
        some = np.flatnonzero(self.bent)
        first, second = self.bows[some, 0], self.bows[some, 1]
        length[some] = sum(
            weight * np.linalg.norm(step[some] + _slope(first, second, s), axis=1)
            for s, weight in NODES.items()
        )
        return length

    def refined(self, pivot: Array, row: Array) -> tuple[Array, Curve]:
        """Insert locations at fractional rows: the parts of a cubic are cubics, so the curve stays the same.

        A part that spans given locations becomes a chord. Returned are the pivots, (m, 3) mm, and their
        curve.
        """
        point, chord = self.between(pivot, row)
        bows = np.zeros((len(row), 2, 3))
        move = np.ceil(row[1:]).astype(np.int64)
        inner = np.flatnonzero((np.floor(row[:-1]) + 1 == move) & self.bent[move])
        if len(inner):
            at = move[inner]
            first, second = self.bows[at, 0], self.bows[at, 1]
            part = (row[inner + 1] - row[inner])[:, None]
            step = point[inner + 1] - point[inner]
            for end in (0, 1):
                s = (row[inner + end] - at + 1)[:, None]
                slope = pivot[at] - pivot[at - 1] + _slope(first, second, s)
                bows[inner + 1, end] = slope * part - step
        return point, Curve(bows, chord)


def _slope(first: Array, second: Array, s: Array | float) -> Array:
    """Return the derivative of the bow by the share of the move, (m, 3) mm."""
    return (1.0 - s) * (1.0 - 3.0 * s) * first - s * (2.0 - 3.0 * s) * second


def _places(row: Array) -> tuple[IntArray, Array]:
    """Return the move that fractional rows, (m,), lie in, by the row where it ends, and its share, (m, 1)."""
    move = np.maximum(np.ceil(row), 0.0).astype(np.int64)
    return move, np.where(move > 0, row - move + 1.0, 1.0)[:, None]


def _bows(pivot: Array, normal: Array, smooth: BoolArray) -> Array:
    """Find the bows of n − 1 moves, (n − 1, 2, 3) mm."""
    step = np.diff(pivot, axis=0)
    length = np.linalg.norm(step, axis=1)
    turn = angle_between(normal[:-1], normal[1:])
    curved = smooth & (length > SHORTEST) & ~(turn > MOST_TURN)
    bows = np.zeros((len(step), 2, 3))
    if curved.sum() < 2:
        return bows
    unit = np.divide(step, length[:, None], out=np.zeros_like(step), where=curved[:, None])
    tangent, curvature = _osculating(unit, length, curved)
    ends = np.stack([tangent[:-1], tangent[1:]], axis=1)
    known = np.asarray(ends.any(axis=2))
    # At an end without a tangent of its own the curve is an arc, which meets its chord at one angle twice.
    for end in (0, 1):
        lone = ~known[:, end] & known[:, 1 - end]
        other = ends[lone, 1 - end]
        ends[lone, end] = 2.0 * _along(unit[lone], other) * unit[lone] - other
    bow = np.maximum(curvature[:-1], curvature[1:]) * length**2 / 8.0
    some = np.flatnonzero(curved & (bow >= NO_BOW) & (bow <= MOST_BOW))
    # A cubic follows an arc over the chord c whose tangents are at the angle α to it if its derivative is
    # c / cos² (α / 2) long at both ends.
    size = 2.0 * length[some, None, None] / (1.0 + _along(unit[some, None], ends[some]))
    bows[some] = size * ends[some] - step[some, None]
    return bows


def _osculating(unit: Array, length: Array, curved: BoolArray) -> tuple[Array, Array]:
    """Find tangent, (n, 3), and curvature, (n,) 1/mm, of circles through n locations and their neighbours.

    They are zero where the curve doesn't go on smoothly. Direction, length and kind are of the n − 1 moves.
    """
    before, after = length[:-1], length[1:]
    meets = curved[:-1] & curved[1:] & (_along(unit[:-1], unit[1:])[:, 0] >= math.cos(MOST_TURN))
    meets &= np.maximum(before, after) <= LONGEST_RATIO * np.minimum(before, after)
    # The chord a is at an angle to the tangent whose sine is a / 2R.
    mean = after[:, None] * unit[:-1] + before[:, None] * unit[1:]
    ahead = normalise(np.where(meets[:, None], mean, 1.0))
    across = np.linalg.norm(before[:, None] * unit[:-1] + after[:, None] * unit[1:], axis=1, keepdims=True)
    towards = 2.0 * cross(cross(unit[:-1], unit[1:]), ahead)
    bend = np.divide(towards, across, out=np.zeros_like(towards), where=meets[:, None])
    size = np.linalg.norm(bend, axis=1)
    pairs = np.sum(bend[:-1] * bend[1:], axis=1)
    alike = np.maximum(np.append(pairs, -np.inf), np.append(-np.inf, pairs)) >= ALIKE * size**2
    smooth = meets & (alike | (size * np.maximum(before, after) ** 2 / 8.0 < LEAST_BOW))
    tangent, curvature = np.zeros((len(length) + 1, 3)), np.zeros(len(length) + 1)
    tangent[1:-1], curvature[1:-1] = np.where(smooth[:, None], ahead, 0.0), np.where(smooth, size, 0.0)
    return tangent, curvature


def _along(one: Array, other: Array) -> Array:
    """Return the products of rows of vectors, (..., 3) → (..., 1)."""
    return np.sum(one * other, axis=-1, keepdims=True)
