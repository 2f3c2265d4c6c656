import numpy as np
import pytest
import trimesh

from fiveaxis.cam import plan_contour
from fiveaxis.cam.contour.options import PlanOptions
from fiveaxis.cam.contour.sections import (
    climbing_curvature,
    scallop_levels,
    scallop_step,
    section_levels,
    section_loops,
)
from fiveaxis.cam.mesh.surface import Surface
from fiveaxis.model import Tool


def tube() -> trimesh.Trimesh:
    return trimesh.creation.annulus(r_min=5.0, r_max=10.0, height=8.0, sections=64)


def test_every_loop_has_the_material_to_its_right():
    surface = Surface.from_mesh(tube())
    loops = section_loops(surface, 1.0)
    assert [loop.closed for loop in loops] == [True, True]
    for loop in loops:
        heading = loop.points[:, 1] - loop.points[:, 0]
        normal = surface.facet_normals[loop.faces]
        assert np.all(np.einsum("ij,ij->i", np.cross(normal, [0.0, 0.0, 1.0]), heading) > 0.0)


def test_segments_of_a_loop_join_exactly():
    for loop in section_loops(Surface.from_mesh(tube()), 1.0):
        np.testing.assert_array_equal(loop.points[:, 1], np.roll(loop.points[:, 0], -1, axis=0))


def test_the_section_of_a_tube_encloses_its_area():
    loops = section_loops(Surface.from_mesh(tube()), 1.0)
    areas = []
    for loop in loops:
        x, y = loop.points[:, 0, :2].T
        areas.append(0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
    polygon = 0.5 * 64 * np.sin(2.0 * np.pi / 64)
    assert sorted(areas) == pytest.approx([-100.0 * polygon, 25.0 * polygon])


@pytest.mark.parametrize("level", [-5.0, 0.0, 4.0])
def test_a_level_through_vertices_gives_closed_loops(level):
    surface = Surface.from_mesh(trimesh.creation.icosphere(subdivisions=2, radius=5.0))
    assert all(loop.closed for loop in section_loops(surface, level))


def test_an_open_mesh_has_open_chains():
    box = trimesh.creation.box(extents=[4.0, 4.0, 4.0])
    box.update_faces(box.face_normals[:, 0] < 0.5)
    loops = section_loops(Surface.from_mesh(box), 0.3)
    assert [loop.closed for loop in loops] == [False]
    assert len(loops[0].faces) == 6


def test_sections_by_any_plane_are_those_of_the_turned_part():
    angle = 0.4
    plane = np.array([-np.sin(angle), np.cos(angle), 0.0])
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    frame = np.array([along, np.cross(plane, along), plane])
    surface = Surface.from_mesh(trimesh.creation.icosphere(subdivisions=3, radius=5.0))
    (loop,) = (found.turned(frame.T) for found in section_loops(surface.turned(frame), 1.3))
    np.testing.assert_allclose(loop.points @ plane, 1.3, atol=1e-12)
    assert np.linalg.norm(loop.points, axis=2).max() <= 5.0 + 1e-12
    assert np.linalg.norm(loop.points, axis=2).min() > 4.9
    # The material is to the right, seen against the plane's normal.
    heading = loop.points[:, 1] - loop.points[:, 0]
    outward = surface.facet_normals[loop.faces]
    assert np.all(np.einsum("ij,ij->i", np.cross(outward, plane), heading) > 0.0)


def test_turning_a_surface_there_and_back_changes_nothing():
    frame = trimesh.transformations.random_rotation_matrix(np.array([0.2, 0.5, 0.7]))[:3, :3]
    surface = Surface.from_mesh(tube())
    again = surface.turned(frame).turned(frame.T)
    for name in ("vertices", "facet_normals", "corner_normals"):
        np.testing.assert_allclose(getattr(again, name), getattr(surface, name), atol=1e-12)


def levels_of(mesh: trimesh.Trimesh, radius: float, scallop: float, step: float | None = None) -> np.ndarray:
    surface = Surface.from_mesh(mesh)
    walls = PlanOptions().is_wall(surface.facet_normals)
    return scallop_levels(surface, walls, radius=radius, scallop=scallop, step=step)


def ridge_between(centres: np.ndarray, radius: float, along: np.ndarray, wall: np.ndarray) -> float:
    """Largest height that balls leave over a wall, by brute force in the plane across the passes.

    Parameters
    ----------
    centres : (n, 2), mm
    along, wall : (m, 2), mm, points on the wall's outline and the unit normals there
    """
    offset = along[:, None] - centres[None]
    # The ray from a point along its normal leaves a ball's disc at the larger root, if it meets it at all.
    b = np.einsum("ij,ikj->ik", wall, offset)
    under = b**2 - (offset**2).sum(axis=2) + radius**2
    left = np.where(under >= 0.0, -b - np.sqrt(np.maximum(under, 0.0)), np.inf)
    return float(left.min(axis=1).max())


def test_the_ridge_of_a_step_on_a_flat_wall_has_the_wanted_height():
    step = float(scallop_step(3.0, 0.02))
    assert 3.0 - np.sqrt(9.0 - step**2 / 4.0) == pytest.approx(0.02, rel=1e-12)


@pytest.mark.parametrize("bend", [5.0, 40.0, -8.0])
def test_the_ridge_of_a_step_on_a_round_wall_is_what_brute_force_finds(bend):
    radius, scallop = 3.0, 0.02
    # In polar coordinates about the centre of curvature; in a hollow the material lies outside.
    side, round_ = np.sign(bend), abs(bend)
    half = float(scallop_step(radius, scallop, 1.0 / bend)) / round_ / 2.0
    angle = np.array([-half, half])
    centres = (round_ + side * radius) * np.c_[np.cos(angle), np.sin(angle)]
    angle = np.linspace(-half, half, 2001)
    outward = np.c_[np.cos(angle), np.sin(angle)]
    found = ridge_between(centres, radius, round_ * outward, side * outward)
    assert found == pytest.approx(scallop, rel=1e-3)


def test_levels_of_an_upright_wall_are_a_step_apart_and_begin_half_a_step_from_its_ends():
    levels = levels_of(trimesh.creation.box(extents=[10.0, 10.0, 10.0]), 3.0, 0.02)
    steps = -np.diff(levels)
    assert steps.max() <= float(scallop_step(3.0, 0.02))
    assert steps.max() == pytest.approx(steps.min(), rel=0.01)
    assert 5.0 - levels[0] == pytest.approx(steps[0] / 2.0, rel=0.01)


def test_levels_are_no_farther_apart_than_the_stepdown_that_bounds_them():
    levels = levels_of(trimesh.creation.box(extents=[10.0, 10.0, 10.0]), 3.0, 0.1, step=0.5)
    assert -np.diff(levels).min() <= 0.5


def test_heights_without_walls_get_no_section():
    low, high = (trimesh.creation.box(extents=[10.0, 10.0, 2.0]) for _ in range(2))
    high.apply_translation([0.0, 0.0, 10.0])
    levels = levels_of(trimesh.util.concatenate([low, high]), 3.0, 0.02)
    assert len(levels) > 4
    assert np.all((np.abs(levels) < 1.0) | (np.abs(levels - 10.0) < 1.0))


def test_the_curvature_of_a_sphere_is_one_over_its_radius():
    surface = Surface.from_mesh(trimesh.creation.icosphere(subdivisions=4, radius=20.0))
    steep = np.abs(surface.facet_normals[:, 2]) < 0.9
    np.testing.assert_allclose(climbing_curvature(surface)[steep], 1.0 / 20.0, rtol=0.1)


def test_the_curvature_of_a_hole_is_negative_only_around_it():
    tube = trimesh.creation.annulus(r_min=10.0, r_max=15.0, height=6.0, sections=128)
    turned = Surface.from_mesh(tube).turned(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]))
    curvature = climbing_curvature(turned)
    middle = turned.triangles.mean(axis=1)
    distance = np.hypot(middle[:, 0], middle[:, 2])
    side = np.abs(turned.facet_normals[:, 1]) < 0.5
    assert np.all(curvature[side & (distance > 12.0)] > -1e-9)
    assert np.all(curvature[side & (distance < 12.0)] < 1e-9)
    np.testing.assert_allclose(climbing_curvature(Surface.from_mesh(tube)), 0.0, atol=1e-9)


@pytest.mark.parametrize("scallop", [0.005, 0.05])
def test_the_passes_of_a_cone_leave_the_wanted_ridges(scallop):
    # Apex down; its outline in the plane through the axis is a straight line.
    cone = trimesh.creation.cone(radius=15.0, height=30.0, sections=512)
    cone.apply_transform(np.diag([1.0, -1.0, -1.0, 1.0]))
    path = plan_contour(cone, Tool.ball(6), scallop=scallop)
    contact, pivot = path.contact[path.cutting], path.pivot[path.cutting]
    profile = np.c_[np.hypot(pivot[:, 0], pivot[:, 1]), pivot[:, 2]]
    centres = np.array([profile[contact[:, 2] == z].mean(axis=0) for z in np.unique(contact[:, 2])])
    height = np.linspace(-24.0, -1.0, 5001)
    normal = np.array([2.0, -1.0]) / np.sqrt(5.0)
    outline = np.c_[15.0 + height / 2.0, height]
    found = ridge_between(centres, 3.0, outline, np.tile(normal, (len(outline), 1)))
    # The facets' chords are 0.0003 mm deep; whole steps fit the wall's height only by making them finer.
    assert 0.9 * scallop <= found <= scallop + 0.0004


def test_scallop_levels_of_a_sphere_follow_its_slope():
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=20.0)
    levels = levels_of(sphere, 3.0, 0.01)
    arc = np.diff(np.arccos(levels / 20.0)) * 20.0
    assert arc.max() <= 1.02 * float(scallop_step(3.0, 0.01, 1.0 / 20.0))
    assert arc.min() >= 0.85 * arc.max()


def test_levels_go_down_from_half_a_step_below_the_top():
    levels = section_levels(Surface.from_mesh(trimesh.creation.box(extents=[4.0, 4.0, 4.0])), 1.0)
    np.testing.assert_allclose(levels, [1.5, 0.5, -0.5, -1.5])


def test_a_part_lower_than_a_step_still_has_one_level():
    levels = section_levels(Surface.from_mesh(trimesh.creation.box(extents=[4.0, 4.0, 0.2])), 1.0)
    np.testing.assert_allclose(levels, [0.0], atol=1e-12)


def test_a_level_that_meets_vertices_moves_a_little():
    levels = section_levels(Surface.from_mesh(trimesh.creation.icosphere(radius=5.0)), 10.0)
    assert 0.0 < abs(levels[0]) <= 0.2
