"""The lower bound: below every admissible path, exact on its lattice, and useful."""

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from support.pairwise_cases import in_pairs
from support.quick_optimiser import tilt_bounds

import fiveaxis as fx
from fiveaxis.base.errors import MachineError
from fiveaxis.model import (
    Constraints,
    DirectionalDrive,
    FrictionDrive,
    Limits,
    Machine,
    Toolpath,
    parse_tool,
    tool_axes,
)
from fiveaxis.posture.bound.lower_bound import LowerBound, bound_energy, bound_travel
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.rotary_bounds import turn_bounds

TILT = (15.0, 60.0)
ROUNDING = 1e-6  # J
WORK = 2e7


def powered(code: str) -> Machine:
    """A machine of a code whose axes cost differently, and differently in each direction."""
    machine = Machine.from_code(code)
    axes = tuple(
        replace(axis, drive=DirectionalDrive(20.0 + 7.0 * i, 35.0 - 5.0 * i))
        for i, axis in enumerate(machine.axes)
    )
    return replace(machine, axes=axes)


def with_drives(machine: Machine) -> Machine:
    """A machine with a power for every axis that has none."""
    axes = tuple(replace(a, drive=a.drive or DirectionalDrive(30.0, 25.0)) for a in machine.axes)
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


@in_pairs(code=["640123", "601234", "214035"], tool=["ball:6", "flat:12", "bull:16:3"], seed=range(3))
@pytest.mark.slow
def test_no_admissible_path_costs_less_than_the_bound(code, tool, seed):
    machine, rng = powered(code), np.random.default_rng(3)
    path = wandering(tool, 5, seed)
    tilt = tilt_bounds(path, TILT)
    bound = bound_travel(path, machine, tilt, work=WORK)
    problem = Problem.build(path, machine, tilt)
    layers = [admissible_postures(problem, row, 300, rng) for row in range(len(path))]
    assert 0.0 < bound.total <= cheapest(problem, layers) + ROUNDING


@pytest.mark.parametrize("name", ["dmu50ev", "micro5", "linuxcnc-bridgemill", "linuxcnc-xyzbc-trt"])
def test_the_bound_holds_on_machines_of_the_library(name):
    machine = with_drives(fx.load_machine(name))
    linear = [machine.letters[column] for column in machine.linear_columns]
    for letter in linear:
        machine = limited(machine, letter, -1e4, 1e4)
    path, rng = wandering("ball:6", 4, 7), np.random.default_rng(1)
    # In a wider range the bound of one of them is 0.
    tilt = tilt_bounds(path, (15.0, 30.0))
    problem = Problem.build(path, machine, tilt)
    layers = [admissible_postures(problem, row, 200, rng) for row in range(len(path))]
    bound = bound_travel(path, machine, tilt, work=WORK)
    assert 0.0 < bound.total <= cheapest(problem, layers) + ROUNDING


def test_axis_limits_raise_the_bound_and_it_stays_below_every_path():
    path, machine = wandering("ball:6", 6, 4), powered("640123")
    tilt = tilt_bounds(path, (10.0, 40.0))
    narrow = limited(machine, "A", -2.4, 0.0)
    bound = bound_travel(path, narrow, tilt, work=5.0 * WORK)
    assert bound.total > 1.05 * bound_travel(path, machine, tilt, work=5.0 * WORK).total
    problem, rng = Problem.build(path, narrow, tilt), np.random.default_rng(0)
    layers = [admissible_postures(problem, row, 500, rng) for row in range(len(path))]
    assert bound.total <= cheapest(problem, layers) + ROUNDING


@pytest.mark.slow
def test_bounded_turns_raise_the_bound_and_it_stays_below_what_is_found_within_them(hayashi, dome):
    """Half a turn of C while A swings through is cheap, but far from one location to the next."""
    tilt, turns = tilt_bounds(dome, (10, 70)), turn_bounds(dome, Constraints.of_degrees(tilt=(10, 70)))
    free = bound_travel(dome, hayashi, tilt, work=3e8)
    bound = bound_travel(dome, hayashi, tilt, turns, work=1e9)
    # Found by `python tests/benchmarks/bench.py dome dome-free`, with the usual largest turns and without.
    assert free.total < 21_609.0 < bound.total < 32_172.0


@pytest.mark.slow
def test_a_narrow_tilt_leaves_hardly_a_gap_to_brute_force():
    """With hardly any freedom in the lean, and one branch only, the bound is nearly attained."""
    path, machine = wandering("ball:6", 4, 1), limited(powered("640123"), "A", -3.0, 0.0)
    tilt = tilt_bounds(path, (0.0, 3.0))
    bound = bound_travel(path, machine, tilt, work=1e9)
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


def test_more_work_gives_a_higher_bound():
    path, machine = wandering("ball:6", 8, 2), powered("640123")
    tilt = tilt_bounds(path, (10.0, 30.0))
    totals = [bound_travel(path, machine, tilt, work=work).total for work in (3e6, 3e7, 3e8)]
    assert totals == sorted(totals)
    assert totals[-1] > 1.1 * totals[0]


def test_a_path_smaller_than_the_first_boxes_has_a_bound():
    contacts = np.column_stack([np.linspace(0.0, 6.0, 5), np.zeros((5, 2))])
    normals = np.tile([0.3, 0.1, 0.948], (5, 1))
    path = Toolpath.from_contacts(contacts, normals, parse_tool("ball:6"), feed_mm_min=500)
    machine, tilt = powered("640123"), tilt_bounds(path, (10.0, 30.0))
    assert bound_travel(path, machine, tilt, work=1e6).total == 0.0
    assert bound_travel(path, machine, tilt, work=3e8).total > 5.0


def test_links_bind_nothing_and_still_cost_something():
    path, machine = wandering("ball:6", 6, 3), powered("640123")
    whole = bound_travel(path, machine, tilt_bounds(path, (10.0, 20.0)), work=WORK)
    loose = tilt_bounds(path, (10.0, 20.0))
    reference = loose.reference.copy()
    reference[2:4] = np.nan
    linked = bound_travel(path, machine, replace(loose, reference=reference), work=WORK)
    assert 0.0 < linked.total < whole.total
    assert linked.visits == 4


def test_one_location_costs_nothing_and_a_location_without_posture_has_no_finite_bound():
    path, machine = wandering("ball:6", 1, 0), powered("640123")
    tilt = tilt_bounds(path, TILT)
    assert bound_travel(path, machine, tilt, work=WORK).total == 0.0
    far = bound_travel(path, limited(machine, "X", 5e4, 6e4), tilt, work=WORK)
    assert far.total == float("inf")


@pytest.mark.slow
@pytest.mark.parametrize(("work", "gap"), [(1e9, 0.10), pytest.param(8e9, 0.08, marks=pytest.mark.release)])
def test_the_vase_is_proven_to_a_few_percent(hayashi, vase, work, gap):
    bound = bound_travel(vase, hayashi, tilt_bounds(vase, (15, 75)), work=work)
    # The best known path costs 7 424 J.
    assert bound.gap(7424.0) < gap
    assert bound.total < 7423.9


def test_the_gap_is_the_share_that_the_bound_leaves_open():
    bound = LowerBound(80.0, "travel", 7)
    assert bound.gap(100.0) == pytest.approx(0.2)
    assert "at most 20.0%" in bound.in_words(100.0)
    assert "nothing is known" in LowerBound(0.0, "energy", 7).in_words(100.0)


def lifted(counterbalance: float, regeneration: float) -> Machine:
    """A machine whose Z lifts 300 kg, other axes with friction alone."""
    machine = Machine.from_code("640123")
    axes = []
    for axis in machine.axes:
        if axis.is_rotary:
            axes.append(replace(axis, drive=FrictionDrive(5.0, hold=3.0), max_speed=1.0))
            continue
        own = FrictionDrive(0.1, moving=20.0, efficiency=0.8)
        if axis.letter == "Z":
            own = replace(own, counterbalance=counterbalance, regeneration=regeneration)
        axes.append(replace(axis, drive=own, moved_mass=300.0, max_speed=200.0))
    return replace(machine, axes=tuple(axes))


@pytest.mark.parametrize(("counterbalance", "regeneration"), [(0.0, 0.7), (2.0, 0.0)])
def test_no_program_takes_less_energy_than_the_bound(counterbalance, regeneration):
    machine = lifted(counterbalance, regeneration)
    path = wandering("ball:6", 6, 5)
    found = fx.optimise(path, machine, tilt=(10, 40), effort="quick")
    bound = bound_energy(found.toolpath, found.machine, found.tilt, work=WORK)
    assert 0.0 < bound.total <= found.energy.total


def test_a_drive_that_returns_power_keeps_the_bound_of_the_travel_metric_below_every_path():
    machine, path = lifted(0.0, 0.7), wandering("ball:6", 5, 3)
    tilt = tilt_bounds(path, TILT)
    problem, rng = Problem.build(path, machine, tilt), np.random.default_rng(2)
    assert problem.minus.min() < 0.0
    layers = [admissible_postures(problem, row, 300, rng) for row in range(len(path))]
    assert bound_travel(path, machine, tilt, work=WORK).total <= cheapest(problem, layers) + ROUNDING


def test_a_constant_power_bounds_nothing_where_speeds_are_unknown():
    path = wandering("ball:6", 6, 5)
    assert bound_energy(path, powered("640123"), tilt_bounds(path, TILT), work=WORK).total == 0.0


def test_a_load_that_depends_on_the_posture_allows_no_bound_if_the_drive_returns_power():
    machine = lifted(0.0, 0.7)
    axes = [
        replace(a, moved_mass=80.0, mass_centre=(0.0, 0.0, -50.0)) if a.letter == "A" else a
        for a in machine.axes
    ]
    axes = [replace(a, drive=replace(a.drive, regeneration=0.5)) if a.letter == "A" else a for a in axes]
    machine = replace(machine, axes=tuple(axes))
    path = wandering("ball:6", 3, 5)
    with pytest.raises(MachineError, match="A of machine"):
        bound_energy(path, machine, tilt_bounds(path, TILT))
    found = fx.optimise(path, machine, tilt=TILT, effort="quick", bound=True)
    assert found.bound is None
    assert [f.code for f in found.toolpath.findings].count("no-bound") == 1


def test_a_bound_is_computed_where_it_is_asked_for(monkeypatch):
    monkeypatch.setattr("fiveaxis.posture.bound.lower_bound.bound_travel", partial(bound_travel, work=WORK))
    path, machine = wandering("ball:6", 3, 5), powered("640123")
    without = fx.optimise(path, machine, tilt=TILT, effort="quick", objective="travel")
    assert without.bound is None
    assert without.gap is None
    found = fx.optimise(path, machine, tilt=TILT, effort="quick", objective="travel", bound=True)
    assert found.bound.of == "travel"
    assert found.gap == pytest.approx(1.0 - found.bound.total / found.energy.travel)
    assert found.gap >= 0.0
