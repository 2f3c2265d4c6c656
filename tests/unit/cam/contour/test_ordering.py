from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from fiveaxis.cam import plan_contour
from fiveaxis.cam.contour.ordering import Links, by_levels, in_order, islands, shortened
from fiveaxis.cam.contour.passes import Pass, neighbours
from fiveaxis.model import Tool, Toolpath

# mm, largest distance of neighbouring passes of levels 1 mm apart.
FARTHEST = 6.0


def straight(start: list[float], end: list[float], normal: tuple[float, ...] = (1.0, 0.0, 0.0)) -> Pass:
    points = np.linspace(start, end, 11)
    normals = np.tile(normal, (11, 1))
    return Pass(points, normals, normals, np.zeros(11, dtype=bool), closed=False, radius=3.0)


def link_length(path: Toolpath) -> float:
    return float(path.lengths[~path.cutting].sum())


def test_passes_above_each_other_are_neighbours_and_others_are_not():
    upper = [straight([0, 0, 1], [0, 5, 1]), straight([0, 20, 1], [0, 25, 1])]
    lower = [straight([0, 2, 0], [0, 7, 0]), straight([0, 40, 0], [0, 45, 0])]
    assert neighbours(upper, lower, FARTHEST) == {(0, 0)}


def test_the_two_sides_of_a_blade_are_no_neighbours():
    front, back = straight([0, 0, 1], [0, 5, 1]), straight([-1, 0, 0], [-1, 5, 0], (-1.0, 0.0, 0.0))
    assert neighbours([front], [back], FARTHEST) == set()


def test_levels_are_cut_one_after_the_other():
    levels = [[straight([0, y, -z], [0, y + 5, -z]) for y in (0, 20)] for z in range(3)]
    queue = by_levels(levels)
    heights = []
    here = np.zeros(3)
    while queue:
        found = queue.take(here)
        here = found.centres[-1]
        heights.append(here[2])
    assert heights == [0, 0, -1, -1, -2, -2]


def test_an_island_goes_on_below_a_pass_as_soon_as_that_is_done():
    levels = [[straight([0, y, -z], [0, y + 5, -z]) for y in (0, 40)] for z in range(3)]
    passes, below = islands(levels, [FARTHEST, FARTHEST])
    assert below == [[2], [3], [4], [5], [], []]
    assert [passes[k] is levels[k // 2][k % 2] for k in range(6)] == [True] * 6


def test_a_given_order_is_kept_and_missing_passes_come_last():
    passes = [straight([0, y, 0], [0, y + 5, 0]) for y in range(4)]
    queue = in_order(passes, [2, 0])
    while queue:
        queue.take(np.zeros(3))
    assert queue.taken == [2, 0, 1, 3]


def test_an_open_pass_is_reversed_only_if_allowed():
    end = np.array([3.0, 5.0, 0.0])
    for reversible, first in ((False, 0.0), (True, 5.0)):
        queue = by_levels([[straight([0, 0, 0], [0, 5, 0])]], reversible=reversible)
        assert queue.take(end).points[0, 1] == first


@given(seed=st.integers(0, 10_000), count=st.integers(1, 12))
def test_a_shortened_order_is_a_valid_order_and_no_longer(seed, count):
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.0, 10.0, (count, count))
    below = [[j for j in range(k + 1, count) if rng.random() < 0.15] for k in range(count)]
    links = Links(length.copy(), lambda a, b: float(length[a, b]))
    order = shortened(range(count), links, below)
    assert sorted(order) == list(range(count))
    assert all(order.index(k) < order.index(j) for k in range(count) for j in below[k])
    assert sum(length[k] for k in pairwise(order)) <= sum(length[k] for k in pairwise(range(count))) + 1e-9


def test_an_order_is_shortened_by_true_lengths_where_lower_bounds_promise_too_much():
    true = np.full((3, 3), 5.0)
    links = Links(np.zeros((3, 3)), lambda a, b: float(true[a, b]))
    assert shortened([0, 1, 2], links, [[], [], []]) == [0, 1, 2]


def test_two_towers_are_cut_one_after_the_other():
    true = np.abs(np.subtract.outer(np.array([0.0, 50.0] * 3), np.array([0.0, 50.0] * 3)))
    links = Links(true.copy(), lambda a, b: float(true[a, b]))
    below = [[2], [3], [4], [5], [], []]
    assert shortened(range(6), links, below) in ([0, 2, 4, 1, 3, 5], [1, 3, 5, 0, 2, 4])


def test_islands_shorten_the_links_between_posts():
    posts = [trimesh.creation.cylinder(radius=5.0, height=10.0, sections=64) for _ in range(3)]
    for k, post in enumerate(posts):
        post.apply_translation([30.0 * k, 0.0, 0.0])
    part = trimesh.util.concatenate(posts)
    levels = plan_contour(part, Tool.ball(4), stepdown=2.0)
    sorted_ = plan_contour(part, Tool.ball(4), stepdown=2.0, order="islands")
    assert link_length(sorted_) < 0.5 * link_length(levels)
    assert sorted_.cutting.sum() == pytest.approx(levels.cutting.sum(), abs=20)
    for k in range(3):
        own = np.abs(sorted_.contact[:, 0] - 30.0 * k) < 10.0
        assert np.all(np.diff(sorted_.contact[own, 2]) <= 0.0)


@pytest.mark.slow
def test_islands_shorten_the_links_of_the_propeller(data):
    part = data / "meshes" / "propeller_d.stl"
    levels = plan_contour(part, Tool.ball(4), stepdown=2.0)
    for direction in ("climb", "zigzag"):
        sorted_ = plan_contour(part, Tool.ball(4), stepdown=2.0, order="islands", direction=direction)
        assert link_length(sorted_) < 0.8 * link_length(levels)
