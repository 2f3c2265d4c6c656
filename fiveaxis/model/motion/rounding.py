"""A path in axis space with its corners rounded, so that axes can pass them without stopping.

Axes run straight from row to row. Lengths along the path, its *stations*, are measured in mm with a lever for
rotary axes, ``|Δ|² = Σ Δ_linear² + (lever · Δ_rotary)²``, and stay those of the polygon. With the unit
vectors ``d₁``, ``d₂`` before and after a corner at station U, the path within ``a`` of it is the parabola

    q(u) = q_polygon(u) + (d₂ − d₁) (a − |u − U|)² / (4 a),        q'' = (d₂ − d₁) / (2 a),

which is tangential to both sides and passes the corner at a distance of ``a |d₂ − d₁| / 4``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model.motion.timing import STANDSTILL

# Directions that differ by less are equal but for rounding.
STRAIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class RoundedPath:
    """A polygon with rounded corners in axis space.

    Parameters
    ----------
    corners : (m, k), mm and rad, start, corners and end; axes run straight between them
    station : (m,), mm, of the corners along the polygon
    directions : (m − 1, k), change of the axis values per mm of station on each side
    arm : (m,), mm, reach of a corner's parabola before and after it; 0 at start, end and stops
    """

    corners: Array
    station: Array
    directions: Array
    arm: Array

    @property
    def length(self) -> float:
        """Station of the end, mm."""
        return float(self.station[-1])

    def nearest(self, station: Array) -> IntArray:
        """Find the corner whose parabola may reach a station."""
        side = self.side(station)
        return side + (station > self.station[side + 1] - self.arm[side + 1])

    def side(self, station: Array) -> IntArray:
        """Find the side of the polygon on which a station lies."""
        found = np.searchsorted(self.station, station, side="right") - 1
        return np.clip(found, 0, len(self.directions) - 1)

    def at(self, station: Array) -> tuple[Array, Array, Array]:
        """Compute axis values, mm and rad, and two derivatives per mm, (s, k) each, at stations, (s,) mm."""
        side, corner = self.side(station), self.nearest(station)
        ahead = station - self.station[side]
        position = self.corners[side] + ahead[:, None] * self.directions[side]
        slope = self.directions[side]
        arm, bend = self.arm[corner], self.bends[corner]
        offset = station - self.station[corner]
        inside = np.maximum(arm - np.abs(offset), 0.0)[:, None]
        toward = np.where(offset < 0.0, 1.0, -1.0)[:, None]
        position = position + 0.5 * bend * inside**2
        return position, slope + toward * bend * inside, np.where(inside > 0.0, bend, 0.0)

    @property
    def bends(self) -> Array:
        """(m, k), per mm²: second derivative in each corner's parabola; 0 without one."""
        turns = np.zeros_like(self.corners)
        turns[1:-1] = np.diff(self.directions, axis=0)
        twice = 2.0 * self.arm[:, None]
        return np.divide(turns, twice, out=np.zeros_like(turns), where=twice > 0.0)


def round_corners(
    positions: Array, lever: Array, stops: BoolArray, *, tolerance: float, smooth: float
) -> tuple[RoundedPath, Array]:
    """Round the corners of a path, each within its tolerance and its share of the sides.

    A corner's arm ends where its neighbour's begins: a side is shared in proportion to the shorter sides of
    its two corners. On a sampled curve all arms meet, and the parabolas have the curve's curvature. A corner
    is part of such a curve if its widest parabola passes it closely enough.

    Parameters
    ----------
    positions : (n, k), mm and rad
    lever : (k,), 1 for linear axes, mm per rad for rotary ones
    stops : (n,), rows with a stop in any case
    tolerance : mm, within which a corner must be passed; 0 stops there
    smooth : mm, a corner whose widest parabola passes it within this is part of a curve and gets no stop

    Returns
    -------
    The path without rows that stand still or lie on a straight line, and the station of every row, (n,) mm
    """
    kept = _moving_rows(positions * lever)
    last = np.searchsorted(kept, np.arange(len(positions)), side="right") - 1
    points = positions[kept]
    if len(points) == 1:  # nothing moves: a path of length 0
        nowhere = np.zeros((1, positions.shape[1]))
        return RoundedPath(np.repeat(points, 2, axis=0), np.zeros(2), nowhere, np.zeros(2)), np.zeros(
            len(last)
        )
    held = np.zeros(len(kept), dtype=bool)
    held[last[stops]] = True
    lengths, units = _sides(points, lever)
    bent = np.linalg.norm(np.diff(units, axis=0) * lever, axis=1) > STRAIGHT
    rows = np.concatenate([[0], np.flatnonzero(bent | held[1:-1]) + 1, [len(points) - 1]])
    sides, directions = _sides(points[rows], lever)
    turns = np.linalg.norm(np.diff(directions, axis=0) * lever, axis=1)
    share = np.where(held[rows][1:-1], 0.0, _shares(sides))
    # Passed at a distance of a·|Δd|/4.
    near = np.where(share * turns <= 4.0 * max(smooth, tolerance), np.inf, 4.0 * tolerance)
    arm = np.minimum(share, np.divide(near, turns, out=np.zeros_like(turns), where=turns > 0.0))
    station = _ends(sides)
    path = RoundedPath(points[rows], station, directions, np.concatenate([[0.0], arm, [0.0]]))
    along = _ends(lengths)
    placed: Array = np.interp(along, along[rows], station)
    return path, placed[last]


def _ends(lengths: Array) -> Array:
    """Return the stations of the ends of sides."""
    return np.concatenate([[0.0], np.cumsum(lengths)])


def _sides(points: Array, lever: Array) -> tuple[Array, Array]:
    """Return lengths and directions of a polygon's sides."""
    moves = np.diff(points, axis=0)
    lengths = np.linalg.norm(moves * lever, axis=1)
    return lengths, moves / lengths[:, None]


def _shares(sides: Array) -> Array:
    """Divide each side between its corners: return the largest arm of every corner, (m − 2,)."""
    if len(sides) < 2:
        return np.zeros(0)
    weight = np.minimum(sides[:-1], sides[1:])
    # Start and end take as much as a corner would, which leaves a straight piece there.
    weight = np.concatenate([sides[:1], weight, sides[-1:]])
    near = sides * weight[:-1] / (weight[:-1] + weight[1:])
    return np.minimum((sides - near)[:-1], near[1:])


def _moving_rows(scaled: Array) -> IntArray:
    """Find the rows that differ from the row kept before them."""
    steps = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
    # The row before is within STANDSTILL of the last kept one, so rows beyond twice that differ from both.
    kept = np.concatenate([[True], steps > 2.0 * STANDSTILL])
    last = 0
    for row in np.flatnonzero(~kept).tolist():
        # Measured from the last kept row, as many tiny steps add up to a move.
        last = row - 1 if kept[row - 1] else last
        kept[row] = np.linalg.norm(scaled[row] - scaled[last], axis=-1) > STANDSTILL
    return np.flatnonzero(kept)
