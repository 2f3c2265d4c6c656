"""What a path breaks at its locations."""

import numpy as np
from support.quick_optimiser import tilt_bounds

import fiveaxis as fx
from fiveaxis.posture.problem import ALLOWED, Problem


def test_a_posture_without_axis_values_breaks_its_bounds(hayashi):
    # A flat bottom touches a level face all around where its axis is the normal: a contact has no tip then.
    contact, normal = np.column_stack([np.arange(3.0), np.zeros((3, 2))]), np.tile([0.0, 0.0, 1.0], (3, 1))
    tool = fx.Tool.bull(10, 2)
    path = fx.Toolpath.from_contacts(contact, normal, tool=tool, feed_mm_min=1e3)
    problem = Problem.build(path, hayashi, tilt_bounds(path, (0.0, 30.0)), max_turn=np.pi)
    leaning, upright = np.tile(np.radians([0.0, 10.0]), (3, 1)), np.zeros((3, 2))
    assert problem.violation(leaning) <= ALLOWED
    some = np.where([[False], [True], [False]], upright, leaning)
    assert np.isnan(problem.positions(slice(None), some)[1]).any()
    assert np.isposinf(problem.excess(some)).tolist() == [False, True, False]
    assert problem.violation(some) == np.inf
