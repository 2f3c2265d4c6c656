"""Postures that keep shank and holder clear, from the library's front door to a job's report."""

import json

import numpy as np
import pytest
import trimesh
from support.quick_optimiser import optimise as optimise_postures

import fiveaxis as fx
from fiveaxis.base.errors import Infeasible, JobError, MeshError
from fiveaxis.check import Clearances, Fixture, Surroundings
from fiveaxis.job import clearing, make_job, read_job, run_job, write_outcome
from fiveaxis.job.clearing import colliding_rows
from fiveaxis.job.task import Task
from fiveaxis.model import Box, Constraints
from fiveaxis.model.toolpath.tool import Holder, Section
from fiveaxis.posture import Options
from fiveaxis.posture import optimise_postures as find_postures

TILT = (10.0, 70.0)
BOUNDS = Constraints.of_degrees(tilt=TILT)
TOOL_FILE = """
shape = "ball"
diameter = 8
shank_diameter = 7
[holder]
stick_out = 25
sections = [{length = 40, diameter = 40}]
"""
JOB_FILE = """
input = "arc.csv"
machine = "hayashi-640123"
tool = "tool.toml"
tilt = [10, 70]
effort = "quick"
[clearance]
holder = 0.5
[[fixture]]
name = "block"
box = {size = [20, 300, 120], center = [35, 0, 0]}
"""


@pytest.fixture(scope="module")
def machine():
    return fx.load_machine("hayashi-640123")


@pytest.fixture(scope="module")
def tool():
    return fx.Tool.ball(8.0, shank_diameter=7.0, holder=Holder(25.0, (Section(40.0, 40.0),)))


@pytest.fixture(scope="module")
def arc(tool):
    """A bow on the floor, beside which a block stands."""
    turn = np.radians(np.linspace(-60.0, 60.0, 40))
    contact = np.column_stack([15.0 * np.cos(turn), 40.0 * np.sin(turn), np.zeros_like(turn)])
    return fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (40, 1)), tool)


@pytest.fixture(scope="module")
def block():
    """From x = 25 on, 60 high: the holder reaches it unless the tool leans away."""
    return Fixture("block", Box((20.0, 300.0, 120.0), (35.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def free(arc, machine):
    """What is found where nothing stands in the way."""
    return optimise_postures(arc, machine, tilt=TILT, effort="quick")


def task(path, machine, around):
    return Task(machine, path, BOUNDS, around, Options(effort="quick"), keep_clear=True, gouge_tolerance=0.01)


def errors(report):
    return {f.code for f in report.findings if f.severity == "error"}


def test_without_the_mask_the_holder_hits_the_block_and_with_it_it_doesnt(arc, machine, block, free):
    around = Surroundings(fixtures=(block,), clearances=Clearances(0.0, 0.5, 0.0, 0.0))
    kept = fx.optimise(
        arc, machine, tilt=TILT, effort="quick", fixtures=(block,), clearances=around.clearances
    )
    hit = fx.verify(free.motion, machine, free.toolpath, tilt=TILT, surroundings=around)
    assert "holder-collision" in errors(hit)
    report = fx.verify(kept.motion, machine, kept.toolpath, tilt=TILT, surroundings=around)
    assert errors(report) == set()
    assert not any(code.startswith("holder") for code in report.counts)
    # Both spend up to a hundredth on steadier axes.
    assert kept.energy.total >= 0.99 * free.energy.total


def test_what_collides_between_locations_is_refused_and_searched_again(
    arc, machine, block, free, monkeypatch
):
    """Where the mask knows nothing, verification's findings alone lead the path around."""
    monkeypatch.setattr(clearing, "find_accessible", lambda *_, **__: None)
    around = Surroundings(fixtures=(block,), clearances=Clearances(0.0, 0.0, 0.0, 0.0))
    asked = []

    def solve(path, machine, bounds, options):
        asked.append(options.mask)
        return free if options.mask is None else find_postures(path, machine, bounds, options)

    cleared = clearing.solve_clear(task(arc, machine, around), solve)
    before = colliding_rows(free, around)
    after = colliding_rows(cleared.solution, around)
    assert asked[0] is None
    assert len(asked) == 1 + cleared.rounds
    place = before if free.motion.location is None else free.motion.location[before]
    rotary = free.motion.positions[before][:, machine.rotary_columns]
    for rows in (np.floor(place), np.ceil(place)):
        assert not asked[1].admits(rows.astype(int), rotary).any()
    assert len(before) > 10
    assert len(after) == 0


def test_a_mask_of_the_users_holds_beside_ours(arc, machine, block):
    def own(rows, rotary):
        return rotary[:, 1] > np.radians(12.0)

    clear = Clearances(0.0, 0.5, 0.0, 0.0)
    kept = fx.optimise(arc, machine, tilt=TILT, effort="quick", fixtures=(block,), clearances=clear, mask=own)
    rotary = kept.motion.positions[:, machine.rotary_columns]
    assert own(np.arange(len(arc)), rotary).all()
    around = Surroundings(fixtures=(block,), clearances=clear)
    assert errors(fx.verify(kept.motion, machine, arc, tilt=TILT, surroundings=around)) == set()


@pytest.mark.parametrize(
    "cutter", [fx.Tool.flat(20.0), fx.Tool.bull(20.0, 2.0), fx.Tool.ball(20.0), fx.Tool.lollipop(20.0, 8.0)]
)
def test_a_cutter_without_cutting_length_is_seen_under_a_bridge(machine, cutter):
    """The bridge is 6 mm above the floor that is cut: nothing 20 mm wide fits under it."""
    contact = np.column_stack([np.linspace(-5.0, 5.0, 6), np.zeros(6), np.zeros(6)])
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (6, 1)), cutter)
    bridge = Fixture("bridge", Box((400.0, 400.0, 20.0), (0.0, 0.0, 16.0)))
    free = optimise_postures(path, machine, tilt=(2.0, 6.0), effort="quick")
    around = Surroundings(fixtures=(bridge,))
    hit = fx.verify(free.motion, machine, free.toolpath, tilt=(2.0, 6.0), surroundings=around)
    if cutter.cutter.shape == "bull":
        # Its profile ends 2 mm up; it is known to its radius.
        assert any("cutting edges above 10 mm" in sentence for sentence in hit.not_checked)
    assert errors(hit) == {"fixture-collision"}
    with pytest.raises(Infeasible, match="no posture"):
        fx.optimise(path, machine, tilt=(2.0, 6.0), effort="quick", fixtures=(bridge,))


def test_where_no_posture_is_clear_the_blocking_pair_is_named(arc, machine):
    lid = Fixture("lid", Box((400.0, 400.0, 4.0), (0.0, 0.0, 20.0)))
    few = arc.at(np.arange(0, len(arc), 8))
    with pytest.raises(Infeasible) as caught:
        fx.optimise(few, machine, tilt=(0.0, 30.0), effort="quick", fixtures=(lid,))
    messages = [finding.message for finding in caught.value.findings]
    assert len(messages) == len(few)
    assert "shank with lid in 100 %" in messages[0]
    # Whoever gives a block and a holder has given no mask.
    said = [str(caught.value), *(finding.message for finding in caught.value.findings)]
    assert not any("mask" in text for text in said)


def test_a_path_that_tightening_makes_impossible_comes_back_with_its_collisions(
    arc, machine, block, free, monkeypatch
):
    monkeypatch.setattr(clearing, "find_accessible", lambda *_, **__: None)
    around = Surroundings(fixtures=(block,))

    def solve(path, machine, bounds, options):
        if options.mask is not None:
            raise Infeasible("no way", ())
        return free

    cleared = clearing.solve_clear(task(arc, machine, around), solve)
    assert cleared.solution is free
    assert cleared.rounds == 1
    report = fx.verify(cleared.solution.motion, machine, arc, tilt=TILT, surroundings=around)
    assert any("the holder" in f.message and "'block'" in f.message for f in report.findings)


def test_a_ball_with_nothing_above_it_is_solved_once(machine, block):
    path = fx.Toolpath.from_contacts([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0, 0, 1.0]] * 2, fx.Tool.ball(8.0))
    calls = []

    def solve(path, machine, bounds, options):
        calls.append(options.mask)
        return find_postures(path, machine, bounds, options)

    part = trimesh.creation.box(extents=(100.0, 100.0, 10.0))
    part.apply_translation([0.0, 0.0, -5.0])
    assert clearing.solve_clear(task(path, machine, Surroundings(part=part)), solve).rounds == 0
    assert calls == [None]


def test_a_mesh_that_is_inside_out_is_refused(arc, machine):
    part = trimesh.creation.box(extents=(10.0, 10.0, 10.0))
    part.invert()
    with pytest.raises(MeshError, match="normals point into the material"):
        fx.optimise(arc, machine, tilt=TILT, part=part)


@pytest.fixture
def job_folder(tmp_path, arc):
    (tmp_path / "tool.toml").write_text(TOOL_FILE, encoding="utf-8")
    rows = np.hstack([arc.contact, arc.normal])
    np.savetxt(tmp_path / "arc.csv", rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    (tmp_path / "job.toml").write_text(JOB_FILE, encoding="utf-8")
    return tmp_path


def test_a_job_keeps_clear_of_its_fixtures_and_its_report_shows_where_it_would_collide(job_folder):
    outcome = run_job(read_job(job_folder / "job.toml"))
    assert outcome.ok
    assert outcome.cleared is not None
    written = write_outcome(outcome, job_folder / "out")
    assert any(path.suffix == ".ngc" for path in written)
    assert "Hatched: only collisions" in (job_folder / "out" / "report.html").read_text(encoding="utf-8")
    document = json.loads((job_folder / "out" / "report.json").read_text(encoding="utf-8"))
    assert any("holder" in sentence for sentence in document["verification"]["passed"])


@pytest.mark.usefixtures("undrawn")
def test_a_job_that_only_verifies_writes_no_program_for_a_holder_in_a_clamp(job_folder):
    outcome = run_job(read_job(job_folder / "job.toml", keep_clear=False))
    assert not outcome.ok
    assert "holder-collision" in outcome.verdict.counts
    written = write_outcome(outcome, job_folder / "out")
    assert not any(path.suffix == ".ngc" for path in written)


def test_a_fixture_without_its_mesh_file_is_one_clear_error(job_folder):
    text = (job_folder / "job.toml").read_text(encoding="utf-8")
    (job_folder / "job.toml").write_text(text + '[[fixture]]\nname = "vice"\nmesh = "vice.stl"\n', "utf-8")
    with pytest.raises(JobError, match="vice"):
        run_job(read_job(job_folder / "job.toml"))


def test_stock_that_isnt_there_is_one_clear_error(job_folder):
    with pytest.raises(MeshError, match="no such file"):
        run_job(make_job(read_job(job_folder / "job.toml"), stock=job_folder / "stock.stl"))


@pytest.mark.slow
def test_what_earlier_passes_cut_away_is_no_obstacle(machine):
    """Under 5 mm of stock no posture is clear of all of it; on the path there is room over the cut side."""
    part, stock = (trimesh.creation.box(extents=(30.0, 16.0, height)) for height in (10.0, 15.0))
    part.apply_translation((0.0, 0.0, -5.0))
    stock.apply_translation((0.0, 0.0, -2.5))
    x = np.linspace(-18.0, 18.0, 10)
    contact = np.array([[[a, y, 0.0] for a in x] for y in np.arange(-8.0, 8.5, 2.0)]).reshape(-1, 3)
    tool = fx.Tool.ball(6.0, shank_diameter=5.0, holder=Holder(20.0, (Section(20.0, 16.0),)))
    path = fx.Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (len(contact), 1)), tool)
    how = {"tilt": (25.0, 60.0), "effort": "quick", "stock": stock}
    with pytest.raises(Infeasible, match="clear of collisions"):
        fx.optimise(path, machine, **how)
    solution = fx.optimise(path, machine, **how, part=part, stock_resolution=0.25)
    assert not [code for code in solution.verify().counts if code.startswith(("shank", "holder", "gouge"))]
