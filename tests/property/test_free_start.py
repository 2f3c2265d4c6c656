"""Laws of closed passes that begin elsewhere: the cut stays the same, and links stay clear."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.contour import Plan, plan_passes
from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.mesh import Surface, TriangleTree
from fiveaxis.posture.starts.rings import Layout, Reopened, known_rings, reopen
from fiveaxis.toolpath import MoveKind, Tool, Toolpath

BALL = Tool.ball(5)


def part() -> trimesh.Trimesh:
    """A cone, a square post whose edges the ball rolls about, and a ridge that is open to the side."""
    cone = trimesh.creation.revolve(np.array([[0, 0], [9, 0], [5, 12], [0, 12.0]]), sections=24)
    post = trimesh.creation.box(extents=[10.0, 10.0, 12.0])
    return trimesh.util.concatenate(
        [cone.apply_translation([-14, 0, 0]), post.apply_translation([14, 2, 6.0])]
    )


@pytest.fixture(scope="module")
def plans() -> list[Plan]:
    shape = part()
    leads = [{}, {"lead_in": 1.0, "lead_out": 0.5}]
    return [plan_passes(shape, BALL, stepdown=4.0, spacing=2.0, **lead) for lead in leads]


@pytest.fixture(scope="module")
def space() -> BallSpace:
    return BallSpace(TriangleTree.build(Surface.from_mesh(part()).triangles), BALL.radius)


def steps_cut(path: Toolpath) -> Counter[frozenset[tuple[float, ...]]]:
    """Every step between touching locations, whichever way it is followed."""
    touching = np.isfinite(path.contact).all(axis=1)
    places = [tuple(row) for row in (np.round(path.pivot, 9) + 0.0).tolist()]
    return Counter(
        frozenset(places[row - 1 : row + 1]) for row in np.flatnonzero(touching[1:] & touching[:-1]) + 1
    )


def drawn(plan: Plan, data: st.DataObject) -> tuple[Layout, Reopened]:
    """Open a plan's rings anywhere that has links."""
    path = plan.toolpath
    layout = Layout(path, known_rings(path, plan.passes), plan.passes.relink)
    openings = []
    for k, ring in enumerate(layout.rings):
        choice = ring.openings(path.cutting, most=200, both=True)
        before = (k - 1, openings[-1]) if k else None
        there = [
            o
            for o in choice
            if layout.link_pivots(before, (k, o)) is not None and layout.link_pivots((k, o), None) is not None
        ]
        openings.append(data.draw(st.sampled_from(there)))
    return layout, reopen(layout, openings)


@settings(max_examples=8)
@given(data=st.data())
def test_every_step_is_cut_once_wherever_passes_begin(plans, data):
    plan = data.draw(st.sampled_from(plans))
    _, found = drawn(plan, data)
    assert steps_cut(found.toolpath) == steps_cut(plan.toolpath)


@settings(max_examples=8)
@given(data=st.data())
def test_rows_stay_consistent_and_links_clear(plans, space, data):
    plan = data.draw(st.sampled_from(plans))
    _, found = drawn(plan, data)
    path = found.toolpath
    touching = np.isfinite(path.contact).all(axis=1)
    np.testing.assert_array_equal(path.kind == MoveKind.CUT, touching)
    np.testing.assert_array_equal(np.isfinite(path.normal).all(axis=1), touching)
    np.testing.assert_allclose(
        path.pivot[touching], path.contact[touching] + BALL.radius * path.normal[touching], atol=1e-9
    )
    assert set(path.feed) == set(plan.toolpath.feed)
    assert path.source.tolist() == list(range(1, len(path) + 1))
    assert space.chords_fit(path.pivot[:-1], path.pivot[1:]).all()


@settings(max_examples=8)
@given(data=st.data())
def test_a_path_opened_twice_can_be_opened_as_it_was(plans, data):
    plan = data.draw(st.sampled_from(plans))
    layout, found = drawn(plan, data)
    again = Layout(found.toolpath, found.rings, layout.relink)
    back = []
    for old, ring in zip(layout.rings, found.rings, strict=True):
        start = layout.path.pivot[[old.first, old.first + 1]]
        choice = ring.openings(found.toolpath.cutting, most=10_000, both=True)
        [same] = {
            tuple(again.path.pivot[ring.rows(o)].ravel()): o
            for o in choice
            if np.array_equal(again.path.pivot[ring.rows(o)[:2]], start)
        }.values()
        back.append(same)
    np.testing.assert_allclose(reopen(again, back).toolpath.pivot, layout.path.pivot, atol=1e-9)
