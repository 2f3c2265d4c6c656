"""A path in time: phases along it, and those of constant acceleration from the speeds at its nodes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.model.motion.rounding import RoundedPath
from fiveaxis.model.motion.timing import AxisBounds

# mm: nodes closer together are one.
ONE_NODE = 1e-9
# s: shorter phases are rounding.
BRIEFEST = 1e-12
# Intervals in the distance over which the axes brake from the feed: within one, the kink between accelerating
# and braking is lost.
NODES_PER_BRAKING = 8.0
# Nodes of a parabola: at least, per unit of |d₂ − d₁| (slopes must change little in an interval), at most.
FEWEST_NODES, NODES_PER_TURN, MOST_NODES = 2, 16.0, 32
# Largest ratio of an axis's slopes at the ends of an interval at which each end has its own speed bound.
FARTHEST_RATIO = 1.5
# Most steps of Newton's method on a convex, piecewise linear function; it takes two or three.
MOST_STEPS = 50
# Slopes below this share of the change of q' in a corner are 0: A / g would exceed the precision of w.
NO_SLOPE = 1e-9


@dataclass(frozen=True, eq=False)
class Phases:
    """Intervals of time in which the station is a polynomial, in order.

    Parameters
    ----------
    station : (p,), mm, at the start of each
    path_speed : (p,), mm/s, at the start; that of the station, u̇
    path_acceleration : (p,), mm/s², at the start
    duration : (p,), s
    block : (p,), row of the motion at which the phase's move ends
    higher : (p, 3), coefficients of the third to fifth power of the time since the start; 0 where the path
        speed changes linearly
    """

    station: Array
    path_speed: Array
    path_acceleration: Array
    duration: Array
    block: IntArray
    higher: Array

    def __len__(self) -> int:
        return len(self.duration)

    @cached_property
    def start(self) -> Array:
        """(p,), s, time at the start of each."""
        return np.cumsum(self.duration) - self.duration

    @property
    def end_path_speed(self) -> Array:
        """(p,), mm/s."""
        return np.maximum(self.within(np.arange(len(self)), self.duration)[1], 0.0)

    @property
    def end_station(self) -> Array:
        """(p,), mm."""
        return self.within(np.arange(len(self)), self.duration)[0]

    def within(self, phase: IntArray, t: Array) -> Array:
        """Compute the station and three derivatives in phases, at times since their starts, (4, s)."""
        c0, c1, c2 = self.station[phase], self.path_speed[phase], 0.5 * self.path_acceleration[phase]
        c3, c4, c5 = self.higher[phase].T
        return np.stack(
            [
                c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
                c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
                2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
                6.0 * c3 + t * (24.0 * c4 + t * 60.0 * c5),
            ]
        )

    def at(self, time: Array) -> Array:
        """Compute the station and three derivatives at times, (4, s); at rest outside."""
        if len(self) == 0:
            return np.zeros((4, len(time)))
        phase = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, None)
        found = self.within(phase, np.clip(time - self.start[phase], 0.0, self.duration[phase]))
        found[1] = np.maximum(found[1], 0.0)
        found[1:, (time < 0.0) | (time > self.start[-1] + self.duration[-1])] = 0.0
        return found


@dataclass(frozen=True, eq=False)
class _Grid:
    """A path divided into intervals, each within one block and on one straight side or half of a parabola.

    ``side``, ``blend`` and ``bend`` (s,) are those of `highest_speeds`; ``ceiling`` (s + 1,) is the highest
    squared path speed at each node, ``top`` (s,) within each straight piece; ``block`` (s,) is a row.
    """

    node: Array
    side: IntArray
    blend: Array
    bend: Array
    block: IntArray
    top: Array
    ceiling: Array


def run_phases(
    path: RoundedPath, station: Array, path_speed: Array, dwelling: Array, bounds: AxisBounds
) -> Phases:
    """Compute the phases, of positive duration, of the fastest run along a path within its bounds.

    Parameters
    ----------
    station : (n,), mm, of the rows
    path_speed : (n,), mm/s, at the feed of each block; NaN where nothing moves
    dwelling : (n,), s, rest at each row; 0 for none
    """
    if path.length == 0.0:
        none = np.zeros(0)
        rest = Phases(none, none, none, none, none.astype(np.int64), np.zeros((0, 3)))
        return with_dwells(rest, station, dwelling)
    grid = _cut(path, station, path_speed, bounds)
    speeds = highest_speeds(
        path.directions,
        grid.side,
        grid.blend,
        grid.bend,
        np.diff(grid.node),
        grid.ceiling,
        bounds.acceleration,
    )
    return with_dwells(_phases(path, grid, speeds, bounds), station, dwelling)


def _cut(path: RoundedPath, station: Array, path_speed: Array, bounds: AxisBounds) -> _Grid:
    node = _nodes(path, station, path_speed, bounds)
    middle = (node[1:] + node[:-1]) / 2.0
    corner = path.nearest(middle)
    arm = path.arm[corner]
    curved = np.abs(middle - path.station[corner]) < arm
    twice = np.where(curved, 2.0 * arm, 1.0)
    side = np.where(curved, corner - 1, path.side(middle))
    ends = np.stack([node[:-1], node[1:]])
    blends = np.where(curved, np.clip((ends - path.station[corner] + arm) / twice, 0.0, 1.0), 0.0)
    # The first row at or after an interval's middle, as rows that stand still share a station.
    block = np.searchsorted(station, middle)
    first, second = path.directions[side], path.directions[np.minimum(side + 1, len(path.directions) - 1)]
    slopes = first + blends[:, :, None] * (second - first)
    top = np.minimum(path_speed[block] ** 2, _speed_ceilings(slopes, bounds.speed))
    ceiling = np.minimum(np.append(top[0], 0.0), np.append(0.0, top[1]))
    if not bounds.accelerates_at_once:
        stops = path.station[path.arm == 0.0]
        ceiling[np.searchsorted(node, stops - ONE_NODE)] = 0.0
    return _Grid(node, side, blends[0], np.where(curved, 1.0 / twice, 0.0), block, top[0], ceiling)


def _speed_ceilings(slopes: Array, speed: Array) -> Array:
    """Bound the squared path speed at both ends of intervals, (2, s) (mm/s)², so that no axis is too fast.

    An axis runs at ``g √x`` with g and x both linear. If both ends were at its bound v, with slopes of ratio
    r, it would reach ``g² x = v² · 4 (r² + r + 1)³ / (27 r² (r + 1)²)`` at ``(2 r + 1) / (3 r + 3)`` of the
    interval. For r near 1 that is hardly more than v², and both ends are lowered by the ratio; otherwise the
    steeper end bounds both. Slopes, (2, s, k), are q' at start and end.
    """
    steep, flat = np.abs(slopes).max(axis=0), np.abs(slopes).min(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):  # an axis that stands sets no bound
        r = steep / flat
        near = (slopes[0] * slopes[1] > 0.0) & (r < FARTHEST_RATIO)
        room = np.where(near, 27.0 * r**2 * (r + 1.0) ** 2 / (4.0 * (r**2 + r + 1.0) ** 3), 1.0)
        return (room * (speed / np.where(near, np.abs(slopes), steep)) ** 2).min(axis=2)


def _nodes(path: RoundedPath, station: Array, path_speed: Array, bounds: AxisBounds) -> Array:
    """Collect the stations at which bounds or slopes change, and enough of them on the parabolas."""
    inner = np.flatnonzero(path.arm > 0.0)
    arm, first, second = path.arm[inner], path.directions[inner - 1], path.directions[inner]
    moving = np.flatnonzero(np.isfinite(path_speed))
    row = np.searchsorted(station[moving], path.station[inner])
    feed = np.minimum(path_speed[moving[row]], path_speed[moving[row + 1]])
    turn = np.abs(second - first).max(axis=1, initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        path_acceleration = (bounds.acceleration / np.maximum(np.abs(first), np.abs(second))).min(
            axis=1, initial=np.inf
        )
        braking = 4.0 * arm * path_acceleration / feed**2 * NODES_PER_BRAKING
    braking = np.where(np.isfinite(braking), braking, 0.0)
    wanted = np.clip(np.maximum(braking, NODES_PER_TURN * turn), FEWEST_NODES, MOST_NODES)
    parts = 2 * np.ceil(wanted / 2.0).astype(np.int64)  # even: the corner itself ends a block
    owner = np.repeat(np.arange(len(inner)), parts + 1)
    part = np.arange(len(owner)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)
    share = 2.0 * part / parts[owner] - 1.0
    nodes = np.unique(
        np.concatenate([station, path.station, path.station[inner][owner] + share * arm[owner]])
    )
    return nodes[np.diff(nodes, prepend=-np.inf) > ONE_NODE]


def _phases(path: RoundedPath, grid: _Grid, speeds: Array, bounds: AxisBounds) -> Phases:
    """Build three phases on a straight side (accelerate, cruise, brake), one on a piece of a parabola."""
    length, straight = np.diff(grid.node), grid.bend == 0.0
    start, end = speeds[:-1], speeds[1:]
    with np.errstate(divide="ignore"):
        path_acceleration = (bounds.acceleration / np.abs(path.directions[grid.side])).min(axis=1)
    peak = np.minimum(grid.top, 0.5 * (start + end) + path_acceleration * length)
    peak = np.where(straight, np.maximum(peak, np.maximum(start, end)), start)
    rising, falling = ((peak - x) / (2.0 * path_acceleration) for x in (start, end))
    pieces = np.stack([rising, length - rising - falling, falling], axis=1)
    whole = np.stack([length, 0 * length, 0 * length], axis=1)
    pieces = np.where(straight[:, None], np.maximum(pieces, 0.0), whole)
    path_speeds = np.sqrt(np.stack([start, peak, peak, end], axis=1))
    path_speeds[~straight, 1:] = path_speeds[~straight, 3:]
    return _timed(grid, pieces, path_speeds)


def _timed(grid: _Grid, pieces: Array, path_speeds: Array) -> Phases:
    """Turn pieces of intervals, (s, 3) mm, with the path speeds at their ends, (s, 4), into phases."""
    used = pieces > 0.0
    station = (grid.node[:-1, None] + np.cumsum(pieces, axis=1) - pieces)[used]
    path_speed, after = path_speeds[:, :-1][used], path_speeds[:, 1:][used]
    duration = 2.0 * pieces[used] / (path_speed + after)
    block = np.broadcast_to(grid.block[:, None], pieces.shape)[used]
    path_acceleration = (after - path_speed) / duration
    long = duration > BRIEFEST
    none = np.zeros((int(long.sum()), 3))
    return Phases(station[long], path_speed[long], path_acceleration[long], duration[long], block[long], none)


def with_dwells(phases: Phases, station: Array, dwelling: Array) -> Phases:
    """Insert rests at the rows that have them."""
    rows = np.flatnonzero(dwelling)
    at = np.searchsorted(phases.station, station[rows] - ONE_NODE)
    rests = {"station": station[rows], "duration": dwelling[rows], "block": rows}
    columns = {field.name: getattr(phases, field.name) for field in fields(phases)}
    inserted = {name: np.insert(column, at, rests.get(name, 0.0), axis=0) for name, column in columns.items()}
    return replace(phases, **inserted)


@compiled
def highest_speeds(
    directions: Array,
    before: IntArray,
    blend: Array,
    bend: Array,
    length: Array,
    ceiling: Array,
    acceleration: Array,
) -> Array:
    """Find the highest squared speeds at the nodes of a path from rest to rest.

    A backward pass finds the highest speeds from which the rest of the path can be run within bounds; all
    lower speeds are possible too. A forward pass accelerates as much as these allow.

    Parameters
    ----------
    directions : (m, k), per mm, q' on the straight sides of the path
    before : (s,), the side on which, or after which, each interval lies
    blend : (s,), share of the change from that side's q' to the next one's at the interval's start, 0 … 1
    bend : (s,), 1/mm, rate of that change; 0 on a straight side
    length : (s,), mm
    ceiling : (s + 1,), (mm/s)², bound at the nodes by feed, axis speeds and stops
    acceleration : (k,), mm/s² and rad/s²; infinite for no bound

    Returns
    -------
    (s + 1,), (mm/s)²
    """
    n = len(length)
    reached = ceiling.copy()
    last = len(directions) - 1
    for i in range(n - 1, -1, -1):
        first, second = directions[before[i]], directions[min(before[i] + 1, last)]
        if bend[i] == 0.0:
            within = reached[i + 1] + 2.0 * _along_side(first, acceleration) * length[i]
            reached[i] = min(reached[i], within)
        else:
            reached[i] = _controllable(
                first, second, blend[i], bend[i], length[i], acceleration, reached[i], reached[i + 1]
            )
    for i in range(n):
        first, second = directions[before[i]], directions[min(before[i] + 1, last)]
        if bend[i] == 0.0:
            most = _along_side(first, acceleration)
        else:
            _, _, most, _ = _range_at(
                reached[i], first, second, blend[i], bend[i], length[i], acceleration, reached[i + 1]
            )
        reached[i + 1] = min(reached[i + 1], max(reached[i] + 2.0 * most * length[i], 0.0))
    return reached


@compiled
def _along_side(direction: Array, acceleration: Array) -> float:
    """Return the highest acceleration along a straight side."""
    most = np.inf
    for a in range(len(direction)):
        if direction[a] != 0.0:
            most = min(most, acceleration[a] / abs(direction[a]))
    return most


@compiled
def _controllable(
    first: Array,
    second: Array,
    blend: float,
    bend: float,
    length: float,
    acceleration: Array,
    ceiling: float,
    following: float,
) -> float:
    """Find the highest x at an interval's start from which some w leads to at most `following` at its end.

    The lower end of the range of w is convex in x, the upper one concave, and at x = 0 the range contains 0.
    Newton's method from the right therefore ends exactly at the highest x at which they meet.
    """
    x = ceiling
    for a in range(len(first)):
        # Where an axis reverses, its acceleration depends on x alone.
        f = bend * (second[a] - first[a])
        start = first[a] + blend * (second[a] - first[a])
        none = NO_SLOPE * abs(second[a] - first[a])
        if f != 0.0 and (abs(start) <= none or abs(start + 3.0 * length * f) <= none):
            x = min(x, acceleration[a] / abs(f))
    for _ in range(MOST_STEPS):
        low, low_slope, high, high_slope = _range_at(
            x, first, second, blend, bend, length, acceleration, following
        )
        # Slopes are equal up to rounding only where the bounds hold anyway.
        if low <= high or not low_slope > high_slope:
            break
        x -= (low - high) / (low_slope - high_slope)
    return max(x, 0.0)


@compiled
def _range_at(
    x: float,
    first: Array,
    second: Array,
    blend: float,
    bend: float,
    length: float,
    acceleration: Array,
    following: float,
) -> tuple[float, float, float, float]:
    """Compute the range of w at squared speed x, and the derivatives of its ends with respect to x.

    At the start an axis accelerates at ``g w + f x`` with ``g = q'``, ``f = q''``. At the end of the interval
    of length h, ``q' + h q''`` and ``x + 2 h w`` replace q' and x, so ``g = q' + 3 h q''``.
    """
    low, low_slope = -x / (2.0 * length), -0.5 / length
    high, high_slope = (following - x) / (2.0 * length), -0.5 / length
    for a in range(len(first)):
        if acceleration[a] == np.inf:
            continue
        f = bend * (second[a] - first[a])
        start = first[a] + blend * (second[a] - first[a])
        none = NO_SLOPE * abs(second[a] - first[a])
        for g in (start, start + 3.0 * length * f):
            if abs(g) <= none:
                continue
            # g w + f x ≤ A and ≥ −A; for g < 0 the two are exchanged.
            bound = acceleration[a] / abs(g)
            slope = -f / g
            if slope * x - bound > low:
                low, low_slope = slope * x - bound, slope
            if slope * x + bound < high:
                high, high_slope = slope * x + bound, slope
    return low, low_slope, high, high_slope
