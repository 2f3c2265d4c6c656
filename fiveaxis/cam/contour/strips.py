"""The surface that a leaned cutter leaves beside a pass, measured along rays.

Between two locations tip and tool axis go evenly. A ray off the part meets what remains of the stock until
the cutter, at some place of the pass, comes down to it: its shortest clear length over the nearest part of
the pass is found by sphere tracing, with the distance to the cutter at the place where that is smallest.
Importing this module loads numba.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.model import Toolpath, Zone

# Golden section; stations of a pass of which the best begins it; mm, where it ends.
GOLDEN, COARSE, FINE = (math.sqrt(5.0) - 1.0) / 2.0, 9, 1e-4
# Most steps of a trace; mm, where it ends.
TRACED, NEAR = 60, 1e-6
# mm: a pass whose ends are nearer to each other is closed.
CLOSED = 1e-3


@dataclass(frozen=True, eq=False)
class Strips:
    """The passes of a leaned cutter; a closed one goes on at both ends by what precedes and follows there.

    Parameters
    ----------
    tips, axes : (m, 3), mm and unit vectors
    stations : (m,), mm, along the passes: of the contact, and of the turning cutter's farthest point
    first, last : (m,), mm, stations of the ends of the pass that each row belongs to
    rows : (n,), of the locations that cut
    zone : of the profile that touches; flat bottom and side go on from its arc
    reach : mm, how far along a pass the cutter is looked for, and the largest height
    """

    tips: Array
    axes: Array
    stations: Array
    first: Array
    last: Array
    rows: IntArray
    zone: Zone
    reach: float

    @classmethod
    def of(cls, toolpath: Toolpath, rows: IntArray, points: Array) -> Strips:
        """Take the passes from a path with tool axes: its n rows that cut, and their contacts, (n, 3) mm."""
        reach, count = toolpath.tool.radius, 0
        taken: list[IntArray] = []
        own: list[IntArray] = []
        for each in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) != 1) + 1):
            before = after = each[:0]
            if len(each) > 2 and np.linalg.norm(points[each[0]] - points[each[-1]], axis=-1) < CLOSED:
                length = np.cumsum(np.linalg.norm(np.diff(points[each], axis=0), axis=1))
                before = each[:-1][np.append(0.0, length[:-1]) > length[-1] - 2.0 * reach]
                after = each[1:][length < 2.0 * reach]
            own.append(count + len(before) + np.arange(len(each)))
            taken.append(np.concatenate([before, each, after]))
            count += len(taken[-1])
        sizes = np.array([len(some) for some in taken])
        first, every = np.repeat(np.cumsum(sizes) - sizes, sizes), np.concatenate(taken)
        axes = toolpath.axis[rows][every]
        moved, turned = (np.diff(column, axis=0, prepend=column[:1]) for column in (points[every], axes))
        steps = np.linalg.norm(moved, axis=1) + reach * np.linalg.norm(turned, axis=1)
        stations = np.cumsum(np.maximum(steps, NEAR))
        return cls(
            tips=toolpath.tips(toolpath.axis)[rows][every],
            axes=axes,
            stations=stations,
            first=stations[first],
            last=stations[first + np.repeat(sizes, sizes) - 1],
            rows=np.concatenate(own),
            zone=toolpath.zone,
            reach=reach,
        )

    def heights(self, points: Array, up: Array, places: Array) -> tuple[Array, BoolArray]:
        """Measure how high above points the cutter clears the stock, (m,) mm; infinite where it isn't met.

        Points and directions up are (m, 3), mm and unit vectors; places (m,), fractional numbers of the
        locations of the pass nearest to each. Returned is, too, whether the cutter stands there at an end of
        its pass, and hasn't gone by.
        """
        number = np.floor(places).astype(np.int64)
        row = self.rows[number]
        along = np.interp(row + places - number, np.arange(len(self.stations)), self.stations)
        low, high = (
            np.clip(along + side * self.reach, self.first[row], self.last[row]) for side in (-1.0, 1.0)
        )
        profile = float(self.zone.radius), float(self.zone.offset), float(self.zone.height)
        swept = _Swept(self.tips, self.axes, self.stations, *profile)
        heights, at = _heights(points, up, swept, low, high, float(self.reach))
        ends = np.minimum(at - self.first[row], self.last[row] - at)
        return heights, np.asarray(ends < 10.0 * FINE)


class _Swept(NamedTuple):
    """Passes for compiled loops: arrays of `Strips`, and the zone's figures, mm."""

    tips: Array
    axes: Array
    stations: Array
    radius: float
    offset: float
    height: float


@compiled
def _heights(
    points: Array, up: Array, swept: _Swept, low: Array, high: Array, reach: float
) -> tuple[Array, Array]:
    found, at = np.empty(len(points)), np.empty(len(points))
    for i in range(len(points)):
        height = 0.0
        for _ in range(TRACED):
            gap, at[i] = _nearest(points[i] + height * up[i], swept, low[i], high[i])
            if gap < NEAR or height > reach:
                break
            height += gap
        found[i] = height if height <= reach else np.inf
    return found, at


@compiled
def _nearest(point: Array, swept: _Swept, low: float, high: float) -> tuple[float, float]:
    """Find the smallest distance to the cutter over a part of its pass, mm, and the station of it."""
    step = (high - low) / (COARSE - 1)
    best, least = 0, np.inf
    for k in range(COARSE):
        gap = _gap(point, swept, low + k * step)
        if gap < least:
            best, least = k, gap
    low, high = low + max(best - 1, 0) * step, low + min(best + 1, COARSE - 1) * step
    inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_inner, at_outer = _gap(point, swept, inner), _gap(point, swept, outer)
    while high - low > FINE:
        if at_inner < at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - GOLDEN * (high - low)
            at_inner = _gap(point, swept, inner)
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + GOLDEN * (high - low)
            at_outer = _gap(point, swept, outer)
    return min(at_inner, at_outer, least), (low + high) / 2.0


@compiled
def _gap(point: Array, swept: _Swept, station: float) -> float:
    """Measure the distance, mm, to the cutter at a station; at most 0 inside."""
    tips, axes, stations = swept.tips, swept.axes, swept.stations
    row = min(max(int(np.searchsorted(stations, station)) - 1, 0), len(tips) - 2)
    share = (station - stations[row]) / (stations[row + 1] - stations[row])
    square = along = length = 0.0
    for k in range(3):
        axis = (1.0 - share) * axes[row, k] + share * axes[row + 1, k]
        away = point[k] - (1.0 - share) * tips[row, k] - share * tips[row + 1, k]
        square += away * away
        along += away * axis
        length += axis * axis
    along /= math.sqrt(length)
    across = math.sqrt(max(0.0, square - along * along)) - swept.offset
    if swept.offset > 0.0:
        across = max(across, 0.0)
    return math.hypot(across, min(along - swept.height, 0.0)) - swept.radius
