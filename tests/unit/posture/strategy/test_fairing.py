"""Fairing: third differences shrink, no posture moves too far, and none leaves the bounds on its lean."""

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import angle_between
from fiveaxis.model import Tool, Toolpath, rotary_angles, tool_axes
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.fairing import faired, within_turns

TILT = (10.0, 20.0)


@pytest.fixture
def rough(hayashi):
    """A path with the tool leaning by 15 deg, shaken by hundredths of a degree."""
    turn = np.linspace(0.0, 1.5, 200)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(len(turn), 0.6)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    contact = np.column_stack([30.0 * np.cos(turn), 30.0 * np.sin(turn), 5.0 * turn])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6.0))
    up = np.array([0.0, 0.0, 1.0]) - normal[:, 2:] * normal
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    lean = np.radians(15.0)
    smooth = rotary_angles(hayashi, np.cos(lean) * normal + np.sin(lean) * up)[0]
    smooth = np.unwrap(smooth, axis=0)
    shaken = smooth + np.radians(0.02) * np.random.default_rng(0).uniform(-1.0, 1.0, smooth.shape)
    problem = Problem.build(path, hayashi, tilt_bounds(path, tilt=TILT), max_turn=np.radians(30.0))
    return problem, smooth, shaken


@pytest.mark.parametrize("farthest", [0.02, 0.05])
def test_a_shaken_path_is_as_smooth_as_it_was(rough, farthest):
    problem, smooth, shaken = rough
    found = faired(problem, shaken, np.radians(farthest))
    assert np.abs(found - shaken).max() <= np.radians(farthest) * (1.0 + 1e-6)
    third = [np.abs(np.diff(path, n=3, axis=0)).max() for path in (smooth, found, shaken)]
    assert third[1] < 0.2 * third[2]
    assert np.abs(found - smooth)[5:-5].max() < np.abs(shaken - smooth).max()


def test_what_would_lean_too_far_is_put_back(rough):
    problem, _, shaken = rough
    # As if the path leant at the end of its range: every posture is to lean by at most 15 deg.
    bound = problem.bounds[0]
    narrow = type(bound)(bound.reference, bound.low, np.radians(15.0), bound.name)
    problem = type(problem)(**{**vars(problem), "bounds": (narrow, *problem.bounds[1:])})
    found = faired(problem, shaken, np.radians(0.05))
    lean = angle_between(tool_axes(problem.machine, found), narrow.reference)
    assert lean.max() <= np.radians(15.0)


def test_smoother_postures_are_taken_but_where_moves_would_turn_too_far(rough):
    problem, _, shaken = rough
    # As if one move, in the middle, might turn no farther than it does.
    most = np.array(np.broadcast_to(problem.max_turn, (len(shaken) - 1, 2)))
    most[99] = np.abs(np.diff(shaken, axis=0))[99]
    problem = type(problem)(**{**vars(problem), "max_turn": most})
    turned = shaken + np.linspace(0.0, 0.1, 200)[:, None] * [0.0, np.sign(np.diff(shaken, axis=0)[99, 1])]
    assert problem.turn_excess(turned).max() > 0.0
    found = within_turns(problem, shaken, turned)
    assert problem.turn_excess(found).max() == 0.0
    np.testing.assert_array_equal(found[99:101], shaken[99:101])
    np.testing.assert_array_equal(found[:80], turned[:80])
    np.testing.assert_array_equal(within_turns(problem, shaken, shaken), shaken)


def test_a_path_of_three_locations_stays(rough):
    problem, _, shaken = rough
    np.testing.assert_array_equal(faired(problem, shaken[:3], 0.1), shaken[:3])
