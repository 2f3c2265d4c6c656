import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between, normalise
from fiveaxis.cam import facet_normals
from fiveaxis.cam.mesh.surface import Surface


def test_a_box_keeps_its_facet_normals_at_every_corner():
    surface = Surface.from_mesh(trimesh.creation.box())
    np.testing.assert_allclose(surface.corner_normals, np.repeat(surface.facet_normals[:, None], 3, axis=1))


def test_a_sphere_has_radial_normals_at_its_vertices():
    surface = Surface.from_mesh(trimesh.creation.icosphere(subdivisions=4, radius=20.0))
    np.testing.assert_allclose(surface.corner_normals, surface.triangles / 20.0, atol=3e-3)


def test_an_edge_below_the_limit_is_smoothed_and_one_above_is_not():
    # A prism with n sides has dihedral angles of 360/n degrees.
    for sides, smoothed in ((13, True), (11, False)):
        surface = Surface.from_mesh(trimesh.creation.cylinder(radius=5.0, height=4.0, sections=sides))
        side = np.abs(surface.facet_normals[:, 2]) < 0.5
        agree = np.einsum("fij,fj->fi", surface.corner_normals[side], surface.facet_normals[side])
        assert (agree < 1.0 - 1e-6).all() == smoothed


def test_a_triangle_without_area_has_no_normal():
    line = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1e-9, 0.0]]])
    assert facet_normals(line) == pytest.approx(np.zeros((1, 3)), abs=0.0)


def between(mesh: trimesh.Trimesh, count: int = 4000) -> tuple[Surface, np.ndarray, np.ndarray]:
    """A surface with points in its triangles, spread by area, and the triangle of each."""
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=1)
    return Surface.from_mesh(mesh), points, faces


def off(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(angle_between(a, b))


@pytest.mark.parametrize("sections", [36, 72])
def test_smoothed_normals_of_a_sphere_are_off_by_tenths_where_facets_are_by_degrees(sections):
    # Facets of 10 and 5 degrees: 0.08 and 0.02 mm from the sphere.
    sphere = trimesh.creation.uv_sphere(radius=20.0, count=[sections // 2, sections])
    surface, points, faces = between(sphere)
    true = normalise(points)
    assert off(surface.facet_normals[faces], true).max() > 150.0 / sections
    assert off(surface.normals_at(points, faces), true).max() < 0.2


def test_smoothed_normals_of_a_cylinder_are_its_own_and_its_ends_stay_flat():
    surface, points, faces = between(trimesh.creation.cylinder(radius=20.0, height=20.0, sections=48))
    side = np.abs(surface.facet_normals[faces][:, 2]) < 0.5
    normals = surface.normals_at(points, faces)
    assert off(surface.facet_normals[faces][side], normalise(points[side] * [1.0, 1.0, 0.0])).max() > 3.5
    assert off(normals[side], normalise(points[side] * [1.0, 1.0, 0.0])).max() < 0.05
    assert off(normals[~side], surface.facet_normals[faces][~side]).max() == pytest.approx(0.0, abs=1e-6)


def test_a_crease_is_where_facets_meet_at_its_angle_or_more():
    prism = trimesh.creation.cylinder(radius=5.0, height=4.0, sections=12)  # 30 deg from side to side
    edge = prism.vertices[np.abs(prism.vertices[:, 2] - 2.0) < 1e-9]
    corner = edge[np.argmax(edge[:, 0])]
    for crease, sharp in ((29.0, True), (31.0, False)):
        surface = Surface.from_mesh(prism, crease=np.radians(crease))
        points = np.array([corner - [0.0, 0.0, 2.0], corner - [0.0, 0.0, 2.0], corner])
        faces = np.array([f for f in range(len(prism.faces)) if touches(prism, f, points[0])][:1])
        on_side = surface.on_crease(points[:1], faces)
        assert bool(on_side[0]) is sharp
        rim = np.array([f for f in range(len(prism.faces)) if touches(prism, f, corner)][:1])
        assert surface.on_crease(corner[None], rim).all()


def touches(mesh: trimesh.Trimesh, face: int, point: np.ndarray) -> bool:
    return bool(
        np.linalg.norm(trimesh.triangles.closest_point(mesh.triangles[[face]], [point]) - point) < 1e-9
    )
