"""Durations of moves."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import (
    Filling,
    Interpolation,
    MoveKind,
    Tool,
    Toolpath,
    block_times,
    follow,
    least_times,
    load_machine,
    rapid_findings,
    tool_axes,
)


def at_one_point(n: int) -> Toolpath:
    return Toolpath.from_contacts(np.zeros((n, 3)), np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(6))


def test_the_duration_of_a_move_at_its_feed_does_not_depend_on_the_posture(hayashi):
    contact = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 20.0, 0]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0, 1.0], (3, 1)), Tool.ball(6), feed_mm_min=600)
    for rotary in (np.zeros((3, 2)), np.array([[0, 0], [1, -1], [2, 0.3]])):
        np.testing.assert_allclose(follow(path, hayashi, rotary).time, [0.0, 1.0, 2.0])


def test_a_turn_on_the_spot_takes_the_number_as_degrees_per_minute(hayashi):
    motion = follow(at_one_point(2), hayashi, np.radians([[0.0, 0.0], [50.0, 20.0]]))
    assert motion.time[1] == pytest.approx(50.0 / (1000.0 / 60.0))


def test_the_slowest_axis_stretches_the_move(trunnion):
    """The simulated trunnion does 20 mm/s and 30 deg/s."""
    contact = np.array([[0.0, 0, 0], [10.0, 0, 0]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0, 1.0], (2, 1)), Tool.ball(6), feed_mm_min=60_000)
    positions = np.array([[0.0, 0, 0, 0, 0], [10.0, 0, 0, 0, 0]])
    assert block_times(path, trunnion, positions)[1] == pytest.approx(0.5)
    positions[1, 4] = np.radians(60.0)
    assert block_times(path, trunnion, positions)[1] == pytest.approx(2.0)


@pytest.mark.parametrize(("radius", "seconds"), [(6.0, 1.0), (13.0, 1.0), (100.0, 7.7)])
def test_a_feed_of_the_tip_counts_its_course_but_no_less_than_half_of_the_pivots(hayashi, radius, seconds):
    """The tip moves 10 mm, and the ball's centre, `radius` above it, 154 mm at most as the tool tilts."""
    tips, tilt = np.array([[0.0, 0, 0], [10.0, 0, 0]]), np.radians([[0.0, 0.0], [0.0, 90.0]])
    axes = tool_axes(hayashi, tilt)
    path = Toolpath.from_tips(tips, axes, Tool.ball(2.0 * radius), feed_mm_min=600)
    positions = follow(path, hayashi, tilt).positions
    time = block_times(path, hayashi, positions, by_tip=True)[1]
    assert time == pytest.approx(max(1.0, path.lengths[1] / 10.0 / 2.0))
    assert time == pytest.approx(seconds, rel=0.1)


def test_under_tcp_a_filled_path_lasts_as_long_as_its_tip_takes(hayashi):
    tips = np.column_stack([np.linspace(0.0, 40.0, 9), np.full(9, 30.0), np.zeros(9)])
    angles = np.radians(np.column_stack([np.linspace(0.0, 60.0, 9), np.linspace(20.0, 50.0, 9)]))
    path = Toolpath.from_tips(tips, tool_axes(hayashi, angles), Tool.ball(8), feed_mm_min=600)
    motion = follow(path, hayashi, angles)
    assert motion.time.sum() != pytest.approx(4.0, rel=1e-3)
    blocks = Filling(Interpolation.TCP).blocks(path, hayashi, motion)
    assert blocks.time.sum() == pytest.approx(4.0, rel=1e-3)


# Rapid moves


def rapid_path(rows: int, feed_mm_min: float = 600.0) -> Toolpath:
    """A path along X whose moves are rapid."""
    tip = np.column_stack([np.linspace(0.0, 40.0, rows), np.zeros((rows, 2))])
    kind = np.full(rows, MoveKind.RAPID)
    up = np.tile([0.0, 0.0, 1.0], (rows, 1))
    return Toolpath.from_tips(tip, up, Tool.ball(6), feed_mm_min=feed_mm_min, kind=kind)


@pytest.mark.parametrize("name", ["linuxcnc-xyzac-trt", "umc-750", "variaxis-630", "linuxcnc-bridgemill"])
def test_a_rapid_move_takes_as_long_as_its_slowest_axis(name):
    machine = load_machine(name)
    path = rapid_path(30, feed_mm_min=1200.0)
    positions = np.cumsum(np.random.default_rng(5).normal(size=(30, 5)), axis=0)
    # 1200 mm/min replaces the unknown speeds: 20 mm/s and 20 deg/s.
    stated = np.where([a.is_rotary for a in machine.axes], np.radians(20.0), 20.0)
    speeds = [s if a.max_speed is None else a.max_speed for a, s in zip(machine.axes, stated, strict=True)]
    needed = (np.abs(np.diff(positions, axis=0)) / speeds).max(axis=1)
    np.testing.assert_allclose(block_times(path, machine, positions)[1:], needed, rtol=1e-12)


def test_a_rapid_move_with_known_speeds_ignores_the_feed(trunnion):
    rotary = np.radians(np.column_stack([np.linspace(0.0, 90.0, 5), np.linspace(0.0, 30.0, 5)]))
    slow, quick = (follow(rapid_path(5, feed), trunnion, rotary).time for feed in (1.0, 1e6))
    np.testing.assert_array_equal(slow, quick)
    assert not rapid_findings(rapid_path(5), trunnion, follow(rapid_path(5), trunnion, rotary).positions)


def test_the_feed_used_for_unknown_speeds_is_reported_once_per_path(hayashi):
    path = rapid_path(5, feed_mm_min=6000.0)
    positions = follow(path, hayashi, np.zeros((5, 2))).positions
    (found,) = rapid_findings(path, hayashi, positions)
    assert found.code == "rapid-speed-unknown"
    assert "highest speed of X: 5 rapid moves are timed at the path's 6000 mm/min" in found.message
    assert not rapid_findings(replace(path, kind=np.zeros(5, dtype=np.int64)), hayashi, positions)


def test_the_whole_duration_of_a_rapid_move_depends_on_the_posture(trunnion, hayashi):
    path = rapid_path(5, feed_mm_min=600.0)
    np.testing.assert_array_equal(least_times(path, trunnion), np.zeros(5))
    # Unknown speeds: the duration at the path's feed.
    np.testing.assert_allclose(least_times(path, hayashi)[1:], 1.0)
    cuts = replace(path, kind=np.zeros(5, dtype=np.int64))
    np.testing.assert_allclose(least_times(cuts, trunnion)[1:], 1.0)
