"""Paths at the given locations: more searches never cost more, and give the same twice."""

import numpy as np
import pytest
from by_travel import optimise
from rings import ring

from fiveaxis.errors import SettingError
from fiveaxis.posture import Effort
from fiveaxis.posture.strategy.effort import grain

ONE = Effort(grain(2.0, 8.0, 60))
MANY = Effort(grain(1.0, 5.0, 200), contains=ONE)


def test_many_searches_never_cost_more_than_one(hayashi):
    one, many = (optimise(ring(120), hayashi, tilt=(15, 75), effort=effort) for effort in (ONE, MANY))
    assert many.energy.travel <= one.energy.travel * (1 + 1e-9)
    for energy in many.baselines.values():
        assert many.energy.travel <= energy.travel * (1 + 1e-9)


def test_an_unknown_effort_is_refused_before_any_work(hayashi):
    with pytest.raises(SettingError, match="effort = 'hard' is unknown"):
        optimise(ring(120), hayashi, tilt=(15, 75), effort="hard")


def test_thorough_is_found_by_its_name_and_gives_the_same_twice(hayashi):
    short = ring(12)
    first, again, normal = (
        optimise(short, hayashi, tilt=(15, 75), max_turn=360.0, effort=effort, bound=False)
        for effort in ("thorough", "thorough", "normal")
    )
    np.testing.assert_array_equal(first.motion.positions, again.motion.positions)
    assert first.energy.travel <= normal.energy.travel * (1 + 1e-9)
