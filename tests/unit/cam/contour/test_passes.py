"""Contacts that no pass reaches are a finding with their number, the highest one and the reason."""

import re

import numpy as np
import pytest
import trimesh

from fiveaxis.base.errors import Infeasible
from fiveaxis.base.findings import Severity
from fiveaxis.cam import TriangleTree, plan_contour, tree_of
from fiveaxis.cam.contour.ball_space import GOUGE, BallSpace
from fiveaxis.cam.contour.contacts import Contacts, Sampling, sample_loop
from fiveaxis.cam.contour.options import PlanOptions
from fiveaxis.cam.contour.passes import split_passes
from fiveaxis.cam.contour.sections import section_loops
from fiveaxis.cam.mesh.surface import Surface
from fiveaxis.model import Tool


def extruded(outline: list[tuple[float, float]], height: float = 60.0) -> trimesh.Trimesh:
    """A star-shaped outline, anticlockwise about the origin, as a prism about z = 0."""
    ring = np.array(outline)
    n = len(ring)
    k, after = np.arange(n), (np.arange(n) + 1) % n
    low, high = np.c_[ring, np.full(n, -height / 2)], np.c_[ring, np.full(n, height / 2)]
    faces = [np.c_[k, after, after + n], np.c_[k, after + n, k + n]]
    faces += [np.c_[after, k, np.full(n, 2 * n)], np.c_[k + n, after + n, np.full(n, 2 * n + 1)]]
    vertices = np.vstack([low, high, [[0.0, 0.0, -height / 2], [0.0, 0.0, height / 2]]])
    return trimesh.Trimesh(vertices, np.vstack(faces), process=False)


def notched_square() -> trimesh.Trimesh:
    """A square of 40 mm with one inner corner of 90 degrees cut into its edge."""
    return extruded([(20, -20), (20, 0), (20, 20), (8, 20), (0, 12), (-8, 20), (-20, 20), (-20, -20)])


def passes_of(mesh: trimesh.Trimesh, radius: float, *, spacing: float = 0.5, overhang: bool = False):
    surface = Surface.from_mesh(mesh)
    space = BallSpace(TriangleTree.build(surface.triangles), radius)
    (loop,) = section_loops(surface, 0.1)
    contacts = sample_loop(loop, surface, Sampling(radius, spacing))
    return *split_passes(contacts, space, PlanOptions(overhang=overhang, spacing=spacing)), space


def test_an_inner_corner_that_the_ball_can_not_reach_splits_the_pass():
    passes, left_out, space = passes_of(notched_square(), radius=3.0)
    assert len(passes) == 1
    (only,) = passes
    assert not only.closed
    # A ball of radius R in a corner of 90 degrees touches its walls R away from the corner.
    from_corner = np.linalg.norm(only.points[:, :2] - [0.0, 12.0], axis=1)
    assert 2.9 < from_corner.min() < 3.6
    assert space.fits(only.centres).all()
    assert left_out.counts["contacts where the ball would gouge"] >= 10


def test_a_convex_part_is_one_closed_pass():
    passes, left_out, _ = passes_of(extruded([(10, -10), (10, 10), (-10, 10), (-10, -10)]), radius=3.0)
    assert [p.closed for p in passes] == [True]
    assert not +left_out.counts
    assert not left_out.unreached


def test_facets_of_a_fillet_wider_than_the_ball_do_not_tear_a_pass_apart():
    angle = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    radius = 20.0 + 2.0 * np.cos(3.0 * angle)
    lobed = extruded(list(zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)))
    passes, _, space = passes_of(lobed, radius=3.0)
    assert [p.closed for p in passes] == [True]
    assert space.fits(passes[0].centres).all()


def test_a_pass_starts_and_ends_with_contacts_not_with_rolling():
    passes, _, _ = passes_of(notched_square(), radius=9.0)
    assert passes
    for found in passes:
        assert not found.rolling[[0, -1]].any()


def test_a_closed_pass_comes_back_to_where_it_was_opened():
    (closed,), _, _ = passes_of(extruded([(10, -10), (10, 10), (-10, 10), (-10, -10)]), radius=3.0)
    start = int(closed.starts()[7])
    opened = closed.started_at(start)
    np.testing.assert_array_equal(opened.centres[[0, -1]], closed.centres[[start, start]])
    assert len(opened.centres) == len(closed.centres) + 1


def test_floors_are_no_walls():
    normals = np.tile([0.05, 0.0, 1.0], (5, 1)) / np.hypot(0.05, 1.0)
    flat = Contacts(
        np.c_[np.arange(5.0), np.zeros((5, 2))], normals, normals, np.zeros(5, dtype=bool), closed=False
    )
    far = BallSpace(TriangleTree.build(np.full((1, 3, 3), 100.0)), 1.0)
    assert split_passes(flat, far, PlanOptions(spacing=1.0))[0] == []


@pytest.mark.parametrize(("lean", "selected"), [(0.1, False), (0.0, False), (-0.005, False), (-0.1, True)])
def test_overhang_selects_normals_that_point_downward(lean, selected):
    normals = np.tile([np.sqrt(1.0 - lean**2), 0.0, lean], (5, 1))
    wall = Contacts(
        np.c_[np.arange(5.0), np.zeros((5, 2))], normals, normals, np.zeros(5, dtype=bool), closed=False
    )
    far = BallSpace(TriangleTree.build(np.full((1, 3, 3), 100.0)), 1.0)
    assert bool(split_passes(wall, far, PlanOptions(overhang=True, spacing=1.0))[0]) == selected


def tube(inside: float, outside: float) -> trimesh.Trimesh:
    return trimesh.creation.annulus(r_min=inside, r_max=outside, height=8.0, sections=64)


def test_a_plan_that_reaches_every_contact_has_no_finding():
    assert plan_contour(tube(3.0, 15.0), Tool.ball(4), stepdown=2.0).findings == ()


def test_contacts_in_a_hole_narrower_than_the_ball_are_a_warning_with_the_room_there():
    path = plan_contour(tube(3.0, 15.0), Tool.ball(8), stepdown=2.0)
    (found,) = path.findings
    assert (found.severity, found.code) == (Severity.WARNING, "contacts-left-out")
    lost, of = map(int, re.search(r"reaches (\d+) of (\d+)", found.message).groups())
    assert lost == path.ignored["contacts where the ball would gouge"] == found.value
    assert of == lost + int(path.cutting.sum())
    assert "the highest at X3 Y0 Z3: " in found.message
    # The hole's diameter.
    assert "half of them have room for a ball of at most 6 mm" in found.message


def test_more_than_half_of_the_contacts_left_out_are_an_error():
    tubes = [tube(1.5, 4.0) for _ in range(3)]
    for number, one in enumerate(tubes):
        one.apply_translation([10.0 * number, 0.0, 0.0])
    path = plan_contour(trimesh.util.concatenate(tubes), Tool.ball(8), stepdown=2.0)
    (found,) = path.findings
    assert (found.severity, found.code) == (Severity.ERROR, "contacts-left-out")
    assert found.value > int(path.cutting.sum())


def test_a_part_that_the_ball_reaches_nowhere_is_infeasible_and_says_where():
    wide = tube(3.0, 200.0)
    pocket = wide.submesh([np.linalg.norm(wide.triangles_center[:, :2], axis=1) < 190.0], append=True)
    with pytest.raises(Infeasible, match=r"no wall can be cut with ball:20 .*ball would gouge") as caught:
        plan_contour(pocket, Tool.ball(20), allow_open=True)
    (found,) = caught.value.findings
    assert caught.value.exit_code == 3
    assert (found.severity, found.code) == (Severity.ERROR, "contacts-left-out")


def test_the_room_in_a_corner_is_that_of_the_ball_in_it():
    # Two planes at right angles: a ball that touches one of them s from the edge has the radius s.
    corner = trimesh.Trimesh(
        [[0, -50, 0], [50, -50, 0], [50, 50, 0], [0, 50, 0], [0, -50, 50], [0, 50, 50]],
        [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4]],
    )
    away = np.array([0.5, 2.0, 7.0, 30.0])
    points = np.c_[away, 0.0 * away, 0.0 * away]
    room = BallSpace(tree_of(corner), 10.0).rooms(points, np.tile([0.0, 0.0, 1.0], (4, 1)))
    np.testing.assert_allclose(room, [0.5, 2.0, 7.0, 10.0], atol=GOUGE)
