"""The terms: their values, their coefficients, and the quantities' derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.model import DirectionalDrive, Machine, Tool, Toolpath, load_machine
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.terms import Term, acceleration_excess, location_tapes

N = 12
RNG = np.random.default_rng(5)


def problem_of(machine: Machine, tool: Tool) -> Problem:
    """Every term at once, on locations in general position."""
    normal = RNG.standard_normal((N, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    contact = 30.0 * RNG.standard_normal((N, 3))
    path = for_tilt(Toolpath.from_contacts(contact, normal, tool), (15, 75), None)
    powered = load_machine("hayashi-640123").axes
    drives = {axis.is_rotary: axis.drive for axis in powered}
    axes = tuple(replace(a, drive=drives[a.is_rotary]) for a in machine.axes)
    problem = Problem.build(
        path,
        replace(machine, axes=axes),
        tilt_bounds(path, (15, 75)),
        up_penalty=2.0,
        max_turn=0.5,
        bend_price=50.0,
        time_price=300.0,
    )
    speeds, pushes = np.array([3.0, 3.0, 1.5, 0.2, 0.3]), np.array([1.0, 2.0, np.inf, 0.3, 0.2])
    return replace(problem, top_speed=speeds, top_acceleration=pushes)


MACHINES = {
    "hayashi": load_machine("hayashi-640123"),
    "table and head": load_machine("linuxcnc-max5"),
    "rotary between": Machine.from_code("624013"),
}


@pytest.fixture(params=[(m, t) for m in MACHINES for t in ("ball", "bull")], ids="-".join)
def problem(request) -> Problem:
    machine, tool = request.param
    return problem_of(MACHINES[machine], Tool.ball(6.0) if tool == "ball" else Tool.bull(6.0, 1.0))


@pytest.fixture
def rotary() -> np.ndarray:
    return RNG.uniform(-1.2, 1.2, (N, 2))


@pytest.mark.parametrize(
    ("machine", "letter", "side"),
    [
        (MACHINES["hayashi"], "Z", "plus"),
        (replace(MACHINES["hayashi"], vertical=(0.0, 1.0, 0.0)), "Y", "plus"),
        (replace(MACHINES["hayashi"], vertical=(-1.0, 0.0, 0.0)), "X", "minus"),
        (MACHINES["rotary between"], "Z", "plus"),
        (Machine.from_code("641302"), "Z", "minus"),
    ],
)
def test_the_up_penalty_is_a_price_of_the_way_that_lifts(machine, letter, side):
    path = for_tilt(Toolpath.from_contacts(np.eye(3), np.eye(3), Tool.ball(6)), (15, 75), None)
    powered = replace(
        machine, axes=tuple(replace(a, drive=DirectionalDrive(plus=1.0, minus=2.0)) for a in machine.axes)
    )
    free, charged = (
        Problem.build(path, powered, tilt_bounds(path, (15, 75)), up_penalty=p) for p in (0.0, 5.0)
    )
    added = {name: getattr(charged, name) - getattr(free, name) for name in ("plus", "minus")}
    np.testing.assert_allclose(added[side][:, powered.column(letter)], 5.0, atol=1e-12)
    assert sum(np.count_nonzero(a) for a in added.values()) == len(path) - 1


def quantities(problem, rotary):
    tapes = location_tapes(problem.machine, problem.zone)
    return tapes.values(np.hstack([rotary, problem.pivot, problem.normal]))


def test_the_quantities_are_the_kinematics_positions_and_tool_axes(problem, rotary):
    positions, _ = problem.placed(slice(None), rotary)
    found = quantities(problem, rotary)
    np.testing.assert_allclose(found[:, :5], positions, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found[:, 5:], axis=1), 1.0)


def test_slopes_and_second_derivatives_are_those_of_finite_differences(problem, rotary):
    tapes = location_tapes(problem.machine, problem.zone)
    weights = RNG.standard_normal((N, 8))

    def derivatives(angles):
        found = tapes.derivatives(np.hstack([angles, problem.pivot, problem.normal, weights]))
        return found[:, :8], found[:, 8:24].reshape(N, 8, 2).transpose(0, 2, 1), found[:, 24:]

    value, slope, bow = derivatives(rotary)
    np.testing.assert_allclose(value, quantities(problem, rotary), rtol=1e-12, atol=1e-12)
    h = 1e-6
    for angle in range(2):
        step = h * np.eye(2)[angle]
        ahead, back = derivatives(rotary + step), derivatives(rotary - step)
        np.testing.assert_allclose(slope[:, angle], (ahead[0] - back[0]) / (2 * h), rtol=1e-4, atol=1e-4)
        bent = np.einsum("nem,nm->ne", ahead[1] - back[1], weights) / (2 * h)
        np.testing.assert_allclose(bow[:, angle : angle + 2], bent, rtol=1e-4, atol=1e-3)


def test_tapes_of_slopes_and_bows_have_the_same_derivatives_of_each_quantity(problem, rotary):
    tapes = location_tapes(problem.machine, problem.zone)
    given = np.hstack([rotary, problem.pivot, problem.normal])
    weights = RNG.standard_normal((N, 8))
    weighted, seconds = tapes.derivatives(np.hstack([given, weights])), tapes.second_derivatives(given)
    np.testing.assert_allclose(tapes.gradients(given), seconds[:, :24], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(seconds[:, :8], weighted[:, :8], rtol=1e-12, atol=1e-12)
    for angle in range(2):
        gradients = seconds[:, 8 * angle + 8 : 8 * angle + 16]
        np.testing.assert_allclose(gradients, weighted[:, 8 + angle : 24 : 2], rtol=1e-12, atol=1e-12)
    bent = np.einsum("nij,nj->ni", seconds[:, 24:].reshape(N, 3, 8), weights)
    np.testing.assert_allclose(bent, weighted[:, 24:], rtol=1e-9, atol=1e-9)


def test_every_terms_coefficients_give_its_values(problem, rotary):
    positions = problem.positions(slice(None), rotary)
    axis = quantities(problem, rotary)[:, 5:]
    path = problem.quantities(positions, axis)
    names = {term.name for term in problem.terms}
    assert names == {"limits", "leans", "travel", "bends", "waits", "durations", "acceleration"}
    for term in problem.terms:
        places, coefficients = term.coefficients(path.shape[1])
        windows = np.stack([path[r : r + term.span].ravel() for r in term.rows])
        read = np.where(places >= 0, windows[:, places], 0.0)
        np.testing.assert_allclose(
            np.sum(coefficients * read, axis=-1), term.values(path), rtol=1e-12, atol=1e-12, err_msg=term.name
        )


def test_the_cost_of_a_path_is_that_of_its_formula(problem, rotary):
    positions = problem.positions(slice(None), rotary)
    step = np.diff(positions, axis=0)
    turn = step[:, problem.machine.rotary_columns]
    expected = (problem.plus * np.maximum(step, 0.0)).sum() + (problem.minus * np.maximum(-step, 0.0)).sum()
    late = np.maximum((np.abs(step) / problem.top_speed).max(axis=1) - problem.least_time, 0.0)
    expected += 300.0 * late.sum() + 50.0 * (turn**2).sum()
    speed = step / problem.least_time[:, None]
    between = (problem.least_time[1:] + problem.least_time[:-1])[:, None] / 2.0
    excess = np.maximum(np.abs(np.diff(speed, axis=0)) - between * problem.top_acceleration, 0.0)
    expected += (problem.excess_price * excess).sum()
    assert problem.cost(positions) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(problem.delay(positions), late)
    term = acceleration_excess(problem)
    changes = np.abs(term.values(problem.quantities(positions)))
    np.testing.assert_allclose(np.maximum(changes - term.free, 0.0), excess)


def test_links_and_rapids_have_no_price_on_changes_of_speed():
    problem = problem_of(MACHINES["hayashi"], Tool.ball(6.0))
    linked = replace(problem, strict=np.arange(N - 1) != 4)
    assert len(acceleration_excess(linked).rows) == N - 4


def test_terms_that_a_problem_doesnt_need_are_left_out():
    problem = problem_of(MACHINES["hayashi"], Tool.ball(6.0))
    endless = np.full(5, np.inf)
    plain = replace(problem, top_speed=endless, top_acceleration=endless, bend_price=np.zeros(N - 1))
    assert [term.name for term in plain.terms] == ["limits", "leans", "travel"]


def test_a_term_that_is_not_linear_is_refused():
    def product(window, _):
        return [window[0].positions[0] * window[1].positions[0]]

    with pytest.raises(ValueError, match="product isn't linear"):
        Term("product", product, 2, np.arange(3), np.empty((3, 0))).coefficients(9)


def test_up_costs_the_penalty_on_top_of_the_drives_cost():
    problem = problem_of(MACHINES["hayashi"], Tool.ball(6.0))
    drive = problem.machine.axis("Z").drive
    z = problem.machine.column("Z")
    assert problem.plus[0, z] - problem.minus[0, z] == pytest.approx(2.0 + 0.06 * (drive.plus - drive.minus))
