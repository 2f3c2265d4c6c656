"""How far a rotary axis may turn from one location to the next."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import Constraints, Tool, Toolpath, divided_rows, refined
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.posture.strategy.rotary_bounds import PROGRAMMED_SHARE, turn_bounds

PLACES = np.array([[0.0, 0, 0], [5.0, 0, 0], [9.0, 0, 0], [12.0, 0, 0]])


def straight() -> Toolpath:
    return Toolpath.from_contacts(PLACES, [[0.0, 0.0, 1.0]] * 4, Tool.ball(6), feed_mm_min=600.0)


def test_a_program_may_turn_as_far_as_it_is_programmed_to():
    axis = [[0.0, 0, 1], [0.0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]]
    path = Toolpath.from_tips(PLACES, axis, Tool.ball(6))
    turns = np.degrees(turn_bounds(path, Constraints.of_degrees(max_turn=15.0)))
    np.testing.assert_allclose(turns, [15.0, np.degrees(np.arccos(0.8)), 15.0])


def test_by_default_an_axis_turns_by_180_degrees_a_second_at_the_feed():
    np.testing.assert_allclose(np.degrees(turn_bounds(straight(), Constraints())), [90.0, 72.0, 54.0])
    fast = replace(straight(), feed=np.full(4, 50.0))
    np.testing.assert_allclose(
        np.degrees(turn_bounds(fast, Constraints())), 180.0 * np.array([0.1, 0.08, 0.06])
    )


@pytest.mark.parametrize("max_turn", [None, 0.3])
def test_a_bound_on_a_move_is_shared_out_over_its_parts(max_turn):
    path, parts = straight(), np.array([3, 2, 4])
    row = divided_rows(parts)
    whole = turn_bounds(path, Constraints(max_turn=max_turn))
    divided = turn_bounds(refined(path, row), Constraints(max_turn=max_turn), row)
    np.testing.assert_allclose(np.add.reduceat(divided, [0, 3, 5]), whole)


def test_a_rate_bounds_the_turn_over_the_path_of_cuts():
    path = straight().with_links(np.array([False, False, True, False]))
    turns = turn_bounds(path, Constraints(max_turn=1.0, turn_rate=0.01))
    np.testing.assert_allclose(turns, [0.05, 3.0, 0.03])


def test_by_default_an_axis_may_turn_as_far_as_the_programmed_tool_axes_need(hayashi):
    lean = np.radians(3.0)
    direction = np.radians([0.0, 16.0, 32.0, 122.0])
    axis = [[np.sin(lean) * np.cos(c), np.sin(lean) * np.sin(c), np.cos(lean)] for c in direction]
    path = Toolpath.from_tips(PLACES, axis, Tool.ball(6), feed_mm_min=6000.0)
    turns = np.degrees(turn_bounds(path, Constraints(), machine=hayashi))
    np.testing.assert_allclose(turns, PROGRAMMED_SHARE * np.array([16.0, 16.0, 90.0]))
    asked = Constraints.of_degrees(max_turn=10.0)
    np.testing.assert_allclose(np.degrees(turn_bounds(path, asked, machine=hayashi)), 10.0)


def test_a_narrow_cone_near_the_singular_direction_has_a_path(hayashi):
    lean, across = np.radians(np.linspace(-20.0, 20.0, 60)), np.sin(np.radians(3.0))
    axis = np.stack([np.sin(lean), np.full(60, across), np.sqrt(np.cos(lean) ** 2 - across**2)], axis=1)
    tips = np.stack([np.arange(60.0), np.zeros(60), np.zeros(60)], axis=1)
    path = Toolpath.from_tips(tips, axis, Tool.ball(6), feed_mm_min=1000.0)
    found = optimise_postures(path, hayashi, Constraints.of_degrees(cone=0.1), Options(effort="quick"))
    assert found.energy.total < found.compared["as-programmed"].energy.total
