"""The quickest run along a smooth path within speeds, accelerations and jerks.

Between two stops the path gets a parameter r that counts intervals of about equal times under a known law:
first that without jerk, then a rough one with it. The station is a smooth function of r, and at a stop
proportional to r³ at first, as under a constant jerk: so ``ṙ`` hardly changes, and nothing is singular.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model.motion.jerk_barrier import (
    SHARES,
    PointLimits,
    centre,
    largest_shares,
    merit,
    spline_basis,
)
from fiveaxis.model.motion.phases import BRIEFEST, ONE_NODE, Phases
from fiveaxis.model.motion.smoothing import SmoothPath
from fiveaxis.model.motion.timing import AxisBounds

# Intervals in the shortest time in which an axis' jerk takes it to its acceleration, of either run.
PER_RAMP = (4.0, 7.0)
# Fewest intervals of a run; most for each row, beside so many; in an arm of a corner; at a stop, as a lead.
FEWEST, MOST_PER_ROW, MOST, PER_ARM, LEAD = 64, 2, 400, 6.0, 12
# A path speed that changes by less than this share in an interval is a cruise, with few intervals.
STEADY = 1e-3
# By how much an interval may be longer than its neighbour; over how many, and how often, that is smoothed.
GROWTH, SMOOTHED, PASSES = 0.08, 5, 4
# Weight of the barrier as a share of the time, at first and at last, in either run; by what factor it falls;
# Newton decrement, as a share of it, up to which a point is at the centre.
WEIGHTS, FALLING, CENTRED = ((0.06, 0.01), (0.004, 1e-3)), 0.25, 0.3
# Lowest and highest ṙ², in intervals per time that one takes about: where nothing else is a bound.
SLOWEST, FASTEST = 1e-6, 100.0
# Factor by which a run may be slowed down; attempts at it; power of an excess by which limits are tightened
# for the next; over how many intervals on both sides.
GOAL, ATTEMPTS, OVER, BESIDE = 1.002, 3, 2.0, 4
# Places of a phase, its ends included, at which its limits are checked.
PLACES = 9
# Gauss points of an interval from 0 to 1, for integrals, and their weights.
POINTS, SIZES = 0.5 * np.array(np.polynomial.legendre.leggauss(4)) + [[0.5], [0.0]]
# Most steps to the time at a row; s, the error.
MOST_STEPS, TIME_ERROR = 60, 1e-13


def _slowed(phases: Phases, factor: float) -> Phases:
    """Let phases take so many times as long."""
    return replace(
        phases,
        path_speed=phases.path_speed / factor,
        path_acceleration=phases.path_acceleration / factor**2,
        duration=phases.duration * factor,
        higher=phases.higher / [factor**3, factor**4, factor**5],
    )


def _cut(phases: Phases, rows: Array) -> Phases:
    """Divide phases at the stations of rows, (n,) mm; each then lies in the block of one row."""
    node = np.append(phases.station, phases.end_station[-1:])
    inner = np.unique(rows[(rows > node[0] + ONE_NODE) & (rows < node[-1] - ONE_NODE)])
    phase = np.clip(np.searchsorted(node, inner, side="right") - 1, 0, len(phases) - 1)
    low, high = np.zeros(len(phase)), phases.duration[phase].copy()
    t = high * (inner - node[phase]) / np.diff(node)[phase]
    for _ in range(MOST_STEPS):
        station, path_speed, _, _ = phases.within(phase, t)
        over = station > inner
        low, high = np.where(over, low, t), np.where(over, t, high)
        better = t - (station - inner) / np.maximum(path_speed, BRIEFEST)
        better = np.where((better > low) & (better < high), better, 0.5 * (low + high))
        moved, t = np.abs(better - t).max(initial=0.0), better
        if moved < TIME_ERROR:
            break
    owner = np.append(np.arange(len(phases)), phase)
    begin = np.append(np.zeros(len(phases)), t)
    order = np.lexsort((begin, owner))
    owner, begin = owner[order], begin[order]
    end = np.where(np.diff(owner, append=-1) == 0, np.append(begin[1:], 0.0), phases.duration[owner])
    long = end - begin > BRIEFEST
    owner, begin, end = owner[long], begin[long], end[long]
    station, path_speed, path_acceleration, path_jerk = phases.within(owner, begin)
    c4 = phases.higher[owner, 1] + 5.0 * phases.higher[owner, 2] * begin
    block = np.searchsorted(rows, phases.within(owner, 0.5 * (begin + end))[0])
    higher = np.stack([path_jerk / 6.0, c4, phases.higher[owner, 2]], axis=1)
    return Phases(station, path_speed, path_acceleration, end - begin, block, higher)


@dataclass(frozen=True, eq=False)
class _Course:
    """The station as a function of r: ``w' = e s``, a spline s, and ``e = 6 p² − 8 p³ + 3 p⁴`` at both ends.

    There p is r / LEAD or that from the end; at p = 1 ``e`` is 1, with two derivatives of 0.

    Parameters
    ----------
    spline : (n + 3,), coefficients of s
    node : (n + 1,), mm, station at whole r
    """

    spline: Array
    node: Array

    def __len__(self) -> int:
        return len(self.spline) - 3

    def slopes(self, r: Array) -> tuple[Array, Array, Array]:
        """Return w', w'' and w'''."""
        i = np.clip(r.astype(np.int64), 0, len(self) - 1)
        coefficients = np.stack([self.spline[i + a] for a in range(4)], axis=1)
        s, s1, s2 = (spline_basis(r - i) * coefficients).sum(axis=2)
        p = np.minimum(np.minimum(r, len(self) - r) / LEAD, 1.0)
        e = p * p * (6.0 - 8.0 * p + 3.0 * p * p)
        e1 = np.where(2.0 * r < len(self), 12.0, -12.0) / LEAD * p * (1.0 - p) ** 2
        e2 = 12.0 / LEAD**2 * (1.0 - p) * (1.0 - 3.0 * p)
        return e * s, e1 * s + e * s1, e2 * s + 2.0 * e1 * s1 + e * s2

    def at(self, r: Array) -> tuple[Array, Array, Array, Array]:
        """Return w and three derivatives with respect to r."""
        i = np.clip(r.astype(np.int64), 0, len(self) - 1)
        return self.node[i] + self.over(i.astype(float), r - i), *self.slopes(r)

    def over(self, r: Array, length: Array) -> Array:
        """Integrate w' over a length from r on, within one interval."""
        return length * sum(w * self.slopes(r + g * length)[0] for g, w in zip(POINTS, SIZES, strict=True))


def run_with_jerk(
    path: SmoothPath, station: Array, path_speed: Array, phases: Phases, bounds: AxisBounds
) -> Phases:
    """Compute the phases of the quickest run along a path within its bounds, jerk included.

    Limits hold at all times: what is left of peaks between the points at which they are limits is taken off
    by slowing the run down from stop to stop, which the time includes. Station and path speed are of the
    rows, as `run_phases`; the phases are those of the same rows without the limits of jerk, nowhere at rest.
    """
    known = np.isfinite(bounds.jerk) & np.isfinite(bounds.acceleration)
    total = float(phases.duration.sum())
    ramp = (bounds.acceleration[known] / bounds.jerk[known]).min(initial=total)
    shortest = total / (MOST + MOST_PER_ROW * len(station))
    runner = _Runner(path, station, np.fmin(path_speed, np.inf), bounds)
    stops = np.flatnonzero(path.arm == 0.0)
    runs = []
    for first, last in pairwise(stops.tolist()):
        begin, end = np.searchsorted(phases.station, path.station[[first, last]] - ONE_NODE)
        run = Phases(*(getattr(phases, field.name)[begin:end] for field in fields(Phases)))
        for solve, parts in zip((runner.rough, runner.final), PER_RAMP, strict=True):
            step = max(ramp / parts, shortest)
            run = solve(_course(path, run, first, last, step), step)
        runs.append(_cut(run, station))
    columns = ([getattr(run, field.name) for run in runs] for field in fields(Phases))
    return Phases(*(np.concatenate(column) for column in columns))


def _course(path: SmoothPath, phases: Phases, first: int, last: int, step: float) -> _Course:
    """Divide the path from one corner with a stop to another into intervals of about the time of a step, s.

    The phases are those of this part of the path under a known law.
    """
    from scipy.ndimage import uniform_filter1d  # slow to load

    begin, end = path.station[first], path.station[last]
    total = float(phases.duration.sum())
    time = np.linspace(0.0, total, max(math.ceil(2.0 * total / step), FEWEST))
    time = np.union1d(time, phases.start - phases.start[0])
    station, speed, acceleration, _ = phases.at(time + phases.start[0])
    # From and to rest a lead covers what the known law does meanwhile, hardly more than the ramp.
    gain = phases.end_path_speed - phases.path_speed
    ramps = [_ramp(phases.duration, gain), _ramp(phases.duration[::-1], -gain[::-1])]
    early = [
        min(LEAD * step, 0.5 * total, ramp + 2.0 * math.sqrt(PER_RAMP[1] * step * ramp)) for ramp in ramps
    ]
    covered = np.abs(phases.at(phases.start[0] + np.array([early[0], total - early[1]]))[0] - [begin, end])
    leads = covered / (0.6 * LEAD)
    slowest = np.where(station - begin < end - station, *leads)
    steady = np.abs(acceleration) * step < STEADY * speed
    longest = np.where(steady, np.inf, np.maximum(speed * step, slowest))
    inner = slice(first + 1, last)
    arms = path.reach[path.own[inner]]
    place = np.concatenate([[begin, end], station, path.station[inner]])
    longest = np.concatenate([leads, longest, np.where(arms > 0.0, arms / PER_ARM, np.inf)])
    order = np.argsort(place, kind="stable")
    place, longest = place[order], np.minimum(longest[order], (end - begin) / FEWEST)
    after = np.minimum.accumulate(longest - GROWTH * place) + GROWTH * place
    before = np.minimum.accumulate((longest + GROWTH * place)[::-1])[::-1] - GROWTH * place
    density = 1.0 / np.minimum(before, after)
    count = np.append(0.0, np.cumsum(np.diff(place) * 0.5 * (density[1:] + density[:-1])))
    steps = np.diff(
        np.interp(np.linspace(0.0, count[-1], max(math.ceil(count[-1]), FEWEST) + 1), count, place)
    )
    # A lead covers 0.6 of what as many whole intervals would.
    short = round(0.6 * LEAD)
    ends = [np.full(LEAD, part.sum() / (0.6 * LEAD)) for part in (steps[:short], steps[-short:])]
    steps = np.concatenate([ends[0], steps[short:-short], ends[1]])
    for _ in range(PASSES):
        steps = uniform_filter1d(steps, 2 * SMOOTHED + 1, mode="nearest")
    between = np.concatenate([steps[:1], steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:], steps[-1:]])
    whole = np.ones(len(steps))
    lengths = _Course(between, steps).over(np.arange(len(steps), dtype=float), whole)
    scale = (end - begin) / lengths.sum()
    return _Course(between * scale, begin + np.append(0.0, np.cumsum(lengths * scale)))


def _ramp(duration: Array, gain: Array) -> float:
    """Return for how long the speed grows at first, s; where the last digits decide, hardly at all."""
    return max(float(duration[: np.argmax(np.append(gain <= 0.0, True))].sum()), 1e-3 * float(duration.sum()))


@dataclass(frozen=True, eq=False)
class _Runner:
    """Runs along a path; arguments as `run_with_jerk`."""

    path: SmoothPath
    station: Array
    path_speed: Array
    bounds: AxisBounds

    def rough(self, course: _Course, step: float) -> Phases:
        """Find about the quickest run from stop to stop; it may exceed limits here and there."""
        c, _ = _quickest(self._limits(course, step), WEIGHTS[0])
        return _timed(course, c, step)

    def final(self, course: _Course, step: float) -> Phases:
        """Find the quickest run from stop to stop that keeps all limits."""
        from scipy.ndimage import maximum_filter1d  # slow to load

        limits, found = self._limits(course, step), []
        tight, inner = np.ones((len(course), 3)), None
        while True:
            c, inner = _quickest(_tightened(limits, tight), WEIGHTS[1], inner)
            phases = _timed(course, c, step)
            shares = self._shares(phases)
            speed, push, jerk = shares.max(axis=0).tolist()
            excess = max(1.0, speed, math.sqrt(push), math.cbrt(jerk))
            found.append(_slowed(phases, excess))
            if excess < GOAL or len(found) == ATTEMPTS:
                return min(found, key=lambda run: float(run.duration.sum()))
            over = np.maximum(shares, 1.0) ** OVER
            tight *= maximum_filter1d(over, 2 * BESIDE + 1, axis=0, mode="nearest")

    def _limits(self, course: _Course, step: float) -> PointLimits:
        """Return the limits at the ends and the middle of each interval, in units of time of a step."""
        n = len(course)
        interval = np.append(np.repeat(np.arange(n), 2), n - 1)
        share = np.append(np.tile([0, 1], n), 2)
        w, w1, w2, w3 = course.at(interval + SHARES[share])
        # Just before the end, as at a stop the slope of the side before it counts.
        _, s1, s2, s3 = self.path.derivatives(np.minimum(w, course.node[-1] - ONE_NODE))
        feed = w1 / self._feeds(w)
        w1, w2, w3 = w1[:, None], w2[:, None], w3[:, None]
        q1, q2, q3 = s1 * w1, s2 * w1**2 + s1 * w2, s3 * (w1 * w1 * w1) + 3.0 * s2 * w1 * w2 + s1 * w3
        slowest = np.maximum((np.abs(q1) / self.bounds.speed).max(axis=1), feed) / step
        ceiling = 1.0 / np.maximum(slowest**2, 1.0 / FASTEST)
        a, j = self.bounds.acceleration * step**2, self.bounds.jerk * step**3
        return PointLimits(interval, share, ceiling, 0.5 * q1 / a, q2 / a, 0.5 * q1 / j, 1.5 * q2 / j, q3 / j)

    def _feeds(self, station: Array) -> Array:
        """Return the path speed at the feed, mm/s, at stations."""
        return self.path_speed[np.minimum(np.searchsorted(self.station, station), len(self.station) - 1)]

    def _shares(self, phases: Phases) -> Array:
        """Find the largest shares of the limits in each phase, (p, 3): of speed, acceleration and jerk."""
        phase, share = np.divmod(np.arange(len(phases) * PLACES), PLACES)
        station, *rates = phases.within(phase, phases.duration[phase] * share / (PLACES - 1))
        u1, u2, u3 = (rate[:, None] for rate in rates)
        _, s1, s2, s3 = self.path.derivatives(np.minimum(station, phases.end_station[-1] - ONE_NODE))
        of_axes = np.stack(
            [
                s1 * u1 / self.bounds.speed,
                (s1 * u2 + s2 * u1**2) / self.bounds.acceleration,
                (s1 * u3 + 3.0 * s2 * u1 * u2 + s3 * (u1 * u1 * u1)) / self.bounds.jerk,
            ]
        )
        shares = np.abs(of_axes).max(axis=2)
        shares[0] = np.maximum(shares[0], rates[0] / self._feeds(station))
        return shares.reshape(3, -1, PLACES).max(axis=2).T


def _quickest(
    limits: PointLimits, weights: tuple[float, float], inner: Array | None = None
) -> tuple[Array, Array]:
    """Find the quickest run within limits: its coefficients, and those at the first weight, (n + 3,) each.

    The weights of the barrier at first and at last are shares of the time. Coefficients of x that exceed the
    limits little may be given, `inner`.
    """
    n = int(limits.interval[-1]) + 1
    if inner is None:
        pushes, jerks = (np.abs(z).max(initial=BRIEFEST) for z in (limits.a2, limits.e3))
        c = np.full(n + 3, 0.9 * min(limits.ceiling.min(), 1.0 / pushes, jerks ** (-2.0 / 3.0)))
    else:
        v, a, j = largest_shares(inner, limits).max(axis=0) / 0.9
        c = inner / max(1.0, v**2, a, j ** (2.0 / 3.0))
    inner = None
    time = merit(c, limits, 0.0)
    mu = weights[0] * time / (2 * n)
    while True:
        c = centre(c, limits, mu, CENTRED * 2 * n * mu)
        inner = c if inner is None else inner
        time = merit(c, limits, 0.0)
        if mu * 2 * n < weights[1] * time:
            return c, inner
        mu *= FALLING


def _tightened(limits: PointLimits, tight: Array) -> PointLimits:
    """Divide limits by factors for speed, acceleration and jerk in each interval, (n, 3)."""
    v, a, j = tight[limits.interval].T
    a, j = a[:, None], j[:, None]
    return limits._replace(
        ceiling=limits.ceiling / v**2,
        a1=limits.a1 * a,
        a2=limits.a2 * a,
        e1=limits.e1 * j,
        e2=limits.e2 * j,
        e3=limits.e3 * j,
    )


def _timed(course: _Course, c: Array, step: float) -> Phases:
    """Return a phase for each interval, a polynomial with the station's two derivatives at both ends."""
    n = len(course)
    i, basis = np.arange(n), spline_basis(POINTS)[0]
    # Between its points x may even be negative where hardly anything limits it.
    x = np.maximum(sum(basis[:, a] * c[i + a, None] for a in range(4)), SLOWEST)
    h = step * (SIZES / np.sqrt(x)).sum(axis=1)
    node = np.append(c, 0.0)[np.arange(n + 1)[:, None] + np.arange(4)]
    x, dx = ((spline_basis(np.zeros(1))[d, 0] * node).sum(axis=1) / step**2 for d in range(2))
    w, w1, w2, _ = course.at(np.arange(n + 1.0))
    u, v, a = w, w1 * np.sqrt(np.maximum(x, 0.0)), w2 * x + 0.5 * w1 * dx
    v[[0, -1]] = a[[0, -1]] = 0.0
    d = np.diff(u) - h * (v[:-1] + 0.5 * h * a[:-1])
    e, f = h * (np.diff(v) - h * a[:-1]), 0.5 * h**2 * np.diff(a)
    h3 = h * h * h
    third, fourth, fifth = 10.0 * d - 4.0 * e + f, 7.0 * e - 15.0 * d - 2.0 * f, 6.0 * d - 3.0 * e + f
    higher = np.stack([third / h3, fourth / (h3 * h), fifth / (h3 * h * h)], axis=1)
    return Phases(u[:-1], v[:-1], a[:-1], h, np.zeros(n, dtype=np.int64), higher)
