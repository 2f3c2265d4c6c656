"""The lower bound: below every admissible path, exact in its parts, and useful."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import DirectionalDrive, Limits, Machine
from fiveaxis.posture.bound.lower_bound import LowerBound, bound_travel
from fiveaxis.posture.bound.visiting import least_travel, spread
from fiveaxis.posture.problem import Problem
from fiveaxis.toolpath import Toolpath, parse_tool

TILT = (15.0, 60.0)
ROUNDING = 1e-6  # J


def powered(code: str) -> Machine:
    """A machine of a code whose axes cost differently, and differently in each direction."""
    machine = Machine.from_code(code)
    axes = tuple(
        replace(axis, drive=DirectionalDrive(20.0 + 7.0 * i, 35.0 - 5.0 * i))
        for i, axis in enumerate(machine.axes)
    )
    return replace(machine, axes=axes)


def limited(machine: Machine, letter: str, low: float, high: float) -> Machine:
    return replace(
        machine,
        axes=tuple(replace(a, limits=Limits(low, high)) if a.letter == letter else a for a in machine.axes),
    )


def wandering(tool: str, n: int, seed: int) -> Toolpath:
    """Random contacts, with normals to all sides but downwards."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(n, 3))
    normal[:, 2] = np.abs(normal[:, 2])
    feed = rng.uniform(200.0, 2000.0, n)
    path = Toolpath.from_contacts(
        rng.uniform(-60.0, 60.0, (n, 3)), normal, parse_tool(tool), feed_mm_min=feed
    )
    return path


def admissible_postures(problem: Problem, row: int, count: int, rng: np.random.Generator):
    """Axis values of random postures of a location that keep tilt range and limits."""
    rotary = rng.uniform(-np.pi, np.pi, (40_000, 2))
    positions, excess = problem.placed(np.full(len(rotary), row), rotary)
    kept = positions[(excess == 0.0) & (problem.limit_excess(positions) == 0.0)]
    assert len(kept) >= count, "the samples miss the admissible set"
    return kept[:count]


def cheapest(problem: Problem, layers: list[np.ndarray]) -> float:
    """Cost of the cheapest path through layers of postures; unlimited axes turn in the cheaper direction."""
    cost = np.zeros(len(layers[0]))
    for i, (here, there) in enumerate(itertools.pairwise(layers)):
        step = there[None] - here[:, None]
        paid = priced(problem, i, step)
        for column in problem.machine.rotary_columns:
            if problem.machine.axes[column].limits.unlimited:
                for turn in (-2.0 * np.pi, 2.0 * np.pi):
                    other = step.copy()
                    other[..., column] += turn
                    paid[..., column] = np.minimum(paid[..., column], priced(problem, i, other)[..., column])
        cost = (cost[:, None] + paid.sum(axis=-1)).min(axis=0)
    return float(cost.min())


def priced(problem: Problem, i: int, step: np.ndarray) -> np.ndarray:
    return problem.plus[i] * np.maximum(step, 0.0) - problem.minus[i] * np.minimum(step, 0.0)


@pytest.mark.parametrize("tool", ["ball:6", "flat:12", "bull:16:3"])
@pytest.mark.parametrize("code", ["640123", "601234", "214035"])
def test_no_admissible_path_costs_less_than_the_bound(code, tool):
    machine, rng = powered(code), np.random.default_rng(3)
    for seed in range(3):
        path = wandering(tool, 5, seed)
        tilt = tilt_bounds(path, TILT)
        bound = bound_travel(path, machine, tilt, cell=np.radians(8.0))
        problem = Problem.build(path, machine, tilt)
        layers = [admissible_postures(problem, row, 300, rng) for row in range(len(path))]
        assert bound.total <= cheapest(problem, layers) + ROUNDING
        # Each axis alone too: random paths through the samples.
        for _ in range(50):
            chosen = np.array([layer[rng.integers(len(layer))] for layer in layers])
            paid = sum(priced(problem, i, step) for i, step in enumerate(np.diff(chosen, axis=0)))
            for letter, cost in bound.linear.items():
                assert cost <= paid[machine.column(letter)] + ROUNDING
            assert bound.rotary <= paid[machine.rotary_columns].sum() + ROUNDING


def test_axis_limits_raise_the_bound_and_it_stays_below_every_path():
    path, machine = wandering("ball:6", 6, 4), powered("640123")
    tilt = tilt_bounds(path, (10.0, 40.0))
    free = bound_travel(path, machine, tilt, cell=np.radians(3.0))
    narrow = limited(machine, "A", -2.4, 0.0)
    bound = bound_travel(path, narrow, tilt, cell=np.radians(3.0))
    assert bound.total > 1.05 * free.total
    problem, rng = Problem.build(path, narrow, tilt), np.random.default_rng(0)
    layers = [admissible_postures(problem, row, 500, rng) for row in range(len(path))]
    assert bound.total <= cheapest(problem, layers) + ROUNDING


def test_a_narrow_tilt_leaves_hardly_a_gap_to_brute_force():
    """With hardly any freedom in the lean, and one branch only, the bound is nearly attained."""
    path, machine = wandering("ball:6", 4, 1), limited(powered("640123"), "A", -3.0, 0.0)
    tilt = tilt_bounds(path, (0.0, 3.0))
    bound = bound_travel(path, machine, tilt, cell=np.radians(1.0))
    problem = Problem.build(path, machine, tilt)
    rng = np.random.default_rng(5)
    layers = []
    for row in range(len(path)):
        rotary = rng.uniform((-np.pi, -3.0), (np.pi, 0.0), (200_000, 2))
        near = tool_axes(machine, rotary) @ path.normal[row] >= np.cos(np.radians(3.0))
        positions, _ = problem.placed(np.full(int(near.sum()), row), rotary[near])
        layers.append(positions[:400])
    optimum = cheapest(problem, layers)
    assert 0.8 * optimum <= bound.total <= optimum


def test_smaller_cells_give_higher_bounds():
    path, machine = wandering("ball:6", 8, 2), powered("640123")
    tilt = tilt_bounds(path, (10.0, 30.0))
    totals = [bound_travel(path, machine, tilt, cell=np.radians(c)).total for c in (8.0, 4.0, 2.0, 1.0)]
    assert totals == sorted(totals)
    assert totals[-1] > 1.2 * totals[0]


def test_links_bind_nothing_and_still_cost_something():
    path, machine = wandering("ball:6", 6, 3), powered("640123")
    whole = bound_travel(path, machine, tilt_bounds(path, (10.0, 20.0)))
    loose = tilt_bounds(path, (10.0, 20.0))
    reference = loose.reference.copy()
    reference[2:4] = np.nan
    linked = bound_travel(path, machine, replace(loose, reference=reference))
    assert 0.0 < linked.total < whole.total


def test_one_location_costs_nothing_and_a_location_without_posture_has_no_finite_bound():
    path, machine = wandering("ball:6", 1, 0), powered("640123")
    tilt, cell = tilt_bounds(path, TILT), np.radians(8.0)
    assert bound_travel(path, machine, tilt, cell=cell).total == 0.0
    far = bound_travel(path, limited(machine, "X", 5e4, 6e4), tilt, cell=cell)
    assert far.total == float("inf")


def test_the_vase_is_proven_to_a_sixth(hayashi, vase):
    bound = bound_travel(vase, hayashi, tilt_bounds(vase, (15, 75)))
    # The best known path costs 7 424 J.
    assert bound.gap(7424.0) < 1.0 / 6.0
    assert bound.total < 7423.9


def test_the_gap_is_the_share_that_the_bound_leaves_open():
    bound = LowerBound({"X": 10.0, "Y": 0.0, "Z": 20.0}, 50.0, 7)
    assert bound.total == 80.0
    assert bound.gap(100.0) == pytest.approx(0.2)
    assert bound.as_dict()["total"] == 80.0


prices = st.lists(st.floats(0.0, 9.0), min_size=3, max_size=3)
ranges = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)).map(sorted), min_size=4, max_size=4)


@settings(max_examples=60, deadline=None)
@given(ranges, prices, prices)
def test_the_least_travel_through_ranges_is_that_of_brute_force(visits, plus, minus):
    first, last = np.array(visits).T
    found = least_travel(first, last, np.array(plus), np.array(minus))
    paths = itertools.product(*(range(a, b + 1) for a, b in visits))
    paid = min(
        sum(
            p * max(b - a, 0) + m * max(a - b, 0)
            for (a, b), p, m in zip(itertools.pairwise(path), plus, minus, strict=True)
        )
        for path in paths
    )
    assert found == pytest.approx(paid, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 50.0), min_size=1, max_size=8), st.floats(0.0, 9.0), st.floats(0.0, 9.0))
def test_on_a_circle_every_index_is_reached_in_the_cheaper_direction(costs, plus, minus):
    found = np.array(costs)
    found = spread(found, plus, minus, wraps=True)
    n = len(costs)
    wanted = [
        min(costs[k] + min(plus * ((j - k) % n), minus * ((k - j) % n)) for k in range(n)) for j in range(n)
    ]
    np.testing.assert_allclose(found, wanted, atol=1e-9)
