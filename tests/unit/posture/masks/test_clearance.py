"""Approximate answers of a mask for searches: its nodes, or its own rough map."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from by_degrees import tilt_bounds
from corridors import general_path

from fiveaxis.machine import Limits, load_machine
from fiveaxis.posture.masks.clearance import NODE_STEP, NODE_STRIDE, Clearance, NodeMap, Nodes
from fiveaxis.posture.masks.mask import CheckedStates, Mask, clean_path
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.corridor import REFUSED_PRICE, Corridor, path_through_corridor
from fiveaxis.posture.search.lattice import Coordinates, Lattice, level_lattice
from fiveaxis.posture.search.shortest import shortest_path
from fiveaxis.toolpath import Tool, Toolpath

SPIN = 4  # column of C


class Mapped:
    """A mask with a rough map that refuses more than it does."""

    def __init__(self) -> None:
        self.exactly, self.roughly = 0, 0

    def __call__(self, rows, rotary):
        self.exactly += len(rows)
        return rotary[:, 0] < 1.0

    def rough(self, rows, rotary):
        self.roughly += len(rows)
        return rotary[:, 0] < 0.5


def problem_of(n: int, **options) -> Problem:
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    normal = np.stack([0.8 * np.cos(angle), 0.8 * np.sin(angle), np.full(n, -0.6)], axis=1)
    contact = np.stack([20 * np.cos(angle), 15 * np.sin(angle), np.full(n, 10.0)], axis=1)
    path = Toolpath.from_contacts(contact, normal, Tool.ball(6))
    return Problem.build(path, load_machine("hayashi-640123"), tilt_bounds(path, (15, 75)), **options)


def postures(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.stack([rng.uniform(-20.0, 20.0, n), rng.uniform(-2.0, 0.5, n)], axis=1)


def test_a_posture_has_the_answer_of_the_nearest_node_which_is_queried_once():
    def function(rows, rotary):
        return np.sin(3.0 * rotary[:, 0]) + rotary[:, 1] < 0.1 * rows - 1.0

    mask, rng = Mask(function), np.random.default_rng(0)
    nodes = NodeMap.of(mask, problem_of(30))
    rows, rotary = rng.integers(0, 30, 500), postures(rng, 500)
    got = nodes.admits(rows, rotary)
    at = nodes.rows[np.abs(nodes.rows[None] - rows[:, None]).argmin(axis=1)]
    near = [n.first + n.step * n.nearest(rotary[:, i]) for i, n in enumerate(nodes.nodes)]
    np.testing.assert_array_equal(got, function(at, np.stack(near, axis=1)))
    queried = mask.queried
    assert queried <= 500
    np.testing.assert_array_equal(nodes.admits(rows, rotary), got)
    assert mask.queried == queried


def test_the_order_of_queries_changes_no_answer():
    rng = np.random.default_rng(1)
    rows, rotary, order = rng.integers(0, 30, 300), postures(rng, 300), rng.permutation(300)

    def function(rows, rotary):
        return np.cos(5.0 * rotary[:, 0]) > rotary[:, 1]

    forwards = NodeMap.of(Mask(function), problem_of(30)).admits(rows, rotary)
    shuffled = NodeMap.of(Mask(function), problem_of(30))
    parts = [shuffled.admits(rows[part], rotary[part]) for part in np.array_split(order, 7)]
    np.testing.assert_array_equal(np.concatenate(parts), forwards[order])


@pytest.mark.parametrize("limits", [Limits(-2.1, 0.5), Limits(-np.inf, np.inf), Limits(0.7, 0.7)])
def test_every_angle_lies_near_a_node_on_some_turn(limits):
    nodes = Nodes.of(limits)
    angle = np.linspace(max(limits.low, -9.0), min(limits.high, 9.0), 300)
    off = angle - nodes.first - nodes.step * nodes.nearest(angle)
    if nodes.period:
        off = np.mod(off + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(off).max() <= NODE_STEP / 2.0 + 1e-9


def test_a_location_between_nodes_has_the_answer_of_the_nearest():
    mask = Mask(lambda rows, rotary: rows == NODE_STRIDE)
    got = NodeMap.of(mask, problem_of(3 * NODE_STRIDE)).admits(
        np.arange(3 * NODE_STRIDE), np.zeros((3 * NODE_STRIDE, 2))
    )
    half = NODE_STRIDE // 2
    assert np.flatnonzero(got).tolist() == list(range(half + 1, NODE_STRIDE + half + 1))


def test_the_masks_own_rough_map_replaces_the_nodes():
    function = Mapped()
    clear = Clearance.of(Mask(function), problem_of(30)).at(np.array([5, 7]))
    rotary = np.array([[0.4, 0.0], [0.7, 0.0]])
    assert clear.roughly(np.array([0, 1]), rotary).tolist() == [True, False]
    assert (function.exactly, function.roughly) == (0, 2)
    assert clear.exactly(np.array([0, 1]), rotary).tolist() == [True, True]


def test_roughly_refused_states_of_a_lattice_have_the_price():
    states = np.zeros((2, 3, 1, 1, 5))
    states[..., SPIN] = np.array([0.0, 0.7, 2.0])[None, :, None, None]
    lattice = Lattice(lambda rows: (states[rows], np.zeros((len(rows), 3, 1, 1))), SPIN, 0.0, (3, 1))
    clear = Clearance.of(Mask(Mapped()), problem_of(30)).at(np.array([0, 12]))
    _, price = clear.priced(lattice, [SPIN, 3], np.inf).states(np.arange(2))
    assert np.isfinite(price[:, :, 0, 0]).tolist() == [[True, False, False]] * 2


def masked_lattice(rng: np.random.Generator, n: int) -> tuple[Lattice, np.ndarray]:
    """States with random linear and A values on a regular grid of C, and which of them a mask refuses."""
    shape = (4, 3, 1)
    states = rng.uniform(-3.0, 3.0, (n, *shape, 5))
    states[..., SPIN] = np.linspace(-np.pi, np.pi, 4, endpoint=False)[None, :, None, None]
    refused = rng.random((n, *shape)) < 0.4
    prices = np.where(rng.random((n, *shape)) < 0.1, np.inf, 0.0)
    return Lattice(
        lambda rows: (states[rows], prices[rows]), SPIN, 0.0, shape[:2], turns_forbidden=True
    ), refused


@pytest.mark.parametrize("seed", range(12))
def test_the_cheapest_clean_path_is_that_of_brute_force(seed):
    n = 3
    problem = problem_of(n, max_turn=2.5)
    lattice, refused = masked_lattice(np.random.default_rng(seed), n)
    states, price = (part.reshape(n, 12, -1) for part in lattice.states(np.arange(n)))
    columns = problem.machine.rotary_columns

    def function(rows, rotary):
        same = np.abs(states[rows][..., columns] - rotary[:, None]).max(axis=-1) < 1e-12
        return ~refused.reshape(n, 12)[rows, same.argmax(axis=1)]

    best = np.inf
    for chosen in itertools.product(range(12), repeat=n):
        rows = np.arange(n)
        if np.isinf(price[rows, chosen]).any() or refused.reshape(n, 12)[rows, chosen].any():
            continue
        path = states[rows, chosen]
        if problem.turn_excess(path[:, columns]).max() == 0.0:
            best = min(best, problem.cost(path))
    for or_last in (False, True):
        checked = CheckedStates(Mask(function), np.arange(n), problem)
        path = clean_path(lattice, checked, 40, or_last=or_last)
        clear = replace(
            lattice,
            states=lambda rows: (
                lattice.states(rows)[0],
                np.where(refused[rows], np.inf, lattice.states(rows)[1]),
            ),
        )
        again = shortest_path(problem, clear)
        if np.isinf(best):
            assert again is None
            assert path is None or not function(np.arange(n), path[:, columns]).all()
        else:
            assert problem.cost(path) == pytest.approx(best, rel=1e-12)
            assert problem.cost(again) == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("coordinates", [Coordinates(0, 2), Coordinates(0, None), Coordinates(1, None)])
def test_the_compiled_corridor_off_a_mask_holds_the_path_of_the_general_one(coordinates):
    n = 60
    problem = problem_of(n, max_turn=0.4)
    columns = problem.machine.rotary_columns
    middle = level_lattice(problem, Coordinates(0, 2), np.radians(5.0), 30, (np.pi, 3))
    near = shortest_path(problem, middle)
    spin = columns[coordinates.spin]
    second = near[:, coordinates.second_column(problem)]
    corridor = Corridor(problem, coordinates, near[:, [spin]], second, (0.02, 0.05), 2)

    def rough(rows, rotary):
        return np.sin(40.0 * rotary[:, 0] + rows) < 0.3

    mask = Mask(rough)
    clear = Clearance(mask, NodeMap.of(mask, problem), np.arange(n))
    found = path_through_corridor(corridor, Roughly(rough))

    def refused(rows, postures):
        at = np.repeat(rows, postures[0, ..., 0].size)
        return REFUSED_PRICE * ~rough(at, postures.reshape(-1, 2)).reshape(postures.shape[:-1])

    expected = general_path(corridor, refused)

    def priced(path):
        return (
            problem.priced(path[:, columns]) + REFUSED_PRICE * (~rough(np.arange(n), path[:, columns])).sum()
        )

    assert priced(found) == pytest.approx(priced(expected), rel=1e-9)
    assert not rough(np.arange(n), path_through_corridor(corridor)[:, columns]).all()
    checked = path_through_corridor(corridor, clear, 20)
    assert rough(np.arange(n), checked[:, columns]).all()


class Roughly:
    """A clearance whose rough answers are exact, and that must not be queried exactly."""

    def __init__(self, function):
        self.roughly = function

    def exactly(self, rows, rotary):
        raise AssertionError("nobody wanted to look")
