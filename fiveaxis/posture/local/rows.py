"""A problem's terms as flat arrays for both solvers, and the quantities that they read.

A row ``r = C q`` of a term is ``Σ σ v`` of its *parts* v, each with its own bounds and price:

- a row with prices is ``s − t``, ``s, t ≥ 0`` at ``W⁺s + W⁻t``; its bounds are the largest s and t;
- with a band free of the price it is ``y + s − t`` with y in the band;
- a row with bounds alone is y within them; if they coincide the part is fixed, an equation.

The directional cost is thus exact; a smoothed absolute value fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.posture.location_model import ANGLES, ARGUMENTS, LocationModel
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.terms import OTHERS, Term

T = TypeVar("T", bound=np.generic)

# Margin of bounds, so that the solver's rounding doesn't carry values out.
MARGIN = 1e-9
# J/mm, J/rad: without a cost the parts of a step would be undetermined.
LEAST_COST = 1e-6
# mm, rad: a narrower range counts as a single value.
NARROW = 1e-6


@dataclass(frozen=True, eq=False)
class TermRows:
    """Rows and their parts, of one term or of all.

    Parameters
    ----------
    first : (r,), the first location of each row's window
    quantity : (r, z), indices of the quantities that a row reads, over all locations; −1 for none
    coefficient : (r, z)
    square : (r,), J per unit²
    begin : (r + 1,), where each row's parts begin
    sign, price, low, high : (p,), of the parts
    """

    first: IntArray
    quantity: IntArray
    coefficient: Array
    square: Array
    begin: IntArray
    sign: Array
    price: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Rows(TermRows):
    """A problem of n locations with m quantities and d unknowns each: the rotary angles, then any wait.

    Parameters
    ----------
    model : of the quantities
    free : (n, d), unknowns that may move
    fixed : (2,), rad, of held rotary axes; NaN for others
    span : locations in the longest window
    count : m
    """

    model: LocationModel
    free: BoolArray
    fixed: Array
    span: int
    count: int

    @property
    def unknowns(self) -> int:
        """Unknowns of a location."""
        return self.free.shape[1]

    @cached_property
    def row(self) -> IntArray:
        """(p,), the row of each part."""
        return np.repeat(np.arange(len(self.first)), np.diff(self.begin))

    @cached_property
    def pair(self) -> IntArray:
        """(r,), the first of the two parts of each row, rise and fall, without largest value; −1 for none."""
        endless = (self.price > 0.0) & np.isinf(self.high)
        first = self.begin[1:] - 2
        both = first >= self.begin[:-1]
        both[both] = endless[first[both]] & endless[first[both] + 1]
        return np.where(both, first, -1)

    def start(self, problem: Problem, rotary: Array) -> Array:
        """Return the unknowns, (n, d), of a path, (n, 2) rad."""
        x = np.zeros(self.free.shape)
        x[:, :ANGLES] = np.where(np.isnan(self.fixed), rotary, self.fixed)
        if self.unknowns > ANGLES:
            x[:-1, ANGLES] = problem.delay(problem.positions(slice(None), rotary))
        return x


def build_rows(
    problem: Problem,
    held: tuple[bool, bool] = (False, False),
    *,
    margin: float = MARGIN,
    elastic: float = 0.0,
) -> Rows:
    """Convert a problem's terms to rows; `held` is whether the first and the last posture stay as they are.

    Bounds are kept by a margin, at most a quarter of the range; a negative one accepts values on them. To
    break those of a location costs `elastic`, J per mm, rad and cosine; 0 forbids it.
    """
    n, machine = len(problem), problem.machine
    count = len(machine.axes) + OTHERS
    columns = machine.rotary_columns
    low, high = machine.low[columns], machine.high[columns]
    fixed = np.full(ANGLES, np.nan)
    narrow = high - low < NARROW
    fixed[narrow] = (low[narrow] + high[narrow]) / 2.0
    free = np.ones((n, ANGLES + problem.is_timed), dtype=bool)
    free[:, :ANGLES] &= np.isnan(fixed)
    free[[0, -1], :ANGLES] &= ~np.array(held)[:, None]
    # No step begins at the last location.
    free[-1, ANGLES:] = False
    still = np.zeros(n, dtype=bool)
    still[[0, -1]] = held
    written = problem.terms
    terms = [_term_rows(term, count, still, margin, elastic) for term in written]
    widest = max(part.quantity.shape[1] for part in terms)
    sizes = np.concatenate([np.diff(part.begin) for part in terms])
    return Rows(
        model=problem.model,
        quantity=np.vstack([_pad(part.quantity, widest, -1) for part in terms]),
        coefficient=np.vstack([_pad(part.coefficient, widest, 0) for part in terms]),
        begin=np.concatenate([[0], np.cumsum(sizes)]),
        **{name: np.concatenate([getattr(part, name) for part in terms]) for name in FLAT},
        free=free,
        fixed=fixed,
        span=max(term.span for term in written),
        count=count,
    )


# Arrays of `TermRows` that are joined as they are.
FLAT = ("first", "square", "sign", "price", "low", "high")


def _term_rows(term: Term, count: int, still: BoolArray, margin: float, elastic: float) -> TermRows:
    slots, coefficients = term.coefficients(count)
    shape = coefficients.shape[:2]

    figures = (term.low, term.high, term.free, term.square, term.plus, term.minus)
    low, high, free, square, plus, minus = (np.broadcast_to(v, shape).ravel() for v in figures)
    first = np.repeat(term.rows, shape[1])
    # (r, 3): y, s, t
    there = np.zeros((len(first), 3), dtype=bool)
    ends = np.zeros((len(first), 3, 2))
    if term.is_priced:
        there[:, 0], there[:, 1:] = free > 0.0, np.stack([high, -low], axis=1) > NARROW
        ends[:, 0] = np.stack([-free, free], axis=1)
        ends[:, 1, 1], ends[:, 2, 1] = high, -low
        # A forbidden step: an equation.
        there[:, 0] |= ~there.any(axis=1)
        needed = np.isfinite(free)
    else:
        there[:, 0] = needed = np.isfinite(low) | np.isfinite(high)
        inside = np.minimum(margin, (high - low) / 4.0)
        ends[:, 0] = np.stack([low + inside, high - inside], axis=1)
        if elastic and term.span == 1:
            there[:, 1:], ends[:, 1:, 1] = needed[:, None], np.inf
            plus = minus = np.full(len(first), elastic)
    narrow = ends[..., 1] - ends[..., 0] < NARROW
    middle = ends[narrow].mean(axis=-1, keepdims=True)
    ends[narrow] = middle
    # Bounds of locations that don't move are left out.
    kept = (needed | (square > 0.0)) & ~(still[first] & (term.span == 1) & (term.name != "waits"))
    there, ends = there[kept], ends[kept]
    prices = np.stack([np.zeros(len(first)), plus, minus], axis=1)[kept]
    prices[:, 1:] = np.maximum(prices[:, 1:], LEAST_COST)
    quantity = np.where(slots >= 0, slots + term.rows[:, None, None] * count, -1)
    return TermRows(
        first=first[kept],
        quantity=quantity.reshape(len(first), quantity.shape[-1])[kept],
        coefficient=coefficients.reshape(len(first), coefficients.shape[-1])[kept],
        square=square[kept],
        begin=np.concatenate([[0], np.cumsum(there.sum(axis=1))]),
        sign=np.broadcast_to([1.0, 1.0, -1.0], there.shape)[there],
        price=prices[there],
        low=ends[..., 0][there],
        high=ends[..., 1][there],
    )


def _pad(columns: NDArray[T], width: int, filling: int) -> NDArray[T]:
    """Widen an array, (r, z), to a number of columns."""
    return np.pad(columns, ((0, 0), (0, width - columns.shape[1])), constant_values=filling)


class Model(Protocol):
    """Quantities, (n, m), as a function of unknowns, (n, d)."""

    def values(self, x: Array) -> Array:
        """Compute the quantities."""
        ...

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Compute the quantities and their derivatives; those by unknowns that don't move are 0.

        They are the quantities; their slopes, (n, m, d); and the second derivatives of their sum, weighted by
        (n, m), by the unknowns of each location, (n, d, d).
        """
        ...


@dataclass(frozen=True, eq=False)
class ChainModel:
    """The quantities by the machine's chain: those of the locations' model, and each step's wait."""

    rows: Rows

    @cached_property
    def _arguments(self) -> Array:
        """(n, 8 + m − 1), what the tapes take: angles and weights are written over at each call."""
        given = self.rows.model.given
        return np.hstack([np.zeros((len(given), ANGLES)), given, np.zeros((len(given), self.rows.count - 1))])

    def values(self, x: Array) -> Array:
        """Compute the quantities."""
        quantities = np.zeros((len(x), self.rows.count))
        self._arguments[:, :ANGLES] = x[:, :ANGLES]
        self.rows.model.tapes.values.evaluate(self._arguments, quantities)
        if x.shape[1] > ANGLES:
            quantities[:, -1] = x[:, ANGLES]
        return quantities

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Compute the quantities and their derivatives, as `Model` says."""
        rows, (n, d), m = self.rows, x.shape, weights.shape[1]
        self._arguments[:, :ANGLES], self._arguments[:, ARGUMENTS:] = x[:, :ANGLES], weights[:, : m - 1]
        # Each location's quantities, their slopes, and 11, 12, 22 of their weighted sum.
        found = rows.model.tapes.derivatives(self._arguments)
        quantities, slope, curvature = np.zeros((n, m)), np.zeros((n, m, d)), np.zeros((n, d, d))
        quantities[:, : m - 1] = found[:, : m - 1]
        slope[:, : m - 1, :ANGLES] = found[:, m - 1 : 3 * (m - 1)].reshape(n, m - 1, ANGLES)
        curvature[:, 0, 0], curvature[:, 1, 0], curvature[:, 1, 1] = found[:, 3 * (m - 1) :].T
        if d > ANGLES:
            quantities[:, -1], slope[:, -1, ANGLES] = x[:, ANGLES], 1.0
        if not rows.free.all():
            slope *= rows.free[:, None, :]
            curvature *= rows.free[:, :, None] & rows.free[:, None, :]
        return quantities, slope, curvature
