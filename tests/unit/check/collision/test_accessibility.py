"""The mask that keeps the tool clear of the workpiece side. The bodies that the optimiser's mask tests."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.sampled_surfaces import without_nose

import fiveaxis as fx
from fiveaxis.base import angle_between
from fiveaxis.check import Clearances, Fixture, Surroundings
from fiveaxis.check.collision.accessibility import (
    Accessibility,
    cell_centres,
    cells_of,
    find_accessible,
    head_solids,
    shape_triangles,
)
from fiveaxis.check.collision.obstacles import Obstacle, tool_solids
from fiveaxis.model import Body, Box, Cylinder, axis_positions, tool_axes
from fiveaxis.model.toolpath import shapes
from fiveaxis.model.toolpath.tool import CUTTER, HOLDER, SHANK, Holder, Section

# Half of the widest cell of the map of directions, deg.
HALF_CELL = 3.8
HOLDER_RADIUS, STICK_OUT, AWAY = 20.0, 40.0, 30.0


@pytest.fixture(scope="module")
def tool():
    return fx.Tool.ball(
        8.0, shank_diameter=8.0, holder=Holder(STICK_OUT, (Section(50.0, 2 * HOLDER_RADIUS),))
    )


@pytest.fixture(scope="module")
def beside_a_wall(tool):
    """A floor of three locations with a high wall at x = 30."""
    contact = np.array([[0.0, -5.0, 0.0], [0.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (3, 1)), tool=tool, feed_mm_min=1000.0)
    wall = np.array([[[AWAY, -900.0, -900.0], [AWAY, 900.0, -900.0], [AWAY, 0.0, 900.0]]])
    obstacle = Obstacle.build("part", wall, tool_solids(tool))
    return Accessibility(path, fx.load_machine("hayashi-640123"), [obstacle])


def _leaning(degrees):
    lean = np.radians(degrees)
    return np.column_stack([np.sin(lean), np.zeros_like(lean), np.cos(lean)])


def test_every_direction_lies_near_the_middle_of_its_cell():
    draw = np.random.default_rng(0).normal(size=(20_000, 3))
    cells = cells_of(draw, 64)
    off = np.degrees(angle_between(cell_centres(cells, 64), draw))
    assert off.max() < HALF_CELL
    assert (cells_of(cell_centres(np.arange(64 * 64), 64), 64) == np.arange(64 * 64)).all()


def test_a_direction_that_nothing_gives_has_a_cell_of_the_map():
    assert 0 <= cells_of(np.full((1, 3), np.nan), 64)[0] < 64 * 64


def test_a_tool_is_split_into_cutter_shank_and_holder(tool):
    solids = {solid.name: solid for solid in tool_solids(tool)}
    assert list(solids) == [CUTTER, SHANK, HOLDER]
    assert solids[SHANK].frusta == pytest.approx(np.array([[4.0, 4.0, STICK_OUT, 4.0]]))
    assert solids[HOLDER].frusta.tolist() == [[STICK_OUT, HOLDER_RADIUS, STICK_OUT + 50.0, HOLDER_RADIUS]]
    assert [s.name for s in tool_solids(fx.Tool.ball(8.0))] == [CUTTER]


def test_a_shrunk_cutter_loses_the_tolerance_all_round(tool):
    cutter = tool_solids(tool)[0].grown(-0.01)
    z0, r0, z1, r1 = cutter.frusta.T
    heights, radii = np.append(z0, z1), np.append(r0, r1)
    from_centre = np.hypot(heights - 4.0, radii)
    # Chords of the sampled ball lie inside of it by up to 4 (1 − cos 2.5 deg).
    assert from_centre.max() <= 4.0 - 0.01 + 1e-4
    assert from_centre.min() >= 4.0 - 0.01 - 4.0 * (1.0 - np.cos(np.radians(2.5))) - 1e-3


def test_the_edge_of_the_accessible_set_is_where_the_holder_touches_the_wall(beside_a_wall):
    # About the ball's centre, 4 above the floor: the holder's upper edge is 86 up the axis and 20 beside it.
    up = STICK_OUT + 50.0 - 4.0
    edge = np.degrees(np.arcsin(AWAY / np.hypot(up, HOLDER_RADIUS)) - np.arctan2(HOLDER_RADIUS, up))
    lean = np.arange(0.0, 40.0, 0.02)
    clear = beside_a_wall.clear(np.ones(len(lean), dtype=np.int64), _leaning(lean))
    assert clear[lean < edge - 0.1].all()
    assert not clear[lean > edge + 0.1].any()


def test_both_branches_of_a_posture_get_one_answer(beside_a_wall):
    axis = _leaning(np.linspace(5.0, 60.0, 23))
    rows = np.ones(23, dtype=np.int64)
    machine, path = beside_a_wall.machine, beside_a_wall.toolpath
    both = axis_positions(machine, path.at(rows).tips(axis), axis)[:, :, machine.rotary_columns]
    answers = [beside_a_wall(rows, branch) for branch in both]
    assert np.array_equal(answers[0], answers[1])
    assert np.array_equal(answers[0], beside_a_wall.clear(rows, axis))


def test_the_rough_map_is_off_by_at_most_a_cell_and_tests_each_cell_once(beside_a_wall):
    draw = np.random.default_rng(5)
    rows = draw.integers(0, 3, 4000)
    rotary = np.column_stack([draw.uniform(-np.pi, np.pi, 4000), draw.uniform(-1.5, 0.0, 4000)])
    rough, exact = beside_a_wall.rough(rows, rotary), beside_a_wall(rows, rotary)
    axis = tool_axes(beside_a_wall.machine, rotary)
    turned = [axis + 0.09 * draw.normal(size=(4000, 3)) for _ in range(20)]
    turned = [t / np.linalg.norm(t, axis=1)[:, None] for t in turned]
    around = np.array([beside_a_wall.clear(rows, t) for t in turned])
    steady = (around == exact).all(axis=0)
    assert steady.mean() > 0.3
    assert np.array_equal(rough[steady], exact[steady])
    before = beside_a_wall.tested
    assert np.array_equal(beside_a_wall.rough(rows[::-1], rotary[::-1]), rough[::-1])
    assert beside_a_wall.tested == before


def test_answers_depend_on_the_query_alone(beside_a_wall):
    draw = np.random.default_rng(6)
    rows = draw.integers(0, 3, 500)
    rotary = np.column_stack([draw.uniform(-np.pi, np.pi, 500), draw.uniform(-1.5, 0.0, 500)])
    fresh = Accessibility(beside_a_wall.toolpath, beside_a_wall.machine, beside_a_wall.obstacles)
    one_by_one = [bool(fresh.rough(rows[i : i + 1], rotary[i : i + 1])[0]) for i in range(499, -1, -1)][::-1]
    assert one_by_one == beside_a_wall.rough(rows, rotary).tolist()


@pytest.fixture(scope="module")
def machine():
    return fx.load_machine("hayashi-640123")


@pytest.fixture(scope="module")
def path():
    """One location on top of a floor at z = 0."""
    tool = fx.Tool.ball(8.0, shank_diameter=8.0, holder=Holder(40.0, (Section(50.0, 40.0),)))
    return fx.Toolpath.from_contacts([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], tool=tool, feed_mm_min=1000.0)


def _axes(degrees):
    lean = np.radians(degrees)
    return np.column_stack([np.sin(lean), np.zeros_like(lean), np.cos(lean)])


def _first_refused(mask, degrees):
    clear = mask.clear(np.zeros(len(degrees), dtype=np.int64), _axes(degrees))
    return degrees[int(np.argmin(clear))] if not clear.all() else None


def test_a_clamp_bounds_the_lean_at_the_angle_where_the_holder_comes_too_near(path, machine):
    machine = without_nose(machine)
    clamp = Fixture("clamp", Box((10.0, 400.0, 200.0), (55.0, 0.0, 0.0)))  # from x = 50 on, up to z = 100
    lean = np.arange(0.0, 60.0, 0.05)
    for clearance in (0.0, 3.0):
        around = Surroundings(fixtures=(clamp,), clearances=Clearances(0.0, clearance, 0.0, 0.0))
        mask = find_accessible(path, machine, around)
        # The holder's upper edge, 86 up the axis from the ball's centre: 20 beside it, more with a clearance.
        # It is at a height below the clamp's upper edge there.
        low, high = 0.0, 60.0
        up, beside = 86.0 + clearance, 20.0 + clearance
        edge = np.degrees(np.arcsin(50.0 / np.hypot(up, beside)) - np.arctan2(beside, up))
        assert low < edge < high
        assert 4.0 + up * np.cos(np.radians(edge)) - beside * np.sin(np.radians(edge)) < 100.0
        assert _first_refused(mask, lean) == pytest.approx(edge, abs=0.1)


def test_a_bare_ball_needs_no_mask(machine):
    path = fx.Toolpath.from_contacts(
        [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], tool=fx.Tool.ball(8.0), feed_mm_min=1000.0
    )
    part = trimesh.creation.box(extents=(100.0, 100.0, 20.0))
    assert find_accessible(path, machine, Surroundings(part=part)) is None
    assert find_accessible(path, machine, Surroundings()) is None


def test_a_shank_as_thick_as_its_ball_may_lie_almost_on_the_surface(path, machine):
    """It starts where the ball ends, so it can have no clearance where the ball touches."""
    part = trimesh.creation.box(extents=(1000.0, 1000.0, 20.0))
    part.apply_translation([0.0, 0.0, -10.0])
    long = replace(path.tool, holder=Holder(400.0, (Section(1.0, 8.0),)))
    mask = find_accessible(replace(path, tool=long), without_nose(machine), Surroundings(part=part))
    assert 84.0 < _first_refused(mask, np.arange(0.0, 90.5, 0.5)) < 90.0


@pytest.mark.parametrize("cutter", [shapes.flat(10.0, length=20.0), shapes.bull(10.0, 2.0, length=20.0)])
def test_a_cutter_may_touch_the_part_at_any_lean_but_not_enter(machine, cutter):
    part = trimesh.creation.box(extents=(200.0, 200.0, 20.0))
    rows, axes = np.zeros(3, dtype=np.int64), _axes(np.array([5.0, 30.0, 80.0]))
    path = fx.Toolpath.from_contacts([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], tool=fx.Tool(cutter))
    for top, is_clear in ((0.0, True), (0.02, False)):
        lifted = part.copy().apply_translation([0.0, 0.0, top - 10.0])
        mask = find_accessible(path, machine, Surroundings(part=lifted))
        assert mask.clear(rows, axes).tolist() == [is_clear] * 3


def test_an_end_mill_without_lengths_cuts_up_to_its_radius_and_has_a_shank_above():
    tool = fx.Tool.flat(10.0, holder=Holder(40.0, (Section(50.0, 40.0),)))
    assert [(solid.name, solid.frusta.tolist()) for solid in tool_solids(tool)] == [
        (CUTTER, [[0.0, 5.0, 5.0, 5.0]]),
        (SHANK, [[5.0, 5.0, 40.0, 5.0]]),
        (HOLDER, [[40.0, 20.0, 90.0, 20.0]]),
    ]


def test_a_ball_without_lengths_is_a_whole_ball():
    (ball,) = tool_solids(fx.Tool.ball(8.0))
    ends = np.concatenate([ball.frusta[:, :2], ball.frusta[:, 2:]])
    assert np.hypot(ends[:, 0] - 4.0, ends[:, 1]) == pytest.approx(4.0)
    assert ends[:, 0].max() == pytest.approx(8.0)


def test_a_cylinder_of_the_head_about_the_tool_axis_turns_with_the_tool(machine):
    tip = machine.chain.tool_home[:3, 3]
    nose = Body("Z", Cylinder(60.0, 20.0, (tip[0], tip[1], tip[2] + 150.0)))
    beside = Body("Z", Cylinder(60.0, 20.0, (tip[0] + 5.0, tip[1], tip[2] + 150.0)))
    found = list(head_solids(replace(machine, bodies=(nose, beside))))
    assert [solid.frusta.tolist() for solid in found] == [[[140.0, 60.0, 160.0, 60.0]]]


def test_the_tool_stays_clear_of_bodies_that_carry_the_workpiece(path, machine):
    table = Body("C", Box((400.0, 400.0, 10.0), (0.0, 0.0, -60.0)))
    around = Surroundings(clearances=Clearances(0.0, 0.0, 0.0, 0.0))
    mask = find_accessible(path, replace(machine, bodies=(table,)), around)
    # Hanging down: the holder goes through the table.
    assert not mask.clear(np.zeros(1, dtype=np.int64), np.array([[0.0, 0.0, -1.0]]))[0]
    assert mask.clear(np.zeros(1, dtype=np.int64), np.array([[0.0, 0.0, 1.0]]))[0]


def test_a_cylinder_is_covered_from_outside():
    triangles = shape_triangles(Cylinder(5.0, 8.0, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0)))
    middle = triangles.reshape(-1, 3).mean(axis=0)
    assert middle == pytest.approx([1.0, 2.0, 3.0])
    edges = (triangles + np.roll(triangles, 1, axis=1)) / 2.0 - [1.0, 2.0, 3.0]
    rim = np.abs(np.abs(edges[..., 0]) - 4.0) < 1e-9
    away = np.hypot(edges[..., 1], edges[..., 2])[rim]
    assert away[away > 4.9].min() >= 5.0 - 1e-9
