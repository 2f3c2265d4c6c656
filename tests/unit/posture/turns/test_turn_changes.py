"""Locations inserted into a path where an axis may change its turn."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import Array, angle_between
from fiveaxis.model import Limits, Machine, TiltBounds, Tool, Toolpath, tool_axes
from fiveaxis.model.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.posture.turns.stops import bounds_between, find_turn_changes, with_turn_changes


def open_turns(angle: float, limits: Limits) -> int:
    """How many turns an angle may be on."""
    first = np.ceil((limits.low - ON_LIMIT - angle) / TURN)
    return int(np.floor((limits.high + ON_LIMIT - angle) / TURN) - first) + 1


@given(
    angles=st.lists(st.floats(-9.0, 9.0), min_size=2, max_size=8).map(np.cumsum),
    low=st.floats(-7.0, 7.0),
    width=st.sampled_from([0.0, 1e-6, 0.3, 2.0, 6.0]),
)
def test_no_move_passes_a_turn_change_without_a_location_and_each_has_two_turns(angles, low, width):
    limits = Limits(low, low + TURN + width)
    rows, changes = find_turn_changes(angles, limits)
    assert all(open_turns(a, limits) == 2 for a in changes)
    np.testing.assert_allclose(np.interp(rows, np.arange(len(angles)), angles), changes, atol=1e-9)
    order = np.argsort(np.concatenate([np.arange(len(angles)), rows]), kind="stable")
    full = np.concatenate([angles, changes])[order]
    assert len(find_turn_changes(full, limits)[0]) == 0


@pytest.mark.parametrize("limits", [Limits(), Limits(0.0, np.inf), Limits(-TURN, TURN), Limits(-1.0, 2.0)])
def test_an_axis_with_two_turns_an_open_end_or_less_than_a_turn_has_no_turn_change(limits):
    assert len(find_turn_changes(np.linspace(-20.0, 20.0, 9), limits)[0]) == 0


def test_a_location_at_the_turn_change_is_not_inserted_again():
    rows, _ = find_turn_changes(np.radians([90.0, 180.0, 270.0]), Limits(-np.pi, np.pi))
    assert len(rows) == 0


def around(degrees: list[float], tool: Tool) -> tuple[Toolpath, Array]:
    """A path round a cylinder with C at some angles, and postures that lean about 50 deg."""
    angle = np.radians(degrees)
    normal = np.stack([-np.sin(angle), np.cos(angle), np.zeros(3)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, tool)
    return path, np.stack([angle, np.radians([-40.0, -45.0, -55.0])], axis=1)


def half_turns(machine: Machine) -> Machine:
    """The machine with C of ±180 deg."""
    limits = Limits(-np.pi, np.pi)
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


@pytest.mark.parametrize("tool", [Tool.ball(6), Tool.bull(10, 2)])
def test_an_inserted_pivot_lies_on_the_straight_line_with_angles_in_proportion(hayashi, tool):
    path, rotary = around([150.0, 170.0, 190.0], tool)
    machine = half_turns(hayashi)
    course = with_turn_changes(path, machine, rotary, [machine.column("C")])
    np.testing.assert_allclose(course.row, [0.0, 1.0, 1.5, 2.0])
    np.testing.assert_array_equal(course.own, [True, True, False, True])
    assert course.rotary[2, 0] == np.pi
    assert np.degrees(course.rotary[2, 1]) == pytest.approx(-50.0)
    there = course.toolpath
    np.testing.assert_allclose(there.pivot[2], (path.pivot[1] + path.pivot[2]) / 2.0, atol=1e-12)
    np.testing.assert_allclose(there.normal[2], [0.0, -1.0, 0.0], atol=1e-12)
    assert there.source[2] == path.source[2]
    np.testing.assert_array_equal(there.pivot[course.own], path.pivot)


def test_where_the_surface_is_unknown_a_point_of_the_tool_axis_moves_straight(hayashi):
    known, rotary = around([150.0, 170.0, 190.0], Tool.bull(10, 2))
    axes = tool_axes(hayashi, rotary)
    path = Toolpath.from_tips(known.tips(axes), axes, known.tool)
    machine = half_turns(hayashi)
    course = with_turn_changes(path, machine, rotary, [machine.column("C")])
    centres = path.centres(axes)
    np.testing.assert_allclose(course.toolpath.pivot[2], (centres[1] + centres[2]) / 2.0, atol=1e-12)
    assert np.isnan(course.toolpath.normal[2]).all()
    middle = (axes[1] + axes[2]) / np.linalg.norm(axes[1] + axes[2])
    np.testing.assert_allclose(course.toolpath.axis[2], middle, atol=1e-12)


def test_at_an_inserted_location_the_other_angle_keeps_the_bounds_on_the_lean(hayashi):
    """Two postures that lean just as far as they may to both sides: halfway they would lean too little."""
    machine = half_turns(hayashi)
    path, rotary = around([178.0, 179.0, 181.0], Tool.ball(6))
    rotary = np.stack([rotary[:, 0] + np.radians([-6.0, -6.0, 6.0]), np.full(3, np.radians(-45.0))], axis=1)
    angles = np.degrees(angle_between(tool_axes(machine, rotary), path.normal))
    tilt = tilt_bounds(path, tilt=(float(angles.min()) - 0.01, 89.0))
    free = with_turn_changes(path, machine, rotary, [machine.column("C")])
    assert not bounds_between(tilt, free.row).admits(tool_axes(machine, free.rotary)).all()
    course = with_turn_changes(path, machine, rotary, [machine.column("C")], tilt)
    assert course.admitted.all()
    assert bounds_between(tilt, course.row).admits(tool_axes(machine, course.rotary)).all()
    assert course.rotary[~course.own, 0] == np.pi
    assert 0.0 < np.degrees(np.abs(course.rotary - free.rotary).max()) < 5.0
    # Where no angle keeps the bounds the location isn't admitted.
    strict = tilt_bounds(path, tilt=(0.0, 0.001))
    assert (
        with_turn_changes(path, machine, rotary, [machine.column("C")], strict).admitted.tolist().count(False)
        == 1
    )


def test_bounds_between_bind_where_both_locations_are_bound():
    reference = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.nan] * 3, [0.0, 0.0, 1.0]])
    bounds = bounds_between(
        TiltBounds(reference, 0.1, 0.2, "normal"), np.array([0.0, 0.5, 1.0, 1.5, 2.5, 3.0])
    )
    diagonal = np.sqrt(0.5)
    np.testing.assert_allclose(bounds.reference[1], [diagonal, diagonal, 0.0])
    np.testing.assert_array_equal(bounds.reference[[0, 2, 5]], reference[[0, 1, 3]])
    assert np.isnan(bounds.reference[[3, 4]]).all()
