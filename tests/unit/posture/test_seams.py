"""Places put into a path where an axis may change its turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Limits
from fiveaxis.posture.seams import passed_seams, with_seams
from fiveaxis.toolpath import Tool, Toolpath


def open_turns(angle: float, limits: Limits) -> int:
    """How many turns an angle may be on."""
    first = np.ceil((limits.low - ON_LIMIT - angle) / TURN)
    return int(np.floor((limits.high + ON_LIMIT - angle) / TURN) - first) + 1


@settings(deadline=None, derandomize=True, max_examples=150)
@given(
    angles=st.lists(st.floats(-9.0, 9.0), min_size=2, max_size=8).map(np.cumsum),
    low=st.floats(-7.0, 7.0),
    width=st.sampled_from([0.0, 1e-6, 0.3, 2.0, 6.0]),
)
def test_no_move_passes_a_seam_without_a_location_and_each_has_two_turns(angles, low, width):
    limits = Limits(low, low + TURN + width)
    rows, seam = passed_seams(angles, limits)
    assert all(open_turns(a, limits) == 2 for a in seam)
    np.testing.assert_allclose(np.interp(rows, np.arange(len(angles)), angles), seam, atol=1e-9)
    order = np.argsort(np.concatenate([np.arange(len(angles)), rows]), kind="stable")
    full = np.concatenate([angles, seam])[order]
    assert len(passed_seams(full, limits)[0]) == 0


@pytest.mark.parametrize("limits", [Limits(), Limits(0.0, np.inf), Limits(-TURN, TURN), Limits(-1.0, 2.0)])
def test_an_axis_with_two_turns_an_open_end_or_less_than_a_turn_has_no_seam(limits):
    assert len(passed_seams(np.linspace(-20.0, 20.0, 9), limits)[0]) == 0


def test_a_location_on_the_seam_is_not_put_in_again():
    rows, _ = passed_seams(np.radians([90.0, 180.0, 270.0]), Limits(-np.pi, np.pi))
    assert len(rows) == 0


def test_a_place_lies_on_the_way_of_the_contact_with_angles_in_proportion(hayashi):
    """A bull-nose leans about its contact, so the point of its axis runs straight and not the pivot."""
    angle = np.radians([150.0, 170.0, 190.0])
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.bull(10, 2))
    rotary = np.stack([angle, np.radians([-40.0, -45.0, -55.0])], axis=1)
    axes = tuple(replace(a, limits=Limits(-np.pi, np.pi)) if a.letter == "C" else a for a in hayashi.axes)
    machine = replace(hayashi, axes=axes)
    course = with_seams(path, machine, rotary, [machine.column("C")])
    np.testing.assert_allclose(course.place, [0.0, 1.0, 1.5, 2.0])
    np.testing.assert_array_equal(course.own, [True, True, False, True])
    assert course.rotary[2, 0] == np.pi
    assert np.degrees(course.rotary[2, 1]) == pytest.approx(-50.0)
    centres = path.centres(tool_axes(machine, rotary))
    np.testing.assert_allclose(course.toolpath.pivot[2], (centres[1] + centres[2]) / 2.0, atol=1e-12)
    assert np.isnan(course.toolpath.normal[2]).all()
    assert course.toolpath.source[2] == path.source[2]
