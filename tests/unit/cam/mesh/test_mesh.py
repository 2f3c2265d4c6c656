"""Our meshes are what trimesh's are, which is asked for what is rare only."""

import numpy as np
import pytest
import trimesh

from fiveaxis.cam import Mesh


@pytest.fixture(params=["box", "sphere", "torus"])
def given(request) -> trimesh.Trimesh:
    if request.param == "torus":
        return trimesh.creation.torus(5.0, 2.0)
    if request.param == "box":
        return trimesh.creation.box(extents=(3.0, 5.0, 7.0))
    return trimesh.creation.icosphere(subdivisions=2, radius=4.0)


def test_figures_are_those_of_trimesh(given):
    mesh = Mesh.of(given)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.open_edges == 0
    assert mesh.area == pytest.approx(given.area, rel=1e-12)
    assert mesh.volume == pytest.approx(given.volume, rel=1e-12)
    np.testing.assert_array_equal(mesh.bounds, given.bounds)


def test_the_edges_of_a_hole_are_counted(given):
    """Around one triangle that is missing."""
    mesh = Mesh(np.array(given.vertices), np.array(given.faces)[1:])
    assert not mesh.is_watertight
    assert mesh.open_edges == 3


def test_vertices_are_merged_as_trimesh_merges_them(given):
    loose = Mesh(given.triangles.reshape(-1, 3) + 1e-10, np.arange(3 * len(given.faces)).reshape(-1, 3))
    unused = Mesh(np.vstack([[[99.0, 99.0, 99.0]], loose.vertices]), loose.faces + 1)
    expected = trimesh.Trimesh(loose.vertices, loose.faces, process=False)
    expected.merge_vertices()
    for mesh in (loose, unused):
        merged = mesh.merged()
        np.testing.assert_array_equal(merged.vertices, expected.vertices)
        np.testing.assert_array_equal(merged.faces, expected.faces)


def test_points_inside_are_told_from_those_outside_also_beside_edges_and_corners(given):
    mesh = Mesh.of(given)
    size = np.abs(mesh.vertices).max()
    points = np.random.default_rng(1).uniform(-size, size, (300, 3))
    # On lines through vertices in the direction of the ray, too.
    ray = np.array([0.6738521397, 0.9469035713, 1.0])
    points = np.vstack([points, mesh.vertices[:50] - 0.1 * ray, mesh.vertices[:50] + 0.1 * ray])
    if given.faces.shape[0] == 12:
        expected = (np.abs(points) < [1.5, 2.5, 3.5]).all(axis=1)
    else:
        expected = given.contains(points)
    np.testing.assert_array_equal(mesh.contains(points), expected)


def test_a_revolved_outline_and_a_box_have_trimesh_s_triangles():
    outline = np.array([[0.0, -1.0], [3.0, -1.0], [3.0, 2.0], [5.0, 4.0]])
    expected = trimesh.creation.revolve(np.vstack([outline, [[0.0, 4.0]]]), sections=24)
    made = Mesh.revolved(outline, 24)
    np.testing.assert_array_equal(made.triangles, expected.triangles)
    box = trimesh.creation.box(extents=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(Mesh.box(np.array([1.0, 2.0, 3.0])).triangles, box.triangles)


def test_a_mesh_with_some_triangles_turned_is_turned_outward(given):
    faces = np.array(given.faces)
    faces[::5] = faces[::5, ::-1]
    mesh = Mesh(np.array(given.vertices), faces)
    assert not mesh.is_winding_consistent
    assert mesh.turned_outward().volume == pytest.approx(given.volume)
