"""The mask that keeps the tool clear of the workpiece side."""

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.collision.accessibility import Accessibility, cell_centres, cells_of
from fiveaxis.collision.obstacles import Obstacle
from fiveaxis.collision.solids import tool_solids
from fiveaxis.geometry import angle_between
from fiveaxis.kinematics import axis_positions, tool_axes
from fiveaxis.toolpath.tool import CUTTER, HOLDER, SHANK, Holder, Section

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
