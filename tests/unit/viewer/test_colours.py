"""Energy per millimetre as colour."""

from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.energy import move_energies
from fiveaxis.toolpath import MoveKind
from fiveaxis.viewer.colours import (
    AIR,
    VIRIDIS,
    colour_top,
    energy_density,
    move_colours,
    viridis,
)


def test_the_ends_of_the_scale_are_the_ends_of_the_table():
    np.testing.assert_array_equal(viridis(np.array([0.0, 1.0])), VIRIDIS[[0, -1]])


def test_shares_outside_the_scale_and_unknown_ones_have_colours():
    found = viridis(np.array([-1.0, 2.0, np.nan, np.inf]))
    np.testing.assert_array_equal(found, VIRIDIS[[0, -1, 0, -1]])


def test_the_scale_grows_lighter_all_the_way():
    luminance = viridis(np.linspace(0.0, 1.0, 101)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > 0.0).all()


def test_density_times_way_is_the_energy_of_the_cuts(solution):
    path = solution.toolpath
    density = energy_density(solution.machine, solution.motion, path)
    energy = move_energies(solution.machine, solution.motion).sum(axis=1)
    known = np.isfinite(density)
    assert known.sum() == path.cutting.sum() - 1
    np.testing.assert_allclose((density * path.lengths)[known], energy[known])


def test_a_turn_on_the_spot_has_no_density_and_raises_no_warning(solution):
    path = solution.toolpath
    still = replace(path, pivot=np.repeat(path.pivot[:1], len(path), axis=0))
    assert np.isnan(energy_density(solution.machine, solution.motion, still)).all()


@pytest.mark.parametrize("density", [[np.nan, np.nan], [0.0, 0.0], []])
def test_a_path_that_costs_nothing_still_has_a_scale(density):
    assert colour_top(np.array(density)) == 1.0


def test_one_dear_move_does_not_darken_the_rest():
    assert colour_top(np.append(np.ones(999), 1e6)) == 1.0


def test_a_very_dear_baseline_does_not_darken_the_result():
    assert colour_top(np.full(100, 2.0), np.full(100, 500.0)) == 6.0


def test_one_dear_move_among_free_ones_is_seen():
    assert colour_top(np.append(np.zeros(999), 3.0)) == 3.0


def test_links_are_grey(solution):
    path = solution.toolpath
    colours = move_colours(np.ones(len(path)), path, 1.0)
    np.testing.assert_array_equal(colours[path.kind == MoveKind.LINK], [AIR])
    np.testing.assert_array_equal(colours[path.cutting], np.tile(VIRIDIS[-1], (path.cutting.sum(), 1)))
