"""The structured interior-point method: any terms over windows of a path.

The method is that of Wächter and Biegler (2006), like IPOPT's: monotone barrier, filter line search. The
linear algebra differs: parts of rows, their duals and the rows' multipliers are eliminated in closed form
(`kernel`), which leaves the unknowns in a band as wide as the longest window. An iteration takes a tenth of
IPOPT's time. And no location holds the others back: negative curvature changes its sign where it is, each
dual has a step length of its own, and an axis that turns back shortens no step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array
from fiveaxis.posture.local import kernel
from fiveaxis.posture.local.rows import ChainModel, Model, Rows
from fiveaxis.posture.location_model import ANGLES

# Constants of Wächter and Biegler: last barrier parameter (J), barrier update, fraction to the boundary.
LAST_BARRIER = 5e-7
BARRIER_FACTOR, BARRIER_POWER, BARRIER_ERROR = 0.2, 1.5, 10.0
LEAST_FRACTION = 0.99
# Accepted errors of the equations and of the gradient (J/mm, J/rad) at the last barrier: rounding.
EXACT, FLAT = 1e-9, 0.1
# Filter: margins in both measures, switch to the Armijo rule.
FILTER_MARGIN, ARMIJO = 1e-5, 1e-4
SWITCH_OBJECTIVE, SWITCH_OFF = 2.3, 1.1
# A barrier is lowered when a step would gain less than this share of it, summed over all bounds.
WORTHWHILE = 1e-3
MOST_HALVINGS = 25
# Bounded parts start this share of their range inside it.
PUSH = 1e-2
MOST_RESTARTS = 5


@dataclass(frozen=True, eq=False)
class LocalOptimum:
    """Result of a solver: the unknowns, (n, d), and the multipliers of the rows, (r,)."""

    x: Array
    multiplier: Array
    solved: bool
    iterations: int

    @property
    def rotary(self) -> Array:
        """(n, 2), rad, chain order."""
        return self.x[:, :ANGLES]


def minimise(
    rows: Rows,
    start: Array,
    *,
    model: Model | None = None,
    iterations: int,
    barrier: float,
    last: float = LAST_BARRIER,
    flat: float = FLAT,
) -> LocalOptimum:
    """Find a local optimum from a start, (n, d), in the model of the machine's chain unless another is given.

    The first and the last barrier parameter are in J. The gradient may keep an error of `flat`, J/rad and
    J/s, scaled.
    """
    model = model or ChainModel(rows)
    quantities = model.values(start)
    if not np.isfinite(quantities).all():
        # A flat bottom has no position where its axis is the normal, and nothing leads on from there.
        return LocalOptimum(start, np.zeros(len(rows.first)), False, 0)
    method = _Method(rows, model, start, quantities, barrier, last, flat)
    for number in range(iterations):
        solved = method.is_solved()
        if solved or not method.advance():
            return LocalOptimum(method.x, method.point.multiplier, solved, number)
    return LocalOptimum(method.x, method.point.multiplier, method.is_solved(), iterations)


class _Method:
    """State of a run: unknowns, parts with duals, multipliers, rows, barrier and filter."""

    def __init__(
        self,
        rows: Rows,
        model: Model,
        start: Array,
        quantities: Array,
        barrier: float,
        last: float,
        flat: float,
    ) -> None:
        self.last, self.flat = last, flat
        self.rows, self.model, self.mu, self.restarts = rows, model, barrier, 0
        self.x, self.free = start.copy(), np.ascontiguousarray(rows.free.ravel())
        value = np.empty(len(rows.first))
        self.weights = np.zeros(quantities.shape)
        self._evaluate(quantities, value)
        state, multiplier = central_point(rows, value, barrier)
        parts = np.stack([rows.sign, rows.price, rows.low, rows.high])
        ends = np.stack([rows.low, rows.high])[:, rows.low < rows.high]
        self.bounds = int(np.isfinite(ends).sum())
        gradient = np.empty((len(value), rows.span * rows.unknowns))
        self.point = kernel.Point(
            rows.first,
            rows.square,
            rows.begin,
            rows.pair,
            parts,
            state,
            value,
            multiplier,
            gradient,
            rows.unknowns,
        )
        # Of the step: unknowns, parts with duals, multipliers.
        self.dx, self.change, self.new = np.zeros(start.size), np.zeros_like(state), np.zeros_like(multiplier)
        self._differentiate()
        self._clear_filter()

    def is_solved(self) -> bool:
        """Lower the barrier while its problem is solved; return whether the last one is."""
        while self._is_barrier_solved():
            if self.mu <= self.last:
                return True
            self._lower()
        return False

    def advance(self) -> bool:
        """Take one step; False if no step makes progress."""
        point, dx, change, new = self.point, self.dx, self.change, self.new
        while True:
            fraction = max(LEAST_FRACTION, 1.0 - self.mu)
            found, alpha, gain = kernel.direct(
                self.mu, fraction, self.curvature, self.free, point, dx, change, new
            )
            if not found:
                return False
            is_small = abs(gain) < WORTHWHILE * self.mu * self.bounds
            if self.mu <= self.last or not is_small or self.primal > BARRIER_ERROR * self.mu:
                break
            self._lower()
        taken = self._search(alpha, fraction, gain)
        if taken is None:
            self.restarts += 1
            point.state[:], point.multiplier[:] = central_point(self.rows, point.value, self.mu)
            self._clear_filter()
            return self.restarts <= MOST_RESTARTS
        kernel.take(self.mu, taken, fraction, point, self.x.ravel(), dx, change, new)
        self._differentiate()
        return True

    def _lower(self) -> None:
        """Lower the barrier."""
        self.mu = max(self.last, min(BARRIER_FACTOR * self.mu, self.mu**BARRIER_POWER))
        self._clear_filter()

    def _evaluate(self, quantities: Array, value: Array) -> None:
        kernel.row_values(self.rows.quantity, self.rows.coefficient, quantities.ravel(), value)

    def _differentiate(self) -> None:
        """Evaluate the rows and their derivatives at the present point."""
        rows, point = self.rows, self.point
        force = point.multiplier
        if rows.square.any():
            self._evaluate(self.model.values(self.x), point.value)
            force = force + 2.0 * rows.square * point.value
        kernel.row_weights(rows.quantity, rows.coefficient, force, self.weights.ravel())
        quantities, slope, self.curvature = self.model.derivatives(self.x, self.weights)
        kernel.differentiate(rows.quantity, rows.coefficient, quantities, slope, point)

    def _clear_filter(self) -> None:
        self.here = kernel.measure(self.mu, self.point, self.change, 0.0, 0.0, self.point.value)
        self.first_off = max(1.0, self.here[0])
        self.filter: list[tuple[float, float]] = [(1e4 * self.first_off, -np.inf)]

    def _search(self, alpha: float, fraction: float, gain: float) -> float | None:
        """Shorten a step until the filter accepts it; None if it accepts none."""
        off, cost = self.here
        point, moved = self.point, self.dx.reshape(self.x.shape)
        trial = np.empty_like(point.value)
        rounding = 10.0 * np.finfo(float).eps * abs(cost)
        for _ in range(MOST_HALVINGS):
            self._evaluate(self.model.values(self.x + alpha * moved), trial)
            new_off, new_cost = kernel.measure(self.mu, point, self.change, alpha, fraction, trial)
            switching = gain < 0.0 and alpha * (-gain) ** SWITCH_OBJECTIVE > off**SWITCH_OFF
            armijo = switching and off <= 1e-4 * self.first_off
            descends = new_cost <= cost + rounding + ARMIJO * alpha * gain
            margin = (1.0 - FILTER_MARGIN) * off, cost - FILTER_MARGIN * off
            better = descends if armijo else new_off <= margin[0] or new_cost <= margin[1] + rounding
            if better and not any(new_off >= o and new_cost >= c for o, c in self.filter):
                if not (armijo and descends):
                    self.filter.append(margin)
                self.here = new_off, new_cost
                return alpha
            alpha /= 2.0
        return None

    def _is_barrier_solved(self) -> bool:
        """Check whether the point is optimal for the barrier parameter, with IPOPT's scaling of duals."""
        mu = self.mu
        dual, primal, gap, size = kernel.errors(mu, self.point, np.empty(self.x.size))
        self.primal = primal
        scale, allowed = max(100.0, size) / 100.0, BARRIER_ERROR * mu
        exact = EXACT if mu <= self.last else allowed
        return dual / scale <= max(allowed, self.flat) and primal <= exact and gap / scale <= allowed


def central_point(rows: Rows, value: Array, mu: float) -> tuple[Array, Array]:
    """Split rows, (r,), into parts on the central path: values with duals, (3, p), and multipliers, (r,)."""
    low, high, sign, price = rows.low, rows.high, rows.sign, rows.price
    v = split_rows(rows, value, mu, PUSH)
    state, moves = np.stack([v, np.zeros_like(v), np.zeros_like(v)]), low < high
    for z, room in ((state[1], v - low), (state[2], high - v)):
        inside = moves & np.isfinite(room)
        z[inside] = mu / room[inside]
    each = np.where(moves, sign * (price - state[1] + state[2]), 0.0)
    count = np.bincount(rows.row[moves], minlength=len(value))
    return state, np.bincount(rows.row, each, len(value)) / np.maximum(count, 1)


def split_rows(rows: Rows, value: Array, mu: float, push: float) -> Array:
    """Split rows, (r,), into parts, (p,), on the central path; bounded ones at least a share inside."""
    low, high, row = rows.low, rows.high, rows.row
    v, bounded, fixed = low.copy(), rows.price == 0.0, low == high
    inset = np.zeros_like(low)
    inset[~fixed] = push * np.minimum(1.0, (high - low)[~fixed])
    v[bounded] = np.clip(value[row], low + inset, high - inset)[bounded]
    # The rest is split into a rise and a fall.
    rest = value - np.bincount(row[bounded], v[bounded], len(value))
    weight = np.bincount(row, rows.price, len(value))[row]
    priced = ~bounded
    rise, fall = split_steps(rest[row[priced]], weight[priced], mu)
    v[priced] = np.minimum(np.where(rows.sign[priced] > 0.0, rise, fall), (1.0 - push) * high[priced])
    return v


def split_steps(step: Array, weight: Array, mu: float) -> tuple[Array, Array]:
    """Split steps d into their parts on the central path, ``s − t = d`` and ``w s t = μ (s + t)``."""
    size = np.abs(step)
    large = ((2.0 * mu + weight * size) + np.hypot(weight * size, 2.0 * mu)) / (2.0 * weight)
    small = mu * large / (weight * large - mu) if mu > 0.0 else np.zeros_like(large)
    return np.where(step > 0.0, large, small), np.where(step > 0.0, small, large)
