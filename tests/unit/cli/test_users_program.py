"""A user's own program on the command line: read, verified and shown as it is."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.stock_on_page import unpacked
from typer.testing import CliRunner

from fiveaxis.cli.commands import app
from fiveaxis.model import load_machine

# A face, then a 5-axis cut under TCP with the cutter in a comment, then one by axis words.
PROGRAM = """\
%
(T1 D=50. CR=0. - FACE MILL)
(T5 8MM BALL MILL)
(T6 6MM BALL MILL)
G90 G94 G17 G21
G53 G0 Z0.
T1 M6
S3000 M3
G54
G0 A0. C0.
G0 X-60. Y0.
G0 Z35.
G1 Z30. F1000.
X60.
G53 G0 Z0.
T5 M6
S9000 M3
G54
G0 A-20. C0.
G43.4 H5
G0 X20. Y0.
G0 Z40.
G1 Z10. F1500.
X19.5 Y4. A-22. C10.
X18.8 Y7. A-24. C20.
G49
G53 G0 Z0.
T6 M6
S9000 M3
G54
G0 A-20. C0.
G0 X20. Y0.
G0 Z40.
G1 Z10. F1500.
X19.5 Y4. A-22. C10.
X18.8 Y7. A-24. C20.
G53 G0 Z0.
M30
%
"""
MACHINE = ("-m", "hayashi-640123")


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_text(PROGRAM)
    return path


def test_a_program_is_listed_without_its_machine(program):
    found = run("info", program)
    assert found.exit_code == 0, found.output
    lines = found.stdout.splitlines()
    assert lines[0] == "part.nc: ISO, control fanuc, mm"
    assert [" ".join(line.split()) for line in lines[2:5]] == [
        "1 12-14 3-axis 1 3000 G54 3 125 7.5 1000",
        "2 22-25 simultaneous, TCP 5 ball:8 9000 G54 4 37 1.5 1500",
        # Fanuc's F counts a degree as a millimetre.
        "3 33-36 simultaneous 6 ball:6 9000 G54 4 ? 2.1 ?",
    ]
    assert "No machine is given" in found.stdout
    assert "No machine is given" not in run("info", program, *MACHINE).stdout
    third = json.loads(run("info", program, "--json").stdout)["operations"][2]
    assert (third["unit"], third["cut_length"], third["feeds"]) == ("mm", None, None)


def test_tools_by_comment_are_measured_in_the_programs_unit(tmp_path):
    path = tmp_path / "inch.nc"
    path.write_text("(T2 D=.5 BALL MILL)\nG20 G90 G94\nT2 M6\nG0 X0 Y0 Z1 A0\nG1 X1 A-5 F10\nX2 A-10\nM30\n")
    assert "ball:12.7" in run("info", path).stdout


def test_a_comment_beside_the_tool_change_names_that_tools_cutter(tmp_path):
    path = tmp_path / "beside.nc"
    path.write_text("G21 G90 G94\nT7 M6 (6MM BALL MILL)\nG0 X0 Y0 Z1 A0\nG1 X1 A-5 F10\nX2 A-10\nM30\n")
    assert "7 ball:6" in run("info", path).stdout


@pytest.mark.parametrize("start", ["X0,Y0,Z100,A0,C0", "X0 Y0 Z100 A0 C0", "X=0, Y=0, Z=100, A=0, C=0"])
def test_the_start_takes_rotary_axes_as_people_write_them(tmp_path, start):
    path = tmp_path / "moves.nc"
    path.write_text("G21 G90 G94\nG91 G1 A-5. C10. X1. F500\nX1. A-5.\nG90\nM30\n")
    assert run("info", path).exit_code == 2
    found = run("info", path, "--start", start)
    assert found.exit_code == 0, found.output
    assert "simultaneous" in found.stdout


def test_a_start_that_names_no_axis_is_refused_with_the_form(program):
    found = run("info", program, "--start", "0,0,100")
    assert found.exit_code == 2
    assert "--start '0,0,100' isn't of the form X18,Y74,Z0,A0,C90 (mm and deg)" in found.stderr


def test_verification_takes_the_cutter_of_the_comments_and_says_so(program):
    words = ("verify", program, *MACHINE, "--rapid", 10000, "--operation", 2)
    document = json.loads(run(*words, "--json").stdout)
    [said] = [finding for finding in document["findings"] if finding["code"] == "tool-by-comment"]
    assert said["place"]["line"] == 3
    assert said["message"].startswith("tool 5 is taken as ball:8, as a comment says")
    risks = json.dumps(document["not_checked"])
    assert "no tool was given" not in risks
    given = json.loads(run(*words, "--tool", "ball:10", "--json").stdout)
    assert "tool-by-comment" not in given["counts"]


def test_a_part_needs_a_cutter_that_is_given_or_stated(program):
    part = Path(__file__).parents[3] / "examples" / "overhang" / "part.stl"
    found = run("verify", program, *MACHINE, "--rapid", 10000, "--operation", 1, "--part", part)
    assert found.exit_code == 2
    assert "part.nc: a part is checked against a cutter; name the tool (--tool ball:10)" in found.stderr


def test_a_path_with_axes_may_lean_by_15_degrees_where_nothing_bounds_it_and_that_is_said(tmp_path):
    path = tmp_path / "axes.csv"
    rows = [f"{x},0,0,{0.01 * x},0.1,{(0.99 - 1e-4 * x * x) ** 0.5:.9f}" for x in range(20)]
    path.write_text("\n".join(["x,y,z,i,j,k", *rows]))
    words = ("optimise", path, *MACHINE, "--tool", "ball:6", "--effort", "quick")
    document = json.loads(run(*words, "--json").stdout)
    [said] = [f for f in document["findings"] if f["code"] == "cone-assumed"]
    assert said["severity"] == "note"
    assert "within 15 deg of the programmed axis; choose that angle (--cone 20)" in said["message"]
    asked = json.loads(run(*words, "--cone", 15, "--json").stdout)
    assert asked["energy"] == document["energy"]
    assert "cone-assumed" not in {finding["code"] for finding in asked["findings"]}


def shown(monkeypatch, *words: object) -> tuple[dict[str, Any], dict[str, np.ndarray], str]:
    """What a preview shows: its head, its arrays, and the page."""
    pages = []
    monkeypatch.setattr("fiveaxis.show.viewer.serving.Preview.wait", lambda viewer: pages.append(viewer.page))
    found = run("preview", *words, "--no-browser")
    assert found.exit_code == 0, found.output
    return *unpacked(pages[0]), pages[0]


def test_a_program_is_previewed_as_it_is_with_its_lines_and_the_tool_of_each_operation(monkeypatch, program):
    head, arrays, page = shown(monkeypatch, program, *MACHINE, "--tool-length", 100)
    assert (head["sides"], head["text"]) == (["program"], PROGRAM.split("\n"))
    line, tool = arrays["0/line"], arrays["0/tool"]
    assert [sorted(set(line[tool == number].tolist())) for number in range(3)] == [
        [12, 13, 14],
        [22, 23, 24, 25],
        [33, 34, 35, 36],
    ]
    assert "Assumed: tool 1 is drawn as ball:6 and checked against nothing, as no comment states" in page
    one = shown(monkeypatch, program, *MACHINE, "--tool-length", 100, "--operation", 3)[1]
    assert set(one["0/line"].tolist()) == {33, 34, 35, 36}


def test_a_preview_of_what_is_no_program_says_where_its_result_is_shown(tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    found = run("preview", path, *MACHINE, "--no-browser")
    assert found.exit_code == 2
    assert "path.csv: is no NC program; `fiveaxis optimise -o OUT` leaves a preview" in found.stderr


def test_axis_values_are_shown_as_the_control_counts_them(monkeypatch, program):
    machine = load_machine("linuxcnc-xyzac-trt")
    head, arrays, _ = shown(monkeypatch, program, "-m", machine.name, "--tool-length", 100, "--operation", 3)
    signs = {axis["letter"]: axis["sign"] for axis in head["machine"]["axes"]}
    assert signs == {axis.letter: -1 if axis.reversed is True else 1 for axis in machine.axes}
    assert -1 in signs.values()
    last = arrays["0/positions"].reshape(-1, 5)[-1]
    np.testing.assert_allclose(np.degrees(last[3:]) * [signs["A"], signs["C"]], [-24.0, 20.0], rtol=1e-6)
