import math
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model import Axis, Limits, Machine, TiltBounds, linear_positions, tool_axes, travel_costs
from fiveaxis.posture import Optimum
from fiveaxis.show import location_surface
from fiveaxis.show.report.landscape import MOST_LOCATIONS, modulo_turn, posture_map, shown_range


@pytest.fixture(params=["solution", "trunnion_solution"])
def any_solution(request: pytest.FixtureRequest) -> Optimum:
    """An ideal machine without offsets, and one with."""
    return request.getfixturevalue(request.param)


def cost_from_zero(solution: Optimum, location: int, first: float, second: float) -> float:
    """Compute S_W for one posture from the tool's tip, step by step."""
    machine, toolpath = solution.machine, solution.toolpath
    rotary = np.array([[first, second]])
    tip = toolpath.pivot[[location]] - toolpath.tool.radius * tool_axes(machine, rotary)
    values = linear_positions(machine, tip, rotary)[0]
    plus, minus = (side[location] for side in travel_costs(machine, toolpath.feed))
    return float(plus @ np.maximum(values, 0.0) + minus @ np.maximum(-values, 0.0))


def test_the_surface_holds_the_contact_not_the_tip(any_solution: Optimum) -> None:
    surface = location_surface(any_solution, 180)
    for i, j in ((0, 0), (17, 40), (120, 71)):
        expected = cost_from_zero(any_solution, 180, surface.power.first[i], surface.power.second[j])
        assert surface.power.total[i, j] == pytest.approx(expected, rel=1e-12)


def test_the_admissible_region_keeps_the_tilt(solution: Optimum) -> None:
    surface = location_surface(solution, 180)
    angles = np.stack(np.meshgrid(surface.power.first, surface.power.second, indexing="ij"), axis=-1)
    cosine = tool_axes(solution.machine, angles) @ solution.toolpath.normal[180]
    tilt = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    np.testing.assert_array_equal(surface.admissible, (tilt >= 15.0) & (tilt <= 75.0))
    assert 0.05 < surface.admissible.mean() < 0.5


def test_the_admissible_region_keeps_the_limits_of_the_linear_axes(solution: Optimum) -> None:
    narrow = replace(solution.machine.axis("Z"), limits=Limits(-5.0, 30.0))
    axes = tuple(narrow if a.letter == "Z" else a for a in solution.machine.axes)
    narrowed = replace(solution, machine=replace(solution.machine, axes=axes))
    free, bound = location_surface(solution, 180), location_surface(narrowed, 180)
    assert bound.admissible.sum() < free.admissible.sum()
    assert not np.any(bound.admissible & ~free.admissible)


def test_a_range_of_the_lean_that_is_narrower_than_the_grid_has_an_empty_map(solution: Optimum) -> None:
    narrow = TiltBounds(solution.tilt.reference, 0.0, 1e-6, "normal")
    shown = posture_map(replace(solution, tilt=narrow))
    assert np.isnan(shown.cost).all()
    assert not shown.colliding.any()


def test_a_link_allows_every_tilt(solution: Optimum) -> None:
    reference = np.full_like(solution.tilt.reference, np.nan)
    free = replace(solution, tilt=TiltBounds(reference, 0.0, 1.0, "normal"))
    assert location_surface(free, 180).admissible.all()


def test_the_map_shows_the_least_cost_over_the_admissible_second_angles(solution: Optimum) -> None:
    landscape = posture_map(solution)
    row = len(landscape.locations) // 2
    location = int(landscape.locations[row])
    seconds = np.radians(np.arange(-120.0, 30.1, 2.0))
    for column in range(0, len(landscape.first), 7):
        first = landscape.first[column]
        costs = [
            cost_from_zero(solution, location, first, second)
            for second in seconds
            if _tilt_holds(solution, location, first, second)
        ]
        expected = min(costs, default=math.nan)
        assert landscape.cost[row, column] == pytest.approx(expected, rel=1e-9, nan_ok=True)


def _tilt_holds(solution: Optimum, location: int, first: float, second: float) -> bool:
    cosine = tool_axes(solution.machine, np.array([first, second])) @ solution.toolpath.normal[location]
    return math.cos(solution.tilt.high) <= cosine <= math.cos(solution.tilt.low)


def test_a_long_path_is_sampled_with_both_ends(solution: Optimum) -> None:
    locations = posture_map(solution).locations
    assert len(locations) == MOST_LOCATIONS
    assert locations[0] == 0
    assert locations[-1] == len(solution.toolpath) - 1


def test_the_chosen_curve_runs_through_admissible_postures(solution: Optimum, hayashi: Machine) -> None:
    landscape = posture_map(solution)
    before = solution.compared["normal"].motion.positions[landscape.locations, hayashi.column("C")]
    chosen = modulo_turn(before, hayashi.axis("C"))
    columns = np.abs(landscape.first[None] - chosen[:, None]).argmin(axis=1)
    assert np.isfinite(landscape.cost[np.arange(len(columns)), columns]).all()


def test_an_axis_that_turns_without_end_is_shown_over_one_turn() -> None:
    endless = Axis("C")
    assert shown_range(endless) == (-math.pi, math.pi)
    turned = modulo_turn(np.radians([10.0, 370.0, -350.0, 1990.0]), endless)
    np.testing.assert_allclose(np.degrees(turned), [10.0, 10.0, 10.0, -170.0])


def test_an_axis_with_narrow_limits_is_shown_between_them() -> None:
    trunnion = Axis("A", Limits(math.radians(-120.0), math.radians(30.0)))
    assert np.degrees(shown_range(trunnion)) == pytest.approx((-120.0, 30.0))
    inside = np.radians([-120.0, -45.0, 30.0])
    np.testing.assert_allclose(modulo_turn(inside, trunnion), inside)
    np.testing.assert_allclose(modulo_turn(inside + 2.0 * math.pi, trunnion), inside)


def test_a_posture_past_a_narrow_limit_stays_past_it() -> None:
    trunnion = Axis("A", Limits(math.radians(-50.0), math.radians(100.0)))
    np.testing.assert_allclose(modulo_turn(np.radians([-98.0]), trunnion), np.radians([-98.0]))


def test_postures_that_collide_are_left_out_of_the_map_and_marked(solution: Optimum) -> None:
    machine = solution.machine

    def admits(rows: IntArray, rotary: Array) -> BoolArray:
        assert rows.shape == (len(rotary),)
        return np.asarray(tool_axes(machine, rotary)[:, 0] > 0.0)

    whole, rest = posture_map(solution), posture_map(solution, admits)
    assert not whole.colliding.any()
    assert (rest.colliding == np.isfinite(whole.cost) & np.isnan(rest.cost)).all()
    assert 0.1 < rest.colliding.mean() < 0.9
    both = np.isfinite(rest.cost)
    assert (rest.cost[both] >= whole.cost[both]).all()
