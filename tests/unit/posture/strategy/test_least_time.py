"""Least time: only what slows a path down is priced, and what is free is smooth."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import for_tilt, optimise, tilt_bounds

import fiveaxis as fx
from fiveaxis.base.errors import MachineError, SettingError
from fiveaxis.job import make_job, run_job
from fiveaxis.model import Clock, Constraints, Interpolation, Machine, Tool, Toolpath, follow, time_motion
from fiveaxis.nc import DIALECTS
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.least_time import TIME_PRICE, by_time, from_rest_to_rest
from fiveaxis.posture.strategy.rotary_bounds import turn_bounds
from fiveaxis.posture.terms import acceleration_excess
from fiveaxis.show.report.page import compose_page

CONE = {"cone": 20.0, "effort": "quick"}
# mm/s and rad/s, mm/s² and rad/s², of X Y Z A C.
SPEEDS, PUSHES = (100.0, 100.0, 100.0, 1.0, 1.0), (1000.0, 1000.0, 1000.0, 5.0, 5.0)
# Seconds: what rounding of sums leaves.
EXACT = 1e-9


def limited(machine: Machine, speeds=SPEEDS, pushes=PUSHES) -> Machine:
    """The machine with other highest speeds and accelerations."""
    axes = (
        replace(axis, max_speed=v, max_acceleration=a)
        for axis, v, a in zip(machine.axes, speeds, pushes, strict=True)
    )
    return replace(machine, axes=tuple(axes))


def wavy(count: int = 41, *, swing: float = 25.0, waves: float = 6.0, feed: float = 3000.0) -> Toolpath:
    """A straight cut whose programmed axis swings to and fro, deg, like a surface's normal."""
    x = np.linspace(-40.0, 40.0, count)
    lean = np.radians(swing) * np.sin(waves * np.pi * x / 40.0)
    axis = np.column_stack([np.sin(lean), np.full(count, 0.3), np.cos(lean)])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    contact = np.column_stack([x, np.zeros(count), np.full(count, 10.0)])
    return replace(
        Toolpath.from_contacts(contact, axis, Tool.ball(6), feed_mm_min=feed),
        axis=axis,
    )


@pytest.fixture(scope="module")
def machine(hayashi) -> Machine:
    return limited(hayashi)


@pytest.fixture(
    scope="module",
    params=[
        "within 5 um",
        pytest.param("LinuxCNC", marks=pytest.mark.slow),
        pytest.param("LinuxCNC, tip", marks=pytest.mark.slow),
    ],
)
def solution(request, machine):
    told = {
        "within 5 um": (Clock(), Interpolation.JOINT),
        "LinuxCNC": (Clock(DIALECTS["linuxcnc"]), Interpolation.JOINT),
        "LinuxCNC, tip": (Clock(DIALECTS["linuxcnc"], "tip"), Interpolation.TCP),
    }
    clock, interpolation = told[request.param]
    return optimise(wavy(), machine, objective="time", clock=clock, interpolation=interpolation, **CONE)


def test_no_baselines_program_is_quicker(solution):
    times = {name: energy.time for name, energy in solution.baselines.items()}
    assert "as-programmed" in times
    assert all(solution.energy.time <= time + EXACT for time in times.values()), times


def test_the_reported_time_is_that_of_the_programs_blocks(solution):
    blocks = solution.filling.blocks(solution.toolpath, solution.machine, solution.motion)
    assert solution.energy.time == solution.clock(blocks, solution.machine).total
    shares = solution.time_savings()
    assert shares["as-programmed"] == 1.0 - solution.energy.time / solution.baselines["as-programmed"].time


def test_an_axis_that_reverses_with_the_normal_is_smoothed(solution):
    """With the programmed axis A would stop and reverse at every wave."""
    assert solution.time_savings()["as-programmed"] > 0.05
    if solution.clock.stops_at_turns:
        return  # axes stand between blocks anyway
    problem, before = solution.problem, solution.compared["as-programmed"].motion.positions
    term = acceleration_excess(problem)
    excess = [
        np.maximum(np.abs(term.values(problem.quantities(path))) - term.free, 0.0).sum()
        for path in (before, solution.motion.positions)
    ]
    assert excess[1] < 0.2 * excess[0]


def test_a_path_that_no_axis_limits_takes_its_feeds_time_and_is_steady(hayashi):
    slow = wavy(feed=60.0)
    at_once = limited(hayashi, pushes=(None,) * 5)
    found = optimise(slow, at_once, objective="time", **CONE)
    assert found.energy.time == pytest.approx(slow.lengths.sum() / slow.feed[0], abs=EXACT)
    problem, paths = found.problem, [found.motion, *(b.motion for b in found.compared.values())]
    assert problem.delay(found.motion.positions).max() == 0.0
    # As many locations each: the squares of their turns can be compared.
    bends = [float((path.moves[:, at_once.rotary_columns] ** 2).sum()) for path in paths]
    assert bends[0] < 0.5 * min(bends[1:]), bends


def posed(path: Toolpath, machine: Machine) -> Problem:
    path = for_tilt(path, None, CONE["cone"])
    built = Problem.build(
        path, machine, tilt_bounds(path, None, CONE["cone"]), max_turn=turn_bounds(path, Constraints())
    )
    return by_time(built)


def test_no_sequence_of_postures_on_a_grid_is_quicker(hayashi):
    """Brute force over the angles, location by location, with A as the limiting axis."""
    machine = limited(hayashi, speeds=(100.0, 100.0, 100.0, 0.3, 50.0), pushes=(None,) * 5)
    path = wavy(65, swing=40.0, waves=2.0, feed=1000.0)
    found = optimise(path, machine, objective="time", **CONE)
    problem = posed(path, machine)
    # C, which turns freely, and A, which doesn't.
    first, second = np.meshgrid(
        np.radians(np.arange(-60.0, 61.0, 6.0)), np.radians(np.arange(-60.0, 31.0, 6.0))
    )
    states = np.column_stack([first.ravel(), second.ravel()])
    placed = [problem.placed(np.array([i]), states[None]) for i in range(len(path))]
    axes, excess = (np.concatenate(parts) for parts in zip(*placed, strict=True))
    late = np.where(excess[0] > 0.0, np.inf, 0.0)
    for i in range(1, len(path)):
        times = np.abs(axes[i][None] - axes[i - 1][:, None]) / problem.top_speed
        step = np.maximum(times.max(axis=-1), problem.least_time[i - 1])
        turn = np.abs(states[None] - states[:, None]) > problem.max_turn[i - 1] + 1e-9
        step = np.where(turn.any(axis=-1), np.inf, step)
        late = np.where(excess[i] > 0.0, np.inf, (late[:, None] + step).min(axis=0))
    assert np.isfinite(late.min())
    assert found.energy.time <= late.min() + 0.01


def test_a_second_costs_the_same_however_it_is_lost(hayashi):
    """An axis that reverses from v loses v / A, and a late one its delay."""
    machine = limited(hayashi)
    problem = posed(wavy(), machine)
    assert problem.time_price == TIME_PRICE
    np.testing.assert_allclose(problem.excess_price * 2.0 * np.array(PUSHES), TIME_PRICE)


@pytest.mark.parametrize("feed", [100.0, 1000.0, 6000.0])
def test_blocks_from_rest_to_rest_are_priced_by_the_time_they_take(hayashi, feed):
    """A is the limiting axis: it reaches the feed, doesn't reach it, or runs at its highest speed."""
    machine = limited(hayashi, (1e5, 1e5, 1e5, 0.5, 1e5), (1e8, 1e8, 1e8, 2.0, 1e8))
    path = for_tilt(wavy(21, feed=feed), None, CONE["cone"])
    turns = np.concatenate([[0.0], np.geomspace(1e-3, 0.3, 20) * np.tile([1.0, -1.0], 10)])
    rotary = np.column_stack([np.zeros(21), np.cumsum(turns)])
    problem = from_rest_to_rest(posed(path, machine), rotary)
    motion = follow(path, machine, rotary)
    stops = np.ones(21, dtype=bool)
    times = time_motion(motion, machine, corners=stops).motion.time[1:]
    np.testing.assert_allclose(problem.least_time + problem.delay(motion.positions), times, rtol=2e-3)


def test_without_speeds_there_is_no_least_time(hayashi):
    unknown = limited(hayashi, speeds=(None,) * 5)
    with pytest.raises(MachineError, match=r"highest speed of X, Y, Z, A, C.*add max_speed to \[axes.X\]"):
        optimise(wavy(), unknown, objective="time", **CONE)


def test_without_accelerations_the_result_says_so(hayashi):
    unknown = limited(hayashi, pushes=(1000.0, 1000.0, None, 5.0, None))
    found = optimise(wavy(9), unknown, objective="time", **CONE)
    (finding,) = [f for f in found.toolpath.findings if f.code == "acceleration-unknown"]
    assert "of Z, C" in finding.message


def test_time_as_the_objective_excludes_another_price_of_time(machine):
    with pytest.raises(SettingError, match="time_price"):
        fx.optimise(wavy(9), machine, objective="time", time_price=5.0, **CONE)


@pytest.mark.slow
def test_terminal_report_and_document_of_a_job_have_the_same_time(tmp_path):
    path, file = wavy(21), tmp_path / "wavy.csv"
    table = np.hstack([path.contact, path.axis])
    np.savetxt(file, table, delimiter=",", header="x,y,z,i,j,k", comments="", fmt="%.9f")
    job = {"machine": "linuxcnc-xyzac-trt", "drives": "hayashi-640123", "tool": "ball:6", "feed": 1000.0}
    job |= {"cone": 20.0, "effort": "quick", "objective": "time", "keep_clear": False}
    outcome = run_job(make_job(input=file, **job))
    solution, document = outcome.solution, outcome.document
    blocks = outcome.program.motion.blocks
    assert document["energy"]["time"] == solution.clock(blocks, solution.machine).total
    shares = {name: saved["time"] for name, saved in document["savings"].items()}
    assert shares == solution.time_savings()
    page = compose_page(outcome.report)
    assert "time at the feed (s)" in page
    assert f"{document['energy']['time']:.1f}</td>" in page
