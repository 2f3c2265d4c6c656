"""Local replanning of locations at which the refinement can't satisfy the bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds

from fiveaxis.machine import load_machine
from fiveaxis.posture.masks.replanning import Replanning
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.strategy.effort import NORMAL
from fiveaxis.posture.strategy.portfolio import BROKEN, MOST_BROKEN, WIDTHS, Portfolio
from fiveaxis.toolpath import Tool, Toolpath


@pytest.fixture(scope="module")
def problem():
    """A ring on the underside of a cone."""
    turn = np.radians(np.linspace(0.0, 150.0, 120))
    contact = np.column_stack([30.0 * np.cos(turn), 30.0 * np.sin(turn), np.zeros_like(turn)])
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full_like(turn, -0.4)])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(8.0))
    bounds = tilt_bounds(path, (15.0, 75.0))
    return Problem.build(path, load_machine("hayashi-640123"), bounds, max_turn=np.radians(15.0))


@pytest.fixture(scope="module")
def sound(problem):
    run = Portfolio(problem, NORMAL)
    path = run.best_path({})
    assert problem.violation(path) <= ALLOWED
    return path


def replanned(problem, path):
    plan = Replanning(problem, Portfolio(problem, NORMAL).lattice, WIDTHS)
    return plan.replanned(path, BROKEN, MOST_BROKEN)


def test_a_sound_path_stays_as_it_is(problem, sound):
    assert replanned(problem, sound) is sound


def test_broken_locations_are_found_with_the_steps_that_break_a_bound(problem, sound):
    assert not problem.broken(sound).any()
    leaning, turning = sound.copy(), sound.copy()
    leaning[40] += np.radians([0.0, 60.0])
    turning[70:] += np.radians([16.0, 0.0])
    assert problem.broken(leaning)[40]
    assert set(np.flatnonzero(problem.broken(turning))) >= {69, 70}


@pytest.mark.parametrize("where", [0, 1, 40, 118, 119])
def test_a_path_that_breaks_bounds_at_one_location_is_replanned_there(problem, sound, where):
    broken = sound.copy()
    broken[where] += np.radians([0.0, 60.0])
    found = replanned(problem, broken)
    assert problem.violation(found) <= ALLOWED
    far = np.abs(np.arange(len(sound)) - where) > 50
    np.testing.assert_array_equal(found[far], sound[far])


def test_a_path_that_is_broken_nearly_everywhere_is_left_alone(problem, sound):
    broken = sound.copy()
    broken[60:] += np.radians([25.0, 0.0])
    assert problem.broken(broken).mean() > 0.4
    assert replanned(problem, broken) is broken


def test_an_endless_axis_that_ends_on_another_turn_goes_on_from_there(problem, sound):
    unwrapped = sound.copy()
    unwrapped[60:] += [2.0 * np.pi, 0.0]
    assert problem.broken(unwrapped).any()
    found = replanned(problem, unwrapped)
    assert problem.violation(found) <= ALLOWED


def test_where_nothing_is_admissible_the_path_comes_back(problem, sound):
    bound = problem.bounds[0]
    reference = bound.reference.copy()
    reference[60] = -reference[60]
    shut = replace(problem, bounds=(replace(bound, reference=reference),))
    broken = shut.broken(sound)
    assert broken[60]
    assert shut.broken(replanned(shut, sound))[60]
