"""Job files, and the settings of the command line over them."""

from pathlib import Path

import numpy as np
import pytest

from fiveaxis.base import require_folder
from fiveaxis.base.errors import JobError, MachineError, SettingError
from fiveaxis.check import verify
from fiveaxis.job import load_job_machine, make_job, read_job, run_job
from fiveaxis.job.loading import load_job_toolpath, part_of
from fiveaxis.job.reading import require_input
from fiveaxis.show.report.words import plain

POINTS = "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n"
LINES = {
    "input": '"path.csv"',
    "machine": '"hayashi-640123"',
    "tool": '"ball:10"',
    "tilt": "[15, 75]",
}


def write_job(folder: Path, **keys: str) -> Path:
    """Write a job file, line 1 a comment, and the path that it names."""
    (folder / "path.csv").write_text(POINTS)
    path = folder / "job.toml"
    path.write_text("\n".join(["# a job", *(f"{k} = {v}" for k, v in (LINES | keys).items())]) + "\n")
    return path


def test_paths_in_a_job_are_relative_to_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path.parent)
    (tmp_path / "part.stl").write_text("")
    machine = Path(__file__).parents[3] / "machines" / "hayashi-640123.toml"
    (tmp_path / "own.toml").write_bytes(machine.read_bytes())
    keys = {"part": '"part.stl"', "machine": '"own.toml"', "drives": '"hayashi-640123"'}
    job = read_job(write_job(tmp_path, **keys))
    assert (job.input, job.part) == (tmp_path / "path.csv", tmp_path / "part.stl")
    assert (job.machine, job.drives) == (str(tmp_path / "own.toml"), "hayashi-640123")
    assert len(load_job_toolpath(job)) == 2
    assert load_job_machine(job).letters == "XYZAC"


def test_a_cone_from_the_command_line_replaces_the_tilt_of_the_job(tmp_path):
    job = read_job(write_job(tmp_path), cone=20.0)
    assert (job.tilt, job.cone) == (None, 20.0)


def test_a_tilt_from_the_command_line_replaces_the_cone_of_the_job(tmp_path):
    path = write_job(tmp_path)
    path.write_text(path.read_text().replace("tilt = [15, 75]", "cone = 20"))
    job = read_job(path, tilt=(10.0, 60.0))
    assert (job.tilt, job.cone) == ((10.0, 60.0), None)


def test_options_go_over_a_job_and_leave_the_rest(tmp_path):
    path = write_job(tmp_path, plan="{ stepdown = 3, overhang = true }", feed="500")
    job = read_job(path, feed=800.0, tool=None, plan={"stepdown": 2.0, "spacing": None})
    assert (job.feed, job.tool, job.tilt) == (800.0, "ball:10", (15.0, 75.0))
    assert (job.plan.stepdown, job.plan.spacing, job.plan.overhang) == (2.0, 0.5, True)


def test_a_name_that_an_option_replaces_is_not_looked_for(tmp_path):
    path = write_job(tmp_path, machine='"on-another-computer.toml"')
    assert read_job(path, machine="hayashi-640123").machine == "hayashi-640123"


@pytest.mark.parametrize(
    ("key", "value", "line", "message"),
    [
        ("stepdwn", "1", 6, "unknown key 'stepdwn'; the nearest known one is 'plan.stepdown'"),
        ("tilt", '"15:75"', 5, "tilt = '15:75' must be a list"),
        ("tilt", "[15]", 5, "tilt[1] is missing"),
        ("tilt", "[75, 15]", 5, "tilt range 75…15 deg is empty, reversed"),
        ("tilt", "[nan, 15]", 5, "tilt[0] = nan must be a finite number"),
        ("cone", "-3", 6, "cone = -3 must be above 0"),
        ("feed", '"fast"', 6, "feed = 'fast' must be a number"),
        ("max_turn", "0", 6, "max_turn = 0 must be above 0"),
        ("unit", '"cm"', 6, "unit = 'cm' must be 'mm', 'inch' or 'm'"),
        ("tool", '"bull:3"', 4, "tool 'bull:3': 1 figures where bull has 2"),
        ("tool", "10", 4, "tool = 10 must be text in quotes"),
        ("control", '"linuxc"', 6, "did you mean 'linuxcnc'?"),
        ("machine", '"hayashi"', 3, "unknown machine 'hayashi'; did you mean hayashi-640123?"),
        ("machine", '"gone.toml"', 3, "gone.toml: no such file"),
        ("drives", '"nobody"', 6, "drives: unknown machine 'nobody'"),
        ("input", '"gone.stl"', 2, "gone.stl: no such file"),
        ("input", '"part.prt"', 2, "unknown suffix '.prt'"),
        ("part", '"gone.stl"', 6, "gone.stl: no such file"),
        ("plan", "3", 6, "plan = 3 must be a table"),
        ("plan", "{ stepdown = 0 }", 6, "plan.stepdown = 0 must be above 0"),
        ("plan", "{ direction = 'up' }", 6, "must be 'climb', 'conventional' or 'zigzag'"),
    ],
)
def test_a_wrong_setting_is_reported_on_its_line(tmp_path, key, value, line, message):
    (tmp_path / "part.prt").touch()
    path = write_job(tmp_path, **{key: value})
    with pytest.raises(JobError) as caught:
        read_job(path)
    assert (caught.value.file, caught.value.line) == (str(path), line)
    assert message in caught.value.message


def test_a_fault_inside_a_machine_file_is_reported_there(tmp_path):
    (tmp_path / "own.toml").write_text('name = "own"\ncode = "640123"\ncolour = "blue"\n')
    with pytest.raises(MachineError, match=r"own\.toml:3: unknown key 'colour'"):
        read_job(write_job(tmp_path, machine='"own.toml"'))


def test_a_job_without_a_machine_can_be_planned_but_not_optimised(tmp_path):
    (tmp_path / "path.csv").write_text(POINTS)
    job = make_job(input=tmp_path / "path.csv", tool="ball:10")
    assert len(load_job_toolpath(job)) == 2
    with pytest.raises(JobError, match="--machine is missing"):
        load_job_machine(job)


def test_settings_that_a_list_of_locations_has_no_use_for_are_refused(tmp_path):
    job = read_job(write_job(tmp_path), plan={"stepdown": 1.0, "overhang": True})
    with pytest.raises(JobError, match=r"path\.csv: overhang, stepdown is for planning on a mesh"):
        load_job_toolpath(job)


@pytest.mark.parametrize("name", ["part.STL", "path.csv", "path.cls.gz", "path.APT"])
def test_every_known_kind_of_input_passes(tmp_path, name):
    (tmp_path / name).write_text("")
    require_input(tmp_path / name)


def test_the_part_is_the_mesh_that_is_planned_on_unless_another_is_named(tmp_path):
    planned = make_job(input=tmp_path / "a.stl", tool="ball:10")
    listed = make_job(input=tmp_path / "a.csv", tool="ball:10")
    named = make_job(planned, part=tmp_path / "b.stl")
    assert (part_of(planned), part_of(listed)) == (tmp_path / "a.stl", None)
    assert part_of(named) == tmp_path / "b.stl"


def test_a_folder_for_results_is_tried_and_not_made(tmp_path):
    assert require_folder(tmp_path / "a" / "b") == tmp_path
    assert list(tmp_path.iterdir()) == []


def test_a_file_with_the_name_of_the_folder_is_refused(tmp_path):
    (tmp_path / "a").write_text("")
    with pytest.raises(SettingError, match=r"a: is a file; name a folder"):
        require_folder(tmp_path / "a" / "b")


def test_the_document_of_a_job_begins_with_what_to_do_at_the_machine(tmp_path):
    (tmp_path / "path.csv").write_text(POINTS)
    words = {"machine": "hayashi-640123", "tool": "ball:10", "tilt": (15, 75), "effort": "quick"}
    document = run_job(make_job(input=tmp_path / "path.csv", nc={"work_offset": "G55"}, **words)).document
    assert next(iter(document)) == "answers"
    assert document["answers"]["verdict"] == "partial"
    details = [tuple(detail.values()) for detail in document["answers"]["next"]["details"]]
    assert ("Work offset", "G55.") in details
    turned = document["program"]["preparation"]["start"]
    assert details[0][1].startswith(f"the approach turns A {plain(round(turned['A'], 3))}°, C ")
    assert any(about == "Tool" and "measure it" in text for about, text in details)


def test_blocks_that_the_program_inserts_are_no_findings_about_the_locations(tmp_path):
    turn = np.linspace(-1.0, 1.0, 12)
    rows = np.column_stack([15.0 * np.cos(turn), 40.0 * np.sin(turn), np.zeros_like(turn)])
    lines = [f"{x:.6f},{y:.6f},{z:.6f},0,0,1,1000" for x, y, z in rows]
    (tmp_path / "bow.csv").write_text("x,y,z,nx,ny,nz,feed\n" + "\n".join(lines) + "\n")
    words = {"machine": "hayashi-640123", "tool": "ball:8", "tilt": (10, 70), "effort": "quick"}
    outcome = run_job(make_job(input=tmp_path / "bow.csv", path_shape="chord", **words))
    assert outcome.document["verification"]["figures"]["tip_deviation_mm"] <= 0.005
    assert outcome.document["program"]["inserted"] > 0
    assert "tip-deviation" not in {f["code"] for f in outcome.document["findings"]}
    assert outcome.gate.is_open
    # Without the blocks inserted the same motion is refused.
    solution = outcome.solution
    given = np.flatnonzero(~solution.toolpath.inserted)
    verdict = verify(solution.motion.at(given), solution.machine, solution.toolpath.at(given))
    assert "tip-deviation" in {c.code for c in verdict.summary()}
