"""Products and angles are those of numpy, but for the last digit."""

import numpy as np
import pytest

from fiveaxis.base import arccos, arcsin, arctan2, frame_along, inverse_transform, product
from fiveaxis.base.geometry.angles import sine

ROUNDING = 1e-14
SHAPES = [((3,), (3,)), ((3,), (5, 3, 4)), ((5, 4, 3), (3,)), ((4, 3), (3, 2)), ((5, 1, 4, 3), (6, 3, 2))]


@pytest.mark.parametrize(("first", "second"), SHAPES)
def test_a_product_of_vectors_matrices_and_stacks_is_what_the_operator_gives(first, second):
    draw = np.random.default_rng(1)
    a, b = draw.normal(size=first), draw.normal(size=second)
    np.testing.assert_allclose(product(a, b), a @ b, rtol=0.0, atol=ROUNDING)


def test_a_product_of_many_is_multiplied_from_the_left():
    a, b, c = np.random.default_rng(2).normal(size=(3, 4, 4))
    np.testing.assert_array_equal(product(a, b, c), product(product(a, b), c))


def test_angles_are_those_of_numpy_to_rounding():
    angle = np.linspace(-np.pi, np.pi, 721)
    x, y = np.cos(angle), np.sin(angle)
    np.testing.assert_allclose(arctan2(y, x), np.arctan2(y, x), rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(np.cos(arccos(x)), x, rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(np.sin(arcsin(y)), y, rtol=0.0, atol=ROUNDING)
    np.testing.assert_array_equal(arccos([1.0, 0.0, -1.0]), [0.0, np.pi / 2.0, np.pi])
    np.testing.assert_array_equal(arcsin([1.0, 0.0, -1.0]), [np.pi / 2.0, 0.0, -np.pi / 2.0])


@pytest.mark.parametrize("reach", [1.0, 100.0, 1e6])
def test_sines_without_the_c_library_are_off_by_the_last_digit_at_most(reach):
    angles = np.random.default_rng(3).uniform(-reach, reach, 2_000)
    for quarters in range(4):
        found = np.array([sine(angle, float(quarters)) for angle in angles])
        expected = (np.sin(angles), np.cos(angles), -np.sin(angles), -np.cos(angles))[quarters]
        np.testing.assert_allclose(found, expected, rtol=5e-16, atol=0.0)


def test_sines_at_whole_quarters_of_a_turn_and_of_no_number():
    quarter = np.pi / 2.0
    for turns in range(-9, 10):
        assert sine(turns * quarter, 0.0) == pytest.approx(np.sin(turns * quarter), rel=1e-15, abs=0.0)
    assert [sine(0.0, 0.0), sine(0.0, 1.0), sine(0.0, 2.0), sine(0.0, 3.0)] == [0.0, 1.0, 0.0, -1.0]
    assert np.isnan([sine(np.nan, 0.0), sine(np.inf, 1.0)]).all()


def test_angles_broadcast_and_say_which_side_of_the_cut_they_are_on():
    assert arctan2(np.zeros((2, 1)), np.ones(3)).shape == (2, 3)
    np.testing.assert_array_equal(arctan2([0.0, -0.0], -1.0), [np.pi, -np.pi])


def test_transforms_in_a_stack_are_inverted_one_by_one():
    moved = [frame_along(z, (1.0, 2.0, 3.0)) for z in ((0.0, 0.6, 0.8), (-0.6, 0.64, -0.48))]
    inverse = inverse_transform(np.array(moved))
    np.testing.assert_allclose(product(inverse, moved), np.broadcast_to(np.eye(4), (2, 4, 4)), atol=ROUNDING)
    np.testing.assert_array_equal(inverse[1], inverse_transform(moved[1]))
