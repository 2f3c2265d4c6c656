"""A job's program comes to its first location by a way that was checked."""

import numpy as np
import trimesh

from fiveaxis.job import Job, run_job


def test_a_job_whose_usual_lead_in_is_blocked_comes_from_the_side(tmp_path):
    rows = "".join(f"{x},0,0,0,0,1\n" for x in (-10, -5, 0, 5, 10))
    (tmp_path / "path.csv").write_text("x,y,z,i,j,k\n" + rows)
    box = trimesh.creation.box
    ledge, floor = box(bounds=[[-60, 2.5, 11], [60, 40, 16]]), box(bounds=[[-60, -40, -10], [60, 40, 0]])
    trimesh.util.concatenate([ledge, floor]).export(tmp_path / "part.stl")
    job = Job(
        input=tmp_path / "path.csv",
        machine="hayashi-640123",
        tool="lollipop:10:4",
        cone=2.0,
        part=tmp_path / "part.stl",
    )
    outcome = run_job(job)
    assert outcome.ok
    lead_in = outcome.program.motion.lead_in
    assert abs(lead_in[0]) + abs(lead_in[1]) > 4.0
    text = " ".join(outcome.program.text.lines)
    assert "checked: approach: a lead-in of 5 mm" in text
    assert "checked: retract: a lead-out of" in text
    assert np.linalg.norm(outcome.program.motion.lead_out) >= 1.0
    assert "not checked: the initial turn of the rotary axes" in text
