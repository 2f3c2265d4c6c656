"""Moves are divided into as many parts as they need, within what fits a computer."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.base.errors import ToolpathError
from fiveaxis.model import Tool, Toolpath, divided_rows, knots, turned
from fiveaxis.model.toolpath.dividing import MOST_IN_ALL, MOST_PARTS, part_places


def test_parts_are_even_and_the_given_rows_are_among_them():
    np.testing.assert_allclose(divided_rows(np.array([1, 4, 2])), [0, 1, 1.25, 1.5, 1.75, 2, 2.5, 3])


def test_a_move_that_would_fill_the_memory_is_refused_by_its_number():
    with pytest.raises(ToolpathError, match=r"the worst, move 2, into 200001 \(at most 200000 each"):
        part_places(np.array([1, MOST_PARTS + 1, 1]))


def test_many_long_moves_are_refused_together():
    parts = np.full(MOST_IN_ALL // MOST_PARTS + 1, MOST_PARTS)
    with pytest.raises(ToolpathError, match="divided into 10200000 parts"):
        part_places(parts)


def test_a_long_path_of_undivided_moves_is_no_such_case():
    assert len(part_places(np.ones(MOST_IN_ALL + 5, dtype=np.int64))[0]) == MOST_IN_ALL + 5


def test_between_knots_the_path_is_as_near_its_chords_as_asked():
    turn = np.linspace(0.0, 4.0, 4001)
    normal = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    path = Toolpath.from_contacts(20.0 * normal, normal, Tool.ball(6))
    rows = knots(path, apart=0.005, tilted=1e-3, most=64)
    # A chord of a circle of 23 mm is this far from it where it spans so many locations.
    widest = 2.0 * np.arccos(1.0 - 0.005 / 23.0) / 1e-3
    assert widest - 2 < np.median(np.diff(rows)) <= widest
    for first, last in itertools.pairwise(rows):
        share = np.linspace(0.0, 1.0, last - first + 1)[:, None]
        chord = path.pivot[first] + share * (path.pivot[last] - path.pivot[first])
        assert np.linalg.norm(chord - path.pivot[first : last + 1], axis=1).max() <= 0.005 * 1.001


def test_links_and_changes_of_feed_are_knots():
    contact = np.stack([np.arange(300.0), np.zeros(300), np.zeros(300)], axis=1)
    path = Toolpath.from_contacts(contact, np.tile([0.0, 0.0, 1.0], (300, 1)), Tool.ball(6))
    links = np.isin(np.arange(300), [100, 101])
    path = replace(path.with_links(links), feed=np.where(np.arange(300) < 200, 10.0, 20.0))
    assert set(knots(path, 0.01, 1e-3, 64)) >= {0, 99, 100, 101, 199, 299}


@pytest.mark.parametrize("angle", [1e-9, 1e-5, 0.3, 1.5, 3.0])
def test_directions_turn_by_the_share_of_their_angle(angle):
    random = np.random.default_rng(3)
    first, side = np.linalg.qr(random.normal(size=(3, 2)))[0].T
    last = np.cos(angle) * first + np.sin(angle) * side
    share = np.array([0.0, 0.1, 0.5, 0.75, 1.0])
    found = turned(np.array([first, last]), share)
    expected = np.outer(np.cos(share * angle), first) + np.outer(np.sin(share * angle), side)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert np.isnan(turned(np.array([first, -first]), share)[1:-1]).all()


def test_a_direction_beside_an_unknown_one_is_unknown_and_itself_known():
    directions = np.array([[0.0, 0.0, 1.0], [np.nan] * 3])
    assert np.isfinite(turned(directions, np.array([0.0, 0.5, 1.0]))).all(axis=1).tolist() == [
        True,
        False,
        False,
    ]
