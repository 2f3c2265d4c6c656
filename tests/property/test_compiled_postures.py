"""Compiled loops give what the kinematics' equations give, on every kind of machine."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.quick_optimiser import for_tilt, tilt_bounds

from fiveaxis.model import (
    Machine,
    Tool,
    Toolpath,
    follow,
    linear_positions,
    load_machine,
    tool_axes,
    travel_costs,
)
from fiveaxis.model.kinematics.windings import ON_LIMIT, nearest_turn
from fiveaxis.model.machine.chain import Chain, Line
from fiveaxis.posture.baselines import catalogue
from fiveaxis.posture.baselines.branches import Postures, cheapest_branches
from fiveaxis.posture.local.rows import ChainModel, build_rows
from fiveaxis.posture.location_model import LocationModel
from fiveaxis.posture.problem import Problem

# Both axes under the part, one on each side, both at the tool; linear axes in three orders.
CODES = ["640123", "650213", "540321", "601235", "512036", "601324", "123064", "012354", "213064"]
# A rotary axis between linear ones.
BETWEEN = ["610243", "624013"]
BALL = Tool.ball(10).zone
TORUS = Tool.bull(10, 2).cutter.zone_for(0.2, 0.5)


def skewed(code: str, rng: np.random.Generator) -> Machine:
    """The machine of a code, its axes off the origin and out of square."""
    machine = Machine.from_code(code)
    lines = {
        j.letter: Line(
            tuple(np.array(j.line.direction) + 0.1 * rng.standard_normal(3)), tuple(rng.normal(0.0, 200.0, 3))
        )
        for j in machine.chain.joints
    }
    return replace(machine, chain=Chain.from_code(machine.code, lines))


def wavy(rng: np.random.Generator, n: int) -> Toolpath:
    """A path round a bulging wall."""
    angle = np.linspace(0.0, rng.uniform(1.0, 12.0), n)
    radius = 20.0 + 5.0 * np.sin(rng.integers(1, 5) * angle)
    contact = np.stack([radius * np.cos(angle), radius * np.sin(angle), 5.0 + angle], axis=1)
    normal = np.stack([np.cos(angle), np.sin(angle), 0.2 + 0.4 * np.sin(3.0 * angle)], axis=1)
    return Toolpath.from_contacts(contact, normal, Tool.ball(6))


def placed_about(machine: Machine, pivot: np.ndarray, rotary: np.ndarray, zone, normal=None):
    """Axis values and tool axes of a tool that leans about its pivots, by the kinematics."""
    axis = tool_axes(machine, rotary)
    tip = zone.tip(pivot, np.zeros(3) if normal is None else normal, axis)
    return linear_positions(machine, tip, rotary), axis


def model_of(machine: Machine, path: Toolpath, zone, bounds) -> LocationModel:
    return LocationModel.of(machine, zone, path.pivot, path.normal, bounds.all)


@pytest.mark.parametrize("code", CODES + BETWEEN)
@pytest.mark.parametrize("zone", [BALL, TORUS], ids=["ball", "torus"])
def test_the_model_has_the_axis_values_and_leans_of_the_kinematics(code, zone):
    rng = np.random.default_rng(0)
    machine, path = skewed(code, rng), wavy(rng, 50)
    bounds = tilt_bounds(path, (15, 75))
    # More postures than a block, some locations several times, one without bounds.
    rows, rotary = rng.integers(0, 50, 30), rng.uniform(-10.0, 10.0, (30, 4, 2))
    bounds.reference[rows[0]] = np.nan
    found, excess = model_of(machine, path, zone, bounds).placed(rows, rotary)
    pivot, normal = path.pivot[rows][:, None], path.normal[rows][:, None]
    positions, axis = placed_about(machine, pivot, rotary, zone, normal)
    np.testing.assert_allclose(found, positions, rtol=1e-8, atol=1e-8)
    cosine = np.sum(axis * bounds.reference[rows][:, None], axis=-1)
    low, high = bounds.cosines
    past = np.nan_to_num(np.maximum(np.maximum(low - cosine, cosine - high), 0.0))
    np.testing.assert_allclose(excess, past, rtol=0.0, atol=1e-13)
    assert (excess > 0.0).any()
    assert not excess[rows == rows[0]].any()


def test_a_posture_that_turns_linear_axes_into_one_plane_has_no_axis_values():
    machine, path = Machine.from_code("610243"), wavy(np.random.default_rng(0), 5)
    rotary = np.array([[0.3, 0.5], [0.3, np.pi / 2.0], [np.pi / 2.0, 0.5], [np.pi / 2.0, np.pi / 2.0]])
    model = model_of(machine, path, BALL, tilt_bounds(path, (15, 75)))
    found, _ = model.placed(np.arange(5), np.tile(rotary, (5, 1, 1)))
    expected, _ = placed_about(machine, path.pivot[:, None], rotary, BALL)
    assert np.isnan(expected).any(axis=-1).sum() == 10
    np.testing.assert_array_equal(np.isnan(found).any(axis=-1), np.isnan(expected).any(axis=-1))


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt"])
@pytest.mark.parametrize("tool", [Tool.ball(6), Tool.bull(10, 2)], ids=["ball", "bull"])
def test_the_refinements_derivatives_are_finite_differences_of_its_quantities(name, tool):
    rng = np.random.default_rng(0)
    machine, path = load_machine(name).with_drives_of(load_machine("hayashi-640123")), wavy(rng, 20)
    path = for_tilt(Toolpath.from_contacts(path.contact, path.normal, tool), (15, 75))
    problem = replace(Problem.build(path, machine, tilt_bounds(path, (15, 75))), time_price=1.0)
    rows = build_rows(replace(problem, top_speed=np.full(5, 10.0)), (True, False))
    x, weights, model = rng.uniform(0.5, 1.0, (20, 3)), rng.normal(size=(20, rows.count)), ChainModel(rows)
    quantities, slope, curvature = model.derivatives(x, weights)
    np.testing.assert_allclose(quantities, model.values(x), rtol=1e-12, atol=1e-12)
    assert not slope[0, :, :2].any()
    assert not curvature[0, :2, :2].any()
    for unknown in range(3):
        step = 1e-6 * np.eye(3)[unknown] * rows.free
        ahead, back = model.derivatives(x + step, weights), model.derivatives(x - step, weights)
        np.testing.assert_allclose(slope[:, :, unknown], (ahead[0] - back[0]) / 2e-6, rtol=1e-5, atol=1e-5)
        bent = np.einsum("nmd,nm->nd", ahead[1] - back[1], weights) / 2e-6
        lower = np.tril(np.ones((3, 3), dtype=bool))[:, unknown]
        np.testing.assert_allclose(curvature[:, lower, unknown], bent[:, lower], rtol=1e-4, atol=1e-3)


def walked(path: Toolpath, machine: Machine, bounds, anchor: np.ndarray) -> np.ndarray:
    """Take the cheapest admissible move at every location with whole arrays and the kinematics."""
    plus, minus = travel_costs(machine, path.feed, path.rapid)
    coarse, fine = catalogue.COARSE, catalogue.FINE
    low, high = machine.low - ON_LIMIT, machine.high + ON_LIMIT
    rotary, here = anchor.copy(), follow(path, machine, anchor).positions[0]
    for i in range(1, len(path)):
        for offsets in (coarse, fine):
            around = here[machine.rotary_columns] if offsets is coarse else rotary[i]
            tried = np.concatenate([around + offsets, anchor[i : i + 1]])
            positions, axis = placed_about(machine, path.pivot[i], tried, path.zone, path.normal[i])
            move = positions - here
            cost = np.maximum(move, 0.0) @ plus[i] - np.minimum(move, 0.0) @ minus[i]
            cosine = axis @ bounds.reference[i]
            inside = (cosine >= bounds.cosines[0]) & (cosine <= bounds.cosines[1])
            cost[~(inside & ((positions >= low) & (positions <= high)).all(axis=1))] = np.inf
            # The anchor is admissible by construction, if only to rounding.
            best = int(np.argmin(cost)) if np.isfinite(cost).any() else len(tried) - 1
            rotary[i], chosen = tried[best], positions[best]
        here = chosen
    return rotary


@pytest.mark.parametrize(("name", "seed"), [("hayashi-640123", 0), ("linuxcnc-xyzac-trt", 1)])
def test_the_compiled_walk_is_that_of_whole_arrays(name, seed):
    machine, path = load_machine(name), wavy(np.random.default_rng(seed), 60)
    machine = machine.with_drives_of(load_machine("hayashi-640123"))
    bounds = tilt_bounds(path, (10, 70))
    anchor = catalogue.along_normal(path, machine, bounds)
    expected = walked(path, machine, bounds, anchor)
    np.testing.assert_allclose(catalogue.greedy(path, machine, bounds), expected, rtol=0.0, atol=1e-9)


def branches_in_numpy(machine: Machine, path: Toolpath, found: Postures, low, high) -> np.ndarray:
    """Choose the branches with whole arrays for every location, keeping each branch's cheapest path."""
    plus, minus = travel_costs(machine, path.feed)
    columns = machine.rotary_columns
    cost = np.where(found.allowed[:, 0], 0.0, np.inf)
    paths = [[found.positions[b, 0]] for b in range(2)]
    for i in range(1, len(path)):
        totals, ways = np.full((2, 2), np.inf), {}
        for before in np.flatnonzero(np.isfinite(cost)):
            for after in np.flatnonzero(found.allowed[:, i]):
                there = found.positions[after, i].copy()
                here = paths[before][-1]
                there[columns] = nearest_turn(there[columns], here[columns], low, high)
                move = there - here
                step = plus[i] @ np.maximum(move, 0.0) - minus[i] @ np.minimum(move, 0.0)
                totals[before, after], ways[before, after] = cost[before] + step, there
        best = np.argmin(totals, axis=0)
        cost = totals[best, [0, 1]]
        paths = [[*paths[d], ways.get((d, b), paths[b][-1])] for b, d in enumerate(best.tolist())]
    return np.array(paths[int(np.argmin(cost))])[:, columns]


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_the_compiled_choice_of_branches_is_that_of_whole_arrays(seed, limited):
    rng = np.random.default_rng(seed)
    machine, path = load_machine("hayashi-640123"), wavy(rng, 12)
    allowed = rng.random((2, 12)) < 0.7
    allowed[0] |= ~allowed.any(axis=0)
    positions = rng.uniform(-3.0, 3.0, (2, 12, 5))
    positions[~allowed] = np.nan
    found = Postures(positions, allowed)
    end = np.full(2, 4.0 if limited else np.inf)
    plus, minus = travel_costs(machine, path.feed, path.rapid)
    columns = np.array(machine.rotary_columns)
    quick = cheapest_branches(positions, allowed, columns, -end, end, ON_LIMIT, plus, minus)
    np.testing.assert_allclose(quick, branches_in_numpy(machine, path, found, -end, end), atol=1e-12)
