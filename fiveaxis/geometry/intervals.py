"""Interval arithmetic: what a formula gives at least and at most while its arguments vary.

Written for equations over ``+ - * /`` and cosines: an `Enclosure` goes through them as a number would, and
comes out with the range of the value and of its derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from fiveaxis.geometry.vectors import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Interval:
    """Ranges of numbers, element by element.

    Rounding isn't directed: the last digits of a bound may be wrong, as in any other figure.

    Parameters
    ----------
    low, high : (...), any unit, low ≤ high
    """

    # numpy's numbers leave the arithmetic to us.
    __array_ufunc__ = None

    low: Array
    high: Array

    @classmethod
    def of(cls, value: Interval | Array | float) -> Interval:
        """Make a number an interval of no width."""
        return value if isinstance(value, Interval) else cls(np.asarray(value), np.asarray(value))

    @property
    def middle(self) -> Array:
        """(...), halfway between the ends."""
        return 0.5 * (self.low + self.high)

    @property
    def radius(self) -> Array:
        """(...), half the width."""
        return 0.5 * (self.high - self.low)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __add__(self, other: Interval | Array | float) -> Interval:
        o = Interval.of(other)
        return Interval(self.low + o.low, self.high + o.high)

    def __sub__(self, other: Interval | Array | float) -> Interval:
        return self + (-Interval.of(other))

    def __mul__(self, other: Interval | Array | float) -> Interval:
        o = Interval.of(other)
        ends = [a * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return Interval(np.minimum.reduce(ends), np.maximum.reduce(ends))

    def inverse(self) -> Interval:
        """Give 1/x; everything where the interval holds 0."""
        with np.errstate(divide="ignore"):
            ends = 1.0 / self.high, 1.0 / self.low
        around = (self.low <= 0.0) & (self.high >= 0.0)
        return Interval(np.where(around, -np.inf, ends[0]), np.where(around, np.inf, ends[1]))


def cosine(angle: Interval) -> Interval:
    """Enclose the cosine of angles, rad."""
    ends = np.cos(angle.low), np.cos(angle.high)
    return Interval(
        np.where(_holds_turn(angle, np.pi), -1.0, np.minimum(*ends)),
        np.where(_holds_turn(angle, 0.0), 1.0, np.maximum(*ends)),
    )


def _holds_turn(angle: Interval, place: float) -> BoolArray:
    """Tell whether an interval holds an angle or one that is whole turns away."""
    turn = 2.0 * np.pi
    return place + turn * np.ceil((angle.low - place) / turn) <= angle.high


@dataclass(frozen=True, eq=False)
class Enclosure:
    """The range of a function's value and of its partial derivatives, over boxes of its arguments.

    Parameters
    ----------
    value : of the function
    slopes : one for each argument
    """

    __array_ufunc__ = None

    value: Interval
    slopes: tuple[Interval, ...]

    @classmethod
    def cosine_and_sine(cls, angle: Interval, argument: int, arguments: int) -> tuple[Self, Self]:
        """Enclose cosine and sine of one of the arguments, rad."""
        cos, sin = cosine(angle), cosine(angle - np.pi / 2.0)
        still = Interval.of(np.zeros_like(cos.low))

        def sloped(slope: Interval) -> tuple[Interval, ...]:
            return tuple(slope if i == argument else still for i in range(arguments))

        return cls(cos, sloped(-sin)), cls(sin, sloped(cos))

    def _of(self, other: Enclosure | float) -> Enclosure:
        if isinstance(other, Enclosure):
            return other
        return Enclosure(Interval.of(other), tuple(Interval.of(0.0) for _ in self.slopes))

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.value, tuple(-s for s in self.slopes))

    def __add__(self, other: Enclosure | float) -> Enclosure:
        o = self._of(other)
        return Enclosure(
            self.value + o.value, tuple(a + b for a, b in zip(self.slopes, o.slopes, strict=True))
        )

    def __sub__(self, other: Enclosure | float) -> Enclosure:
        return self + (-self._of(other))

    def __mul__(self, other: Enclosure | float) -> Enclosure:
        o = self._of(other)
        slopes = tuple(a * o.value + self.value * b for a, b in zip(self.slopes, o.slopes, strict=True))
        return Enclosure(self.value * o.value, slopes)

    def inverse(self) -> Enclosure:
        """Give 1/x; everything where the value may be 0."""
        reciprocal = self.value.inverse()
        return Enclosure(reciprocal, tuple(-(s * (reciprocal * reciprocal)) for s in self.slopes))

    def __truediv__(self, other: Enclosure | float) -> Enclosure:
        return self * self._of(other).inverse()

    def __radd__(self, other: float) -> Enclosure:
        return self + other

    def __rsub__(self, other: float) -> Enclosure:
        return -self + other

    def __rmul__(self, other: float) -> Enclosure:
        return self * other

    def __rtruediv__(self, other: float) -> Enclosure:
        return self.inverse() * other
