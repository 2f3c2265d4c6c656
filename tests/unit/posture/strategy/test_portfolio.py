"""Searches and refinements in parallel threads."""

import os

import numpy as np
import pytest
from by_degrees import tilt_bounds

from fiveaxis.posture.problem import Problem
from fiveaxis.posture.strategy import portfolio
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.portfolio import Portfolio


@pytest.fixture
def problem(hayashi, vase) -> Problem:
    part = vase.at(np.arange(0, 720, 2))
    turns = np.where(part.cutting[1:], 0.4, 1.0)
    return Problem.build(part, hayashi, tilt_bounds(part, (15, 75)), max_turn=turns)


def test_the_number_of_threads_doesnt_change_the_result(problem, monkeypatch):
    alone = Portfolio(problem, Effort())
    expected = alone.best_path({})
    monkeypatch.setattr(portfolio, "LONG", 100)
    for cores in (1, 2, 5):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        run = Portfolio(problem, Effort())
        np.testing.assert_array_equal(run.best_path({}), expected)
        assert run.stages == alone.stages


def test_a_ctrl_c_in_one_thread_ends_the_work(problem, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(portfolio, "LONG", 100)
    monkeypatch.setattr(portfolio, "shortest_path", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Portfolio(problem, Effort()).best_path({})
