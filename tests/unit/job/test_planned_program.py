"""The blocks of a solution's program: redundant ones removed, and every location held to its checks."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import optimise
from support.sampled_surfaces import ellipse, sampled

import fiveaxis as fx
from fiveaxis.base import Coordinates
from fiveaxis.base.findings import Finding, Place, Severity
from fiveaxis.check import DEFAULT_TOLERANCES, Surroundings, verify_program
from fiveaxis.job import make_job
from fiveaxis.job.planned_program import may_thin, plan_program
from fiveaxis.job.program import MadeProgram, make_program
from fiveaxis.model import AXIS_TOLERANCE, Constraints, Tool, Toolpath, follow, motion_energy
from fiveaxis.model.energy.totals import move_energies
from fiveaxis.nc import ProgramOptions, ProgramSettings
from fiveaxis.posture import Optimum

AS_ASKED = {"tilt": (15.0, 75.0), "max_turn": 15.0}
BOUNDS = Constraints.of_degrees(**AS_ASKED)


def program_of(
    solution: Optimum, constraints: Constraints = BOUNDS, coordinates: Coordinates = "axes", **words
) -> MadeProgram:
    options = ProgramOptions.of(coordinates=coordinates, header={"tool": "ball:8"}, **words)
    return make_program(solution.motion, solution.machine, solution.toolpath, constraints, options)


@pytest.fixture(scope="module")
def solution(hayashi):
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(721)])
    rising = np.column_stack([np.zeros((721, 2)), 5.0 + angle])
    path = Toolpath.from_contacts(25.0 * out + rising, out, Tool.ball(8))
    return optimise(path, hayashi, effort="quick", **AS_ASKED)


@pytest.mark.parametrize("coordinates", ["axes", "tip"])
def test_blocks_are_the_locations_and_the_inserted_ones_without_the_redundant(solution, coordinates):
    program = program_of(solution, coordinates=coordinates)
    said = program.figures
    # A tip led straight would make axes go to and fro that stand still otherwise: fewer blocks can go there.
    assert program.fill.removed > 50 or coordinates == "tip"
    blocks = said.blocks_before + said.inserted - said.removed
    assert said.blocks == blocks == len(program.motion.blocks)
    assert said.redundant_kept_for == ()
    assert program.ok
    # Every location was looked at, those without a block included.
    assert len(program.fill.path) == 721 + said.inserted
    assert program.report.figures["contact_error_mm"] <= 0.005


def test_findings_of_the_writer_are_placed_at_locations_of_the_given_path(solution):
    wording = ProgramOptions.of().wording(solution.machine)
    words = (Surroundings(), wording, ProgramSettings(), DEFAULT_TOLERANCES)
    planned = plan_program(solution.motion, solution.toolpath, BOUNDS, *words)
    few = planned.without_redundant(BOUNDS, wording)
    last = len(few.motion.blocks) - 1
    assert last < 720 < len(planned.fill.path)
    rows = [Finding(Severity.WARNING, "feed-floor", "slow", Place(location=row)) for row in (0, last)]
    assert [finding.place.location for finding in few.located(rows)] == [0, 720]
    anywhere = Finding(Severity.WARNING, "number-assumed", "named 1")
    assert few.located([anywhere]) == (anywhere,)


def turning(solution, degrees):
    """A solution of few locations along a straight cut, with given angles."""
    contact = np.column_stack([np.linspace(20.0, 26.0, len(degrees)), np.zeros((len(degrees), 2))])
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * len(degrees), Tool.ball(8))
    motion = follow(path, solution.machine, np.radians(degrees))
    return replace(solution, toolpath=path, motion=motion, compared={})


@pytest.mark.parametrize("thin", [True, False])
def test_the_tool_axis_is_held_in_its_plane_and_the_cuts_in_which_it_isnt_are_named(solution, thin):
    degrees = [[0.0, -30.0], [14.0, -30.0], [20.0, -30.0], [180.0, -4.0], [180.0, -40.0]]
    program = program_of(turning(solution, degrees), Constraints.of_degrees(max_turn=180.0), thin=thin)
    said = program.figures
    assert said.axis_left_plane == said.axis_held_in_plane == 1
    assert program.report.counts["axis-off-plane"] == 1
    (found,) = [f for f in program.report.findings if f.code == "axis-off-plane"]
    # The place counts the locations of the path that was given.
    assert found.place.location == 3
    assert found.value == pytest.approx(program.report.figures["axis_off_plane_deg"])
    few = program_of(turning(solution, degrees[:3]), Constraints.of_degrees(max_turn=15.0), thin=thin)
    assert few.report.ok
    assert set(few.report.counts) == {"operator"}
    assert 0.0 < math.radians(few.report.figures["axis_off_plane_deg"]) <= AXIS_TOLERANCE


def test_a_rate_that_a_cut_keeps_as_a_whole_is_no_error_in_its_parts(solution):
    degrees = [[0.0, -20.0], [30.0, -20.0]]
    rate = 30.0 / 6.0 * (1.0 + 1e-9)
    program = program_of(turning(solution, degrees), Constraints.of_degrees(max_turn=30.0, turn_rate=rate))
    assert program.figures.axis_held_in_plane == 1
    assert program.ok, program.report.findings
    # Half of the way takes a little more than half of the turn next to the middle, where C is quickest.
    found = program.report.figures["turn_rate_deg_mm"]
    assert 1.0 < found / rate <= 2.0 * math.tan(math.radians(15.0)) / math.radians(30.0) + 1e-5


def test_what_holds_an_axis_goes_before_the_plane(solution):
    degrees = [[0.0, -30.0], [14.0, -30.0]]
    program = program_of(turning(solution, degrees), Constraints.of_degrees(hold={"A": -30.0}))
    said = program.figures
    assert (said.axis_held_in_plane, said.axis_left_plane) == (0, 1)
    assert program.ok
    assert program.report.figures["held_axis_off_deg"] < 1e-6


def test_all_blocks_stay_on_request(solution):
    program = program_of(solution, thin=False)
    assert program.fill.removed == 0
    assert len(program.motion.blocks) == 721 + program.fill.inserted
    assert program.report.figures["contact_error_mm"] < 2e-6


def test_fewer_blocks_cost_no_more(solution):
    few, whole = (
        motion_energy(solution.machine, program_of(solution, thin=thin).motion.blocks)
        for thin in (True, False)
    )
    assert few.total <= whole.total * (1.0 + 1e-6)
    assert few.time == pytest.approx(whole.time)


def test_where_fewer_blocks_fail_verification_all_stay(hayashi, monkeypatch):
    solution = optimise(sampled(ellipse, 240, rings=1), hayashi, effort="quick", **AS_ASKED)
    # Blocks of eight moves each, however far that takes the tool off its path.
    eight = "fiveaxis.model.motion.thinning.longest_spans"
    monkeypatch.setattr(eight, lambda last, _fits: np.unique(np.append(np.arange(0, last, 8), last)))
    program = program_of(solution)
    assert "contact-error" in program.held_back
    assert program.fill.removed == 0
    assert program.ok


@pytest.mark.parametrize(
    ("control", "coordinates", "may"),
    [
        ("linuxcnc", "axes", True),
        ("heidenhain", "tip", True),
        ("fanuc", "vector", False),
        ("apt", None, False),
    ],
)
def test_blocks_go_only_where_the_path_between_them_is_known(hayashi, control, coordinates, may):
    assert may_thin(ProgramOptions.of(control=control, coordinates=coordinates).wording(hayashi)) is may


def test_a_job_thins_unless_it_says_otherwise(tmp_path):
    (tmp_path / "path.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    given = {"input": tmp_path / "path.csv", "machine": "hayashi-640123", "tool": "ball:8"}
    assert make_job(**given).thin
    assert not make_job(**given, thin=False).thin


@pytest.mark.parametrize(("coordinates", "control"), [("axes", "linuxcnc"), ("tip", "heidenhain")])
def test_a_thinned_program_read_back_follows_the_path_and_keeps_its_bounds(
    solution, hayashi, tmp_path, coordinates, control
):
    program = program_of(solution, coordinates=coordinates, control=control)
    file = program.write(tmp_path / ("part.h" if control == "heidenhain" else "part.ngc"))
    report = verify_program(file, hayashi, toolpath=solution.toolpath, **AS_ASKED)
    assert report.ok, report.findings


@pytest.mark.parametrize(
    ("control", "coordinates", "near"),
    # 6, 5 and 4 decimals: a rounded angle moves axes that would stand, ten times as far with a decimal less.
    [("linuxcnc", "axes", 1e-4), ("sinumerik", "tip", 1e-3), ("fanuc", "tip", 1e-2)],
)
def test_a_program_read_back_costs_what_its_report_says(
    solution, hayashi, tmp_path, control, coordinates, near
):
    program = program_of(solution, coordinates=coordinates, control=control)
    blocks = program.motion.blocks
    said = motion_energy(hayashi, blocks)
    read = fx.program_energy(program.write(tmp_path / "p.nc"), hayashi, rapid=1e9)
    # Around the path lie approach, lead-in and lead-out.
    first, last = (
        int(np.abs(read.motion.positions - end).sum(axis=1).argmin()) for end in blocks.positions[[0, -1]]
    )
    cuts = slice(first + 1, last + 1)
    metric = move_energies(hayashi, read.motion)[cuts].sum()
    assert metric == pytest.approx(said.travel, rel=near)
    assert read.by_block[cuts].sum() == pytest.approx(said.total, rel=near)
    # Under TCP F is the tip's.
    assert read.as_dict()["feed_of"] == ("the tool's tip" if coordinates == "tip" else "the centre of ball:8")
