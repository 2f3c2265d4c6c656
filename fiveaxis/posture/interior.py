"""The same local optimum as the NLP's, by an interior-point method made for paths.

The problem is the one that `nlp` writes for IPOPT, and so is the method (Wächter and Biegler 2006: monotone
barrier, filter line search, inertia correction). What differs is the algebra: parts of steps, slacks
and multipliers are eliminated in closed form, and the angles are left in 2 × 2 blocks on three diagonals.
An iteration takes a tenth of IPOPT's time.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.posture import interior_kernel as kernel
from fiveaxis.posture.nlp import LEAST_COST, MARGIN
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.waves import has_waves, waves_of

# The constants of Wächter and Biegler: last barrier parameter (J), barrier update, fraction to the boundary.
LAST_BARRIER = 5e-7
# What rounding leaves of the equations and of the gradient (J/mm, J/rad) at the last barrier.
EXACT, FLAT = 1e-9, 0.1
BARRIER_FACTOR, BARRIER_POWER, BARRIER_ERROR = 0.2, 1.5, 10.0
LEAST_FRACTION = 0.99
# Filter: margins in both measures, switch to the Armijo rule.
FILTER_MARGIN, ARMIJO = 1e-5, 1e-4
SWITCH_OBJECTIVE, SWITCH_OFF = 2.3, 1.1
MOST_HALVINGS = 25
# Inertia: the first shift of the diagonal (J/rad²), its growth and decay, and where to give up.
FIRST_SHIFT, GROWTH, DECAY, MOST_SHIFT = 0.1, 8.0, 3.0, 1e14
# Least room that a value keeps to its bound: less is rounded away beside it, and divided by.
LEAST_ROOM = 1e-13
# Duals stay within this factor of what the barrier asks for.
DUAL_RANGE = 1e10
# Slacks start this share of their range inside it.
PUSH = 1e-2
MOST_RESTARTS = 5
# mm, rad: a range narrower than this has no inside to speak of.
NARROW = 1e-6


@dataclass(frozen=True, eq=False)
class Outcome:
    """Where the method ended: angles, (n, 2) rad, whether they are a local optimum, and iterations taken."""

    rotary: Array
    solved: bool
    iterations: int


@dataclass(frozen=True, eq=False)
class Banded:
    """The problem as arrays, axes in the order linear then rotary.

    Parameters
    ----------
    waves : (n, r, 9), of the rows
    low, high : (n, r), bounds on rows, infinite where there is none
    plus, minus, most : (n − 1, 5), J/mm and J/rad of a step, and its largest size
    bend : (n − 1,), J/rad²
    held : (n,), locations that don't move
    """

    waves: Array
    low: Array
    high: Array
    plus: Array
    minus: Array
    most: Array
    bend: Array
    held: BoolArray


@dataclass(eq=False)
class Point:
    """Angles; parts of steps, their duals and multiplier; slacks of rows, likewise."""

    x: Array
    s: Array
    t: Array
    zs: Array
    zt: Array
    vs: Array
    vt: Array
    lam: Array
    y: Array
    zl: Array
    zh: Array
    nu: Array


PRIMAL, DUAL = ("x", "s", "t", "y", "lam", "nu"), ("zs", "zt", "vs", "vt", "zl", "zh")


def is_banded(problem: Problem) -> bool:
    """Tell whether the method knows all terms of a problem.

    It knows no price on time and no bound on accelerations, and needs an inside: no axis that is held, no
    step that may not turn at all.
    """
    machine = problem.machine
    known = has_waves(machine, problem.zone) and len(machine.axes) == kernel.AXES
    timed = problem.is_timed or len(problem.jolted) > 0
    held = (machine.high - machine.low < NARROW).any() or (problem.max_turn < NARROW).any()
    return known and not timed and not held


def as_banded(problem: Problem, held: tuple[bool, bool]) -> Banded:
    """Write a problem as arrays.

    Parameters
    ----------
    problem : for which `is_banded` holds
    held : whether the first and the last posture stay as they are
    """
    n, machine = len(problem), problem.machine
    found = waves_of(machine, problem.pivot, problem.zone, problem.bounds)
    columns = [*machine.linear_columns, *machine.rotary_columns]
    ends = np.array([b.cosines for b in problem.bounds])
    # A range from 0 has no upper cosine to keep.
    ends[ends == 1.0] = np.inf
    low = np.tile(np.concatenate([machine.low[columns], ends[:, 0]]) + MARGIN, (n, 1))
    high = np.tile(np.concatenate([machine.high[columns], ends[:, 1]]) - MARGIN, (n, 1))
    unbound = np.isnan(found.cosines).any(axis=2)
    low[:, kernel.AXES :][unbound], high[:, kernel.AXES :][unbound] = -np.inf, np.inf
    rows = np.zeros(n, dtype=bool)
    rows[[0, -1]] = held
    low[rows], high[rows] = -np.inf, np.inf
    most = np.full((n - 1, kernel.AXES), np.inf)
    most[:, 3:] = problem.max_turn
    return Banded(
        waves=np.concatenate([found.linear, np.zeros((n, 2, 9)), np.nan_to_num(found.cosines)], axis=1),
        low=low,
        high=high,
        plus=np.maximum(problem.plus[:, columns], LEAST_COST),
        minus=np.maximum(problem.minus[:, columns], LEAST_COST),
        most=most,
        bend=np.ascontiguousarray(problem.bend_price),
        held=rows,
    )


def minimise(problem: Banded, start: Array, *, iterations: int, barrier: float) -> Outcome:
    """Find a local optimum.

    Parameters
    ----------
    start : (n, 2), rad, chain order
    iterations : most to take
    barrier : first barrier parameter, J
    """
    method = _Method(problem, start, barrier)
    for number in range(iterations):
        if method.is_solved():
            return Outcome(method.point.x, True, number)
        if not method.advance():
            return Outcome(method.point.x, False, number)
    return Outcome(method.point.x, method.is_solved(), iterations)


class _Method:
    """One run: the point, the values of all rows there, the barrier parameter and the filter."""

    def __init__(self, problem: Banded, start: Array, barrier: float) -> None:
        self.problem, self.mu, self.shift, self.restarts = problem, barrier, 0.0, 0
        shape = problem.low.shape
        self.value, self.slope, self.bow = np.zeros(shape), np.zeros((*shape, 2)), np.zeros((*shape, 3))
        self._evaluate(start)
        self.point = central_point(problem, start, self.value, barrier)
        self._clear_filter()

    def is_solved(self) -> bool:
        """Lower the barrier as often as its problem is solved; tell whether the whole is."""
        while self._is_barrier_solved():
            if self.mu <= LAST_BARRIER:
                return True
            self.mu = max(LAST_BARRIER, min(BARRIER_FACTOR * self.mu, self.mu**BARRIER_POWER))
            self._clear_filter()
        return False

    def advance(self) -> bool:
        """Take one step; False where there is none that leads on."""
        step = self._direction()
        if step is None:
            return False
        p, problem, fraction = self.point, self.problem, max(LEAST_FRACTION, 1.0 - self.mu)
        pairs = ((p.s, step.s), (p.t, step.t), (problem.most - p.s, -step.s), (problem.most - p.t, -step.t))
        slacks = ((p.y - problem.low, step.y), (problem.high - p.y, -step.y))
        alpha = min(kernel.longest(fraction, room, change) for room, change in (*pairs, *slacks))
        dual = min(kernel.longest(fraction, getattr(p, z), getattr(step, z)) for z in DUAL)
        taken = self._search(step, alpha)
        if taken is None:
            self.restarts += 1
            self.point = central_point(problem, p.x, self.value, self.mu)
            self._clear_filter()
            return self.restarts <= MOST_RESTARTS
        for name in PRIMAL:
            getattr(p, name)[...] += taken * getattr(step, name)
        for name in DUAL:
            getattr(p, name)[...] += dual * getattr(step, name)
        self._keep_room()
        self._evaluate(p.x)
        self._reset_duals()
        return True

    def _keep_room(self) -> None:
        """Move values off the bounds that they have come so near to that nothing is left between."""
        p, q = self.point, self.problem
        room = np.minimum(LEAST_ROOM, (q.high - q.low) / 4.0)
        np.clip(p.y, q.low + room, q.high - room, out=p.y)
        for way in (p.s, p.t):
            np.minimum(way, q.most - np.minimum(LEAST_ROOM, q.most / 4.0), out=way)

    def _evaluate(self, x: Array) -> None:
        kernel.evaluate(self.problem.waves, x, self.value, self.slope, self.bow)

    def _judge(self, value: Array, y: Array, s: Array, t: Array) -> tuple[float, float]:
        p = self.problem
        return kernel.judge(self.mu, value, p.low, p.high, p.plus, p.minus, p.most, p.bend, y, s, t)

    def _clear_filter(self) -> None:
        p = self.point
        self.first_off = max(1.0, self._judge(self.value, p.y, p.s, p.t)[0])
        self.filter: list[tuple[float, float]] = [(1e4 * self.first_off, -np.inf)]

    def _direction(self) -> Point | None:
        """Solve the condensed system, its diagonal shifted until the step leads downhill."""
        p, q, n = self.point, self.problem, len(self.value)
        diagonal, beside, right = np.zeros((n, 3)), np.zeros((n - 1, 2, 2)), np.zeros((n, 2))
        at = self.value, self.slope
        bounds, steps = (p.y, p.zl, p.zh, p.nu), (p.s, p.t, p.zs, p.zt, p.vs, p.vt, p.lam)
        kernel.condense_rows(self.mu, *at, self.bow, q.low, q.high, *bounds, diagonal, right)
        prices = q.plus, q.minus, q.most
        kernel.condense_steps(self.mu, *at, self.bow, *prices, q.bend, *steps, diagonal, beside, right)
        change = Point(**{f.name: np.zeros_like(getattr(p, f.name)) for f in fields(Point)})
        if not self._solve(diagonal, beside, right, change.x):
            return None
        c = change
        rows, moves = (c.y, c.zl, c.zh, c.nu), (c.s, c.t, c.zs, c.zt, c.vs, c.vt, c.lam)
        kernel.recover_rows(self.mu, *at, q.low, q.high, *bounds, c.x, *rows)
        kernel.recover_steps(self.mu, *at, *prices, *steps, c.x, *moves)
        return change

    def _solve(self, diagonal: Array, beside: Array, right: Array, dx: Array) -> bool:
        shift, last = 0.0, self.shift
        while not kernel.solve_blocks(diagonal, beside, right, self.problem.held, shift, dx):
            if shift == 0.0:
                shift = max(FIRST_SHIFT, last / DECAY)
            else:
                shift *= GROWTH if last > 0.0 else 100.0
            if shift > MOST_SHIFT:
                return False
            self.shift = shift
        return bool(np.isfinite(dx).all())

    def _search(self, step: Point, alpha: float) -> float | None:
        """Shorten a step until the filter takes it; None where it takes none."""
        p = self.point
        off, cost = self._judge(self.value, p.y, p.s, p.t)
        gain = self._gain(step)
        trial, unused = np.empty_like(self.value), (np.empty_like(self.slope), np.empty_like(self.bow))
        rounding = 10.0 * np.finfo(float).eps * abs(cost)
        for _ in range(MOST_HALVINGS):
            kernel.evaluate(self.problem.waves, p.x + alpha * step.x, trial, *unused)
            y, s, t = (getattr(p, name) + alpha * getattr(step, name) for name in "yst")
            new_off, new_cost = self._judge(trial, y, s, t)
            switching = gain < 0.0 and alpha * (-gain) ** SWITCH_OBJECTIVE > off**SWITCH_OFF
            armijo = switching and off <= 1e-4 * self.first_off
            descends = new_cost - rounding <= cost + ARMIJO * alpha * gain
            margin = (1.0 - FILTER_MARGIN) * off, cost - FILTER_MARGIN * off
            better = descends if armijo else new_off <= margin[0] or new_cost - rounding <= margin[1]
            if better and not any(new_off >= o and new_cost >= c for o, c in self.filter):
                if not (armijo and descends):
                    self.filter.append(margin)
                return alpha
            alpha /= 2.0
        return None

    def _gain(self, step: Point) -> float:
        """Differentiate the barrier objective along a step."""
        p, q, mu = self.point, self.problem, self.mu
        total = np.sum((q.plus - mu / p.s + mu / (q.most - p.s)) * step.s)
        total += np.sum((q.minus - mu / p.t + mu / (q.most - p.t)) * step.t)
        total += np.sum((mu / (q.high - p.y) - mu / (p.y - q.low)) * step.y)
        return float(total + 2.0 * q.bend @ np.sum(np.diff(p.x, axis=0) * np.diff(step.x, axis=0), axis=1))

    def _reset_duals(self) -> None:
        p, q = self.point, self.problem
        rooms = (p.s, p.t, q.most - p.s, q.most - p.t, p.y - q.low, q.high - p.y)
        for name, room in zip(DUAL, rooms, strict=True):
            wanted = self.mu / room
            z = getattr(p, name)
            np.clip(z, wanted / DUAL_RANGE, wanted * DUAL_RANGE, out=z)

    def _is_barrier_solved(self) -> bool:
        """Tell whether the point is the optimum for the barrier parameter, with IPOPT's scaling of duals."""
        p, q, mu = self.point, self.problem, self.mu
        at, pull = (mu, self.value, self.slope), np.zeros_like(p.x)
        rows = kernel.errors(*at, q.low, q.high, p.y, p.zl, p.zh, p.nu, q.held, pull)
        parts = p.s, p.t, p.zs, p.zt, p.vs, p.vt, p.lam
        steps = kernel.step_errors(*at, q.plus, q.minus, q.most, q.bend, *parts, q.held, pull)
        scale = max(100.0, (rows[3] + steps[3]) / (rows[4] + steps[4])) / 100.0
        dual, primal, gap = (max(pair) for pair in zip(rows[:3], steps[:3], strict=True))
        dual, allowed = max(dual, float(np.abs(pull).max())) / scale, BARRIER_ERROR * mu
        exact = EXACT if mu <= LAST_BARRIER else allowed
        return dual <= max(allowed, FLAT) and primal <= exact and gap / scale <= allowed


def central_point(problem: Banded, x: Array, value: Array, mu: float) -> Point:
    """Put a point around angles, (n, 2) rad: on the central path in all but the angles."""
    apart = np.diff(value[:, : kernel.AXES], axis=0)
    s, t = split(apart, problem.plus + problem.minus, mu)
    s, t = (np.minimum(part, (1.0 - PUSH) * problem.most) for part in (s, t))
    zs, zt = mu / s, mu / t
    vs, vt = mu / (problem.most - s), mu / (problem.most - t)
    lam = (problem.plus - zs + vs - problem.minus + zt - vt) / 2.0
    low, high = problem.low, problem.high
    push = PUSH * np.minimum(1.0, high - low)
    y = np.clip(value, low + push, high - push)
    zl, zh = mu / (y - low), mu / (high - y)
    return Point(x.copy(), s, t, zs, zt, vs, vt, lam, y, zl, zh, zh - zl)


def split(apart: Array, weight: Array, mu: float) -> tuple[Array, Array]:
    """Split steps into their parts on the central path, ``s − t = d`` and ``w s t = μ (s + t)``."""
    size = np.abs(apart)
    large = ((2.0 * mu + weight * size) + np.hypot(weight * size, 2.0 * mu)) / (2.0 * weight)
    small = mu * large / (weight * large - mu)
    return np.where(apart > 0.0, large, small), np.where(apart > 0.0, small, large)
