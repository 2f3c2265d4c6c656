"""Key frames: few, in order, and without detours of the tool."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.geometry import normalise
from fiveaxis.viewer.tool_motion import LONGEST_SHOW, MOST_FRAMES, choose_frames, transport


def stretched(motion, n: int, duration: float):
    rows = np.linspace(0, len(motion) - 1, n).astype(int)
    return replace(motion, positions=motion.positions[rows], time=np.full(n, duration / n))


def test_a_long_motion_has_few_frames_with_both_ends(solution):
    frames = choose_frames(stretched(solution.motion, 20_000, 600.0))
    assert len(frames.rows) <= MOST_FRAMES
    assert frames.rows[0] == 0
    assert frames.rows[-1] == 19_999
    assert (np.diff(frames.rows) > 0).all()
    assert (np.diff(frames.times) > 0.0).all()


def test_a_long_motion_is_a_time_lapse_and_a_short_one_is_not(solution):
    long = choose_frames(stretched(solution.motion, 1000, 10.0 * LONGEST_SHOW))
    assert long.times[-1] == pytest.approx(LONGEST_SHOW, rel=0.01)
    assert long.pace == pytest.approx(10.0, rel=0.01)
    short = choose_frames(stretched(solution.motion, 1000, 10.0))
    assert short.pace == 1.0


@pytest.mark.parametrize("n", [1, 2])
def test_the_shortest_motions_have_frames(solution, n):
    assert choose_frames(stretched(solution.motion, n, 1.0)).rows.tolist() == list(range(n))


def test_a_motion_without_durations_is_shown_by_location(solution):
    still = replace(solution.motion, time=np.zeros(len(solution.motion)))
    assert len(choose_frames(still).rows) == len(still)


def axes_of(quaternions: np.ndarray) -> np.ndarray:
    x, y, z, w = quaternions.T
    return np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], axis=1)


def test_quaternions_turn_z_into_the_axes_also_past_straight_down():
    angle = np.linspace(0.0, 2.0 * np.pi, 50)
    axes = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
    quaternions = transport(axes)
    np.testing.assert_allclose(axes_of(quaternions), axes, atol=1e-12)
    assert (np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.99).all()


def test_opposite_axes_are_turned_about_something():
    axes = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    np.testing.assert_allclose(axes_of(transport(axes)), axes, atol=1e-12)


def test_each_turn_is_the_smallest_one():
    rng = np.random.default_rng(3)
    axes = normalise(np.cumsum(rng.normal(size=(40, 3)), axis=0))
    quaternions = transport(axes)
    turn = 2.0 * np.arccos(np.clip(np.abs(np.sum(quaternions[1:] * quaternions[:-1], axis=1)), 0.0, 1.0))
    between = np.arccos(np.clip(np.sum(axes[1:] * axes[:-1], axis=1), -1.0, 1.0))
    np.testing.assert_allclose(turn, between, atol=1e-6)
