"""Where a path lets the pivot be, found by the verification from the given locations alone."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fiveaxis.check.verification.course import ROUNDING, Course
from fiveaxis.model import Tool, Toolpath, refined

UP = np.array([0.0, 0.0, 1.0])
# mm: by how much the cubic of the path may leave the arcs of the verification.
AGREE = 2e-4


def wandering(seed: int) -> Toolpath:
    """Samples of a smooth space curve, unevenly spaced; the bow of its chords is up to a tenth of a mm."""
    rng = np.random.default_rng(seed)
    t = np.append(0.0, np.cumsum(rng.uniform(0.5, 1.0, size=rng.integers(4, 60))))
    t *= rng.uniform(0.5, 3.0) / t[-1]
    wave = rng.normal(size=(4, 3)) * rng.uniform(5.0, 40.0) / np.arange(1, 5)[:, None]
    points = sum(wave[i] * np.sin((i + 1) * t[:, None] + i) for i in range(4))
    return Toolpath.from_contacts(points, np.tile(UP, (len(t), 1)), Tool.ball(6))


def filled(path: Toolpath, parts: int = 9) -> Toolpath:
    return refined(path, np.linspace(0.0, len(path) - 1.0, parts * (len(path) - 1) + 1))


@given(seed=st.integers(0, 10**6))
def test_the_curve_of_the_path_is_allowed_everywhere_and_its_chords_too(seed):
    path = filled(wandering(seed))
    course, rows = Course.of(path), np.arange(len(path))
    assert course.distances(rows, path.pivot).max() < AGREE
    chord = np.zeros(3) if path.curve is None else path.curve.chord
    assert course.distances(rows, path.pivot + chord).max() < 1e-9


@given(seed=st.integers(0, 10**6))
def test_the_verification_takes_no_move_for_a_curve_that_is_planned_straight(seed):
    path = wandering(seed)
    bent = path.curved if path.curve is None else np.linalg.norm(path.curve.bows, axis=2).max(axis=1) / 4.0
    height = np.linalg.norm(Course.of(path).circles, axis=2).max(axis=1) * path.lengths**2 / 8.0
    # A bow of a nanometre may count as none for either.
    assert height[bent == 0.0].max() < 1e-5
    assert (height[bent > 1e-5] > 0.0).all()


@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), off=st.floats(0.02, 0.2))
def test_a_pivot_beside_the_band_is_found_by_how_far_it_is(seed, off):
    """Across the band, and on both sides of it: it hides nothing."""
    path = filled(wandering(seed))
    rows = np.flatnonzero(np.arange(len(path)) % 9)
    course, begin = Course.of(path), 9 * (rows // 9)
    chord = path.pivot[begin + 9] - path.pivot[begin]
    side = np.cross(chord, UP if path.curve is None else path.curve.chord[rows])
    side = np.where(np.linalg.norm(side, axis=1, keepdims=True) > 1e-12, side, np.cross(chord, UP))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    found = course.distances(rows, path.pivot[rows] + off * side)
    np.testing.assert_allclose(found, off, atol=5e-3)


def test_beyond_the_curve_and_beyond_the_chord_the_distance_counts_from_there():
    angle = np.linspace(0.0, 2.0, 24)
    points = 20.0 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)])
    path = Toolpath.from_contacts(points, np.tile(UP, (24, 1)), Tool.ball(8))
    course, rows = Course.of(path), np.arange(1, 24)
    middle = (path.pivot[1:] + path.pivot[:-1]) / 2.0
    out = middle - 4.0 * UP
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    sagitta = 20.0 * (1.0 - np.cos(1.0 / 23.0))
    for height, wanted in ((-0.01, 0.01), (0.5 * sagitta, 0.0), (sagitta + 0.01, 0.01), (sagitta + 0.1, 0.1)):
        found = course.distances(rows, middle + height * out)
        # The arcs are allowed to be higher by three hundredths, and by what is rounding.
        np.testing.assert_allclose(found, wanted, atol=0.03 * sagitta + ROUNDING)


@pytest.mark.parametrize("change", [{"shape": "chord"}, {"straight": np.ones(24, dtype=bool)}])
def test_a_path_of_chords_allows_no_curve(change):
    angle = np.linspace(0.0, 2.0, 24)
    points = 20.0 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)])
    path = replace(Toolpath.from_contacts(points, np.tile(UP, (24, 1)), Tool.ball(8)), **change)
    assert not Course.of(path).curved.any()
