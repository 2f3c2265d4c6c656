"""Starts of a path: many never cost more than one, and the results of all are reported."""

from dataclasses import replace

import numpy as np
import pytest
from by_travel import optimise, refined_cost
from rings import ring

from fiveaxis.errors import SettingError
from fiveaxis.posture import Effort, LatticeSearch
from fiveaxis.posture.solution import Optima

MANY = Effort(
    searches=(
        (LatticeSearch(4, 0.1, 24),),
        (LatticeSearch(3, 0.12, 30),),
        (LatticeSearch(2, 0.06, 24, on_angles=True),),
    ),
    iterations=300,
)


@pytest.fixture(scope="module")
def many(hayashi):
    return optimise(ring(120), hayashi, tilt=(15, 75), effort=MANY)


def test_many_starts_never_cost_more_than_the_searches_alone(many, hayashi):
    one = replace(MANY, searches=MANY.searches[:1])
    alone = optimise(ring(120), hayashi, tilt=(15, 75), effort=one)
    assert alone.optima is None
    assert many.energy.travel <= alone.energy.travel * (1 + 1e-9)
    assert many.optima.costs["searches, set 1"] == pytest.approx(refined_cost(alone))


def test_the_best_of_the_optima_is_the_result_and_each_start_is_reported(many):
    costs = many.optima.costs
    assert min(costs.values()) <= refined_cost(many) * (1.0 + 1e-9)
    assert {*costs, *many.optima.failed} == {f"searches, set {number}" for number in (1, 2, 3)}
    assert any("on angles" in stage.name for stage in many.stages)
    for energy in many.baselines.values():
        assert max(costs.values()) <= energy.total * (1 + 1e-9)


def test_the_spread_is_plain_data(many):
    data = many.optima.as_dict()
    assert data["min"] <= data["median"] <= data["max"]
    assert 1 <= data["distinct"] <= len(data["starts"])


def test_optima_that_are_nearly_the_same_count_once():
    optima = Optima({"a": 100.0, "b": 100.0001, "c": 101.0, "d": 250.0}, ("e",))
    assert optima.distinct == 3
    assert optima.as_dict()["median"] == pytest.approx(100.50005)
    assert Optima({}, ("a",)).as_dict() == {
        "min": None, "median": None, "max": None, "distinct": 0, "starts": {}, "failed": ["a"],
    }  # fmt: skip


def test_an_unknown_effort_is_refused_before_any_work(hayashi):
    with pytest.raises(SettingError, match="unknown effort"):
        optimise(ring(120), hayashi, tilt=(15, 75), effort="hard")


def test_thorough_is_found_by_its_name_and_gives_the_same_twice(hayashi):
    short = ring(12)
    first = optimise(short, hayashi, tilt=(15, 75), max_turn=360.0, effort="thorough")
    again = optimise(short, hayashi, tilt=(15, 75), max_turn=360.0, effort="thorough")
    assert first.optima.as_dict() == again.optima.as_dict()
    np.testing.assert_array_equal(first.motion.positions, again.motion.positions)
    normal = optimise(short, hayashi, tilt=(15, 75), max_turn=360.0)
    assert first.energy.travel <= normal.energy.travel * (1 + 1e-9)
