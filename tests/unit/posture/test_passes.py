"""Starts of closed passes: found, chosen as by brute force, and never to a solution's cost."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fiveaxis.errors import SettingError
from fiveaxis.posture import Problem, optimise
from fiveaxis.posture import passes as module
from fiveaxis.posture.passes import Ring, choose_starts, find_rings, reopened, reordered, unwound
from fiveaxis.toolpath import MoveKind, Tool, Toolpath, tilt_bounds


def rings(count: int = 3, n: int = 40, step: float = 8.0, lobes: float = 4.0) -> Toolpath:
    """Closed rings round a lobed wall, one below the other, each leading straight to the next."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    r = 20.0 + lobes * np.cos(3.0 * angle + 0.5)
    one = np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros(n)], axis=1)
    flat = np.sqrt(1.0 - 0.3**2)
    normal = np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(n, -0.3)], axis=1)
    contact = np.concatenate(
        [one * [1.0 - 0.1 * k, 1.0 - 0.1 * k, 1.0] - [0, 0, step * k] for k in range(count)]
    )
    return Toolpath.from_contacts(contact, np.tile(normal, (count, 1)), Tool.ball(6), feed_mm_min=600.0)


def problem_of(path: Toolpath, machine) -> Problem:
    return Problem.build(path, machine, tilt_bounds(path, tilt=(5, 85)))


def test_rings_are_found_where_the_steps_are_longer():
    assert find_rings(rings()) == [Ring(0, 39, True), Ring(40, 79, True), Ring(80, 119, True)]


def test_a_run_that_does_not_return_is_open():
    path = rings().at(np.arange(70))
    assert find_rings(path) == [Ring(0, 39, True), Ring(40, 69, False)]
    assert find_rings(path)[1].starts().tolist() == [40]


def test_turns_close_above_each_other_are_no_ring_and_keep_their_order(hayashi):
    path = rings(count=6, step=0.5)
    assert not any(ring.closed for ring in find_rings(path))
    solution = optimise(path, hayashi, tilt=(15, 75), effort="quick", free_start=True)
    np.testing.assert_array_equal(solution.toolpath.contact, path.contact)


def test_a_ring_that_ends_on_its_first_point_leaves_no_piece_uncut(hayashi):
    path = rings(count=1)
    closed = path.at(np.append(np.arange(40), 0))
    assert not find_rings(closed)[0].closed
    solution = optimise(closed, hayashi, tilt=(15, 75), effort="quick", free_start=True)
    assert solution.toolpath.lengths.sum() == pytest.approx(closed.lengths.sum())


def test_a_ring_from_another_start_has_all_its_rows_in_order():
    ring = Ring(10, 15, True)
    assert ring.from_start(13).tolist() == [13, 14, 15, 10, 11, 12]
    assert ring.end(np.array([10, 13])).tolist() == [15, 12]


@pytest.mark.parametrize("seed", range(4))
def test_starts_are_chosen_as_by_brute_force(hayashi, monkeypatch, seed):
    monkeypatch.setattr(module, "LONGER", 1e9)
    path = rings(n=7)
    found = [Ring(0, 6, True), Ring(7, 13, True), Ring(14, 20, True)]
    random = np.random.default_rng(seed)
    angle = np.tile(np.linspace(0.0, 2.0 * np.pi, 7, endpoint=False), 3) - np.pi / 2.0
    rotary = np.stack([angle, np.full(21, -1.0)], axis=1) + random.normal(0.0, 0.2, (21, 2))

    def cost(starts):
        rows = reordered(found, starts)
        moved = problem_of(reopened(path, found, rows), hayashi)
        return moved.cost(moved.positions(slice(None), unwound(moved, rotary[rows])))

    every = itertools.product(*(ring.starts().tolist() for ring in found))
    least = min(cost(list(starts)) for starts in every)
    assert cost(choose_starts(problem_of(path, hayashi), found, rotary)) == pytest.approx(least, rel=1e-9)


def test_the_way_between_passes_stays_short(hayashi):
    path = rings()
    found = find_rings(path)
    rotary = np.random.default_rng(1).normal(0.0, 0.5, (len(path), 2))
    rows = reordered(found, choose_starts(problem_of(path, hayashi), found, rotary))
    moved = path.at(rows).lengths[[40, 80]]
    assert moved.max() <= 1.3 * path.lengths[[40, 80]].max()


def test_the_move_to_a_ring_keeps_its_feed_wherever_the_ring_begins():
    path = rings()
    feed = path.feed.copy()
    feed[[0, 40, 80]] = [1.0, 2.0, 3.0]
    found = find_rings(path)
    rows = reordered(found, [5, 45, 80])
    moved = reopened(replace(path, feed=feed), found, rows)
    assert moved.feed[[0, 40, 80]].tolist() == [1.0, 2.0, 3.0]
    assert np.delete(moved.feed, [0, 40, 80]).tolist() == [10.0] * 117
    np.testing.assert_array_equal(np.sort(moved.source), path.source)


def test_a_free_start_is_cheaper_and_says_what_it_did(hayashi):
    path = rings()
    bound = optimise(path, hayashi, tilt=(15, 75), effort="quick")
    free = optimise(path, hayashi, tilt=(15, 75), effort="quick", free_start=True)
    [told] = [f for f in free.toolpath.findings if f.code == "free-start"]
    assert free.energy.total < bound.energy.total
    assert free.residuals()["tilt"] <= 1e-9
    assert free.residuals()["contact"] <= 1e-9
    assert "begin elsewhere, which saves" in told.message
    assert all(b.toolpath is not None for b in free.compared.values())
    np.testing.assert_array_equal(np.sort(free.toolpath.source), path.source)


def test_passes_reached_by_links_keep_their_start_and_say_why(hayashi):
    path = rings()
    path = replace(path, kind=np.where(np.arange(len(path)) == 40, MoveKind.LINK, path.kind))
    found = optimise(path, hayashi, tilt=(15, 75), effort="quick", free_start=True)
    [told] = [f for f in found.toolpath.findings if f.code == "free-start"]
    assert "an approach of its own" in told.message
    np.testing.assert_array_equal(found.toolpath.source, path.source)


def test_a_free_start_and_a_singular_cone_are_refused_together(hayashi):
    with pytest.raises(SettingError, match="can't be combined"):
        optimise(rings(), hayashi, tilt=(15, 75), free_start=True, singular_cone=5)


@pytest.mark.slow
def test_the_vase_gets_cheaper_with_a_free_start(hayashi, vase):
    bound = optimise(vase, hayashi, tilt=(15, 75), effort="quick")
    free = optimise(vase, hayashi, tilt=(15, 75), effort="quick", free_start=True)
    assert free.energy.total < bound.energy.total - 10.0
    assert free.energy.total <= 7412.0
