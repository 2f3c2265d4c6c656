"""The terms of the optimisation problem, each written once.

Everything nonlinear is a *quantity* of one location: axis values and tool axis are CasADi expressions of its
rotary angles (`location_tapes`). A term is linear in those of one or more consecutive locations, with prices
and bounds. Its expression works on columns of arrays, to price a path, and on CasADi symbols, to derive its
coefficients. To add a term, add a function to `TERMS`: all else reads that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.model import Machine, Vector, Zone, dot, linear_axes_of_posture, tool_axis_of_posture
from fiveaxis.posture.tape import Tape

if TYPE_CHECKING:
    from fiveaxis.posture.problem import Problem

Scalar = Any  # a column of an array, or a CasADi symbol
# Quantities of a location besides its axis values: the tool axis, and how long its step waits.
OTHERS = 4
# CasADi counts references to symbols without a lock.
WRITING = Lock()


class Quantities(NamedTuple):
    """The quantities of one location, each a scalar.

    They are axis values, (k,) mm and rad, the tool axis, (3,), workpiece frame, and s by which the step to
    the next location takes longer than at the feed.
    """

    positions: Sequence[Scalar]
    axis: Vector
    wait: Scalar

    @classmethod
    def of(cls, quantities: Sequence[Scalar]) -> Quantities:
        """Name k + 4 quantities in their order."""
        *positions, u, v, w, wait = quantities
        return cls(positions, (u, v, w), wait)


Expression = Callable[[Sequence[Quantities], Sequence[Scalar]], Sequence[Scalar]]


@dataclass(frozen=True, eq=False)
class Term:
    """Rows of one kind, ``r = C q`` of the quantities q of the locations in a window.

    A row costs ``plus (r − free)⁺ + minus (−r − free)⁺ + square r²``; its bounds are ``low ≤ r ≤ high``.

    Parameters
    ----------
    expression : computes o rows of a window from its locations' quantities and the window's data
    span : locations in a window
    rows : (w,), the windows' first locations
    data : (w, d), of each window
    low, high, plus, minus, free, square : broadcast to (w, o), in the units of the row and J per unit
    """

    name: str
    expression: Expression
    span: int
    rows: IntArray
    data: Array
    low: Array | float = -np.inf
    high: Array | float = np.inf
    plus: Array | float = 0.0
    minus: Array | float = 0.0
    free: Array | float = 0.0
    square: Array | float = 0.0

    @property
    def is_priced(self) -> bool:
        """Whether any of the rows costs in proportion to its value."""
        return bool(np.any(self.plus) or np.any(self.minus))

    @property
    def has_price(self) -> bool:
        """Whether any of the rows costs anything."""
        return self.is_priced or bool(np.any(self.square))

    def values(self, quantities: Array) -> Array:
        """Evaluate the rows for a path's quantities, (n, k + 4); (w, o)."""
        window = [Quantities.of(list(quantities[self.rows + i].T)) for i in range(self.span)]
        return np.stack(self.expression(window, list(self.data.T)), axis=-1)

    def cost(self, values: Array) -> float:
        """Price values, (w, o); J."""
        rise, fall = np.maximum(values - self.free, 0.0), np.maximum(-values - self.free, 0.0)
        return float(np.sum(self.plus * rise + self.minus * fall + self.square * values**2))

    def coefficients(self, count: int) -> tuple[IntArray, Array]:
        """Derive the rows' coefficients with respect to the quantities, `count` of each location.

        Columns, (o, z), are indices into a window's quantities, −1 for none; coefficients are (w, o, z).
        """
        columns, tape = _coefficients(self.expression, self.span, self.data.shape[1], count)
        return columns, tape(self.data).reshape(len(self.data), *columns.shape)


@lru_cache(maxsize=256)
def _coefficients(expression: Expression, span: int, data: int, count: int) -> tuple[IntArray, Tape]:
    """Differentiate an expression, once for each number of data."""
    with WRITING:
        quantities, given = ca.SX.sym("quantities", span * count), ca.SX.sym("data", data)
        split = ca.vertsplit(quantities)
        window = [Quantities.of(split[i * count : (i + 1) * count]) for i in range(span)]
        rows = ca.vertcat(*expression(window, ca.vertsplit(given)))
        if not ca.is_linear(rows, quantities):
            raise ValueError(f"{expression.__name__} isn't linear; make the nonlinear part a quantity")
        slope = ca.jacobian(rows, quantities)
        entry = np.array(ca.DM(slope.sparsity(), 1.0), dtype=bool)
        found = [np.flatnonzero(row) for row in entry]
        most = max(map(len, found))
        padded = np.array([np.pad(row, (0, most - len(row)), constant_values=-1) for row in found])
        entries = [slope[row, c] if c >= 0 else ca.SX(0.0) for row, at in enumerate(padded) for c in at]
        return padded, Tape.of(given, ca.vertcat(*entries))


@dataclass(frozen=True, eq=False)
class LocationTapes:
    """The k + 3 quantities that depend on the rotary angles, axis values then tool axis, and derivatives.

    They are expressions of a location's symbols, (8,): both angles, rad, pivot, mm, and normal. Slopes are
    by the first and the second angle, bows 11, 12 and 22.
    """

    location: ca.SX
    quantities: ca.SX
    slopes: tuple[ca.SX, ...]
    bows: tuple[ca.SX, ...]

    @cached_property
    def values(self) -> Tape:
        """(rotary (2), pivot (3), normal (3)) → (k + 3)."""
        return self._tape(self.quantities)

    @cached_property
    def gradients(self) -> Tape:
        """The same → values, then their derivatives by the first and by the second angle, (k + 3) each."""
        return self._tape(self.quantities, *self.slopes)

    @cached_property
    def second_derivatives(self) -> Tape:
        """The same → values, derivatives 1 and 2, second derivatives 11, 12 and 22, (k + 3) each."""
        return self._tape(self.quantities, *self.slopes, *self.bows)

    @cached_property
    def derivatives(self) -> Tape:
        """(The same, weights (k + 3)) → values; each one's derivatives 1 and 2; weighted sum's 11, 12, 22."""
        with WRITING:
            weights = ca.SX.sym("weights", self.quantities.numel())
            pairs, bent = ca.vec(ca.horzcat(*self.slopes).T), [ca.dot(weights, bow) for bow in self.bows]
            return Tape.of(ca.vertcat(self.location, weights), ca.vertcat(self.quantities, pairs, *bent))

    @cached_property
    def function(self) -> ca.Function:
        """As `values`, for CasADi's own solvers."""
        with WRITING:
            return ca.Function("location", [self.location], [ca.densify(self.quantities)])

    def _tape(self, *values: ca.SX) -> Tape:
        with WRITING:
            return Tape.of(self.location, ca.vertcat(*values))


# A search for a setup goes through many machines.
MOST_WRITTEN = 32
_written: dict[tuple[Any, ...], LocationTapes] = {}


def location_tapes(machine: Machine, zone: Zone) -> LocationTapes:
    """Write a machine's location, once for all machines whose chains have the same lines."""
    chain, axes = machine.chain, range(len(machine.axes))
    joints = tuple((j.letter, *j.line.direction, *j.line.point) for j in chain.joints)
    key = (joints, chain.tool_home.tobytes(), machine.letters, zone.height, zone.offset)
    with WRITING:
        if key in _written:
            return _written[key]
        if len(_written) >= MOST_WRITTEN:
            _written.pop(next(iter(_written)))
        rotary, pivot, normal = (ca.SX.sym(name, size) for name, size in (("rotary", 2), ("p", 3), ("n", 3)))
        linear = linear_axes_of_posture(machine, pivot, rotary, zone, normal)
        values = dict(zip(machine.linear_columns, ca.vertsplit(linear), strict=True))
        values |= dict(zip(machine.rotary_columns, ca.vertsplit(rotary), strict=True))
        quantities = ca.vertcat(*(values[column] for column in axes), tool_axis_of_posture(machine, rotary))
        ahead = ca.DM([1, 0]), ca.DM([0, 1])
        slopes = tuple(ca.jtimes(quantities, rotary, way) for way in ahead)
        bows = tuple(ca.jtimes(slopes[i], rotary, ahead[j]) for i, j in ((0, 0), (0, 1), (1, 1)))
        _written[key] = LocationTapes(ca.vertcat(rotary, pivot, normal), quantities, slopes, bows)
        return _written[key]


def _axis_values(window: Sequence[Quantities], _: Sequence[Scalar]) -> Sequence[Scalar]:
    return window[0].positions


def _lean_cosines(window: Sequence[Quantities], references: Sequence[Scalar]) -> Sequence[Scalar]:
    at = range(0, len(references), 3)
    return [dot(window[0].axis, (references[i], references[i + 1], references[i + 2])) for i in at]


def _steps(window: Sequence[Quantities], _: Sequence[Scalar] = ()) -> Sequence[Scalar]:
    here, there = window
    return [b - a for a, b in zip(here.positions, there.positions, strict=True)]


def _waits(window: Sequence[Quantities], _: Sequence[Scalar]) -> Sequence[Scalar]:
    return [window[0].wait]


def _durations(window: Sequence[Quantities], paces: Sequence[Scalar]) -> Sequence[Scalar]:
    """Time of each axis in both directions at a pace, s/mm and s/rad, less the wait."""
    steps, wait = _steps(window), window[0].wait
    return [sign * pace * step - wait for pace, step in zip(paces, steps, strict=True) for sign in (1, -1)]


def _speed_changes(window: Sequence[Quantities], paces: Sequence[Scalar]) -> Sequence[Scalar]:
    first, then = paces
    return [then * b - first * a for a, b in zip(_steps(window[:2]), _steps(window[1:]), strict=True)]


def limits(problem: Problem) -> Term:
    """Keep axis values within their limits, mm and rad."""
    machine = problem.machine
    return _term("limits", problem, _axis_values, 1, low=machine.low, high=machine.high)


def leans(problem: Problem) -> Term:
    """Keep the cosines of the tool axis to the directions of the bounds within their ranges."""
    bounds = problem.bounds
    ends = np.array([bound.cosines for bound in bounds])
    # A range from 0 has no upper cosine to keep: it would cut off the reference itself.
    ends[ends[:, 1] == 1.0, 1] = np.inf
    free = np.stack([~np.isfinite(bound.reference).all(axis=1) for bound in bounds], axis=1)
    references = np.nan_to_num(np.hstack([bound.reference for bound in bounds]))
    low, high = np.where(free, -np.inf, ends[:, 0]), np.where(free, np.inf, ends[:, 1])
    return _term("leans", problem, _lean_cosines, 1, data=references, low=low, high=high)


def travel(problem: Problem) -> Term:
    """Price the travel of every axis by direction, and bound the turns of rotary ones; mm and rad."""
    most = np.full(problem.plus.shape, np.inf)
    most[:, problem.machine.rotary_columns] = problem.max_turn
    plus, minus = problem.plus, problem.minus
    return _term("travel", problem, _steps, 2, low=-most, high=most, plus=plus, minus=minus)


def bends(problem: Problem) -> Term | None:
    """Price the squares of turns, rad."""
    if not problem.bend_price.any():
        return None
    square = np.zeros(problem.plus.shape)
    square[:, problem.machine.rotary_columns] = problem.bend_price[:, None]
    return _term("bends", problem, _steps, 2, square=square)


def waits(problem: Problem) -> Term | None:
    """Price the time by which steps take longer than at the feed, s."""
    if not problem.is_timed:
        return None
    steps = np.arange(len(problem) - 1)
    return _term("waits", problem, _waits, 1, rows=steps, low=0.0, plus=problem.time_price)


def durations(problem: Problem) -> Term | None:
    """Make steps wait for the slowest axis, s."""
    if not problem.is_timed:
        return None
    if problem.ramps is None:
        paces = np.broadcast_to(1.0 / problem.top_speed, problem.plus.shape)
        most = np.where(np.isfinite(problem.top_speed), problem.least_time[:, None], np.inf)
    else:
        paces, most = problem.ramps
    return _term("durations", problem, _durations, 2, data=paces, high=np.repeat(most, 2, axis=1))


def acceleration_excess(problem: Problem) -> Term | None:
    """Price changes of speed between cuts, mm/s and rad/s, beyond the axes' accelerations."""
    times, timed = problem.least_time, problem.strict & (problem.least_time > 0.0)
    first = np.flatnonzero(timed[:-1] & timed[1:])
    if not len(first) or not np.isfinite(problem.top_acceleration).any():
        return None
    free = (times[first] + times[first + 1])[:, None] / 2.0 * problem.top_acceleration
    paces = 1.0 / np.stack([times[first], times[first + 1]], axis=1)
    prices = dict.fromkeys(("plus", "minus"), problem.excess_price)
    return _term("acceleration", problem, _speed_changes, 3, rows=first, data=paces, free=free, **prices)


# Every term of the problem; one that a problem doesn't need is None.
Write = Callable[["Problem"], Term | None]
TERMS: tuple[Write, ...] = limits, leans, travel, bends, waits, durations, acceleration_excess


def terms_of(problem: Problem, written: Sequence[Write] = TERMS) -> tuple[Term, ...]:
    """Collect the terms of a problem, all or some of them."""
    return tuple(term for term in (write(problem) for write in written) if term is not None)


def _term(
    name: str,
    problem: Problem,
    expression: Expression,
    span: int,
    *,
    rows: IntArray | None = None,
    data: Array | None = None,
    **figures: Array | float,
) -> Term:
    """Build a term, by default for every window of the path and without data."""
    firsts = np.arange(max(len(problem) - span + 1, 0)) if rows is None else rows
    given = np.empty((len(firsts), 0)) if data is None else np.ascontiguousarray(data)
    return Term(name, expression, span, firsts, given, **figures)
