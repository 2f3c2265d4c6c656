"""Paths that pass the end of an axis range and come back."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds

from fiveaxis.base import Array
from fiveaxis.model import Limits, Machine, TiltBounds, Tool, Toolpath, follow, motion_energy, tool_axes
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Optimum
from fiveaxis.posture.turns.rewinding import endless, insert_rewinds
from fiveaxis.posture.turns.unwrapped import paths_without_reversals, rewind_solution


def ranged(machine: Machine, low: float, high: float) -> Machine:
    """The machine with C from one angle to another, deg."""
    limits = Limits(np.radians(low), np.radians(high))
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in machine.axes)
    return replace(machine, axes=axes)


def swinging(swing: float) -> tuple[Toolpath, Array]:
    """A turn and a half round a cylinder, with C swinging to both sides of where it follows the normal."""
    n = 91
    angle = np.radians(91.0 + 6.0 * np.arange(n))
    normal = np.stack([-np.sin(angle), np.cos(angle), np.zeros(n)], axis=1)
    contact = 20.0 * normal + np.outer(np.arange(n) * 0.05, [0.0, 0.0, 1.0])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6), feed_mm_min=600.0)
    c = angle + np.radians(swing) * np.sin(np.arange(n) * np.pi / 3.0)
    return path, np.stack([c, np.full(n, np.radians(-45.0))], axis=1)


def solved(path: Toolpath, machine: Machine, rotary: Array, bounds: TiltBounds) -> Optimum:
    """A solution on the endless machine with a given path."""
    free = endless(machine)
    problem = Problem.build(path, free, bounds)
    motion = follow(path, free, rotary)
    return Optimum(free, path, bounds, motion, motion_energy(free, motion), {}, {}, (), problem)


@pytest.mark.parametrize(("low", "high"), [(0.0, 360.0), (-2.0, 361.0)])
def test_a_path_that_swings_at_the_turn_change_is_held_there_and_rewound_once(hayashi, low, high):
    machine = ranged(hayashi, low, high)
    path, rotary = swinging(12.0)
    first = insert_rewinds(path, machine, rotary)
    assert [r.turns for r in first.rewinds] == [-1, 1, -1]
    solution = rewind_solution(
        solved(path, machine, rotary, tilt_bounds(path, tilt=(15, 85))),
        machine,
        lambda _, start: start,
        lambda _: True,
    )
    assert sum(f.code == "rewind" for f in solution.toolpath.findings) == 1
    assert max(solution.residuals().values()) <= 1e-9
    changed = np.flatnonzero((solution.unwrapped.rotary != rotary).any(axis=1))
    assert 1 <= len(changed) <= 6
    assert np.degrees(np.abs(solution.unwrapped.rotary - rotary).max()) < 24.0


@pytest.mark.parametrize(("cone", "rewinds"), [(2.0, 3), (20.0, 1)])
def test_a_pair_that_the_bounds_require_stays(hayashi, cone, rewinds):
    """In a narrow cone about the swinging axes C can't be held at the end of its range, whatever A does."""
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = swinging(12.0)
    bounds = TiltBounds(tool_axes(machine, rotary), 0.0, np.radians(cone), "programmed axis")
    solution = rewind_solution(
        solved(path, machine, rotary, bounds), machine, lambda _, start: start, lambda _: True
    )
    assert sum(f.code == "rewind" for f in solution.toolpath.findings) == rewinds
    assert max(solution.residuals().values()) <= 1e-9


def tried(machine: Machine, path: Toolpath, rotary: Array) -> list[Array]:
    problem = Problem.build(path, endless(machine), tilt_bounds(path, tilt=(15, 85)))
    return list(paths_without_reversals(problem, machine, rotary, insert_rewinds(path, machine, rotary)))


def test_a_path_that_the_check_refuses_stays_as_it_is(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = swinging(12.0)
    solution = rewind_solution(
        solved(path, machine, rotary, tilt_bounds(path, tilt=(15, 85))),
        machine,
        lambda _, start: start,
        lambda _: False,
    )
    np.testing.assert_array_equal(solution.unwrapped.rotary, rotary)


def test_each_pair_of_opposite_rewinds_is_left_out_the_shortest_first(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = swinging(12.0)
    together, *alone = tried(machine, path, rotary)
    # Both pairs share a rewind, so only one of them can be left out at once.
    np.testing.assert_array_equal(together, alone[0])
    changed = [int((o != rotary).any(axis=1).sum()) for o in alone]
    assert len(changed) == 2
    assert changed == sorted(changed)
    for other in alone:
        assert len(insert_rewinds(path, machine, other).rewinds) == 1


def test_pairs_that_share_no_rewind_are_left_out_at_once(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    one, two = swinging(12.0), swinging(12.0)
    n = len(two[1])
    path = Toolpath.from_contacts(
        np.tile(one[0].contact, (2, 1)), np.tile(one[0].normal, (2, 1)), Tool.ball(6), feed_mm_min=600.0
    )
    # There and back: the same swings are passed again.
    order = np.concatenate([np.arange(n), np.arange(n)[::-1]])
    path, rotary = path.at(order), one[1][order]
    assert [r.turns for r in insert_rewinds(path, machine, rotary).rewinds] == [-1, 1, -1, 1, -1, 1]
    together = tried(machine, path, rotary)[0]
    assert [r.turns for r in insert_rewinds(path, machine, together).rewinds] == [-1, 1]


def test_a_path_that_winds_in_one_direction_has_no_pairs(hayashi):
    machine = ranged(hayashi, 0.0, 360.0)
    path, rotary = swinging(0.0)
    assert len(insert_rewinds(path, machine, rotary).rewinds) == 1
    assert tried(machine, path, rotary) == []
