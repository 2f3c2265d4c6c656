"""The baselines that a result is compared with."""

import numpy as np
import pytest
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.base.errors import NoBaseline
from fiveaxis.model import Tool, Toolpath, follow, motion_energy, tool_axes, travel_costs, within_limits
from fiveaxis.posture.baselines.branches import cheapest_sequence, postures
from fiveaxis.posture.baselines.catalogue import (
    along_normal,
    as_programmed,
    feed_directions,
    find_baselines,
    greedy,
    leaned,
    single_posture,
)

UP = np.array([0.0, 0.0, 1.0])


def test_the_normal_baseline_of_the_vase_is_the_printed_one(hayashi, vase):
    rotary = along_normal(vase, hayashi, tilt_bounds(vase, (15, 75)))
    assert motion_energy(hayashi, follow(vase, hayashi, rotary)).travel == pytest.approx(11306, abs=1.0)


def test_every_baseline_keeps_the_tilt_range_and_the_limits(hayashi, vase):
    short = vase.at(np.arange(0, 720))
    bounds = tilt_bounds(short, (15, 75))
    found, missing = find_baselines(short, hayashi, bounds)
    assert set(found) == {"normal", "lead-lean", "greedy"}
    assert "no tool axes" in missing["as-programmed"]
    assert "no single posture" in missing["fixed"]
    for baseline in found.values():
        positions = baseline.motion.positions
        axis = tool_axes(hayashi, positions[:, hayashi.rotary_columns])
        tilt = np.degrees(bounds.angles(axis))
        assert tilt.min() > 15.0 - 1e-6
        assert tilt.max() < 75.0 + 1e-6
        assert (positions <= hayashi.high + 1e-9).all()
        assert (positions >= hayashi.low - 1e-9).all()
    # Leaning straight up is a lead and lean too, but for rounding.
    assert found["lead-lean"].energy.travel < 1.01 * found["normal"].energy.total


def test_greedy_moves_cost_no_more_than_standing_still(hayashi):
    # A straight line on a flat floor: the posture may stay, and nothing but X moves.
    contact = np.stack([np.linspace(0.0, 20.0, 21), np.zeros(21), np.zeros(21)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile(UP, (21, 1)), Tool.ball(6))
    found, _ = find_baselines(path, hayashi, tilt_bounds(path, (10, 60)))
    moved = found["greedy"].energy
    assert moved.total <= 20.0 * 34.55 * 0.06 + 1e-6
    assert found["fixed"].energy.travel <= 20.0 * 34.55 * 0.06 + 1e-6


def test_greedy_doesnt_unwind_where_it_returns_to_a_path_that_is_whole_turns_away(hayashi):
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    normal = np.stack([np.sin(turn), np.cos(turn), np.full(60, 0.2)], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    bounds = tilt_bounds(path, (0, 3))
    anchor = along_normal(path, hayashi, bounds)
    spin = int(np.argmax(np.ptp(anchor, axis=0)))
    away = anchor.copy()
    away[20:, spin] += 2.0 * np.pi
    walked = greedy(path, hayashi, bounds, away)
    assert np.abs(np.diff(walked, axis=0)).max() < np.pi
    np.testing.assert_array_equal(walked, greedy(path, hayashi, bounds, anchor))


def test_a_single_posture_is_found_where_one_exists(hayashi):
    angle = np.linspace(0.0, 2.0 * np.pi, 50)
    normal = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), np.full(50, np.sqrt(0.75))], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    bounds = tilt_bounds(path, (0, 60))
    rotary = single_posture(path, hayashi, bounds)
    assert np.ptp(rotary, axis=0).max() == 0.0
    assert bounds.angles(tool_axes(hayashi, rotary)).max() <= bounds.high
    with pytest.raises(NoBaseline):
        single_posture(path, hayashi, tilt_bounds(path, (0, 10)))


def test_a_programmed_path_is_followed_on_one_branch_without_a_jump(hayashi):
    turn = np.linspace(0.0, 4.0 * np.pi, 200)
    lean = np.radians(40.0)
    axis = np.stack(
        [np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.full(200, np.cos(lean))], axis=1
    )
    path = Toolpath.from_tips(30.0 * axis, axis, Tool.ball(6))
    rotary = as_programmed(path, hayashi, tilt_bounds(path, cone=10))
    np.testing.assert_allclose(tool_axes(hayashi, rotary), axis, atol=1e-9)
    assert np.abs(np.diff(rotary, axis=0)).max() < np.radians(5.0)
    assert np.ptp(rotary[:, 0]) == pytest.approx(4.0 * np.pi)  # two turns, never wrapped


def test_a_programmed_axis_out_of_reach_is_named(hayashi):
    path = Toolpath.from_tips(np.zeros((3, 3)), [UP, UP, -UP], Tool.ball(6))
    with pytest.raises(NoBaseline, match="1 locations have a tool axis outside the axis limits"):
        as_programmed(path, hayashi, tilt_bounds(path, cone=10))


def test_the_branches_are_chosen_for_the_whole_path_not_one_by_one(hayashi, vase):
    """Brute force over the two branches of a few locations, with the shorter turns."""
    import itertools

    short = vase.at(np.arange(0, 3600, 450))
    axis = np.cos(0.6) * short.normal + np.sin(0.6) * UP
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    free = hayashi.with_drives_of(hayashi)
    object.__setattr__(free, "axes", tuple(
        type(a)(a.letter, drive=a.drive) for a in free.axes
    ))  # fmt: skip
    found = postures(free, short, axis)
    rotary = cheapest_sequence(free, found, travel_costs(free, short.feed, short.rapid))
    best = np.inf
    for branches in itertools.product((0, 1), repeat=len(short)):
        angles = found.positions[branches, np.arange(len(short))][:, free.rotary_columns]
        path = np.unwrap(angles, axis=0)
        best = min(best, motion_energy(free, follow(short, free, path)).travel)
    assert motion_energy(free, follow(short, free, rotary)).travel == pytest.approx(best)


def test_lead_leans_towards_the_feed_and_lean_sideways():
    contact = np.stack([np.arange(5.0), np.zeros(5), np.zeros(5)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile(UP, (5, 1)), Tool.ball(2))
    forward = feed_directions(path, path.normal)
    np.testing.assert_allclose(forward, np.tile([1.0, 0.0, 0.0], (5, 1)), atol=1e-12)
    lead = leaned(path.normal, forward, np.radians(20.0), 0.0)
    np.testing.assert_allclose(lead[2], [np.sin(np.radians(20)), 0.0, np.cos(np.radians(20))], atol=1e-12)
    both = leaned(path.normal, forward, np.radians(20.0), np.radians(10.0))
    np.testing.assert_allclose(np.linalg.norm(both, axis=1), 1.0)
    # To the right of the feed.
    assert np.degrees(np.arcsin(both[2, 1])) == pytest.approx(-10.0)


def test_an_inside_corner_keeps_every_location_its_own_posture(hayashi):
    """The ball's centre stands still there while the normal jumps from one wall to the other."""
    normal = np.array([[0.0, 1.0, 0.0]] * 3 + [[-1.0, 0.0, 0.0]] * 3)
    centre = np.array([[-2.0, 0, 9], [-1, 0, 9], [0, 0, 9], [0, 0, 9], [0, 1, 9], [0, 2, 9]])
    path = Toolpath.from_contacts(centre - 3.0 * normal, normal, Tool.ball(6))
    bounds = tilt_bounds(path, (15, 75))
    rotary = along_normal(path, hayashi, bounds)
    tilt = np.degrees(bounds.angles(tool_axes(hayashi, rotary)))
    np.testing.assert_allclose(tilt, 15.0, atol=1e-6)


def test_a_baseline_starts_on_the_turn_that_needs_no_rewind(hayashi):
    from dataclasses import replace

    from fiveaxis.model import Limits

    turn = np.linspace(np.radians(100.0), np.radians(604.0), 150)
    s, c = np.sin(np.radians(40.0)), np.cos(np.radians(40.0))
    axis = np.stack([s * np.cos(turn), s * np.sin(turn), np.full(150, c)], axis=1)
    path = Toolpath.from_tips(30.0 * axis, axis, Tool.ball(6))
    limits = Limits(-2.0 * np.pi, 2.0 * np.pi)
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in hayashi.axes)
    rotary = as_programmed(path, replace(hayashi, axes=axes), tilt_bounds(path, cone=10))
    assert np.abs(np.diff(rotary[:, 0])).max() < np.radians(10.0)
    assert np.abs(rotary[:, 0]).max() <= 2.0 * np.pi + 1e-9


@pytest.mark.parametrize("tool", [Tool.ball(8.0), Tool.bull(16.0, 3.0)], ids=["ball", "bull"])
def test_no_single_posture_is_cheaper_than_the_chosen_one(hayashi, tool):
    """Each posture of the grid is held along the whole path and priced by `fiveaxis.model.energy`."""
    turn = np.linspace(0.0, 2.0 * np.pi, 9)
    contact = np.stack([40.0 * np.cos(turn), 40.0 * np.sin(turn), 3.0 * turn], axis=1)
    path = for_tilt(Toolpath.from_contacts(contact, np.tile(UP, (9, 1)), tool), (10, 70))
    bounds = tilt_bounds(path, (10, 70))
    taken = motion_energy(hayashi, follow(path, hayashi, single_posture(path, hayashi, bounds))).travel
    tried = 0
    grid = np.meshgrid(np.arange(-180.0, 180.0, 15.0), np.arange(-69.0, 70.0, 6.0))
    for posture in np.radians(np.stack(grid, axis=-1)).reshape(-1, 2):
        motion = follow(path, hayashi, np.tile(posture, (9, 1)))
        axis = tool_axes(hayashi, motion.positions[:, hayashi.rotary_columns])
        if bounds.admits(axis).all() and within_limits(hayashi, motion.positions).all():
            tried += 1
            assert motion_energy(hayashi, motion).travel >= taken - 1e-9
    assert tried > 100
