"""What a program adds before and after a motion is checked like the motion, and goes around obstacles."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fiveaxis.collision import Surroundings
from fiveaxis.errors import Unverified
from fiveaxis.kinematics import axis_positions
from fiveaxis.machine import load_machine
from fiveaxis.motion import follow
from fiveaxis.nc import compose_program
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.toolpath.tool import Holder, Section
from fiveaxis.verification import verify, with_approach

UPRIGHT = np.zeros((9, 2))


def box(low, high) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def along_x(tool: Tool) -> Toolpath:
    tips = np.column_stack([np.linspace(-20.0, 20.0, 9), np.zeros((9, 2))])
    return Toolpath.from_tips(tips, np.tile([0.0, 0.0, 1.0], (9, 1)), tool)


def ledge(*, over: tuple[float, float]) -> trimesh.Trimesh:
    """A ledge over a floor, over some y; the balls of these tests fit below it."""
    floor = box([-60, -40, -10], [60, 40, 0])
    return trimesh.util.concatenate([box([-60, over[0], 11], [60, over[1], 16]), floor])


@pytest.fixture
def lollipop() -> Tool:
    return Tool.lollipop(10.0, 4.0, shank_diameter=4.0, holder=Holder(60.0, (Section(30.0, 40.0),)))


def verified(machine, path, part, rotary=UPRIGHT, **options):
    motion = follow(path, machine, rotary)
    report = verify(motion, machine, path, part=part)
    around = Surroundings.load(part)
    return motion, report, with_approach(report, motion, machine, path, surroundings=around, **options)


def test_an_open_place_is_approached_along_the_tool_axis(hayashi, lollipop):
    _, before, after = verified(hayashi, along_x(lollipop), box([-60, -40, -10], [60, 40, 0]))
    assert after.ok == before.ok is True
    assert np.allclose(after.lead_in, [0.0, 0.0, 5.0, 0.0, 0.0])
    assert any(text.startswith("approach: a lead-in of 5 mm and Z down") for text in after.checked)
    assert any("rotary axes" in text for text in after.not_checked)


def test_under_a_ledge_the_tool_comes_from_the_side(hayashi, lollipop):
    motion, before, after = verified(hayashi, along_x(lollipop), ledge(over=(2.5, 40.0)))
    assert before.ok
    assert after.ok
    x, y, z, _, _ = after.lead_in
    assert y < 0.0 or x != 0.0
    assert z < 2.0
    program = compose_program(motion, machine=hayashi, report=after)
    begin = [line for line in program.lines if line.startswith("G0 ")]
    assert f"Y{motion.positions[0, 1] + y:.6f}" in begin[1]
    assert begin[2] == f"G0 Z{motion.positions[0, 2] + z:.6f}"


def test_where_no_way_in_is_clear_no_program_is_written(hayashi, lollipop):
    motion, before, after = verified(hayashi, along_x(lollipop), box([-200, -200, 95], [200, 200, 99]))
    assert before.counts == {}
    assert after.counts == {"approach-blocked": 1}
    with pytest.raises(Unverified, match=r"approach-blocked \(1\)"):
        compose_program(motion, machine=hayashi, report=after)
    accepted = compose_program(motion, machine=hayashi, report=after, override=["approach-blocked"])
    assert any("approach-blocked" in line for line in accepted.lines)


def test_a_way_up_through_the_part_is_found(hayashi, lollipop):
    _, before, after = verified(hayashi, along_x(lollipop), ledge(over=(2.5, 40.0)), way_out=True)
    assert before.ok
    assert after.counts == {"retreat-blocked": 1}
    found = next(f for f in after.findings if f.code == "retreat-blocked")
    assert found.place.location == 8
    assert "reaches" in found.message


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
    _, _, led = verified(machine, path, roof, rotary, leg=False)
    assert led.ok
    assert any(text.startswith("the rapid move of the tip") for text in led.not_checked)


def test_what_was_found_at_the_first_location_is_not_found_again(hayashi, lollipop):
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
        report = verify(motion, hayashi, path, surroundings=around)
        after = with_approach(report, motion, hayashi, path, surroundings=around, way_out=True)
        assert after.counts == report.counts
        lengths.append(after.lead_in[2])
    assert lengths[0] == 5.0
    assert lengths[1] > 12.0


def test_a_header_says_where_nobody_looked_at_the_approach(hayashi, lollipop):
    motion, before, after = verified(hayashi, along_x(lollipop), box([-60, -40, -10], [60, 40, 0]))
    said = " ".join(compose_program(motion, machine=hayashi, report=before).lines)
    assert "approach to the first location and the way out" in said
    said = " ".join(compose_program(motion, machine=hayashi, report=after).lines)
    assert "approach to the first location and the way out" not in said
