"""What a machine doesn't state never counts as zero where the tool's motion depends on it."""

import re

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import MachineError, SettingError
from fiveaxis.base.findings import Severity
from fiveaxis.model import Machine, Motion, MoveKind, Tool, load_machine, machine_names
from fiveaxis.model.machine.drafting import draft_machine
from fiveaxis.model.machine.files import find_machine
from fiveaxis.model.machine.unknown import figure_findings, require_stated, unknown_figures
from fiveaxis.show.report.sheet import describe_machine

ASSUMED = {"B.points": "0,0,50", "B.counts": "table", "C.counts": "tool"}
PROGRAM = "G21 G90 G94 G54\nG0 X0 Y0 Z50 B0 C0\nG1 Z10 F500\nX5 {turn}\nX10 {turn}\nM30\n"


HALF_OPEN = """name = "half-open"
code = "640123"
structure = { source = "a data sheet" }

[axes.A]
reversed = "unknown"
limits = { max = 30, unit = "deg", source = "a data sheet" }

[axes.C]
reversed = "unknown"
limits = { min = -10, unit = "deg", source = "a data sheet" }
"""


def test_the_library_states_all_pivots_but_those_of_three_machines():
    unknown = {name: [f.text for f in unknown_figures(load_machine(name))] for name in machine_names()}
    lacking = {name: texts for name, texts in unknown.items() if texts}
    # The tool length is the job's.
    assert {name for name, texts in lacking.items() if any("line" in t for t in texts)} == {
        "micro5", "umc-750", "variaxis-730",
    }  # fmt: skip
    assert {name for name, texts in lacking.items() if any("counts" in t for t in texts)} == {
        "micro5", "umc-750",
    }  # fmt: skip


def test_the_data_sheet_says_unknown_and_not_zero():
    sheet = describe_machine(load_machine("umc-750"))
    assert sheet["unknown"] == ["B.points", "B.counts", "C.counts"]
    points = {joint["axis"]: joint["point"] for joint in sheet["chain"] if "point" in joint}
    assert points["B"] is None
    assert points["C"] == [0.0, 0.0, 0.0]  # the table's first axis, where zero is chosen
    assert describe_machine(load_machine("umc-750", ASSUMED))["unknown"] == []


def test_a_machine_made_from_its_code_has_its_axes_in_zero():
    assert not unknown_figures(Machine.from_code("640123"))


@pytest.mark.parametrize(("coordinates", "errors"), [("axes", 3), ("tip", 2), ("vector", 0)])
def test_a_figure_is_an_error_only_where_the_tool_s_motion_depends_on_it(coordinates, errors):
    found = list(figure_findings(load_machine("umc-750"), coordinates))
    assert [f.code for f in found] == ["figure-unknown"] * 3
    assert sum(f.severity is Severity.ERROR for f in found) == errors
    if errors:
        with pytest.raises(MachineError, match="--assume"):
            require_stated(load_machine("umc-750"), coordinates)
    else:
        require_stated(load_machine("umc-750"), coordinates)


def test_what_is_assumed_moves_the_tool_as_if_it_were_stated_and_is_named():
    machine = load_machine("umc-750", ASSUMED)
    require_stated(machine, "axes")
    found = list(figure_findings(machine, "axes"))
    assert {f.code for f in found} == {"figure-assumed"}
    assert {f.message.split(" of machine")[0] for f in found} == {"B line", "B counts", "C counts"}
    # A point on B's line stays where it is.
    turned = np.zeros((1, 5))
    turned[0, machine.column("B")] = 0.5
    tip, _ = machine.forward(turned)
    home, _ = machine.forward(np.zeros((1, 5)))
    pivot = np.array([0.0, 0.0, 50.0])
    assert np.linalg.norm(tip - pivot) == pytest.approx(np.linalg.norm(home - pivot))


def test_limits_of_an_axis_whose_sense_is_assumed_turn_with_it():
    stated, turned = load_machine("umc-750"), load_machine("umc-750", ASSUMED)
    low, high = stated.axis("B").limits.ends
    assert turned.axis("B").limits.ends == pytest.approx((-high, -low))
    assert turned.axis("B").reversed is True
    same = load_machine("umc-750", ASSUMED | {"B.counts": "tool"})
    assert same.axis("B").limits.ends == pytest.approx((low, high))


@pytest.mark.parametrize(
    ("assume", "says"),
    [
        ({"pivot": "1"}, "no figure of a machine"),
        ({"points": "0,0,1"}, "AXIS.points"),
        ({"B.points": "0,1"}, "X,Y,Z"),
        ({"Q.points": "0,0,1"}, "axes X, Y, Z, B, C"),
    ],
)
def test_an_assumption_that_means_nothing_is_refused(assume, says):
    with pytest.raises(SettingError, match=says):
        load_machine("umc-750", assume)


def test_a_sense_that_the_machine_states_can_t_be_assumed():
    with pytest.raises(SettingError, match="has its sense"):
        load_machine("linuxcnc-xyzbc-trt", {"B.counts": "tool"})


def test_axis_words_of_a_machine_without_pivots_are_never_verified(tmp_path):
    file = tmp_path / "part.nc"
    file.write_text(PROGRAM.format(turn="B20 C30"))
    report = fx.verify_program(file, load_machine("umc-750"))
    assert report.counts["figure-unknown"] == 3
    assert not report.ok
    assert fx.verify_program(file, load_machine("umc-750", ASSUMED)).counts["figure-assumed"] == 3
    # An upright tool goes with the linear axes, wherever the rotary ones are.
    file.write_text(PROGRAM.format(turn=""))
    assert "figure-unknown" not in fx.verify_program(file, load_machine("umc-750")).counts


def test_the_length_of_a_tool_that_leans_with_the_head_is_never_zero(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM.format(turn="B20 C30"))
    bridge = load_machine("linuxcnc-bridgemill")
    assert fx.verify_program(file, bridge).counts["figure-unknown"] == 1
    assert "figure-unknown" not in fx.verify_program(file, bridge.with_tool_length(120.0)).counts


def test_a_motion_isn_t_written_in_axis_words_whose_pivots_nobody_knows(tmp_path):
    machine = load_machine("umc-750")
    positions = np.array([[0.0, 0.0, 10.0, 0.0, 0.0], [5.0, 0.0, 10.0, 0.4, 0.3]])
    rows = np.array([0, 1])
    time, feed = np.array([0.0, 1.0]), np.full(2, 5.0)
    motion = Motion(machine.letters, positions, feed, time, np.full(2, MoveKind.CUT), rows)
    for checked in ({"against": fx.Against(tool=Tool.ball(6.0))}, {"unverified": True}):
        with pytest.raises(MachineError, match="doesn't state"):
            fx.write_program(motion, tmp_path / "part.nc", machine, control="haas", **checked)
    assert not (tmp_path / "part.nc").exists()


@pytest.mark.parametrize("name", ["dmu80p-duoblock", "linuxcnc-bridgemill"])
def test_a_head_whose_gauge_point_nobody_states_has_it_nowhere(name, tmp_path):
    stated = load_machine(name).with_tool_length(120.0)
    lines = find_machine(name).read_text(encoding="utf-8")
    file = tmp_path / "head.toml"
    file.write_text(re.sub(r"\[spindle\]\n(?:(?!\[).*\n)*", "", lines), encoding="utf-8")
    machine = load_machine(file).with_tool_length(120.0)
    assert "spindle" in [f.name for f in unknown_figures(machine)]
    assert "spindle" not in [f.name for f in unknown_figures(stated)]
    assert describe_machine(machine)["spindle"]["point"] is None
    program = tmp_path / "part.ngc"
    program.write_text(PROGRAM.format(turn="B20 C30"))
    report = fx.verify_program(program, machine)
    assert not report.ok
    [found] = [f for f in report.findings if f.code == "figure-unknown"]
    assert "gauge point" in found.message
    assert "--assume spindle=X,Y,Z" in found.message
    assert "figure-unknown" not in fx.verify_program(program, stated).counts
    point = ",".join(f"{v:g}" for v in stated.with_tool_length(0.0).chain.tool_home[:3, 3])
    assumed = load_machine(file, {"spindle": point}).with_tool_length(120.0)
    assert assumed.chain.tool_home == pytest.approx(stated.chain.tool_home)
    assert fx.verify_program(program, assumed).counts["figure-assumed"] == 1


def test_what_a_table_carries_needs_no_gauge_point(tmp_path):
    """The work offset takes up where it is."""
    file = tmp_path / "table.toml"
    lines = find_machine("dmu50ev").read_text(encoding="utf-8")
    file.write_text(re.sub(r"\[spindle\]\n(?:(?!\[).*\n)*", "", lines), encoding="utf-8")
    assert not unknown_figures(load_machine(file))


def test_a_file_drafted_for_a_fork_says_that_its_zero_is_the_gauge_point():
    made = draft_machine({("structure", ""): "head-head-ac", ("points", "A"): "0,0,451"}).machine
    assert "spindle" not in [f.name for f in unknown_figures(made)]


def test_a_range_with_one_end_is_turned_round_where_the_table_counts(tmp_path):
    path = tmp_path / "half-open.toml"
    path.write_text(HALF_OPEN)
    machine = load_machine(path, {"A.counts": "table", "C.counts": "table"})
    assert [machine.axis(c).limits.ends for c in "AC"] == [
        (pytest.approx(np.radians(-30.0)), None),
        (None, pytest.approx(np.radians(10.0))),
    ]
