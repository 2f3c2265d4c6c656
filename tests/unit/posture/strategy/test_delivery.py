"""The program is solved: its inserted blocks keep the bounds, and its energy is the objective."""

import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.check import Against
from fiveaxis.job import make_job, run_job
from fiveaxis.job.program import make_program
from fiveaxis.model import Constraints, Limits, Machine, Tool, Toolpath
from fiveaxis.nc import ProgramOptions, write_motion
from fiveaxis.nc.motion_table import read_motion
from fiveaxis.nc.source import load_source
from fiveaxis.posture.strategy.delivery import WORTHWHILE

RING = {"tilt": (15.0, 75.0), "effort": "quick"}
HOP = {"tilt": (35.0, 80.0), "max_turn": 60.0, "effort": "quick"}


def s_wall(count: int) -> Toolpath:
    """An S-shaped wall that leans by 20 deg: in large steps the tool hops over its normal between two."""
    x = np.linspace(-60.0, 60.0, count)
    bend = np.pi * x / 60.0
    out = np.column_stack([-0.5 * np.pi * np.cos(bend), np.ones(count), np.zeros(count)])
    out /= np.linalg.norm(out, axis=1)[:, None]
    normal = np.cos(np.radians(20.0)) * out - np.sin(np.radians(20.0)) * np.array([0.0, 0.0, 1.0])
    contact = np.column_stack([x, 30.0 * np.sin(bend), np.full(count, 20.0)])
    return Toolpath.from_contacts(contact, normal, Tool.ball(8), feed_mm_min=500.0)


def to_and_fro(count: int) -> Toolpath:
    """Two passes along a leaning S-shaped wall in opposite directions, one cut, by a bull nose."""
    along = np.concatenate([np.linspace(0.0, 1.0, count), np.linspace(1.0, 0.0, count)])
    height, slope = np.repeat([5.0, 10.0], count), np.tan(np.radians(25.0))
    contact = np.column_stack([60.0 * along, 18.0 * np.sin(np.pi * along) + 20.0 + slope * height, height])
    ahead = np.column_stack([np.full(2 * count, 60.0), 18.0 * np.pi * np.cos(np.pi * along), 0.0 * along])
    return Toolpath.from_contacts(contact, np.cross(ahead, [0.0, slope, 1.0]), Tool.bull(8, 2))


@pytest.fixture(scope="module")
def wall() -> Toolpath:
    return s_wall(40)


@pytest.fixture(scope="module")
def solution(wall, hayashi) -> fx.Solution:
    """The wall as it is solved within bounds that the tool hops over."""
    return fx.optimise(wall, hayashi, **HOP)


@pytest.fixture(scope="module")
def ring() -> Toolpath:
    """A round wall in steps of 3 deg."""
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(121)])
    return Toolpath.from_contacts(30.0 * out + [20.0, 0.0, 30.0], out, Tool.ball(10))


@pytest.fixture(scope="module")
def short(hayashi) -> Machine:
    """A machine whose Z doesn't reach as far down as the cheapest path around the ring."""
    z = hayashi.column("Z")
    axes = [replace(a, limits=Limits(low=18.7)) if i == z else a for i, a in enumerate(hayashi.axes)]
    return replace(hayashi, axes=tuple(axes))


def counts(solution, bounds) -> dict[str, int]:
    constraints = Constraints.of_degrees(tilt=bounds["tilt"], max_turn=bounds.get("max_turn"))
    made = make_program(
        solution.motion, solution.machine, solution.toolpath, constraints, ProgramOptions.of(thin=False)
    )
    # The contact of a hollow goes faster than the ball's centre, whose F is.
    told = ("operator", "cutter-speed")
    return {code: n for code, n in made.report.counts.items() if code not in told}


def test_the_lean_holds_between_given_locations_too(wall, solution):
    assert counts(solution, HOP) == {}
    assert len(solution.toolpath) > len(wall) == solution.toolpath.count_given


def test_axes_stay_within_their_travel_between_given_locations_too(ring, short):
    solution = fx.optimise(ring, short, **RING)
    assert counts(solution, RING) == {}
    assert solution.machine.axis("Z").limits == short.axis("Z").limits


def test_what_is_solved_passes_the_given_locations_in_their_order(wall, solution):
    location = solution.motion.location
    given = location == np.floor(location)
    np.testing.assert_array_equal(location[given], np.arange(len(wall)))
    np.testing.assert_array_equal(solution.toolpath.pivot[given], wall.pivot)
    assert (np.diff(location) > 0.0).all()


# Where both lead to nearly the same path, they may differ by what a last round would have to save.
@pytest.mark.parametrize(("tilt", "less"), [((20.0, 60.0), 0.0), ((25.0, 75.0), WORTHWHILE)])
def test_each_objective_is_least_by_its_own_measure(hayashi, tilt, less):
    by_energy, by_travel = (
        fx.optimise(s_wall(160), hayashi, objective=objective, tilt=tilt, effort="quick")
        for objective in ("energy", "travel")
    )
    assert by_energy.energy.total < (1.0 + less) * by_travel.energy.total
    assert by_travel.energy.travel < (1.0 + less) * by_energy.energy.travel
    for solution in (by_energy, by_travel):
        assert all(solution.energy.total < energy.total for energy in solution.baselines.values())


def test_a_drive_in_proportion_to_speed_knows_one_objective_only(ring, hayashi):
    """Without a constant part energy and travel metric are the same."""
    axes = [
        axis
        if axis.is_rotary
        else replace(axis, drive=replace(axis.drive, plus=w, minus=w, proportional=True))
        for axis, w in zip(hayashi.axes, (2.0, 4.0, 30.0, 0.0, 0.0), strict=True)
    ]
    machine = replace(hayashi, axes=tuple(axes))
    one, other = (fx.optimise(ring, machine, objective=o, **RING).energy for o in ("energy", "travel"))
    assert one.total == pytest.approx(one.travel, rel=1e-6)
    # More locations are solved for the program, so it may find a little more.
    assert 0.98 * other.total < one.total <= 1.002 * other.total


def test_a_job_solves_its_program(wall, hayashi, tmp_path):
    rows = np.hstack([wall.contact, wall.normal])
    file = tmp_path / "wall.csv"
    np.savetxt(file, rows, delimiter=",", header="x,y,z,nx,ny,nz", comments="", fmt="%.9f")
    job = make_job(
        input=file, machine="hayashi-640123", tool="ball:8", feed=500.0, tilt=HOP["tilt"], max_turn=60.0
    )
    outcome = run_job(job.model_copy(update={"effort": "quick"}))
    assert outcome.ok, outcome.program.report.counts
    assert any(stage.name.startswith("program") for stage in outcome.solution.stages)
    assert outcome.document["locations"] == len(wall)


def test_the_table_of_its_motion_becomes_the_same_program(wall, solution, hayashi, tmp_path):
    file = write_motion(solution.motion, tmp_path / "motion.csv", hayashi)
    read = read_motion(load_source(file), hayashi)
    np.testing.assert_allclose(read.location, solution.motion.location, atol=1e-9)
    bounds = Constraints.of_degrees(tilt=HOP["tilt"], max_turn=60.0)
    own = make_program(
        solution.motion, hayashi, solution.toolpath, bounds, ProgramOptions.of(control="linuxcnc")
    )
    written = fx.write_program(
        read, tmp_path / "wall.nc", hayashi, against=Against(wall, constraints=bounds), control="linuxcnc"
    )
    texts = own.text.text, written.read_text()
    one, other = ([line for line in text.splitlines() if "(" not in line] for text in texts)
    # A table has nine digits, so that a tie is rounded either way, and the time of a short block fewer: F in
    # 1/min shows it.
    (words, rates), (again, rates_again) = (
        zip(*(line.split("F") for line in t if "F" in line), strict=True) for t in (one, other)
    )
    number = re.compile(r"-?\d+\.\d{6}")
    assert [number.sub("", line) for line in words] == [number.sub("", line) for line in again]
    values, rounded = (np.array(number.findall(" ".join(lines)), float) for lines in (words, again))
    np.testing.assert_allclose(values, rounded, rtol=0.0, atol=1.01e-6)
    assert np.count_nonzero(values != rounded) <= 1
    np.testing.assert_allclose(np.array(rates, float), np.array(rates_again, float), rtol=1e-6)


def test_a_motion_is_verified_against_the_path_that_was_given(wall, solution, hayashi):
    assert fx.verify(solution.motion, hayashi, wall, tilt=HOP["tilt"], max_turn=60.0).ok
    with pytest.raises(fx.FiveAxisError, match="along another path"):
        fx.verify(solution.motion, hayashi, s_wall(39), tilt=HOP["tilt"])


def test_a_baseline_that_no_program_can_follow_is_missing_with_the_reason(hayashi):
    """A lead that changes sides where the feed reverses takes the tool over its flat bottom within a move."""
    solution = fx.optimise(to_and_fro(40), hayashi, tilt=(20.0, 70.0), effort="quick")
    assert "lead-lean" not in solution.baselines
    assert (
        "flat bottom of bull:8:2, in 1 of 79 moves, first from location 39 to 40"
        in solution.missing["lead-lean"]
    )
    assert {"normal", "fixed", "greedy"} <= solution.baselines.keys()
    assert np.isfinite(solution.energy.total)
    assert solution.energy.total < min(energy.total for energy in solution.baselines.values())


def test_a_ball_has_every_baseline_of_the_same_passes(hayashi):
    path = to_and_fro(40)
    ball = Toolpath.from_contacts(path.contact, path.normal, Tool.ball(8))
    solution = fx.optimise(ball, hayashi, tilt=(20.0, 70.0), effort="quick")
    assert "lead-lean" in solution.baselines


def test_a_long_path_that_needs_no_further_location_takes_few_kilobytes_a_location(hayashi):
    """A million locations are to fit into 2.5 GB: path, problem and planes are kept once."""

    def turns(count):
        angle = np.linspace(0.0, 40.0 * np.pi, count)
        out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
        contact = 30.0 * out + np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 15.0], count)
        return Toolpath.from_contacts(contact, out - [0.0, 0.0, 0.3], Tool.ball(10))

    bounds = {"tilt": (15.0, 70.0), "effort": "quick"}
    fx.optimise(turns(300), hayashi, **bounds)  # what is imported and compiled once doesn't count
    path = turns(6000)
    tracemalloc.start()
    found = fx.optimise(path, hayashi, **bounds)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(found.toolpath) == len(path)
    assert peak < 5000 * len(path)
