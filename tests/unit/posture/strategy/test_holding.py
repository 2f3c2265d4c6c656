"""Held axes and planes: 3+2 and 4-axis machining as special cases, and lead and lean in the optimiser."""

import itertools

import numpy as np
import pytest
from support.ring_path import ring
from support.travel_optimiser import optimise

from fiveaxis.base.errors import Infeasible, SettingError
from fiveaxis.check import verify
from fiveaxis.model import Tool, Toolpath, tool_axes, turned
from fiveaxis.posture.strategy.rotary_bounds import free_angles, hold, is_holding


def wave(n: int = 5) -> Toolpath:
    """Few contacts over a wavy floor, along +X."""
    x = np.linspace(0.0, 8.0, n)
    slope = 0.4 * np.sin(x)
    normal = np.stack([-np.sin(slope), 0.0 * x, np.cos(slope)], axis=1)
    return Toolpath.from_contacts(np.stack([x, 0 * x, -0.4 * np.cos(x)], axis=1), normal, Tool.ball(6))


def rotary_of(solution):
    return solution.motion.positions[:, solution.machine.rotary_columns]


def cheapest_of_all(solution, choices):
    """Try every sequence of rotary angles, (c, 2) rad, that is admissible."""
    problem = solution.problem
    n = len(problem)
    positions, excess = problem.placed(np.arange(n), np.tile(choices, (n, 1, 1)))
    allowed = (excess == 0.0) & (problem.limit_excess(positions) == 0.0)
    options = [positions[i][allowed[i]] for i in range(n)]
    cost = np.zeros(len(options[0]))
    for i in range(1, n):
        step = options[i][None] - options[i - 1][:, None]
        move = np.maximum(step, 0.0) @ problem.plus[i - 1] - np.minimum(step, 0.0) @ problem.minus[i - 1]
        move[np.abs(step[..., problem.machine.rotary_columns]).max(axis=-1) > problem.max_turn[i - 1, 0]] = (
            np.inf
        )
        move[_passes_normal(solution, i, options[i - 1], options[i])] = np.inf
        cost = (cost[:, None] + move).min(axis=0)
    assert np.isfinite(cost.min()), "no sequence of the choices is admissible"
    return cost.min()


def _passes_normal(solution, row: int, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Tell between which postures the tool comes nearer to the turning normal than it may, (b, a)."""
    least, machine = solution.tilt.low - np.radians(0.5), solution.machine
    columns = machine.rotary_columns
    nearer = np.zeros((len(before), len(after)), dtype=bool)
    for share in np.linspace(0.0, 1.0, 9)[1:-1]:
        normal = turned(solution.toolpath.normal, np.array([row - 1 + share]))[0]
        rotary = (1.0 - share) * before[:, None, columns] + share * after[None, :, columns]
        nearer |= np.arccos(tool_axes(machine, rotary.reshape(-1, 2)) @ normal).reshape(nearer.shape) < least
    return nearer


def test_one_held_axis_is_never_left(hayashi):
    solution = optimise(ring(40, 0.5), hayashi, tilt=(0, 85), hold={"A": -60}, max_turn=30.0)
    np.testing.assert_allclose(
        np.degrees(solution.motion.positions[:, hayashi.column("A")]), -60.0, atol=1e-9
    )
    assert max(solution.residuals().values()) <= 1e-9
    assert verify(solution.motion, hayashi, solution.toolpath, tilt=(0, 85)).ok
    for name, energy in solution.baselines.items():
        assert solution.energy.travel <= energy.travel * (1.0 + 1e-9), name
    assert "normal" in solution.baselines


@pytest.mark.parametrize(("letter", "angle"), [("A", -20.0), ("C", 0.0), ("C", 35.0)])
def test_four_axes_are_as_good_as_brute_force(hayashi, letter, angle):
    solution = optimise(wave(), hayashi, tilt=(5, 50), hold={letter: angle}, max_turn=25.0, effort="normal")
    # Every degree of the axis that is free.
    choices = free_angles(solution.machine)[::4]
    assert solution.energy.travel <= cheapest_of_all(solution, choices) * (1.0 + 1e-3)


def test_both_axes_held_are_3_plus_2(hayashi):
    solution = optimise(wave(), hayashi, tilt=(0, 60), hold={"A": -20.0, "C": 30.0})
    np.testing.assert_allclose(np.degrees(rotary_of(solution)), [[30.0, -20.0]] * 5, atol=1e-9)
    assert solution.energy.travel == pytest.approx(solution.baselines["fixed"].travel)


def test_what_cannot_be_held_is_refused(hayashi):
    with pytest.raises(SettingError, match="'B' can't be held: the rotary axes of hayashi-640123 are C, A"):
        hold(hayashi, {"B": 0.0})
    with pytest.raises(SettingError, match="A can't be held at -130 deg, outside its limits -120"):
        hold(hayashi, {"A": np.radians(-130.0)})
    assert is_holding(hold(hayashi, {"C": np.radians(1000.0)}))
    assert not is_holding(hold(hayashi, {}))


def test_held_axes_that_reach_nothing_are_reported_with_the_tilt_that_would_do(hayashi):
    with pytest.raises(Infeasible, match="5 of 5 locations") as caught:
        optimise(wave(), hayashi, tilt=(0, 30), hold={"A": -60.0, "C": 0.0})
    assert "tilt up to 6" in caught.value.findings[0].message


def test_a_plane_is_kept_and_as_good_as_brute_force(hayashi):
    across = np.array([0.0, 1.0, 0.0])
    solution = optimise(wave(), hayashi, tilt=(5, 50), plane=tuple(across), max_turn=25.0, effort="normal")
    axis = tool_axes(hayashi, rotary_of(solution))
    assert np.degrees(np.arcsin(np.abs(axis @ across))).max() <= 0.5 + 1e-7
    assert verify(solution.motion, hayashi, solution.toolpath, tilt=(5, 50), plane=tuple(across)).ok
    # The plane of X and Z is where C is 90 or -90 deg, and A is what leans the tool.
    tilted = np.radians(np.arange(-60.0, 30.0, 1.0))
    choices = np.stack(
        np.meshgrid(np.radians([-90.0, -89.7, -90.3, 90.0]), tilted, indexing="ij"), axis=-1
    ).reshape(-1, 2)
    assert solution.energy.travel <= cheapest_of_all(solution, choices) * (1.0 + 1e-3)


def test_lead_and_lean_are_kept_and_as_good_as_brute_force(hayashi):
    bounds = {"lead": (5.0, 25.0), "lean": (-20.0, 10.0)}
    solution = optimise(wave(), hayashi, **bounds, max_turn=25.0, effort="normal")
    assert max(solution.residuals().values()) <= 1e-9
    assert verify(solution.motion, hayashi, solution.toolpath, **bounds).ok
    steps = (np.radians(np.arange(-180.0, 180.0, 3.0)), np.radians(np.arange(-60.0, 30.0, 1.5)))
    choices = np.array(list(itertools.product(*steps)))
    assert solution.energy.travel <= cheapest_of_all(solution, choices) * (1.0 + 1e-3)
    for name, energy in solution.baselines.items():
        assert solution.energy.travel <= energy.travel * (1.0 + 1e-9), name


@pytest.mark.parametrize("lead", [(9.0, 11.0), (-11.0, -9.0)])
def test_a_window_narrower_than_the_first_states_of_a_search_is_found(hayashi, lead):
    solution = optimise(ring(40, 0.5), hayashi, lead=lead, lean=(19.0, 21.0), max_turn=30.0)
    assert max(solution.residuals().values()) <= 1e-9
    assert {"normal", "lead-lean"} <= set(solution.baselines)


def test_a_baseline_that_passes_the_normal_between_locations_is_no_rival(hayashi):
    solution = optimise(wave(), hayashi, tilt=(5, 50), plane=(0.0, 1.0, 0.0), max_turn=25.0)
    fixed = solution.compared["fixed"]
    rotary = fixed.motion.positions[fixed.motion.given][:, hayashi.rotary_columns]
    assert (solution.tilt.at(solution.motion.given).admits(tool_axes(hayashi, rotary))).all()
    assert fixed.energy.travel < solution.energy.travel
    assert not fixed.admitted
