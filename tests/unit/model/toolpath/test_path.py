"""Toolpaths: contacts, tips and faults of their rows."""

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import Tool, Toolpath, parse_tool

UP = np.array([0.0, 0.0, 1.0])
BALL = Tool.ball(10)


def test_turning_a_ball_about_its_centre_keeps_the_contact():
    path = Toolpath.from_contacts([[1.0, 2.0, 3.0]], [[0.0, 0.0, 2.0]], BALL)
    for axis in np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.8, 0.6]]):
        tip = path.tips(axis[None])[0]
        centre = tip + BALL.radius * axis
        np.testing.assert_allclose(centre - BALL.radius * UP, [1.0, 2.0, 3.0])


def test_a_tip_and_its_axis_give_the_same_centre():
    path = Toolpath.from_tips([[1.0, 2.0, 3.0]], [[3.0, 0.0, 4.0]], BALL)
    np.testing.assert_allclose(path.pivot, [[1.0 + 3.0, 2.0, 3.0 + 4.0]])
    np.testing.assert_allclose(path.tips(path.axis), [[1.0, 2.0, 3.0]])
    assert not path.has_normals
    assert path.has_axes


@pytest.mark.parametrize(
    ("contact", "normal", "said"),
    [
        (
            [[0.0, 0, 0], [1, 0, 0]],
            [[0.0, 0, 1], [0, 0, 0]],
            "p.csv:8: the normal of location 1 has length 0",
        ),
        ([[0.0, 0, np.nan]], [[0.0, 0, 1]], "p.csv:7: location 0 has a position that isn't a finite number"),
        ([[0.0, 0, 0]], [[0.0, 0, np.nan]], "a length that isn't a number"),
        ([[0.0, 0]], [[0.0, 0, 1]], r"contact has shape \(1, 2\)"),
        (np.zeros((0, 3)), np.zeros((0, 3)), "no cutter locations"),
    ],
)
def test_a_bad_location_is_named_with_its_line(contact, normal, said):
    with pytest.raises(ToolpathError, match=said):
        Toolpath.from_contacts(contact, normal, BALL, source=7 + np.arange(len(contact)), name="p.csv")


def test_a_feed_that_isnt_positive_is_refused():
    with pytest.raises(ToolpathError, match="no positive feed"):
        Toolpath.from_contacts([[0.0, 0, 0]], [[0.0, 0, 1]], BALL, feed_mm_min=0.0)


def test_a_tool_survives_its_short_form():
    assert parse_tool(str(Tool.ball(9.525))) == Tool.ball(9.525)


@pytest.mark.parametrize("tilt", [(75, 15), (15, 15), (-5, 30), (0, 190), (float("nan"), 30)])
def test_an_invalid_tilt_range_is_refused(tilt):
    path = Toolpath.from_contacts([[0.0, 0, 0]], [UP], BALL)
    with pytest.raises(SettingError, match=r"empty, reversed or outside|tilt = nan deg is out of range"):
        tilt_bounds(path, tilt)


def test_the_tilt_of_a_link_is_nan_and_that_of_a_cut_its_angle():
    path = Toolpath.from_contacts(np.zeros((2, 3)), [UP, UP], BALL).with_links(np.array([False, True]))
    angles = tilt_bounds(path, (0, 90)).angles(np.array([[0.0, 0.6, 0.8]] * 2))
    assert angles[0] == pytest.approx(np.arccos(0.8))
    assert np.isnan(angles[1])
    np.testing.assert_array_equal(path.pivot[0], path.pivot[1])
