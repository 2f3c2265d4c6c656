"""Programs of others, verified: what only they do."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from support.unverified_text import write_text

import fiveaxis as fx
from fiveaxis.base import normalise
from fiveaxis.check import Fixture
from fiveaxis.model import Box, Tool, Toolpath, parse_tool, rotary_angles, tool_poses
from fiveaxis.model.motion.filling import fill_in
from fiveaxis.model.toolpath.tool import Holder, Section

TURNED = """G71 G90 G17
TRAORI
ORIWKS
ORIAXES
G1 X60 Y10 Z0 A3=0 B3=0.5 C3=0.8660254 F1000
G1 X60 Y11 Z0 A3=0 B3=0.5 C3=0.8660254
G0 X-60 Y11 Z0 A3=0 B3=-0.5 C3=0.8660254
G1 X-60 Y12 Z0 A3=0 B3=-0.5 C3=0.8660254
TRAFOOF
M30
"""


def test_a_program_of_directions_is_swept_where_the_control_leads_the_tip(hayashi, tmp_path):
    """The rapid turns the table by half a turn: axes that ran linearly would go around the pin."""
    program = tmp_path / "turned.mpf"
    program.write_text(TURNED)
    pin = Fixture("pin", Box((4.0, 4.0, 20.0), (0.0, 11.0, 4.0)))
    tool = Tool.ball(6, shank_diameter=6, holder=Holder(40.0, (Section(40.0, 40.0),)))
    report = fx.verify_program(program, hayashi, tool=tool, fixtures=(pin,))
    (found,) = [f for f in report.findings if f.code == "fixture-collision"]
    assert found.place.line == 7
    aside = Fixture("pin", Box((4.0, 4.0, 20.0), (0.0, 300.0, 4.0)))
    clear = fx.verify_program(program, hayashi, tool=tool, fixtures=(aside,))
    assert "the tool centre point straight" in " ".join(clear.passed)


LEANING = """G21 G90 G94
G0 A0 C0
G0 X0 Y0 Z50
G1 X0 Y0 Z0 F500
G1 X1 A-5
G1 X2 A-65
G1 X3 A-66
M2
"""


@pytest.mark.parametrize("led", [False, True])
def test_a_bound_on_turns_that_is_named_holds_for_whole_blocks(hayashi, tmp_path, led):
    """The tool leans with A: that the program says so is no excuse, and neither is that it is led."""
    program = tmp_path / "leaning.ngc"
    program.write_text(LEANING.replace("G0 A0 C0", "G0 A0 C0\nG0 X0 Y0 Z50\nG43.4 H1") if led else LEANING)
    checked = {"tool": Tool.ball(10), "singular_cone": None}
    report = fx.verify_program(program, hayashi, max_turn=10.0, **checked)
    assert [f.place.line for f in report.findings if f.code == "jump"] == [8 if led else 6]
    assert fx.verify_program(program, hayashi, max_turn=61.0, **checked).ok
    path = fx.read_toolpath(program, tool=Tool.ball(10), machine=hayashi)
    allowed = fx.verify_program(program, hayashi, toolpath=path, max_turn=10.0, tool=Tool.ball(10))
    assert "jump" not in allowed.counts


def test_cuts_beside_the_part_have_no_normal_and_are_counted_as_unchecked(hayashi, tmp_path):
    """The part ends at x = 3.2: the last two of five cuts are in the air, and lean beyond nothing."""
    program = tmp_path / "air.ngc"
    cuts = "".join(f"G1 X{x} A{a} F500\n" for x, a in ((1, -15), (2, -15), (3, -15), (5, -16), (6, -16)))
    program.write_text(f"G21 G90 G94\nG0 A-15 C0\nG0 X0 Y0 Z50\n{cuts}M2\n")
    tip, axis = tool_poses(hayashi, fx.read_program(program, hayashi).positions)
    under = (tip + 5.0 * axis)[1, 2] - 5.0
    part = trimesh.creation.box(bounds=[[-50.0, -100.0, -20.0], [3.2, 100.0, under]])
    report = fx.verify_program(program, hayashi, tool=Tool.ball(10), part=part, tilt=(10.0, 20.0))
    assert any("at every location of a cut where it is known" in sentence for sentence in report.passed)
    assert "angle between tool axis and normal at 2 cuts" in " ".join(report.not_checked)
    whole = trimesh.creation.box(bounds=[[-50.0, -100.0, -20.0], [60.0, 100.0, under]])
    report = fx.verify_program(program, hayashi, tool=Tool.ball(10), part=whole, tilt=(10.0, 20.0))
    assert not any("and normal at" in sentence for sentence in report.not_checked)


CUTS = ("G1 X0 Y20 Z0 F500", "G1 X5", "G1 X10", "{rewind}", "G1 X15", "G1 X20", "M2")
REWIND = "G1 Z30\nG1 C-180\nG1 Z0"


def around(tmp_path, rewind, name="around.ngc"):
    """Cuts with something in the midst of them."""
    program = tmp_path / name
    lines = "\n".join(CUTS).format(rewind=rewind)
    program.write_text(f"G21 G90 G94\nG0 A-30 C180\nG0 X0 Y20 Z0\n{lines}\n")
    return program


def test_a_rewind_that_is_written_as_feed_moves_is_a_link(hayashi, tmp_path):
    """The tool goes back along its axis, the table turns once, and the tool returns to where it was."""
    tool = Tool.ball(8)
    path = fx.read_toolpath(around(tmp_path, "", "plain.ngc"), tool=tool, machine=hayashi)
    checked = {"tool": tool, "singular_cone": None}
    program = around(tmp_path, REWIND)
    assert fx.verify_program(program, hayashi, **checked).ok
    report = fx.verify_program(program, hayashi, toolpath=path, max_turn=15.0, **checked)
    assert report.ok, report.counts


@pytest.mark.parametrize(
    ("rewind", "line"),
    [
        ("G1 C-180", 7),  # in the cut
        ("G1 Z0.5\nG1 C-180\nG1 Z0", 8),  # hardly away
        ("G1 Z30\nG1 C-180\nG1 Y20.1 Z0", 8),  # back elsewhere
        ("G1 Y50\nG1 C-180\nG1 Y20", 8),  # away sideways, through the part
    ],
)
def test_a_turn_that_is_no_rewind_is_a_jump(hayashi, tmp_path, rewind, line):
    report = fx.verify_program(around(tmp_path, rewind), hayashi, tool=Tool.ball(8), singular_cone=None)
    assert [f.place.line for f in report.findings if f.code == "jump"] == [line]


def test_a_bull_nose_follows_the_straight_path_of_its_centre(hayashi, tmp_path):
    """Few contacts around a cylinder: from one to the next the tool turns by 12 deg about what it cuts."""
    angle = np.linspace(0.0, 2.0, 11)
    around = np.stack([np.cos(angle), np.sin(angle), 0.2 + 0.0 * angle], axis=1)
    path = Toolpath.from_contacts(20.0 * around, around, parse_tool("bull:12:2"), name="bull.csv")
    leant = np.stack([np.cos(angle), np.sin(angle), 0.9 + 0.0 * angle], axis=1)
    rotary = np.unwrap(rotary_angles(hayashi, normalise(leant))[1], axis=0)
    _, motion, _ = fill_in(path, hayashi, rotary)
    program = write_text(motion, tmp_path / "bull.ngc", machine=hayashi)
    report = fx.verify_program(program, hayashi, toolpath=path, singular_cone=None)
    assert report.ok, report.counts
    lift = np.array([0.0, 0.0, 0.02])
    apart = replace(path, pivot=path.pivot + lift, contact=path.contact + lift)
    assert not fx.verify_program(program, hayashi, toolpath=apart, singular_cone=None).ok


@pytest.mark.parametrize(("degrees", "ok"), [(3.5, True), (14.0, False)])
def test_directions_are_followed_in_their_plane_and_with_the_axes_in_proportion(
    hayashi, tmp_path, degrees, ok
):
    """In proportion the tool's centre swings along the ring that is cut, in the plane above it."""
    turn = np.radians(np.arange(0.0, 84.1, degrees))
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    up = np.broadcast_to([0.0, 0.0, 1.0], out.shape)
    ring = Toolpath.from_contacts(6.0 * out, up, Tool.ball(20), feed_mm_min=1000.0, name="ring")
    axis = 0.6 * out + 0.8 * up
    rows = np.column_stack([ring.pivot - 10.0 * axis, axis])
    program = tmp_path / "ring.apt"
    moves = "".join("GOTO/" + ",".join(f"{value:.6f}" for value in row) + "\n" for row in rows)
    program.write_text(f"UNITS/MM\nFEDRAT/1000,MMPM\n{moves}FINI\n")
    found = fx.verify_program(program, hayashi, toolpath=ring)
    assert found.ok is ok
    assert set(found.counts) == {"angles-assumed", *(() if ok else ("off-path",))}
