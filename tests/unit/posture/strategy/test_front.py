"""The front between energy and steadiness: its ends, its order, and that no point dominates another."""

from dataclasses import replace

import numpy as np
import pytest
from support.ring_path import ring
from support.travel_optimiser import find_front, optimise

from fiveaxis import posture
from fiveaxis.base.errors import SettingError
from fiveaxis.model import Constraints, Limits, Tool, Toolpath, refined, within_limits
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy.front import FrontPoint, undominated


@pytest.fixture(scope="module")
def found(hayashi):
    return find_front(ring(60), hayashi, 5, tilt=(15, 75))


def test_the_ends_are_the_optimum_and_the_smoothest(found):
    assert found.points[0].smoothing == 0.0
    assert found.points[0].energy.as_dict() == found.solution.energy.as_dict()
    assert found.points[-1].smoothing == pytest.approx(max(p.smoothing for p in found.points))
    assert found.points[-1].bend < 0.9 * found.points[0].bend
    assert len(found.points) + found.dominated == 5


def test_a_cheaper_path_found_at_another_price_is_the_solution(found, hayashi, monkeypatch):
    """The first optimum is made worse, so that a search with a price of bends finds a better one."""

    def optimise_badly(path, machine, constraints, options):
        price = options.smoothing or 3000.0
        poor = posture.optimise_postures(path, machine, constraints, replace(options, smoothing=price))
        return replace(poor, problem=replace(poor.problem, bend_price=np.zeros(len(poor.problem) - 1)))

    monkeypatch.setattr("fiveaxis.posture.strategy.front.optimise_postures", optimise_badly)
    bounds = Constraints.of_degrees(tilt=(15, 75), max_turn=15.0)
    poor = optimise_badly(ring(60), hayashi, bounds, posture.Options(objective="travel", effort="quick"))
    front = find_front(ring(60), hayashi, 3, tilt=(15, 75))
    first = front.points[0]
    assert first.cost == min(p.cost for p in front.points)
    assert front.solution.energy.travel < poor.energy.travel * (1 - 1e-3)
    assert np.array_equal(front.solution.motion.positions, first.motion.positions)


def given(solution, motion):
    """Rotary angles at the given locations, (n, 2) rad."""
    return motion.positions[~solution.toolpath.inserted][:, solution.machine.rotary_columns]


@pytest.mark.slow
def test_a_path_that_the_mask_refuses_is_no_point_of_the_front(hayashi):
    """A mask that admits tilts that differ by less than eight degrees from what `optimise` found."""
    alone = optimise(ring(60), hayashi, tilt=(15, 75))
    kept = given(alone, alone.motion)

    def mask(rows, rotary):
        return np.abs(rotary[:, 1] - kept[rows, 1]) < np.radians(8.0)

    front = find_front(ring(60), hayashi, 4, tilt=(15, 75), mask=mask)
    for solution in front.solutions:
        assert mask(np.arange(60), given(solution, solution.motion)).all()


def test_a_point_that_costs_more_is_steadier(found):
    energy = [point.energy.travel for point in found.points]
    bend = [point.bend for point in found.points]
    assert energy == sorted(energy)
    assert bend == sorted(bend, reverse=True)
    assert len(found.points) >= 3


def test_every_point_keeps_the_bounds(found):
    for solution in found.solutions:
        assert max(solution.residuals().values()) <= 1e-9
        turns = np.degrees(np.abs(solution.motion.moves[:, solution.machine.rotary_columns]))
        assert turns.max() <= 15.0 + 1e-6


def bends(solution) -> float:
    """Σ‖Δρ‖² between the given locations, rad²."""
    return float((np.diff(given(solution, solution.motion), axis=0) ** 2).sum())


@pytest.mark.parametrize("end", [0, -1])
@pytest.mark.parametrize("locations", [pytest.param(40, marks=pytest.mark.slow), 60])
def test_the_ends_are_no_worse_than_a_search_at_their_own_price(found, hayashi, end, locations):
    path = ring(locations)
    front = found if locations == 60 else find_front(path, hayashi, 5, tilt=(15, 75))
    point, solution = front.points[end], front.solutions[end]
    alone = optimise(path, hayashi, tilt=(15, 75), smoothing=point.smoothing)
    assert point.bend == pytest.approx(bends(solution))
    searched = alone.energy.travel + point.smoothing * bends(alone)
    assert point.energy.travel + point.smoothing * point.bend <= searched * (1 + 1e-9)


def test_bends_cost_the_same_however_finely_their_moves_are_divided(hayashi):
    """A turn that is spread evenly over the parts of a move costs what it costs in one."""
    path, bounds = ring(12), Constraints.of_degrees(tilt=(15, 75))
    rotary = np.stack([np.linspace(0.0, 6.0, 12), np.linspace(0.4, 0.9, 12)], axis=1)
    costs = []
    for parts in (1, 7):
        row = np.arange(11 * parts + 1) / parts
        finer = refined(path, row)
        built = Problem.build(finer, hayashi, bounds.lean_bounds(finer), bend_price=50.0)
        turns = np.diff(np.stack([np.interp(row, np.arange(12), a) for a in rotary.T], axis=1), axis=0)
        costs.append((built.bend_price[:, None] * turns**2).sum())
    assert costs[1] == pytest.approx(costs[0])


def test_no_other_point_is_better_at_a_points_own_price(found):
    for point in found.points:
        costs = [other.cost + point.smoothing * other.bend for other in found.points]
        assert point.cost + point.smoothing * point.bend <= min(costs) * (1 + 1e-3)


def test_where_the_clock_is_known_less_time_costs_more_and_the_first_is_the_cheapest(trunnion, hayashi):
    machine = trunnion.with_drives_of(hayashi)
    path = Toolpath.from_contacts(ring(30).contact, ring(30).normal, Tool.ball(6), feed_mm_min=3000.0)
    front = find_front(path, machine, 3, tilt=(15, 75), time_price=500.0)
    spent, times = ([getattr(p.energy, name) for p in front.points] for name in ("travel", "time"))
    assert spent == sorted(spent)
    assert times == sorted(times, reverse=True)
    alone = optimise(path, machine, tilt=(15, 75), time_price=500.0)
    assert spent[0] <= alone.energy.travel


def test_a_single_location_is_a_front_of_one(trunnion, hayashi):
    path = Toolpath.from_contacts(ring(60).contact, ring(60).normal, Tool.ball(6), feed_mm_min=3000.0)
    front = find_front(path.at(np.array([3])), trunnion.with_drives_of(hayashi), 3, tilt=(15, 75))
    assert len(front.points) == 1


@pytest.mark.slow
def test_where_speeds_are_known_delay_costs_more_along_the_front_and_time_shrinks(trunnion, hayashi):
    machine = trunnion.with_drives_of(hayashi)
    small = Toolpath.from_contacts(ring(30).contact, ring(30).normal, Tool.ball(6), feed_mm_min=3000.0)
    found = find_front(small, machine, 3, tilt=(15, 75))
    assert found.points[0].time_price < found.points[-1].time_price
    assert found.points[-1].energy.time <= found.points[0].energy.time * (1 + 1e-9)
    least = optimise(small, machine, tilt=(15, 75), objective="time")
    assert found.points[-1].energy.time <= least.energy.time * (1 + 1e-9)


def test_the_data_have_each_points_figures(found):
    data = found.as_dict()["points"]
    assert [p["energy_J"] for p in data] == [p.energy.total for p in found.points]
    assert data[0]["steepest_deg_mm"] == pytest.approx(np.degrees(found.points[0].steepest))


def test_every_point_has_its_solution_and_is_picked_by_its_number(found):
    assert len(found.solutions) == len(found.points)
    for number, (p, solution) in enumerate(zip(found.points, found.solutions, strict=True), start=1):
        assert found.pick(number) is solution
        assert solution.motion.positions.tolist() == p.motion.positions.tolist()
        assert solution.energy.total == p.energy.total
        assert max(solution.residuals().values()) <= 1e-9
    # Fewer may be left than were sought.
    assert found.pick(50) is found.solutions[-1]


def test_progress_counts_the_runs_of_a_front_up_to_the_last(hayashi):
    steps = []
    find_front(ring(24), hayashi, 3, tilt=(15, 75), progress=lambda *step: steps.append(step))
    runs = [step[0].partition(":")[0] for step in steps if step[0].startswith("front")]
    assert list(dict.fromkeys(runs)) == [f"front, run {k} of 3" for k in range(1, 4)]
    # The stages of one point would look as if all were done.
    assert "refining postures" not in {stage for stage, _, _ in steps}


def test_slower_cuts_that_save_no_travel_are_refused(hayashi):
    with pytest.raises(SettingError, match="the objective is travel"):
        find_front(ring(60), hayashi, tilt=(15, 75), feed_share=0.7)


def point(found, energy: float, bend: float, time: float) -> FrontPoint:
    first = found.points[0]
    by_axis = dict.fromkeys(first.energy.by_axis, 0.0) | {"X": energy}
    return replace(first, energy=replace(first.energy, by_axis=by_axis, time=time), cost=energy, bend=bend)


def test_a_dominated_point_is_left_out_and_of_equals_one_stays(found):
    figures = [(5, 1, 1), (1, 5, 1), (5, 5, 1), (1, 5, 1), (9, 9, 0.5)]
    points = [point(found, *f) for f in figures]
    kept = undominated([p.figures(p.energy) for p in points])
    assert [figures[k] for k in kept] == [(1, 5, 1), (5, 1, 1), (9, 9, 0.5)]


def test_on_a_known_clock_energy_with_base_power_counts_against_time_alone(found):
    figures = [(3870.5, 1, 100), (3869.1, 9, 99), (3900, 0.1, 98), (4000, 0.0, 99)]
    points = [point(found, *f) for f in figures]
    timed = [replace(p.energy, timing="accelerations", base=2.0 * p.energy.time) for p in points]
    rows = [p.figures(energy) for p, energy in zip(points, timed, strict=True)]
    assert rows[0] == (3870.5 + 200, 100)
    assert undominated(rows) == [1, 2]


@pytest.fixture(scope="module")
def rewound_front(hayashi):
    """The wall twice, one ring above the other, on a machine whose C has exactly one turn."""
    limits = Limits(0.0, 2.0 * np.pi)
    axes = tuple(replace(a, limits=limits) if a.letter == "C" else a for a in hayashi.axes)
    machine = replace(hayashi, axes=axes)
    one = ring(30)
    contact = np.concatenate([one.contact, one.contact - [0.0, 0.0, 0.5]])
    path = Toolpath.from_contacts(contact, np.tile(one.normal, (2, 1)), Tool.ball(6))
    return path, machine, find_front(path, machine, 3, tilt=(15, 75))


def test_a_front_of_a_path_with_rewinds_has_points_each_with_its_own(rewound_front):
    path, machine, front = rewound_front
    solution = front.solution
    assert solution.unwrapped is not None
    assert front.points[0].energy.as_dict() == solution.energy.as_dict()
    assert len(front.points) >= 2
    rewinds = [f for f in solution.toolpath.findings if f.code == "rewind"]
    c = machine.column("C")
    for p in front.points:
        assert within_limits(machine, p.motion.positions).all()
        turned = np.abs(p.motion.moves[:, c]) > 2.0 * np.pi - 1e-6
        assert 1 <= turned.sum() <= len(rewinds)
        assert len(p.motion) > len(path)
        # A rewind isn't counted among the bends.
        assert p.bend < (2.0 * np.pi) ** 2
    figures = [(p.energy.total, p.bend, p.energy.time) for p in front.points]
    for one in figures:
        others = [other for other in figures if other != one]
        assert not any(all(b <= a for a, b in zip(one, other, strict=True)) for other in others), figures


def test_the_solution_of_such_a_front_keeps_its_bounds_and_reports_its_own_rewinds(rewound_front):
    front = rewound_front[2]
    solution = front.solution
    assert max(solution.residuals().values()) <= 1e-9
    found = [f for f in solution.toolpath.findings if f.code == "rewind"]
    assert np.count_nonzero(np.diff(solution.toolpath.cutting.astype(int)) < 0) == len(found)
    assert len(solution.unwrapped.rewinds) == len(found)


def test_a_solution_put_together_by_hand_has_no_front(hayashi, monkeypatch):
    def bare(*args):
        return replace(posture.optimise_postures(*args), problem=None)

    monkeypatch.setattr("fiveaxis.posture.strategy.front.optimise_postures", bare)
    with pytest.raises(SettingError, match="put together by hand"):
        find_front(ring(60), hayashi, 3, tilt=(15, 75))
