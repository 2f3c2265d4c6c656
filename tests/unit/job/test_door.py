"""`fx.optimise` takes names and files where objects are meant, and places the part as jobs do."""

import inspect

import numpy as np
import pytest
from typer.testing import CliRunner

import fiveaxis as fx
from fiveaxis.base import Framing, Surrounding, Workpiece, Writing, options_of
from fiveaxis.base.errors import SettingError
from fiveaxis.cli.commands import app
from fiveaxis.job import Job, make_job, run_job
from fiveaxis.nc import write_toolpath

WITHIN = {"tilt": (15.0, 70.0), "effort": "quick"}


@pytest.fixture
def ring():
    """A ring on an overhanging wall, 40 mm in diameter."""
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.full(40, -0.2)])
    contact = 20.0 * normal * [1.0, 1.0, 0.0] + [0.0, 0.0, 15.0]
    return fx.Toolpath.from_contacts(contact, normal, fx.Tool.ball(8), name="ring")


@pytest.fixture
def file(ring, tmp_path):
    """The ring's file, which names no tool."""
    return write_toolpath(ring, tmp_path / "ring.csv")


def test_a_name_and_a_file_stand_for_machine_and_path(file, ring):
    found = fx.optimise(str(file), "hayashi-640123", tool="ball:8", **WITHIN)
    path = fx.read_toolpath(file, tool=fx.Tool.ball(8))
    again = fx.optimise(path, fx.load_machine("hayashi-640123"), **WITHIN)
    np.testing.assert_array_equal(found.motion.positions, again.motion.positions)


def test_a_path_brings_its_own_tool(ring, hayashi):
    with pytest.raises(SettingError, match="the path has a tool, ball:8; leave out tool"):
        fx.optimise(ring, hayashi, tool="ball:6", **WITHIN)


@pytest.mark.parametrize(
    ("path", "machine", "fault"),
    [
        (None, 640123, "machine is of type int; give a Machine, or the name or file of one"),
        ([1, 2], None, "toolpath is of type list; give a Toolpath, or the file of one"),
        ("part.stl", None, r"part.stl: is a mesh; plan passes on it first \(plan_contour\)"),
    ],
)
def test_anything_else_is_one_clear_error(ring, hayashi, path, machine, fault):
    with pytest.raises(SettingError, match=fault):
        fx.optimise(ring if path is None else path, hayashi if machine is None else machine, **WITHIN)


def test_a_part_out_of_reach_is_placed_as_its_job_places_it(file, ring):
    found = fx.optimise(file, "variaxis-630", tool="ball:8", **WITHIN)
    outcome = run_job(make_job(input=file, machine="variaxis-630", tool="ball:8", **WITHIN))
    assert found.machine.setup == outcome.solution.machine.setup
    assert "part-placed" in {finding.code for finding in found.toolpath.findings}
    assert found.machine.limit_excess(found.motion.positions).max() <= 0.0


def test_a_stated_setup_stays_even_at_zero(ring):
    machine = fx.load_machine("variaxis-630").with_setup()
    with pytest.raises(fx.FiveAxisError, match="no admissible posture"):
        fx.optimise(ring, machine, **WITHIN)


@pytest.mark.parametrize(
    "function", [fx.Solution.program, fx.Solution.write, fx.write_program, fx.post_program]
)
def test_each_option_of_writing_is_a_keyword(function):
    own = inspect.signature(function).parameters
    for name, (_, option) in options_of(Writing).items():
        assert own[name].default == option.default
        assert name in function.__doc__


@pytest.mark.parametrize("function", [fx.optimise, fx.verify_program])
def test_what_stands_around_the_cut_is_said_alike(function):
    own = inspect.signature(function).parameters
    assert set(options_of(Workpiece)) <= set(own)
    assert {"fixtures", "clearances"} <= set(own)


def test_jobs_and_commands_have_the_same_options():
    fields = Job.model_fields
    assert set(options_of(Writing)) | set(options_of(Surrounding)) <= set(fields)
    assert set(options_of(Framing)) == set(fx.ProgramSettings.model_fields)
    for verb in ("optimise", "post"):
        told = CliRunner().invoke(app, [verb, "--help-all"]).output
        for name, (_, option) in {**options_of(Writing), **options_of(Framing)}.items():
            flag = (option.flags or f"--{name.replace('_', '-')}").split()[0].partition("/")[0]
            assert flag in told, f"{verb} {flag}"
