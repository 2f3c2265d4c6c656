"""Efforts by name."""

from dataclasses import replace

import pytest

from fiveaxis.errors import SettingError
from fiveaxis.posture.strategy.effort import EFFORTS, Effort, effort_of, random_searches


def test_normal_is_the_default():
    assert effort_of("normal") == replace(Effort(), promise=EFFORTS["normal"].promise)


def test_quick_does_less_than_normal_and_thorough_more():
    quick, normal, thorough = (effort_of(name) for name in ("quick", "normal", "thorough"))
    assert len(quick.searches) < len(normal.searches) <= len(thorough.searches)
    assert quick.kept < normal.kept < thorough.kept
    assert not quick.is_many
    assert not normal.is_many
    assert thorough.is_many
    # The portfolio of normal is among the starts, so thorough can't cost more.
    assert set(normal.searches) <= set(thorough.searches)


def test_every_effort_has_a_promise():
    assert list(EFFORTS) == ["quick", "normal", "thorough"]
    for effort in EFFORTS.values():
        assert len(effort.promise.split()) > 8


def test_an_unknown_effort_is_refused_with_the_known_ones():
    with pytest.raises(SettingError, match="'best'; write quick, normal, thorough"):
        effort_of("best")


def test_random_searches_are_the_same_in_every_run_and_differ_from_each_other():
    first = random_searches(6)
    assert first == random_searches(6)
    assert len(set(first)) == 6
    assert first != random_searches(6, seed=1)
    for search in first:
        assert search.stride >= 1
        assert search.step > 0.0
        assert search.levels > 1
