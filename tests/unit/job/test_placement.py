"""The part is put where its path is reached if nobody says where, and where that is is told."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.cli import app
from fiveaxis.errors import Infeasible
from fiveaxis.job import make_job, run_job
from fiveaxis.nc import write_toolpath


@pytest.fixture
def ring(tmp_path):
    """A ring on an overhanging wall, 40 mm in diameter."""
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(60, -0.2)])
    contact = 20.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 15.0]
    path = fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name="ring")
    return write_toolpath(path, tmp_path / "ring.csv")


def job_on(ring, machine, **settings):
    return make_job(input=ring, tool="ball:8", tilt=(15.0, 70.0), effort="quick", machine=machine, **settings)


def findings_of(outcome):
    return {f.code: f.message for f in outcome.solution.toolpath.findings}


def test_a_part_stays_at_the_tables_centre_where_its_path_is_reached(ring):
    outcome = run_job(job_on(ring, "hayashi-640123"))
    assert outcome.solution.machine.setup.offset == (0.0, 0.0, 0.0)
    assert "part-placed" not in findings_of(outcome)


def test_a_part_out_of_reach_is_raised_and_where_to_is_told(ring):
    outcome = run_job(job_on(ring, "variaxis-630"))
    assert outcome.ok
    x, y, z = outcome.solution.machine.setup.offset
    assert z > 50.0
    assert f"part placed at X{x:g} Y{y:g} Z{z:g}" in findings_of(outcome)["part-placed"]
    assert "set up elsewhere than given" in outcome.program.text.text
    machine = outcome.solution.machine
    assert machine.limit_excess(outcome.solution.motion.positions).max() <= 0.0


def test_a_table_that_is_drawn_carries_the_part(ring):
    outcome = run_job(job_on(ring, "linuxcnc-bridgemill", tool_length=150.0, keep_clear=False))
    assert outcome.solution.machine.setup.offset[2] >= -300.0


def test_a_given_offset_stays_and_the_nearest_that_is_reached_is_told_once(ring):
    with pytest.raises(
        Infeasible, match=r"with the part at X.* all of them are reached .*--work-offset"
    ) as fault:
        run_job(job_on(ring, "variaxis-630", setup={"offset": (0.0, 0.0, 0.0)}))
    offset = tuple(map(float, str(fault.value).partition("--work-offset ")[2].rstrip(")").split(",")))
    assert run_job(job_on(ring, "variaxis-630", setup={"offset": offset})).ok


def test_a_program_is_verified_with_the_part_where_its_job_was_placed(ring, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(
        f'input = "{ring}"\ntool = "ball:8"\nmachine = "variaxis-630"\ntilt = [15, 70]\neffort = "quick"\n'
    )
    runner = CliRunner()
    assert runner.invoke(app, ["optimise", str(job), "-o", str(tmp_path / "out")]).exit_code == 0
    program = next((tmp_path / "out").glob("*.ngc"))
    found = runner.invoke(app, ["verify", str(program), "--path", str(job)])
    assert found.exit_code == 0, found.output
    assert "part placed at" in found.stderr
    moved = ["--work-offset", "0,0,0"]
    assert runner.invoke(app, ["verify", str(program), "--path", str(job), *moved]).exit_code == 1
