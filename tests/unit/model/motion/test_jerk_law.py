"""The quickest run under limits of jerk: closed forms, printed times, laws of scale, sequential programs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from support.sequential_program import least_time

from fiveaxis.model import Machine, Motion, TimeLaw, law_limiting, load_machine, predicted_time, time_motion
from fiveaxis.nc import DIALECTS

# Finite differences of a profile keep every limit to within this share.
KEPT = 0.002
SAMPLE = 1e-3  # s
TRUNNION = load_machine("linuxcnc-xyzac-trt")
# Ma et al. (2022), Appendix 1 and Table 4: control points of the tool's tip and of a point 15 mm up its axis.
KNOTS = [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 1, 1, 1, 1]
TIP = [[5, 0], [-10, 20], [10, 20], [20, 30], [30, 30], [40, 30], [50, 20], [55, 0]]
TOP = [[0, 0], [-15, 20], [5, 25], [15, 35], [30, 35], [45, 35], [55, 25], [60, 0]]
PRINTED = {"speed": [100.0, 0.4, 0.8], "acceleration": [500.0, 0.5, 0.5], "jerk": [3000.0, 1.5, 1.5]}


def limited(machine: Machine, speed: list, acceleration: list, jerk: list | None) -> Machine:
    """Give axes limits: of X, Y and Z, of A and of C."""
    rows = [[column[0]] * 3 + list(column[1:]) for column in (speed, acceleration, jerk or [None] * 3)]
    axes = zip(machine.axes, *rows, strict=True)
    return replace(
        machine, axes=tuple(replace(a, max_speed=v, max_acceleration=b, max_jerk=j) for a, v, b, j in axes)
    )


def with_jerk(factor: float = 1.0, rise: float = 10.0) -> Machine:
    """State as jerk the accelerations, `rise` times a second."""
    axes = tuple(replace(a, max_jerk=a.max_acceleration * rise * factor) for a in TRUNNION.axes)
    return replace(TRUNNION, axes=axes)


def motion_of(positions: np.ndarray, seconds: float = 1e-4) -> Motion:
    n = len(positions)
    rows = np.zeros((n, 5))
    rows[:, : positions.shape[1]] = positions
    return Motion(
        "XYZAC", rows, np.full(n, 10.0), np.r_[0.0, np.full(n - 1, seconds)], np.zeros(n, int), np.arange(n)
    )


def smooth_path(n: int, seed: int) -> np.ndarray:
    rng, u = np.random.default_rng(seed), np.linspace(0.0, 1.0, n)[:, None, None]
    waves = np.arange(1, 5)[:, None]
    phase, height = rng.uniform(0, 6, (4, 5)), rng.normal(size=(4, 5)) * 20.0 / waves
    return (height * [1, 1, 1, 0.05, 0.05] * np.sin(2 * np.pi * waves * u + phase)).sum(axis=1)


def printed_path(n: int) -> np.ndarray:
    """Rows of the axes of the printed path, whose rotary axes are about the origin."""
    u = np.linspace(0.0, 1.0, n)
    tip, top = (BSpline(KNOTS, np.array(points, dtype=float), 3)(u) for points in (TIP, TOP))
    x, y = tip.T
    i, j = (top - tip).T
    a, c = np.arctan2(np.hypot(i, j), 15.0), np.unwrap(np.arctan2(i, j))
    across, along = np.cos(c) * x - np.sin(c) * y, np.sin(c) * x + np.cos(c) * y
    return np.stack([across, np.cos(a) * along, np.sin(a) * along, a, c], axis=1)


def excess(law: TimeLaw) -> float:
    """By how much finite differences of the sampled profile exceed the worst limit, as a share."""
    positions = law.at(np.arange(0.0, law.total, SAMPLE))[0]
    bounds = law.bounds.speed, law.bounds.acceleration, law.bounds.jerk
    differences = (np.diff(positions, order + 1, axis=0) / SAMPLE ** (order + 1) for order in range(3))
    return max(float((np.abs(d) / bound).max()) for d, bound in zip(differences, bounds, strict=True)) - 1.0


def test_a_straight_move_is_the_closed_form():
    speed, push, jerk = 20.0, 300.0, 3000.0
    law = time_motion(motion_of(np.array([[0.0], [50.0]])), with_jerk())
    # Seven phases: jerk and acceleration up to the speed, cruise, and back.
    ramp = speed / push + push / jerk if speed * jerk > push**2 else 2.0 * math.sqrt(speed / jerk)
    assert law.total == pytest.approx(50.0 / speed + ramp, rel=0.005)
    short = time_motion(motion_of(np.array([[0.0], [0.05]])), with_jerk())
    assert short.total == pytest.approx(4.0 * (0.05 / (2.0 * jerk)) ** (1.0 / 3.0), rel=0.005)


def test_the_printed_path_takes_the_known_times():
    rows = motion_of(printed_path(801))
    law = time_motion(rows, limited(TRUNNION, **PRINTED))
    assert law.total == pytest.approx(8.04, rel=0.01)
    assert excess(law) <= KEPT
    assert time_motion(rows, limited(TRUNNION, **PRINTED | {"jerk": None})).total == pytest.approx(
        7.126, rel=0.005
    )
    assert any(cause.endswith("jerk") for cause in law_limiting(law).by_cause)


@pytest.mark.slow
def test_a_sequential_linear_program_is_hardly_quicker():
    law = time_motion(motion_of(printed_path(801)), limited(TRUNNION, **PRINTED))
    assert law.total <= 1.01 * least_time(law, intervals=200)


@settings(max_examples=5, deadline=None)
@given(st.integers(100, 400), st.integers(0, 1000), st.sampled_from([3.0, 10.0, 30.0]))
def test_limits_hold_between_nodes_and_jerk_takes_time(n, seed, rise):
    motion = motion_of(smooth_path(n, seed))
    law = time_motion(motion, with_jerk(rise=rise), smooth=1.0)
    assert excess(law) <= KEPT
    assert law.total >= 0.99 * time_motion(motion, TRUNNION, smooth=1.0).total


@settings(max_examples=2, deadline=None)
@given(st.integers(400, 800), st.integers(0, 1000))
def test_more_jerk_takes_less_time_and_very_much_is_the_law_without(n, seed):
    motion = motion_of(smooth_path(n, seed))
    times = [time_motion(motion, with_jerk(factor)).total for factor in (0.1, 1.0, 10.0)]
    assert times[0] > times[1] > 0.998 * times[2]
    assert time_motion(motion, with_jerk(100.0)).total == pytest.approx(
        time_motion(motion, TRUNNION).total, rel=0.01
    )


@settings(max_examples=2, deadline=None)
@given(st.integers(20, 200), st.integers(0, 1000))
def test_there_and_back_take_as_long(n, seed):
    rows = smooth_path(n, seed)
    there, back = (time_motion(motion_of(z), with_jerk(), smooth=1.0).total for z in (rows, rows[::-1]))
    assert there == pytest.approx(back, rel=0.01)


def test_times_scale_with_the_limits():
    path = smooth_path(500, 3)
    slow = time_motion(motion_of(path), with_jerk()).total
    twice = tuple(
        replace(
            a,
            max_speed=2.0 * a.max_speed,
            max_acceleration=4.0 * a.max_acceleration,
            max_jerk=8.0 * a.max_jerk,
        )
        for a in with_jerk().axes
    )
    assert time_motion(motion_of(path, 5e-5), replace(TRUNNION, axes=twice)).total == pytest.approx(
        slow / 2, rel=1e-3
    )


@pytest.mark.parametrize("tolerance", [0.02, 0.5])
def test_a_corner_is_passed_within_its_tolerance(tolerance):
    corner = motion_of(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]]))
    law = time_motion(corner, with_jerk(), corners=tolerance)
    path = law.at(np.linspace(0.0, law.total, 20_001))[0][:, :2]
    assert np.linalg.norm(path - [20.0, 0.0], axis=1).min() == pytest.approx(tolerance, rel=1e-3)
    assert excess(law) <= KEPT


def test_passing_a_corner_widely_is_quicker_than_stopping():
    corner = motion_of(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]]))
    assert time_motion(corner, with_jerk(), corners=0.5).total < 0.95 * time_motion(corner, with_jerk()).total


def test_it_rests_at_stops_and_dwells_and_keeps_the_feed():
    square = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [10.0, 10.0], [0.0, 10.0]])
    motion = motion_of(square, 2.0)
    law = time_motion(motion, with_jerk())
    assert law.motion.time[3] == pytest.approx(2.0)
    assert law_limiting(law).by_cause["dwell"] == pytest.approx(2.0)
    ends = np.cumsum(law.motion.time)
    np.testing.assert_allclose(law.at(ends)[0][:, :2], square, atol=1e-6)
    np.testing.assert_allclose(law.at(ends)[1], 0.0, atol=1e-6)
    assert np.abs(law.samples.speed).max() <= 5.0 * (1.0 + KEPT)
    assert law.samples.weight.sum() == pytest.approx(law.total)


def test_samples_integrate_to_the_moves_of_blocks():
    law = time_motion(motion_of(printed_path(101)), limited(TRUNNION, **PRINTED))
    samples, moved = law.samples, np.zeros((101, 5))
    np.add.at(moved, samples.block, samples.speed * samples.weight[:, None])
    ends = law.at(np.cumsum(law.motion.time))[0]
    np.testing.assert_allclose(moved, np.diff(ends, axis=0, prepend=ends[:1]), atol=1e-5)
    # From rest to rest the work of the inertia is none.
    work = (samples.speed * samples.acceleration * samples.weight[:, None]).sum(axis=0)
    np.testing.assert_allclose(work, 0.0, atol=0.05)


def test_limits_hold_from_stop_to_stop_of_several_curves():
    rows = printed_path(301)
    motion = motion_of(np.concatenate([rows, rows[-2::-1], rows[1:]]))
    stops = np.isin(np.arange(901), [300, 600])
    law = time_motion(motion, limited(TRUNNION, **PRINTED), corners=stops)
    assert excess(law) <= KEPT
    one = time_motion(motion_of(rows), limited(TRUNNION, **PRINTED)).total
    assert law.total == pytest.approx(3.0 * one, rel=0.01)
    at_stops = law.at(np.cumsum(law.motion.time)[[300, 600]])
    np.testing.assert_allclose(at_stops[0], motion.positions[[300, 600]], atol=1e-6)
    np.testing.assert_allclose(at_stops[1], 0.0, atol=1e-6)


def test_a_curve_keeps_to_its_rows_and_takes_no_notice_of_their_rounding():
    path = printed_path(2001)
    machine = limited(TRUNNION, **PRINTED)
    scale = np.array([1e3, 1e3, 1e3, *np.degrees([1e3, 1e3])])
    law, rounded = (time_motion(motion_of(z), machine) for z in (path, np.round(path * scale) / scale))
    assert rounded.total == pytest.approx(law.total, rel=0.06)
    rows = rounded.at(np.cumsum(rounded.motion.time))[0]
    assert np.linalg.norm((rows - path) * [1, 1, 1, 10, 10], axis=1).max() < 0.012


def test_blocks_of_a_sinumerik_program_keep_jerk():
    machine = limited(TRUNNION, **PRINTED)
    taken = predicted_time(motion_of(printed_path(401), 0.05), machine, DIALECTS["sinumerik"])
    law = time_motion(motion_of(printed_path(401), 0.05), machine, corners=0.005)
    assert taken.total == pytest.approx(law.total)
    assert excess(law) <= KEPT


@pytest.mark.parametrize("corners", ["exact-stop", 0.005, 0.1])
@pytest.mark.parametrize("size", [0.0005, 0.002, 0.02, 2.0])
def test_turning_back_and_forth_takes_no_longer_than_a_stop_in_every_row(size, corners):
    """A control that would creep around a corner stops there."""
    rows = np.zeros((30, 5))
    rows[:, 0] = size * np.cumsum(np.random.default_rng(3).normal(size=30))
    motion, machine = motion_of(rows, 1e-3), with_jerk(rise=30.0)
    everywhere = time_motion(motion, machine, corners="exact-stop", smooth=0.0)
    without = replace(machine, axes=tuple(replace(axis, max_jerk=None) for axis in machine.axes))
    usual = time_motion(motion, without, corners=corners)
    found = time_motion(motion, machine, corners=corners)
    assert found.total <= max(everywhere.total, 1.3 * usual.total) * (1.0 + 1e-9)
