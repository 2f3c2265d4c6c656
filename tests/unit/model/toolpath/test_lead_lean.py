"""Lead and lean, planes, and bounds that hold at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.base import normalise
from fiveaxis.base.errors import SettingError, ToolpathError
from fiveaxis.model import MoveKind, Tool, Toolpath, feed_directions, refined
from fiveaxis.model.toolpath.bounds import tilt_of


def straight(n: int = 3, tool: Tool | None = None) -> Toolpath:
    """Along +Y over a flat surface: t = Y, n = Z, and the left of the feed is −X."""
    contact = np.stack([np.zeros(n), np.arange(float(n)), np.zeros(n)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), tool or Tool.ball(6))


def axes(lead: float, lean: float) -> np.ndarray:
    """Return the tool axis seen at two angles, degrees, on the straight path."""
    forwards, left = np.tan(np.radians([lead, lean]))
    return normalise(np.array([[-left, forwards, 1.0]] * 3))


def test_lead_tips_the_tool_into_the_feed_and_lean_to_its_left():
    bounds = tilt_bounds(straight(), lead=(5, 20), lean=(-10, 30))
    assert bounds.admits(axes(10, 25)).all()
    assert bounds.admits(axes(5.001, -9.999)).all()
    for lead, lean in ((-10, 0), (4.999, 0), (20.001, 0), (10, -25), (10, 30.001)):
        assert not bounds.admits(axes(lead, lean)).any(), (lead, lean)


@given(lead=st.floats(-80, 80), lean=st.floats(-80, 80), low=st.floats(-85, 80), width=st.floats(1.0, 80.0))
def test_the_bounds_are_the_ranges_of_the_two_angles(lead, lean, low, width):
    high = min(low + width, 89.0)
    axis = axes(lead, lean)
    if min(abs(lead - low), abs(lead - high)) > 1e-6:
        assert tilt_bounds(straight(), lead=(low, high)).admits(axis).all() == (low < lead < high)
    if min(abs(lean - low), abs(lean - high)) > 1e-6:
        assert tilt_bounds(straight(), lean=(low, high)).admits(axis).all() == (low < lean < high)


@given(lead=st.floats(-85, 85), lean=st.floats(-85, 85))
def test_a_lead_and_a_lean_are_one_tilt(lead, lean):
    expected = np.degrees(np.arccos(axes(lead, lean)[0, 2]))
    ends = [(np.radians(angle), np.radians(angle)) for angle in (lead, lean)]
    assert np.degrees(tilt_of(*ends)) == pytest.approx((expected, expected), abs=1e-6)


def test_ranges_of_lead_and_lean_alone_leave_a_range_of_tilt():
    assert tilt_of((-0.1, 0.3), None) == (0.0, np.pi / 2.0)
    assert tilt_of((0.2, 0.3), None) == pytest.approx((0.2, np.pi / 2.0))
    least, most = np.degrees(tilt_of(np.radians((-30, -10)), np.radians((-5, 5))))
    assert least == pytest.approx(10.0)
    assert most == pytest.approx(
        np.degrees(np.arctan(np.hypot(np.tan(np.radians(30)), np.tan(np.radians(5)))))
    )


def test_tilt_lead_and_lean_hold_at_once():
    bounds = tilt_bounds(straight(), (15, 75), lead=(-5, 20))
    assert bounds.name == "normal"
    assert len(bounds.all) == 3
    assert bounds.admits(axes(19, 0)).all()
    assert not bounds.admits(axes(10, 0)).any()  # tilt 10 deg is too little
    assert bounds.admits(axes(10, 40)).all()
    assert not bounds.admits(axes(30, 0)).any()


def test_at_a_corner_and_across_passes_the_feed_is_the_direction_of_the_pass():
    """Zigzag over a flat: forwards along +X, then a link, then back along −X."""
    x = np.array([0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 2.0, 1.0, 0.0])
    y = np.array([0.0, 0.0, 0.0, 0.0, 4.0, 8.0, 8.0, 8.0, 8.0])
    path = Toolpath.from_contacts(
        np.stack([x, y, 0 * x], axis=1), np.tile([0.0, 0.0, 1.0], (9, 1)), Tool.ball(2)
    )
    path = path.with_links(np.arange(9) == 4)
    bounds = tilt_bounds(path, lead=(5, 85))
    forwards = normalise(np.tile([1.0, 0.0, 2.0], (9, 1)))
    assert bounds.admits(forwards).tolist() == [True] * 5 + [False] * 4
    assert np.isnan(bounds.beside[0].reference[4]).all()
    assert path.kind[4] == MoveKind.LINK


def test_a_location_given_again_and_again_keeps_its_neighbours_feed():
    path = straight(4).at(np.array([0, 1, 1, 1, 1, 2, 3]))
    bounds = tilt_bounds(path, lead=(5, 20))
    np.testing.assert_allclose(bounds.beside[0].reference, bounds.beside[0].reference[[0] * 7], atol=1e-12)


@pytest.mark.parametrize("rows", [[0], [1, 1]])
def test_a_path_that_stands_still_has_no_lead(rows):
    path = straight().at(np.array(rows))
    with pytest.raises(ToolpathError, match="location 0 has no feed direction"):
        tilt_bounds(path, lead=(0, 20))


def test_lead_without_normals_is_refused():
    path = Toolpath.from_tips(np.eye(3), np.tile([0.0, 0.0, 1.0], (3, 1)), Tool.ball(6))
    with pytest.raises(ToolpathError, match="no surface normals, so lead mean"):
        tilt_bounds(path, cone=20, lead=(0, 10))


@pytest.mark.parametrize("given_range", [(20, 10), (10, 10), (-90, 10), (0, 90), (float("nan"), 5)])
def test_an_impossible_range_is_named(given_range):
    with pytest.raises(
        SettingError, match=r"lead range .* not inside -90…90 deg|lead = nan deg is out of range"
    ):
        tilt_bounds(straight(), lead=given_range)


def test_lead_and_lean_choose_the_part_of_the_cutter_that_touches():
    path = for_tilt(straight(tool=Tool.bull(10, 2)), lead=(2, 30), lean=(-5, 5))
    assert path.zone.name == "corner"


def test_a_plane_keeps_the_axis_at_right_angles_to_a_vector():
    bounds = tilt_bounds(straight(), (0, 60), plane=(0, 2, 0))
    assert bounds.admits(axes(0, 50)).all()
    assert bounds.admits(axes(0.49, 0)).all()
    assert not bounds.admits(axes(0.51, 0)).any()
    with pytest.raises(SettingError, match="at right angles"):
        tilt_bounds(straight(), (0, 60), plane=(0, 0, 0))


@given(start=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_drawing_in_ends_inside_every_bound(start):
    bounds = tilt_bounds(straight(), (10, 75), lead=(-5, 20), lean=(10, 12))
    drawn = bounds.draw_in(normalise(np.array([start] * 3)), np.radians(0.1))
    assert bounds.admits(drawn).all()
    np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1.0)


def test_drawing_in_leaves_what_is_inside_as_it_is_and_links_free():
    path = straight(5).with_links(np.arange(5) == 2)
    bounds = tilt_bounds(path, (10, 75), lead=(-5, 20))
    inside = np.array([axes(10, 20)[0]] * 5)
    np.testing.assert_array_equal(bounds.draw_in(inside, 0.01), inside)
    away = np.tile([0.0, 0.0, -1.0], (5, 1))
    np.testing.assert_array_equal(bounds.draw_in(away, 0.01)[2], away[2])


def test_the_feed_direction_at_a_location_is_the_same_whatever_is_inserted_beside_it():
    turn = np.linspace(0.0, 3.0, 13)
    out = np.column_stack([np.cos(turn), np.sin(turn), np.full(13, -0.5)])
    path = Toolpath.from_contacts(30.0 * out, out / np.hypot(1.0, 0.5), Tool.ball(8))
    finer = refined(path, np.sort(np.append(np.arange(13.0), [4.5, 5.2, 5.4, 5.6, 5.8])))
    own, again = (feed_directions(one, one.normal) for one in (path, finer))
    np.testing.assert_allclose(again[~finer.inserted], own, atol=1e-12)
