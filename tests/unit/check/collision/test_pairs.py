"""Pairs of pieces of all kinds against coal: far, near, a hair's breadth apart or into it, and deep."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.coal_query import HERE, PAIRS, SHAPES, CoalQuery, poses_of

from fiveaxis.base import translation
from fiveaxis.check.collision.pieces import (
    PairQuery,
    box_piece,
    convex_runs,
    cylinder_piece,
    mesh_piece,
    revolved_pieces,
)

POSES = 60
# mm: where both agree that nothing touches or overlaps by more than this, the answers have to be the same.
HAIR = 1e-6
# mm: of gaps and depths; coal's are no more exact. A polygon of 96 sides is that much wider than a circle.
EXACT, POLYGON = 3e-5, 0.006


@pytest.mark.parametrize("pair", PAIRS)
def test_pairs_are_near_apart_and_deep_as_coal_says(pair):
    (their_mover, mover), (their_other, other) = (SHAPES[name]() for name in pair.split("-"))
    theirs, ours = CoalQuery(their_mover, their_other), PairQuery(mover, other)
    wrong, gaps, depths = 0, [], []
    for pose in poses_of(theirs, mover.size + other.size, POSES):
        gap, depth = theirs.gap(pose, 2.0), theirs.depth(pose)
        if max(gap, depth) > HAIR:
            wrong += ours.nearer(pose, 0.0) is not theirs.nearer(pose, 0.0)
        if abs(gap - 2.0) > HAIR:
            wrong += ours.nearer(pose, 2.0) is not theirs.nearer(pose, 2.0)
        gaps.append(ours.gap(pose, 2.0) - gap)
        depths.append(ours.depth(pose) - depth)
    assert wrong == 0
    assert max(gaps) <= 1e-7  # never too large, but for coal's bisection
    assert min(gaps) > -EXACT
    # coal overstates the depth of two meshes in each other.
    if not (mover.is_mesh and other.is_mesh):
        np.testing.assert_allclose(depths, 0.0, atol=EXACT)
    assert max(depths) < EXACT


@pytest.mark.parametrize("other", ["box", "cylinder", "mesh"])
def test_a_cone_is_exact_where_a_polyhedron_about_it_is_a_little_wider(other):
    (polyhedron, cone), (their_other, piece) = SHAPES["cone"](), SHAPES[other]()
    theirs, ours = CoalQuery(polyhedron, their_other), PairQuery(cone, piece)
    for pose in poses_of(theirs, cone.size + piece.size, POSES):
        assert -EXACT < ours.gap(pose, 2.0) - theirs.gap(pose, 2.0) < POLYGON
        assert -POLYGON < ours.depth(pose) - theirs.depth(pose) < EXACT


def test_the_depth_in_a_triangle_is_finite_where_coals_was_not():
    """coal 3.0.3 says 1.8e308 for this triangle of a propeller and a cylinder."""
    triangle = [[223.7178, 17.44062, 18.01553], [224.5789, 15.91976, 18.8936], [224.345, 14.32402, 17.59255]]
    pose = translation((226.7764700838388, 23.951364459760065, 22.294803750126373))
    pose[:3, :3] = [
        [0.9999998587788375, -0.00020958931642457243, -0.0004883795896160402],
        [0.0005314530130809791, 0.3943703049326578, 0.9189514569034739],
        [0.0, -0.9189515866788853, 0.3943703606260986],
    ]
    corners = np.array(triangle, dtype=np.float32).astype(float)
    face = mesh_piece(corners, np.array([[0, 1, 2]]), HERE, closed=False)
    query = PairQuery(cylinder_piece(3.0, 20.0, HERE), face)
    local = (corners - pose[:3, 3]) @ pose[:3, :3]
    # What it takes to leave it sideways bounds the depth.
    assert 0.0 <= query.depth(pose) <= 3.0 - np.hypot(local[:, 0], local[:, 1]).min() + EXACT


@pytest.mark.parametrize("apart", [5.0, 1e-3, 1e-6, -1e-6, -2.0])
def test_boxes_along_an_axis_are_apart_or_deep_by_hand(apart):
    query = PairQuery(
        box_piece(np.array([10.0, 20.0, 30.0]), HERE), box_piece(np.array([4.0, 8.0, 6.0]), HERE)
    )
    pose = translation((7.0 + apart, 1.0, -2.0))
    assert query.nearer(pose, 0.0) is (apart <= 0.0)
    assert query.gap(pose, 10.0) == pytest.approx(max(apart, 0.0), abs=1e-7)
    assert query.depth(pose) == pytest.approx(max(-apart, 0.0), abs=1e-6)


@pytest.mark.parametrize("lean", np.linspace(0.0, np.pi / 2.0, 7))
@pytest.mark.parametrize("apart", [1.0, 1e-4, -1e-4, -0.7])
def test_a_leaning_cone_above_a_face_is_apart_or_deep_by_hand(lean, apart):
    """Lowest of a cone of radius 3 at its tip and 8 at 20 above, turned by the lean about y."""
    (cone,) = revolved_pieces(np.array([[3.0, 0.0], [8.0, 20.0]]), HERE)
    query = PairQuery(cone, box_piece(np.array([200.0, 200.0, 50.0]), HERE))
    lowest = min(h * np.cos(lean) - r * np.sin(lean) for r, h in ((3.0, 0.0), (8.0, 20.0)))
    pose = translation((1.0, 2.0, 25.0 + apart - lowest))
    pose[:3, :3] = Rotation.from_euler("y", lean).as_matrix()
    assert query.nearer(pose, 0.0) is (apart < 0.0)
    assert query.gap(pose, 2.0) == pytest.approx(max(apart, 0.0), abs=1e-6)
    assert query.depth(pose) == pytest.approx(max(-apart, 0.0), abs=EXACT)


def test_a_query_is_the_same_from_both_sides():
    one, two = SHAPES["cone"]()[1], SHAPES["mesh"]()[1]
    rng = np.random.default_rng(3)
    for _ in range(40):
        pose = translation(rng.normal(size=3) * 12.0)
        pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        there, back = PairQuery(one, two), PairQuery(two, one)
        assert there.gap(pose, 9.0) == pytest.approx(back.gap(np.linalg.inv(pose), 9.0), abs=EXACT)
        assert there.depth(pose) == pytest.approx(back.depth(np.linalg.inv(pose)), abs=EXACT)


def test_an_outline_is_split_where_it_turns_inwards():
    outline = np.array([[0.0, 0.0], [4.0, 2.0], [4.0, 6.0], [2.0, 6.0], [2.0, 20.0]])
    runs = convex_runs(outline)
    assert [run.tolist() for run in runs] == [outline[:4].tolist(), outline[3:].tolist()]
