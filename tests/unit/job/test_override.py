"""A job's program and the errors that someone accepts by name."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fiveaxis.base.errors import JobError
from fiveaxis.cli.commands import app
from fiveaxis.job import make_job, read_job

pytestmark = pytest.mark.usefixtures("undrawn")

ASKED = ("--machine", "hayashi-640123", "--tool", "ball:10", "--tilt", "15:75", "--effort", "quick")


@pytest.fixture(scope="module")
def sunk(tmp_path_factory) -> tuple[Path, Path]:
    """A pass along a wall of a box, 0.1 mm inside of it."""
    folder = tmp_path_factory.mktemp("sunk")
    trimesh.creation.box(extents=(40.0, 40.0, 40.0)).export(folder / "box.stl")
    y = np.linspace(-10.0, 10.0, 11)
    rows = np.column_stack([np.full(11, 19.9), y, 0 * y, np.ones(11), 0 * y, 0 * y])
    np.savetxt(folder / "path.csv", rows, fmt="%.6f", delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    return folder / "path.csv", folder / "box.stl"


def optimise(sunk, out: Path, *more: str):
    path, box = sunk
    words = ["optimise", str(path), *ASKED, "--part", str(box), "--surface-tolerance", "0.2"]
    return CliRunner().invoke(app, [*words, "-o", str(out), "--json", *more])


def test_a_gouge_keeps_the_program_back_and_another_code_that_is_accepted_opens_nothing(sunk, tmp_path):
    result = optimise(sunk, tmp_path, "--override", "jump")
    assert result.exit_code == 1
    assert "override accepts jump, which wasn't found [override-unused]" in result.stderr
    assert "no NC program was written" in result.stderr
    assert list(json.loads(result.stdout)["kept_back"]) == ["gouge"]
    assert "No NC program was written, because of gouge" in (tmp_path / "report.html").read_text()
    assert not (tmp_path / "program.ngc").exists()


def test_a_gouge_that_is_accepted_by_name_stands_in_the_header(sunk, tmp_path):
    result = optimise(sunk, tmp_path, "--override", "gouge")
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    count = document["overridden"]["gouge"]
    assert count >= 11
    assert document["verification"]["ok"] is False
    assert document["kept_back"] == {}
    assert document["overridden_by"] == "whoever called this run (--override)"
    page = (tmp_path / "report.html").read_text()
    assert f"<dt>Overridden</dt><dd>gouge ({count}), by whoever called" in page
    assert f"overridden: gouge ({count})" in result.stderr
    text = (tmp_path / "program.ngc").read_text()
    assert f"(OVERRIDDEN: gouge [{count}])" in text
    assert "verification: errors accepted by name" in text


def test_a_code_that_does_not_exist_is_refused_before_any_work(sunk, tmp_path):
    result = optimise(sunk, tmp_path / "out", "--override", "gauge")
    assert result.exit_code == 2
    assert "did you mean gouge" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_job_file_can_accept_codes(sunk, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(f'input = "{sunk[0]}"\nmachine = "hayashi-640123"\noverride = ["gouge"]\n')
    assert read_job(job).override == ("gouge",)
    assert read_job(job).override_by == make_job(read_job(job), feed=500.0).override_by
    assert read_job(job).override_by == "the job file job.toml (override)"
    assert read_job(job, override=("jump",)).override_by == "whoever called this run (--override)"
    job.write_text(f'input = "{sunk[0]}"\nmachine = "hayashi-640123"\noverride = ["gauge"]\n')
    with pytest.raises(JobError, match=r"job\.toml:3: .*did you mean gouge"):
        read_job(job)
    assert make_job(input=sunk[0]).override == ()
