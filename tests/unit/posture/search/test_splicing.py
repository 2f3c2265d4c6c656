"""Paths of parts of several paths, against all that there are."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.quick_optimiser import tilt_bounds
from support.sampled_surfaces import SHAPES, sampled

import fiveaxis as fx
from fiveaxis.model import BlockCosts, block_costs, feed_times
from fiveaxis.posture.problem import CUT_TURN_PRICE, VIOLATION_PRICE, Problem
from fiveaxis.posture.search.splicing import spliced

TURN = 2.0 * np.pi


def problem_of(name: str, rows: slice, most: float = 20.0) -> tuple[Problem, BlockCosts]:
    """Some locations of a shape on a machine whose C, the first angle, has no limits."""
    path, machine = sampled(SHAPES[name], 60).at(np.arange(60)[rows]), fx.load_machine("hayashi-640123")
    problem = Problem.build(path, machine, tilt_bounds(path, (15.0, 70.0)), max_turn=np.radians(most))
    return problem, block_costs(machine, path.feed[1:], time=feed_times(path)[1:])


def price(problem: Problem, costs: BlockCosts, path: np.ndarray) -> float:
    """What a path's blocks cost by the formula of `BlockCosts`, and what it breaks."""
    positions, excess = problem.placed(slice(None), path)
    moves, total = np.diff(positions, axis=0), 0.0
    for (i, axis), move in np.ndenumerate(moves):
        way, slow = int(move < 0.0), costs.slow[i, axis]
        share = max(min(1.0, abs(move) / slow), abs(move) / costs.measured[i, axis])
        total += costs.slope[way, i, axis] * abs(move) + costs.standing[way, i, axis] * share
    turns = np.maximum(np.abs(np.diff(path, axis=0)) - problem.max_turn, 0.0).sum()
    return float(
        total
        + CUT_TURN_PRICE * turns
        + VIOLATION_PRICE * (excess.sum() + problem.limit_excess(positions).sum())
    )


@pytest.mark.parametrize("name", sorted(SHAPES))
@pytest.mark.parametrize("most", [3.0, 20.0])
def test_no_choice_of_postures_is_cheaper(name, most):
    problem, costs = problem_of(name, slice(20, 26), most)
    rng = np.random.default_rng(len(name))
    middle = np.array([0.3, -0.8]) + np.cumsum(rng.normal(0.0, 0.02, (6, 2)), axis=0)
    paths = [middle + np.cumsum(rng.normal(0.0, 0.02, (6, 2)), axis=0) for _ in range(3)]
    chosen = (np.array(paths)[list(of), np.arange(6)] for of in product(range(3), repeat=6))
    least = min(price(problem, costs, one) for one in chosen)
    # The same postures, whole turns of C away.
    paths[1] = paths[1] - [2.0 * TURN, 0.0]
    found = spliced(problem, costs, paths)
    assert price(problem, costs, found) == pytest.approx(least, rel=1e-9)
    assert np.abs(np.diff(found[:, 0])).max() < np.pi


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(sorted(SHAPES)), count=st.integers(1, 5))
def test_it_costs_no_more_than_any_path_and_takes_their_postures(seed, name, count):
    problem, costs = problem_of(name, slice(0, 60))
    rng = np.random.default_rng(seed)
    ways = np.cumsum(rng.normal(0.0, 0.05, (count, 60, 2)), axis=1)
    paths = list(np.array([0.0, -0.7]) + ways)
    found = spliced(problem, costs, paths)
    least = min(price(problem, costs, path) for path in paths)
    assert price(problem, costs, found) <= least * (1.0 + 1e-9)
    away = np.abs(found - np.array(paths))
    assert np.minimum(away, np.abs(away - TURN)).max(axis=2).min(axis=0).max() < 1e-9
    if count == 1:
        np.testing.assert_allclose(found, paths[0], atol=1e-9)


def test_a_posture_without_axis_values_is_avoided():
    problem, costs = problem_of("dome", slice(0, 8))
    sound = np.tile([0.2, -0.7], (8, 1))
    broken = sound.copy()
    broken[3] = np.nan
    np.testing.assert_array_equal(spliced(problem, costs, [broken, sound])[3], sound[3])


def test_no_step_from_one_path_to_another_turns_far():
    """From end to end a long turn looks cheap; along its course linear axes travel farther."""
    problem, costs = problem_of("dome", slice(0, 8), most=180.0)
    one = np.tile([0.2, -0.7], (8, 1))
    other = one + np.array([1.0, 0.0])
    # Each leans out of bounds where the other one doesn't.
    one[5:, 1], other[:3, 1] = 1.0, 1.0
    turns = np.abs(np.diff(spliced(problem, costs, [one, other])[:, 0]))
    assert turns.max() < np.radians(20.0)
