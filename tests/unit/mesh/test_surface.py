import numpy as np
import pytest
import trimesh

from fiveaxis.mesh import Surface, facet_normals


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
