"""Limits of axes: their ends, span and tolerance, and how far positions exceed them."""

import math
from dataclasses import replace

import numpy as np

from fiveaxis.model import Limits, Machine


def test_a_missing_end_is_none_and_the_span_infinite():
    assert Limits().ends == (None, None)
    half = Limits(low=-1.0)
    assert half.ends == (-1.0, None)
    assert math.isinf(half.span)
    assert Limits(-1.0, 0.5).span == 1.5


def test_a_range_contains_its_ends_and_what_a_tolerance_adds():
    limits = Limits(-1.0, 0.5)
    assert limits.contains(-1.0)
    assert limits.contains(0.5)
    assert not limits.contains(0.6)
    assert limits.contains(0.6, tolerance=0.2)


def test_the_excess_is_positive_beyond_a_limit_and_negative_inside():
    machine = Machine.from_code("640123")
    limits = {"X": Limits(-10.0, 20.0), "A": Limits(-2.0, 0.5)}
    machine = replace(
        machine, axes=tuple(replace(a, limits=limits.get(a.letter, Limits())) for a in machine.axes)
    )
    excess = machine.limit_excess(np.array([[23.0, 1e6, 0.0, -2.5, 99.0], [20.0, 0.0, 0.0, -0.75, 0.0]]))
    np.testing.assert_array_equal(excess[:, machine.column("X")], [3.0, 0.0])
    np.testing.assert_array_equal(excess[:, machine.column("A")], [0.5, -1.25])
    assert (excess[:, [machine.column(c) for c in "YZC"]] == -np.inf).all()
