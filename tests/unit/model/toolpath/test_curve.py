"""The curve through cutter locations: where it is, and where the path stays straight."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from fiveaxis.model import Band, MoveKind, Tool, Toolpath, divide, refined

BALL = Tool.ball(8)
UP = np.array([0.0, 0.0, 1.0])


def through(points: np.ndarray, normal: np.ndarray = UP) -> Toolpath:
    return Toolpath.from_contacts(points, np.broadcast_to(normal, points.shape), BALL)


def circle(angle: np.ndarray, radius: float = 20.0) -> np.ndarray:
    return radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])


def between(path: Toolpath, parts: int = 8) -> np.ndarray:
    return refined(path, np.linspace(0.0, len(path) - 1.0, parts * (len(path) - 1) + 1)).pivot


def bow(path: Toolpath) -> np.ndarray:
    """Largest distance of the curve from each chord, mm."""
    row = np.arange(1, len(path))[:, None] + np.linspace(-1.0, 0.0, 17)
    _, chord = path.curve.between(path.pivot, row.ravel())
    return np.linalg.norm(chord, axis=1).reshape(row.shape).max(axis=1)


@pytest.mark.parametrize("uneven", [0.0, 0.35])
def test_a_circle_is_met_between_its_samples_however_they_are_spaced(uneven):
    steps = np.radians(5.0) * (1.0 + uneven * np.sin(np.arange(72)))
    path = through(circle(np.append(0.0, np.cumsum(steps))))
    assert path.curved[1:].all()
    radius = np.linalg.norm(between(path)[:, :2], axis=1)
    np.testing.assert_allclose(radius, 20.0, atol=2e-6)
    # The chords are up to 34 µm inside.
    assert np.linalg.norm(between(path.shaped("chord"))[:, :2], axis=1).min() < 20.0 - 0.015


def test_the_length_of_a_curve_is_the_arcs():
    angle = np.linspace(0.0, 1.0, 12)
    assert through(circle(angle)).lengths[1:] == pytest.approx(20.0 * np.diff(angle), rel=1e-7)


def test_a_smooth_space_curve_is_met_far_more_closely_than_by_chords():
    def helix(t):
        return np.column_stack([20.0 * np.cos(t), 14.0 * np.sin(t), 3.0 * t + np.sin(2.0 * t)])

    t = np.linspace(0.0, 6.0, 90)
    fine = cKDTree(helix(np.linspace(0.0, 6.0, 10**6)) + 4.0 * UP)
    path = through(helix(t))
    smooth, chord = (fine.query(between(path.shaped(shape)))[0].max() for shape in ("smooth", "chord"))
    assert chord > 0.008
    assert smooth < 0.1 * chord


def test_inserted_locations_lie_on_one_and_the_same_curve():
    path = through(circle(np.linspace(0.0, 3.0, 30)))
    some = refined(path, np.sort(np.append(np.arange(30.0), [3.2, 3.7, 11.5])))
    row = np.linspace(0.0, 29.0, 400)
    here = np.interp(row, [*np.arange(30.0)], np.arange(30.0))
    at = np.interp(here, np.sort(np.append(np.arange(30.0), [3.2, 3.7, 11.5])), np.arange(33.0))
    point, chord = path.curve.between(path.pivot, row)
    again, chord_again = some.curve.between(some.pivot, at)
    np.testing.assert_allclose(again, point, atol=1e-12)
    np.testing.assert_allclose(chord_again, chord, atol=1e-12)
    assert some.lengths.sum() == pytest.approx(path.lengths.sum(), rel=1e-9)
    np.testing.assert_allclose(some.contact, some.pivot - 4.0 * some.normal, atol=1e-12)


def test_the_band_reaches_from_the_curve_to_the_chord_and_no_farther():
    path = through(circle(np.linspace(0.0, 3.0, 30)))
    row = np.arange(29) + 0.5
    straight = (path.pivot[1:] + path.pivot[:-1]) / 2.0
    band = Band.of(path, np.broadcast_to(UP, path.pivot.shape), row, np.broadcast_to(UP, (29, 3)))
    outwards = straight - 4.0 * UP
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    sagitta = 20.0 * (1.0 - np.cos(1.5 / 29.0))
    for beyond, wanted in (
        (0.0, 0.0),
        (0.5 * sagitta, 0.0),
        (sagitta, 0.0),
        (sagitta + 0.01, 0.01),
        (-0.01, 0.01),
    ):
        np.testing.assert_allclose(band.distances(straight + beyond * outwards), wanted, atol=1e-6)


def square(side: int = 6) -> np.ndarray:
    edge = np.arange(side, dtype=float)
    return np.array(
        [*((x, 0, 0) for x in edge), *((side, y, 0) for y in edge), *((side - x, side, 0) for x in edge)]
    )


ARC = np.radians(6.0) * np.arange(1, 11)
LINE = {"a long line, then an arc": 10.0, "an even line, then an arc": 1.0}


@pytest.mark.parametrize("step", LINE.values(), ids=LINE)
def test_a_line_beside_an_arc_bows_by_less_than_half_the_arcs_sagitta(step):
    arc = np.column_stack([10.0 * np.sin(ARC), 10.0 - 10.0 * np.cos(ARC), np.zeros(10)])
    path = through(np.vstack([[[-step * k, 0.0, 0.0] for k in (4, 3, 2, 1, 0)], arc]))
    assert path.curved[5:].all()
    sagitta = 10.0 * (1.0 - np.cos(np.radians(3.0)))
    found = bow(path)
    assert (found[:4] < 0.5 * sagitta).all()
    np.testing.assert_allclose(found[5:], sagitta, rtol=1e-2)


POINTS = {
    "corners": square(),
    "a zigzag": np.column_stack([np.arange(20.0), 0.1 * (np.arange(20) % 2), np.zeros(20)]),
    "one bend of ten degrees": np.vstack(
        [[[x, 0.0, 0.0] for x in range(6)], [[5 + 0.985 * x, 0.174 * x, 0.0] for x in range(1, 6)]]
    ),
    "samples far apart": circle(np.linspace(0.0, 6.0, 20), 100.0),
}


@pytest.mark.parametrize("points", POINTS.values(), ids=POINTS)
def test_what_tells_no_curve_stays_straight(points):
    path = through(points)
    assert not path.curved.any()
    np.testing.assert_array_equal(
        between(path), divide(path.shaped("chord"), np.full(len(path) - 1, 8)).pivot
    )


def test_a_repeated_point_is_a_corner_and_the_curve_goes_on_beside_it():
    path = through(circle(np.radians(5.0) * np.array([0, 1, 2, 3, 4, 4, 5, 6, 7, 8])))
    np.testing.assert_array_equal(np.flatnonzero(~path.curved), [0, 5])
    np.testing.assert_allclose(np.linalg.norm(between(path)[:, :2], axis=1), 20.0, atol=2e-6)


def test_steps_of_a_micrometre_beside_steps_of_ten_millimetres_are_chords():
    rng = np.random.default_rng(3)
    far = np.column_stack([10.0 * np.arange(8), 0.2 * np.arange(8) ** 2, np.zeros(8)])
    near = far + rng.normal(size=far.shape) * 1e-3 / np.sqrt(3.0)
    path = through(np.stack([far, near], axis=1).reshape(-1, 3))
    assert np.isfinite(between(path)).all()
    assert not path.curved.any()


def test_normals_that_flip_make_a_chord_of_their_move():
    points = circle(np.linspace(0.0, 2.0, 24))
    normal = np.broadcast_to(UP, points.shape).copy()
    normal[12:] *= -1.0
    path = Toolpath.from_contacts(points, normal, BALL)
    assert not path.curved[12]
    assert path.curved[[6, 18]].all()
    assert np.isfinite(between(path)).all()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_too_few_locations_tell_no_curve(count):
    path = through(circle(np.linspace(0.0, 0.2, 3))[:count])
    assert not path.curved.any()
    assert len(between(path, 4)) == 4 * (count - 1) + 1


def test_links_rapid_moves_and_moves_marked_straight_are_chords():
    path = through(circle(np.linspace(0.0, 2.0, 24)))
    kind = path.kind.copy()
    kind[[8, 9]] = MoveKind.LINK, MoveKind.RAPID
    some = replace(path, kind=kind, straight=np.arange(24) == 16)
    np.testing.assert_array_equal(np.flatnonzero(~some.curved), [0, 8, 9, 16])


def test_tips_and_axes_state_chords_until_a_curve_is_asked_for():
    path = Toolpath.from_tips(circle(np.linspace(0.0, 2.0, 24)), np.tile(UP, (24, 1)), BALL)
    assert path.shape == "chord"
    assert path.curve is None
    assert path.shaped("smooth").curved[1:].all()


@given(seed=st.integers(0, 10**6))
def test_the_curve_of_any_points_stays_within_the_arcs_through_them(seed):
    """No overshoot: over each chord it is no higher than the higher of the arcs of its ends."""
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.uniform(-0.6, 0.6, size=(40, 2)), axis=0)
    step = rng.choice([1e-3, 0.3, 1.0, 1.2, 5.0], size=40, p=[0.05, 0.2, 0.4, 0.3, 0.05])
    ahead = np.column_stack([np.cos(turn[:, 0]), np.sin(turn[:, 0]), 0.3 * np.sin(turn[:, 1])])
    path = through(np.cumsum(step[:, None] * ahead, axis=0))
    assert np.isfinite(between(path)).all()
    unit = np.diff(path.pivot, axis=0) / np.linalg.norm(np.diff(path.pivot, axis=0), axis=1, keepdims=True)
    bend = np.linalg.norm(np.diff(unit, axis=0), axis=1)
    bend = np.append(0.0, np.append(bend, 0.0))
    # An arc over the chord c meets it at an angle below that between the chords: it is lower than c φ / 4.
    most = np.linalg.norm(np.diff(path.pivot, axis=0), axis=1) * np.maximum(bend[:-1], bend[1:]) / 4.0
    assert (bow(path) <= most * 1.02 + 1e-9).all()
