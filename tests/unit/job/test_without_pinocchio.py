"""Where pinocchio and coal can't be imported, programs are the same, and verified with the same findings."""

import sys
from pathlib import Path

import pytest
import trimesh

import fiveaxis as fx
from fiveaxis.base import Workpiece
from fiveaxis.check import Fixture, Surroundings
from fiveaxis.job import read_job, run_job
from fiveaxis.model import Box, Cylinder
from fiveaxis.model.toolpath.tool import Holder, Section

EXAMPLE = Path(__file__).parents[3] / "examples/overhang/job.toml"
TILT = (15, 75)
KINEMATICS = "kinematics: "


@pytest.fixture
def hide(monkeypatch):
    """Make both libraries impossible to import, as on a computer for which they have no wheel."""
    pytest.importorskip("pinocchio")

    def hide() -> None:
        for name in ("pinocchio", "coal"):
            monkeypatch.setitem(sys.modules, name, None)

    return hide


def told(report: fx.Report) -> tuple[object, ...]:
    """Verdict, findings and sentences, but for the one that names the kinematics."""
    findings = [(f.code, f.severity, f.message, f.place) for f in report.findings]
    passed = [sentence for sentence in report.passed if not sentence.startswith(KINEMATICS)]
    return report.ok, dict(report.counts), findings, passed, report.not_checked


@pytest.mark.slow
def test_the_example_gets_the_same_program_and_verdict(hide):
    job = read_job(EXAMPLE, effort="quick")
    first = run_job(job)
    hide()
    second = run_job(job)
    assert first.ok
    assert second.program.text.lines == first.program.text.lines
    assert told(second.verdict) == told(first.verdict)
    assert f"{KINEMATICS}own URDF forward kinematics" in second.verdict.passed
    assert any(sentence.startswith(f"{KINEMATICS}pinocchio") for sentence in first.verdict.passed)


@pytest.mark.parametrize("jaw", ["box", "cylinder"])
def test_a_holder_beside_a_clamp_gets_the_same_findings(hide, jaw):
    part = trimesh.creation.box((16.0, 16.0, 10.0))
    part.apply_translation((0.0, 0.0, 5.0))
    shapes = {
        "box": Box(size=(20.0, 40.0, 20.0), center=(35.0, 0.0, 10.0)),
        "cylinder": Cylinder(10.0, 40.0, (35.0, 0.0, 10.0), (0.0, 1.0, 0.0)),
    }
    around = Surroundings.of(Workpiece(part=part), fixtures=(Fixture("clamp", shapes[jaw]),))
    holder = Holder(stick_out=30.0, sections=(Section(length=40.0, diameter=40.0),))
    tool = fx.Tool.ball(8, shank_diameter=7.0, holder=holder)
    machine = fx.load_machine("hayashi-640123")
    toolpath = fx.plan_contour(part, tool, stepdown=10, spacing=1.0)
    blind = fx.optimise(toolpath, machine, tilt=TILT, effort="quick")

    def verify() -> list[fx.Report]:
        return [
            fx.verify(blind.motion, machine, blind.toolpath, tilt=TILT, surroundings=around, between=between)
            for between in ("joint", "tcp")
        ]

    before = verify()
    assert any("holder-collision" in report.counts for report in before)
    hide()
    assert [told(report) for report in verify()] == [told(report) for report in before]
