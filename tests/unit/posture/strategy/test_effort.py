"""Efforts by name."""

import pytest

from fiveaxis.errors import SettingError
from fiveaxis.posture.strategy.effort import EFFORTS, effort_of


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


def test_every_effort_has_a_promise():
    assert list(EFFORTS) == ["quick", "normal", "thorough"]
    for effort in EFFORTS.values():
        assert len(effort.promise.split()) > 8


def test_an_unknown_effort_is_refused_with_the_known_ones():
    with pytest.raises(SettingError, match="'best'; write quick, normal, thorough"):
        effort_of("best")
