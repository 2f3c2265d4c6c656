"""What a job leaves in its preview: all that it kept clear of, and what verification found."""

import numpy as np
import pytest

from fiveaxis.job import load_surroundings, read_job, run_job, write_outcome
from fiveaxis.viewer import render_page

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


@pytest.mark.usefixtures("undrawn")
def test_a_jobs_preview_shows_stock_fixtures_and_findings(tmp_path):
    import trimesh

    turn = np.linspace(-1.0, 1.0, 12)
    rows = np.column_stack([15.0 * np.cos(turn), 40.0 * np.sin(turn), np.zeros_like(turn)])
    lines = [f"{x:.6f},{y:.6f},{z:.6f},0,0,1,1000" for x, y, z in rows]
    (tmp_path / "arc.csv").write_text("x,y,z,nx,ny,nz,feed\n" + "\n".join(lines) + "\n")
    (tmp_path / "tool.toml").write_text(TOOL)
    (tmp_path / "job.toml").write_text(JOB)
    stock = trimesh.creation.box((60.0, 100.0, 10.0))
    stock.apply_translation([0.0, 0.0, -10.0])
    stock.export(tmp_path / "stock.stl")
    outcome = run_job(read_job(tmp_path / "job.toml"))
    write_outcome(outcome, tmp_path / "out")
    page = (tmp_path / "out" / "preview.html").read_text(encoding="utf-8")
    around, findings = load_surroundings(outcome.job), outcome.verdict.findings
    assert findings, "the holder comes nearer to the stock than its clearance"
    assert page == render_page(
        outcome.solution, program=outcome.program, surroundings=around, findings=findings
    )
    assert "fixtures: left &lt;clamp&gt;" in page
    assert 'data-node="workpiece/stock"' in page
    assert f"findings: {len(findings)}" in page
    assert "No holder is known" not in page
