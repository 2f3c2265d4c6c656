import numpy as np
import pytest
import trimesh

from fiveaxis.cam import TriangleTree
from fiveaxis.cam.contour.ball_space import BallSpace, Linker, PassEnd, quarter_arc
from fiveaxis.cam.contour.linking import open_passes
from fiveaxis.cam.contour.ordering import by_levels
from fiveaxis.cam.contour.passes import Pass

X, Y, Z = np.eye(3)


@pytest.fixture(scope="module")
def linker() -> Linker:
    """A table top of 60 × 60 × 4 mm, its underside at z = 0, over a ball of 3 mm radius."""
    table = trimesh.creation.box(extents=[60.0, 60.0, 4.0])
    table.apply_translation([0.0, 0.0, 2.0])
    space = BallSpace(TriangleTree.build(np.array(table.triangles)), 3.0)
    return Linker(space, table.bounds, clearance=5.0)


def straight(start: np.ndarray, end: np.ndarray, normal: np.ndarray, n: int = 9) -> Pass:
    points = np.linspace(start, end, n)
    normals = np.tile(normal, (n, 1))
    return Pass(points, normals, normals, np.zeros(n, dtype=bool), closed=False, radius=3.0)


def test_from_a_free_side_the_route_goes_straight_up(linker):
    route = linker.escape(np.array([33.0, 0.0, 2.0]), X)
    np.testing.assert_allclose(route, [[38.0, 0.0, 2.0], [38.0, 0.0, 12.0]])


def test_from_under_a_table_the_route_goes_out_along_the_normal_then_up(linker):
    normal = (X - Z) / np.sqrt(2.0)
    away, out, top = linker.escape(np.array([10.0, 0.0, -10.0]), normal)
    assert away[2] == out[2]
    assert out[0] >= 33.0 - 0.01
    assert out[1] == pytest.approx(0.0)
    np.testing.assert_allclose(top, [out[0], out[1], linker.plane])


def test_every_route_found_is_clear(linker):
    for heading in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
        normal = np.array([np.cos(heading), np.sin(heading), -1.0]) / np.sqrt(2.0)
        start = np.array([4.0, -7.0, -4.0])
        route = linker.escape(start, normal)
        assert linker.space.clear(start, *route)


def test_near_passes_are_joined_close_to_the_surface(linker):
    low, high = straight([30, -5, 1], [30, 5, 1], X), straight([30, 5, 3], [30, -5, 3], X)
    opened = open_passes(by_levels([[high], [low]]), linker)
    linked, left_out = opened.joined(), opened.left_out
    np.testing.assert_allclose(linked[1].approach, [[38.0, -5.0, 3.0], [38.0, -5.0, 1.0]])
    assert len(linked[0].retract) == 0
    assert linked[1].retract[-1, 2] == linker.plane
    assert not left_out.counts


def test_far_passes_are_joined_over_the_clearance_plane(linker):
    here, there = straight([30, -5, 2], [30, 5, 2], X), straight([-30, 5, 2], [-30, -5, 2], -X)
    opened = open_passes(by_levels([[here, there]]), linker)
    linked = opened.joined()
    heights = linked[1].approach[:, 2]
    np.testing.assert_allclose(heights, [2.0, linker.plane, linker.plane, 2.0])


def test_the_nearest_start_comes_next(linker):
    first = straight([30, -20, 2], [30, -10, 2], X)
    near, far = straight([30, -5, 2], [30, 5, 2], X), straight([30, 10, 2], [30, 20, 2], X)
    opened = open_passes(by_levels([[first], [far, near]]), linker)
    linked = opened.joined()
    assert [p.cut.points[0, 1] for p in linked] == [-20.0, -5.0, 10.0]


def test_an_open_pass_is_shortened_to_where_the_ball_gets_out():
    # Two parallel walls that close in: at the far end the ball touches both and can't leave along the normal.
    slot = trimesh.util.concatenate([trimesh.creation.box(extents=[60.0, 4.0, 20.0]) for _ in range(2)])
    slot.vertices[:8] += [0.0, -2.0, 0.0]
    slot.vertices[8:] += [0.0, 8.0, 0.0]
    slot.vertices[8:, 1] -= np.where(slot.vertices[8:, 0] > 0.0, 0.1, -4.0)
    space = BallSpace(TriangleTree.build(np.array(slot.triangles)), 3.0)
    linker = Linker(space, slot.bounds, clearance=5.0)
    wedged = straight([-25, 0, 5], [30, 0, 5], Y, n=56)
    opened = open_passes(by_levels([[wedged]]), linker)
    linked, left_out = opened.joined(), opened.left_out
    assert len(linked) == 1
    lost = len(wedged) - len(linked[0].cut)
    assert left_out.counts == left_out.unreached == {"contacts without a clear link": lost}
    assert lost > 0


def test_a_pass_without_a_route_out_is_left_out_and_counted():
    cage = trimesh.creation.box(extents=[30.0, 30.0, 30.0])
    linker = Linker(BallSpace(TriangleTree.build(np.array(cage.triangles)), 3.0), cage.bounds, clearance=5.0)
    opened = open_passes(by_levels([[straight([15, -5, 0], [15, 5, 0], -X)]]), linker)
    linked, left_out = opened.joined(), opened.left_out
    assert linked == []
    assert left_out.counts == {"passes without a clear link": 1}


def test_an_arc_leaves_along_the_feed_and_ends_along_the_normal():
    arc = quarter_arc(np.zeros(3), X, Y + 0.3 * X, 2.0)
    middle = 2.0 * X
    np.testing.assert_allclose(np.linalg.norm(arc - middle, axis=1), 2.0)
    np.testing.assert_allclose(arc[-1], [2.0, 2.0, 0.0], atol=1e-12)
    chords = np.vstack([np.zeros((1, 3)), arc])
    sag = 2.0 - np.linalg.norm((chords[1:] + chords[:-1]) / 2.0 - middle, axis=1)
    assert sag.max() <= 0.01 + 1e-12


def test_a_lead_takes_the_largest_arc_that_is_clear(linker):
    # 4 mm beside the contact, off the wall x = 30, a second wall blocks the full arc.
    assert len(linker.lead(PassEnd(np.array([33.0, 0.0, 2.0]), X, Y), 3.0).arc) >= 3
    wall = trimesh.creation.box(extents=[60.0, 60.0, 4.0])
    wall.apply_translation([0.0, 0.0, 2.0])
    stop = trimesh.creation.box(extents=[20.0, 4.0, 30.0])
    stop.apply_translation([40.0, 8.0, 0.0])
    both = trimesh.util.concatenate([wall, stop])
    near = Linker(BallSpace(TriangleTree.build(np.array(both.triangles)), 3.0), both.bounds, clearance=5.0)
    centre = np.array([33.0, 0.0, 2.0])
    lead = near.lead(PassEnd(centre, X, Y), 4.0)
    assert lead is not None
    assert lead.arc[-1] == pytest.approx(centre + 2.0 * X + 2.0 * Y)
    assert near.space.clear(centre, *lead.arc, *lead.route)


def test_leads_go_before_and_behind_a_pass(linker):
    only = straight([30, -5, 2], [30, 5, 2], X)
    opened = open_passes(by_levels([[only]]), linker, lead_in=2.0, lead_out=1.0)
    (linked,), left_out = opened.joined(), opened.left_out
    assert not left_out.counts
    np.testing.assert_allclose(linked.approach[-1][2], 2.0)
    assert linked.approach[-1][1] < -5.0
    assert any(np.allclose(p, [35.0, -7.0, 2.0]) for p in linked.approach)
    assert any(np.allclose(p, [34.0, 6.0, 2.0]) for p in linked.retract)
