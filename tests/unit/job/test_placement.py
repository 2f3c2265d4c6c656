"""The part is put where its path is reached if nobody says where, and where that is is told."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base.errors import Infeasible
from fiveaxis.check import Reach, Surroundings
from fiveaxis.cli.commands import app
from fiveaxis.job import make_job, resolve, run_job
from fiveaxis.model import Constraints, Limits
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


LOWEST = {  # pass or turn near the bed, tool, tilt
    "leaning_s_wall": (slice(1, 300, 6), "ball:8", (20.0, 80.0)),
    "dome_underside": (slice(-60, None, 3), "ball:6", (10.0, 70.0)),
}


@pytest.fixture(params=LOWEST)
def over_the_bed(request, data, tmp_path):
    """A job whose path on the table's centre takes the cutter, or the head, into the bed."""
    file = data / "cases" / f"{request.param}.csv"
    rows, tool, tilt = LOWEST[request.param]
    lines = file.read_text().splitlines()
    path = tmp_path / file.name
    path.write_text("\n".join([lines[0], *lines[rows]]) + "\n")
    on = {"machine": "linuxcnc-bridgemill", "drives": "hayashi-640123", "tool_length": 80.0}
    return make_job(input=path, tool=tool, tilt=tilt, feed=500.0, effort="quick", **on)


@pytest.mark.slow
def test_a_part_is_raised_until_cutter_and_head_pass_the_bed(over_the_bed):
    outcome = run_job(over_the_bed)
    assert outcome.ok
    assert -300.0 < outcome.solution.machine.setup.offset[2] <= -250.0
    assert "tried locations can't be reached" in findings_of(outcome)["part-placed"]


def test_the_place_that_is_chosen_leaves_every_tried_location_a_posture(over_the_bed):
    offset = resolve(over_the_bed).machine.setup.offset
    assert offset[2] > -300.0
    lower = make_job(over_the_bed, setup={"offset": (*offset[:2], -300.0)})
    there = resolve(lower)
    reach = Reach.of(there.toolpath, there.machine, lower.constraints, (0.0, 0.0, 0.0), Surroundings())
    assert reach.reached(offset).all()
    assert not reach.reached(lower.setup.offset).all()


@pytest.mark.parametrize("bounds", [{"plane": (0, 1, 0)}, {"tilt": (30.0, 31.0)}])
def test_bounds_too_narrow_to_be_sampled_are_left_to_the_search(trunnion, hayashi, bounds):
    turn = np.radians(np.linspace(0.0, 60.0, 12))
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(12, 0.8)])
    contact = 25.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 20.0]
    path = fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), feed_mm_min=1200)
    part = trimesh.creation.box((20.0, 20.0, 20.0))
    given = {"tilt": (15.0, 75.0), **bounds}
    found = fx.optimise(path, trunnion.with_drives_of(hayashi), part=part, effort="quick", **given)
    assert found.verify().ok


def test_a_place_is_reached_that_only_the_widest_tilt_reaches(hayashi):
    a = Limits(np.radians(-70.0), np.radians(-60.0))
    machine = replace(
        hayashi, axes=tuple(replace(x, limits=a) if x.letter == "A" else x for x in hayashi.axes)
    )
    contact = np.column_stack([np.linspace(-5.0, 5.0, 4), np.zeros((4, 2))])
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (4, 1)), fx.Tool.ball(8))
    for widest, is_reached in ((70.0, True), (59.0, False)):
        reach = Reach.of(path, machine, Constraints.of_degrees(tilt=(10.0, widest)), (0.0, 0.0, 0.0))
        assert (reach.reached((0.0, 0.0, 0.0)) == is_reached).all()


def test_what_stands_in_the_way_at_a_given_place_is_told_before_a_search(over_the_bed, monkeypatch):
    monkeypatch.setattr("fiveaxis.job.stages.optimise_postures", lambda *_: pytest.fail("searched"))
    given = make_job(over_the_bed, setup={"offset": (0.0, 0.0, -300.0)})
    with pytest.raises(Infeasible, match=r"in the way: .*bed body 0.*all of them are reached") as fault:
        run_job(given)
    assert "with bed body 0 in 100 %" in fault.value.findings[0].message


def test_a_part_that_fits_nowhere_is_refused_with_what_is_in_the_way(ring, monkeypatch):
    monkeypatch.setattr("fiveaxis.job.stages.optimise_postures", lambda *_: pytest.fail("searched"))
    lid = {"name": "lid", "box": {"size": (200.0, 200.0, 10.0), "center": (0.0, 0.0, 25.0)}}
    skirt = {"name": "skirt", "box": {"size": (200.0, 10.0, 60.0), "center": (0.0, 28.0, 0.0)}}
    with pytest.raises(Infeasible, match=r"no posture that is clear of collisions; in the way: .*skirt"):
        run_job(job_on(ring, "hayashi-640123", tool_length=80.0, fixture=(lid, skirt)))
