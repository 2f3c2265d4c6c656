"""The whole way, from a path to verified postures and NC, on machines of every structure."""

from dataclasses import replace

import numpy as np
import pytest

import fiveaxis as fx
from fiveaxis.base.errors import JobError
from fiveaxis.job import load_job_machine, make_job
from fiveaxis.model import (
    DirectionalDrive,
    Limits,
    Machine,
    Tool,
    Toolpath,
    load_machine,
    machine_names,
    tool_poses,
)
from fiveaxis.nc.program import compose_program

FIVE_AXIS = [n for n in machine_names() if len(load_machine(n).rotaries) == 2]
TILT = (10.0, 60.0)


def with_powers(machine: Machine) -> Machine:
    """The machine with plain drives, Z+ the dear one, and linear axes that reach everything.

    Beyond its travel a machine's bodies would run into each other: they are left out.
    """
    drives = {c: DirectionalDrive(40.0, 40.0) for c in "XY"} | {"Z": DirectionalDrive(600.0, 400.0)}
    turning = DirectionalDrive(200.0, 200.0, proportional=True)
    return replace(
        machine,
        bodies=(),
        axes=tuple(
            replace(a, drive=turning) if a.is_rotary else replace(a, drive=drives[a.letter], limits=Limits())
            for a in machine.axes
        ),
    )


def ring(count: int = 40, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Toolpath:
    """A ring of contacts on a wall that opens upwards, reachable for every machine's tilt."""
    turn = np.linspace(0.0, 1.5 * np.pi, count)
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    normal = np.cos(np.radians(35.0)) * out + np.sin(np.radians(35.0)) * np.array([0.0, 0.0, 1.0])
    return Toolpath.from_contacts(15.0 * out + np.array(offset), normal, Tool.ball(6), name="ring")


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_a_path_is_optimised_and_verified_on_every_library_machine(name):
    machine = with_powers(load_machine(name)).with_setup((5.0, -8.0, 20.0), (0.0, 0.0, 30.0))
    machine = machine.with_tool_length(80.0)
    solution = fx.optimise(ring(), machine, tilt=TILT, effort="quick")
    report = fx.verify(solution.motion, machine, ring(), tilt=TILT)
    assert report.ok, report.counts
    for saved in solution.savings().values():
        assert saved > -1e-9


def test_moving_the_setup_is_moving_the_path():
    machine = with_powers(load_machine("variaxis-630"))
    offset = (12.0, -7.0, 30.0)
    set_up = fx.optimise(ring(), machine.with_setup(offset), tilt=TILT, effort="quick")
    moved = fx.optimise(ring(offset=offset), machine, tilt=TILT, effort="quick")
    assert set_up.energy.total == pytest.approx(moved.energy.total, rel=1e-6)
    np.testing.assert_allclose(set_up.motion.positions, moved.motion.positions, atol=1e-4)


def test_on_a_table_machine_the_tool_length_lifts_z_and_nothing_else():
    machine = with_powers(load_machine("hayashi-640123"))
    plain = fx.optimise(ring(), machine, tilt=TILT, effort="quick")
    longer = fx.optimise(ring(), machine.with_tool_length(50.0), tilt=TILT, effort="quick")
    lift = longer.motion.positions - plain.motion.positions
    np.testing.assert_allclose(lift, np.tile([0.0, 0.0, 50.0, 0.0, 0.0], (len(lift), 1)), atol=1e-4)


def test_a_longer_tool_in_a_head_moves_the_linear_axes_along_the_tool():
    """p + L o is where the gauge point is: the tip stays."""
    machine = load_machine("linuxcnc-bridgemill")
    positions = np.array([[10.0, -20.0, 30.0, 0.4, 1.1]])
    short = machine.with_tool_length(40.0)
    tip, axis = tool_poses(short, positions)
    long_tip, long_axis = tool_poses(machine.with_tool_length(100.0), positions)
    np.testing.assert_allclose(long_axis, axis)
    np.testing.assert_allclose(long_tip, tip - 60.0 * axis, atol=1e-12)


def test_a_head_machine_without_tool_length_is_refused():
    job = make_job(input="x.csv", tool="ball:6", machine="linuxcnc-max5")
    with pytest.raises(JobError, match=r"doesn't always hold the tool along Z.*tool_length"):
        load_job_machine(job)
    assert load_job_machine(make_job(job, tool_length=90.0)).tool_length == 90.0


def test_a_jobs_setup_reaches_the_machine():
    setup = {"offset": (1.0, 2.0, 3.0), "rotation": (0.0, 0.0, 90.0)}
    job = make_job(input="x.csv", tool="ball:6", machine="hayashi-640123", setup=setup)
    tip, axis = tool_poses(load_job_machine(job), np.array([[4.0, 2.0, 3.0, 0.0, 0.0]]))
    np.testing.assert_allclose(tip, [[0.0, -3.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(axis, [[0.0, 0.0, 1.0]])


def program_of(machine: Machine) -> str:
    solution = fx.optimise(ring(12), machine, tilt=TILT, effort="quick")
    return " ".join(compose_program(solution.motion, machine=machine, control="linuxcnc").lines)


def test_a_program_says_setup_and_tool_length_and_never_adds_the_length_twice():
    machine = with_powers(load_machine("hayashi-640123"))
    plain = program_of(machine)
    assert " G43 " in plain
    assert "setup" not in plain
    own = program_of(machine.with_setup((10.0, 0.0, 0.0)).with_tool_length(70.0))
    assert " G49 " in own
    assert " G43 " not in own
    assert "tool length: 70 mm, contained in the words" in own
    assert "the tip is at -10 0 -70 mm of the workpiece" in own
    assert "workpiece at offset [10, 0, 0] mm" in own
