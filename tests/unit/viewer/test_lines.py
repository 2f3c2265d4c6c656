"""Paths coloured by power."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.toolpath import MoveKind
from fiveaxis.viewer.lines import (
    AIR,
    VIRIDIS,
    colour_top,
    cutting_powers,
    move_colours,
    viridis,
)


def test_the_ends_of_the_scale_are_the_ends_of_the_table():
    np.testing.assert_array_equal(viridis(np.array([0.0, 1.0])), VIRIDIS[[0, -1]])


def test_shares_outside_the_scale_and_unknown_ones_have_colours():
    found = viridis(np.array([-1.0, 2.0, np.nan, np.inf]))
    np.testing.assert_array_equal(found, VIRIDIS[[0, -1, 0, -1]])


def test_the_scale_grows_lighter_throughout():
    luminance = viridis(np.linspace(0.0, 1.0, 101)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > 0.0).all()


def test_power_times_duration_is_the_power_integral_of_the_cuts(solution):
    motion = replace(solution.motion, kind=np.full(len(solution.motion), MoveKind.CUT))
    power = cutting_powers(solution.machine, motion)
    assert np.isnan(power).tolist() == [True] + [False] * (len(motion) - 1)
    assert np.nansum(power * motion.time) == pytest.approx(solution.energy.total)


def test_a_link_and_a_move_without_duration_have_no_power_and_raise_no_warning(solution):
    motion = solution.motion
    still = replace(motion, time=np.zeros(len(motion)))
    assert np.isnan(cutting_powers(solution.machine, still)).all()
    power = cutting_powers(solution.machine, motion)
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


def test_moves_without_power_are_grey_and_the_costliest_have_the_last_colour():
    colours = move_colours(np.array([np.nan, 5.0, 7.0]), 5.0)
    last = np.round(255.0 * VIRIDIS[-1])
    np.testing.assert_array_equal(colours, [np.round(255.0 * np.array(AIR)), last, last])
    assert colours.dtype == np.uint8
