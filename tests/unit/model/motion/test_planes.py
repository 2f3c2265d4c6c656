"""The plane of the tool's directions at both ends of a cut: the cuts filled in it, and how."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base import angle_between
from fiveaxis.model import (
    AXIS_TOLERANCE,
    FASTEST,
    Limits,
    Machine,
    MoveKind,
    Tool,
    Toolpath,
    load_machine,
    tool_axes,
)
from fiveaxis.model.machine.chain import Line
from fiveaxis.model.motion.deviation import axis_deviation, turns_on_the_spot
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.motion.planes import AxisPlanes

LEANING = [[0.0, -45.0], [20.0, -45.0]]


def cut(n: int = 2) -> Toolpath:
    contact = np.stack([np.linspace(30.0, 32.0, n), np.zeros(n), np.full(n, 5.0)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(6))


def planes_of(machine: Machine, degrees: list[list[float]], **options) -> AxisPlanes:
    return AxisPlanes.of(cut(len(degrees)), machine, np.radians(degrees), **options)


def rodrigues(vector: np.ndarray, about: np.ndarray, angle: float) -> np.ndarray:
    along = about * (about @ vector)
    return along + np.cos(angle) * (vector - along) + np.sin(angle) * np.cross(about, vector)


def test_inserted_blocks_turn_the_tool_axis_evenly_in_its_plane(hayashi):
    rotary = np.radians(LEANING)
    planes = planes_of(hayashi, LEANING)
    # Halfway the axis has its lean on the cone, and tan(lean) falls with the cosine of half the turn in the
    # plane.
    off = np.pi / 4.0 - np.arctan(np.cos(np.radians(10.0)))
    assert planes.off == pytest.approx([off], rel=1e-9)
    assert planes.kept.tolist() == [True]
    _, motion, row = fill_in(cut(), hayashi, rotary, planes=planes)
    angles = motion.positions[:, hayashi.rotary_columns]
    np.testing.assert_array_equal(angles[[0, -1]], rotary)
    axes = tool_axes(hayashi, angles)
    normal = np.cross(axes[0], axes[-1])
    size = np.linalg.norm(normal)
    wanted = [rodrigues(axes[0], normal / size, share * np.arcsin(size)) for share in row]
    np.testing.assert_allclose(axes, wanted, atol=1e-12)
    between = tool_axes(hayashi, np.linspace(angles[:-1], angles[1:], 50))
    assert np.abs(between @ normal).max() / size <= np.sin(AXIS_TOLERANCE)


def test_a_deviation_to_both_sides_is_seen_and_bounded():
    # Across the equator, as seen along the first axis, halves bend to opposite sides and the middle is right.
    machine = load_machine("hayashi-640123")
    machine = replace(machine, axes=tuple(replace(a, limits=Limits(-np.inf, np.inf)) for a in machine.axes))
    degrees = [[-40.0, -80.0], [40.0, -100.0]]
    planes = planes_of(machine, degrees)
    middle = tool_axes(machine, np.radians([[0.0, -90.0]]))
    assert planes.angles(np.array([0]), middle)[0] < 1e-12
    assert planes.kept.tolist() == [True]
    _, motion, _ = fill_in(cut(), machine, np.radians(degrees), planes=planes)
    angles = motion.positions[:, machine.rotary_columns]
    between = tool_axes(machine, np.linspace(angles[:-1], angles[1:], 50))
    assert np.abs(between @ planes.normal[0]).max() <= np.sin(AXIS_TOLERANCE)


def test_cuts_that_leave_their_plane_by_less_stay_in_proportion(hayashi):
    degrees = [[0.0, -45.0], [5.0, -45.0], [9.0, -20.0]]
    planes = planes_of(hayashi, degrees)
    assert planes.kept.tolist() == [False, True]
    _, motion, row = fill_in(cut(3), hayashi, np.radians(degrees), planes=planes)
    first = row <= 1.0
    angles = motion.positions[first][:, hayashi.rotary_columns]
    np.testing.assert_allclose(angles[:, 0], np.radians(5.0) * row[first], atol=1e-12)
    np.testing.assert_allclose(angles[:, 1], np.radians(-45.0), atol=1e-12)


@pytest.mark.parametrize(
    "degrees",
    [
        [[0.0, -4.0], [150.0, -4.0]],  # always near the singular direction
        [[0.0, 0.0], [40.0, -30.0]],  # from it
        [[0.0, -30.0], [200.0, -30.0]],  # shorter in the other direction
    ],
)
def test_cuts_whose_plane_takes_a_rotary_axis_much_faster_leave_it(hayashi, degrees):
    planes = planes_of(hayashi, degrees)
    assert planes.left.tolist() == [True]
    _, motion, row = fill_in(cut(), hayashi, np.radians(degrees), planes=planes)
    angles = motion.positions[:, hayashi.rotary_columns]
    expected = np.radians(degrees[0]) + row[:, None] * np.diff(np.radians(degrees), axis=0)
    np.testing.assert_allclose(angles, expected, atol=1e-12)
    assert not planes.demanded(row).any()
    found = axis_deviation(planes, row, angles, np.arange(len(row) - 1), planes.left)
    assert found.max() == pytest.approx(planes.off[0], rel=0.05)


def test_a_whole_turn_has_no_plane_and_leaves_its_direction(hayashi):
    planes = planes_of(hayashi, [[0.0, -30.0], [360.0, -30.0]])
    assert planes.left.tolist() == [True]
    assert planes.off == pytest.approx([np.radians(60.0)], rel=0.02)


def test_rotary_axes_that_tilt_the_tool_in_one_direction_only_stay_in_proportion():
    machine = Machine.from_code("640123")
    # Two axes along a line between y and z, about which the tool axis is inclined: a cone.
    along = Line((0.0, np.sqrt(0.5), np.sqrt(0.5)))
    joints = tuple(replace(j, line=along) if j.is_rotary else j for j in machine.chain.joints)
    parallel = replace(machine, chain=replace(machine.chain, joints=joints))
    assert planes_of(parallel, LEANING).left.tolist() == [True]


def test_links_and_rapids_run_in_proportion(hayashi):
    path = cut(3)
    for kind in (MoveKind.LINK, MoveKind.RAPID):
        planes = AxisPlanes.of(
            replace(path, kind=np.array([0, kind, 0])), hayashi, np.radians([*LEANING, [40.0, -45.0]])
        )
        assert planes.kept.tolist() == [False, True]
        assert planes.left.tolist() == [False, False]
        assert not planes.demanded(np.array([0.0, 0.5, 1.0])).any()


def test_no_axis_exceeds_its_limit_for_the_plane(hayashi):
    halfway = np.radians(-44.9)
    for limit, kept in ((halfway, False), (np.radians(-44.0), True)):
        axes = tuple(replace(a, limits=Limits(-2.0, limit)) if a.letter == "A" else a for a in hayashi.axes)
        planes = planes_of(replace(hayashi, axes=axes), LEANING)
        assert planes.kept.tolist() == [kept]
        assert planes.left.tolist() == [not kept]


def test_a_linear_axis_keeps_its_travel_too(hayashi):
    # C carries the cut past a tool that stands, except for Z, which A's reversal moves.
    angle = np.radians([-10.0, 10.0])
    contact = np.stack([30.0 * np.cos(angle), 30.0 * np.sin(angle), np.full(2, 5.0)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (2, 1)), Tool.ball(6))
    rotary = np.column_stack([angle, np.full(2, -np.pi / 4.0)])
    z = fill_in(path, hayashi, rotary)[1].positions[:, hayashi.column("Z")]
    assert z.max() > z[0] + 0.03
    for room, kept in ((0.04, False), (0.05, True)):
        travel = Limits(-1000.0, float(z[0]) + room)
        axes = tuple(replace(a, limits=travel) if a.letter == "Z" else a for a in hayashi.axes)
        planes = AxisPlanes.of(path, replace(hayashi, axes=axes), rotary)
        assert planes.kept.tolist() == [kept]
        assert planes.left.tolist() == [not kept]


def test_a_held_axis_stands(hayashi):
    assert planes_of(hayashi, LEANING, hold={"A": -45.0}).left.tolist() == [True]
    assert planes_of(hayashi, LEANING, hold=()).kept.tolist() == [True]


def test_the_plane_enters_no_cone_that_the_axes_avoid(hayashi):
    degrees = [[0.0, -10.0], [60.0, -10.0]]
    nearest = np.arctan(np.tan(np.radians(10.0)) * np.cos(np.radians(30.0)))
    for cone, kept in ((nearest - 1e-3, True), (nearest + 1e-3, False), (np.radians(11.0), True)):
        assert planes_of(hayashi, degrees, cone=cone).kept.tolist() == [kept]


def test_the_fastest_turn_is_a_multiple_of_the_even_one(hayashi):
    degrees = [[0.0, -10.0], [60.0, -10.0]]
    planes = planes_of(hayashi, degrees)
    _, _, row = fill_in(cut(), hayashi, np.radians(degrees), planes=planes)
    # C turns as fast as the angle seen from the foot of the plane's great circle does.
    most = 2.0 * np.sin(np.radians(30.0)) / np.radians(60.0) / np.cos(np.radians(30.0))
    assert 1.0 < planes.fastest(row) == pytest.approx(most, rel=0.03)
    assert planes.fastest(row) <= FASTEST
    assert planes_of(hayashi, [[0.0, -45.0], [1.0, -45.0]]).fastest(np.array([0.0, 1.0])) == 1.0


def test_the_tool_axis_takes_the_nearest_branch_on_a_machine_that_nutates():
    machine = load_machine("dmu50ev")
    degrees = [[10.0, 40.0], [35.0, 70.0]]
    rotary = np.radians(degrees)
    planes = planes_of(machine, degrees)
    assert planes.kept.tolist() == [True]
    _, motion, _ = fill_in(cut(), machine, rotary, planes=planes)
    angles = motion.positions[:, machine.rotary_columns]
    assert np.ptp(angles, axis=0).max() <= FASTEST * np.abs(rotary[1] - rotary[0]).max()
    axes = tool_axes(machine, angles)
    whole = angle_between(axes[:1], axes[-1:])[0]
    assert angle_between(axes[:-1], axes[1:]).sum() == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt", "linuxcnc-bridgemill", "dmu50ev"])
def test_cuts_past_the_singular_direction_are_never_filled_with_turns_of_their_own(name):
    """There the first axis would swing round within a thousandth of the cut, unseen by any equal parts."""
    machine = load_machine(name)
    random = np.random.default_rng(3)
    kept = []
    for nearest in np.tile([0.1, 1.5, 30.0], 20):
        beyond = random.uniform(0.5, 1.0) * nearest
        before = random.choice([-1.0, 1.0]) * random.uniform(3.0, 40.0) if nearest < 2.0 else beyond + 2.0
        turn = random.uniform(0.0, 300.0)
        rotary = np.radians([[turn, before], [turn + random.uniform(0.5, 12.0), beyond]])
        axis = tool_axes(machine, rotary)
        path = Toolpath.from_tips(np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), axis, Tool.ball(8.0))
        planes = AxisPlanes.of(path, machine, rotary)
        kept.append(bool(planes.kept.any()))
        row = fill_in(path, machine, rotary, planes=planes)[2]
        travel = np.abs(np.diff(planes.rotary_at(row), axis=0)).sum(axis=0)
        assert travel.max() <= 1.01 * FASTEST * np.abs(np.diff(rotary, axis=0)).max()
        assert planes.fastest(row) <= 1.01 * FASTEST
    assert any(kept)
    assert not all(kept)


def test_only_whole_turns_of_axes_that_stand_otherwise_are_turns_on_the_spot(hayashi):
    turns = np.array([2.0, -4.0, 0.0, 1.0, 3.0, 2.0]) * np.pi
    moves = np.column_stack([np.zeros((6, 4)), turns])
    moves[5, 0] = 0.1
    assert turns_on_the_spot(hayashi, moves).tolist() == [True, True, True, False, False, False]
