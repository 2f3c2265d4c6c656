"""The density at which a smooth path is sampled changes neither its result nor what it is compared with."""

import numpy as np
import pytest
from support.sampled_surfaces import cone, dome, ellipse, sampled, wave

import fiveaxis as fx
from fiveaxis.base.errors import SettingError

# Share by which energies may differ between paths with one and four times the locations.
SAME = 0.02
# mm: the coarsest chords leave the curve by nearly as much.
MOST_BOW = 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "n"),
    [(cone, 60), (wave, 40)],
)
def test_result_and_baselines_cost_the_same_at_any_density(hayashi, surface, n):
    paths = [sampled(surface, n * times, rings=2) for times in (1, 4)]
    _, chord = paths[0].curve.between(paths[0].pivot, np.arange(len(paths[0]) - 1) + 0.5)
    assert 0.4 * MOST_BOW < np.linalg.norm(chord, axis=1).max() < MOST_BOW
    solutions = [fx.optimise(path, hayashi, tilt=(15, 70)) for path in paths]
    energies = [
        {"optimised": s.energy.total} | {n: e.total for n, e in s.baselines.items()} for s in solutions
    ]
    # The cheapest step at every location has no limit: it finds other ways at other locations.
    for name in energies[0].keys() - {"greedy"}:
        found = [energy[name] for energy in energies]
        assert max(found) <= (1.0 + SAME) * min(found), (name, found)


@pytest.mark.slow
def test_one_way_costs_the_same_at_any_density_where_searches_find_several(hayashi):
    """On the dome the search finds other local optima at other densities; from one way they cost the same."""
    energies, n = [], 60
    first = fx.optimise(sampled(dome, n), hayashi, tilt=(15, 70))
    given = first.motion.positions[~first.toolpath.inserted][:, hayashi.rotary_columns]
    for times in (1, 4):
        path = sampled(dome, n * times)
        # Ring by ring: between two rings lies one move at any density.
        rings = [np.arange(n * times + 1) / times + ring * (n + 1) for ring in range(4)]
        start = np.column_stack([np.interp(np.concatenate(rings), np.arange(len(given)), c) for c in given.T])
        energies.append(fx.optimise(path, hayashi, tilt=(15, 70), start=start).energy.total)
    assert max(energies) <= (1.0 + SAME) * min(energies), energies


@pytest.mark.slow
def test_along_chords_a_coarse_path_is_followed_as_the_polygon_that_it_is(hayashi):
    """What the curve changes: every axis saws to and fro, in the result and in the baselines."""
    path = sampled(cone, 60)
    smooth, chord = (
        fx.optimise(path, hayashi, tilt=(15, 70), path_shape=shape, effort="quick")
        for shape in ("smooth", "chord")
    )
    assert chord.baselines["normal"].total > 1.5 * smooth.baselines["normal"].total
    assert chord.energy.steadiness.events > 10 * smooth.energy.steadiness.events
    assert len(smooth.program().motion.blocks) < 0.5 * len(chord.program().motion.blocks)


def test_a_share_of_the_energy_buys_steadier_axes(hayashi):
    path = sampled(ellipse, 70, rings=2)
    free, steady = (fx.optimise(path, hayashi, tilt=(15, 70), effort="quick", steady=s) for s in (0.0, 0.01))
    assert steady.energy.steadiness.events <= free.energy.steadiness.events
    assert steady.energy.total <= 1.01 * free.energy.total * (1.0 + 1e-9)
    with pytest.raises(SettingError, match="steady = 2 is out of range; give 1 or less"):
        fx.optimise(path, hayashi, tilt=(15, 70), steady=2.0)
