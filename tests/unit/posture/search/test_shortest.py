"""The global search against brute force, on lattices small enough to try every path."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds
from corridors import general_path

from fiveaxis.kinematics.windings import fit_turns
from fiveaxis.machine import load_machine
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search import shortest
from fiveaxis.posture.search.lattice import (
    Coordinates,
    Lattice,
    choose_coordinates,
    grid_lattice,
    level_lattice,
)
from fiveaxis.posture.search.shortest import density, refill, shortest_path, thin
from fiveaxis.toolpath import Tool, Toolpath

SPIN = 4  # column of C


def ring(n: int, turns: float = 1.0, n_z: float = -0.3) -> Toolpath:
    """Contacts round a cylinder, normals leaning downwards."""
    angle = np.linspace(0.0, 2.0 * np.pi * turns, n, endpoint=False)
    flat = np.sqrt(1.0 - n_z**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(n, n_z)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), 10 + 0.01 * np.arange(n)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6))


def problem_of(path: Toolpath, **options) -> Problem:
    return Problem.build(path, load_machine("hayashi-640123"), tilt_bounds(path, (15, 75)), **options)


def random_lattice(rng: np.random.Generator, n: int, shape: tuple[int, int, int], period: float) -> Lattice:
    """States with random linear and A values on a regular grid of C; some are forbidden."""
    spin = np.linspace(-np.pi, np.pi, shape[0], endpoint=False)
    states = rng.uniform(-3.0, 3.0, (n, *shape, 5))
    states[..., SPIN] = spin[None, :, None, None]
    price = np.where(rng.random((n, *shape)) < 0.25, np.inf, 0.0)
    reach = shape[:2]
    return Lattice(lambda rows: (states[rows], price[rows]), SPIN, period, reach, turns_forbidden=True)


def brute_force(problem: Problem, lattice: Lattice) -> float:
    """Try every sequence of states, with every winding of C that the lattice allows."""
    n = len(problem)
    states, price = lattice.states(np.arange(n))
    flat, prices = states.reshape(n, -1, 5), price.reshape(n, -1)
    turns = (-1, 0, 1) if lattice.period else (0,)
    best = np.inf
    for path in itertools.product(range(flat.shape[1]), repeat=n):
        chosen = flat[np.arange(n), path]
        cost = sum(prices[i, s] for i, s in enumerate(path))
        if np.isinf(cost):
            continue
        for i in range(n - 1):
            step = chosen[i + 1] - chosen[i]
            options = []
            for turn in turns:
                moved = step.copy()
                moved[SPIN] += turn * lattice.period
                up, down = np.maximum(moved, 0.0), np.maximum(-moved, 0.0)
                if (np.abs(moved[[4, 3]]) <= problem.max_turn[i]).all():
                    late = max(0.0, (np.abs(moved) / problem.top_speed).max() - problem.least_time[i])
                    bend = problem.bend_price[i] * (moved[[4, 3]] ** 2).sum()
                    travel = problem.plus[i] @ up + problem.minus[i] @ down
                    options.append(travel + problem.time_price * late + bend)
            cost += min(options, default=np.inf)
        best = min(best, cost)
    return best


@pytest.mark.parametrize("period", [0.0, 2.0 * np.pi])
@pytest.mark.parametrize("max_turn", [np.inf, 2.5])
@pytest.mark.parametrize("prices", [{}, {"time_price": 400.0, "bend_price": 30.0}])
@pytest.mark.parametrize("seed", range(4))
def test_the_cheapest_path_is_that_of_brute_force(period, max_turn, prices, seed):
    problem = problem_of(ring(4), max_turn=max_turn, **prices)
    problem = replace(problem, top_speed=np.array([5.0, 8.0, 2.0, 0.5, 0.9]))
    lattice = random_lattice(np.random.default_rng(seed), 4, (3, 2, 1), period)
    expected = brute_force(problem, lattice)
    path = shortest_path(problem, lattice)
    if path is None:
        assert np.isinf(expected)
    else:
        assert problem.cost(path) == pytest.approx(expected, rel=1e-12)


def test_a_lattice_without_a_path_gives_none():
    problem = problem_of(ring(3))
    states = np.zeros((3, 2, 2, 1, 5))
    price = np.zeros((3, 2, 2, 1))
    price[1] = np.inf
    lattice = Lattice(lambda rows: (states[rows], price[rows]), SPIN, 0.0, (2, 2))
    assert shortest_path(problem, lattice) is None


def test_states_of_one_level_have_one_height_and_keep_all_bounds():
    problem = problem_of(ring(12))
    coordinates = choose_coordinates(problem)
    assert coordinates == Coordinates(spin=0, level=2)  # C spins, Z is the most expensive
    lattice = level_lattice(problem, coordinates, np.radians(10.0), 15, (np.pi, 3))
    states, price = lattice.states(np.arange(12))
    allowed = np.isfinite(price)
    assert allowed.sum() > 100
    heights = [states[:, :, j][allowed[:, :, j]][:, 2] for j in range(15)]
    assert all(np.ptp(h) < 1e-9 for h in heights if len(h))
    rows = np.nonzero(allowed)[0]
    rotary = states[allowed][:, problem.machine.rotary_columns]
    positions, excess = problem.placed(rows, rotary)
    assert excess.max() == 0.0
    np.testing.assert_allclose(positions, states[allowed], atol=1e-9)


def test_a_grid_has_only_states_within_bounds():
    problem = problem_of(ring(5))
    lattice = grid_lattice(problem, Coordinates(0, None), (0.2, 0.1), (1.0, 1.0))
    states, price = lattice.states(np.arange(5))
    allowed = np.isfinite(price)
    _, excess = problem.placed(np.nonzero(allowed)[0], states[allowed][:, problem.machine.rotary_columns])
    assert allowed.any()
    assert excess.max() == 0.0


def test_turns_are_shifted_into_the_limits_as_a_whole():
    unwrapped = np.array([0.0, 10.0, 20.0])
    np.testing.assert_allclose(fit_turns(unwrapped, -np.inf, np.inf), unwrapped)
    fitted = fit_turns(unwrapped, -21.0, 3.0)
    np.testing.assert_allclose(np.diff(fitted), 10.0)
    assert fitted.min() >= -21.0
    assert fitted.max() <= 3.0
    assert fit_turns(unwrapped, -5.0, 5.0) is None


def test_turns_that_fit_already_are_left_alone():
    """A rotary table of ±100 turns must not unwind to its end before it starts."""
    unwrapped = np.array([-3.0, 0.0, 40.0])
    np.testing.assert_array_equal(fit_turns(unwrapped, -628.3, 628.3), unwrapped)
    np.testing.assert_array_equal(fit_turns(unwrapped, -np.inf, np.inf), unwrapped)


def test_thinning_keeps_both_ends_and_both_sides_of_every_link():
    path = ring(30)
    links = np.zeros(30, dtype=bool)
    links[13:16] = True
    problem = problem_of(path.with_links(links))
    assert thin(problem, 10).tolist() == [0, 10, 12, 13, 15, 16, 20, 29]


def test_refilling_a_path_known_everywhere_never_raises_its_cost():
    problem = problem_of(ring(60))
    coordinates = choose_coordinates(problem)
    lattice = level_lattice(problem, coordinates, np.radians(5.0), 30, (np.pi, 3))
    path = shortest_path(problem, lattice)
    rows = np.arange(60)
    again = refill(problem, coordinates, rows, path, ((0.01, 0.05),))
    assert problem.cost(again) <= problem.cost(path) + 1e-9


@pytest.mark.parametrize("coordinates", [Coordinates(0, 2), Coordinates(0, None), Coordinates(1, None)])
@pytest.mark.parametrize("prices", [{}, {"time_price": 400.0, "bend_price": 30.0}])
def test_the_compiled_corridor_has_the_path_of_the_general_one(monkeypatch, coordinates, prices):
    problem = problem_of(ring(80, turns=1.6), max_turn=0.4, **prices)
    problem = replace(problem, top_speed=np.array([5.0, 8.0, 2.0, 0.5, 0.9]))
    lattice = level_lattice(problem, Coordinates(0, 2), np.radians(5.0), 30, (np.pi, 3))
    rows = thin(problem, 4)
    known = shortest_path(problem, lattice)[rows]
    # One corridor: of paths that cost the same either may be taken, and the next would start elsewhere.
    widths = ((0.01, 0.05 if coordinates.level else 0.01),)
    quick = refill(problem, coordinates, rows, known, widths)
    monkeypatch.setattr(shortest, "path_through_corridor", lambda corridor, *_: general_path(corridor))
    slow = refill(problem, coordinates, rows, known, widths)
    columns = problem.machine.rotary_columns
    assert problem.priced(quick[:, columns]) == pytest.approx(problem.priced(slow[:, columns]), rel=1e-6)
    np.testing.assert_allclose(problem.positions(slice(None), quick[:, columns]), quick, atol=1e-9)


def test_long_paths_are_searched_as_sparsely_as_they_turn():
    assert density(problem_of(ring(2_000, turns=1.0))) == 1
    assert density(problem_of(ring(12_000, turns=12_000 / 360))) == 1
    assert density(problem_of(ring(12_000, turns=12.0))) == 3
    assert density(problem_of(ring(12_000, turns=1.0))) == 4
