"""Existing programs as input: their posture is chosen anew, block by block."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fiveaxis.cli.commands import app
from fiveaxis.model import Tool, load_machine, parse_tool, rotary_angles, tool_axes
from fiveaxis.nc import read_toolpath

MACHINE = "linuxcnc-xyzac-trt"
QUICK = ("--drives", "hayashi-640123", "--effort", "quick")
N = 120


def wall(count=N):
    """Contacts and normals once round a ball of radius 20, or some of them, a little above its equator."""
    angle = np.linspace(0.0, 2.0 * np.pi, N)[:count]
    normal = np.column_stack([0.9 * np.cos(angle), 0.9 * np.sin(angle), np.full(count, np.sqrt(1.0 - 0.81))])
    return 20.0 * normal, normal


def write_program(path, tool, lean=40.0, count=N):
    """Write the wall as a program with tool centre point control, the tool leaning up from the normal."""
    machine = load_machine(MACHINE)
    contact, normal = wall(count)
    up = np.array([0.0, 0.0, 1.0]) - normal[:, 2:] * normal
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    axis = np.cos(np.radians(lean)) * normal + np.sin(np.radians(lean)) * up
    tip = tool.cutter.tips(contact, normal, axis)
    rotary = rotary_angles(machine, axis)[0]
    rotary[:, 0] = np.unwrap(rotary[:, 0])
    np.testing.assert_allclose(tool_axes(machine, rotary), axis, atol=1e-9)
    words = dict(zip(machine.rotaries, np.degrees(rotary).T, strict=True))
    signs = {a.letter: -1.0 if a.reversed else 1.0 for a in machine.axes}
    columns = {**dict(zip("XYZ", tip.T, strict=True)), **words}
    lines = ["G21 G90 G94", "M428", "G0 X60 Y0 Z60 A0 C0"]
    for i in range(count):
        lines.append("G1 " + " ".join(f"{c}{signs[c] * v[i]:.6f}" for c, v in columns.items()) + " F800")
    path.write_text("\n".join([*lines, "M30"]) + "\n")
    return path


def run(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


@pytest.fixture
def part(tmp_path):
    mesh = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=4, radius=20.0).export(mesh)
    return mesh


def optimised(program, *options):
    result = run("optimise", program, "--machine", MACHINE, *QUICK, *options, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_a_program_is_read_with_its_machine_and_keeps_its_blocks(tmp_path):
    tool = Tool.ball(6)
    program = write_program(tmp_path / "wall.ngc", tool)
    path = read_toolpath(program, tool=tool, machine=load_machine(MACHINE))
    contact, normal = wall()
    np.testing.assert_allclose(path.pivot[path.cutting], contact + 3.0 * normal, atol=1e-5)
    assert path.source[path.cutting].tolist() == list(range(4, 4 + N))


@pytest.mark.usefixtures("undrawn")
def test_a_cone_about_the_programmed_axis_saves_energy_with_no_surface_known(tmp_path):
    program = write_program(tmp_path / "wall.ngc", Tool.ball(6))
    by_axes = ("--coordinates", "axes", "-o", tmp_path / "out")
    document = optimised(program, "--tool", "ball:6", "--cone", "20", *by_axes)
    energy, programmed = document["energy"]["total"], document["baselines"]["as-programmed"]["total"]
    assert energy < 0.9 * programmed
    rows = (tmp_path / "out" / "motion.csv").read_text().splitlines()
    assert rows[0].endswith("location")
    assert rows[-1].split(",")[rows[0].split(",").index("source")] == str(3 + N)


@pytest.mark.parametrize("text", ["ball:6", pytest.param("bull:6:1", marks=pytest.mark.slow)])
def test_with_the_part_any_cutter_is_turned_about_its_contact(tmp_path, part, text):
    # Leaning less than is asked for, the program has to be changed.
    program = write_program(tmp_path / "wall.ngc", parse_tool(text), lean=10.0, count=25)
    # At the program's own zero the part would lie in the table; above this the first turn is too high.
    raised = ("--work-offset", "0,0,30")
    document = optimised(program, "--tool", text, "--tilt", "15:75", "--part", part, *raised)
    assert document["verification"]["ok"]
    assert "off-surface" not in {f["code"] for f in document["findings"]}
    assert document["residuals"]["contact"] < 1e-9


def test_without_the_part_a_bull_nose_is_not_turned_about_a_guess(tmp_path):
    program = write_program(tmp_path / "wall.ngc", Tool.bull(6, 1))
    result = run(
        *("optimise", program, "--machine", MACHINE, "--drives", "hayashi-640123"),
        *("--tool", "bull:6:1", "--cone", "20"),
    )
    assert result.exit_code == 2
    assert "has to be moved about its contact" in result.stderr


def test_a_program_with_rotary_words_needs_its_machine(tmp_path):
    program = write_program(tmp_path / "wall.ngc", Tool.ball(6))
    words = ("--cone", "20", "--machine", "hayashi-640123", "--effort", "quick")
    result = run("optimise", program, "--tool", "ball:6", *words)
    assert result.exit_code == 0
    # Another machine runs it: the words are angles of the one that it was written for.
    other = run(
        *("optimise", program, "--tool", "ball:6", "--cone", "20", "--json"),
        *("--machine", "hayashi-640123", "--written-for", MACHINE, "--effort", "quick"),
    )
    assert other.exit_code == 0
    assert json.loads(other.stdout)["machine"]["name"] == "hayashi-640123"


@pytest.mark.slow
def test_a_moved_part_is_reported_and_not_followed(tmp_path, part):
    program = write_program(tmp_path / "wall.ngc", Tool.ball(6), count=15)
    mesh = trimesh.load_mesh(part)
    mesh.apply_translation([0.0, 0.0, 0.4])
    mesh.export(part)
    options = ("optimise", program, "--machine", MACHINE, "--drives", "hayashi-640123", "--tool", "ball:6")
    options = (*options, "--only-verify", "--effort", "quick")
    near = run(*options, "--cone", "20", "--part", part, "--surface-tolerance", "0.3", "--json")
    # Within the tolerance it is followed, but the ball is in the part: verification says so.
    assert near.exit_code == 1
    assert "gouge" in {f["code"] for f in json.loads(near.stdout)["findings"]}
    far = run(*options, "--cone", "20", "--part", part, "--json")
    assert far.exit_code == 1
    (sunk,) = (f for f in json.loads(far.stdout)["findings"] if f["code"] == "sunk")
    assert 0.1 < sunk["value"] < 0.3


def test_a_part_that_no_cut_touches_is_refused(tmp_path, part):
    program = write_program(tmp_path / "wall.ngc", Tool.ball(6), count=15)
    mesh = trimesh.load_mesh(part)
    mesh.apply_translation([0.0, 0.0, -2.6])
    mesh.export(part)
    wrong = run("optimise", program, "--machine", MACHINE, "--tool", "ball:6", "--cone", "20", "--part", part)
    assert wrong.exit_code == 2
    assert "no cut touches the part within 0.05 mm" in wrong.stderr
