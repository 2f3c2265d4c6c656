"""Lead-in and lead-out are checked like the motion, and avoid obstacles."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from support.sampled_surfaces import without_nose

from fiveaxis.base import Workpiece
from fiveaxis.base.errors import Unverified
from fiveaxis.check import Fixture, Gate, Report, Surroundings, choose_leads, verify
from fiveaxis.check.verification.approach import clear_from_anywhere, height_above
from fiveaxis.model import (
    Box,
    Interpolation,
    Limits,
    Motion,
    MoveKind,
    ProgramMotion,
    Tool,
    Toolpath,
    axis_positions,
    follow,
    load_machine,
)
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.nc import ProgramSettings, compose_program

UPRIGHT = np.zeros((9, 2))


def box(low, high) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def along_x(tool: Tool) -> Toolpath:
    tips = np.column_stack([np.linspace(-20.0, 20.0, 9), np.zeros((9, 2))])
    return Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (9, 1)), tool)


def ledge(*, over: tuple[float, float]) -> trimesh.Trimesh:
    """A ledge above a floor, over a range of y; the balls of these tests fit below it."""
    floor = box([-60, -40, -10], [60, 40, 0])
    return trimesh.util.concatenate([box([-60, over[0], 11], [60, over[1], 16]), floor])


@pytest.fixture
def lollipop() -> Tool:
    return Tool.lollipop(10.0, 4.0, shank_diameter=4.0, holder=Holder(60.0, (Section(30.0, 40.0),)))


@dataclass
class After:
    """A motion's leads with their report."""

    lead_in: np.ndarray
    lead_out: np.ndarray
    report: Report

    def __getattr__(self, name: str) -> Any:
        return getattr(self.report, name)


def program_of(motion, machine, after: After, settings: ProgramSettings | None = None):
    """The text of a motion with chosen leads."""
    planned = ProgramMotion.around(
        motion, machine, Interpolation.JOINT, lead_in=after.lead_in, lead_out=after.lead_out
    )
    return compose_program(planned, machine=machine, settings=settings, verdict=Gate.of(after.report).notes)


def verified(machine, path, part, rotary=UPRIGHT, **options):
    motion = follow(path, machine, rotary)
    report = verify(motion, machine, path, part=part)
    leads = choose_leads(motion, machine, path, surroundings=Surroundings.of(Workpiece(part=part)), **options)
    return motion, report, After(leads.lead_in, leads.lead_out, report.merge(leads.report))


def test_an_open_location_is_approached_along_the_tool_axis(hayashi, lollipop):
    _, before, after = verified(hayashi, along_x(lollipop), box([-60, -40, -10], [60, 40, 0]))
    assert after.ok == before.ok is True
    assert np.allclose(after.lead_in, [0.0, 0.0, 5.0, 0.0, 0.0])
    assert any(text.startswith("approach: a lead-in of 5 mm and Z down") for text in after.passed)
    assert any("rotary axes" in text for text in after.not_checked)


def test_under_a_ledge_the_tool_comes_from_the_side(hayashi, lollipop):
    motion, before, after = verified(hayashi, along_x(lollipop), ledge(over=(2.5, 40.0)))
    assert before.ok
    assert after.ok
    x, y, z, _, _ = after.lead_in
    assert y < 0.0 or x != 0.0
    assert z < 2.0
    program = program_of(motion, hayashi, after)
    begin = [line for line in program.lines if line.startswith("G0 ")]
    assert f"Y{motion.positions[0, 1] + y:.6f}" in begin[1]
    assert begin[2] == f"G0 Z{motion.positions[0, 2] + z:.6f}"


def test_without_a_clear_lead_in_no_program_is_written(hayashi, lollipop):
    machine = without_nose(hayashi)
    _, before, after = verified(machine, along_x(lollipop), box([-200, -200, 95], [200, 200, 99]))
    assert before.counts == {}
    assert after.counts == {"approach-blocked": 1}
    with pytest.raises(Unverified, match=r"approach-blocked \(1\)"):
        Gate.of(after.report).require_open()
    assert Gate.of(after.report, ["approach-blocked"]).is_open


def test_an_open_location_is_left_along_the_tool_axis(hayashi, lollipop):
    _, _, after = verified(hayashi, along_x(lollipop), box([-60, -40, -10], [60, 40, 0]))
    assert np.allclose(after.lead_out, [0.0, 0.0, 5.0, 0.0, 0.0])
    assert "retract: a lead-out of 5 mm, for gouges and collisions" in after.passed
    assert "the retract from the end of the lead-out: the program ends there" in after.not_checked


def test_from_under_a_ledge_the_tool_leaves_sideways_and_then_upwards(hayashi, lollipop):
    motion, before, after = verified(hayashi, along_x(lollipop), ledge(over=(2.5, 40.0)), retract=100.0)
    assert before.ok
    assert after.ok
    x, y, z, _, _ = after.lead_out
    # Past the ledge, its far end at 60 mm, or out from under its front at 2.5 mm.
    assert y < -2.5 or x > 40.0
    assert z > 0.5
    lines = program_of(motion, hayashi, after, ProgramSettings(retract=100.0)).lines
    out = next(i for i, line in enumerate(lines) if f"Y{motion.positions[-1, 1] + y:.6f} Z{z:.6f} F" in line)
    assert next(line for line in lines[out + 1 :] if line[:2] != "G9") == "G53 G0 Z100.000000"
    said = "retract: a lead-out of 5 mm and Z up from it to the end of its travel"
    assert any(said in sentence for sentence in after.report.passed)


@pytest.mark.parametrize(
    ("retract", "message"),
    [
        (40.0, None),
        (5.1, None),
        (4.0, "goes down from Z 5.000 mm, where the lead-out ends"),
        (-50.0, "goes down from Z 5.000"),
        (41.0, "is beyond its travel, -200 to 40"),
    ],
)
def test_a_retract_goes_up_and_stays_within_the_travel_of_z(hayashi, lollipop, retract, message):
    column = hayashi.column("Z")
    short = replace(hayashi.axes[column], limits=Limits(-200.0, 40.0))
    axes = tuple(short if i == column else axis for i, axis in enumerate(hayashi.axes))
    around = box([-60, -40, -10], [60, 40, 0])
    for machine, fault in ((replace(hayashi, axes=axes), message), (hayashi, None)):
        _, _, after = verified(machine, along_x(lollipop), around, retract=retract)
        found = [f.message for f in after.findings if f.code == "retreat-blocked"]
        assert len(found) == (fault is not None)
        assert fault is None or fault in found[0]


@pytest.mark.slow
def test_below_a_roof_there_is_no_clear_approach_and_no_clear_retract(hayashi, lollipop):
    # The shank passes a slot in the roof that is as long as the path.
    slotted = trimesh.util.concatenate(
        [
            box([-200, 3, 12], [200, 200, 16]),
            box([-200, -200, 12], [200, -3, 16]),
            box([-60, -40, -10], [60, 40, 0]),
        ]
    )
    _, before, after = verified(hayashi, along_x(lollipop), slotted, tcp=True)
    assert before.ok
    # Under TCP, too, Z comes down from above.
    assert after.counts == {"approach-blocked": 1}
    assert np.linalg.norm(after.lead_out) >= 1.0
    _, _, up = verified(hayashi, along_x(lollipop), slotted, tcp=True, retract=100.0)
    assert up.counts == {"approach-blocked": 1, "retreat-blocked": 1}
    found = next(f for f in up.findings if f.code == "retreat-blocked")
    assert found.place.location == 8
    assert not Gate.of(up.report).is_open


EXAMPLE = Path(__file__).parents[4] / "examples/overhang"


def test_at_the_retract_every_body_of_the_table_is_below_the_tool_wherever_the_other_axes_stand():
    """Measured with the forward kinematics, at random places, along the tool's axis: Z is at the tool."""
    machine = load_machine(EXAMPLE / "machine.toml").with_tool_length(85.0)
    tool, part = Tool.ball(8), box((-15, -15, 0), (15, 15, 40))
    room = height_above(machine, tool, Surroundings(part), 340.0)
    table = box((-60, -60, -20), (60, 60, 0))
    positions = np.random.default_rng(1).uniform(
        [-250, -250, 340, np.radians(-120), 0], [250, 250, 340, np.radians(30), 2 * np.pi], (20_000, 5)
    )
    tip, axis = machine.forward(positions)
    points = np.concatenate([part.vertices, table.vertices])
    heights = np.einsum("nk,nmk->nm", axis, tip[:, None] - points)
    assert room == pytest.approx(heights.min(), abs=3.0)
    # The bridge under the table turns with A alone; its corners are 96 mm from A's line, 20 mm up.
    assert room <= heights.min() + 0.5
    unknown = replace(machine, axes=(replace(machine.axes[0], limits=Limits()), *machine.axes[1:]))
    assert height_above(unknown, tool, Surroundings(part), 340.0) is None


@pytest.mark.parametrize(("retract", "is_clear"), [(340.0, True), (80.0, False)])
def test_only_a_retract_above_everything_settles_the_moves_there(retract, is_clear):
    machine = load_machine(EXAMPLE / "machine.toml").with_tool_length(85.0)
    tool, part = Tool.ball(8), box((-20, -20, 0), (20, 20, 40))
    tips = np.column_stack([np.linspace(-20.0, 20.0, 9), np.zeros(9), np.full(9, 40.0)])
    path = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (9, 1)), tool)
    motion = follow(path, machine, np.zeros((len(path), 2)))
    around = Surroundings(part)
    leads = choose_leads(motion, machine, path, surroundings=around, retract=retract, rises=True)
    turns = [gap.sentence for gap, _ in leads.report.gaps if gap.is_risk]
    assert (turns == []) is is_clear
    assert any(text.startswith("moves at the retract") for text in leads.report.passed) is is_clear


def test_the_tool_leaves_a_wall_sideways(hayashi):
    """The tool axis is parallel to the wall that the flank cuts: the lead-out goes off the wall."""
    tool = Tool.ball(10.0)
    tips = np.column_stack([np.linspace(-20.0, 20.0, 9), np.full(9, -5.0), np.full(9, 1.0)])
    path = Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (9, 1)), tool)
    _, before, after = verified(hayashi, path, box([-60, 0, -10], [60, 40, 20]), tcp=True)
    assert before.ok
    assert after.ok
    assert after.lead_out[1] < -0.5


def test_the_tool_leaves_a_slot_of_its_own_width_at_the_open_end(hayashi):
    tool = Tool.ball(10.0)
    sides = [box([-60, 5, -9], [60, 40, 45]), box([-60, -40, -9], [60, -5, 45])]
    floor = box([-60, -40, -9], [60, 40, 0])
    path = along_x(tool)
    _, before, after = verified(hayashi, path, trimesh.util.concatenate([*sides, floor]))
    assert before.ok
    assert after.ok
    assert after.lead_out[0] > 40.0 or after.lead_out[2] > 45.0


def test_a_path_that_ends_in_a_link_gets_no_lead_out(hayashi, lollipop):
    path = along_x(lollipop)
    path = replace(path, kind=np.array([*[MoveKind.CUT] * 8, MoveKind.LINK]))
    _, _, after = verified(hayashi, path, ledge(over=(2.5, 40.0)))
    assert not np.any(after.lead_out)
    _, _, up = verified(hayashi, path, ledge(over=(2.5, 40.0)), retract=100.0)
    assert up.counts == {"retreat-blocked": 1}


def test_without_a_lead_out_the_retract_straight_up_is_checked(hayashi, lollipop):
    floor = box([-60, -40, -10], [60, 40, 0])
    _, _, plain = verified(hayashi, along_x(lollipop), floor, leaves=False)
    assert not np.any(plain.lead_out)
    assert "the retract after the last location: the program ends there" in plain.not_checked
    _, _, up = verified(hayashi, along_x(lollipop), ledge(over=(2.5, 40.0)), leaves=False, retract=100.0)
    assert up.counts == {"retreat-blocked": 1}


def test_a_leg_of_z_with_a_tilted_tool_is_checked():
    machine = load_machine("linuxcnc-bridgemill").with_tool_length(100.0)
    tool = Tool.ball(10.0, shank_diameter=10.0, holder=Holder(60.0, (Section(30.0, 40.0),)))
    axis = np.tile([np.sin(np.pi / 3), 0.0, 0.5], (9, 1))
    tips = np.column_stack([np.zeros(9), np.linspace(-20.0, 20.0, 9), np.full(9, -80.0)])
    path = Toolpath.from_tips(tips, axis, tool)
    branches = axis_positions(machine, tips, axis)[..., machine.rotary_columns]
    rotary = branches[np.nanargmin(np.abs(branches[:, 0]).sum(axis=1))]
    roof = box([-80, -60, -65], [8, 60, -5])
    _, before, after = verified(machine, path, roof, rotary)
    assert before.ok
    # The roof ends at 8 mm and the ball is 5 mm thick: Z comes down beside it.
    assert after.ok
    assert after.lead_in[0] > 13.0
    _, _, led = verified(machine, path, roof, rotary, tcp=True)
    assert led.ok
    assert any(text.startswith("the rapid move of the tip") for text in led.not_checked)


def test_an_error_at_the_first_location_is_not_reported_for_the_lead_in_too(hayashi, lollipop):
    sunk = box([-60, -40, -10], [60, 40, 0.5])
    _, before, after = verified(hayashi, along_x(lollipop), sunk)
    assert before.counts["gouge"] == after.counts["gouge"]
    assert "approach-blocked" not in after.counts


def test_a_lead_in_passes_the_stock_at_the_feed_of_the_cut(hayashi):
    tool = Tool.ball(10.0, shank_diameter=8.0)
    path = along_x(tool)
    motion = follow(path, hayashi, UPRIGHT)
    lengths = []
    for depth in (3.0, 12.0):
        around = Surroundings(stock=box([-60, -40, -40], [60, 40, depth]))
        after = choose_leads(motion, hayashi, path, surroundings=around, retract=100.0)
        assert after.report.ok
        lengths.append(after.lead_in[2])
    assert lengths[0] == 5.0
    assert lengths[1] > 12.0


@pytest.mark.parametrize(("x", "is_clear"), [(20.0, True), (100.0, False)])
def test_from_a_retract_the_tip_comes_clear_from_anywhere_unless_something_stands_between(x, is_clear):
    """A post stands in the way from the far end of X; where X ends before it, nothing comes by."""
    machine = load_machine(EXAMPLE / "machine.toml").with_tool_length(85.0)
    tool, part = Tool.ball(8), box((-20, -20, 0), (20, 20, 40))
    post = Fixture("post", Box((4.0, 4.0, 258.0), (85.0, 0.0, 129.0)))
    axes = [replace(a, limits=Limits(-x, x)) if a.letter == "X" else a for a in machine.axes]
    machine = replace(machine, axes=tuple(axes))
    around = Surroundings(part, fixtures=(post,))
    above = np.array([0.0, 0.0, 100.0, 0.0, 0.0])
    assert clear_from_anywhere(machine, tool, around, 260.0, above) is is_clear
    # Every move of many is clear, too, or one of them isn't.
    draw = np.random.default_rng(3)
    starts = np.column_stack([draw.uniform(-x, x, 60), draw.uniform(-9.0, 9.0, 60), np.full(60, 260.0)])
    hit = False
    for start in starts:
        rows = np.vstack([[*start, 0.0, 0.0], above])
        tip, axis = machine.forward(rows)
        path = Toolpath.from_tips(tip, axis, tool, kind=np.full(2, MoveKind.RAPID))
        motion = Motion(machine.letters, rows, path.feed, np.ones(2), path.kind, path.source)
        hit = hit or not verify(motion, machine, path, surroundings=around).ok
    assert hit is not is_clear
