"""The search over exact postures: what it may do, what it costs, and that it finds what stands."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.quick_optimiser import tilt_bounds
from support.sampled_surfaces import SHAPES, cone, sampled, turned

import fiveaxis as fx
from fiveaxis.base import angle_between
from fiveaxis.cam import plan_contour
from fiveaxis.model import (
    BlockCosts,
    Limits,
    MoveKind,
    Toolpath,
    block_costs,
    feed_times,
    linear_positions,
    standing_speeds,
    tool_axes,
)
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search import successors
from fiveaxis.posture.search.records import MOST_COURSE_PARTS
from fiveaxis.posture.search.successor_kernel import COURSE_PART, advance
from fiveaxis.posture.search.successors import START, Resolution, path_anywhere
from fiveaxis.posture.search.successors import sampled as postures_of

DEGREE = np.pi / 180.0
ANYWHERE = Resolution(1.0, 5.0 * DEGREE, 300)
NEAR = Resolution(0.2, 0.7 * DEGREE, 24, 6.0 * DEGREE)


def cheapest_path(problem: Problem, *task: Any, **options: Any) -> np.ndarray | None:
    """Search, and take whole paths only."""
    found = successors.cheapest_path(problem, *task, **options)
    return found if len(found) == len(problem) else None


def problem_of(
    path: Toolpath, machine: fx.Machine, most: float = 20.0, tilt: tuple[float, float] = (15.0, 70.0)
) -> tuple[Problem, BlockCosts]:
    """The problem of a path, and the costs of its steps."""
    problem = Problem.build(path, machine, tilt_bounds(path, tilt), max_turn=most * DEGREE)
    return problem, block_costs(machine, path.feed[1:], time=feed_times(path)[1:])


def travelled(problem: Problem, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far axes go up and down in each step, (n − 1, k): on a long turn along its course, part by part."""
    up, down = np.zeros((2, len(path) - 1, len(problem.machine.axes)))
    largest = np.abs(np.diff(path, axis=0)).max(axis=1)
    parts = np.minimum(largest // COURSE_PART + 1, MOST_COURSE_PARTS).astype(int)
    for i, count in enumerate(parts):
        share = np.linspace(0.0, 1.0, count + 1)[:, None]
        rotary, pivot, normal = (
            (1.0 - share) * each[i] + share * each[i + 1]
            for each in (path, problem.pivot, np.nan_to_num(problem.normal))
        )
        tip = problem.zone.tip(pivot, normal, tool_axes(problem.machine, rotary))
        moves = np.diff(linear_positions(problem.machine, tip, rotary), axis=0)
        up[i], down[i] = np.maximum(moves, 0.0).sum(axis=0), np.maximum(-moves, 0.0).sum(axis=0)
    return up, down


def priced(problem: Problem, costs: BlockCosts, path: np.ndarray, start: float = START) -> float:
    """Price a path by the formula of a block, and its starts and reversals."""
    ways = np.stack(travelled(problem, path))
    travel, time = ways.sum(axis=0), problem.least_time[:, None]
    moves = ways > standing_speeds(problem.machine) * time
    standing = np.sum(costs.standing * ways, axis=0) / np.where(travel > 0.0, travel, 1.0)
    share = np.maximum(np.minimum(1.0, travel / costs.slow), travel / costs.measured)
    begun = moves[:, 1:] & ~moves[:, :-1]
    starts = (start * costs.standing / time)[:, 1:][begun]
    return float(np.sum(standing * share) + np.sum(costs.slope * ways) + starts.sum())


@settings(max_examples=12)
@given(st.sampled_from(sorted(SHAPES)), st.integers(12, 40), st.sampled_from([8.0, 20.0, 45.0]))
def test_paths_keep_every_bound_and_corridors_make_them_cheaper(name, count, most):
    machine = fx.load_machine("hayashi-640123")
    problem, costs = problem_of(sampled(SHAPES[name], count, rings=1), machine, most)
    rows = np.arange(len(problem))
    found = cheapest_path(problem, costs, ANYWHERE)
    if found is None:
        return
    assert found.shape == (len(rows), 2)
    assert problem.violation(found) <= ALLOWED
    near = cheapest_path(problem, costs, NEAR, found)
    assert problem.violation(near) <= ALLOWED
    assert priced(problem, costs, near) <= priced(problem, costs, found) * (1.0 + 2e-3)
    assert (np.abs(near - found) <= NEAR.radius * 2.0 + 1e-9).all()


def test_on_a_cone_about_the_tables_axis_only_the_table_turns(hayashi):
    problem, costs = problem_of(sampled(cone, 120, rings=1), hayashi)
    path = cheapest_path(problem, costs, NEAR, path_anywhere(problem, costs, ANYWHERE))
    moves = np.abs(np.diff(problem.positions(slice(None), path), axis=0))
    stand = moves <= standing_speeds(hayashi) * problem.least_time[:, None]
    assert stand[:, hayashi.linear_columns].mean() > 0.9


@pytest.mark.parametrize("degrees", [37.0, 200.0])
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_a_part_that_is_turned_on_its_table_has_the_same_path(hayashi, name, degrees):
    """Many states cost the same: rounding mustn't decide which of them stay."""
    path = sampled(SHAPES[name], 60, rings=1)
    (known, costs), (again, _) = (problem_of(p, hayashi) for p in (path, turned(path, degrees)))
    prices = [priced(one, costs, path_anywhere(one, costs, ANYWHERE)) for one in (known, again)]
    assert prices[1] == pytest.approx(prices[0], rel=1e-6)


def test_a_search_from_the_last_location_is_that_of_the_path_backwards(hayashi):
    problem, costs = problem_of(sampled(SHAPES["wave"], 60, rings=1), hayashi)
    found = path_anywhere(problem, costs, replace(ANYWHERE, backwards=True))
    other = path_anywhere(problem.backwards(), costs.backwards(), ANYWHERE)[::-1]
    turns = (found - other) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.broadcast_to(np.round(turns[0]), turns.shape), atol=1e-12)
    assert problem.violation(found) <= ALLOWED


def test_a_search_of_some_locations_runs_the_loops_compiled_for_all_of_them(hayashi):
    """Numba compiles them anew, for seconds, where an array lies in memory in another order."""
    problem, costs = problem_of(sampled(SHAPES["wave"], 60, rings=1), hayashi)
    rows = np.arange(0, 60, 2)
    for there, prices in (
        (problem, costs),
        (problem.thinned(rows), costs.thinned(rows)),
        (problem.between(10, 40), costs.between(10, 40)),
    ):
        for backwards in (False, True):
            path_anywhere(there, prices, replace(ANYWHERE, backwards=backwards))
    assert len(advance.signatures) == 1


@pytest.mark.parametrize("shape", ["bowl", "blade"])
def test_a_part_that_is_turned_on_the_table_begins_with_the_same_postures(hayashi, shape):
    path = sampled(SHAPES[shape], 40, rings=1)
    problem, there = (problem_of(one, hayashi)[0] for one in (path, turned(path, 37.0)))
    heights = []
    for one in (problem, there):
        postures = postures_of(one, 0)
        positions = one.positions(np.zeros(len(postures), dtype=np.int64), postures)
        heights.append(np.sort(positions[:, hayashi.column("Z")]))
    np.testing.assert_allclose(*heights, atol=1e-9)


def test_where_a_search_is_not_free_the_path_stays(hayashi):
    problem, costs = problem_of(sampled(SHAPES["wave"], 40, rings=1), hayashi)
    known = path_anywhere(problem, costs, ANYWHERE)
    free = np.ones(len(known), dtype=bool)
    free[[0, 10, 11, 12, 40]] = False
    path = cheapest_path(problem, costs, NEAR, known, free)
    np.testing.assert_array_equal(path[~free], known[~free])


@pytest.mark.parametrize("told", [False, True])
def test_a_mask_is_queried_where_it_is_in_the_way_and_the_path_passes_it_everywhere(hayashi, told):
    problem, costs = problem_of(sampled(SHAPES["wave"], 80, rings=1), hayashi)
    rows = np.arange(len(problem))
    axes = tool_axes(hayashi, cheapest_path(problem, costs, ANYWHERE))
    queries = np.zeros(len(problem), dtype=int)

    def admits(at: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        np.add.at(queries, at, 1)
        return (at < 40) | (at > 43) | (angle_between(tool_axes(hayashi, rotary), axes[at]) > 3.0 * DEGREE)

    tight = (rows >= 40) & (rows <= 43) if told else None
    ways = Mask(admits).halfway(rows).admits
    kept = cheapest_path(problem, costs, ANYWHERE, admits=ways, tight=tight)
    away, known = (rows < 30) | (rows > 53), queries.copy()
    assert admits(rows, kept).all()
    # There the path alone is queried, and halfway to its postures, once for each search.
    assert known[away].max() <= 3 * (1 if told else 2)
    assert known[40:44].min() > 50
    everywhere = cheapest_path(problem, costs, ANYWHERE, admits=ways, tight=rows >= 0)
    assert priced(problem, costs, kept) <= 1.01 * priced(problem, costs, everywhere)


@pytest.mark.parametrize("name", ["wave", "ellipse", "saddle"])
def test_in_a_link_a_path_is_led_around_what_a_mask_refuses(hayashi, name):
    path = sampled(SHAPES[name], 60, rings=1)
    rows = np.arange(len(path))
    path = replace(path, kind=np.where((rows > 20) & (rows <= 40), MoveKind.LINK, path.kind))
    problem, costs = problem_of(path, hayashi)
    known = cheapest_path(problem, costs, ANYWHERE)
    lean = np.abs(np.interp(np.arange(2 * len(rows) - 1) / 2.0, rows, known[:, 1]))

    def admits(halves: np.ndarray, rotary: np.ndarray) -> np.ndarray:
        return (halves < 56) | (halves > 66) | (np.abs(rotary[:, 1]) < lean[halves] - 6.0 * DEGREE)

    free = (rows > 15) & (rows < 46)
    wide = Resolution(0.5, 2.0 * DEGREE, 400, 60.0 * DEGREE)
    found = cheapest_path(problem, costs, wide, known, free, admits)
    halfway = (found[1:] + found[:-1]) / 2.0
    assert admits(2 * rows, found).all()
    assert admits(2 * rows[1:] - 1, halfway).all()
    assert problem.violation(found) <= ALLOWED
    np.testing.assert_allclose(found[~free], known[~free], rtol=0.0, atol=1e-12)


def test_a_path_that_breaks_a_bound_is_left(hayashi):
    problem, costs = problem_of(sampled(SHAPES["wave"], 40, rings=1), hayashi, tilt=(40.0, 46.0))
    sound = cheapest_path(problem, costs, NEAR, path_anywhere(problem, costs, ANYWHERE))
    assert problem.violation(sound) <= ALLOWED
    # The tool of the location that is nearest to a bound leans out of its range.
    lean = problem.bounds[0].angles(tool_axes(hayashi, sound))
    row = int(np.argmin(np.minimum(lean - 40.0 * DEGREE, 46.0 * DEGREE - lean)))
    aside = 3.0 * DEGREE * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    excess = problem.placed(np.full(4, row), sound[row] + aside)[1]
    off = sound.copy()
    off[row] += aside[np.argmax(excess)]
    assert problem.violation(off) > ALLOWED
    assert problem.violation(cheapest_path(problem, costs, NEAR, off)) <= ALLOWED


@pytest.mark.parametrize("resolution", [ANYWHERE, NEAR])
def test_a_search_tells_its_steps_and_finds_the_same_however_many_it_takes_at_once(
    hayashi, monkeypatch, resolution
):
    problem, costs = problem_of(sampled(SHAPES["wave"], 60, rings=1), hayashi)
    known = None if resolution is ANYWHERE else cheapest_path(problem, costs, ANYWHERE)
    found, told = [], []
    for count in (1, 10, len(problem)):
        monkeypatch.setattr("fiveaxis.posture.search.successors.AT_ONCE", count * resolution.states)
        found.append(cheapest_path(problem, costs, resolution, known, steps=lambda *step: told.append(step)))
        assert np.array_equal(found[0], found[-1])
        assert told == [(row, len(problem)) for row in range(0, len(problem), count)]
        told.clear()


def test_a_search_ends_where_its_listener_interrupts_it(hayashi, monkeypatch):
    def interrupt(done: int, _total: int) -> None:
        if done:
            raise KeyboardInterrupt

    monkeypatch.setattr("fiveaxis.posture.search.successors.AT_ONCE", 1)
    problem, costs = problem_of(sampled(SHAPES["wave"], 60, rings=1), hayashi)
    with pytest.raises(KeyboardInterrupt):
        cheapest_path(problem, costs, ANYWHERE, steps=interrupt)


def test_a_search_says_how_far_it_came(hayashi):
    path = sampled(SHAPES["wave"], 40, rings=1)
    machine = replace(
        hayashi,
        axes=tuple(a if a.is_rotary else replace(a, limits=Limits(-1.0, 1.0)) for a in hayashi.axes),
    )
    problem, costs = problem_of(path, machine)
    found = successors.cheapest_path(problem, costs, ANYWHERE)
    assert len(found) < len(problem)
    narrow, costs = problem_of(sampled(SHAPES["ellipse"], 40, rings=1), hayashi, most=1.0)
    stopped = successors.cheapest_path(narrow, costs, ANYWHERE)
    assert 1 < len(stopped) < len(narrow)
    assert narrow.between(0, len(stopped) - 1).violation(stopped) <= ALLOWED


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wave", "saddle", "blade", "flutes"])
def test_brute_force_on_four_locations_finds_nothing_cheaper_by_a_hundredth(hayashi, name):
    """Every start of a fine grid, and from each posture every pair of axes that can stand, without cells."""
    path = sampled(SHAPES[name], 60, rings=1).at(np.arange(20, 24))
    problem, costs = problem_of(path, hayashi)
    pairs = [(a, b) for a in range(5) for b in range(a + 1, 5)]
    low, high = np.maximum(hayashi.low, -np.pi)[hayashi.rotary_columns], hayashi.high[hayashi.rotary_columns]
    grid = [np.arange(a, min(b, np.pi), 3.0 * DEGREE) for a, b in zip(low, high, strict=True)]
    states = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    cost = np.zeros(len(states))
    states, cost = kept(problem, 0, states, cost, None)
    for row in range(3):
        here = problem.positions(np.full(len(states), row), states)
        reached, paid = [], []
        for a, b in pairs:
            there = held(problem, row + 1, states, here, (a, b))
            moves = problem.positions(np.full(len(there), row + 1), there) - here
            moves[:, [a, b]] = 0.0
            side = (moves < 0.0).astype(int)
            at = np.arange(5)
            standing, slope = costs.standing[side, row, at], costs.slope[side, row, at]
            size = np.abs(moves)
            share = np.maximum(np.minimum(1.0, size / costs.slow[row]), size / costs.measured[row])
            paid.append(cost + np.sum(standing * share + slope * size, axis=1))
            near = (np.abs(there - states) <= problem.max_turn[row]).all(axis=1)
            reached.append(np.where(near[:, None], there, np.nan))
        states, cost = kept(problem, row + 1, np.vstack(reached), np.concatenate(paid), 400_000)
    found = fx.optimise(path, hayashi, tilt=(15, 70), max_turn=20.0, steady=0.0)
    assert found.energy.total <= 1.01 * cost.min(), (found.energy.total, cost.min())


def held(
    problem: Problem, row: int, states: np.ndarray, here: np.ndarray, pair: tuple[int, int]
) -> np.ndarray:
    """Solve the postures of a location at which two axes keep their values, by differences; NaN for none."""

    def of(rotary: np.ndarray) -> np.ndarray:
        return problem.positions(np.full(len(rotary), row), rotary)[:, pair]

    found, ahead = states.copy(), 1e-6 * np.eye(2)
    for _ in range(8):
        off = of(found) - here[:, pair]
        (a, c), (b, d) = ((of(found + way) - of(found - way)).T / 2e-6 for way in ahead)
        area = a * d - b * c
        with np.errstate(divide="ignore", invalid="ignore"):
            back = np.stack([d * off[:, 0] - b * off[:, 1], a * off[:, 1] - c * off[:, 0]], axis=1)
            found = found - back / area[:, None]
        found = np.where(np.isfinite(found), found, states)
    left = np.abs(of(found) - here[:, pair]).max(axis=1)
    return np.where((left < 1e-7)[:, None], found, np.nan)


def kept(
    problem: Problem, row: int, states: np.ndarray, cost: np.ndarray, most: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Leave out what breaks a bound and, of more than so many, what costs most."""
    sound = np.isfinite(states).all(axis=1)
    states, cost = states[sound], cost[sound]
    positions, excess = problem.placed(np.full(len(states), row), states)
    sound = (excess <= 1e-9) & (problem.limit_excess(positions) <= 1e-9)
    states, cost = states[sound], cost[sound]
    if most is not None and len(cost) > most:
        cheap = np.argsort(cost, kind="stable")[:most]
        states, cost = states[cheap], cost[cheap]
    return states, cost


def test_where_all_postures_cost_the_same_a_link_keeps_as_many_as_there_is_room_for(hayashi):
    """Passes over the example part, joined by links in which axes turn as far as they like."""
    part = Path(__file__).parents[4] / "examples/overhang/part.stl"
    options = {"strategy": "raster", "stepover": 12.0, "spacing": 4.0}
    path = plan_contour(part, fx.Tool.ball(6), feed_mm_min=1000.0, **options)
    solution = fx.optimise(path, hayashi, tilt=(10.0, 60.0), effort="quick")
    assert solution.energy.total < solution.energies["normal"].total
