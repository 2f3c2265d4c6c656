"""Blocks in servo cycles: closed forms of single moves, and laws of all."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.trapezoid_times import rest_times

from fiveaxis.model import Machine, Motion, load_machine
from fiveaxis.model.motion.servo_cycles import servo_times

TRUNNION = load_machine("linuxcnc-xyzac-trt")
CYCLE = 1e-3


def blocks_of(rows, feed=10.0) -> Motion:
    """Blocks from row to row, from 0, at a feed along X, Y and Z, or rad/s where these stand."""
    positions = np.vstack([np.zeros(5), rows])
    along = np.linalg.norm(np.diff(positions[:, :3], axis=0, prepend=positions[:1, :3]), axis=1)
    turn = np.linalg.norm(np.diff(positions[:, 3:], axis=0, prepend=positions[:1, 3:]), axis=1)
    time = np.where(along > 0.0, along / feed, turn)
    n = len(positions)
    return Motion("XYZAC", positions, np.full(n, feed), time, np.zeros(n, int), np.arange(n))


def accelerated(factor: float) -> Machine:
    axes = tuple(replace(a, max_acceleration=factor * a.max_acceleration) for a in TRUNNION.axes)
    return replace(TRUNNION, axes=axes)


def exact(blocks: Motion, machine: Machine = TRUNNION) -> np.ndarray:
    return servo_times(blocks, machine, CYCLE, blends=False).times


@pytest.mark.parametrize("length", [0.001, 0.2, 0.34, 5.0])
def test_one_block_is_a_trapezoid_or_triangle_in_whole_cycles(length):
    """300 mm/s² reach 10 mm/s after 0.167 mm: shorter blocks than 0.333 mm never reach their feed."""
    times = exact(blocks_of([[length, 0, 0, 0, 0]]))
    rest = rest_times(blocks_of([[length, 0, 0, 0, 0]]), TRUNNION)[1]
    assert rest - 1e-9 <= times[1] <= rest + 2.0 * CYCLE
    assert times[1] / CYCLE == pytest.approx(round(times[1] / CYCLE))


@pytest.mark.parametrize("blends", [False, True])
def test_a_straight_line_takes_as_long_in_pieces_as_in_one(blends):
    pieces = np.column_stack([np.linspace(0.0, 20.0, 21)[1:], np.zeros((20, 4))])
    one = servo_times(blocks_of(pieces[-1:]), TRUNNION, CYCLE, blends=False).times.sum()
    pieced = servo_times(blocks_of(pieces), TRUNNION, CYCLE, blends=blends).times.sum()
    assert pieced == pytest.approx(one, abs=0.02)


def test_a_block_that_turns_an_axis_is_limited_by_it():
    """A quarter turn of C at 30 deg/s and 300 deg/s², in 1 mm of X."""
    blocks = blocks_of([[1.0, 0, 0, 0, np.pi / 2.0]], feed=1.0)
    assert exact(blocks)[1] == pytest.approx(3.0 + 30.0 / 300.0, abs=2.0 * CYCLE)


def test_a_block_shorter_than_a_cycle_takes_one():
    blocks = blocks_of([[0.001 * k, 0, 0, 0, 0] for k in range(1, 101)])
    assert exact(blocks).sum() >= 100 * CYCLE


def test_a_corner_keeps_a_tenth_of_the_acceleration():
    """A corner of 90 deg: both blocks brake and speed up with 0.9 of what the axis can."""
    blocks = blocks_of([[10.0, 0, 0, 0, 0], [10.0, 10.0, 0, 0, 0]])
    ramp = 10.0 / (0.9 * 300.0)
    np.testing.assert_allclose(exact(blocks)[1:], 1.0 + ramp, atol=2.0 * CYCLE)


def test_a_path_that_doubles_back_stops_without_that():
    blocks = blocks_of([[10.0, 0, 0, 0, 0], [0.0, 0, 0, 0, 0]])
    np.testing.assert_allclose(exact(blocks)[1:], 1.0 + 10.0 / 300.0, atol=2.0 * CYCLE)


def test_a_tighter_blend_is_slower():
    """Down to a corner that would be faster exactly: overlapping blocks have half of their acceleration."""
    corners = np.array([[0, 10], [10, 10], [10, 0], [0, 0]], dtype=float)
    blocks = blocks_of(np.column_stack([corners, np.zeros((4, 3))]), feed=20.0)
    totals = [
        servo_times(blocks, TRUNNION, CYCLE, blends=True, tolerance=tolerance).times.sum()
        for tolerance in (0.0, 0.1, 0.01, 0.001)
    ]
    assert totals == sorted(totals)
    assert totals[0] < exact(blocks).sum() < totals[-1]


def test_a_block_without_a_move_keeps_its_time():
    blocks = blocks_of([[1.0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0], [2.0, 0, 0, 0, 0]])
    blocks = replace(blocks, time=np.array([0.0, 0.1, 0.5, 0.1]))
    assert exact(blocks)[2] == 0.5


steps = st.lists(st.tuples(*[st.integers(-40, 40)] * 5), min_size=1, max_size=25)


@given(steps, st.booleans(), st.sampled_from([0.0, 0.01]))
def test_no_program_is_faster_than_its_feed_nor_slower_on_a_machine_that_accelerates_more(
    steps, blends, tolerance
):
    rows = np.cumsum(np.array(steps) * [0.05, 0.05, 0.05, 0.002, 0.004], axis=0)
    blocks = blocks_of(rows)
    times = servo_times(blocks, TRUNNION, CYCLE, blends=blends, tolerance=tolerance).times
    assert np.isfinite(times).all()
    # Where blocks overlap, at most two are under way at once.
    assert times.sum() >= (1.0 if not blends else 0.5) * blocks.time.sum() - CYCLE
    if not blends:
        assert exact(blocks, accelerated(4.0)).sum() <= times.sum() + CYCLE * len(steps)
