"""Bounds drawn in, so that a path which is solved again keeps the given ones between its locations too.

The problem binds postures at locations. Between two of them the rotary axes turn in proportion, and what they
pass there may lie outside. Whoever has looked (`fiveaxis.job.replanning`) draws the bounds in where that
happens, and has the path solved again from where it was.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Axis, Limits, Machine
from fiveaxis.posture.problem import Problem
from fiveaxis.toolpath import TiltBounds

# A bound is narrowed by no more than this share of its width at each end, so that something is left.
MOST = 0.4


@dataclass(frozen=True, eq=False)
class Tightening:
    """By how much bounds are drawn in, and the path that is refined within them.

    Parameters
    ----------
    start : (n, 2), rad, chain order: the path found without
    lean : (b, n), rad, by which each bound on the tool's lean, in the order of `TiltBounds.all`, is narrowed
        at a location
    low, high : (k,), mm and rad, by which each end of an axis's travel is drawn in
    turn : (n − 1,), rad, largest turn of a rotary axis in each move; infinite where this asks for nothing
    """

    start: Array
    lean: Array
    low: Array
    high: Array
    turn: Array

    @classmethod
    def none(cls, start: Array, bounds: TiltBounds, machine: Machine) -> Tightening:
        """Begin with bounds as they are."""
        n, k = len(start), len(machine.axes)
        return cls(start, np.zeros((len(bounds.all), n)), np.zeros(k), np.zeros(k), np.full(n - 1, math.inf))

    def travel(self, machine: Machine) -> Machine:
        """Return a machine with less travel; an axis that is held, or would have none left, keeps its own."""
        ends = zip(machine.axes, self.low.tolist(), self.high.tolist(), strict=True)
        return replace(machine, axes=tuple(_shorter(axis, low, high) for axis, low, high in ends))

    def bounds(self, tilt: TiltBounds) -> TiltBounds:
        """Return the bounds on the lean with the narrower ones beside them."""
        narrower = [n for b, margins in zip(tilt.all, self.lean, strict=True) for n in _narrower(b, margins)]
        return replace(tilt, beside=(*tilt.beside, *narrower))

    def turns(self, problem: Problem) -> Problem:
        """Return a problem whose moves turn less."""
        return replace(problem, max_turn=np.minimum(problem.max_turn, self.turn[:, None]))


def _shorter(axis: Axis, low: float, high: float) -> Axis:
    limits = axis.limits
    if low == high == 0.0 or not limits.low + low < limits.high - high:
        return axis
    return replace(axis, limits=Limits(limits.low + low, limits.high - high))


def _narrower(bound: TiltBounds, margins: Array) -> Iterator[TiltBounds]:
    """Narrow a bound by each of its margins, (n,) rad, where that is asked for.

    No angle to a direction is below 0 or above π: these ends bind nothing and stay.
    """
    for margin in np.unique(margins[margins > 0.0]).tolist():
        inset = min(margin, MOST * (bound.high - bound.low))
        low = bound.low + inset if bound.low > 0.0 else bound.low
        high = bound.high - inset if bound.high < math.pi else bound.high
        yield replace(bound, low=low, high=high, beside=()).only(margins == margin)
