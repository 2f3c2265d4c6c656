"""Near the singular direction: held axes, bounds and findings."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds
from support.travel_optimiser import optimise

from fiveaxis.model import Tool, Toolpath, follow
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.singular import (
    Cone,
    bounded_within,
    nearest_angles,
    slow_findings,
    turning_within,
)

CONE = Cone(np.radians(5.0))


def over_the_top(n: int = 41, aside: float = 1.0, radius: float = 50.0) -> Toolpath:
    """A line over a dome that passes its top by a little."""
    y = np.linspace(-15.0, 15.0, n)
    points = np.stack([np.full(n, aside), y, np.sqrt(radius**2 - aside**2 - y**2)], axis=1)
    normal = points / radius
    path = Toolpath.from_contacts(points, normal, Tool.ball(6), feed_mm_min=600.0)
    return replace(path, axis=normal)


def along_the_normal(path: Toolpath) -> np.ndarray:
    """Angles of C and A with the tool along the normal, C turning half round next to the top."""
    n = path.normal
    return np.stack([np.arctan2(n[:, 1], n[:, 0]) - np.pi / 2.0, -np.arccos(n[:, 2])], axis=1)


def test_a_move_across_the_cone_counts_though_both_its_ends_are_outside(hayashi):
    rotary = np.radians([[0.0, -8.0], [0.0, 8.0], [0.0, 20.0]])
    np.testing.assert_allclose(nearest_angles(hayashi, rotary), np.radians([0.0, 8.0]), atol=1e-9)


def test_only_the_first_axis_of_cuts_within_the_cone_is_bounded(hayashi):
    path = over_the_top()
    rotary = along_the_normal(path)
    problem = Problem.build(path, hayashi, tilt_bounds(path, cone=10), max_turn=np.radians(15.0))
    for rate in (0.0, np.radians(0.5)):
        found = bounded_within(problem, path, rotary, replace(CONE, rate=rate))
        inside = nearest_angles(hayashi, rotary) < CONE.angle
        assert 0 < inside.sum() < len(inside)
        np.testing.assert_allclose(found.max_turn[inside, 0], rate * path.lengths[1:][inside])
        np.testing.assert_array_equal(found.max_turn[~inside], problem.max_turn[~inside])
        np.testing.assert_array_equal(found.max_turn[:, 1], problem.max_turn[:, 1])


def test_links_turn_as_they_like(hayashi):
    path = over_the_top()
    rotary = along_the_normal(path)
    assert turning_within(path, hayashi, rotary, CONE).any()
    links = path.with_links(np.ones(len(path), dtype=bool))
    assert not turning_within(links, hayashi, rotary, CONE).any()


def round_the_top(n: int = 60, radius: float = 50.0) -> Toolpath:
    """Half a ring round a dome's top, the normals 8 deg from it."""
    angle, lean = np.linspace(0.0, np.pi, n), np.radians(8.0)
    flat = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    normal = np.column_stack([np.sin(lean) * flat, np.full(n, np.cos(lean))])
    path = Toolpath.from_contacts(radius * normal, normal, Tool.ball(6), feed_mm_min=600.0)
    return replace(path, axis=normal)


def test_the_optimiser_keeps_c_still_in_the_cone_only_if_there_is_one(hayashi):
    path = round_the_top()
    columns = hayashi.rotary_columns
    wide = Cone(np.radians(9.0))
    free = optimise(path, hayashi, cone=5)
    rotary = free.motion.positions[:, columns]
    assert turning_within(path, hayashi, rotary, wide).any()
    bound = optimise(path, hayashi, cone=5, singular_cone=9)
    rotary = bound.motion.positions[:, columns]
    assert not turning_within(path, hayashi, rotary, wide).any()
    assert bound.residuals()["tilt"] <= 1e-9
    assert bound.energy.travel >= free.energy.travel * (1.0 - 1e-9)
    assert "singular-turn" not in {f.code for f in bound.toolpath.findings}


def speed_of_c(machine, degrees):
    axes = tuple(replace(a, max_speed=np.radians(degrees)) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


def test_a_crossing_that_c_cannot_follow_is_reported_with_its_factor(hayashi):
    path = over_the_top()
    machine = speed_of_c(hayashi, 30.0)
    motion = follow(path, machine, along_the_normal(path))
    [finding] = slow_findings(path, machine, motion)
    assert finding.code == "singular-crossing"
    turn = np.degrees(np.abs(motion.moves[:, machine.column("C")]))
    factor = turn / 30.0 / (path.lengths / 10.0 + 1e-30)
    assert finding.value == pytest.approx(factor[1:].max(), rel=1e-9)
    assert finding.place.location == 1 + int(np.argmax(factor[1:]))
    assert "C can't keep the feed" in finding.message
    # The motion itself takes the time that the axis needs.
    assert motion.time[1:].sum() > path.lengths.sum() / 10.0


def test_a_turn_far_from_the_singular_direction_has_another_code(hayashi):
    path = over_the_top(aside=25.0)
    machine = speed_of_c(hayashi, 1.0)
    found = slow_findings(path, machine, follow(path, machine, along_the_normal(path)))
    assert {f.code for f in found} == {"rotary-slows"}


def test_an_axis_that_is_quick_enough_or_has_no_known_speed_is_not_named(hayashi):
    path = over_the_top()
    for machine in (hayashi, speed_of_c(hayashi, 1e4)):
        assert slow_findings(path, machine, follow(path, machine, along_the_normal(path))) == []
