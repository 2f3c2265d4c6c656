"""The relaxed path of the lower bound: near admissible postures, and a good start."""

from dataclasses import replace

import numpy as np
from by_degrees import tilt_bounds
from by_travel import optimise, refined_cost
from rings import ring

from fiveaxis.machine import Limits
from fiveaxis.posture.bound.relaxed import relaxed_path
from fiveaxis.posture.local.refinement import refine
from fiveaxis.posture.problem import ALLOWED, Problem


def test_refined_it_is_about_as_cheap_as_the_best_path_found(hayashi):
    path = ring()
    tilt = tilt_bounds(path, (15, 75))
    problem = Problem.build(path, hayashi, tilt)
    start = relaxed_path(problem, path, tilt)
    found = refine(problem, start, iterations=500, barrier=0.1)
    assert problem.violation(found.rotary) <= ALLOWED
    assert found.cost < 1.15 * refined_cost(optimise(path, hayashi, tilt=(15, 75)))


def test_it_leans_the_tool_within_the_range_but_for_the_width_of_a_box(hayashi):
    path = ring()
    tilt = tilt_bounds(path, (30, 40))
    problem = Problem.build(path, hayashi, tilt)
    start = relaxed_path(problem, path, tilt)
    _, excess = problem.placed(slice(None), start)
    # Corners of boxes are up to a step of 8 deg of each angle away from a posture in them.
    assert excess.max() < np.radians(16.0)


def test_where_a_visit_has_no_posture_there_is_none(hayashi):
    path = ring()
    axes = (replace(a, limits=Limits(0.1, 0.2)) if a.letter == "A" else a for a in hayashi.axes)
    narrow, tilt = replace(hayashi, axes=tuple(axes)), tilt_bounds(path, (70, 75))
    assert relaxed_path(Problem.build(path, narrow, tilt), path, tilt) is None


def test_thorough_tries_it(hayashi):
    found = optimise(ring(24), hayashi, tilt=(15, 75), effort="thorough", bound=False)
    assert "relaxed path" in {*found.optima.costs, *found.optima.failed}
    assert len(found.optima.costs) > 5
