"""Interval arithmetic contains every value and slope of a formula."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.base.geometry.intervals import Enclosure, Interval, cosine

angles = st.floats(-20.0, 20.0)
widths = st.floats(0.0, 8.0)
shares = st.floats(0.0, 1.0)
SLACK = 1e-9


def holds(interval: Interval, value: float) -> bool:
    return bool(interval.low - SLACK <= value <= interval.high + SLACK)


@given(angles, widths, shares)
def test_the_cosine_of_an_interval_holds_every_cosine_in_it(low, width, share):
    interval = cosine(Interval(np.array(low), np.array(low + width)))
    assert holds(interval, np.cos(low + share * width))
    assert -1.0 <= interval.low <= interval.high <= 1.0


def test_the_cosine_over_a_crest_reaches_one_and_elsewhere_its_ends():
    over = cosine(Interval(np.array([-0.1, 0.1, 3.0]), np.array([0.2, 0.2, 3.3])))
    np.testing.assert_allclose(over.high, [1.0, np.cos(0.1), np.cos(3.3)])
    np.testing.assert_allclose(over.low, [np.cos(0.2), np.cos(0.2), -1.0])


def formula(a, b):
    """Some of everything: products, differences, numbers on either side, a quotient."""
    return (2.0 - a[0]) * b[1] / (3.0 + a[1] * b[0]) - (1.0 / (b[0] + 4.0)) + 0.5 * -a[1]


@given(angles, angles, st.floats(0.0, 0.5), shares, shares)
def test_an_enclosure_holds_the_value_and_the_difference_quotients_of_a_formula(x, y, width, s, t):
    boxes = [Interval(np.array(v), np.array(v + width)) for v in (x, y)]
    a, b = (Enclosure.cosine_and_sine(box, i, 2) for i, box in enumerate(boxes))
    enclosed = formula(a, b)

    def value(u, v):
        return formula((np.cos(u), np.sin(u)), (np.cos(v), np.sin(v)))

    u, v = x + s * width, y + t * width
    assert holds(enclosed.value, value(u, v))
    # The mean value theorem: a difference quotient is a slope somewhere between.
    across = value(x + width, v) - value(x, v)
    along = value(u, y + width) - value(u, y)
    for change, low, high in zip((across, along), enclosed.slopes.low, enclosed.slopes.high, strict=True):
        assert low * width - SLACK <= change <= high * width + SLACK


def test_dividing_by_an_interval_around_zero_leaves_everything_possible():
    around = Interval(np.array([-1.0, 1.0]), np.array([1.0, 2.0])).inverse()
    np.testing.assert_array_equal(around.low, [-np.inf, 0.5])
    np.testing.assert_array_equal(around.high, [np.inf, 1.0])
