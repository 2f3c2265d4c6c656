"""A problem's terms as flat arrays, which both solvers read.

A row ``r = C q`` of a term is ``Σ σ v`` of its *parts* v, each within bounds of its own and with a price:

- a row with prices is ``s − t``, ``s, t ≥ 0`` at ``W⁺s + W⁻t``; its bounds are the largest s and t;
- where a band is free of the price it is ``y + s − t`` with y in the band;
- a row with bounds alone is y within them; where they leave no room the part is fixed, an equation.

So the directional cost is exact; a smoothed absolute value fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.trigonometric import TrigonometricCoefficients
from fiveaxis.posture.terms import OTHERS, LocationTapes, Term, location_tapes

T = TypeVar("T", bound=np.generic)

# Bounds are kept by this much, so that the solver's rounding doesn't carry values out.
MARGIN = 1e-9
# An axis that costs nothing would leave its parts of steps undetermined (J/mm, J/rad).
LEAST_COST = 1e-6
# mm, rad: a range narrower than this has no inside to speak of.
NARROW = 1e-6
# Unknowns of a location that are angles.
ANGLES = 2


@dataclass(frozen=True, eq=False)
class Laid:
    """Rows and their parts, of one term or of all.

    Parameters
    ----------
    first : (r,), the first location of each row's window
    place : (r, z), quantities that a row reads, counted through the path; −1 where it reads fewer
    coefficient : (r, z)
    square : (r,), J per unit²
    begin : (r + 1,), where each row's parts begin
    sign, price, low, high : (p,), of the parts
    """

    first: IntArray
    place: IntArray
    coefficient: Array
    square: Array
    begin: IntArray
    sign: Array
    price: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Rows(Laid):
    """A problem of n locations with m quantities and d unknowns each: the rotary angles, then any wait.

    Parameters
    ----------
    tapes : of the quantities
    trigonometric : coefficients of the locations' own quantities; None where the chain has none
    columns : (5,), of the linear and the rotary axes among the quantities
    given : (n, 6), pivot in mm and normal
    free : (n, d), unknowns that may move
    fixed : (2,), rad, where a rotary axis is held; NaN where it isn't
    span : locations in the longest window
    count : m
    """

    tapes: LocationTapes
    trigonometric: TrigonometricCoefficients | None
    columns: IntArray
    given: Array
    free: BoolArray
    fixed: Array
    span: int
    count: int

    @property
    def unknowns(self) -> int:
        """How many a location has."""
        return self.free.shape[1]

    @cached_property
    def row(self) -> IntArray:
        """(p,), the row of each part."""
        return np.repeat(np.arange(len(self.first)), np.diff(self.begin))

    def start(self, problem: Problem, rotary: Array) -> Array:
        """Give the unknowns, (n, d), that a path, (n, 2) rad, stands for."""
        x = np.zeros(self.free.shape)
        x[:, :ANGLES] = np.where(np.isnan(self.fixed), rotary, self.fixed)
        if self.unknowns > ANGLES:
            x[:-1, ANGLES] = problem.delay(problem.positions(slice(None), rotary))
        return x


def rows_of(
    problem: Problem,
    held: tuple[bool, bool] = (False, False),
    *,
    margin: float = MARGIN,
    elastic: float = 0.0,
) -> Rows:
    """Lay a problem's terms out.

    Parameters
    ----------
    held : whether the first and the last posture stay as they are
    margin : by which bounds are kept; negative to let what stands on them pass
    elastic : J per mm, rad and cosine, at which bounds of a location may be broken; 0 where they may not
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
    laid = [_laid(term, count, still, margin, elastic) for term in problem.terms]
    widest = max(part.place.shape[1] for part in laid)
    sizes = np.concatenate([np.diff(part.begin) for part in laid])
    return Rows(
        tapes=location_tapes(machine, problem.zone),
        trigonometric=problem.trigonometric,
        columns=np.array([*machine.linear_columns, *columns]),
        given=np.hstack([problem.pivot, problem.normal]),
        first=np.concatenate([part.first for part in laid]),
        place=np.vstack([_widened(part.place, widest, -1) for part in laid]),
        coefficient=np.vstack([_widened(part.coefficient, widest, 0) for part in laid]),
        square=np.concatenate([part.square for part in laid]),
        begin=np.concatenate([[0], np.cumsum(sizes)]),
        **{name: np.concatenate([getattr(part, name) for part in laid]) for name in PARTS},
        free=free,
        fixed=fixed,
        span=max(term.span for term in problem.terms),
        count=count,
    )


PARTS = ("sign", "price", "low", "high")


def _laid(term: Term, count: int, still: BoolArray, margin: float, elastic: float) -> Laid:
    slots, coefficients = term.coefficients(count)
    shape = coefficients.shape[:2]

    def figures(values: Array | float) -> Array:
        return np.broadcast_to(values, shape).ravel()

    low, high, free, square = (figures(v) for v in (term.low, term.high, term.free, term.square))
    plus, minus = (figures(price) for price in (term.plus, term.minus))
    first = np.repeat(term.rows, shape[1])
    # (r, 3): y, s, t
    there = np.zeros((len(first), 3), dtype=bool)
    ends = np.zeros((len(first), 3, 2))
    if term.is_priced:
        there[:, 0], there[:, 1:] = free > 0.0, (np.stack([high, -low], axis=1) > NARROW)
        ends[:, 0] = np.stack([-free, free], axis=1)
        ends[:, 1, 1], ends[:, 2, 1] = high, -low
        # A step that may not be: an equation.
        there[:, 0] |= ~there.any(axis=1)
        needed = np.isfinite(free)
    else:
        there[:, 0] = needed = np.isfinite(low) | np.isfinite(high)
        ends[:, 0] = np.stack([low + margin, high - margin], axis=1)
        if elastic and term.span == 1:
            there[:, 1:], ends[:, 1:, 1] = needed[:, None], np.inf
            plus = minus = np.full(len(first), elastic)
    narrow = ends[..., 1] - ends[..., 0] < NARROW
    middle = ends[narrow].mean(axis=-1, keepdims=True)
    ends[narrow] = middle
    # What doesn't move keeps no bounds.
    kept = (needed | (square > 0.0)) & ~(still[first] & (term.span == 1) & (term.name != "waits"))
    there, ends = there[kept], ends[kept]
    prices = np.stack([np.zeros(len(first)), plus, minus], axis=1)[kept]
    prices[:, 1:] = np.maximum(prices[:, 1:], LEAST_COST)
    place = np.where(slots >= 0, slots + term.rows[:, None, None] * count, -1)
    return Laid(
        first=first[kept],
        place=place.reshape(len(first), -1)[kept],
        coefficient=coefficients.reshape(len(first), -1)[kept],
        square=square[kept],
        begin=np.concatenate([[0], np.cumsum(there.sum(axis=1))]),
        sign=np.broadcast_to([1.0, 1.0, -1.0], there.shape)[there],
        price=prices[there],
        low=ends[..., 0][there],
        high=ends[..., 1][there],
    )


def _widened(columns: NDArray[T], width: int, filling: int) -> NDArray[T]:
    """Give every row as many columns, (r, z)."""
    return np.pad(columns, ((0, 0), (0, width - columns.shape[1])), constant_values=filling)
