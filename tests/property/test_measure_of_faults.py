"""The measure of planted faults allows the band between chord and curve, 0.02 mm around it, and no more."""

from itertools import pairwise

import numpy as np
import pytest
from planted.measure import ALONG_BLOCKS, Band, Meaning, Measure, Way, distances
from planted.trial import PARTS, Trial, cone_wall, two_passes
from planted.words import DIRECTION, LINEAR, with_words, words_of

import fiveaxis as fx
from fiveaxis.base import Array, normalise
from fiveaxis.model import Toolpath

PATHS = {"hayashi": cone_wall(-0.5), "trunnion": cone_wall(0.0), "passes": two_passes()}
# mm: how far scipy's spline may be from the planned curve, at the ends of a pass, which have one neighbour.
CURVES_DIFFER = 0.003
# mm: so far beside the band a fault matters.
OUTSIDE = 0.03
# mm: a thinner band has no sides to tell apart.
THIN = 0.001


@pytest.fixture(params=PATHS)
def path(request) -> Toolpath:
    return PATHS[request.param]


def between(path: Toolpath) -> tuple[Array, Array]:
    """The planned curve at places of all cuts where it leaves the chord, and from there to the chord, mm."""
    every = np.arange(1, len(path))[path.cutting[1:]]
    places = (every[:, None] - np.array([0.3, 0.5, 0.7])).ravel()
    curve, chord = path.curve.between(path.pivot, places)
    wide = np.linalg.norm(chord, axis=1) > THIN
    assert wide.sum() > len(path)
    return curve[wide], chord[wide]


def test_the_spline_of_the_measure_is_the_planned_curve(path):
    spline = Band.of(path).spline
    for move in range(1, len(path)):
        curve, _ = path.curve.between(path.pivot, move - 1 + np.linspace(0.0, 1.0, 9))
        assert distances(curve, spline[move - 1]).min(axis=1).max() < CURVES_DIFFER


def test_a_point_in_the_band_is_on_the_path(path):
    curve, chord = between(path)
    band = Band.of(path)
    for share in (0.0, 0.5, 1.0):
        assert band.near(curve + share * chord).all()


def test_a_point_a_little_beside_the_band_is_off_the_path_on_every_side(path):
    curve, chord = between(path)
    band, inwards = Band.of(path), normalise(chord)
    assert not band.near(curve - OUTSIDE * inwards).any()
    assert not band.near(curve + chord + OUTSIDE * inwards).any()
    step = np.diff(path.pivot, axis=0)
    along = normalise(step[distances(curve, path.pivot).argmin(axis=1)])
    for side in (-OUTSIDE, OUTSIDE):
        assert not band.near(curve + 0.5 * chord + side * np.cross(along, inwards)).any()


def test_the_band_widens_no_link():
    path = two_passes()
    links = np.flatnonzero(~path.cutting)
    middle = 0.5 * (path.pivot[links] + path.pivot[links - 1])
    along = normalise(path.pivot[links] - path.pivot[links - 1])
    band, up = Band.of(path), np.array([0.0, 0.0, 1.0])
    assert band.near(middle).all()
    for across in (np.cross(along, up), np.cross(np.cross(along, up), along)):
        for side in (-1.0, 1.0):
            assert not band.near(middle + side * (ALONG_BLOCKS + 0.001) * normalise(across)).any()


def test_a_pass_that_ends_early_matters_though_it_stays_in_the_band(path):
    """Each given location has to be passed."""
    measure = Measure(Meaning(fx.load_machine("hayashi-640123"), "vector"), path, tilt=(0.0, 180.0))
    share = np.linspace(0.0, 1.0, 10)[:, None]
    axis = np.tile([0.0, 0.0, 1.0], (len(share), 1))
    ways = [Way(i, False, a + share * (b - a), axis) for i, (a, b) in enumerate(pairwise(path.pivot), 1)]
    assert not measure.strays(ways)
    assert measure.strays(ways[:-1])


@pytest.mark.parametrize("part", ["hayashi", "trunnion"])
def test_a_block_moved_across_the_path_matters_on_every_side(part):
    """In a list of locations each block has all words of the tip."""
    trial = Trial.of(PARTS[part], PARTS[part].solve(), "apt", "vector")
    subject, text = trial.subject, trial.text
    assert not subject.measure.matters(text)
    tips = {line: np.array([text.states[line][c] for c in LINEAR]) for line in text.moves}
    for line in subject.cutting[::3]:
        words, before = words_of(text.lines[line]), text.moves[text.moves.index(line) - 1]
        along = normalise((tips[line] - tips[before])[None])[0]
        axis = np.array([words[c] for c in DIRECTION])
        across = normalise(np.cross(along, axis)[None])[0]
        for way in (across, np.cross(across, along)):
            for side in (-0.1, 0.1):
                moved = dict(zip(LINEAR, (tips[line] + side * way).tolist(), strict=True))
                changed = text.replaced(line, with_words(text.lines[line], words | moved))
                assert subject.measure.matters(changed), f"line {line}: {side} mm along {way}"
