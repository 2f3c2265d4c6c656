"""The table and the spindle nose that are assumed, and how high the part has to stand."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.base.findings import Severity
from fiveaxis.check import Clearances, Fixture, PathConstraints, Report, Surroundings, Tolerances
from fiveaxis.check.collision.assumed import NOSE, TABLE, AssumedTable, with_nose
from fiveaxis.check.collision.scene import build_scene
from fiveaxis.check.verification.check_context import CheckContext, make_context
from fiveaxis.check.verification.report import make_report
from fiveaxis.check.verification.standing import check_table
from fiveaxis.model import (
    Body,
    Box,
    Cylinder,
    Limits,
    Machine,
    Motion,
    Tool,
    Toolpath,
    linear_positions,
    tool_poses,
)
from fiveaxis.model.toolpath.tool import Holder, Section

TOOL = Tool.ball(8, shank_diameter=8.0, holder=Holder(60.0, (Section(40.0, 32.0),)))
PART = trimesh.creation.box(bounds=[[-20.0, -20.0, 5.0], [20.0, 20.0, 30.0]])
LOWEST = 5.0
DESCRIBED = Body("C", Cylinder(150.0, 40.0, (0.0, 0.0, -20.0)))


@pytest.fixture(scope="module")
def mill() -> Machine:
    machine = Machine.from_code("640123")
    axes = tuple(replace(a, limits=Limits(-200.0, 200.0)) if a.letter in "XY" else a for a in machine.axes)
    return replace(machine, axes=axes).with_tool_length(110.0)


def leaning(machine: Machine, tips, degrees, tool: Tool = TOOL) -> CheckContext:
    """A motion through tips, the tool leaning in the plane of x and z."""
    tips, lean = np.asarray(tips, dtype=float), np.radians(degrees)
    axis = np.column_stack([np.sin(lean), np.zeros(len(lean)), np.cos(lean)])
    rotary = np.column_stack([np.full(len(lean), np.pi / 2.0), -lean])
    positions = linear_positions(machine, tips, rotary)
    found, reached = tool_poses(machine, positions)
    assert np.allclose(found, tips)
    assert np.allclose(np.abs(reached), np.abs(axis), atol=1e-9)
    path = Toolpath.from_tips(found, reached, tool)
    motion = Motion(machine.letters, positions, path.feed, np.ones(len(tips)), path.kind, path.source)
    return make_context(motion, machine, path, PathConstraints(), Tolerances())


def report(context: CheckContext, **around) -> Report:
    return make_report(check_table(context, Surroundings(part=PART, **around)), context.toolpath, ())


def lowest(context: CheckContext, outline: np.ndarray) -> float:
    """The lowest point of a revolved outline in moves with all axes linear in time, by sampled points."""
    rows = np.linspace(0.0, len(context.positions) - 1.0, 40 * len(context.positions))
    every = np.arange(len(context.positions))
    positions = np.column_stack([np.interp(rows, every, column) for column in context.positions.T])
    tip, axis = tool_poses(context.machine, positions)
    across = np.cross(axis, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    beside = np.cross(axis, across)
    found = np.inf
    for radius, height in outline:
        for turn in np.linspace(0.0, 2.0 * np.pi, 720):
            rim = radius * (np.cos(turn) * across + np.sin(turn) * beside)
            found = min(found, float((tip + height * axis + rim)[:, 2].min()))
    return found


def test_the_needed_height_is_that_of_sampled_points(mill):
    context = leaning(mill, [[30.0, 0.0, 12.0], [25.0, 5.0, 10.0], [30.0, 10.0, 16.0]], [70.0, 85.0, 92.0])
    clearances = Clearances()
    nose = np.array([[44.441, 110.0], [44.441, 110.0 + 88.882]])
    outlines = {"machine": nose} | {part.name: part.outline for part in TOOL.parts()}
    wanted = max(
        clearances.by_kind[kind] + LOWEST - lowest(context, outline) for kind, outline in outlines.items()
    )
    assert wanted > 20.0
    standing = report(context).standing
    assert standing is not None
    assert standing.needed == standing.height == np.ceil(wanted)
    assert not standing.stated


@settings(max_examples=12, deadline=None)
@given(z=st.floats(6.0, 40.0), first=st.floats(20.0, 95.0), second=st.floats(20.0, 95.0))
def test_a_table_at_the_needed_height_is_clear_and_one_a_millimetre_higher_is_not(mill, z, first, second):
    context = leaning(mill, [[30.0, 0.0, z], [30.0, 5.0, z]], [first, second])
    found = report(context)
    assert found.counts == {}
    needed = found.standing.needed
    assert report(context, above_table=needed).counts == {}
    if needed:
        # Rounding up takes less than 1 mm, and the bound between rows at most 0.05.
        assert report(context, above_table=max(needed - 1.06, 0.0)).counts != {}


def test_only_a_height_that_nobody_stated_is_a_risk(mill):
    low = leaning(mill, [[30.0, 0.0, 6.0], [30.0, 5.0, 6.0]], [90.0, 90.0])
    (risk,) = report(low).risks
    needed = report(low).standing.needed
    assert f"height over the table, at least {needed:g} mm:" in risk.sentence
    assert risk.add.startswith("above_table")
    stated = report(low, above_table=needed)
    assert stated.risks == ()
    assert str(stated.standing) == f"its lowest point {needed:g} mm above the table"
    upright = leaning(mill, [[30.0, 0.0, 6.0], [30.0, 5.0, 6.0]], [0.0, 0.0])
    assert report(upright).risks == ()
    assert report(upright).standing.height == 0.0


def test_a_table_that_is_touched_is_an_error_that_says_how_high_the_part_has_to_stand(mill):
    context = leaning(mill, [[30.0, 0.0, 6.0], [30.0, 5.0, 6.0]], [90.0, 90.0])
    found = report(context, above_table=0.0)
    assert not found.ok
    assert {"machine-collision", "holder-collision"} <= set(found.counts)
    assert all(f.remedy.startswith("raise the part") for f in found.findings if f.severity is Severity.ERROR)
    assert f"to {found.standing.needed:g} mm at least" in found.findings[0].message


def test_beside_the_table_the_tool_may_go_down(mill):
    far = leaning(mill, [[600.0, 0.0, -80.0], [600.0, 5.0, -80.0]], [0.0, 0.0])
    assert report(far).standing.needed == 0.0
    assert report(far, above_table=0.0).counts == {}
    # From one side to the other, it passes over the table between two rows.
    across = leaning(mill, [[-600.0, 0.0, -10.0], [600.0, 0.0, -10.0]], [0.0, 0.0])
    assert report(across).standing.needed == 16.0


@pytest.mark.parametrize("height", [0.0, 20.0, 60.0])
def test_a_part_that_is_moved_with_its_table_has_the_same_verdict(mill, height):
    def verdict(machine: Machine) -> Report:
        return report(
            leaning(machine, [[30.0, 0.0, 6.0], [30.0, 5.0, 9.0]], [80.0, 93.0]), above_table=height
        )

    here, there = verdict(mill), verdict(mill.with_setup((0.0, 0.0, 37.0)))
    assert here.counts == there.counts
    assert here.standing.needed == there.standing.needed
    assert [f.message for f in here.findings] == [f.message for f in there.findings]


def test_bodies_of_the_machine_replace_what_is_assumed(mill):
    context = leaning(mill, [[30.0, 0.0, 6.0]], [90.0])
    described = replace(mill, bodies=(DESCRIBED,))
    assert check_table(replace(context, machine=described), Surroundings(part=PART)) == ()
    assert [body.assumed for body in with_nose(described, TOOL).bodies] == ["", NOSE]
    head = replace(mill, bodies=(Body("Z", Box((50.0, 50.0, 50.0), (0.0, 0.0, 200.0))),))
    assert with_nose(head, TOOL) is head
    assert AssumedTable.of(head, Surroundings(part=PART), np.empty((0, 3))) is not None


def test_the_nose_begins_at_the_gauge_point_or_at_the_holders_upper_end(mill):
    for machine, begin in ((mill, 110.0), (Machine.from_code("640123"), 100.0)):
        (nose,) = with_nose(machine, TOOL).bodies
        tip = machine.chain.tool_home[2, 3]
        assert nose.shape.center[2] - tip == pytest.approx(begin + 44.441)
    wide = replace(TOOL, holder=Holder(60.0, (Section(40.0, 120.0),)))
    assert with_nose(mill, wide).bodies[0].shape.radius == 60.0
    unknown = build_scene(Machine.from_code("640123"), Tool.ball(8), Surroundings())
    assert any(
        gap.is_risk and gap.sentence.startswith("shank, holder and spindle nose")
        for gap in unknown.not_checked
    )


def test_what_stands_on_the_table_is_part_stock_and_fixtures(mill):
    vice = Fixture("vice", Box((60.0, 60.0, 30.0), (0.0, 0.0, -10.0)))
    on_vice = AssumedTable.of(mill, Surroundings(part=PART, fixtures=(vice,)), np.empty((0, 3)))
    assert on_vice.middle[2] == pytest.approx(-25.0)
    assert on_vice.body(10.0).assumed == TABLE
    bare = AssumedTable.of(mill, Surroundings(), np.array([[1.0, 2.0, 7.0], [3.0, 2.0, np.nan]]))
    assert bare.middle == pytest.approx((1.0, 2.0, 7.0))
    assert bare.radius == 200.0
    assert AssumedTable.of(mill, Surroundings(), np.empty((0, 3))) is None
