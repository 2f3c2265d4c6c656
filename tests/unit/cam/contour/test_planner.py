import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between
from fiveaxis.base.errors import MeshError, SettingError
from fiveaxis.cam import PlanOptions, TriangleTree, plan_contour, plan_passes
from fiveaxis.cam.contour.linking import LINK_SPACING
from fiveaxis.model import Tool, Toolpath

ROOT = Path(__file__).parents[4]


def lowest_gap(path: Toolpath, mesh: trimesh.Trimesh) -> float:
    """How far the nearest ball is from touching, mm, by trimesh's own distance; negative is a gouge."""
    return float(trimesh.proximity.closest_point(mesh, path.pivot)[1].min() - path.tool.radius)


def lowest_gap_between(path: Toolpath, mesh: trimesh.Trimesh) -> float:
    """The same along the straight moves from location to location, mm, sampled every 0.1 mm or finer."""
    tree = TriangleTree.build(np.array(mesh.triangles))
    moves = [
        np.linspace(a, b, 2 + int(np.linalg.norm(b - a) / 0.1))
        for a, b in zip(path.pivot, path.pivot[1:], strict=False)
    ]
    return float(tree.distances(np.vstack(moves)).min() - path.tool.radius)


def runs_of_links(path: Toolpath) -> int:
    starts = np.diff(np.concatenate([[0], (~path.cutting).astype(int)])) == 1
    return int(starts.sum())


@pytest.fixture(scope="module")
def sphere() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=5, radius=20.0)


@pytest.fixture(scope="module")
def sphere_path(sphere) -> Toolpath:
    return plan_contour(sphere, Tool.ball(6), stepdown=4.0, spacing=0.5)


def test_passes_of_a_plan_are_what_lies_between_the_links_of_its_path(sphere, sphere_path):
    plan = plan_passes(sphere, Tool.ball(6), PlanOptions(stepdown=4.0, spacing=0.5))
    np.testing.assert_array_equal(plan.toolpath.pivot, sphere_path.pivot)
    inside = np.zeros(len(sphere_path), dtype=bool)
    for first, last in zip(plan.first, plan.last, strict=True):
        inside[first : last + 1] = True
    np.testing.assert_array_equal(sphere_path.cutting, inside)


def test_contacts_lie_on_their_sections_and_on_the_sphere(sphere_path):
    contact = sphere_path.contact[sphere_path.cutting]
    assert len(np.unique(contact[:, 2])) == 10
    np.testing.assert_allclose(np.linalg.norm(contact, axis=1), 20.0, atol=0.02)


def test_normals_of_a_sphere_are_radial(sphere_path):
    contact, normal = sphere_path.contact[sphere_path.cutting], sphere_path.normal[sphere_path.cutting]
    radial = contact / np.linalg.norm(contact, axis=1, keepdims=True)
    assert np.degrees(angle_between(normal, radial)).max() < 0.5


def test_passes_of_a_sphere_are_closed_and_go_down(sphere_path):
    cut = sphere_path.cutting
    contact = sphere_path.contact[cut]
    assert np.all(np.diff(contact[:, 2]) <= 0.0)
    for z in np.unique(contact[:, 2]):
        ring = contact[contact[:, 2] == z]
        np.testing.assert_array_equal(ring[0], ring[-1])


def test_neighbouring_contacts_of_a_pass_are_within_the_spacing(sphere_path):
    both = sphere_path.cutting[1:] & sphere_path.cutting[:-1]
    gaps = np.linalg.norm(np.diff(sphere_path.contact, axis=0), axis=1)[both]
    assert gaps.max() <= 0.5 + 1e-9


def test_links_are_divided_into_short_moves(sphere_path):
    assert 0.5 * LINK_SPACING < sphere_path.lengths[~sphere_path.cutting].max() <= LINK_SPACING + 1e-9


def test_links_have_no_contact_and_rows_are_counted_from_one(sphere_path):
    link = ~sphere_path.cutting
    assert np.isnan(sphere_path.contact[link]).all()
    assert np.isnan(sphere_path.normal[link]).all()
    assert not sphere_path.has_axes
    np.testing.assert_array_equal(sphere_path.source, np.arange(1, len(sphere_path) + 1))


def test_normals_of_a_cone_match_its_half_angle():
    # An inverted cone: apex down, so that its whole wall overhangs.
    cone = trimesh.creation.cone(radius=15.0, height=30.0, sections=256)
    cone.apply_transform(np.diag([1.0, -1.0, -1.0, 1.0]))
    path = plan_contour(cone, Tool.ball(4), stepdown=3.0, overhang=True)
    contact, normal = path.contact[path.cutting], path.normal[path.cutting]
    radial = contact[:, :2] / np.linalg.norm(contact[:, :2], axis=1, keepdims=True)
    expected = np.c_[2.0 * radial, np.full(len(radial), -1.0)] / np.sqrt(5.0)
    # The facets' normals at the apex lean, since they are the mean of a fan of 60 degrees.
    error = np.degrees(angle_between(normal, expected))
    assert error.max() < 1.5
    assert error[contact[:, 2] > -6.0].max() < 0.4
    assert lowest_gap(path, cone) >= -0.01


def test_climb_goes_clockwise_around_a_boss_and_conventional_anticlockwise():
    boss = trimesh.creation.cylinder(radius=10.0, height=6.0, sections=128)
    turned = {}
    for direction in ("climb", "conventional"):
        path = plan_contour(boss, Tool.ball(4), stepdown=6.0, direction=direction)
        x, y = path.contact[path.cutting, :2].T
        turned[direction] = float(np.sum(x[:-1] * y[1:] - y[:-1] * x[1:]))
    assert turned["climb"] == pytest.approx(-2.0 * np.pi * 100.0, rel=0.01)
    assert turned["conventional"] == pytest.approx(-turned["climb"], rel=1e-3)


@pytest.mark.parametrize("turned", range(8))
def test_the_ball_rolls_about_the_corners_of_a_box_wherever_the_section_begins(turned):
    box = trimesh.creation.box(extents=[12.0, 12.0, 12.0])
    box.faces = np.roll(box.faces, turned, axis=0)
    path = plan_contour(box, Tool.ball(6), stepdown=4.0)
    assert lowest_gap_between(path, box) >= -0.02
    both = path.cutting[1:] & path.cutting[:-1]
    np.testing.assert_allclose(angle_between(path.normal[1:][both], path.normal[:-1][both]), 0.0, atol=1e-9)


def test_climb_goes_anticlockwise_in_a_hole():
    tube = trimesh.creation.annulus(r_min=10.0, r_max=15.0, height=6.0, sections=128)
    path = plan_contour(tube, Tool.ball(4), stepdown=6.0)
    inner = path.contact[path.cutting & (np.linalg.norm(path.contact[:, :2], axis=1) < 12.0)]
    x, y = inner[:, :2].T
    assert np.sum(x[:-1] * y[1:] - y[:-1] * x[1:]) == pytest.approx(2.0 * np.pi * 100.0, rel=0.01)
    assert lowest_gap(path, tube) >= -0.01


def test_overhang_keeps_only_the_lower_half_of_a_sphere(sphere):
    path = plan_contour(sphere, Tool.ball(6), stepdown=4.0, overhang=True)
    assert path.normal[path.cutting, 2].max() < 0.0
    assert path.contact[path.cutting, 2].max() < 0.0


def test_a_pass_under_a_roof_is_reached_from_the_side():
    # A mushroom: the stem's wall can't be reached straight down from above.
    roof = trimesh.creation.cylinder(radius=30.0, height=5.0, sections=96)
    stem = trimesh.creation.cylinder(radius=8.0, height=40.0, sections=96)
    roof.apply_translation([0.0, 0.0, 23.0])
    part = trimesh.util.concatenate([roof, stem])
    path = plan_contour(part, Tool.ball(6), stepdown=6.0)
    on_stem = np.linalg.norm(path.contact[:, :2], axis=1) < 10.0
    assert on_stem.sum() > 200
    assert lowest_gap(path, part) >= -0.01
    assert lowest_gap_between(path, part) >= -0.02


def test_a_hole_hardly_wider_than_the_ball_is_left_straight_up():
    tube = trimesh.creation.annulus(r_min=2.1, r_max=10.0, height=8.0, sections=128)
    path = plan_contour(tube, Tool.ball(4), stepdown=2.0)
    assert (np.linalg.norm(path.contact[:, :2], axis=1) < 3.0).sum() > 50
    assert path.ignored == {}
    assert lowest_gap_between(path, tube) >= -0.02


def test_an_enclosed_void_is_left_out_and_counted():
    outer = trimesh.creation.box(extents=[30.0, 30.0, 30.0])
    void = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    void.invert()
    part = trimesh.util.concatenate([outer, void])
    path = plan_contour(part, Tool.ball(4), stepdown=5.0)
    assert np.abs(path.contact[path.cutting][:, :2]).max(axis=1) == pytest.approx(15.0)
    assert path.ignored["passes without a clear link"] > 0


def test_bodies_are_cut_level_by_level_with_links_between_them():
    posts = [trimesh.creation.cylinder(radius=5.0, height=10.0, sections=64) for _ in range(3)]
    for k, post in enumerate(posts):
        post.apply_translation([30.0 * k, 0.0, 0.0])
    path = plan_contour(trimesh.util.concatenate(posts), Tool.ball(4), stepdown=5.0)
    assert runs_of_links(path) == 7
    assert np.all(np.diff(path.contact[path.cutting, 2]) <= 0.0)


def test_the_mesh_of_the_caller_stays_as_it_was():
    part = trimesh.creation.box(extents=[10.0, 10.0, 10.0])
    before = part.vertices.copy(), part.faces.copy()
    plan_contour(part, Tool.ball(4), stepdown=5.0)
    np.testing.assert_array_equal(part.vertices, before[0])
    np.testing.assert_array_equal(part.faces, before[1])


def test_feed_is_turned_into_mm_per_second_on_every_row():
    path = plan_contour(
        trimesh.creation.box(extents=[10.0] * 3), Tool.ball(4), stepdown=5.0, feed_mm_min=600.0
    )
    assert set(path.feed) == {10.0}


def test_progress_counts_the_sections():
    calls: list[tuple[int, int]] = []
    box = trimesh.creation.box(extents=[10.0] * 3)
    plan_contour(box, Tool.ball(4), stepdown=2.0, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(k, 5) for k in range(1, 6)]


@pytest.mark.parametrize("name", ["stepdown", "spacing", "feed_mm_min", "clearance"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_a_setting_out_of_range_is_named_with_its_unit(name, value):
    with pytest.raises(SettingError, match=rf"{name} = {value:g} mm\S* is out of range; give more than 0 mm"):
        plan_contour(trimesh.creation.box(), Tool.ball(4), **{name: value})


@pytest.mark.parametrize("name", ["stepdown", "spacing"])
def test_a_step_that_would_fill_the_memory_is_refused(name):
    with pytest.raises(SettingError, match=rf"{name} = 1e-09 mm is below 1e-05 mm"):
        plan_contour(trimesh.creation.box(), Tool.ball(4), **{name: 1e-9})


def test_an_unknown_direction_lists_the_known_ones():
    with pytest.raises(SettingError, match="direction = 'up' is unknown; give 'climb' or 'conventional'"):
        plan_contour(trimesh.creation.box(), Tool.ball(4), direction="up")


def test_an_open_part_is_planned_if_allowed():
    shell = trimesh.creation.cylinder(radius=10.0, height=10.0, sections=64)
    shell.update_faces(np.abs(shell.face_normals[:, 2]) < 0.5)
    with pytest.raises(MeshError, match="128 of its edges"):
        plan_contour(shell, Tool.ball(4), stepdown=2.0)
    assert plan_contour(shell, Tool.ball(4), stepdown=2.0, allow_open=True).cutting.sum() > 500


def test_importing_the_room_loads_no_heavy_library():
    code = "import sys, fiveaxis.cam.contour; print({'trimesh', 'numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "set()"


def test_the_example_part_is_what_its_script_makes():
    script = ROOT / "examples" / "overhang" / "make_part.py"
    namespace: dict[str, object] = {"__name__": "make_part", "__file__": str(script)}
    exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), namespace)
    made = namespace["make_part"]()
    assert made.export(file_type="stl") == script.with_name("part.stl").read_bytes()


def test_the_example_part_gives_a_short_path_on_its_overhang():
    part = ROOT / "examples" / "overhang" / "part.stl"
    path = plan_contour(part, Tool.ball(8), stepdown=3.0, overhang=True)
    assert 500 < path.cutting.sum() < 1500
    assert path.normal[path.cutting, 2].max() < -0.02
    assert path.ignored == {}
    # One closed pass on each of ten levels, and no ball below the table.
    assert runs_of_links(path) == 11
    assert (path.pivot[:, 2] - 4.0).min() > 0.0
    assert lowest_gap(path, trimesh.load_mesh(part)) >= -0.01


@pytest.mark.slow
def test_several_bodies_of_someone_else_are_never_gouged(data):
    part = data / "meshes" / "supportless_sample.stl"
    path = plan_contour(part, Tool.ball(6), stepdown=4.0)
    assert path.cutting.sum() > 5000
    assert lowest_gap(path, trimesh.load_mesh(part)) >= -0.01
