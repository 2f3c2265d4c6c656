"""Paths coloured by power."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.model import MoveKind, move_powers
from fiveaxis.show.viewer.payload import VIRIDIS, colour_top, cutting_powers


def test_the_scale_grows_lighter_throughout():
    luminance = VIRIDIS @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > 0.0).all()


def test_power_times_duration_is_the_power_integral_of_the_cuts(solution):
    motion = replace(solution.motion, kind=np.full(len(solution.motion), MoveKind.CUT))
    power = cutting_powers(move_powers(solution.machine, motion), motion)
    assert np.isnan(power).tolist() == [True] + [False] * (len(motion) - 1)
    assert np.nansum(power * motion.time) == pytest.approx(solution.energy.total)


def test_a_link_and_a_move_without_duration_have_no_power_and_raise_no_warning(solution):
    motion = solution.motion
    still = replace(motion, time=np.zeros(len(motion)))
    assert np.isnan(cutting_powers(move_powers(solution.machine, still), still)).all()
    power = cutting_powers(move_powers(solution.machine, motion), motion)
    assert np.isnan(power[motion.kind == MoveKind.LINK]).all()


@pytest.mark.parametrize("powers", [[np.nan, np.nan], [0.0, 0.0], []])
def test_a_path_that_costs_nothing_still_has_a_scale(powers):
    assert colour_top(np.array(powers)) == 1.0


def test_one_costly_move_does_not_darken_the_rest():
    assert colour_top(np.append(np.ones(999), 1e6)) == 1.0


def test_a_very_costly_baseline_does_not_darken_the_result():
    assert colour_top(np.full(100, 2.0), np.full(100, 500.0)) == 6.0


def test_one_costly_move_among_free_ones_is_seen():
    assert colour_top(np.append(np.zeros(999), 3.0)) == 3.0
