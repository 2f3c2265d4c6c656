"""How far a ball can move near a part."""

import numpy as np
import pytest
import trimesh

from fiveaxis.cam import TriangleTree
from fiveaxis.cam.contour.ball_space import BallSpace


@pytest.fixture(scope="module")
def tree() -> TriangleTree:
    torus = trimesh.creation.torus(major_radius=20.0, minor_radius=6.0)
    return TriangleTree.build(np.array(torus.triangles))


def test_a_ball_reaches_as_far_as_the_wall_allows(tree):
    space = BallSpace(tree, radius=3.0)
    reached = space.reach(np.zeros(3), np.array([30.0, 0.0, 0.0]))
    # The hole's wall is 14 mm from the centre (a little more between the facets' corners).
    assert reached == pytest.approx(11.0, abs=0.08)
    assert space.reach(np.array([20.0, 0.0, 6.0]), np.zeros(3)) == -1.0


def test_a_move_through_the_part_is_not_clear(tree):
    space = BallSpace(tree, radius=3.0)
    above, inside, beyond = np.array([0.0, 0.0, 20.0]), np.zeros(3), np.array([0.0, 40.0, 0.0])
    assert space.clear(above, inside)
    assert not space.clear(inside, beyond)


def test_a_ball_that_touches_may_move_away(tree):
    space = BallSpace(tree, radius=3.0)
    touching, away = np.array([29.0 - 1e-9, 0.0, 0.0]), np.array([34.0, 0.0, 0.0])
    assert space.clear(touching, away)
