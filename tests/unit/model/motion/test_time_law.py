"""The fastest timing under the axes' limits: against closed forms, laws of scale, brute force, and toppra."""

import warnings
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.trapezoid_times import rest_times

from fiveaxis.base.errors import MachineError, SettingError, ToolpathError
from fiveaxis.model import (
    Machine,
    Motion,
    TimeLaw,
    Tool,
    Toolpath,
    block_times,
    follow,
    load_machine,
    time_motion,
)
from fiveaxis.model.motion.limiting import law_limiting

# Bounds hold all along the path but for rounding in the shortest phases; measured 6e-11.
ROUNDING = 1e-6
TRUNNION = load_machine("linuxcnc-xyzac-trt")
SPEED = np.array([20.0, 20.0, 20.0, *np.radians([30.0, 30.0])])
ACCELERATION = np.array([300.0, 300.0, 300.0, *np.radians([300.0, 300.0])])


def motion_of(positions: object, times: object = 1e-4) -> Motion:
    """Make a motion; a feed of 0.1 ms a block is no bound."""
    rows = np.zeros((len(np.asarray(positions)), 5))
    given_rows = np.asarray(positions, dtype=float)
    rows[:, : given_rows.shape[1]] = given_rows
    n = len(rows)
    spent = np.broadcast_to(np.asarray(times, dtype=float), n).copy()
    spent[0] = 0.0
    return Motion("XYZAC", rows, np.full(n, 10.0), spent, np.zeros(n, int), np.arange(n))


def with_limits(machine: Machine, speed: float = 1.0, acceleration: float = 1.0) -> Machine:
    axes = tuple(
        replace(a, max_speed=a.max_speed * speed, max_acceleration=a.max_acceleration * acceleration)
        for a in machine.axes
    )
    return replace(machine, axes=axes)


def smooth_path(n: int, seed: int, size: float = 20.0) -> np.ndarray:
    rng, u = np.random.default_rng(seed), np.linspace(0.0, 1.0, n)[:, None, None]
    waves = np.arange(1, 5)[:, None]
    phase, height = rng.uniform(0, 6, (4, 5)), rng.normal(size=(4, 5)) * size / waves
    return (height * [1, 1, 1, 0.05, 0.05] * np.sin(2 * np.pi * waves * u + phase)).sum(axis=1)


def overrun(law: TimeLaw, speed: np.ndarray = SPEED, acceleration: np.ndarray = ACCELERATION) -> float:
    """By how much the worst of dense samples is over its bound, as a share of the bound."""
    # Within 10 ns a time's last digits decide which side of a phase's end it is on.
    start, duration = (
        column[law.phases.duration > 1e-8] for column in (law.phases.start, law.phases.duration)
    )
    inside = (start[:, None] + duration[:, None] * np.linspace(1e-4, 1 - 1e-4, 9)).ravel()
    _, rate, path_acceleration = law.at(inside)
    return float(max((np.abs(rate) / speed).max(), (np.abs(path_acceleration) / acceleration).max()) - 1.0)


# --- closed forms


def test_one_straight_block_is_the_closed_form():
    for distance, time in ((10.0, 1.0), (10.0, 1e-4), (0.01, 1e-4)):
        motion = motion_of([[0.0], [distance]], time)
        law = time_motion(motion, TRUNNION)
        assert law.total == pytest.approx(rest_times(motion, TRUNNION)[1], rel=1e-12)


def test_a_chain_of_short_blocks_in_line_is_one_long_block():
    whole = motion_of([[0.0, 0.0, 0.0, 0.0], [30.0, 40.0, 0.0, 0.7]], 2.5)
    chain = motion_of(np.linspace(whole.positions[0], whole.positions[1], 1001), 2.5 / 1000)
    assert time_motion(chain, TRUNNION).total == pytest.approx(time_motion(whole, TRUNNION).total, rel=1e-9)


def test_an_exact_stop_at_every_corner_is_a_sum_of_blocks():
    square = motion_of([[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]], 1.0)
    law = time_motion(square, TRUNNION)
    np.testing.assert_allclose(law.motion.time, rest_times(square, TRUNNION), rtol=1e-12)
    np.testing.assert_allclose(law.rates, 0.0, atol=1e-5)


def test_stops_that_are_given_row_by_row_are_the_only_ones():
    """Corner or not: a stop in the middle of a straight line counts, a corner without one doesn't."""
    line = motion_of(np.linspace([0.0, 0.0], [30.0, 40.0], 11), 0.25)
    everywhere = time_motion(line, TRUNNION, corners=np.ones(11, dtype=bool))
    np.testing.assert_allclose(everywhere.motion.time, rest_times(line, TRUNNION), rtol=1e-9)
    assert time_motion(line, TRUNNION, corners=np.zeros(11, dtype=bool)).total == pytest.approx(
        time_motion(line, TRUNNION).total, rel=1e-9
    )
    square = motion_of([[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]], 1.0)
    middle = time_motion(square, TRUNNION, corners=np.arange(5) == 2)
    np.testing.assert_allclose(middle.rates[2], 0.0, atol=1e-5)
    assert np.abs(middle.rates[1]).max() > 1.0
    assert middle.total < time_motion(square, TRUNNION).total


def test_stops_of_another_number_of_rows_are_refused():
    with pytest.raises(SettingError, match=r"one bool for each of 2 rows"):
        time_motion(motion_of([[0.0], [1.0]]), TRUNNION, corners=np.ones(3, dtype=bool))


def test_a_corner_within_tolerance_is_passed_at_the_formulas_speed():
    """u̇² = 2 ε A / sin²(δ/2) at a right angle; along X + Y both axes' 300 mm/s² give A = √2 · 300."""
    tolerance = 0.01
    corner = motion_of([[0, 0], [50, 0], [50, 50]])
    law = time_motion(with_speed(corner, 1000.0), with_limits(TRUNNION, 100.0), corners=tolerance)
    path_speed = np.sqrt(2 * tolerance * np.sqrt(2.0) * 300.0 / np.sin(np.pi / 4) ** 2)
    # Halfway through the parabola the axes share the path_speed; the whole is never quicker there.
    assert np.abs(law.rates[1]).max() == pytest.approx(path_speed / 2.0, rel=0.05)
    dense, _, _ = law.at(np.linspace(0.0, law.total, 100_001))
    assert np.linalg.norm(dense[:, :2] - [50, 0], axis=1).min() == pytest.approx(tolerance, rel=0.01)


def with_speed(motion: Motion, feed: float) -> Motion:
    return replace(motion, time=np.linalg.norm(motion.moves, axis=1) / feed)


def test_a_circle_sampled_densely_runs_at_its_feed():
    turn = np.linspace(0.0, 2 * np.pi, 721)
    circle = with_speed(motion_of(20.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)), 15.0)
    law = time_motion(circle, TRUNNION)
    assert law.total == pytest.approx(2 * np.pi * 20.0 / 15.0 + 15.0 / 300.0, rel=1e-4)
    assert law_limiting(law).by_cause["feed"] > 0.98 * law.total


def test_a_small_circle_runs_at_the_speed_of_its_centripetal_acceleration():
    turn = np.linspace(0.0, 20 * np.pi, 7201)
    circle = with_speed(motion_of(0.1 * np.stack([np.cos(turn), np.sin(turn)], axis=1)), 15.0)
    path_speed = np.linalg.norm(time_motion(circle, TRUNNION).rates[2000:5000, :2], axis=1)
    # v² / r is at most 300 mm/s² where an axis takes it alone, and √2 times that where two share it.
    assert path_speed.min() > 0.98 * np.sqrt(300.0 * 0.1)
    assert path_speed.max() < 1.01 * np.sqrt(np.sqrt(2.0) * 300.0 * 0.1)


# --- laws


@settings(max_examples=25)
@given(
    st.integers(0, 10_000),
    st.integers(3, 60),
    st.sampled_from(["exact-stop", 0.002, 0.05, 5.0]),
    st.booleans(),
)
def test_bounds_hold_all_along_random_polygons(seed, n, corners, fast):
    rng = np.random.default_rng(seed)
    motion = motion_of(
        np.cumsum(rng.normal(size=(n, 5)) * [2, 2, 2, 0.2, 0.2] * rng.uniform(0, 1, (n, 1)), axis=0)
    )
    motion = motion if fast else with_speed(motion, 8.0)
    law = time_motion(motion, TRUNNION, corners=corners)
    assert overrun(law) < ROUNDING
    path_speed = law.phases.end_path_speed / law.feed_speed[law.phases.block]
    assert path_speed.max() < 1.0 + ROUNDING


@pytest.mark.parametrize("seed", range(6))
def test_bounds_hold_where_axes_start_to_move_in_a_corner(seed):
    """One axis at a time: at each parabola's start an axis has no speed but already accelerates."""
    rng = np.random.default_rng(seed)
    steps = np.zeros((40, 5))
    steps[np.arange(40), rng.integers(0, 5, 40)] = rng.choice([-1.0, 1.0], 40) * rng.uniform(0.02, 3.0, 40)
    law = time_motion(motion_of(np.cumsum(steps * [1, 1, 1, 0.1, 0.1], axis=0)), TRUNNION, corners=1.0)
    assert overrun(law) < ROUNDING


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.integers(30, 400), st.sampled_from([1.0, 10.0]))
def test_bounds_hold_all_along_random_curves(seed, n, more_speed):
    machine = with_limits(TRUNNION, more_speed)
    law = time_motion(motion_of(smooth_path(n, seed)), machine, smooth=10.0)
    assert overrun(law, SPEED * more_speed) < ROUNDING


@pytest.mark.parametrize("corners", ["exact-stop", 0.01, 0.5])
def test_speed_is_the_derivative_of_position_and_acceleration_that_of_speed(corners):
    law = time_motion(motion_of(smooth_path(40, 3)), TRUNNION, corners=corners)
    times = np.linspace(0.0, law.total, 400_001)
    position, speed, acceleration = law.at(times)
    step = times[1]
    assert (
        np.abs(np.diff(position, axis=0) / step - (speed[1:] + speed[:-1]) / 2).max() < ACCELERATION[0] * step
    )
    average = (acceleration[1:] + acceleration[:-1]) / 2
    wrong = np.abs(np.diff(speed, axis=0) / step - average) > 1e-3 * ACCELERATION[0]
    assert wrong.any(axis=1).sum() <= len(law.phases)  # only where a phase ends between two samples
    np.testing.assert_allclose(position[[0, -1]], law.motion.positions[[0, -1]], atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("corners", ["exact-stop", 0.05])
def test_lower_limits_never_shorten_the_time(seed, corners):
    motion = motion_of(smooth_path(60, seed))
    times = [
        time_motion(motion, with_limits(TRUNNION, speed, acceleration), corners=corners).total
        for speed, acceleration in ((1.0, 1.0), (0.9, 1.0), (0.9, 0.7), (0.5, 0.7), (0.5, 0.1))
    ]
    assert (np.diff(times) > -1e-4 * times[0]).all()  # nodes move with the limits


@pytest.mark.parametrize("factor", [0.3, 4.0])
def test_speeds_times_c_and_accelerations_times_c_squared_divide_the_time_by_c(factor):
    motion = with_speed(motion_of(smooth_path(80, 5)), 15.0)
    quick = replace(motion, time=motion.time / factor)
    for corners in ("exact-stop", 0.05):
        slow = time_motion(motion, TRUNNION, corners=corners)
        scaled = time_motion(quick, with_limits(TRUNNION, factor, factor**2), corners=corners)
        np.testing.assert_allclose(scaled.motion.time * factor, slow.motion.time, rtol=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from(["exact-stop", 0.05]), st.floats(0.05, 0.95))
def test_splitting_a_block_in_line_changes_nothing(seed, corners, share):
    rng = np.random.default_rng(seed)
    motion = with_speed(motion_of(np.cumsum(rng.normal(size=(8, 5)) * [3, 3, 3, 0.3, 0.3], axis=0)), 10.0)
    row = int(rng.integers(1, 8))
    between = motion.positions[row - 1] + share * motion.moves[row]
    split = motion_of(
        np.insert(motion.positions, row, between, axis=0),
        np.insert(motion.time, row, share * motion.time[row]) * 1.0,
    )
    split.time[row + 1] *= 1.0 - share
    whole, parts = (time_motion(m, TRUNNION, corners=corners) for m in (motion, split))
    joined = np.delete(parts.motion.time, row)
    joined[row] += parts.motion.time[row]
    # A further node inside a parabola lets the speed change there: a hair quicker.
    np.testing.assert_allclose(joined, whole.motion.time, rtol=5e-3, atol=1e-3)
    if corners == "exact-stop":
        np.testing.assert_allclose(joined, whole.motion.time, rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("corners", ["exact-stop", 0.05, 5.0])
def test_a_path_takes_as_long_backwards(seed, corners):
    motion = with_speed(motion_of(smooth_path(60, seed)), 18.0)
    back = motion_of(motion.positions[::-1], np.roll(motion.time[::-1], 1))
    there, again = (time_motion(m, TRUNNION, corners=corners) for m in (motion, back))
    assert again.total == pytest.approx(there.total, rel=2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_stopping_takes_longest_and_wider_tolerances_less(seed):
    motion = motion_of(smooth_path(60, seed))
    stop = time_motion(motion, TRUNNION).total
    times = [time_motion(motion, TRUNNION, corners=c).total for c in (0.0, 1e-3, 0.02, 0.1, 1.0, 20.0)]
    assert times[0] == stop
    # Nodes move with the arms.
    assert (np.diff(times) < 1e-3 * stop).all()
    assert times[-1] < 0.85 * stop


# --- against other methods


def quickest_by_dynamic_programming(law: TimeLaw, nodes: int, levels: int) -> float:
    """Search all speeds on a grid of stations; bounds checked at five points of every interval."""
    station = np.linspace(0.0, law.path.length, nodes)
    top = 1.05 * law.phases.path_speed.max() ** 2
    x = np.linspace(0.0, top, levels)
    cost = np.where(x == 0.0, 0.0, np.inf)
    for start, end in pairwise(station):
        _, slope, bend = law.path.at(np.linspace(start + 1e-9, end - 1e-9, 5))
        path_acceleration = (x[None, :] - x[:, None]) / (2.0 * (end - start))
        good = x[:, None] + x[None, :] > 0.0
        for i, share in enumerate(np.linspace(0.0, 1.0, 5)):
            squared = (1 - share) * x[:, None] + share * x[None, :]
            for a in np.flatnonzero(np.abs(slope).max(axis=0) > 0.0):
                # A hair of play, as the grid of speeds seldom meets a bound.
                good &= (
                    np.abs(slope[i, a] * path_acceleration + bend[i, a] * squared) <= 1.001 * ACCELERATION[a]
                )
                good &= slope[i, a] ** 2 * squared <= 1.001 * SPEED[a] ** 2
        path_speeds = np.sqrt(x[:, None]) + np.sqrt(x[None, :])
        spent = np.full_like(path_speeds, np.inf)
        np.divide(2.0 * (end - start), path_speeds, out=spent, where=good)
        cost = (cost[:, None] + spent).min(axis=0)
    return float(cost[0])


@pytest.mark.parametrize(
    "positions",
    [
        [[0, 0], [0.5, 0], [0.5, 0.5]],
        [[0, 0], [0.4, 0], [0.1, 0.3], [0.6, 0.4]],
        [[0, 0, 0, 0.0, 0.0], [0.4, 0, 0, 0.02, 0], [0.5, 0.3, 0, 0.0, 0.01], [0.5, 0.6, 0.1, 0.0, 0.02]],
    ],
)
def test_no_search_over_all_speeds_is_quicker(positions):
    law = time_motion(motion_of(positions), TRUNNION, corners=10.0)
    brute = quickest_by_dynamic_programming(law, 61, 400)
    assert law.total == pytest.approx(brute, rel=0.03)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("n", "more_speed"), [(400, 1.0), (800, 1.0), (400, 10.0)])
def test_toppra_takes_as_long_on_smooth_paths(seed, n, more_speed):
    """Measured: 0.9997 to 1.0065 times as long as toppra 0.6.10 on four times as many grid points."""
    toppra = pytest.importorskip("toppra")
    positions = smooth_path(n, seed)
    law = time_motion(motion_of(positions), with_limits(TRUNNION, more_speed))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = toppra_time(toppra, positions, SPEED * more_speed)
    assert law.total == pytest.approx(theirs, rel=0.02)


def toppra_time(toppra: object, positions: np.ndarray, speed: np.ndarray) -> float:
    from toppra import algorithm, constraint

    lengths = np.linalg.norm(np.diff(positions, axis=0) * [1, 1, 1, 10, 10], axis=1)
    station = np.concatenate([[0.0], np.cumsum(lengths)])
    n = len(positions)
    grid = np.interp(np.linspace(0, n - 1, 4 * (n - 1) + 1), np.arange(n), station)
    bounds = [
        constraint.JointVelocityConstraint(np.stack([-speed, speed], axis=1)),
        constraint.JointAccelerationConstraint(
            np.stack([-ACCELERATION, ACCELERATION], axis=1),
            discretization_scheme=constraint.DiscretizationType.Interpolation,
        ),
    ]
    path = toppra.SplineInterpolator(station, positions, bc_type="natural")
    run = algorithm.TOPPRA(bounds, path, gridpoints=grid, solver_wrapper="seidel")
    _, path_speed, _ = run.compute_parameterization(0, 0)
    return float(np.sum(2.0 * np.diff(grid) / (path_speed[1:] + path_speed[:-1])))


# --- results of a time law


def test_samples_integrate_over_time():
    law = time_motion(motion_of(smooth_path(50, 1)), TRUNNION, corners=0.05)
    samples = law.samples
    by_block = np.bincount(samples.block, samples.weight, len(law.motion))
    np.testing.assert_allclose(by_block, law.motion.time, atol=1e-12)
    # Speed over time is the travel, and energy that accelerates a mass is recovered from rest to rest.
    np.testing.assert_allclose(
        samples.weight @ samples.speed, law.motion.positions[-1] - law.motion.positions[0], atol=1e-9
    )
    work = samples.weight @ (samples.speed * samples.acceleration)
    np.testing.assert_allclose(work, 0.0, atol=1e-5 * 20.0**2)  # a polynomial of degree 5 in time
    assert (np.diff(samples.time) > 0.0).all()


def test_a_rotary_axis_goes_on_turning_over_its_turns():
    turns = np.zeros((400, 5))
    turns[:, 4] = np.linspace(0.0, 6 * np.pi, 400)
    law = time_motion(motion_of(turns), TRUNNION)
    assert law.total == pytest.approx(3 * 360.0 / 30.0 + 30.0 / 300.0, rel=1e-9)
    assert law.at(law.total)[0][0, 4] == pytest.approx(6 * np.pi)


def test_without_accelerations_times_are_those_of_the_blocks(hayashi, trunnion):
    contact = np.array([[30.0, 0, 5], [40.0, 0, 5], [40.0, 10.0, 5]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0, 1.0], (3, 1)), Tool.ball(6))
    rotary = np.radians([[0, -20], [8, -20], [46, -50]])
    tame = replace(trunnion, axes=tuple(replace(a, max_acceleration=None) for a in trunnion.axes))
    for machine in (hayashi, tame):
        motion = follow(path, machine, rotary)
        law = time_motion(motion, machine)
        np.testing.assert_allclose(law.motion.time, block_times(path, machine, motion.positions), rtol=1e-12)


def test_an_axis_without_acceleration_limit_starts_at_once():
    free = tuple(replace(a, max_acceleration=None) if a.letter == "Y" else a for a in TRUNNION.axes)
    motion = motion_of([[0.0, 0.0], [0.0, 10.0], [10.0, 10.0]], 1.0)
    law = time_motion(motion, replace(TRUNNION, axes=free))
    np.testing.assert_allclose(law.motion.time, [0.0, 1.0, 1.0 + 10.0 / 300.0])


# --- degenerate motions


def test_repeated_rows_take_no_time_and_change_nothing():
    rows = smooth_path(30, 2)
    plain = time_motion(with_speed(motion_of(rows), 10.0), TRUNNION, corners=0.05)
    again = motion_of(np.repeat(rows, 3, axis=0))
    repeated = time_motion(with_speed(again, 10.0), TRUNNION, corners=0.05)
    assert repeated.total == pytest.approx(plain.total, rel=1e-9)
    assert repeated.motion.time.reshape(30, 3)[:, 1:].max() == 0.0


def test_many_tiny_steps_are_a_move():
    whole = motion_of([[0.0], [1e-3], [10.0]], [0.0, 1e-3, 1.0])
    tiny = motion_of([*np.linspace([0.0], [1e-3], 3001), [10.0]], [0.0, *[1e-3 / 3000] * 3000, 1.0])
    assert time_motion(tiny, TRUNNION).total == pytest.approx(time_motion(whole, TRUNNION).total, rel=1e-6)


def test_a_dwell_is_a_stop_of_its_time():
    motion = motion_of([[0.0], [10.0], [10.0], [20.0]], [0.0, 1.0, 2.5, 1.0])
    law = time_motion(motion, TRUNNION)
    np.testing.assert_allclose(law.motion.time, [0.0, 1.0 + 10 / 300, 2.5, 1.0 + 10 / 300])
    assert law_limiting(law).by_cause["dwell"] == pytest.approx(2.5)
    np.testing.assert_allclose(law.at(2.0)[1], 0.0, atol=1e-12)


@pytest.mark.parametrize("rows", [[[1.0, 2.0]], [[1.0, 2.0]] * 4])
def test_a_motion_that_goes_nowhere_takes_no_time(rows):
    law = time_motion(motion_of(rows, 0.0), TRUNNION)
    assert law.total == 0.0
    assert not law.rates.any()
    assert law_limiting(law).by_cause == {}
    position, speed, _ = law.at([0.0, 1.0])
    np.testing.assert_array_equal(position[:, :2], [[1.0, 2.0]] * 2)
    assert not speed.any()


def test_a_reversal_on_the_same_line_is_a_corner():
    motion = motion_of([[0.0], [10.0], [0.0]], 1.0)
    stop, near = (time_motion(motion, TRUNNION, corners=c) for c in ("exact-stop", 0.5))
    assert stop.total == pytest.approx(2.0 * (1.0 + 10.0 / 300.0))
    assert near.total < stop.total
    assert overrun(near) < ROUNDING
    assert near.at(np.linspace(0, near.total, 1001))[0][:, 0].max() == pytest.approx(9.5, abs=1e-3)


@pytest.mark.parametrize("corners", ["sharp", -0.1, np.nan])
def test_other_corners_are_refused(corners):
    with pytest.raises(SettingError, match="corners"):
        time_motion(motion_of([[0.0], [1.0]]), TRUNNION, corners=corners)


def test_other_lengths_are_refused():
    with pytest.raises(SettingError, match="smooth"):
        time_motion(motion_of([[0.0], [1.0]]), TRUNNION, smooth=-1.0)


def test_what_isnt_a_number_is_refused():
    with pytest.raises(ToolpathError, match=r"location 1 .*finite"):
        time_motion(motion_of([[0.0], [np.nan]]), TRUNNION)
    with pytest.raises(ToolpathError, match=r"location 1 .*time"):
        time_motion(motion_of([[0.0], [1.0]], np.inf), TRUNNION)
    with pytest.raises(ToolpathError, match="no cutter locations"):
        time_motion(Motion("XYZAC", np.zeros((0, 5)), *[np.zeros(0)] * 2, *[np.zeros(0, int)] * 2), TRUNNION)
    broken = replace(TRUNNION, axes=tuple(replace(a, max_speed=np.nan) for a in TRUNNION.axes))
    with pytest.raises(MachineError, match="max_speed of X"):
        time_motion(motion_of([[0.0], [1.0]]), broken)
