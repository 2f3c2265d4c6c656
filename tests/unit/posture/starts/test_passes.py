"""Starts of closed passes: found, chosen as by brute force, and never more expensive."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds
from by_travel import optimise

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.machine import Limits
from fiveaxis.posture import Problem
from fiveaxis.posture.starts import passes as start_points
from fiveaxis.posture.starts.passes import Transitions, choose_openings
from fiveaxis.posture.starts.rings import Layout, Opening, Ring, find_rings, known_rings, reopen, unwrap
from fiveaxis.toolpath import MoveKind, Tool, Toolpath
from fiveaxis.toolpath.passes import Passes

ABOVE = 30.0


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


def closed_rings(path: Toolpath, count: int) -> Toolpath:
    """The same rings, each coming to its first location again."""
    n = len(path) // count
    return path.at(np.concatenate([[*range(k * n, (k + 1) * n), k * n] for k in range(count)]))


def straight_up(leaving, arriving):
    """Link over a plane: up, across, down."""
    ends = [end.pivot for end in (leaving, arriving) if end is not None]
    return np.array([[x, y, ABOVE] for x, y, _ in ends])


def linked(count: int = 3, n: int = 24) -> tuple[Toolpath, Passes]:
    """Rings that come to their first location again, with links between them, before and behind."""
    path = closed_rings(rings(count, n), count)
    first = np.arange(count) * (n + 1)
    up = replace(path, pivot=path.pivot * [1.0, 1.0, 0.0] + [0.0, 0.0, ABOVE])
    up = up.with_links(np.ones(len(up), dtype=bool))
    both = replace(
        path,
        **{
            c: np.concatenate([getattr(path, c), getattr(up, c)])
            for c in ("pivot", "contact", "normal", "axis", "feed", "kind", "source")
        },
    )
    parts = [[len(path) + a, *range(a, a + n + 1), len(path) + a + n] for a in first.tolist()]
    made = both.at(np.concatenate(parts))
    begins = np.arange(count) * (n + 3) + 1
    made = replace(made, source=np.arange(1, len(made) + 1))
    return made, Passes(begins, begins + n, len(made), straight_up)


def layout_of(path: Toolpath, passes: Passes | None = None) -> Layout:
    if passes is None:
        return Layout(path, find_rings(path), None)
    return Layout(path, known_rings(path, passes), passes.relink)


def steps_cut(path: Toolpath) -> list[tuple[tuple[float, ...], ...]]:
    """Each cut step as its two contacts, in either direction."""
    touching = np.isfinite(path.contact).all(axis=1)
    rows = np.flatnonzero(touching[1:] & touching[:-1] & path.cutting[1:]) + 1
    ends = np.round(np.stack([path.contact[rows - 1], path.contact[rows]], axis=1), 9) + 0.0
    return sorted(tuple(sorted(map(tuple, pair.tolist()))) for pair in ends)


def free_start_message(solution) -> str:
    [finding] = [f for f in solution.toolpath.findings if f.code == "free-start"]
    return finding.message


def test_rings_are_found_where_the_steps_are_longer():
    assert find_rings(rings()) == [Ring(0, 39, True), Ring(40, 79, True), Ring(80, 119, True)]


def test_rings_that_come_to_their_first_location_again_are_found_as_such():
    path = closed_rings(rings(), 3)
    assert find_rings(path) == [Ring(0, 40, True, True), Ring(41, 81, True, True), Ring(82, 122, True, True)]


def test_a_run_that_does_not_return_is_open():
    path = rings().at(np.arange(70))
    assert find_rings(path) == [Ring(0, 39, True), Ring(40, 69, False)]
    assert find_rings(path)[1].openings(path.cutting, most=72, both=True) == [Opening(40)]


def test_a_run_whose_ends_nearly_meet_is_left_alone():
    path = rings(count=1)
    ends = path.at(np.append(np.arange(40), 0))
    nudged = ends.contact + np.where(np.arange(41)[:, None] == 40, 0.01, 0.0)
    near = Toolpath.from_contacts(nudged, ends.normal, path.tool)
    assert find_rings(near) == [Ring(0, 40, False)]


def test_turns_close_above_each_other_are_no_ring_and_keep_their_order(hayashi):
    path = rings(count=6, step=0.5)
    assert not any(ring.closed for ring in find_rings(path))
    solution = optimise(path, hayashi, tilt=(15, 75), free_start=True)
    np.testing.assert_array_equal(given(solution).contact, path.contact)


@pytest.mark.parametrize(
    ("ring", "opening", "rows", "moves"),
    [
        (Ring(10, 15, True), Opening(13), [13, 14, 15, 10, 11, 12], [10, 14, 15, 11, 11, 12]),
        (Ring(10, 15, True), Opening(10, True), [10, 15, 14, 13, 12, 11], [10, 11, 15, 14, 13, 12]),
        (Ring(10, 15, True), Opening(12, True), [12, 11, 10, 15, 14, 13], [10, 12, 11, 11, 15, 14]),
        (Ring(10, 14, True, True), Opening(10), [10, 11, 12, 13, 14], [10, 11, 12, 13, 14]),
        (Ring(10, 14, True, True), Opening(12), [12, 13, 14, 11, 12], [10, 13, 14, 11, 12]),
        (Ring(10, 14, True, True), Opening(10, True), [14, 13, 12, 11, 10], [10, 14, 13, 12, 11]),
        (Ring(10, 14, True, True), Opening(12, True), [12, 11, 14, 13, 12], [10, 12, 11, 14, 13]),
    ],
)
def test_a_ring_from_another_start_has_its_rows_in_order_and_each_move_its_feed(ring, opening, rows, moves):
    assert ring.rows(opening).tolist() == rows
    assert ring.moves(opening).tolist() == moves


@pytest.mark.parametrize(("seed", "both"), [(0, False), (1, True)])
def test_openings_are_chosen_as_by_brute_force(hayashi, monkeypatch, seed, both):
    monkeypatch.setattr(start_points, "LONGER", 1e9)
    path = rings(n=5)
    layout = Layout(path, [Ring(0, 4, True), Ring(5, 9, True), Ring(10, 14, True)], None)
    random = np.random.default_rng(seed)
    angle = np.tile(np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False), 3) - np.pi / 2.0
    rotary = np.stack([angle, np.full(15, -1.0)], axis=1) + random.normal(0.0, 0.2, (15, 2))

    def cost(openings):
        found = reopen(layout, openings)
        moved = Problem.build(found.toolpath, hayashi, tilt_bounds(found.toolpath, tilt=(5, 85)))
        return moved.cost(moved.positions(slice(None), found.start(moved, rotary)))

    choices = [ring.openings(path.cutting, most=9, both=both) for ring in layout.rings]
    least = min(cost(list(openings)) for openings in itertools.product(*choices))
    problem = Problem.build(path, hayashi, tilt_bounds(path, tilt=(5, 85)))
    assert cost(choose_openings(Transitions(problem, layout, rotary), choices)) == pytest.approx(
        least, rel=1e-9
    )


@pytest.mark.parametrize("seed", range(2))
def test_openings_between_links_are_chosen_as_by_brute_force(hayashi, seed):
    path, passes = linked(count=3, n=5)
    layout = layout_of(path, passes)
    rotary = np.random.default_rng(seed).normal(0.0, 0.5, (len(path), 2))
    priced = Transitions(Problem.build(path, hayashi, tilt_bounds(path, tilt=(5, 85))), layout, rotary)
    choices = [ring.openings(path.cutting, most=9) for ring in layout.rings]

    def cost(openings):
        found = reopen(layout, openings)
        here, rows = Problem.build(found.toolpath, hayashi, tilt_bounds(found.toolpath, tilt=(5, 85))), []
        angles, air = rotary[found.rows], found.toolpath.kind == MoveKind.LINK
        known = np.flatnonzero(~air)
        for row in np.flatnonzero(air).tolist():
            near = (
                known[np.searchsorted(known, row) + np.array([-1, 0])[: len(known)]]
                if (known[0] < row < known[-1])
                else known[[0, 0] if row < known[0] else [-1, -1]]
            )
            at = np.cumsum(found.toolpath.lengths)[[near[0], row, near[1]]]
            share = (at[1] - at[0]) / (at[2] - at[0]) if near[0] != near[1] else 0.0
            a, b = angles[near[0]], angles[near[1]]
            rows.append((row, a + share * (np.remainder(b - a + np.pi, 2.0 * np.pi) - np.pi)))
        for row, angle in rows:
            angles[row] = angle
        steps = np.diff(here.positions(slice(None), angles), axis=0)
        turned = steps[:, hayashi.rotary_columns]
        steps[:, hayashi.rotary_columns] = np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi
        links = air[1:] | air[:-1]
        travel = here.plus * np.maximum(steps, 0.0) - here.minus * np.minimum(steps, 0.0)
        return float(travel[links].sum())

    least = min(cost(list(openings)) for openings in itertools.product(*choices))
    assert cost(choose_openings(priced, choices)) == pytest.approx(least, rel=1e-9)


def test_the_step_between_passes_stays_short(hayashi):
    path = rings()
    layout = layout_of(path)
    rotary = np.random.default_rng(1).normal(0.0, 0.5, (len(path), 2))
    problem = Problem.build(path, hayashi, tilt_bounds(path, tilt=(5, 85)))
    choices = [ring.openings(path.cutting, most=72) for ring in layout.rings]
    moved = reopen(layout, choose_openings(Transitions(problem, layout, rotary), choices)).toolpath
    assert moved.lengths[[40, 80]].max() <= 1.3 * path.lengths[[40, 80]].max()


def test_the_move_to_a_ring_keeps_its_feed_wherever_the_ring_begins():
    path = rings()
    feed = path.feed.copy()
    feed[[0, 40, 80]] = [1.0, 2.0, 3.0]
    layout = layout_of(replace(path, feed=feed))
    moved = reopen(layout, [Opening(5), Opening(45, True), Opening(80)]).toolpath
    assert moved.feed[[0, 40, 80]].tolist() == [1.0, 2.0, 3.0]
    assert np.delete(moved.feed, [0, 40, 80]).tolist() == [10.0] * 117
    np.testing.assert_array_equal(np.sort(moved.source), path.source)


@pytest.mark.parametrize("seed", range(8))
def test_a_reopened_path_drops_no_step_and_cuts_none_twice(seed):
    random = np.random.default_rng(seed)
    path, passes = linked(count=int(random.integers(1, 5)), n=int(random.integers(5, 12)))
    layout = layout_of(path, passes)
    choices = [ring.openings(path.cutting, most=99, both=True) for ring in layout.rings]
    found = reopen(layout, [choice[random.integers(len(choice))] for choice in choices])
    moved = found.toolpath
    assert steps_cut(moved) == steps_cut(path)
    assert moved.source.tolist() == list(range(1, len(moved) + 1))
    air = moved.kind == MoveKind.LINK
    assert np.isnan(moved.normal[air]).all()
    assert np.isfinite(moved.normal[~air]).all()
    np.testing.assert_allclose(moved.pivot[~air], moved.contact[~air] + 3.0 * moved.normal[~air], atol=1e-12)
    assert [(r.first, r.last, r.again) for r in found.rings] == [
        (r.first, r.last, r.again)
        for r in known_rings(
            moved,
            Passes(
                np.array([r.first for r in found.rings]),
                np.array([r.last for r in found.rings]),
                len(moved),
                straight_up,
            ),
        )
    ]


@pytest.mark.parametrize("seed", range(4))
def test_rings_without_a_repeat_keep_every_contact_in_any_opening(seed):
    random = np.random.default_rng(seed)
    path = rings()
    layout = layout_of(path)
    openings = [
        Opening(int(random.integers(r.first, r.last + 1)), bool(random.integers(2))) for r in layout.rings
    ]
    moved = reopen(layout, openings).toolpath
    assert sorted(map(tuple, moved.contact.tolist())) == sorted(map(tuple, path.contact.tolist()))
    for ring in layout.rings:
        assert set(moved.source[ring.first : ring.last + 1]) == set(path.source[ring.first : ring.last + 1])


def test_own_openings_give_the_path_back():
    path, passes = linked()
    layout = layout_of(path, passes)
    same = reopen(layout, [ring.own for ring in layout.rings])
    for name in ("pivot", "contact", "normal", "axis", "feed", "kind", "source"):
        np.testing.assert_array_equal(getattr(same.toolpath, name), getattr(path, name))


def test_angles_within_limits_keep_their_turn_along_a_pass():
    angles = np.radians([350.0, 355.0, 0.0, 5.0, 10.0])
    runs = [np.arange(2), np.arange(2, 5)]
    free = unwrap(angles, runs, Limits(-np.inf, np.inf))
    np.testing.assert_allclose(np.degrees(free), [350.0, 355.0, 360.0, 365.0, 370.0])
    held = unwrap(
        np.radians([-5.0, 355.0, 0.0, 5.0, 370.0]), runs, Limits(np.radians(-20.0), np.radians(360.0))
    )
    np.testing.assert_allclose(np.degrees(held), [-5.0, -5.0, 0.0, 5.0, 10.0])


def test_a_free_start_is_cheaper_and_has_a_finding(hayashi):
    path = rings()
    bound = optimise(path, hayashi, tilt=(15, 75))
    free = optimise(path, hayashi, tilt=(15, 75), free_start=True)
    assert free.energy.travel <= bound.energy.travel
    assert free.residuals()["tilt"] <= 1e-9
    assert free.residuals()["contact"] <= 1e-9
    assert "begin elsewhere, which saves" in free_start_message(free)
    assert all(b.toolpath is not None for b in free.compared.values())
    np.testing.assert_array_equal(np.sort(given(free).source), path.source)


def test_rings_that_come_to_their_first_location_again_are_cut_whole_from_another_start(hayashi):
    turned = rings().at(np.concatenate([np.arange(40), np.roll(np.arange(40, 80), 13), np.arange(80, 120)]))
    path = closed_rings(turned, 3)
    bound = optimise(path, hayashi, tilt=(15, 75))
    free = optimise(path, hayashi, tilt=(15, 75), free_start=True)
    assert free.energy.travel <= bound.energy.travel
    assert "begin elsewhere" in free_start_message(free)
    for first in (0, 41, 82):
        rows = np.arange(first, first + 41)
        assert steps_cut(given(free).at(rows)) == steps_cut(path.at(rows))


def test_passes_reached_by_links_keep_their_start_and_the_finding_says_why(hayashi):
    path, _ = linked()
    found = optimise(path, hayashi, tilt=(15, 75), free_start=True)
    assert free_start_message(found).startswith("3 keep their start: they are reached or left by links")
    np.testing.assert_array_equal(given(found).pivot, path.pivot)


def test_a_pass_between_two_that_it_joins_is_free_though_links_bind_those(hayashi):
    path = rings(count=4)
    kind = np.where(np.isin(np.arange(len(path)), [0, 159]), MoveKind.LINK, path.kind)
    layout = layout_of(replace(path, kind=kind))
    assert [ring.closed for ring in layout.rings] == [True, True, True, False]
    cut = replace(path, kind=np.where(np.arange(len(path)) == 40, MoveKind.LINK, path.kind))
    found = optimise(cut, hayashi, tilt=(15, 75), free_start=True)
    moved = given(found)
    # The first ring is left by the link, and the second, whose first location ends it, is reached by it.
    np.testing.assert_array_equal(moved.source[:80], path.source[:80])


def given(solution):
    """The path without the locations that the program needs between."""
    return solution.toolpath.at(np.flatnonzero(~solution.toolpath.inserted))


def test_linked_passes_of_a_plan_begin_where_it_is_cheaper_and_stay_whole_in_either_direction(hayashi):
    path, passes = linked()
    bound, free, both = (
        optimise(path, hayashi, tilt=(15, 75), **options)
        for options in (
            {},
            {"free_start": True, "passes": passes},
            {"free_start": True, "passes": passes, "free_direction": True},
        )
    )
    assert both.energy.travel <= free.energy.travel <= bound.energy.travel
    for solution in (free, both):
        assert steps_cut(given(solution)) == steps_cut(path)
        assert solution.residuals()["tilt"] <= 1e-9
    assert "of 3 closed passes begin" in free_start_message(free)


def test_open_passes_stay_as_they_are(hayashi):
    path, passes = linked(count=2)
    half = path.at(np.array([*range(14), *range(27, len(path))]))
    known = Passes(np.array([1, 15]), np.array([13, 39]), len(half), passes.relink)
    assert [ring.closed for ring in known_rings(half, known)] == [False, True]
    found = optimise(half, hayashi, tilt=(15, 75), free_start=True, passes=known)
    np.testing.assert_array_equal(given(found).contact[1:14], half.contact[1:14])
    assert "of 1 closed passes" in free_start_message(found)


def test_passes_of_another_path_are_refused(hayashi):
    path, passes = linked()
    fewer = path.at(np.arange(len(path) - 1))
    with pytest.raises(SettingError, match="planned with it"):
        optimise(fewer, hayashi, tilt=(15, 75), free_start=True, passes=passes)


def test_passes_out_of_order_are_refused():
    with pytest.raises(ToolpathError, match="before the one before it ends"):
        Passes(np.array([0, 3]), np.array([4, 8]), 9, straight_up)
    with pytest.raises(ToolpathError, match="ends before it begins"):
        Passes(np.array([4]), np.array([2]), 9, straight_up)
    with pytest.raises(ToolpathError, match="row 9 of 9"):
        Passes(np.array([4]), np.array([9]), 9, straight_up)


def test_a_free_direction_without_a_free_start_is_refused(hayashi):
    with pytest.raises(SettingError, match="goes with free_start"):
        optimise(rings(), hayashi, tilt=(15, 75), free_direction=True)


def test_a_free_start_and_a_singular_cone_are_refused_together(hayashi):
    with pytest.raises(SettingError, match="can't be combined"):
        optimise(rings(), hayashi, tilt=(15, 75), free_start=True, singular_cone=5)


@pytest.mark.slow
def test_the_vase_gets_cheaper_with_a_free_start(hayashi, vase):
    bound = optimise(vase, hayashi, tilt=(15, 75))
    free = optimise(vase, hayashi, tilt=(15, 75), free_start=True)
    assert free.energy.travel < bound.energy.travel - 5.0
