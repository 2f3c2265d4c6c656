import numpy as np
import trimesh

from fiveaxis.mesh.signed import SignedSurface

BOX = SignedSurface.of(trimesh.creation.box((40.0, 40.0, 20.0)))


def test_the_distance_is_negative_inside_and_the_normal_points_out():
    normal, foot, distance = BOX.nearest(np.array([[1.0, 2.0, 13.0], [1.0, 2.0, 7.0]]))
    np.testing.assert_allclose(distance, [3.0, -3.0])
    np.testing.assert_allclose(foot, [[1.0, 2.0, 10.0]] * 2)
    np.testing.assert_allclose(normal, [[0.0, 0.0, 1.0]] * 2)


def test_a_place_on_the_surface_has_the_normal_of_its_facet():
    normal, _, distance = BOX.nearest(np.array([[20.0, 1.0, 2.0]]))
    np.testing.assert_allclose(normal, [[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(distance, [0.0])


def test_off_an_edge_the_normal_is_the_way_to_the_point():
    normal, _, distance = BOX.nearest(np.array([[23.0, 0.0, 14.0]]))
    np.testing.assert_allclose(normal, [[0.6, 0.0, 0.8]])
    np.testing.assert_allclose(distance, [5.0])
