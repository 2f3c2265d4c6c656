"""Refinement: never worse than its start, by either solver."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from support.quick_optimiser import tilt_bounds
from support.ring_path import ring

from fiveaxis.base.errors import SettingError
from fiveaxis.model import Tool, Toolpath, load_machine
from fiveaxis.posture.baselines.catalogue import along_normal, lead_lean
from fiveaxis.posture.local.interior import minimise
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.local.rows import build_rows
from fiveaxis.posture.problem import ALLOWED, Problem

RNG = np.random.default_rng(5)


@pytest.fixture
def problem() -> Problem:
    angle = np.linspace(0.0, 4.0, 40)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(40, -0.3)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), np.full(40, 10.0)], axis=1)
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6))
    return Problem.build(path, load_machine("hayashi-640123"), tilt_bounds(path, (15, 75)), up_penalty=2.0)


@pytest.fixture
def timed(problem) -> Problem:
    """The same problem with a price on time and on bends, and axes so slow that both matter."""
    speeds = np.array([3.0, 3.0, 1.5, 0.2, 0.3])
    return replace(
        problem,
        top_speed=speeds,
        top_acceleration=np.array([np.inf, np.inf, np.inf, 0.3, 0.2]),
        time_price=300.0,
        bend_price=np.full(39, 50.0),
    )


@pytest.fixture
def start(problem) -> np.ndarray:
    """Follow the normals, tool tilted up by 40°, with a wobble that leaves the bounds intact."""
    normal = problem.bounds[0].reference
    turn = np.unwrap(np.arctan2(normal[:, 1], normal[:, 0]))
    rotary = np.stack([turn - np.pi / 2.0, np.full(40, np.radians(-66.0))], axis=1)
    return rotary + 0.03 * RNG.standard_normal(rotary.shape)


def cost(problem, rotary):
    return problem.cost(problem.positions(slice(None), rotary))


@pytest.mark.parametrize("solver", ["structured", "ipopt"])
def test_refining_lowers_the_cost_and_stays_within_all_bounds(problem, start, solver):
    assert problem.violation(start) == 0.0
    found = refine(problem, start, iterations=200, barrier=1e-1, solver=solver)
    assert found.status == "Solve_Succeeded"
    assert found.cost == pytest.approx(cost(problem, found.rotary))
    assert found.cost < 0.8 * cost(problem, start)
    assert problem.violation(found.rotary) <= ALLOWED


@pytest.mark.parametrize("iterations", [0, 1, 2, 3, 5, 8, 13])
def test_the_nlp_never_ends_above_its_start(problem, start, iterations):
    found = refine(problem, start, iterations=iterations, barrier=1e-1)
    assert found.cost <= cost(problem, start)
    assert problem.violation(found.rotary) <= ALLOWED


@pytest.mark.parametrize("dearer", [1.0, 10.0, 30.0])
def test_a_path_that_leaves_its_bounds_between_sparse_postures_is_brought_back(hayashi, dearer):
    count, lean = 300, (0, 6)
    u = np.linspace(0.0, 6.0, count)
    normal = np.stack([0.3 * np.sin(5.0 * u), 0.25 * np.cos(7.0 * u), np.ones(count)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    contact = np.stack([20.0 * np.cos(u), 20.0 * np.sin(u), np.zeros(count)], axis=1)
    path = Toolpath.from_contacts(contact, normal, Tool.ball(2))
    problem = Problem.build(path, hayashi, tilt_bounds(path, lean))
    dear = np.where(np.isin(np.arange(5), hayashi.rotary_columns), dearer, 1.0)
    problem = replace(problem, plus=dear * problem.plus, minus=dear * problem.minus)
    along, rows = along_normal(path, hayashi, tilt_bounds(path, lean)), np.arange(0, count, 12)
    sparse = np.stack([np.interp(np.arange(count), rows, angle[rows]) for angle in along.T], axis=1)
    assert problem.violation(sparse) > 0.01
    found = refine(problem, sparse, iterations=25, barrier=1e-2, near=True)
    assert problem.violation(found.rotary) <= ALLOWED


def test_an_unknown_solver_is_an_error(problem, start):
    with pytest.raises(SettingError, match="structured or ipopt"):
        refine(problem, start, iterations=5, barrier=1e-1, solver="simplex")


def test_held_ends_stay_where_they_are(problem, start):
    found = refine(problem, start, iterations=200, barrier=1e-1, held=(True, True))
    np.testing.assert_array_equal(found.rotary[[0, -1]], start[[0, -1]])
    assert found.cost < cost(problem, start)


def test_a_ctrl_c_inside_the_solver_isnt_taken_for_an_answer(problem, start, monkeypatch):
    class Interrupted:
        def __call__(self, **arguments):
            return {"x": arguments["x0"]}

        def stats(self):
            return {"return_status": "NonIpopt_Exception_Thrown", "iter_count": 3}

    monkeypatch.setattr(ca, "nlpsol", lambda *arguments: Interrupted())
    with pytest.raises(KeyboardInterrupt):
        refine(problem, start, iterations=5, barrier=1e-1, solver="ipopt")


def test_time_and_bends_have_their_price(timed, start):
    free = refine(
        replace(timed, time_price=0.0, bend_price=np.zeros(39)), start, iterations=200, barrier=1e-1
    )
    priced = refine(timed, start, iterations=200, barrier=1e-1)
    assert priced.status == "Solve_Succeeded"

    def parts(rotary):
        step = np.diff(timed.positions(slice(None), rotary), axis=0)
        return timed.delay(timed.positions(slice(None), rotary)).sum(), (step[:, [3, 4]] ** 2).sum()

    assert parts(free.rotary)[0] > 0.0
    assert cost(timed, priced.rotary) < cost(timed, free.rotary)
    assert (
        300.0 * parts(priced.rotary)[0] + 50.0 * parts(priced.rotary)[1]
        < 300.0 * parts(free.rotary)[0] + 50.0 * parts(free.rotary)[1]
    )


def test_a_start_that_the_small_barrier_does_not_improve_in_time_is_improved_by_the_large_one(hayashi):
    """On a long path a round from the start's neighbourhood alone may end outside its bounds, and be lost."""
    path = ring(80).shaped("chord")  # along which the feed's direction jumps at both ends
    tilt = tilt_bounds(path, (15, 75))
    problem = Problem.build(path, hayashi, tilt)
    start = lead_lean(path, hayashi, tilt)
    found = refine(problem, start, iterations=15, barrier=0.04, near=True, last=1e-5)
    assert problem.violation(found.rotary) <= ALLOWED
    assert found.cost < 0.5 * problem.path_cost(start)


def test_attempts_that_end_outside_of_the_bounds_are_not_the_last(problem, start, monkeypatch):
    """As where a few steps bring a path near its optimum, but not yet within its bounds."""
    ended, given = [], minimise

    def soon(*task, **options):
        found = given(*task, **options)
        if len(ended) < 2:
            ended.append(replace(found, x=np.add(found.x, [np.pi, 0.0]), solved=False))
            return ended[-1]
        return found

    monkeypatch.setattr("fiveaxis.posture.local.optima.minimise", soon)
    found = refine(problem, start, iterations=100, barrier=1e-1, near=True)
    assert all(problem.violation(one.x) > ALLOWED for one in ended)
    assert problem.violation(found.rotary) <= ALLOWED
    assert found.cost < 0.9 * cost(problem, start)


@pytest.mark.parametrize("margin", [1e-4, 1e-2])
def test_a_margin_leaves_at_least_half_of_a_range(problem, margin):
    """A lean may be asked for so narrowly that its range would close."""
    narrow = tuple(replace(bound, high=bound.low + 1e-4) for bound in problem.bounds)
    whole, within = (build_rows(replace(problem, bounds=narrow), margin=m) for m in (0.0, margin))
    bounded = np.isfinite(whole.high - whole.low) & (whole.high > whole.low)
    share = (within.high - within.low)[bounded] / (whole.high - whole.low)[bounded]
    assert bounded.sum() >= 40
    assert share.min() >= 0.5 - 1e-9
    assert share.min() < 1.0
