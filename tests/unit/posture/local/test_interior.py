"""The structured method: its algebra against dense matrices, its optima against IPOPT's for every term."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.quick_optimiser import optimise

from fiveaxis.model import Tool, Toolpath, load_machine
from fiveaxis.posture.local import kernel
from fiveaxis.posture.local.interior import minimise, split_steps
from fiveaxis.posture.local.ipopt import minimise_by_ipopt
from fiveaxis.posture.local.rows import ChainModel, build_rows
from fiveaxis.posture.problem import ALLOWED

# Relative, of the cost: what the last barrier parameter and IPOPT's tolerance leave.
GAP = 1e-6


def cost(problem, rotary):
    return problem.cost(problem.positions(slice(None), rotary))


@pytest.mark.parametrize("held", [(False, False), (True, True), (False, True)])
def test_each_solver_accepts_the_local_optimum_of_the_other(problem, start, held):
    rows = build_rows(problem, held)
    x = rows.start(problem, start)
    own = minimise(rows, x, iterations=300, barrier=1.0)
    assert own.solved
    assert problem.violation(own.rotary) <= ALLOWED
    if problem.violation(x[:, :2]) <= ALLOWED:
        assert cost(problem, own.rotary) < cost(problem, x[:, :2])
    again = minimise_by_ipopt(rows, rows.start(problem, own.rotary), iterations=300, barrier=1e-4)
    assert cost(problem, again.rotary) == pytest.approx(cost(problem, own.rotary), rel=GAP)
    ipopt = minimise_by_ipopt(rows, x, iterations=300, barrier=1e-1)
    assert ipopt.solved
    kept = minimise(rows, rows.start(problem, ipopt.rotary), iterations=300, barrier=1e-4)
    assert cost(problem, kept.rotary) == pytest.approx(cost(problem, ipopt.rotary), rel=GAP)
    at = [row for row, is_held in ((0, held[0]), (-1, held[1])) if is_held]
    np.testing.assert_array_equal(own.rotary[at], x[at, :2])


@pytest.mark.parametrize(("seed", "width"), [(0, 4), (1, 6), (2, 9), (3, 12)])
def test_a_band_is_solved_as_the_dense_matrix_is(seed, width):
    rng, n = np.random.default_rng(seed), 30
    dense = rng.standard_normal((n, n))
    far = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) >= width
    dense = np.where(far, 0.0, dense + dense.T)
    free = np.ones(n, dtype=bool)
    free[[0, 7]] = False
    dense[~free], dense[:, ~free] = 0.0, 0.0
    band = np.zeros((n, width))
    for below in range(width):
        band[below:, below] = np.diagonal(dense, -below)
    inner = dense[np.ix_(free, free)]
    shift = 0.1 - np.linalg.eigvalsh(inner)[0]
    right, found = rng.standard_normal(n), np.zeros(n)
    assert kernel.solve_band(band, right, free, shift, found)
    expected = np.zeros(n)
    expected[free] = -np.linalg.solve(inner + shift * np.eye(free.sum()), right[free])
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert not kernel.solve_band(band, right, free, shift - 0.2, found)


def test_steps_are_split_on_the_central_path():
    apart = np.array([-30.0, -1e-9, 0.0, 1e-6, 2.0, 1e5])
    s, t = split_steps(apart, np.full(6, 60.0), 1e-3)
    np.testing.assert_allclose(s - t, apart, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(60.0 * s * t, 1e-3 * (s + t), rtol=1e-9)
    assert (s > 0.0).all()
    assert (t > 0.0).all()


def test_a_slack_that_rounds_to_zero_beside_its_bound_does_no_harm() -> None:
    """A level circle: steps end so near to their bounds that no room is left in double precision."""
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    contact = np.column_stack([25.0 * np.cos(turn), 25.0 * np.sin(turn), np.full_like(turn, 5.0)])
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    path = Toolpath.from_contacts(contact, normal, Tool.ball(8.0))
    machine = load_machine("hayashi-640123")
    solution = optimise(path, machine, tilt=(15.0, 75.0), max_turn=15.0)
    assert np.isfinite(solution.motion.positions).all()
    assert all(solution.energy.total <= energy.total for energy in solution.baselines.values())


def test_prices_may_change_from_one_solve_to_the_next(problem, start):
    """Reweighted prices: cheaper travel can't cost more."""
    rows = build_rows(problem)
    first = minimise(rows, rows.start(problem, start), iterations=300, barrier=1.0)
    halved = replace(problem, plus=0.5 * problem.plus, minus=0.5 * problem.minus)
    again = build_rows(halved)
    found = minimise(again, again.start(halved, first.rotary), iterations=300, barrier=0.1)
    assert found.solved
    assert cost(halved, found.rotary) <= cost(halved, first.rotary) * (1.0 + GAP)


def test_a_start_that_has_no_position_somewhere_stays_as_it_is(problem, start):
    """A flat end mill along the normal has none: nothing is warned of, and nothing claimed."""
    rows = build_rows(problem, (False, False))
    x = rows.start(problem, start)
    nowhere = np.full_like(ChainModel(rows).values(x), -np.inf)
    lost = SimpleNamespace(values=lambda _: nowhere, derivatives=ChainModel(rows).derivatives)
    found = minimise(rows, x, model=lost, iterations=20, barrier=1.0)
    assert not found.solved
    np.testing.assert_array_equal(found.x, x)
