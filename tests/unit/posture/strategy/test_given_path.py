"""Starts of a path: many never cost more than one, and the results of all are reported."""

from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds
from by_travel import optimise, refined_cost
from rings import ring

from fiveaxis.errors import SettingError
from fiveaxis.kinematics import tool_axes
from fiveaxis.posture import Effort, LatticeSearch
from fiveaxis.posture.solution import Optima
from fiveaxis.posture.strategy.given_path import leaning_paths

MANY = Effort(
    searches=(LatticeSearch(4, 0.1, 24),),
    kept=1,
    iterations=300,
    others=((LatticeSearch(3, 0.12, 30),), (LatticeSearch(2, 0.06, 24, on_angles=True),)),
    from_baselines=True,
    leans=(0.5,),
)


@pytest.fixture(scope="module")
def many(hayashi):
    return optimise(ring(120), hayashi, tilt=(15, 75), effort=MANY)


def test_many_starts_never_cost_more_than_the_searches_alone(many, hayashi):
    one = replace(MANY, others=(), from_baselines=False, leans=())
    alone = optimise(ring(120), hayashi, tilt=(15, 75), effort=one)
    assert alone.optima is None
    assert many.energy.travel <= alone.energy.travel * (1 + 1e-9)
    assert many.optima.costs["searches"] == pytest.approx(refined_cost(alone))


def test_the_best_of_the_optima_is_the_result_and_each_start_is_reported(many):
    costs = many.optima.costs
    assert min(costs.values()) <= refined_cost(many) * (1.0 + 1e-9)
    starts = {*costs, *many.optima.failed}
    assert {"searches", "searches, set 1", "searches, set 2", "lean of 45 deg"} <= starts
    assert {f"baseline {name}" for name in many.baselines} <= starts
    assert any(stage.name.startswith("searches, set 2: search") for stage in many.stages)
    assert any("on angles" in stage.name for stage in many.stages)
    for name, energy in many.baselines.items():
        assert costs[f"baseline {name}"] <= energy.total * (1 + 1e-9)


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


def test_a_leaning_path_leans_by_its_share_of_the_range_all_along(hayashi):
    path = ring(120)
    tilt = tilt_bounds(path, (15.0, 75.0))
    effort = replace(MANY, leans=(0.25, 0.5))
    paths = leaning_paths(path, hayashi, tilt, effort)
    assert list(paths) == ["lean of 30 deg", "lean of 45 deg"]
    for wanted, rotary in zip((30.0, 45.0), paths.values(), strict=True):
        np.testing.assert_allclose(np.degrees(tilt.angles(tool_axes(hayashi, rotary))), wanted, atol=1e-6)


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
