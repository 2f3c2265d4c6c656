import numpy as np
import pytest
import trimesh

from fiveaxis.contour.distance import BallSpace, TriangleTree


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


def test_a_ball_goes_as_far_as_the_wall_lets_it(tree):
    space = BallSpace(tree, radius=3.0)
    reached = space.reach(np.zeros(3), np.array([30.0, 0.0, 0.0]))
    # The hole's wall is 14 mm from the centre (a little more between the facets' corners).
    assert reached == pytest.approx(11.0, abs=0.08)
    assert space.reach(np.array([20.0, 0.0, 6.0]), np.zeros(3)) == -1.0


def test_a_clear_way_is_told_from_one_through_the_part(tree):
    space = BallSpace(tree, radius=3.0)
    above, inside, beyond = np.array([0.0, 0.0, 20.0]), np.zeros(3), np.array([0.0, 40.0, 0.0])
    assert space.clear(above, inside)
    assert not space.clear(inside, beyond)


def test_a_ball_that_touches_may_move_away(tree):
    space = BallSpace(tree, radius=3.0)
    touching, away = np.array([29.0 - 1e-9, 0.0, 0.0]), np.array([34.0, 0.0, 0.0])
    assert space.clear(touching, away)
