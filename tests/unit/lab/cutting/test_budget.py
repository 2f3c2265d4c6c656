"""The electricity of a whole job, each consumer against its own formula."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fiveaxis.base.errors import JobError, MachineError
from fiveaxis.check import Blank
from fiveaxis.check.stock.cutting import cut_stock
from fiveaxis.check.stock.sources import load_stock
from fiveaxis.cli.commands import app
from fiveaxis.job import read_job
from fiveaxis.lab import CutCourse, CuttingCoefficients, EndMill, Engaged, Factors, Process, job_budget
from fiveaxis.lab.cutting.budget import cutting_energies
from fiveaxis.lab.cutting.cutting_forces import mean_cutting_power
from fiveaxis.lab.cutting.engagement import Cut, removal_rate
from fiveaxis.lab.cutting.process import make_process
from fiveaxis.model import Machine, Motion, MoveKind, Provenance, Tool, motion_energy, parse_tool

# Wang et al. (2019): idle 0.0003 n² + 0.0524 n + 1221 W, n in rev/min; C0 = 0.1336.
TURN = 2.0 * np.pi / 60.0
PROCESS = Process(
    EndMill("ball", 10.0, 2), 0.5, 0.3, 6000.0 * TURN, CuttingCoefficients(2000.0), "fitted", "trial"
)


@pytest.fixture
def machine(hayashi: Machine) -> Machine:
    added = (
        Provenance("base_power", "value 500", "meter", False),
        Provenance("spindle_idle", "…", "a log of the spindle", False, fitted=True),
        Provenance("auxiliary", "…", "", True, "as on another machine"),
    )
    idle = (80.0, 0.0524 / TURN, 0.0003 / TURN**2)
    return replace(
        hayashi,
        base_power=500.0,
        spindle_idle=idle,
        auxiliary=(0.1336, 0.0),
        provenance=hayashi.provenance + added,
    )


@pytest.fixture
def motion() -> Motion:
    positions = np.zeros((4, 5))
    positions[:, 0] = 0.0, 10.0, 40.0, 60.0
    return Motion(
        letters="XYZAC",
        positions=positions,
        feed=np.array([10.0, 10.0, 20.0, 100.0]),
        time=np.array([0.0, 1.0, 1.5, 0.2]),
        kind=np.array([MoveKind.CUT, MoveKind.CUT, MoveKind.CUT, MoveKind.RAPID]),
        source=np.arange(4),
    )


def shares_of(budget) -> dict[str, tuple[float | None, str]]:
    return {s.name: (s.energy, s.basis) for s in budget.shares}


def test_every_consumer_follows_its_own_formula(machine, motion):
    budget = job_budget(machine, motion, PROCESS, Factors(price=0.3, co2=0.4))
    shares = shares_of(budget)
    assert shares["base"] == (pytest.approx(500.0 * 2.7), "measured")
    assert shares["feed drives"] == (pytest.approx(motion_energy(machine, motion).total), "measured")
    idle = 0.0003 * 6000.0**2 + 0.0524 * 6000.0 + 80.0
    assert shares["spindle idle"] == (pytest.approx(idle * 2.7), "fitted")
    powers = [
        mean_cutting_power(Cut(PROCESS.mill, 0.5, 0.3, feed, PROCESS.spindle), PROCESS.coefficients)
        for feed in (10.0, 20.0)
    ]
    cut = powers[0] * 1.0 + powers[1] * 1.5
    assert shares["cutting"] == (pytest.approx(cut), "fitted")
    # Without edge forces the power is K_tc times the removal rate, so twice the feed takes twice the power.
    assert powers[1] == pytest.approx(2.0 * powers[0])
    assert shares["auxiliary"] == (pytest.approx(0.1336 * cut), "assumed")
    assert budget.complete
    assert budget.total == pytest.approx(sum(energy for energy, _ in shares.values()))
    assert budget.cost == pytest.approx(0.3 * budget.total / 3.6e6)
    assert budget.co2 == pytest.approx(0.4 * budget.total / 3.6e6)


def test_an_unknown_consumer_is_reported_and_not_counted_as_zero(hayashi, motion):
    budget = job_budget(hayashi, motion)
    shares = shares_of(budget)
    assert not budget.complete
    assert {name for name, (energy, _) in shares.items() if energy is None} == {
        "base",
        "spindle idle",
        "cutting",
        "auxiliary",
    }
    assert all(s.source for s in budget.shares)
    assert budget.cost is None
    assert budget.co2 is None


def test_a_quadratic_loss_takes_the_mean_of_the_square(machine, motion):
    both = replace(machine, auxiliary=(0.1, 0.002))
    cutting = shares_of(job_budget(both, motion, PROCESS))["auxiliary"][0]
    linear = shares_of(job_budget(replace(machine, auxiliary=(0.1, 0.0)), motion, PROCESS))["auxiliary"][0]
    p = [
        mean_cutting_power(Cut(PROCESS.mill, 0.5, 0.3, feed, PROCESS.spindle), PROCESS.coefficients)
        for feed in (10.0, 20.0)
    ]
    assert cutting - linear == pytest.approx(0.002 * (p[0] ** 2 * 1.0 + p[1] ** 2 * 1.5))


JOB = """input = "ring.csv"
machine = "hayashi-640123"
tool = "ball:6"
tilt = [15, 75]

[process]
spindle_rpm = 12000
teeth = 2
depth = 0.2
width = 0.3
tangential = 1800
basis = "assumed"
source = "a handbook value for steel"

[factors]
price = 0.25
co2 = 0.38
source = "the bill"
"""


def write_job(folder: Path, text: str = JOB) -> Path:
    turn = np.linspace(0.0, 2.0, 30)
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(30)])
    rows = np.hstack([15.0 * out, 0.8 * out + [0.0, 0.0, 0.6]])
    lines = ["x,y,z,nx,ny,nz", *(",".join(f"{v:.6f}" for v in row) for row in rows)]
    (folder / "ring.csv").write_text("\n".join(lines) + "\n")
    path = folder / "job.toml"
    path.write_text(text)
    return path


@pytest.mark.usefixtures("undrawn")
def test_a_jobs_report_holds_the_whole_job(tmp_path):
    job = write_job(tmp_path)
    result = CliRunner().invoke(app, ["optimise", str(job), "-v", "-o", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "cutting" in result.stdout
    assert "not known: base, spindle idle, auxiliary" in " ".join(result.stdout.split())
    document = json.loads((tmp_path / "out" / "report.json").read_text())
    budget = document["budget"]
    assert [s["name"] for s in budget["shares"]] == [
        "base",
        "feed drives",
        "spindle idle",
        "cutting",
        "auxiliary",
    ]
    assert budget["cost"] == pytest.approx(0.25 * budget["kWh"])
    assert "Electricity of the whole job" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("depth = 0.2", "depth = -1", "process.depth = -1 must be at least 0"),
        ("teeth = 2", "teeth = 0", "process.teeth = 0 must be at least 1"),
        ("spindle_rpm = 12000", "spindle = 12000", "the nearest known one is 'spindle_rpm'"),
        ('basis = "assumed"', 'basis = "guessed"', "process.basis"),
        ('source = "the bill"', "", "factors.source is missing"),
    ],
)
def test_a_wrong_figure_of_the_process_is_named_with_its_line(tmp_path, old, new, message):
    assert old in JOB
    with pytest.raises(JobError) as caught:
        read_job(write_job(tmp_path, JOB.replace(old, new)))
    assert message in str(caught.value)
    assert f"{tmp_path / 'job.toml'}:" in str(caught.value)


def test_an_impossible_engagement_is_refused_before_the_optimisation(tmp_path):
    job = read_job(write_job(tmp_path, JOB.replace("width = 0.3", "width = 7")))
    with pytest.raises(JobError, match="process: width of cut is 7 mm"):
        make_process(job.process, Tool.ball(6), 1000.0 / 60.0)


def test_an_axis_that_slows_the_move_makes_the_chips_thinner_but_not_the_cut_costlier(machine, motion):
    """Without edge forces the work is K_tc times the volume removed, however long that takes."""
    slow = replace(motion, time=motion.time * 4.0)
    spent = [shares_of(job_budget(machine, m, PROCESS))["cutting"][0] for m in (motion, slow)]
    assert spent[1] == pytest.approx(spent[0])


def test_a_dwell_cuts_nothing(machine, motion):
    positions = np.insert(motion.positions, 2, motion.positions[1], axis=0)
    dwelling = Motion(
        letters="XYZAC",
        positions=positions,
        feed=np.insert(motion.feed, 2, 10.0),
        time=np.insert(motion.time, 2, 20.0),
        kind=np.insert(motion.kind, 2, MoveKind.CUT),
        source=np.arange(5),
    )
    spent = [shares_of(job_budget(machine, m, PROCESS))["cutting"][0] for m in (motion, dwelling)]
    assert spent[1] == pytest.approx(spent[0])


def test_an_idle_power_below_0_is_refused(machine, motion):
    with pytest.raises(MachineError, match=r"W at 628\.319 rad/s, below 0"):
        job_budget(replace(machine, spindle_idle=(0.0, -1.0, 0.0)), motion, PROCESS)


@pytest.mark.parametrize("cutter", ["ball:6", "flat:6"])
def test_over_a_stock_of_even_thickness_the_cut_takes_what_its_one_engagement_says(machine, cutter):
    """A pass beside others, through a plate of known depth, by rays 0.1 mm apart."""
    depth, width, feed, length = 1.0, 0.8, 20.0, 40.0
    part = trimesh.creation.box(extents=(length, 20.0, 10.0))
    part.apply_translation((0.0, 0.0, -5.0))
    blank = Blank.of(load_stock(f"box:{length}:20:{10.0 + depth}", part, 0.1), part)
    x = np.arange(-24.0, 24.5, 0.5)
    passes = [
        [(x[0], y, 20.0), *((a, y, 0.0) for a in x), (x[-1], y, 20.0)] for y in np.arange(-4.0, 0.1, width)
    ]
    tip = np.concatenate(passes)

    def poses(place):
        columns = [np.interp(place, np.arange(len(tip)), tip[:, k]) for k in range(3)]
        return np.column_stack(columns), np.tile([0.0, 0.0, 1.0], (len(place), 1))

    tool = parse_tool(cutter)
    cut = cut_stock(blank, tool, poses, np.arange(1, len(tip)), len(tip))
    # The last pass, in the middle of the plate.
    ends = np.flatnonzero((np.abs(tip[:, 0]) <= 10.0) & (tip[:, 1] == tip[-1, 1]))
    engaged = Engaged.of_rows(cut.removal.volume.mean(axis=0), cut.removal.contact, ends)
    process = replace(
        PROCESS,
        mill=EndMill(tool.cutter.shape, 6.0, 2),
        depth=depth,
        width=width,
        coefficients=CuttingCoefficients(2000.0, 20.0),
    )
    positions = np.zeros((len(ends), 5))
    positions[:, 0] = tip[ends, 0]
    kind = np.full(len(ends), MoveKind.CUT)
    time = np.full(len(ends), 0.5 / feed)
    motion = Motion("XYZAC", positions, np.full(len(ends), feed), time, kind, np.arange(len(ends)))
    one, real = (cutting_energies(machine, motion, process, given)[1:] for given in (None, engaged))
    assert real == pytest.approx(one, rel=0.015)
    course = CutCourse(time[1:], engaged.volume[1:], real)
    assert course.rate[:-1] == pytest.approx(
        removal_rate(Cut(process.mill, depth, width, feed, process.spindle)), rel=0.01
    )
