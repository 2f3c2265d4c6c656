import numpy as np
import pytest
import trimesh

from fiveaxis.mesh import Surface
from fiveaxis.mesh.sections import section_loops


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
