"""Compiled loops give what the kinematics' equations give, on every kind of machine."""

from dataclasses import replace

import numpy as np
import pytest
from by_degrees import for_tilt, tilt_bounds
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.energy import travel_costs
from fiveaxis.kinematics import positions_about
from fiveaxis.kinematics.windings import ON_LIMIT, nearest_turn
from fiveaxis.machine import Chain, Line, Machine, load_machine
from fiveaxis.posture.baselines import catalogue
from fiveaxis.posture.baselines.branches import Postures
from fiveaxis.posture.baselines.kernel import cheapest_branches
from fiveaxis.posture.local.quantities import chain_model
from fiveaxis.posture.local.rows import build_rows
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.trigonometric import (
    is_trigonometric,
    linear_values,
    terms,
    trigonometric_coefficients,
)
from fiveaxis.toolpath import Tool, Toolpath

# Both axes under the part, one on each side, both at the tool; linear axes in three orders.
CODES = ["640123", "650213", "540321", "601235", "512036", "601324", "123064", "012354", "213064"]
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


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("zone", [BALL, TORUS], ids=["ball", "torus"])
@pytest.mark.parametrize("seed", range(3))
def test_waves_are_the_kinematics_of_any_chain_whose_linear_axes_adjoin(code, zone, seed):
    rng = np.random.default_rng(seed)
    machine = skewed(code, rng)
    assert is_trigonometric(machine)
    path = wavy(rng, 50)
    rotary = rng.uniform(-10.0, 10.0, (50, 2))
    known = trigonometric_coefficients(
        machine, path.pivot, path.normal, zone, tilt_bounds(path, (15, 75)).all
    )
    positions, axis = positions_about(machine, path.pivot, rotary, zone, path.normal)
    found = np.empty((50, 3))
    for i, (c, s) in enumerate(zip(np.cos(rotary), np.sin(rotary), strict=True)):
        place = known.linear[i], known.beside[i], known.along, known.offset
        linear_values(*place, c[0], s[0], c[1], s[1], found[i])
    np.testing.assert_allclose(found, positions[:, machine.linear_columns], rtol=1e-9, atol=1e-10)
    cosine = np.einsum("nbt,nt->nb", known.cosines, terms(rotary))[:, 0]
    np.testing.assert_allclose(cosine, np.sum(axis * path.normal, axis=1), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt"])
@pytest.mark.parametrize("tool", [Tool.ball(6), Tool.bull(10, 2)], ids=["ball", "bull"])
def test_waves_have_the_derivatives_of_the_chains_tape(name, tool):
    rng = np.random.default_rng(0)
    machine, path = load_machine(name).with_drives_of(load_machine("hayashi-640123")), wavy(rng, 20)
    path = for_tilt(Toolpath.from_contacts(path.contact, path.normal, tool), (15, 75))
    problem = replace(Problem.build(path, machine, tilt_bounds(path, (15, 75))), time_price=1.0)
    problem = replace(problem, top_speed=np.full(5, 10.0))
    rows = build_rows(problem, (True, False))
    x, weights = rng.uniform(0.5, 1.0, (20, 3)), rng.normal(size=(20, rows.count))
    quick, taped = chain_model(rows), chain_model(replace(rows, trigonometric=None))
    np.testing.assert_allclose(quick.values(x), taped.values(x), atol=1e-9)
    for of_quick, of_tape in zip(quick.derivatives(x, weights), taped.derivatives(x, weights), strict=True):
        np.testing.assert_allclose(of_quick, of_tape, rtol=1e-8, atol=1e-8)


def test_a_rotary_axis_between_linear_ones_has_no_waves():
    assert not is_trigonometric(Machine.from_code("610243"))


@pytest.mark.parametrize("name", ["hayashi-640123", "linuxcnc-xyzac-trt"])
@pytest.mark.parametrize("seed", range(3))
def test_the_compiled_walk_is_that_of_any_chain(monkeypatch, name, seed):
    machine, path = load_machine(name), wavy(np.random.default_rng(seed), 60)
    machine = machine.with_drives_of(load_machine("hayashi-640123"))
    bounds = tilt_bounds(path, (10, 70))
    quick = catalogue.greedy(path, machine, bounds)
    monkeypatch.setattr(catalogue, "is_trigonometric", lambda _: False)
    np.testing.assert_allclose(quick, catalogue.greedy(path, machine, bounds), rtol=0.0, atol=1e-9)


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


@settings(max_examples=40, deadline=None)
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
