"""A job through all stages: its approach, and the solutions of a front."""

import json

import numpy as np
import pytest
import trimesh

from fiveaxis.job import Job, make_job, run_job, write_outcome

FILES = {"motion.csv", "report.json", "report.html", "preview.html", "program.ngc"}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """Contacts round a lobed wall that overhangs, as a table of points."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(60, -0.3)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    r = 20.0 + 3.0 * np.cos(3.0 * angle)
    rows = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(60, 10.0), normal])
    path = tmp_path_factory.mktemp("front") / "wall.csv"
    np.savetxt(path, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    given = {"machine": "hayashi-640123", "tool": "ball:6", "tilt": (15, 75), "feed": 500, "effort": "quick"}
    return make_job(input=path, front=4, pick=2, **given)


@pytest.fixture(scope="module")
def outcome(job):
    return run_job(job)


def test_the_picked_solution_is_the_result(outcome):
    front = outcome.front
    assert len(outcome.members) == len(front.points) >= 2
    assert outcome.solution.motion is outcome.members[1].solution.motion
    assert outcome.document["front"]["picked"] == 2
    assert outcome.program is outcome.members[1].program


def test_every_solution_passed_the_gate_and_the_document_lists_its_cost(outcome):
    points = outcome.document["front"]["points"]
    assert [point["number"] for point in points] == list(range(1, len(points) + 1))
    for point, one in zip(points, outcome.members, strict=True):
        assert point["released"] is one.gate.is_open
        assert point["energy_J"] == one.solution.energy.total
        assert one.verdict.figures["contact_error_mm"] is not None
    assert points[0]["energy_J"] <= points[-1]["energy_J"]
    assert points[0]["bend_rad2"] >= points[-1]["bend_rad2"]


def test_each_has_its_files_and_those_of_an_earlier_run_go(outcome, tmp_path):
    earlier = tmp_path / "front" / "9"
    earlier.mkdir(parents=True)
    (earlier / "program.mpf").write_text("M30")
    (tmp_path / "front" / "notes.txt").write_text("mine")
    write_outcome(outcome, tmp_path)
    assert not earlier.exists()
    assert (tmp_path / "front" / "notes.txt").read_text() == "mine"
    for number, one in enumerate(outcome.members, start=1):
        folder = tmp_path / "front" / str(number)
        assert {path.name for path in folder.iterdir()} == FILES
        told = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        assert told["energy"]["total"] == one.solution.energy.total
    for name in FILES - {"report.json", "report.html"}:
        assert (tmp_path / name).read_bytes() == (tmp_path / "front" / "2" / name).read_bytes()
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Energy against steadiness" in page
    assert "Number 2 is the optimised program" in page


@pytest.mark.slow
def test_on_a_known_clock_no_program_of_a_front_beats_another_as_delivered(job):
    clocked = make_job(job, machine="linuxcnc-xyzac-trt", front=4, pick=1, feed_share=0.7, feed=2000.0)
    outcome = run_job(clocked)
    figures = [(one.solution.energy.total, one.solution.energy.time) for one in outcome.members]
    assert len(figures) >= 2
    # Cheaper ones take longer, so none is as good as another in both.
    assert figures == sorted(figures)
    assert [time for _, time in figures] == sorted((time for _, time in figures), reverse=True)
    assert len({time for _, time in figures}) == len(figures)
    assert all(one.gate.is_open and one.verdict.ok for one in outcome.members)
    assert outcome.front.by_time
    assert outcome.program is outcome.members[0].program
    told = outcome.document["front"]["points"]
    assert [(p["energy_J"], p["program_time_s"]) for p in told] == figures
    limited = outcome.document["energy"]["limited"]
    assert sum(limited.values()) == pytest.approx(outcome.solution.energy.time)


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
        effort="quick",
    )
    outcome = run_job(job)
    assert outcome.ok
    lead_in = outcome.program.motion.lead_in
    assert abs(lead_in[0]) + abs(lead_in[1]) > 4.0
    text = " ".join(outcome.program.report.passed)
    assert "approach: a lead-in of 5 mm" in text
    assert "retract: a lead-out of" in text
    assert np.linalg.norm(outcome.program.motion.lead_out) >= 1.0 - 1e-9
    assert any(t.startswith("the initial turn of the rotary") for t in outcome.program.report.not_checked)
