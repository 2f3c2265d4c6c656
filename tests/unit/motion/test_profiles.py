"""Moves from rest to rest: closed forms, and the integral of their speed."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.errors import MachineError, SettingError, ToolpathError
from fiveaxis.motion import Motion, block_profiles, move_profiles

FEED = 500.0 / 60.0


def motion_of(positions: object, time: object) -> Motion:
    rows = np.asarray(positions, dtype=float)
    n = len(rows)
    return Motion("XYZAC", rows, np.full(n, 10.0), np.asarray(time, float), np.zeros(n, int), np.arange(n))


def test_a_long_move_is_a_trapezoid():
    """114 mm at 500 mm/min with 0.05 s of acceleration: 2 t_a + (D − 2 D_a)/v."""
    profile = move_profiles(114.0, FEED, ramp=0.05)
    assert profile.time == pytest.approx(2 * 0.05 + (114.0 - FEED * 0.05) / FEED, rel=1e-14)
    assert profile.peak == FEED
    np.testing.assert_allclose(profile.durations, [0.05, 114.0 / FEED - 0.05, 0.05])


def test_a_short_move_is_a_triangle_and_takes_longer_than_the_misprint_says():
    distance, ramp = 0.1, 0.05
    profile = move_profiles(distance, FEED, ramp=ramp)
    acceleration = FEED / ramp
    assert profile.time == pytest.approx(2.0 * np.sqrt(distance / acceleration), rel=1e-14)
    assert profile.cruise == pytest.approx(0.0, abs=1e-15)
    assert profile.peak == pytest.approx(np.sqrt(acceleration * distance))
    misprint = np.sqrt(2.0 * ramp * distance / FEED)
    assert profile.time / misprint == pytest.approx(np.sqrt(2.0))


def test_triangle_and_trapezoid_meet_where_the_ramps_do():
    middle = FEED * 0.05
    below, above = move_profiles([middle * (1 - 1e-12), middle * (1 + 1e-12)], FEED, ramp=0.05).time
    assert below == pytest.approx(above, rel=1e-11)
    assert above == pytest.approx(0.1, rel=1e-11)


def test_acceleration_and_acceleration_time_say_the_same():
    by_time = move_profiles([0.01, 3.0], [5.0, 20.0], ramp=0.1)
    by_rate = move_profiles([0.01, 3.0], [5.0, 20.0], acceleration=[50.0, 200.0])
    np.testing.assert_array_equal(by_time.time, by_rate.time)


@pytest.mark.parametrize("acceleration", [7.0, 300.0, np.inf])
def test_the_integral_of_the_speed_is_the_way(acceleration):
    distance = np.array([0.0, 0.3, 5.0, 80.0])
    profile = move_profiles(distance, 12.0, acceleration=acceleration)
    times = np.linspace(0.0, 1.0, 20_001)[:, None] * profile.time
    way, speed = profile.at(times)
    np.testing.assert_allclose(way[-1], distance, rtol=1e-12)
    np.testing.assert_allclose(np.trapezoid(speed, times, axis=0), distance, rtol=1e-4)
    slopes = np.diff(way, axis=0)[1:-1] - (speed[2:-1] + speed[1:-2]) / 2.0 * np.diff(times, axis=0)[1:-1]
    assert np.abs(slopes).max() < 1e-4
    assert (speed <= 12.0).all()


def test_the_phases_are_the_speed_profile():
    profile = move_profiles([0.3, 80.0], 12.0, acceleration=30.0)
    starts = np.cumsum(profile.durations, axis=1) - profile.durations
    _, speeds = profile.at(starts.T + 1e-12)
    np.testing.assert_allclose(speeds.T, profile.start_speeds, atol=1e-9)
    ends = profile.start_speeds + profile.accelerations * profile.durations
    np.testing.assert_allclose(ends, np.stack([profile.peak, profile.peak, [0.0, 0.0]], axis=1), atol=1e-12)


def test_before_and_after_the_move_rests():
    way, speed = move_profiles(10.0, 5.0, acceleration=3.0).at([-1.0, 99.0])
    np.testing.assert_allclose(way, [0.0, 10.0])
    np.testing.assert_allclose(speed, [0.0, 0.0], atol=1e-15)


def test_the_weakest_axis_for_its_share_bounds_a_block(trunnion):
    """X and Y do 20 mm/s and 300 mm/s², C 30 deg/s and 300 deg/s²."""
    quarter = np.radians(90.0)
    motion = motion_of([[0.0] * 5, [30.0, 40.0, 0, 0, 0], [30.0, 40.0, 0, 0, quarter]], [0.0, 1.0, 1.0])
    profile = block_profiles(motion, trunnion)
    # Y at 20 mm/s for 40 mm, and the same share of 300 mm/s²; C turns 90 deg at 30 deg/s.
    np.testing.assert_allclose(profile.peak, [0.0, 20.0 / 40.0, 30.0 / 90.0])
    np.testing.assert_allclose(profile.acceleration[1:], [300.0 / 40.0, 300.0 / 90.0])
    np.testing.assert_allclose(profile.time, [0.0, 2.0 + 20.0 / 300.0, 3.0 + 30.0 / 300.0])


def test_a_block_keeps_its_feed(trunnion):
    motion = motion_of([[0.0] * 5, [10.0, 0, 0, 0, 0]], [0.0, 4.0])
    assert block_profiles(motion, trunnion).time[1] == pytest.approx(4.0 + 2.5 / 300.0)


def test_axes_without_limits_set_no_bound(hayashi):
    """The paper's machine states neither speeds nor accelerations."""
    moves = replace(motion_of([[0.0] * 5, [10.0, 0, 0, 0, 0]], [0.0, 4.0]), letters=hayashi.letters)
    assert block_profiles(moves, hayashi).time[1] == 4.0


@pytest.mark.parametrize(
    ("distance", "speed", "given", "said"),
    [
        (-1.0, 1.0, {"ramp": 1.0}, "distance"),
        (np.nan, 1.0, {"ramp": 1.0}, "distance"),
        (1.0, 0.0, {"ramp": 1.0}, "speed"),
        (1.0, np.inf, {"ramp": 1.0}, "speed"),
        (1.0, 1.0, {"acceleration": 0.0}, "acceleration"),
        (1.0, 1.0, {"ramp": -0.1}, "ramp"),
        (1.0, 1.0, {}, "either"),
        (1.0, 1.0, {"ramp": 1.0, "acceleration": 1.0}, "either"),
    ],
)
def test_impossible_moves_are_refused(distance, speed, given, said):
    with pytest.raises(SettingError, match=said):
        move_profiles(distance, speed, **given)


def test_faulty_motions_and_machines_are_named(trunnion):
    good = motion_of([[0.0] * 5, [10.0, 0, 0, 0, 0]], [0.0, 4.0])
    with pytest.raises(ToolpathError, match=r"location 1 .*finite"):
        block_profiles(replace(good, positions=good.positions * [[1.0], [np.nan]]), trunnion)
    with pytest.raises(ToolpathError, match=r"location 1 .*time"):
        block_profiles(replace(good, time=np.array([0.0, np.nan])), trunnion)
    with pytest.raises(ToolpathError, match="0 s at its feed"):
        block_profiles(replace(good, time=np.zeros(2)), trunnion)
    with pytest.raises(MachineError, match="XYZAC"):
        block_profiles(replace(good, letters="XYZBC"), trunnion)
    lame = replace(trunnion, axes=tuple(replace(a, max_acceleration=0.0) for a in trunnion.axes))
    with pytest.raises(MachineError, match="max_acceleration of X is 0 mm/s²"):
        block_profiles(good, lame)
