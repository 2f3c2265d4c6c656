"""Energies are those over the time that the control takes: one number in solution, program and its reader."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.quick_optimiser import optimise

import fiveaxis as fx
from fiveaxis.base.errors import SettingError
from fiveaxis.job.program import MadeProgram, make_program
from fiveaxis.model import (
    Clock,
    Constraints,
    Interpolation,
    Motion,
    Tool,
    Toolpath,
    blocks_energy,
    load_machine,
    motion_energy,
)
from fiveaxis.model.motion.steadiness import measure_steadiness
from fiveaxis.model.motion.timing import axis_times
from fiveaxis.nc import DIALECTS, ProgramOptions
from fiveaxis.posture import Optimum

TRUNNION = load_machine("linuxcnc-xyzac-trt").with_drives_of(load_machine("hayashi-640123"))
MODES = {"axes": Interpolation.JOINT, "tip": Interpolation.TCP}
TILT = (5.0, 30.0)


def leaning_path(count: int = 31) -> Toolpath:
    """A cut of 30 mm whose normals swing to and fro."""
    x = np.linspace(-15.0, 15.0, count)
    lean = np.radians(20.0) * np.sin(np.pi * x / 5.0)
    normals = np.column_stack([np.sin(lean), np.full(count, 0.3), np.cos(lean)])
    contacts = np.column_stack([x, np.zeros(count), np.full(count, 10.0)])
    return Toolpath.from_contacts(contacts, normals, Tool.ball(6), feed_mm_min=1200.0)


@pytest.fixture(scope="module", params=["axes", "tip"])
def made(request) -> tuple[Optimum, MadeProgram]:
    mode = request.param
    clock = Clock(DIALECTS["linuxcnc"], mode)
    solution = optimise(
        leaning_path(), TRUNNION, tilt=TILT, effort="quick", clock=clock, interpolation=MODES[mode]
    )
    options = ProgramOptions.of(control="linuxcnc", coordinates=mode, header={"tool": "ball:6"})
    constraints = Constraints.of_degrees(tilt=TILT)
    return solution, make_program(solution.motion, TRUNNION, solution.toolpath, constraints, options)


def test_the_energy_is_over_the_time_of_the_control(made):
    solution, program = made
    energy, blocks = solution.energy, program.motion.blocks
    assert energy.timing == "accelerations"
    assert energy.feed_time == pytest.approx(blocks.time.sum())
    assert energy.time == solution.clock(blocks, TRUNNION).total > 1.05 * energy.feed_time
    assert energy.total == pytest.approx(
        motion_energy(TRUNNION, solution.clock.timed(blocks, TRUNNION)).total
    )
    assert energy.total > motion_energy(TRUNNION, blocks).total


def test_a_reader_of_the_program_gets_the_same_energy_and_time(made, tmp_path):
    solution, program = made
    read = fx.program_energy(program.write(tmp_path / "p.ngc", unverified=not program.ok), TRUNNION)
    assert read.energy.timing == "accelerations"
    # Without the ways in and out, which the solution's energy leaves out.
    first, count = program.motion.first, len(program.motion.blocks)
    lines = {k for k, row in enumerate(program.text.rows, start=1) if first < row < first + count}
    blocks = [row for row in read.rows if row["line"] in lines]
    # Words have six decimals, and whole cycles turn on them.
    assert sum(row["time"] for row in blocks) == pytest.approx(solution.energy.time, abs=1e-3 * count)
    assert sum(row["energy"] for row in blocks) == pytest.approx(solution.energy.total, rel=2e-3)


def test_the_starts_and_reversals_are_those_of_the_programs_blocks_also_of_baselines(made):
    solution, program = made
    blocks = solution.clock.timed(program.motion.blocks, TRUNNION)
    counted = measure_steadiness(TRUNNION, blocks).as_dict()
    assert solution.energy.steadiness.as_dict() == counted
    for name, baseline in solution.compared.items():
        blocks = solution.filling.blocks(baseline.toolpath or solution.toolpath, TRUNNION, baseline.motion)
        counted = measure_steadiness(TRUNNION, solution.clock.timed(blocks, TRUNNION)).as_dict()
        assert baseline.energy.steadiness.as_dict() == counted, name


def test_another_control_takes_another_time(made, tmp_path):
    program = made[1]
    file = program.write(tmp_path / "p.ngc", unverified=not program.ok)
    own, other = fx.program_energy(file, TRUNNION), fx.program_energy(file, TRUNNION, control="haas")
    assert other.energy.time < own.energy.time
    assert [f.code for f in other.findings if f.code == "corners-assumed"] == ["corners-assumed"]
    programmed = fx.program_energy(file, TRUNNION, corners="programmed")
    assert programmed.energy.time == pytest.approx(own.energy.feed_time)
    assert programmed.energy.time < other.energy.time
    law = fx.program_energy(file, TRUNNION, corners="exact-stop")
    for one in (own, other, programmed, law):
        assert sum(one.energy.limited.values()) == pytest.approx(one.energy.time, rel=1e-6)
    # LinuxCNC stops in every block that turns an axis; without accelerations nobody knows of stops.
    assert own.energy.limited["stops"] > other.energy.limited["stops"]
    assert "stops" not in programmed.energy.limited


def test_no_baseline_is_cheaper_in_that_time(made):
    solution, _ = made
    assert all(share >= 0.0 for share in solution.savings().values()), solution.savings()
    assert {energy.timing for energy in solution.baselines.values()} == {"accelerations"}


def test_charts_show_the_times_of_the_control(made):
    solution, _ = made
    shown = solution.timed()
    assert shown.time.sum() == pytest.approx(solution.energy.time, rel=1e-9)
    assert sum(solution.energy.limited.values()) == pytest.approx(solution.energy.time, rel=1e-9)
    np.testing.assert_allclose(solution.limiting().times, shown.time, atol=1e-9)
    assert (shown.time[1:] > 0.0).all()
    name = next(iter(solution.compared))
    assert solution.timed(name).time.sum() == pytest.approx(solution.baselines[name].time, rel=1e-9)


def test_without_accelerations_the_feed_decides(hayashi):
    solution = optimise(leaning_path(), hayashi, tilt=TILT, effort="quick", clock=Clock(DIALECTS["linuxcnc"]))
    assert solution.energy.timing == "programmed"
    assert solution.energy.time == solution.energy.feed_time
    assert solution.timed() is solution.motion


def test_the_call_names_the_control_and_its_coordinates():
    machine, asked = replace(TRUNNION, bodies=()), {"tilt": TILT, "effort": "quick"}
    solution = fx.optimise(leaning_path(), machine, control="linuxcnc", coordinates="tip", **asked)
    assert (solution.clock.dialect, solution.clock.coordinates) == (DIALECTS["linuxcnc"], "tip")
    assert solution.filling.interpolation is Interpolation.TCP
    unnamed = fx.optimise(leaning_path(), machine, coordinates="tip", **asked)
    assert unnamed.filling.interpolation is Interpolation.TCP
    assert unnamed.energy.time < solution.energy.time
    with pytest.raises(SettingError, match="did you mean 'linuxcnc'"):
        fx.optimise(leaning_path(), machine, control="lunixcnc", **asked)


steps_of_axes = st.lists(st.tuples(*[st.integers(-40, 40)] * 5), min_size=1, max_size=12)


@given(steps_of_axes, st.sampled_from(["linuxcnc", "haas"]))
def test_energy_and_time_are_never_below_those_at_the_feed(steps, control):
    """Drives of constant power: the longer a block lasts, the more they draw."""
    rows = np.vstack([np.zeros(5), np.cumsum(np.array(steps) * [0.1, 0.1, 0.1, 0.005, 0.01], axis=0)])
    length = np.abs(np.diff(rows, axis=0, prepend=rows[:1])).max(axis=1)
    n = len(rows)
    # Words are rounded: no axis is at its highest speed to the last digit.
    time = np.maximum(length / 20.0, 1.001 * axis_times(TRUNNION, np.diff(rows, axis=0, prepend=rows[:1])))
    blocks = Motion("XYZAC", rows, np.full(n, 20.0), time, np.zeros(n, int), np.arange(n))
    clock = Clock(DIALECTS[control])
    timed, plain = blocks_energy(TRUNNION, blocks, clock), motion_energy(TRUNNION, blocks)
    assert timed.time >= plain.time - 1e-9
    assert timed.total >= plain.total - 1e-6
    assert timed.travel == pytest.approx(plain.travel)
    bare = tuple(replace(axis, max_acceleration=None) for axis in TRUNNION.axes)
    assert blocks_energy(replace(TRUNNION, axes=bare), blocks, clock).total == plain.total
