"""`fiveaxis info` and `plan` on a STEP file."""

import json
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fiveaxis.cli.commands import app

pytestmark = pytest.mark.skipif(find_spec("OCP") is None, reason="needs Open Cascade: fiveaxis[step]")
CONE = Path(__file__).parents[2] / "golden/cad_cone.step"


def run(*words: str) -> tuple[int, str, str]:
    ended = CliRunner().invoke(app, [*words])
    return ended.exit_code, ended.stdout, ended.stderr


def test_info_lists_the_faces_with_the_fit_of_the_ball():
    code, out, _ = run("info", str(CONE), "--tool", "ball:4")
    assert code == 0
    wall, top, bottom = (line.split() for line in out.splitlines()[-3:])
    assert wall[:4] == ["1", "1", "cone", "449.25"]
    assert (top[2], bottom[2]) == ("plane", "plane")
    assert "fits" in wall


def test_info_as_json_has_the_same_figures():
    code, out, _ = run("info", str(CONE), "--json")
    sheet = json.loads(out)
    assert code == 0
    assert sheet["closed"]
    assert [face["number"] for face in sheet["faces"]] == [1, 2, 3]
    assert sheet["faces"][2]["overhang_share"] == 1.0


def test_a_face_that_is_not_there_is_refused_with_those_that_are():
    code, _, err = run("plan", str(CONE), "--tool", "ball:4", "--faces", "12")
    assert code == 2
    assert "no face is called '12'; there are numbers 1 to 3" in " ".join(err.split())


def test_options_of_parts_are_refused_beside_a_machine():
    code, _, err = run("info", "hayashi-640123", "--body", "1")
    assert code == 2
    assert "are for CAD files" in " ".join(err.split())
