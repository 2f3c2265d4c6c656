"""Refinement within a mask: never outside it, never costlier."""

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.model import Tool, Toolpath, axis_positions, load_machine, tool_axes
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.near import PINCH, Confinement, Planes, blended, pinched, windows_around

MACHINE = load_machine("hayashi-640123")


def problem_of(n: int = 120) -> Problem:
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    normal = np.stack([0.8 * np.cos(angle), 0.8 * np.sin(angle), np.full(n, -0.6)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), np.full(n, 10.0)], axis=1)
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6))
    return Problem.build(path, MACHINE, tilt_bounds(path, (15, 75)), max_turn=0.3)


def solve(problem, start, held):
    return refine(problem, start, iterations=120, barrier=4e-2, held=held, near=True).rotary


def steady(problem: Problem) -> np.ndarray:
    """A clean start: the tool at 45 deg to the normal, sideways."""
    normal = problem.normal
    side = np.cross(normal, [0.0, 0.0, 1.0])
    axis = (normal + side / np.linalg.norm(side, axis=1, keepdims=True)) / np.sqrt(2.0)
    branches = axis_positions(MACHINE, np.zeros((len(axis), 3)), axis)[..., MACHINE.rotary_columns]
    paths = [np.unwrap(branch, axis=0) for branch in branches]
    return min(paths, key=problem.violation)


def run(problem, function, start):
    clear = Mask(function)
    return Confinement(problem, clear, solve, Planes.none(len(start))).refined(start)


def test_planes_keep_a_refined_path_within_a_mask_and_cheaper():
    problem = problem_of()
    start = steady(problem)
    assert problem.violation(start) <= 1e-9
    normal = problem.normal

    def mask(rows, rotary):
        return np.sum(tool_axes(MACHINE, rotary) * normal[rows], axis=1) > np.cos(np.radians(50.0))

    every = np.arange(len(problem))
    free = solve(problem, start, (False, False))
    assert not mask(every, free).all()
    found = run(problem, mask, start)
    assert mask(every, found).all()
    assert problem.violation(found) <= 1e-9
    costs = [problem.priced(path) for path in (free, found, start)]
    assert costs[0] < costs[1] < 0.9 * costs[2]


def test_planes_that_are_known_confine_a_path_at_once_and_those_it_is_outside_of_are_left_out():
    problem, solved = problem_of(), []
    every = np.arange(len(problem))

    def mask(rows, rotary):
        return np.sum(tool_axes(MACHINE, rotary) * problem.normal[rows], axis=1) > np.cos(np.radians(50.0))

    def counted(*given):
        solved.append(given)
        return solve(*given)

    first = Confinement(problem, Mask(mask), counted, Planes.none(len(problem)))
    found = first.refined(steady(problem))
    before, axis = len(solved), tool_axes(MACHINE, found)
    known = Planes.around(axis, first.planes.columns)
    again = Confinement(problem, Mask(mask), counted, known).refined(found)
    assert len(solved) == before + 1 < 2 * before
    assert mask(every, again).all()
    assert problem.priced(again) <= problem.priced(found)
    assert np.isfinite(first.planes.columns).any()
    assert not np.isfinite(Planes.around(-axis, first.planes.columns).inwards).any()
    assert not Planes.around(axis[1:], first.planes.columns).count.any()


def test_a_mask_that_admits_only_the_start_leaves_it():
    problem = problem_of(40)
    start = steady(problem)

    def mask(rows, rotary):
        return np.abs(rotary - start[rows]).max(axis=1) < 1e-9

    np.testing.assert_allclose(run(problem, mask, start), start, atol=1e-9)


def test_a_location_that_is_refused_at_the_start_has_no_planes():
    problem = problem_of(40)
    start = steady(problem)
    found = run(problem, lambda rows, _: rows != 7, start)
    free = solve(problem, start, (False, False))
    np.testing.assert_array_equal(found, free)


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, 0.0, -0.8]])
def test_three_planes_close_round_an_axis_admit_it_and_nothing_far(axis):
    axis = np.array([axis])
    inwards = pinched(axis, np.array([PINCH]))[0]
    np.testing.assert_allclose(inwards @ axis[0], np.sin(PINCH))
    rng = np.random.default_rng(0)
    other = axis[0] + rng.normal(0.0, 0.02, (500, 3))
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    inside = (other @ inwards.T >= 0.0).all(axis=1)
    angle = np.arccos(np.clip(other @ axis[0], -1.0, 1.0))
    assert not inside[angle > 2.01 * PINCH].any()
    assert inside[angle < PINCH].all()


def test_planes_bound_the_part_that_they_belong_to():
    problem, planes = problem_of(30), Planes.none(30)
    planes.add(np.array([4]), np.array([[1.0, 0.0, 0.0]]))
    planes.add(np.array([4, 9]), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    part = planes.bounding(problem, 3, 8)
    assert len(part.bounds) == len(problem.bounds) + 2
    first, second = (bound.reference for bound in part.bounds[-2:])
    assert np.isfinite(first).all(axis=1).tolist() == [False, True, False, False, False, False]
    np.testing.assert_array_equal(second[1], [0.0, 1.0, 0.0])
    assert len(planes.bounding(problem, 10, 20).bounds) == len(problem.bounds)


def test_windows_have_a_margin_and_merge_if_they_overlap():
    assert windows_around(np.array([5, 9]), 30, 2) == [(3, 11)]
    assert windows_around(np.array([0, 29]), 30, 3) == [(0, 3), (26, 29)]
    assert windows_around(np.array([5, 12]), 30, 2) == [(3, 7), (10, 14)]


def test_a_blend_is_the_other_path_at_the_given_locations_and_the_path_far_away():
    path, other = np.zeros((200, 2)), np.ones((200, 2))
    mixed = blended(path, other, np.array([100]))
    assert mixed[100].tolist() == [1.0, 1.0]
    assert not mixed[:50].any()
    assert not mixed[150:].any()
    assert np.abs(np.diff(mixed[:, 0])).max() < 0.03
