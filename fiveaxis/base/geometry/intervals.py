"""Interval arithmetic: bounds on a formula's value while its arguments vary.

For equations of ``+ - * /`` and cosines: an `Enclosure` replaces a number in them and carries the ranges of
the value and of its derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from fiveaxis.base.geometry.vectors import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Interval:
    """Ranges of numbers, element by element, without directed rounding.

    Parameters
    ----------
    low, high : (...), any unit, low ≤ high
    """

    # numpy scalars defer to this class's operators.
    __array_ufunc__ = None

    low: Array
    high: Array

    @classmethod
    def of(cls, value: Interval | Array | float) -> Interval:
        """Return a number as an interval of zero width; an interval as it is."""
        return value if isinstance(value, Interval) else cls(np.asarray(value), np.asarray(value))

    @property
    def middle(self) -> Array:
        """(...), midpoint."""
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
        """Return 1/x; unbounded where the interval contains 0."""
        with np.errstate(divide="ignore"):
            ends = 1.0 / self.high, 1.0 / self.low
        has_zero = (self.low <= 0.0) & (self.high >= 0.0)
        return Interval(np.where(has_zero, -np.inf, ends[0]), np.where(has_zero, np.inf, ends[1]))


def cosine(angle: Interval) -> Interval:
    """Enclose the cosine of angles, rad."""
    ends = np.cos(angle.low), np.cos(angle.high)
    return Interval(
        np.where(_contains(angle, np.pi), -1.0, np.minimum(*ends)),
        np.where(_contains(angle, 0.0), 1.0, np.maximum(*ends)),
    )


def _contains(interval: Interval, angle: float) -> BoolArray:
    """Check whether an interval contains an angle, up to whole turns."""
    turn = 2.0 * np.pi
    return angle + turn * np.ceil((interval.low - angle) / turn) <= interval.high


@dataclass(frozen=True, eq=False)
class Enclosure:
    """Range of a function's value, (...), and of its partial derivatives, (arguments, ...), over boxes."""

    __array_ufunc__ = None

    value: Interval
    slopes: Interval

    @classmethod
    def cosine_and_sine(cls, angle: Interval, argument: int, arguments: int) -> tuple[Self, Self]:
        """Enclose cosine and sine of the argument with index `argument` out of `arguments`, rad."""
        cos, sin = cosine(angle), cosine(angle - np.pi / 2.0)
        own = Interval.of(np.expand_dims(np.eye(arguments)[argument], tuple(range(1, cos.low.ndim + 1))))
        return cls(cos, own * -sin), cls(sin, own * cos)

    def _of(self, other: Enclosure | float) -> Enclosure:
        return other if isinstance(other, Enclosure) else Enclosure(Interval.of(other), Interval.of(0.0))

    def __neg__(self) -> Enclosure:
        return Enclosure(-self.value, -self.slopes)

    def __add__(self, other: Enclosure | float) -> Enclosure:
        o = self._of(other)
        return Enclosure(self.value + o.value, self.slopes + o.slopes)

    def __sub__(self, other: Enclosure | float) -> Enclosure:
        return self + (-self._of(other))

    def __mul__(self, other: Enclosure | float) -> Enclosure:
        o = self._of(other)
        return Enclosure(self.value * o.value, self.slopes * o.value + self.value * o.slopes)

    def inverse(self) -> Enclosure:
        """Return 1/x; unbounded where the value may be 0."""
        reciprocal = self.value.inverse()
        return Enclosure(reciprocal, -(self.slopes * (reciprocal * reciprocal)))

    def __truediv__(self, other: Enclosure | float) -> Enclosure:
        return self * self._of(other).inverse()

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: float) -> Enclosure:
        return -self + other

    def __rtruediv__(self, other: float) -> Enclosure:
        return self.inverse() * other
