"""Deviations between two locations, and locations inserted against them."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import (
    PATH_TOLERANCE,
    Constraints,
    Filling,
    Interpolation,
    Machine,
    MoveKind,
    Tool,
    Toolpath,
    divide,
    follow,
    tool_axes,
    tool_poses,
    turned,
)
from fiveaxis.model.motion.deviation import path_deviation
from fiveaxis.model.motion.filling import fill_in, inside_rapids
from fiveaxis.model.motion.thinning import thinned


def straight_cut(n: int = 4) -> Toolpath:
    contact = np.stack([np.linspace(30.0, 40.0, n), np.zeros(n), np.full(n, 5.0)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(6))


def blocks_of(path: Toolpath) -> np.ndarray:
    return np.arange(len(path) - 1)


def test_a_path_with_a_still_posture_needs_no_blocks(hayashi):
    filled, _, _ = fill_in(straight_cut(), hayashi, np.tile([0.3, -0.5], (4, 1)))
    assert len(filled) == 4


def test_no_block_of_a_cut_turns_as_far_as_a_jump(hayashi):
    """About an upright tool in the table's centre C turns without moving its tip."""
    contact = np.zeros((3, 3))
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (3, 1)), Tool.ball(6))
    path = path.with_links(np.array([False, False, True]))
    rotary = np.radians([[0.0, 0.0], [170.0, 0.0], [0.0, 0.0]])
    turns = np.degrees(np.abs(np.diff(fill_in(path, hayashi, rotary)[1].positions[:, hayashi.column("C")])))
    assert len(turns) > 2
    assert turns[:-1].max() <= 30.0
    assert turns[-1] == pytest.approx(170.0)


def test_the_time_of_a_path_doesnt_change_with_its_blocks(hayashi):
    path = straight_cut()
    rotary = np.radians([[0, -20], [8, -20], [16, -30], [46, -50]])
    _, motion, _ = fill_in(path, hayashi, rotary)
    assert motion.time.sum() == pytest.approx(10.0 / (1000.0 / 60.0))


def test_divided_moves_have_equal_parts_and_belong_to_the_move_they_were_in():
    path = straight_cut(3)
    divided = divide(path, np.array([2, 3]))
    np.testing.assert_allclose(divided.pivot[:, 0], [30, 32.5, 35, 35 + 5 / 3, 35 + 10 / 3, 40])
    assert divided.source.tolist() == [1, 2, 2, 3, 3, 3]
    assert np.isfinite(divided.normal[:, 2]).tolist() == [True, False, True, False, False, True]


def test_tcp_interpolation_bends_the_path_of_the_balls_centre():
    # A head that turns about the ball's centre: axes that run straight keep it on its path, a tip that does
    # so doesn't.
    machine = Machine.from_code("012346").with_tool_length(0.0)
    path = Toolpath.from_contacts(
        np.column_stack([np.linspace(0.0, 30.0, 4), np.zeros((4, 2))]),
        np.tile([0.0, 0.0, 1.0], (4, 1)),
        Tool.ball(20),
    )
    rotary = np.radians(np.column_stack([np.linspace(0.0, 45.0, 4), np.zeros(4)]))
    off = path_deviation(path, machine, rotary, blocks_of(path), tcp=True)[1]
    axes = tool_axes(machine, rotary)
    turns = np.arccos(np.clip(np.einsum("ni,ni->n", axes[1:], axes[:-1]), -1.0, 1.0))
    np.testing.assert_allclose(off, 10.0 * (1.0 - np.cos(turns / 2.0)), atol=1e-9)
    filled, motion, _ = fill_in(path, machine, rotary, tcp=True)
    angles = motion.positions[:, machine.rotary_columns]
    assert path_deviation(filled, machine, angles, blocks_of(filled), tcp=True).max() <= PATH_TOLERANCE
    assert path_deviation(filled, machine, angles, blocks_of(filled)).max() <= PATH_TOLERANCE
    assert len(filled) > len(path)


def with_a_rapid_move(path: Toolpath) -> Toolpath:
    kind = path.kind.copy()
    kind[2] = MoveKind.RAPID
    return replace(path, kind=kind)


def test_a_rapid_move_gets_no_block_between_its_ends(hayashi):
    rotary = np.radians([[0, -20], [8, -20], [160, -30], [170, -30]])
    _, motion, _ = fill_in(with_a_rapid_move(straight_cut()), hayashi, rotary)
    assert motion.rapid.sum() == 1
    assert motion.cutting.sum() > 3


def test_under_tcp_the_tip_goes_straight_in_rapid_moves(hayashi):
    path = with_a_rapid_move(straight_cut())
    rotary = np.radians([[0, -20], [8, -20], [160, -30], [170, -30]])
    filled, motion, row = fill_in(path, hayashi, rotary, tcp=True)
    inside = inside_rapids(filled, row)
    assert inside.sum() > 5
    tip = tool_poses(hayashi, motion.positions)[0]
    ends = tip[[np.flatnonzero(row == 1.0)[0], np.flatnonzero(row == 2.0)[0]]]
    share = (row[inside] - 1.0)[:, None]
    np.testing.assert_allclose(tip[inside], ends[0] + share * (ends[1] - ends[0]), atol=1e-9)
    # Such a move is one block, and takes the time of its parts.
    few, _ = thinned(filled, hayashi, motion, tcp=True, inside=inside)
    assert few.rapid.sum() == 1
    assert few.time[few.rapid] == pytest.approx(motion.time[motion.rapid].sum())


def tipping_over(lead: float, end: float) -> tuple[Toolpath, np.ndarray]:
    """Turn a bull nose on a floor from one lean to another, deg, in the plane of the feed and the normal."""
    contact = np.stack([np.linspace(30.0, 40.0, 4), np.zeros(4), np.full(4, 5.0)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (4, 1)), Tool.bull(8, 2))
    rotary = np.radians([[90.0, lead], [90.0, lead], [90.0, end], [90.0, end]])
    return path, rotary


def test_a_move_over_the_flat_bottom_jumps_however_short_its_blocks(hayashi):
    path, rotary = tipping_over(-20.0, 20.0)
    fill = Filling().fill(path, hayashi, follow(path, hayashi, rotary))
    np.testing.assert_array_equal(fill.jumps, [1])
    assert np.isfinite(fill.motion.positions).all()
    assert np.isfinite(fill.motion.time).all()


@pytest.mark.parametrize("end", [-60.0, -2.0])
def test_a_move_that_stays_on_one_side_of_the_flat_bottom_has_no_jump(hayashi, end):
    path, rotary = tipping_over(-20.0, end)
    fill = Filling().fill(path, hayashi, follow(path, hayashi, rotary))
    assert len(fill.jumps) == 0
    assert fill.inserted > 0


def test_a_move_over_a_posture_in_which_the_linear_axes_lie_in_one_plane_jumps():
    """Z turns with the table: at A = 90 deg it lies in the plane of X and Y."""
    contact = np.stack([np.linspace(30.0, 40.0, 4), np.zeros(4), np.full(4, 5.0)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 1.0, 0.0], (4, 1)), Tool.ball(6))
    machine = Machine.from_code("364012")
    order = [machine.rotaries.index(c) for c in "AC"]
    rotary = np.radians([[a, 0.0] for a in (80.0, 80.0, 100.0, 100.0)])[:, np.argsort(order)]
    fill = Filling().fill(path, machine, follow(path, machine, rotary))
    np.testing.assert_array_equal(fill.jumps, [1])


def swinging(far: float, near: float) -> Toolpath:
    """A long cut whose normal swings past an upright tool: far from it at both ends, near between them."""
    lean, side = np.radians([-far, far]), np.radians(near)
    normal = np.stack([np.sin(lean), np.cos(lean) * np.sin(side), np.cos(lean) * np.cos(side)], axis=1)
    return Toolpath.from_contacts(np.array([[0.0, 0.0, 5.0], [40.0, 0.0, 5.0]]), normal, Tool.ball(6))


@pytest.mark.parametrize("low", [5.0, 15.0, 40.0])
@pytest.mark.parametrize("past", [0.2, 0.4, 1.0, 5.0])
@pytest.mark.parametrize("swing", [25.0, 31.0, 38.0])
def test_an_axis_that_passes_nearer_to_the_normal_than_it_may_is_seen_at_a_row(hayashi, low, past, swing):
    path = swinging(low + swing, low - past)
    row = fill_in(path, hayashi, np.zeros((2, 2)), least_tilt=np.radians(low))[2]
    assert len(fill_in(path, hayashi, np.zeros((2, 2)))[2]) == 2

    def least(rows: np.ndarray) -> float:
        return float(np.degrees(np.arccos(turned(path.normal, rows)[:, 2])).min())

    assert least(np.linspace(0.0, 1.0, 4001)) == pytest.approx(low - past, abs=0.01)
    assert past < 0.35 or least(row) < low
    # No more of them than are of use.
    assert len(row) < 3 + 2.0 * (low + swing) / np.sqrt(8.0 * low * 0.3)


@pytest.mark.parametrize("angles", [{"cone": 60.0}, {"tilt": (0.0, 70.0)}])
def test_an_edge_that_passes_slower_between_locations_than_it_may_is_seen_at_a_row(hayashi, angles):
    """The edge of a ball of 6 mm has 15 deg to the normal at a radius of 3 sin 15 deg."""
    path, rpm = swinging(45.0, 10.0), 10_000.0
    speed = 2.0 * np.pi * rpm * 3.0 * np.sin(np.radians(15.0)) / 1000.0
    slow = Constraints.of_degrees(**angles, least_cutting_speed=speed, spindle_speed=rpm)
    motion = follow(path, hayashi, np.zeros((2, 2)))
    fill = Filling.of(slow, Interpolation.JOINT).fill(path, hayashi, motion)
    assert np.degrees(np.arccos(turned(path.normal, fill.row)[:, 2])).min() < 15.0
    # Without that speed nothing is asked between the ends.
    free = Filling.of(Constraints.of_degrees(**angles), Interpolation.JOINT)
    assert len(free.fill(path, hayashi, motion).row) == 2
