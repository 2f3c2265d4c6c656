"""Links laid again: as the planner lays them, clear of the part, and to begin passes where it is cheaper."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from by_degrees import optimise

from fiveaxis.contour import Plan, plan_contour, plan_passes
from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.job import make_job, run_job
from fiveaxis.mesh import Surface, TriangleTree
from fiveaxis.posture.starts.rings import Layout, known_rings, reopen
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.passes import PassEnd

BALL = Tool.ball(6)


def cup() -> trimesh.Trimesh:
    """A round cup with two conical islands."""
    wall = np.array([[0, 0], [38, 0], [38, 18], [34, 18], [28, 4], [0, 4]], dtype=float)
    bodies = [trimesh.creation.revolve(wall, sections=48)]
    for x, y in ((13.0, 3.0), (-11.0, 9.0)):
        island = trimesh.creation.revolve(np.array([[0, 3], [7, 3], [4, 16], [0, 16.0]]), sections=32)
        bodies.append(island.apply_translation([x, y, 0.0]))
    return trimesh.util.concatenate(bodies)


@pytest.fixture(scope="module")
def part() -> trimesh.Trimesh:
    return cup()


def planned(part: trimesh.Trimesh, **options) -> Plan:
    return plan_passes(part, BALL, stepdown=6.0, spacing=2.0, **options)


def end(plan: Plan, row: int, inner: int) -> PassEnd:
    path = plan.toolpath
    return PassEnd(path.pivot[row], path.normal[row], path.pivot[row] - path.pivot[inner])


def ends(plan: Plan) -> list[tuple[PassEnd | None, PassEnd | None]]:
    """Ends of every link."""
    leaving = [end(plan, row, row - 1) for row in plan.passes.last.tolist()]
    arriving = [end(plan, row, row + 1) for row in plan.passes.first.tolist()]
    return list(zip([None, *leaving], [*arriving, None], strict=True))


def test_a_plan_is_the_path_of_plan_contour(part):
    plan = planned(part)
    path = plan_contour(part, BALL, stepdown=6.0, spacing=2.0)
    np.testing.assert_array_equal(plan.toolpath.pivot, path.pivot)
    assert plan.passes.locations == len(path)


def test_passes_of_a_plan_are_what_lies_between_its_links(part):
    plan = planned(part)
    inside = np.zeros(len(plan.toolpath), dtype=bool)
    for first, last in zip(plan.passes.first, plan.passes.last, strict=True):
        inside[first : last + 1] = True
    np.testing.assert_array_equal(plan.toolpath.cutting, inside)


@pytest.mark.parametrize("lead", [0.0, 1.5])
def test_links_laid_again_between_the_same_ends_are_those_of_the_plan(part, lead):
    plan = planned(part, lead_in=lead, lead_out=lead)
    pivot = plan.toolpath.pivot
    firsts, lasts = [*plan.passes.first, len(pivot)], [-1, *plan.passes.last]
    for (leaving, arriving), begin, after in zip(ends(plan), lasts, firsts, strict=True):
        way = plan.passes.relink(leaving, arriving)
        np.testing.assert_allclose(way, pivot[begin + 1 : after], atol=1e-9)


@pytest.mark.parametrize("lead", [0.0, 1.5])
def test_a_path_begun_elsewhere_keeps_the_ball_out_of_the_part(part, lead):
    plan = planned(part, lead_in=lead, lead_out=lead)
    path = plan.toolpath
    layout = Layout(path, known_rings(path, plan.passes), plan.passes.relink)
    random = np.random.default_rng(3)
    openings = []
    for k, ring in enumerate(layout.rings):
        choice = ring.openings(path.cutting, most=12, both=True)
        ways = [
            c
            for c in choice
            if layout.link_pivots((k, c), None) is not None
            and layout.link_pivots((k - 1, openings[-1]) if k else None, (k, c)) is not None
        ]
        openings.append(ways[int(random.integers(len(ways)))])
    moved = reopen(layout, openings).toolpath
    assert (moved.pivot[plan.passes.first[0]] != path.pivot[plan.passes.first[0]]).any()
    surface = Surface.from_mesh(part)
    space = BallSpace(TriangleTree.build(surface.triangles), BALL.radius)
    assert space.fits(moved.pivot).all()
    assert space.chords_fit(moved.pivot[:-1], moved.pivot[1:]).all()


def test_where_arcs_were_asked_for_a_start_without_room_for_one_has_no_link(part):
    plan = planned(part, lead_in=1.5)
    wedged = end(plan, plan.passes.first[0], plan.passes.first[0] + 1)
    into = PassEnd(wedged.pivot, wedged.normal, np.zeros(3))
    assert plan.passes.relink(None, into) is None
    assert plan.passes.relink(None, wedged) is not None


@pytest.mark.slow
def test_islands_in_a_cup_cost_less_with_a_free_start(part, hayashi):
    plan = planned(part)
    options = {"tilt": (10, 80), "effort": "quick"}
    bound = optimise(plan.toolpath, hayashi, **options)
    free = optimise(plan.toolpath, hayashi, **options, free_start=True, passes=plan.passes)
    assert free.energy.total < bound.energy.total
    assert free.residuals()["tilt"] <= 1e-9
    [told] = [f.message for f in free.toolpath.findings if f.code == "free-start"]
    assert f"of {len(plan.passes.first)} closed passes begin elsewhere, which saves" in told


def test_a_job_on_a_mesh_lays_links_anew(part, tmp_path):
    part.export(tmp_path / "cup.stl")
    job = make_job(
        input=tmp_path / "cup.stl",
        machine="hayashi-640123",
        tool="ball:6",
        tilt=(10.0, 80.0),
        effort="quick",
        plan={"stepdown": 12.0, "spacing": 3.0},
        free_start=True,
        free_direction=True,
    )
    [told] = [f.message for f in run_job(job).solution.toolpath.findings if f.code == "free-start"]
    assert "run backwards, which saves" in told
