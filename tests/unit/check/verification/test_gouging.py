"""The cutter against a mesh, at locations and in the moves between them."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fiveaxis.cam import Mesh, TriangleTree
from fiveaxis.check import verify
from fiveaxis.check.verification.check_context import DEFAULT_TOLERANCES, make_context
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.check.verification.gouging import MovePoses, gouge_depths
from fiveaxis.model import (
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    follow,
    linear_positions,
    rotary_angles,
    tool_axes,
    tool_poses,
)
from fiveaxis.model.toolpath import shapes

RADIUS = 5.0
SIDE = 40.0
# Radius and height of a ball's outermost points, mm.
AROUND = np.array([[0.0, 0.0], [RADIUS, RADIUS], [0.0, 2.0 * RADIUS]])


@pytest.fixture(scope="module")
def box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(SIDE, SIDE, SIDE))


def along_top(height: float = 0.0, n: int = 30) -> Toolpath:
    """A straight pass over the box's top face, lifted by `height`."""
    contact = np.stack([np.linspace(-15.0, 15.0, n), np.zeros(n), np.full(n, SIDE / 2.0 + height)], axis=1)
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (n, 1)), Tool.ball(2.0 * RADIUS))


def upright(path: Toolpath, machine):
    return follow(path, machine, np.zeros((len(path), 2)))


def test_a_ball_on_the_surface_passes(hayashi, box):
    path = along_top()
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.ok
    assert report.figures["gouge_depth_mm"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("depth", "fires"), [(0.009, False), (0.011, True)])
def test_a_hundredth_of_a_millimetre_is_the_bound(hayashi, box, depth, fires):
    path = along_top(-depth)
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.ok is not fires
    assert report.figures["gouge_depth_mm"] == pytest.approx(depth, abs=1e-9)


def test_one_location_in_the_part_is_named(hayashi, box):
    path = along_top()
    pivot = path.pivot.copy()
    pivot[12, 2] -= 0.015
    sunk = replace(path, pivot=pivot, contact=np.full_like(pivot, np.nan))
    report = verify(upright(sunk, hayashi), hayashi, sunk, part=box)
    assert [f.place.location for f in report.findings] == [12]
    assert "0.015 mm deep into the part here" in report.findings[0].message


def test_a_link_through_the_part_is_found_between_two_good_locations(hayashi, box):
    pivot = np.array([[-30.0, 0.0, 0.0], [30.0, 0.0, 0.0]])
    path = Toolpath.from_tips(
        pivot - [0.0, 0.0, RADIUS],
        np.tile([0.0, 0.0, 1.0], (2, 1)),
        Tool.ball(2.0 * RADIUS),
        kind=[MoveKind.CUT, MoveKind.RAPID],
    )
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.counts == {"gouge": 1}
    assert "in the move to here" in report.findings[0].message


def test_a_path_wholly_inside_the_part_is_a_gouge(hayashi, box):
    path = along_top(-SIDE / 2.0 - RADIUS, n=31)
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.counts == {"gouge": len(path)}
    assert report.figures["gouge_depth_mm"] == pytest.approx(RADIUS + SIDE / 2.0)


def test_an_open_mesh_is_checked_and_what_it_leaves_open_is_reported(hayashi, box):
    lid = box.copy()
    lid.update_faces(np.arange(len(lid.faces)) != 0)
    path = along_top()
    report = verify(upright(path, hayashi), hayashi, path, part=lid)
    assert any("isn't watertight" in sentence for sentence in report.not_checked)


def test_the_part_may_be_a_file(hayashi, box, tmp_path):
    box.export(tmp_path / "box.stl")
    path = along_top(-0.05)
    report = verify(upright(path, hayashi), hayashi, path, part=tmp_path / "box.stl")
    assert report.counts == {"gouge": len(path)}


def test_the_posture_does_not_change_what_the_ball_touches(hayashi, box):
    path = along_top()
    leant = np.tile([0.0, -np.sin(0.5), np.cos(0.5)], (len(path), 1))
    motion = follow(path, hayashi, np.unwrap(rotary_angles(hayashi, leant)[1], axis=0))
    assert verify(motion, hayashi, path, tilt=(15.0, 75.0), part=box).ok


def rows_of(report, code="gouge"):
    return sorted(f.place.location for f in report.findings if f.code == code)


@pytest.mark.parametrize("tool", [Tool.flat(10.0), Tool.bull(10.0, 2.0), Tool.lollipop(10.0, 6.0)], ids=str)
@pytest.mark.parametrize(("depth", "fires"), [(0.009, False), (0.011, True)])
def test_every_cutter_has_the_bound_of_the_ball(hayashi, box, tool, depth, fires):
    ball = along_top(-depth)
    path = Toolpath.from_tips(ball.contact, np.tile([0.0, 0.0, 1.0], (len(ball), 1)), tool)
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert report.ok is not fires
    assert report.figures["gouge_depth_mm"] == pytest.approx(depth, abs=1e-8)


def test_the_flank_of_a_flat_end_is_checked_up_to_its_cutting_length(hayashi, box):
    """Beside a wall, 0.1 mm in it, with the tip above its upper edge by nothing or by a lot."""
    side = np.tile([SIDE / 2.0 + 5.0 - 0.1, 0.0, -10.0], (2, 1))
    side[1, 1] = 1.0
    path = Toolpath.from_tips(side, np.tile([0.0, 0.0, 1.0], (2, 1)), Tool(shapes.flat(10.0, length=25.0)))
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert rows_of(report) == [0, 1]
    assert report.figures["gouge_depth_mm"] == pytest.approx(0.1, abs=1e-8)
    beside = Toolpath.from_tips(side + np.array([0.2, 0.0, 0.0]), path.axis, path.tool)
    passed = " ".join(verify(upright(beside, hayashi), hayashi, beside, part=box).passed)
    assert "cutter, up to 25 mm above its tip" in passed
    assert "above its tip" not in " ".join(report.passed)


def test_a_missing_cutting_length_is_reported(hayashi, box):
    path = along_top()
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert any("states no cutting length" in sentence for sentence in report.not_checked)


def test_an_edge_passed_between_two_good_locations_is_found(hayashi, box):
    """A flat end passes diagonally over the box's edge: free at both ends, 0.07 mm deep in the middle."""
    edge = np.array([SIDE / 2.0, 0.0, SIDE / 2.0])
    corner = edge + np.array([5.0, 0.0, 0.0]) + np.array([-0.05, 0.0, -0.05])
    step = np.array([1.0, 0.0, -1.0])
    path = Toolpath.from_tips(
        np.array([corner - 0.5 * step, corner + 0.5 * step]),
        np.tile([0.0, 0.0, 1.0], (2, 1)),
        Tool.flat(10.0),
    )
    report = verify(upright(path, hayashi), hayashi, path, part=box)
    assert rows_of(report) == [1]
    assert "in the move to here" in report.findings[0].message
    assert report.figures["gouge_depth_mm"] == pytest.approx(0.05, abs=0.01)


def test_a_turn_between_two_good_locations_sweeps_the_flank_into_the_part(hayashi, box):
    """The tip stands beside the box; the tool leans away from it at both ends and is upright between."""
    tip = np.array([[SIDE / 2.0 + 4.5, -1.0, 0.0], [SIDE / 2.0 + 4.5, 1.0, 0.0]])
    tool = Tool(shapes.flat(10.0, length=60.0))
    lean = np.radians(30.0)
    axes = np.array([[np.sin(lean), -np.sin(lean), 1.0], [np.sin(lean), np.sin(lean), 1.0]])
    path = Toolpath.from_tips(tip, axes, tool)
    rotary = np.unwrap(rotary_angles(hayashi, path.axis)[1], axis=0)
    motion = follow(path, hayashi, rotary)
    context = make_context(motion, hayashi, path, None, DEFAULT_TOLERANCES)
    _, within = gouge_depths(context, Mesh.of(box), tcp_height=path.zone.height)
    shares = np.linspace(0.0, 1.0, 401)[1:-1]
    moves = MovePoses(context, path.zone.height, tool.cutter.outline())
    poses = moves.poses(np.ones(len(shares), dtype=int), shares)
    body = CuttingBody.of(tool)
    tree = TriangleTree.build(np.asarray(box.triangles))
    dense = body.depths(*poses, tree, np.full(len(shares), -10.0))
    assert within[1] == pytest.approx(dense.max(), abs=0.01)


@pytest.mark.parametrize("tool", [shapes.flat(10.0), shapes.bull(10.0, 1.0), shapes.lollipop(10.0, 6.0)])
def test_a_block_that_passes_through_the_cutter_from_above_is_found(hayashi, tool):
    """A small block above the cutter at one location and below it at the next."""
    tips = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 14.0]])
    path = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (2, 1)), Tool(tool))
    block = trimesh.creation.box(extents=(1.0, 1.0, 1.0))
    block.apply_translation([1.0, 0.0, 12.0])
    context = make_context(upright(path, hayashi), hayashi, path, None, DEFAULT_TOLERANCES)
    here, within = gouge_depths(context, Mesh.of(block))
    assert (here < 0.0).all()
    assert within[1] > 1.0


def test_linear_axes_leave_the_straight_path_of_the_centre(hayashi, box):
    """Half a turn of the table while the ball passes over the part: under TCP it stays on top."""
    contact = np.array([[-10.0, 8.0, SIDE / 2.0], [10.0, 8.0, SIDE / 2.0]])
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (2, 1)), Tool.ball(2.0 * RADIUS))
    first, last = (rotary_angles(hayashi, leant_axis(a))[1][0] for a in (25.0, 65.0))
    motion = follow(path, hayashi, np.array([first, last]))
    context = make_context(motion, hayashi, path, None, DEFAULT_TOLERANCES)
    _, straight = gouge_depths(context, Mesh.of(box), tcp_height=path.zone.height)
    _, linear = gouge_depths(context, Mesh.of(box), tcp_height=None)
    assert straight[1] == pytest.approx(0.0, abs=1e-9)
    assert abs(linear[1]) > 0.1


def test_a_control_that_moves_the_tip_straight_displaces_the_ball(hayashi):
    """A lollipop turns about its ball's centre under a ceiling: with TCP at the tip it bulges upwards."""
    half, tilt = np.radians(30.0), np.radians(45.0)
    axes = np.array([[0.0, np.sin(a), np.cos(a)] for a in (-half, half)])
    path = Toolpath.from_tips(-RADIUS * axes, axes, Tool(shapes.lollipop(2.0 * RADIUS, 4.0)))
    rotary = np.array([[0.0, half], [0.0, -half]])
    assert tool_axes(hayashi, rotary) == pytest.approx(axes)
    context = make_context(follow(path, hayashi, rotary), hayashi, path, None, DEFAULT_TOLERANCES)
    ceiling = trimesh.creation.box(extents=(20.0, 100.0, 100.0))
    towards = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    ceiling.apply_transform(trimesh.geometry.align_vectors([1.0, 0.0, 0.0], towards))
    ceiling.apply_translation((RADIUS + 10.0) * towards)
    bulge = RADIUS * (1.0 - np.cos(half)) * np.cos(tilt)
    for tcp_height, depth in ((RADIUS, 0.0), (0.0, bulge)):
        here, within = gouge_depths(context, Mesh.of(ceiling), tcp_height=tcp_height)
        assert here == pytest.approx(0.0, abs=1e-6)
        assert within[1] == pytest.approx(depth, abs=0.005)


@pytest.mark.parametrize("step", [1.0, 1.9, 4.0])
@pytest.mark.parametrize("arm", [200.0, 1000.0])
def test_linear_axes_bulge_between_ends_that_coincide(hayashi, arm, step):
    """A ball that turns about its centre, far from the axis of A: between the rows it swings aside."""
    angle = np.radians(step)
    rotary = np.array([[0.0, 0.0], [0.0, -angle], [0.0, -2.0 * angle]])
    axis = tool_axes(hayashi, rotary)
    tips = np.array([0.0, 0.0, arm]) - RADIUS * axis
    path = Toolpath.from_tips(tips, axis, Tool.ball(2.0 * RADIUS))
    positions = linear_positions(hayashi, tips, rotary)
    motion = Motion(hayashi.letters, positions, path.feed, np.ones(3), path.kind, path.source)
    context = make_context(motion, hayashi, path, None, DEFAULT_TOLERANCES)
    bulge = arm * (1.0 - np.cos(angle / 2.0))
    tip, axis = tool_poses(hayashi, (positions[1:] + positions[:-1]) / 2.0)
    aside = tip + RADIUS * axis - [0.0, 0.0, arm]
    assert np.linalg.norm(aside, axis=1) == pytest.approx(bulge, rel=1e-6)
    wall = trimesh.creation.box(extents=(20.0, 100.0, 100.0))
    wall.apply_transform(trimesh.geometry.align_vectors([1.0, 0.0, 0.0], aside[0]))
    wall.apply_translation([0.0, 0.0, arm] + aside[0] / bulge * (RADIUS + 10.0))
    here, deepest = gouge_depths(context, Mesh.of(wall), tcp_height=None)
    assert here == pytest.approx(0.0, abs=1e-6)
    if bulge > DEFAULT_TOLERANCES.chord_gouge:
        assert deepest[1:] == pytest.approx(bulge, abs=0.005)


@pytest.mark.parametrize("tcp_height", [None, 0.0, RADIUS])
def test_no_point_of_the_cutter_exceeds_the_bound_on_its_movement(hayashi, tcp_height):
    generator = np.random.default_rng(8)
    positions = np.cumsum(generator.normal(size=(40, 5)) * [3.0, 3.0, 3.0, 0.02, 0.02], axis=0)
    positions[:, :3] += 100.0
    tip, axis = tool_poses(hayashi, positions)
    path = Toolpath.from_tips(tip, axis, Tool.ball(2.0 * RADIUS))
    motion = Motion(hayashi.letters, positions, path.feed, np.ones(40), path.kind, path.source)
    moves = MovePoses(make_context(motion, hayashi, path, None, DEFAULT_TOLERANCES), tcp_height, AROUND)
    row = np.arange(1, 40)
    ends = [moves.poses(row, np.full(39, share)) for share in (0.0, 1.0)]
    bound = moves.movement(*ends) + moves.bends(row) / 2.0
    dense = [moves.poses(row, np.full(39, share)) for share in np.linspace(0.0, 1.0, 51)]
    for height in (0.0, RADIUS, 2.0 * RADIUS):
        points = np.array([tip + height * axis for tip, axis in dense])
        length = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0)
        assert (length <= bound + 1e-9).all()


def leant_axis(degrees):
    angle = np.radians(degrees)
    return np.array([[0.0, -np.sin(angle), np.cos(angle)]])
