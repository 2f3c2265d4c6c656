"""The method made for paths: its algebra against dense matrices, its optimum against IPOPT's."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.machine import Limits, Machine, load_machine
from fiveaxis.posture import interior_kernel as kernel
from fiveaxis.posture import optimise
from fiveaxis.posture.interior import as_banded, is_banded, minimise, split
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.local.refinement import _by_ipopt
from fiveaxis.toolpath import Tool, Toolpath, tilt_bounds

N = 40
# What the last barrier parameter and IPOPT's tolerance leave of the cost (J).
GAP = 2e-3


def limited(machine: Machine) -> Machine:
    """The machine with ends of X and A that bind."""
    bounds = {"X": Limits(-14.0, 60.0), "A": Limits(np.radians(-70.0), np.radians(20.0))}
    return replace(
        machine, axes=tuple(replace(a, limits=bounds.get(a.letter, a.limits)) for a in machine.axes)
    )


@pytest.fixture(params=["free", "limited", "slow turns", "bends", "link"])
def problem(request) -> Problem:
    angle = np.linspace(0.0, 4.0, N)
    normal = np.stack([np.cos(angle), np.sin(angle), np.full(N, -0.3)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), np.full(N, 10.0)], axis=1)
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6))
    machine = load_machine("hayashi-640123")
    if request.param == "link":
        path = path.with_links(np.arange(N) // 4 == 3)
    if request.param == "limited":
        machine = limited(machine)
    turn = np.radians(6.5) if request.param == "slow turns" else None
    bend = 3000.0 if request.param == "bends" else 0.0
    return Problem.build(path, machine, tilt_bounds(path, (15, 75)), max_turn=turn, bend_price=bend)


@pytest.fixture
def start() -> np.ndarray:
    turn = np.linspace(0.0, 4.0, N) - np.pi / 2.0
    wobble = 0.005 * np.random.default_rng(3).standard_normal((N, 2))
    return np.stack([turn, np.full(N, np.radians(-66.0))], axis=1) + wobble


def cost(problem, rotary):
    return problem.cost(problem.positions(slice(None), rotary))


@pytest.mark.parametrize("held", [(False, False), (True, True), (False, True)])
def test_its_local_optimum_is_one_for_ipopt_too_and_ipopts_one_for_it(problem, start, held):
    banded = as_banded(problem, held)
    own = minimise(banded, start, iterations=300, barrier=1.0)
    assert own.solved
    assert problem.violation(own.rotary) <= ALLOWED
    assert cost(problem, own.rotary) < cost(problem, start)
    again = _by_ipopt(problem, own.rotary, 300, 1e-4, held)
    assert again.cost == pytest.approx(cost(problem, own.rotary), abs=GAP)
    ipopt = _by_ipopt(problem, start, 300, 1e-1, held)
    assert ipopt.status == "Solve_Succeeded"
    kept = minimise(banded, ipopt.rotary, iterations=300, barrier=1e-4)
    assert cost(problem, kept.rotary) == pytest.approx(ipopt.cost, abs=GAP)
    rows = [row for row, is_held in ((0, held[0]), (-1, held[1])) if is_held]
    np.testing.assert_array_equal(own.rotary[rows], start[rows])


def test_terms_that_it_does_not_know_are_left_to_ipopt(problem):
    assert is_banded(problem)
    speeds = np.array([3.0, 3.0, 1.5, 0.2, 0.3])
    assert not is_banded(replace(problem, top_speed=speeds, time_price=300.0))
    assert not is_banded(replace(problem, top_acceleration=np.array([1.0, 1.0])))


def test_derivatives_of_rows_are_those_of_finite_differences(problem, start):
    banded = as_banded(problem, (False, False))
    shape = banded.low.shape

    def rows(x):
        found = np.zeros(shape), np.zeros((*shape, 2)), np.zeros((*shape, 3))
        kernel.evaluate(banded.waves, x, *found)
        return found

    value, slope, bow = rows(start)
    h = 1e-6
    for axis in range(2):
        step = h * np.eye(2)[axis]
        ahead, back = rows(start + step), rows(start - step)
        np.testing.assert_allclose(slope[..., axis], (ahead[0] - back[0]) / (2 * h), atol=1e-6)
        bowed = (ahead[1] - back[1]) / (2 * h)
        np.testing.assert_allclose(bow[..., axis : axis + 2], bowed, atol=1e-6)
    np.testing.assert_allclose(value[:, :3], problem.positions(slice(None), start)[:, :3], atol=1e-11)


@pytest.mark.parametrize("seed", range(3))
def test_blocks_are_solved_as_the_dense_matrix_is(seed):
    rng, n = np.random.default_rng(seed), 12
    blocks = rng.standard_normal((n, 2, 2))
    beside = 0.4 * rng.standard_normal((n - 1, 2, 2))
    dense = np.zeros((2 * n, 2 * n))
    for i in range(n):
        dense[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = blocks[i] @ blocks[i].T + 2.0 * np.eye(2)
    diagonal = np.array([dense[2 * i : 2 * i + 2, 2 * i : 2 * i + 2][[0, 0, 1], [0, 1, 1]] for i in range(n)])
    for i in range(n - 1):
        dense[2 * i : 2 * i + 2, 2 * i + 2 : 2 * i + 4] = beside[i]
        dense[2 * i + 2 : 2 * i + 4, 2 * i : 2 * i + 2] = beside[i].T
    held = np.zeros(n, dtype=bool)
    held[[0, 5]] = True
    free = np.repeat(~held, 2)
    right, found = rng.standard_normal((n, 2)), np.zeros((n, 2))
    shift = 0.1 - np.linalg.eigvalsh(dense[np.ix_(free, free)])[0]
    assert kernel.solve_blocks(diagonal, beside, right, held, shift, found)
    expected = np.zeros(2 * n)
    matrix = dense[np.ix_(free, free)] + shift * np.eye(free.sum())
    expected[free] = -np.linalg.solve(matrix, right.ravel()[free])
    np.testing.assert_allclose(found.ravel(), expected, atol=1e-10)
    assert not kernel.solve_blocks(diagonal, beside, right, held, shift - 0.2, found)


def test_steps_are_split_on_the_central_path():
    apart = np.array([-30.0, -1e-9, 0.0, 1e-6, 2.0, 1e5])
    s, t = split(apart, np.full(6, 60.0), 1e-3)
    np.testing.assert_allclose(s - t, apart, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(60.0 * s * t, 1e-3 * (s + t), rtol=1e-9)
    assert (s > 0.0).all()
    assert (t > 0.0).all()


def test_the_same_start_gives_the_same_bits(problem, start):
    runs = [minimise(as_banded(problem, (False, False)), start, iterations=50, barrier=1.0) for _ in range(2)]
    np.testing.assert_array_equal(runs[0].rotary, runs[1].rotary)


def test_a_held_axis_and_steps_that_may_not_turn_are_left_to_ipopt(problem):
    still = problem.max_turn.copy()
    still[3] = 0.0
    assert not is_banded(replace(problem, max_turn=still))
    machine = replace(
        problem.machine,
        axes=tuple(
            replace(a, limits=Limits(0.5, 0.5)) if a.letter == "A" else a for a in problem.machine.axes
        ),
    )
    assert not is_banded(replace(problem, machine=machine))


def test_a_slack_that_rounds_to_nothing_beside_its_bound_stops_nothing() -> None:
    """A level circle: steps end so near to their bounds that no room is left in double precision."""
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    contact = np.column_stack([25.0 * np.cos(turn), 25.0 * np.sin(turn), np.full_like(turn, 5.0)])
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(8.0))
    machine = load_machine("hayashi-640123")
    solution = optimise(path, machine, tilt=(15.0, 75.0), max_turn=15.0, effort="quick")
    assert np.isfinite(solution.motion.positions).all()
    assert all(solution.energy.total <= energy.total for energy in solution.baselines.values())
