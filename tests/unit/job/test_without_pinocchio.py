"""Without pinocchio and coal only verification and collision checks are missing, and it is said."""

import json
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.cli import app
from fiveaxis.job import make_job, run_job, write_outcome

MACHINE = "hayashi-640123"
TOOL = """
shape = "ball"
diameter = 8
length = 10
shank_diameter = 8
[holder]
stick_out = 30
sections = [{ length = 40, diameter = 30 }]
"""
CLAMP = {"name": "clamp", "box": {"size": (10, 10, 10), "center": (0, 0, 5)}}


@pytest.fixture(autouse=True)
def hidden(monkeypatch):
    """As on a platform without the wheel `pin`: neither library can be imported."""
    for name in ("pinocchio", "coal"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.fixture
def path(tmp_path):
    angle = np.linspace(0.0, 1.0, 12)
    around = np.column_stack([np.cos(angle), np.sin(angle), np.full(12, 0.3)])
    normal = around / np.linalg.norm(around, axis=1, keepdims=True)
    rows = np.hstack([25.0 * around + [0.0, 0.0, 20.0], normal])
    np.savetxt(tmp_path / "path.csv", rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    (tmp_path / "tool.toml").write_text(TOOL)
    return tmp_path / "path.csv"


def job_of(path, **more):
    words = {
        "machine": MACHINE,
        "tool": str(path.with_name("tool.toml")),
        "tilt": (15, 75),
        "effort": "quick",
    }
    return make_job(input=path, **words | more)


@pytest.mark.parametrize("fixture", [[], [CLAMP]], ids=["alone", "clamp"])
def test_a_job_is_optimised_and_reported_and_its_program_kept_back(path, tmp_path, fixture):
    outcome = run_job(job_of(path, fixture=fixture))
    assert not outcome.ok
    assert outcome.gate.kept == {"not-verified": 1}
    assert outcome.solution.energy.total > 0.0
    (finding,) = (f for f in outcome.verdict.findings if f.code == "not-verified")
    assert "which isn't installed" in finding.message
    assert "install the wheel `pin`" in finding.message
    write_outcome(outcome, tmp_path / "out")
    names = {file.name for file in (tmp_path / "out").iterdir()}
    assert names == {"motion.csv", "report.json", "report.html", "preview.html"}
    assert json.loads((tmp_path / "out/report.json").read_text())["kept_back"] == {"not-verified": 1}


def test_who_accepts_it_by_name_gets_a_program_that_says_so(path, tmp_path):
    outcome = run_job(job_of(path, override=["not-verified"]))
    write_outcome(outcome, tmp_path / "out")
    text = (tmp_path / "out/program.ngc").read_text()
    assert "NOT VERIFIED" in text
    assert "(OVERRIDDEN: not-verified [1])" in text
    assert "verified" not in text.replace("not-verified", "")


def test_what_only_verifies_says_what_is_missing(path):
    machine, toolpath = fx.load_machine(MACHINE), fx.read_toolpath(path, tool=fx.Tool.ball(8))
    solution = fx.optimise(toolpath, machine, tilt=(15, 75), effort="quick")
    with pytest.raises(fx.FiveAxisError, match="verification needs pinocchio, which isn't installed"):
        fx.verify(solution.motion, machine, toolpath, tilt=(15, 75))
    words = ["verify", str(path), "-m", MACHINE, "--tool", "ball:8", "--tilt", "15:75"]
    assert CliRunner().invoke(app, words).exit_code == 2
