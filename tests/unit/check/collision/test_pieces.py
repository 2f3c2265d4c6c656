"""Answers about pairs of pieces against hand calculation, brute force and coal."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.pairwise_cases import in_pairs

from fiveaxis.base import translation
from fiveaxis.check.collision.pieces import (
    PairQuery,
    box_piece,
    convex_runs,
    cylinder_piece,
    mesh_piece,
    revolved_pieces,
)

HERE = np.eye(4)


def mesh_of(mesh: trimesh.Trimesh):
    return mesh_piece(mesh.vertices, mesh.faces, HERE, closed=mesh.is_watertight)


def wall():
    """A wall of two triangles in the plane x = 0."""
    corners = np.array([[0, -50, -50], [0, 50, -50], [0, 50, 50], [0, -50, 50]], dtype=float)
    return mesh_piece(corners, np.array([[0, 1, 2], [0, 2, 3]]), HERE, closed=False)


@in_pairs(margin=[0.0, 0.5, 20.0], miss=[1e-3, -1e-3], lean=[0.0, 0.3, 1.5])
def test_a_micrometre_decides_between_a_cylinder_and_a_wall(margin, miss, lean):
    radius, height = 5.0, 30.0
    reach = radius * np.cos(lean) + height / 2.0 * np.sin(lean)
    place = translation((reach + margin + miss, 3.0, 2.0))
    place[:3, :3] = Rotation.from_euler("y", lean).as_matrix()
    assert PairQuery(cylinder_piece(radius, height, HERE), wall()).nearer(place, margin) is (miss < 0.0)


def test_the_depth_of_a_cylinder_in_a_wall_is_the_overlap():
    query = PairQuery(cylinder_piece(5.0, 30.0, HERE), wall())
    assert query.depth(translation((4.3, 0.0, 0.0))) == pytest.approx(0.7, abs=1e-6)
    assert query.depth(translation((5.1, 0.0, 0.0))) == 0.0


def test_the_gap_is_never_overestimated():
    query = PairQuery(cylinder_piece(5.0, 30.0, HERE), wall())
    gap = query.gap(translation((6.3, 0.0, 0.0)), 2.0)
    assert 1.3 - 1e-6 <= gap <= 1.3


def test_a_cone_has_its_width_and_no_more():
    (cone,) = revolved_pieces(np.array([[10.0, 0.0], [20.0, 30.0]]), HERE)
    query = PairQuery(cone, box_piece(np.array([2.0, 2.0, 2.0]), HERE))
    for height, radius in ((1.0, 10.0 + 2.0 / 3.0), (15.0, 15.0 + 1.0 / 3.0), (29.0, 20.0)):
        edge = 1.0 + radius
        assert query.nearer(translation((edge - 1e-6, 0.0, -height)), 0.0)
        assert not query.nearer(translation((edge + 1e-6, 0.0, -height)), 0.0)


def test_an_outline_is_split_where_it_turns_inwards():
    outline = np.array([[0.0, 0.0], [4.0, 2.0], [4.0, 6.0], [2.0, 6.0], [2.0, 20.0]])
    runs = convex_runs(outline)
    assert [run.tolist() for run in runs] == [outline[:4].tolist(), outline[3:].tolist()]


def test_random_cylinders_meet_a_mesh_where_dense_samples_of_it_lie_inside_them():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=20.0)
    samples, spacing = trimesh.sample.sample_surface_even(mesh, 40_000, seed=3)[0], 0.6
    radius, height = 4.0, 25.0
    query = PairQuery(cylinder_piece(radius, height, HERE), mesh_of(mesh))
    rng = np.random.default_rng(7)
    decided = 0
    for _ in range(150):
        place = np.eye(4)
        place[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        place[:3, 3] = rng.uniform(-38.0, 38.0, 3)
        local = (samples - place[:3, 3]) @ place[:3, :3]
        over = np.maximum(np.hypot(local[:, 0], local[:, 1]) - radius, np.abs(local[:, 2]) - height / 2.0)
        if over.min() < 0.0 or over.min() > spacing:
            decided += 1
            assert query.nearer(place, 0.0) is bool(over.min() < 0.0)
    assert decided > 120


def test_a_meshs_memory_is_known():
    piece = mesh_of(trimesh.creation.icosphere(subdivisions=3))
    assert 200 * 1280 < piece.memory < 400 * 1280
    assert box_piece(np.ones(3), HERE).memory == 0


@pytest.mark.parametrize(("gap", "margin", "near"), [(0.9, 1.0, True), (1.1, 1.0, False), (-0.1, 0.0, True)])
def test_two_meshes_are_near_if_their_gap_is_within_the_margin(gap, margin, near):
    first, second = (mesh_of(trimesh.creation.box(extents=(10.0, 20.0, 30.0))) for _ in range(2))
    query = PairQuery(first, second)
    place = translation((10.0 + gap, 3.0, 4.0))
    assert query.nearer(place, margin) is near
    assert (query.depth(place) > 0.0) is (gap < 0.0)
