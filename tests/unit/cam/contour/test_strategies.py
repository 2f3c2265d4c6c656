"""Rasters, undercuts, leads and shortest passes of planned paths."""

import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between
from fiveaxis.base.errors import MeshError, SettingError
from fiveaxis.cam import TriangleTree, plan_contour
from fiveaxis.model import Tool, Toolpath


def revolved(profile: list[tuple[float, float]], sections: int = 128) -> trimesh.Trimesh:
    """A closed profile of (radius, height), anticlockwise, turned about z."""
    ring = np.linspace(0.0, 2.0 * np.pi, sections, endpoint=False)
    points = np.array(profile)
    around = np.stack([np.cos(ring), np.sin(ring)], axis=1)
    vertices = np.concatenate([np.c_[r * around, np.full(sections, z)] for r, z in points])
    faces = []
    for k in range(len(points)):
        low = k * sections + np.arange(sections)
        high = (k + 1) % len(points) * sections + np.arange(sections)
        faces += [np.c_[low, np.roll(low, -1), np.roll(high, -1)], np.c_[low, np.roll(high, -1), high]]
    return trimesh.Trimesh(vertices, np.vstack(faces), process=False)


def gap(path: Toolpath, mesh: trimesh.Trimesh) -> tuple[float, float]:
    """How far the ball is from touching, at locations and between them, mm; negative is a gouge."""
    tree = TriangleTree.build(np.array(mesh.triangles))
    steps = np.linspace(0.0, 1.0, 12)[1:-1, None, None]
    between = path.pivot[:-1] + steps * np.diff(path.pivot, axis=0)
    radius = path.tool.radius
    return (
        float(tree.distances(path.pivot).min() - radius),
        float(tree.distances(between.reshape(-1, 3)).min() - radius),
    )


@pytest.fixture(scope="module")
def spool() -> trimesh.Trimesh:
    """A tube with an undercut groove in its outer wall and one in its inner wall, at different heights."""
    outer = [(30.0, 0.0), (30.0, 8.0), (24.0, 14.0), (30.0, 20.0), (30.0, 40.0)]
    inner = [(16.0, 40.0), (16.0, 34.0), (21.0, 28.0), (16.0, 22.0), (16.0, 0.0)]
    return revolved(outer + inner)


def test_undercuts_of_inner_and_outer_walls_are_cut_from_both_sides(spool):
    path = plan_contour(spool, Tool.ball(6), stepdown=1.0, overhang=True)
    contact, normal = path.contact[path.cutting], path.normal[path.cutting]
    radius = np.hypot(contact[:, 0], contact[:, 1])
    assert normal[:, 2].max() < 0.0
    outside, inside = radius > 22.0, radius < 22.0
    # Only the upper flank of each groove looks down.
    assert contact[outside, 2].min() > 14.0
    assert contact[outside, 2].max() < 20.0
    assert contact[inside, 2].min() > 28.0
    assert contact[inside, 2].max() < 34.0
    assert len(np.unique(contact[outside, 2])) >= 4
    assert len(np.unique(contact[inside, 2])) >= 4
    outward = np.einsum("ij,ij->i", normal[:, :2], contact[:, :2])
    assert np.all(outward[outside] > 0.0)
    assert np.all(outward[inside] < 0.0)
    at, between = gap(path, spool)
    assert at >= -0.01
    assert between >= -0.02


def test_all_walls_of_sections_with_two_loops_are_cut(spool):
    path = plan_contour(spool, Tool.ball(6), stepdown=2.0)
    contact = path.contact[path.cutting]
    radius = np.hypot(contact[:, 0], contact[:, 1])
    plain = [z for z in np.unique(contact[:, 2]) if z < 6.0 or z > 36.0]
    assert len(plain) >= 5
    for level in plain:
        assert set(np.round(radius[contact[:, 2] == level])) == {16.0, 30.0}
    assert gap(path, spool)[1] >= -0.02


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 200.0])
def test_raster_passes_run_along_their_angle_on_a_block(angle):
    block = trimesh.creation.box(extents=[20.0, 20.0, 10.0])
    path = plan_contour(
        block, Tool.ball(6), strategy="raster", stepover=2.0, raster_angle=angle, direction="zigzag"
    )
    across = np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle)), 0.0])
    top = path.cutting & (path.normal[:, 2] > 0.9)
    both = top[1:] & top[:-1]
    steps = np.diff(path.contact, axis=0)[both]
    np.testing.assert_allclose(steps @ across, 0.0, atol=1e-9)
    assert gap(path, block)[0] >= -0.01


def test_raster_sections_lie_a_stepover_apart():
    block = trimesh.creation.box(extents=[20.0, 20.0, 10.0])
    path = plan_contour(block, Tool.ball(6), strategy="raster", stepover=2.0)
    heights = np.unique(np.round(path.contact[path.cutting][:, 1], 9))
    np.testing.assert_allclose(np.diff(heights), 2.0)


def test_a_raster_cuts_floors_and_walls_but_not_what_lies_on_the_table():
    block = trimesh.creation.box(extents=[20.0, 20.0, 10.0])
    path = plan_contour(block, Tool.ball(6), strategy="raster", stepover=2.0)
    normals = path.normal[path.cutting]
    assert {tuple(n) for n in np.round(normals, 6) + 0.0} == {(0, 0, 1), (1, 0, 0), (-1, 0, 0)}


def test_a_raster_of_overhangs_cuts_nothing_else(spool):
    path = plan_contour(spool, Tool.ball(6), strategy="raster", stepover=2.0, overhang=True)
    assert path.normal[path.cutting, 2].max() < 0.0
    at, between = gap(path, spool)
    assert at >= -0.01
    assert between >= -0.02


def test_a_raster_of_a_sphere_touches_it_and_never_gouges():
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=20.0)
    path = plan_contour(sphere, Tool.ball(6), strategy="raster", stepover=3.0, raster_angle=40.0)
    contact, normal = path.contact[path.cutting], path.normal[path.cutting]
    np.testing.assert_allclose(np.linalg.norm(contact, axis=1), 20.0, atol=0.02)
    assert np.degrees(angle_between(normal, contact / 20.0)).max() < 0.5
    at, between = gap(path, sphere)
    assert at >= -0.01
    assert between >= -0.02


def test_a_climbing_raster_has_what_it_has_yet_to_cut_on_its_right():
    block = trimesh.creation.box(extents=[20.0, 20.0, 10.0])
    for direction, side in (("climb", 1.0), ("conventional", -1.0)):
        path = plan_contour(block, Tool.ball(6), strategy="raster", stepover=2.0, direction=direction)
        top = path.cutting & (path.normal[:, 2] > 0.9)
        feed = np.diff(path.contact, axis=0)[top[1:] & top[:-1]].mean(axis=0)
        passes = path.contact[top, 1]
        ahead = np.array([0.0, np.sign(passes[-1] - passes[0]), 0.0])
        right = np.cross(feed, [0.0, 0.0, 1.0])
        assert np.sign(right @ ahead) == side


def test_zigzag_cuts_open_passes_in_both_directions():
    block = trimesh.creation.box(extents=[20.0, 20.0, 10.0])
    lengths = {}
    for direction in ("climb", "zigzag"):
        path = plan_contour(block, Tool.ball(6), strategy="raster", stepover=2.0, direction=direction)
        lengths[direction] = path.lengths[~path.cutting].sum()
        top = path.cutting & (path.normal[:, 2] > 0.9)
        signs = np.sign(np.diff(path.contact, axis=0)[top[1:] & top[:-1]][:, 0])
        assert set(signs) == ({1.0, -1.0} if direction == "zigzag" else {signs[0]})
    assert lengths["zigzag"] < 0.8 * lengths["climb"]


def test_leads_are_tangential_arcs_in_the_plane_of_feed_and_normal():
    boss = trimesh.creation.cylinder(radius=10.0, height=6.0, sections=256)
    path = plan_contour(boss, Tool.ball(4), stepdown=2.0, lead_in=2.0, lead_out=1.0)
    assert path.ignored == {}
    cut = np.flatnonzero(path.cutting)
    for row, step, radius in ((cut[0], -1, 2.0), (cut[-1], 1, 1.0)):
        normal = path.normal[row]
        middle = path.pivot[row] + radius * normal
        rows = row + step * np.arange(1, 40)
        rows = rows[(rows >= 0) & (rows < len(path))]
        away = np.linalg.norm(path.pivot[rows] - middle, axis=1)
        arc = rows[: int(np.argmax(np.abs(away - radius) > 1e-6))]
        assert len(arc) >= 3
        first = path.pivot[arc[0]] - path.pivot[row]
        assert np.degrees(angle_between(first, normal)) > 70.0
        end = path.pivot[arc[-1]] - path.pivot[row]
        assert end @ normal == pytest.approx(radius)
        outward = path.pivot[row] - path.pivot[row - step]
        assert end @ outward > 0.0


def test_leads_without_room_come_along_the_normal_and_are_counted():
    # A hole hardly wider than the ball: there is room for a quarter of the radius, or for no arc.
    tube = trimesh.creation.annulus(r_min=2.1, r_max=10.0, height=8.0, sections=128)
    path = plan_contour(tube, Tool.ball(4), stepdown=2.0, lead_in=3.0, lead_out=3.0)
    assert path.ignored == {"leads without room for an arc": 8}
    at, between = gap(path, tube)
    assert at >= -0.01
    assert between >= -0.02


def test_a_lollipop_plans_as_a_ball():
    box = trimesh.creation.box(extents=[12.0, 12.0, 12.0])
    paths = [plan_contour(box, tool, stepdown=4.0) for tool in (Tool.lollipop(6, 4), Tool.ball(6))]
    np.testing.assert_array_equal(paths[0].pivot, paths[1].pivot)


@pytest.mark.parametrize("name", ["stepover", "scallop"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_steps_out_of_range_are_named_with_their_unit(name, value):
    with pytest.raises(SettingError, match=rf"{name} = {value:g} mm is out of range; give more than 0 mm"):
        plan_contour(trimesh.creation.box(), Tool.ball(4), strategy="raster", **{name: value})


@pytest.mark.parametrize("name", ["lead_in", "lead_out"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_lengths_below_zero_are_named_with_their_unit(name, value):
    with pytest.raises(SettingError, match=rf"{name} = {value:g} mm is out of range; give 0 mm or more"):
        plan_contour(trimesh.creation.box(), Tool.ball(4), **{name: value})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"strategy": "helix"}, "strategy = 'helix' is unknown; give 'waterline' or 'raster' or 'flow'"),
        ({"order": "random"}, "order = 'random' is unknown; give 'levels' or 'islands'"),
        ({"stepover": 1.0}, "stepover = 1 mm is no option of the waterline strategy"),
        ({"raster_angle": 0.0}, "raster_angle = 0 deg is no option of the waterline strategy"),
        (
            {"strategy": "raster", "stepdown": 1.0},
            "stepdown = 1 mm is no option of the raster .* give stepover",
        ),
        (
            {"strategy": "raster", "raster_angle": np.nan},
            "raster_angle = nan deg is out of range; give a finite number",
        ),
        (
            {"strategy": "raster", "spiral": True},
            "spiral = true is no option of the raster .* give strategy = 'waterline' or 'flow' with it",
        ),
        (
            {"flow_along": "u"},
            "flow_along = u is no option of the waterline .* give strategy = 'flow' with it",
        ),
        ({"strategy": "flow", "stepdown": 1.0}, "stepdown = 1 mm is no option of the flow .* give stepover"),
        ({"scallop": 2.0}, "scallop = 2 mm must be less than the ball's radius, 2 mm"),
        ({"scallop": 1e-13}, r"scallop = 1e-13 mm needs steps of .* finest for a part of 1 mm"),
        ({"strategy": "raster", "stepover": 1e-9}, "stepover = 1e-09 mm is below 1e-05 mm"),
    ],
)
def test_options_that_are_wrong_or_exclude_each_other_say_so(options, message):
    with pytest.raises(SettingError, match=message):
        plan_contour(trimesh.creation.box(), Tool.ball(4), **options)


@pytest.mark.parametrize("options", [{}, {"order": "islands"}, {"spiral": True}, {"scallop": 0.1}])
def test_a_part_without_overhangs_says_so_whatever_the_options(options):
    with pytest.raises(MeshError, match=r"has no overhanging wall on its sections .*10 × 10 × 10 mm"):
        plan_contour(trimesh.creation.box(extents=[10.0] * 3), Tool.ball(4), overhang=True, **options)


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"stepdown": 1.0, "overhang": True},
        {"strategy": "raster", "raster_angle": 20.0, "stepover": 2.0},
        {"scallop": 0.1, "order": "islands", "direction": "zigzag"},
        {"stepdown": 2.0, "spiral": True, "lead_in": 2.0, "lead_out": 2.0},
    ],
)
def test_the_propeller_is_never_gouged_by_any_strategy(data, options):
    part = data / "meshes" / "propeller_d.stl"
    path = plan_contour(part, Tool.ball(4), **options)
    assert path.cutting.sum() > 5000
    at, between = gap(path, trimesh.load_mesh(part))
    assert at >= -0.01
    assert between >= -0.025
