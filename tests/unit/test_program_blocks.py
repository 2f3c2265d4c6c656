"""The blocks of an outcome's program: needless ones left out, and the gate on what is left."""

import math
from dataclasses import replace

import numpy as np
import pytest
from fiveaxis.job.blocks import may_thin

import fiveaxis as fx
from fiveaxis.collision import Surroundings
from fiveaxis.energy import move_energies
from fiveaxis.job import blocks, make_job, program_motion, verify_program
from fiveaxis.motion import AXIS_TOLERANCE, follow
from fiveaxis.nc import require_program
from fiveaxis.posture import optimise
from fiveaxis.toolpath import Tool, Toolpath

BOUNDS = {"tilt": (15.0, 75.0), "max_turn": 15.0}


@pytest.fixture(scope="module")
def solution(hayashi):
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(721)])
    rising = np.column_stack([np.zeros((721, 2)), 5.0 + angle])
    path = Toolpath.from_contacts(25.0 * out + rising, out, Tool.ball(8))
    return optimise(path, hayashi, effort="quick", **BOUNDS)


@pytest.mark.parametrize("led", [False, True])
def test_blocks_are_the_locations_and_the_inserted_ones_without_the_needless(solution, led):
    program = program_motion(solution, Surroundings(), BOUNDS, led=led)
    said = program.as_dict()
    # A tip led straight would make axes go to and fro that stand still otherwise: fewer blocks can go there.
    assert program.removed > 50 or led
    assert said["blocks"] == said["blocks_before"] + said["inserted"] - said["removed"] == len(program.motion)
    assert said["needless_kept_for"] == []
    assert program.ok
    # The gate looked at every location, those without a block included.
    assert len(program.driven) == 721 + program.inserted
    figures = program.verdict.figures
    assert figures["contact_error_mm"] <= 0.005
    assert (figures["contact_error_mm"] > 1e-6) is (program.removed > 0)


def turning(solution, degrees):
    """A solution of few locations along a straight cut, with given angles."""
    contact = np.column_stack([np.linspace(20.0, 26.0, len(degrees)), np.zeros((len(degrees), 2))])
    path = Toolpath.from_contacts(contact, [[0.0, 0.0, 1.0]] * len(degrees), Tool.ball(8))
    motion = follow(path, solution.machine, np.radians(degrees))
    return replace(solution, toolpath=path, motion=motion, compared={})


@pytest.mark.parametrize("thin", [True, False])
def test_the_tool_axis_is_held_in_its_plane_and_the_cuts_in_which_it_isnt_are_named(solution, thin):
    degrees = [[0.0, -30.0], [14.0, -30.0], [20.0, -30.0], [180.0, -4.0], [180.0, -40.0]]
    program = program_motion(turning(solution, degrees), Surroundings(), {"max_turn": 180.0}, thin=thin)
    assert (program.in_plane, program.left_plane) == (1, 1)
    assert program.verdict.counts["axis-off-plane"] == 1
    (found,) = [f for f in program.verdict.findings if f.code == "axis-off-plane"]
    # The place counts the program's own locations.
    np.testing.assert_allclose(
        program.driven.positions[found.place.location, solution.machine.rotary_columns],
        np.radians([180.0, -4.0]),
    )
    said = program.as_dict()
    assert said["axis_left_plane"] == said["axis_held_in_plane"] == 1
    assert (
        found.value
        == pytest.approx(said["axis_off_plane_deg"])
        == program.verdict.figures["axis_off_plane_deg"]
    )
    few = program_motion(turning(solution, degrees[:3]), Surroundings(), {"max_turn": 15.0}, thin=thin)
    assert few.verdict.counts == {}
    assert 0.0 < few.off_plane <= AXIS_TOLERANCE


def test_a_rate_that_a_cut_keeps_as_a_whole_is_no_error_in_its_parts(solution):
    degrees = [[0.0, -20.0], [30.0, -20.0]]
    bounds = {"max_turn": 30.0, "turn_rate": 30.0 / 6.0 * (1.0 + 1e-9)}
    program = program_motion(turning(solution, degrees), Surroundings(), bounds)
    assert program.in_plane == 1
    assert program.ok
    # Half of the way takes a little more than half of the turn next to the middle, where C is quickest.
    rate = program.verdict.figures["turn_rate_deg_mm"]
    assert 1.0 < rate / bounds["turn_rate"] <= 2.0 * math.tan(math.radians(15.0)) / math.radians(30.0) + 1e-6


def test_what_holds_an_axis_goes_before_the_plane(solution):
    degrees = [[0.0, -30.0], [14.0, -30.0]]
    program = program_motion(turning(solution, degrees), Surroundings(), {"hold": {"A": -30.0}})
    assert (program.in_plane, program.left_plane) == (0, 1)
    assert program.ok
    assert program.verdict.figures["held_axis_off_deg"] < 1e-9


def test_all_blocks_stay_where_that_is_asked_for(solution):
    program = program_motion(solution, Surroundings(), BOUNDS, thin=False)
    assert program.removed == 0
    assert len(program.motion) == 721 + program.inserted
    assert program.verdict.figures["contact_error_mm"] < 1e-6


def test_fewer_blocks_cost_no_more(solution):
    few, all_of_them = (program_motion(solution, Surroundings(), BOUNDS, thin=t) for t in (True, False))
    assert few.energy["optimised"].total <= all_of_them.energy["optimised"].total * (1.0 + 1e-6)
    assert few.energy["optimised"].time == pytest.approx(all_of_them.energy["optimised"].time)


def test_where_fewer_blocks_fail_verification_all_stay(solution, monkeypatch):
    careful = blocks.thinned

    def careless(*args, **options):
        return careful(*args, **options, tolerance=0.1)

    monkeypatch.setattr(blocks, "thinned", careless)
    program = program_motion(solution, Surroundings(), BOUNDS)
    assert "contact-error" in program.held_back
    assert program.removed == 0
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
def test_blocks_go_only_where_the_way_between_them_is_known(hayashi, control, coordinates, may):
    assert may_thin(require_program(hayashi, control, coordinates)) is may


def test_a_job_thins_unless_it_says_otherwise(tmp_path):
    (tmp_path / "path.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,0,0,1\n")
    given = {"input": tmp_path / "path.csv", "machine": "hayashi-640123", "tool": "ball:8"}
    assert make_job(**given).thin
    assert not make_job(**given, thin=False).thin


@pytest.mark.parametrize(("coordinates", "control"), [("axes", "linuxcnc"), ("tip", "heidenhain")])
def test_a_thinned_program_read_back_follows_the_path_and_keeps_its_bounds(
    solution, hayashi, tmp_path, coordinates, control
):
    program = program_motion(solution, Surroundings(), BOUNDS, led=coordinates == "tip")
    file = tmp_path / ("part.h" if control == "heidenhain" else "part.ngc")
    fx.write_program(program.motion, file, machine=hayashi, control=control, coordinates=coordinates)
    report = verify_program(file, hayashi, toolpath=solution.toolpath, **BOUNDS)
    assert report.ok, report.findings


@pytest.mark.parametrize(
    ("control", "coordinates", "near"),
    # 6, 5 and 4 decimals: with few of them an axis that creeps has a drive's whole power here or there.
    [("linuxcnc", "axes", 1e-3), ("sinumerik", "tip", 1e-3), ("fanuc", "tip", 5e-3)],
)
def test_a_program_read_back_costs_what_its_report_says(
    solution, hayashi, tmp_path, control, coordinates, near
):
    program = program_motion(solution, Surroundings(), BOUNDS, led=coordinates == "tip")
    said = program.energy["optimised"]
    path = fx.write_program(
        program.motion,
        tmp_path / "p.nc",
        machine=hayashi,
        control=control,
        coordinates=coordinates,
        header={"tool": "ball:8"},
    )
    read = fx.program_energy(path, hayashi, rapid_mm_min=1e9)
    # Around the path lie the ways in and out.
    first, last = (
        int(np.abs(read.motion.positions - end).sum(axis=1).argmin())
        for end in program.motion.positions[[0, -1]]
    )
    cuts = slice(first + 1, last + 1)
    metric = move_energies(hayashi, read.motion)[cuts].sum()
    assert metric == pytest.approx(said.total, rel=near)
    assert read.by_block[cuts].sum() == pytest.approx(said.power_integral, rel=near)
    assert read.as_dict()["feed_of"] == "the centre of ball:8"
