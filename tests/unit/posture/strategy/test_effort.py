"""Efforts: by name, and more of it never costs more."""

import pytest
from support.ring_path import ring
from support.travel_optimiser import optimise

from fiveaxis.base.errors import SettingError
from fiveaxis.posture.strategy.effort import Effort, effort_of, resolution

ONE = Effort((resolution(2.0, 8.0, 60),))
MANY = Effort((resolution(1.0, 5.0, 200),), contains=ONE)


def test_each_effort_contains_the_smaller_one():
    quick, normal, thorough = (effort_of(name) for name in ("quick", "normal", "thorough"))
    assert quick.contains is None
    assert normal.contains == quick
    assert thorough.contains == normal
    assert thorough.nested == (quick, normal, thorough)


def test_a_field_is_changed_in_the_smaller_efforts_too():
    effort = effort_of("thorough").having(solver="ipopt")
    while effort is not None:
        assert effort.solver == "ipopt"
        effort = effort.contains


def test_an_unknown_effort_is_refused_with_the_known_ones(hayashi):
    with pytest.raises(SettingError, match="'best'; write quick, normal, thorough"):
        effort_of("best")
    with pytest.raises(SettingError, match="unknown effort 'best'"):
        optimise(ring(12), hayashi, tilt=(15, 75), effort="best")


def test_many_searches_never_cost_more_than_one(hayashi):
    one, many = (optimise(ring(60), hayashi, tilt=(15, 75), effort=effort) for effort in (ONE, MANY))
    assert many.energy.travel <= one.energy.travel * (1 + 1e-9)
    for energy in many.baselines.values():
        assert many.energy.travel <= energy.travel * (1 + 1e-9)
