import numpy as np
import pytest
import trimesh

from fiveaxis.cam import TriangleTree
from fiveaxis.cam.mesh.distance import SignedSurface
from fiveaxis.cam.mesh.kernels import encloses

BOX = SignedSurface.of(trimesh.creation.box((40.0, 40.0, 20.0)))


@pytest.fixture(scope="module")
def torus() -> trimesh.Trimesh:
    return trimesh.creation.torus(major_radius=20.0, minor_radius=6.0)


@pytest.fixture(scope="module")
def tree(torus) -> TriangleTree:
    return TriangleTree.build(np.array(torus.triangles))


def test_distances_agree_with_trimesh(torus, tree):
    points = np.random.default_rng(1).uniform(-30.0, 30.0, (300, 3))
    expected = trimesh.proximity.closest_point(torus, points)[1]
    np.testing.assert_allclose(tree.distances(points), expected, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 4, 5, 17])
def test_a_tree_of_any_size_finds_the_nearest_triangle(count):
    rng = np.random.default_rng(count)
    triangles, points = rng.normal(size=(count, 3, 3)), rng.normal(size=(50, 3))
    alone = [TriangleTree.build(triangles[k : k + 1]).distances(points) for k in range(count)]
    np.testing.assert_allclose(TriangleTree.build(triangles).distances(points), np.min(alone, axis=0))


def test_a_triangle_without_area_has_its_distance_too():
    line = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])
    assert TriangleTree.build(line).distances(np.array([[1.0, 3.0, 4.0]])) == pytest.approx(5.0)


def test_a_bound_cuts_distances_off(tree):
    assert tree.distances(np.zeros((1, 3)), bound=2.0) == pytest.approx(2.0)


def test_the_nearest_point_agrees_with_trimesh(torus, tree):
    points = np.random.default_rng(2).uniform(-30.0, 30.0, (300, 3))
    expected, gaps, _ = trimesh.proximity.closest_point(torus, points)
    foot, triangle, distance = tree.nearest(points)
    np.testing.assert_allclose(foot, expected, atol=1e-9)
    np.testing.assert_allclose(distance, gaps, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points - foot, axis=1), distance, atol=1e-12)
    # The index is the mesh's own: the foot lies on that very face.
    own = trimesh.triangles.closest_point(torus.triangles[triangle], points)
    np.testing.assert_allclose(own, foot, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 4, 5, 17])
def test_the_nearest_triangle_of_a_tree_of_any_size_is_the_one_brute_force_finds(count):
    rng = np.random.default_rng(count)
    triangles, points = rng.normal(size=(count, 3, 3)), rng.normal(size=(60, 3))
    gaps = np.stack([TriangleTree.build(triangles[k : k + 1]).distances(points) for k in range(count)])
    _, triangle, distance = TriangleTree.build(triangles).nearest(points)
    np.testing.assert_array_equal(triangle, gaps.argmin(axis=0))
    np.testing.assert_allclose(distance, gaps.min(axis=0), atol=1e-12)


def test_a_point_without_a_triangle_within_the_bound_has_no_foot(tree):
    foot, triangle, distance = tree.nearest(np.array([[0.0, 0.0, 0.0], [27.0, 0.0, 0.0]]), bound=2.0)
    assert np.isnan(foot[0]).all()
    assert triangle[0] == -1
    assert distance[0] == np.inf
    assert distance[1] == pytest.approx(1.0, abs=0.05)
    assert triangle[1] >= 0


def test_the_nearest_point_of_a_triangle_without_area_is_on_its_line():
    line = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])
    foot, triangle, distance = TriangleTree.build(line).nearest(np.array([[1.5, 3.0, 4.0]]))
    np.testing.assert_allclose(foot, [[1.5, 0.0, 0.0]])
    assert (triangle[0], distance[0]) == (0, pytest.approx(5.0))


def test_the_distance_is_negative_inside_and_the_normal_points_out():
    normal, foot, distance = BOX.nearest(np.array([[1.0, 2.0, 13.0], [1.0, 2.0, 7.0]]))
    np.testing.assert_allclose(distance, [3.0, -3.0])
    np.testing.assert_allclose(foot, [[1.0, 2.0, 10.0]] * 2)
    np.testing.assert_allclose(normal, [[0.0, 0.0, 1.0]] * 2)


def test_a_point_on_the_surface_has_the_normal_of_its_facet():
    normal, _, distance = BOX.nearest(np.array([[20.0, 1.0, 2.0]]))
    np.testing.assert_allclose(normal, [[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(distance, [0.0])


def test_off_an_edge_the_normal_points_from_the_edge_to_the_point():
    normal, _, distance = BOX.nearest(np.array([[23.0, 0.0, 14.0]]))
    np.testing.assert_allclose(normal, [[0.6, 0.0, 0.8]])
    np.testing.assert_allclose(distance, [5.0])


def test_a_point_is_inside_a_ring_or_it_is_not():
    ring = trimesh.creation.annulus(r_min=10.0, r_max=20.0, height=8.0)
    assert encloses(ring.triangles, np.array([15.0, 0.0, 1.0]))
    assert not encloses(ring.triangles, np.array([0.5, 0.3, 0.0]))
    assert not encloses(ring.triangles, np.array([15.0, 0.0, 4.1]))
