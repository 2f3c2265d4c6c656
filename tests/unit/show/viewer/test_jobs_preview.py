"""What a job leaves in its preview: all that it kept clear of, and what verification found."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.stock_on_page import surface, unpacked

from fiveaxis.job import load_surroundings, read_job, run_job, write_outcome
from fiveaxis.show.viewer.page import render_page
from fiveaxis.show.viewer.shown import Beside

JOB = """
input = "arc.csv"
machine = "hayashi-640123"
tool = "tool.toml"
tilt = [10, 70]
effort = "quick"
stock = "stock.stl"
keep_clear = false
[clearance]
holder = 40
[[fixture]]
name = "left <clamp>"
box = {size = [10, 10, 10], center = [-60, 0, 0]}
"""
TOOL = """
shape = "ball"
diameter = 8
shank_diameter = 7
[holder]
stick_out = 25
sections = [{length = 40, diameter = 40}]
"""


CUT = """
input = "arc.csv"
machine = "hayashi-640123"
tool = "ball:8"
tilt = [10, 70]
effort = "quick"
part = "part.stl"
stock = "part+1"
stock_resolution = 0.5
stock_tolerance = 0.2
"""


def write_job(folder: Path, job: str) -> None:
    """Write a job along an arc at z = 0."""
    turn = np.linspace(-1.0, 1.0, 12)
    rows = np.column_stack([15.0 * np.cos(turn), 40.0 * np.sin(turn), np.zeros_like(turn)])
    lines = [f"{x:.6f},{y:.6f},{z:.6f},0,0,1,1000" for x, y, z in rows]
    (folder / "arc.csv").write_text("x,y,z,nx,ny,nz,feed\n" + "\n".join(lines) + "\n")
    (folder / "tool.toml").write_text(TOOL)
    (folder / "job.toml").write_text(job)


@pytest.mark.usefixtures("undrawn")
def test_a_stock_that_a_job_cuts_has_its_map_in_preview_and_report_by_one_tolerance(tmp_path):
    write_job(tmp_path, CUT)
    part = trimesh.creation.box((60.0, 100.0, 10.0))
    part.apply_translation([0.0, 0.0, -5.0])
    part.export(tmp_path / "part.stl")
    outcome = run_job(read_job(tmp_path / "job.toml"))
    write_outcome(outcome, tmp_path / "out")
    page, report = (
        (tmp_path / "out" / name).read_text(encoding="utf-8") for name in ("preview.html", "report.html")
    )
    assert "within 0.2 mm of the part" in page
    assert "(±0.20 mm)" in report
    head, arrays = unpacked(page)
    first, last = (surface(head, arrays, step) for step in (0, len(arrays["stock/clock"]) - 1))
    removed = outcome.verdict.cut.removal.volume.sum(axis=1).mean()
    # The preview cuts with the lead-in and lead-out, too.
    assert 0.95 * removed < first.volume - last.volume < 1.5 * removed


@pytest.mark.usefixtures("undrawn")
def test_a_jobs_preview_shows_stock_fixtures_and_findings(tmp_path):
    write_job(tmp_path, JOB)
    stock = trimesh.creation.box((60.0, 100.0, 10.0))
    stock.apply_translation([0.0, 0.0, -10.0])
    stock.export(tmp_path / "stock.stl")
    outcome = run_job(read_job(tmp_path / "job.toml"))
    write_outcome(outcome, tmp_path / "out")
    page = (tmp_path / "out" / "preview.html").read_text(encoding="utf-8")
    around, findings = load_surroundings(outcome.job), outcome.verdict.findings
    assert findings, "the holder comes nearer to the stock than its clearance"
    assert page == render_page(
        outcome.solution, Beside(program=outcome.program, surroundings=around, findings=findings)
    )
    assert "fixtures: left &lt;clamp&gt;" in page
    assert 'data-node="workpiece/stock"' in page
    assert f"findings: {len(findings)}" in page
    assert "No holder is known" not in page
