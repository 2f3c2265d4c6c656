import numpy as np
import pytest
import trimesh

from fiveaxis.base import angle_between
from fiveaxis.cam import TriangleTree, path_quality, plan_contour
from fiveaxis.model import Tool, Toolpath


def cone() -> trimesh.Trimesh:
    """A truncated cone, 12 mm radius at its foot, 6 mm at its top, 20 mm high."""
    ring = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    around = np.c_[np.cos(ring), np.sin(ring)]
    low, high = np.c_[12.0 * around, np.zeros(200)], np.c_[6.0 * around, np.full(200, 20.0)]
    k, after = np.arange(200), (np.arange(200) + 1) % 200
    faces = [np.c_[k, after, after + 200], np.c_[k, after + 200, k + 200]]
    faces += [np.c_[after, k, np.full(200, 400)], np.c_[k + 200, after + 200, np.full(200, 401)]]
    return trimesh.Trimesh(np.vstack([low, high, [[0, 0, 0], [0, 0, 20.0]]]), np.vstack(faces), process=False)


@pytest.fixture(scope="module")
def spiral() -> Toolpath:
    return plan_contour(cone(), Tool.ball(6), stepdown=1.0, spiral=True)


def test_a_cone_is_cut_in_one_go(spiral):
    cuts = np.flatnonzero(spiral.cutting)
    assert np.array_equal(cuts, np.arange(cuts[0], cuts[-1] + 1))
    assert spiral.ignored == {}


def test_contacts_of_a_spiral_lie_on_the_surface(spiral):
    contact = spiral.contact[spiral.cutting]
    assert TriangleTree.build(np.array(cone().triangles)).distances(contact).max() < 1e-9
    radius = 12.0 - 0.3 * contact[:, 2]
    np.testing.assert_allclose(np.linalg.norm(contact[:, :2], axis=1), radius, atol=0.003)


def test_normals_of_a_spiral_are_the_cones(spiral):
    contact, normal = spiral.contact[spiral.cutting], spiral.normal[spiral.cutting]
    radial = contact[:, :2] / np.linalg.norm(contact[:, :2], axis=1, keepdims=True)
    expected = np.c_[radial, np.full(len(radial), 0.3)] / np.hypot(1.0, 0.3)
    assert np.degrees(angle_between(normal, expected)).max() < 1.0


def test_a_spiral_descends_and_never_climbs(spiral):
    height = spiral.contact[spiral.cutting][:, 2]
    assert np.diff(height).max() < 1e-6
    assert height[0] == pytest.approx(19.5, abs=0.05)
    assert height[-1] == pytest.approx(0.5, abs=0.05)


def test_the_first_and_last_ring_of_a_spiral_are_whole(spiral):
    contact = spiral.contact[spiral.cutting]
    for level in (contact[0, 2], contact[-1, 2]):
        ring = contact[np.abs(contact[:, 2] - level) < 1e-9]
        turned = np.unwrap(np.arctan2(ring[:, 1], ring[:, 0]))
        assert abs(turned[-1] - turned[0]) == pytest.approx(2.0 * np.pi, abs=1e-6)


def test_a_spiral_keeps_the_spacing_and_never_gouges(spiral):
    gaps = np.linalg.norm(np.diff(spiral.contact[spiral.cutting], axis=0), axis=1)
    assert gaps.max() <= 0.5 + 1e-9
    tree = TriangleTree.build(np.array(cone().triangles))
    assert tree.distances(spiral.pivot).min() >= 3.0 - 0.01
    middles = (spiral.pivot[1:] + spiral.pivot[:-1]) / 2.0
    assert tree.distances(middles).min() >= 3.0 - 0.02


def test_turns_of_a_spiral_lie_as_near_to_each_other_as_rings(spiral):
    rings = plan_contour(cone(), Tool.ball(6), stepdown=1.0)
    limit = path_quality(rings, cone()).scallop_largest
    assert path_quality(spiral, cone()).scallop_largest <= 1.05 * limit


def test_a_spiral_rolls_about_the_corners_of_a_box():
    box = trimesh.creation.box(extents=[20.0, 16.0, 12.0])
    path = plan_contour(box, Tool.ball(6), stepdown=2.0, spiral=True)
    assert path.ignored == {}
    crossing = (path.pivot[:, 2] > 6.0).astype(int)
    assert np.abs(np.diff(crossing)).sum() == 2, "only the first approach and the last retreat"
    touching = path.normal[path.cutting]
    assert np.all(np.sort(np.abs(touching), axis=1) == [0.0, 0.0, 1.0])
    tree = TriangleTree.build(np.array(box.triangles))
    assert tree.distances(path.pivot).min() >= 3.0 - 0.01


def test_inner_and_outer_wall_of_a_tube_get_a_spiral_each():
    tube = trimesh.creation.annulus(r_min=10.0, r_max=15.0, height=6.0, sections=128)
    path = plan_contour(tube, Tool.ball(4), stepdown=1.0, spiral=True)
    starts = np.flatnonzero(np.diff(path.cutting.astype(int)) == 1) + 1
    radii = np.linalg.norm(path.contact[starts, :2], axis=1)
    assert sorted(radii) == pytest.approx([10.0, 15.0], abs=0.01)


def test_no_turn_leads_over_a_ledge():
    posts = [trimesh.creation.cylinder(radius=r, height=6.0, sections=128) for r in (10.0, 10.5)]
    posts[1].apply_translation([0.0, 0.0, -6.0])
    part = trimesh.util.concatenate(posts)
    path = plan_contour(part, Tool.ball(4), stepdown=1.0, spiral=True)
    starts = np.flatnonzero(np.diff(path.cutting.astype(int)) == 1) + 1
    assert np.linalg.norm(path.contact[starts, :2], axis=1) == pytest.approx([10.0, 10.5], abs=0.01)
    assert TriangleTree.build(np.array(part.triangles)).distances(path.pivot).min() >= 2.0 - 0.01


def test_rings_whose_sharp_edges_lean_stay_apart_and_are_counted():
    prism = trimesh.creation.box(extents=[20.0, 20.0, 20.0])
    prism.vertices[:, 0] += 0.8 * prism.vertices[:, 2]
    path = plan_contour(prism, Tool.ball(6), stepdown=2.0, spiral=True)
    rings = plan_contour(prism, Tool.ball(6), stepdown=2.0)
    assert path.ignored.get("closed passes that no spiral joins to the next", 0) > 0
    assert path.cutting.sum() == pytest.approx(rings.cutting.sum(), rel=0.1)
    assert TriangleTree.build(np.array(prism.triangles)).distances(path.pivot).min() >= 3.0 - 0.01
