"""Circular moves in their plane."""

import math

import numpy as np
import pytest

from fiveaxis.nc.control.arcs import arc_about, arc_of_radius


def test_the_radius_of_a_half_circle_may_be_too_small_by_rounding():
    arc = arc_of_radius((0, 0), (10, 0), 4.999, clockwise=True)
    assert arc.radii == pytest.approx((5, 5))
    assert arc.sweep == pytest.approx(-math.pi)


def test_radii_that_differ_by_rounding_change_along_the_arc():
    # The ends of a block of the LinuxCNC boat: radius 5.0002 at its begin, 5.001 at its end.
    arc = arc_about((-48.713, 20.275), (-44.662, 22.345), (-44.662, 17.344), clockwise=True)
    radii = np.linalg.norm(arc.points(50) - [-44.662, 17.344], axis=1)
    assert (np.diff(radii) > 0).all()
    np.testing.assert_allclose(arc.points(7)[-1], [-44.662, 22.345], atol=1e-12)


@pytest.mark.parametrize(("tolerance", "parts"), [(1.0, 4), (1 - math.cos(math.pi / 6), 6), (1e-4, 223)])
def test_the_number_of_chords_follows_from_the_tolerance(tolerance, parts):
    # n chords of a circle of radius 1 are 1 - cos(pi / n) off; 222 of them would be 1.0013e-4 off.
    assert arc_about((1, 0), (1, 0), (0, 0), clockwise=False).parts(tolerance) == parts
