"""How deep is a gouge: a cut of known depth below a floor, at tolerances on both sides of it."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.unverified_text import write_text
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base.errors import SettingError
from fiveaxis.check import Tolerances
from fiveaxis.check.verification.verdict import verify
from fiveaxis.cli.commands import app
from fiveaxis.job import make_job
from fiveaxis.model import Tool, Toolpath, follow, load_machine

# mm: the floor is flat, so a ball that touches this far below it reaches as deep into the part.
DEPTH = 0.03
FINE, COARSE = 0.005, 0.04
# A program's rows may be as much deeper: 0.01 mm as they lie on chords, 0.005 mm as blocks keep to the path.
ROW = 0.015


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A block whose top is at Z0."""
    box = trimesh.creation.box((80.0, 80.0, 20.0))
    box.apply_translation([0.0, 0.0, -10.0])
    path = tmp_path_factory.mktemp("floor") / "floor.stl"
    box.export(path)
    return path


@pytest.fixture(scope="module")
def cut() -> Toolpath:
    """A straight cut in the floor, `DEPTH` too deep."""
    x = np.linspace(-10.0, 10.0, 9)
    contact = np.column_stack([x, np.zeros(9), np.full(9, -DEPTH)])
    return Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (9, 1)), Tool.ball(10.0))


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same cut as a list of points."""
    path = tmp_path_factory.mktemp("cut") / "cut.csv"
    rows = [f"{x},0,{-DEPTH},0,0,1" for x in np.linspace(-10.0, 10.0, 9)]
    path.write_text("x,y,z,nx,ny,nz\n" + "\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def program(cut: Toolpath, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The cut as a program, the tool leaning by 30 deg."""
    machine = load_machine("hayashi-640123")
    motion = follow(cut, machine, np.tile([0.0, np.radians(30.0)], (9, 1)))
    return write_text(motion, tmp_path_factory.mktemp("program") / "cut.ngc", machine=machine)


def run(*words: object):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.parametrize(("tolerance", "found"), [(FINE, True), (DEPTH - 1e-6, True), (DEPTH + 1e-6, False)])
def test_a_gouge_is_one_from_the_tolerance_on(cut, floor, hayashi, tolerance, found):
    motion = follow(cut, hayashi, np.zeros((9, 2)))
    report = verify(motion, hayashi, cut, part=floor, gouge_tolerance=tolerance)
    assert ("gouge" in report.counts) is found
    assert report.figures["gouge_depth_mm"] == pytest.approx(DEPTH, abs=1e-9)
    between = f"{tolerance:.4g} mm deep at a location, {tolerance + 0.01:g} mm between"
    assert any(between in sentence for sentence in report.passed) is not found


def test_within_a_move_a_gouge_may_be_a_hundredth_deeper(floor, hayashi):
    """A bar that sticks out of the floor between two locations, by as much as the ball reaches into it."""
    bar = trimesh.creation.box((1.0, 80.0, 10.0 + DEPTH))
    bar.apply_translation([0.0, 0.0, (DEPTH - 10.0) / 2.0])
    part = trimesh.util.concatenate([trimesh.load(floor), bar])
    contact = np.array([[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * 2, Tool.ball(10.0))
    motion = follow(path, hayashi, np.zeros((2, 2)))
    for tolerance, found in ((DEPTH - 0.0101, True), (DEPTH - 0.0099, False)):
        report = verify(motion, hayashi, path, part=part, gouge_tolerance=tolerance)
        assert ("gouge" in report.counts) is found


@pytest.mark.parametrize(
    ("tolerance", "found"), [(DEPTH - ROW - 1e-4, True), (DEPTH - ROW + 1e-4, False), (COARSE, False)]
)
def test_a_program_is_checked_with_the_tolerance(program, floor, hayashi, tolerance, found):
    report = fx.verify_program(program, hayashi, tool=Tool.ball(10.0), part=floor, gouge_tolerance=tolerance)
    assert ("gouge" in report.counts) is found
    named = f"(gouge tolerance {tolerance:g} mm)"
    assert any(named in sentence for sentence in report.passed) is not found


@pytest.mark.parametrize("tolerance", [0.0, -0.01, math.nan, math.inf])
def test_a_tolerance_that_is_none_is_refused(cut, floor, hayashi, program, tolerance):
    motion = follow(cut, hayashi, np.zeros((9, 2)))
    with pytest.raises(SettingError, match=r"gouge_tolerance is .* mm; it must be a finite number above 0"):
        verify(motion, hayashi, cut, part=floor, gouge_tolerance=tolerance)
    with pytest.raises(SettingError, match="gouge_tolerance"):
        fx.verify_program(program, hayashi, gouge_tolerance=tolerance)
    with pytest.raises(fx.FiveAxisError, match="gouge_tolerance"):
        make_job(input="cut.csv", gouge_tolerance=tolerance)


def test_two_tolerances_that_differ_are_refused(cut, hayashi):
    motion = follow(cut, hayashi, np.zeros((9, 2)))
    with pytest.raises(SettingError, match="give one of them"):
        verify(motion, hayashi, cut, gouge_tolerance=0.02, tolerances=Tolerances(gouge=0.05))


def test_a_job_takes_it_and_its_reports_name_it(points, floor, tmp_path):
    words = (
        "optimise",
        points,
        "-m",
        "hayashi-640123",
        "--tool",
        "ball:10",
        "--tilt",
        "10:60",
        "--part",
        floor,
    )
    given = (*words, "--effort", "quick", "--only-verify")
    fine = run(*given, "--gouge-tolerance", FINE, "-o", tmp_path / "fine")
    assert fine.exit_code == 1
    assert "gouge (" in fine.stdout
    coarse = run(*given, "--gouge-tolerance", COARSE, "-o", tmp_path / "coarse")
    assert coarse.exit_code == 0, coarse.stderr
    document = json.loads((tmp_path / "coarse" / "report.json").read_text())
    said = "at most 0.04 mm deep at a location, 0.055 mm between (gouge tolerance 0.04 mm)"
    assert any(said in sentence for sentence in document["verification"]["passed"])
    assert said in (tmp_path / "coarse" / "report.html").read_text(encoding="utf-8")
