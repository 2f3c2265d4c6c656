"""The tool's length counts once, in whichever of the equivalent ways a program and its caller state it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.rs274 import canonical, needs_rs274

import fiveaxis as fx
from fiveaxis.base import Array
from fiveaxis.base.findings import Severity
from fiveaxis.check import Fixture
from fiveaxis.job import resolve
from fiveaxis.job.reading import make_job
from fiveaxis.model import Machine, linear_positions, load_machine, save_machine, tool_poses
from fiveaxis.model.machine.bodies import Box
from fiveaxis.nc import read_program, read_toolpath
from fiveaxis.nc.own_header import LENGTH
from fiveaxis.nc.words import control_values

MACHINES = {
    "table-table": load_machine("dmu50ev"),
    "head-table": load_machine("dmu80p-duoblock"),
    "head-head": load_machine("linuxcnc-bridgemill"),
}
TOOL = fx.Tool.ball(6.0)
# mm, workpiece frame: down, along, up.
TIPS = np.array([[0.0, 0.0, 60.0], [0.0, 0.0, 40.0], [20.0, 5.0, 40.0], [20.0, 5.0, 60.0]])
# Round the end of the cut, where no other length has the tool.
IN_THE_WAY = Fixture("clamp", Box((6.0, 6.0, 3.0), (21.0, 5.0, 39.5)))


def positions_of(machine: Machine, turns: tuple[float, float]) -> Array:
    """Return the axis values of the tips with one pair of rotary angles, deg."""
    return linear_positions(machine, TIPS, np.tile(np.radians(turns), (len(TIPS), 1)))


def text_of(words: Array, letters: str, head: list[str], end: str = "M30", move: str = "G1 F500 {}") -> str:
    """Write a program: to the first row in rapids, the rotary axes first."""
    rows = [{c: f"{c}{v:.9f}" for c, v in zip(letters, row, strict=True)} for row in words.tolist()]
    turn = " ".join(rows[0][c] for c in letters if c in "ABC")
    first = " ".join(rows[0][c] for c in "XYZ")
    rapid = ("L {} FMAX" if move.startswith("L") else "G0 {}").format
    cuts = [move.format(" ".join(row[c] for c in letters)) for row in rows[1:]]
    return "\n".join([*head, rapid(turn), rapid(first), *cuts, end]) + "\n"


def less_length(machine: Machine, words: Array, length: float) -> Array:
    """Take the length off the words of Z, as a control that adds it expects them."""
    less = words.copy()
    less[:, machine.column("Z")] -= length * (-1.0 if machine.axis("Z").reversed else 1.0)
    return less


def of_tips(machine: Machine, words: Array) -> Array:
    """Return the words of the tip, from where the tip of no tool is with every axis at 0."""
    tips = words.copy()
    zero, _ = tool_poses(machine.with_tool_length(0.0), np.zeros((1, len(machine.axes))))
    rotation = machine.machine_frame[:3, :3]
    tips[:, [machine.column(c) for c in "XYZ"]] = (TIPS - zero) @ rotation
    return tips


ISO = ["G21 G90 G94 G17", "T1 M6", "S5000 M3"]
SINUMERIK = ["G710 G90 G94 G17", "T1 D1 M6", "S5000 M3"]
KLARTEXT = ["BEGIN PGM A MM", "TOOL CALL 1 Z S5000", "L M3"]
Written = tuple[str, str]
Way = Callable[[Machine, Array, float], Written]

# How a program's words count, the caller having said how long the tool is: suffix and text.
WAYS: Mapping[str, Way] = {
    "contained": lambda m, w, length: (".nc", text_of(w, m.letters, [*ISO, "G49"])),
    "G43": lambda m, w, length: (".nc", text_of(less_length(m, w, length), m.letters, [*ISO, "G43 H1"])),
    "G43 after the first height": lambda m, w, length: (
        ".nc",
        text_of(less_length(m, w, length), m.letters, [*ISO, "G0 Z400.", "G43 H1"]),
    ),
    "TCP": lambda m, w, length: (".nc", text_of(of_tips(m, w), m.letters, [*ISO, "G43.4 H1"])),
    "D0": lambda m, w, length: (".mpf", text_of(w, m.letters, [*SINUMERIK, "TRAFOOF", "D0"])),
    "D1": lambda m, w, length: (
        ".mpf",
        text_of(less_length(m, w, length), m.letters, [*SINUMERIK, "TRAFOOF"]),
    ),
    "TRAORI": lambda m, w, length: (".mpf", text_of(of_tips(m, w), m.letters, [*SINUMERIK, "TRAORI"])),
    "TOOL CALL": lambda m, w, length: (
        ".h",
        text_of(less_length(m, w, length), m.letters, KLARTEXT, "END PGM A MM", "L {} F500"),
    ),
}


def errors_of(report: fx.Report) -> dict[str, int]:
    """Count the errors by code."""
    errors = {f.code for f in report.findings if f.severity is Severity.ERROR}
    return {code: n for code, n in report.counts.items() if code in errors}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("structure", MACHINES)
@given(
    length=st.floats(20.0, 300.0),
    turns=st.tuples(st.floats(-25.0, 25.0), st.floats(-40.0, 40.0)),
)
def test_axis_positions_and_tips_are_those_of_the_tool_whichever_way_states_its_length(
    structure, way, length, turns, tmp_path_factory
):
    machine = MACHINES[structure].with_tool_length(length)
    wanted = positions_of(machine, turns)
    suffix, text = WAYS[way](machine, control_values(machine, wanted), length)
    file = tmp_path_factory.mktemp("length") / f"part{suffix}"
    file.write_text(text)
    reading: dict[str, Any] = {"zero": {"X": 0.0}, "rapid": 10_000.0, "positions": "table"}
    motion = read_program(file, machine, **reading)
    # A first row before G43 stands aside.
    np.testing.assert_allclose(motion.positions[-len(TIPS) + 1 :], wanted[1:], atol=1e-5)
    del reading["rapid"]
    path = read_toolpath(file, tool=TOOL, machine=machine, **reading)
    np.testing.assert_allclose(path.tips(path.axis)[-len(TIPS) + 1 :], TIPS[1:], atol=1e-5)


@pytest.mark.parametrize("structure", MACHINES)
def test_what_stands_in_the_way_is_found_whichever_way_states_the_length(structure, tmp_path):
    machine = MACHINES[structure].with_tool_length(150.0)
    wanted = positions_of(machine, (15.0, 30.0))
    words = control_values(machine, wanted)
    reports = {}
    surroundings: dict[str, Any] = {"tool": TOOL, "fixtures": (IN_THE_WAY,)}
    reading: dict[str, Any] = {"zero": {"X": 0.0}, "rapid": 10_000.0, "positions": "table"}

    def verified(name: str, text: str, on: Machine) -> fx.Report:
        file = tmp_path / name
        file.write_text(text)
        return fx.verify_program(file, on, **surroundings, **reading)

    for way, write in WAYS.items():
        suffix, text = write(machine, words, 150.0)
        reports[way] = verified(f"part{suffix}", text, machine)
    # Nobody says the length but the head of a program that contains it.
    head = [f"({LENGTH.write(150.0)})", *ISO]
    bare = MACHINES[structure]
    reports["comment"] = verified("own.nc", text_of(words, machine.letters, head), bare)
    found = {way: errors_of(report) for way, report in reports.items()}
    assert all(errors.get("fixture-collision") for errors in found.values()), found
    assert {way: errors for way, errors in found.items() if errors != found["contained"]} == {}


@pytest.mark.parametrize("way", ["G43", "contained, by the head"])
def test_where_only_z_takes_the_length_up_nobody_needs_to_say_it(way, tmp_path):
    bare = MACHINES["table-table"]
    machine = bare.with_tool_length(150.0)
    words = control_values(machine, positions_of(machine, (15.0, 30.0)))
    file = tmp_path / "part.nc"
    head = [f"({LENGTH.write(150.0)})", *ISO, "G49"]
    file.write_text(
        WAYS["G43"](machine, words, 150.0)[1] if way == "G43" else text_of(words, machine.letters, head)
    )
    for on in (bare, machine):
        path = read_toolpath(file, tool=TOOL, machine=on, zero={"X": 0.0})
        np.testing.assert_allclose(path.tips(path.axis), TIPS, atol=1e-5)


def test_words_that_contain_another_length_than_the_tool_s_are_an_error(tmp_path):
    machine = MACHINES["head-table"].with_tool_length(150.0)
    words = control_values(machine, positions_of(machine, (15.0, 30.0)))
    file = tmp_path / "own.nc"
    file.write_text(text_of(words, machine.letters, [f"({LENGTH.write(150.0)})", *ISO]))
    assert "tool-length-differs" not in fx.verify_program(file, machine).counts
    report = fx.verify_program(file, MACHINES["head-table"].with_tool_length(120.0))
    assert not report.ok
    assert report.counts["tool-length-differs"] == 1


@pytest.mark.parametrize("way", ["contained", "G43", "TCP", "D0", "D1"])
@pytest.mark.parametrize("structure", ["dmu50ev", "dmu80p-duoblock"])
def test_an_operation_that_is_revised_in_its_lines_is_where_the_machine_has_it(structure, way, tmp_path):
    """Path, rows and check of `optimise PROGRAM` are one, with a setup and words that contain the length."""
    offset = (0.0, 0.0, 45.0)
    machine = load_machine(structure).with_setup(offset).with_tool_length(150.0)
    turns = np.radians(np.linspace((10.0, 0.0), (25.0, 40.0), len(TIPS)))
    wanted = linear_positions(machine, TIPS, turns)
    suffix, text = WAYS[way](machine, control_values(machine, wanted), 150.0)
    file = tmp_path / f"part{suffix}"
    file.write_text(text)
    # Words of axes alone don't tell an ISO control.
    stated = replace(load_machine(structure), control="fanuc" if suffix == ".nc" else "sinumerik")
    save_machine(stated, tmp_path / "mill.toml")
    reading = {"zero": {"X": 0.0}, "positions": "table", "rapid": 10_000.0}
    given: dict[str, Any] = {
        "machine": str(tmp_path / "mill.toml"),
        "tool": "ball:6",
        "tool_length": 150.0,
        "cone": 20.0,
    }
    job = make_job(input=file, program=reading, setup={"offset": offset}, **given)
    placed = resolve(job)
    path = placed.toolpath
    np.testing.assert_allclose(path.tips(path.axis)[-len(TIPS) + 2 :], TIPS[2:], atol=1e-5)
    motion = read_program(file, placed.machine, **reading)
    np.testing.assert_allclose(motion.positions[-1], wanted[-1], atol=1e-5)


@needs_rs274
def test_z_goes_where_linuxcnc_has_it_with_the_length_that_g43_adds(tmp_path):
    """G43 and G49 move nothing: the words after them count from elsewhere."""
    file = tmp_path / "part.ngc"
    text = "G21 G90 G94 G17 G49 G54\nG0 X0 Y0 Z300{turn}\nG43 H1\nG1 X10 F100\nZ20\nG49\nX20\nZ250\nM2\n"
    file.write_text(text.format(turn=""))
    commands = canonical(file, tools="T1 P1 Z5 D1\n")  # inches
    added, heights = 0.0, []
    for found in re.finditer(r"USE_TOOL_LENGTH_OFFSET\(\S+ \S+ ([-.0-9]+)|STRAIGHT_\w+\((.*?)\)", commands):
        if found[1] is not None:
            added = float(found[1])
        else:
            heights.append(float(found[2].split(",")[2]) + added)
    assert added == 0.0
    assert heights == pytest.approx([300.0, 300.0, 20.0 + 127.0, 20.0 + 127.0, 250.0])
    file.write_text(text.format(turn=" B0 C0"))
    for machine in MACHINES.values():
        motion = read_program(file, machine.with_tool_length(127.0), zero={"X": 0.0}, rapid=10_000.0)
        assert machine.axis("Z").reversed is False
        np.testing.assert_allclose(motion.positions[:, machine.column("Z")], heights, atol=1e-6)
