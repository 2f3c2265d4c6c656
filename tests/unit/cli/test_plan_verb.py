"""`fiveaxis plan`: the planner's options by their names, and what it tells about a plan."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import fiveaxis
from fiveaxis.base.errors import Infeasible
from fiveaxis.cam import PlanOptions, path_quality
from fiveaxis.cli.commands import app
from fiveaxis.job import make_job, read_job, run_job
from fiveaxis.job.loading import load_job_toolpath

PART = Path(__file__).parents[3] / "examples" / "overhang" / "part.stl"
RASTER: dict[str, Any] = {
    "strategy": "raster",
    "stepover": 5.0,
    "raster_angle": 30.0,
    "spacing": 1.0,
    "direction": "zigzag",
    "order": "islands",
    "lead_in": 1.0,
    "lead_out": 0.5,
}
SPIRAL: dict[str, Any] = {"scallop": 0.2, "stepdown": 2.5, "spiral": True, "overhang": True}


def plan(*words: object) -> Any:
    return CliRunner().invoke(app, ["plan", str(PART), "--tool", "ball:8", *map(str, words)])


def words(options: dict[str, Any]) -> list[str]:
    flags = [f"--{name}" for name, value in options.items() if value is True]
    pairs = [(f"--{name.replace('_', '-')}", str(v)) for name, v in options.items() if v is not True]
    return [*flags, *(word for pair in pairs for word in pair)]


@pytest.mark.parametrize("options", [RASTER, SPIRAL])
def test_options_have_the_names_of_the_keywords_and_of_the_job_files_keys(options, tmp_path):
    found = plan(*words(options), "--json")
    assert found.exit_code == 0, found.output
    document = json.loads(found.stdout)
    direct = fiveaxis.plan_contour(PART, fiveaxis.Tool.ball(8), **options)
    lines = [f"{name} = {json.dumps(value)}" for name, value in options.items()]
    text = f'input = "{PART.as_posix()}"\ntool = "ball:8"\n[plan]\n' + "\n".join(lines)
    (tmp_path / "job.toml").write_text(text)
    by_file = load_job_toolpath(read_job(tmp_path / "job.toml"))
    assert document["locations"] == len(direct) == len(by_file)
    assert by_file.pivot.tobytes() == direct.pivot.tobytes()


def test_a_plan_prints_the_ridges_and_chords_that_were_measured():
    document = json.loads(plan(*words(SPIRAL), "--json").stdout)
    path = load_job_toolpath(make_job(input=PART, tool="ball:8", plan=SPIRAL))
    measured = path_quality(path, PART, PlanOptions(overhang=True))
    assert document["scallop_largest_mm"] == pytest.approx(measured.scallop_largest, abs=1e-6)
    assert document["scallop_mean_mm"] == pytest.approx(measured.scallop_mean, abs=1e-6)
    assert document["chord_error_mm"] == pytest.approx(measured.chord_largest, abs=1e-6)
    assert 0.1 < measured.scallop_mean < measured.scallop_largest < 0.2 + 0.02
    assert document["cut_length_mm"] + document["link_length_mm"] == pytest.approx(
        document["length_mm"], abs=0.002
    )


def test_a_plan_in_words_has_the_same_figures():
    shown = plan("--stepdown", "6")
    document = json.loads(plan("--stepdown", "6", "--json").stdout)
    assert shown.exit_code == 0
    size = document.pop("part_size_mm")
    assert f"part {' × '.join(f'{extent:.4g}' for extent in size)} mm" in shown.stdout
    del document["summary"], document["findings"]
    for name, value in document.items():
        assert f"{name}: {value}" in shown.stdout


def test_a_plan_says_what_its_file_has(tmp_path):
    file = tmp_path / "path.csv"
    said = plan("--stepdown", "6", "-o", file).stderr
    document = json.loads(plan("--stepdown", "6", "--json").stdout)
    counts = f"{document['locations']} locations, {document['passes']} passes, {document['length_mm']} mm"
    assert f"wrote {file}: {counts}, left out nothing" in said
    assert "wrote" not in plan("--stepdown", "6").stderr


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--stepover", "1"), "stepover = 1 mm is no option of the waterline strategy"),
        (("--scallop", "9"), "scallop = 9 mm must be less than the ball's radius, 4 mm"),
        (("--strategy", "zigzag"), "plan.strategy = 'zigzag' must be 'waterline', 'raster' or 'flow'"),
        (("--lead-in", "-1"), "plan.lead_in = -1.0 must be at least 0"),
    ],
)
def test_wrong_options_are_one_line_with_what_to_do(options, message):
    found = plan(*options)
    assert found.exit_code == 2
    assert message in found.output.replace("\n", " ")


@pytest.fixture
def dome(tmp_path):
    """Half a ball of 2 inches, its file in inches."""
    up, turn = np.meshgrid(np.linspace(0.0, np.pi / 2.0, 13), np.linspace(0.0, 2.0 * np.pi, 49))
    points = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1)
    path = tmp_path / "dome.stl"
    trimesh.convex.convex_hull(points.reshape(-1, 3)).export(path)
    return path


COARSE = ("--tool", "ball:10", "--stepdown", "6", "--spacing", "2")


def test_the_unit_of_a_mesh_is_an_option_and_a_key_of_jobs(dome, tmp_path):
    found = CliRunner().invoke(app, ["plan", str(dome), *COARSE, "--unit", "inch"])
    assert found.exit_code == 0
    assert "part 50.8 × 50.8 × 25.4 mm" in found.output
    assert "part-size" not in found.output
    (tmp_path / "job.toml").write_text(
        f'input = "{dome.name}"\nunit = "inch"\ntool = "ball:10"\n[plan]\nstepdown = 6\nspacing = 2\n'
    )
    again = CliRunner().invoke(app, ["plan", str(tmp_path / "job.toml")])
    assert again.stdout == found.stdout


@pytest.mark.parametrize("diameter", [2.1, 10.0])
def test_a_part_smaller_than_the_cutter_is_refused_with_its_size_in_other_units(dome, diameter):
    found = CliRunner().invoke(app, ["plan", str(dome), "--tool", f"ball:{diameter}", *COARSE[2:]])
    assert found.exit_code == 2
    assert f"and the cutter {diameter:g} mm: take a smaller one (--tool)" in found.output
    assert "the part measures 2 × 2 × 1 mm, read in mm" in found.output
    assert "inch makes it 50.8 × 50.8 × 25.4 mm" in found.output
    smaller = CliRunner().invoke(app, ["plan", str(dome), "--tool", "ball:1.5", *COARSE[2:-2]])
    assert "[part-size]" in smaller.output


def test_a_plan_of_millions_of_contacts_is_refused_at_once(dome):
    found = CliRunner().invoke(app, ["plan", str(dome), "--tool", "ball:10", "--unit", "m"])
    assert found.exit_code == 2
    assert "contact points, more than 3e+06" in found.output
    assert "check its unit (--unit)" in found.output


def test_a_plan_that_reaches_few_of_its_contacts_ends_with_code_3_and_the_reason(tmp_path):
    tubes = [trimesh.creation.annulus(r_min=1.5, r_max=4.0, height=8.0, sections=32) for _ in range(3)]
    for number, tube in enumerate(tubes):
        tube.apply_translation([10.0 * number, 0.0, 0.0])
    part, planned = tmp_path / "tubes.stl", tmp_path / "path.csv"
    trimesh.util.concatenate(tubes).export(part)
    words = ["plan", str(part), "--tool", "ball:8", "--stepdown", "2", "-o", str(planned)]
    found = CliRunner().invoke(app, [*words, "--json"])
    assert found.exit_code == 3
    document = json.loads(found.stdout)
    assert [f["code"] for f in document["findings"]] == ["contacts-left-out"]
    assert planned.exists()
    left = " and ".join(f"{count} {what}" for what, count in document["left_out"].items())
    assert f"mm, left out {left}" in found.stderr
    job = make_job(input=part, tool="ball:8", machine="hayashi-640123", plan={"stepdown": 2.0})
    with pytest.raises(Infeasible, match="no pass reaches most of the contacts"):
        run_job(job)


def test_a_feed_beyond_every_machine_is_refused(dome):
    found = CliRunner().invoke(app, ["plan", str(dome), *COARSE, "--unit", "inch", "--feed", "1200000"])
    assert found.exit_code == 2
    assert "feed = 1200000.0 must be at most 200000" in found.output
