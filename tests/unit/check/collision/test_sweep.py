"""What a sweep proves clear is clear, and what it finds is there, compared with dense samples."""

import numpy as np
import pytest
import trimesh

from fiveaxis.base import translation
from fiveaxis.check.collision.pieces import PairQuery, box_piece, cylinder_piece, mesh_piece
from fiveaxis.check.collision.scene import Pair, SceneBody
from fiveaxis.check.collision.sweep import Hits, Sweep, join
from fiveaxis.check.collision.travel import Stretch, Travel
from fiveaxis.model import Machine, link_poses

TOLERANCE = 0.05
SAMPLES = 60
TORUS = trimesh.creation.torus(major_radius=25.0, minor_radius=6.0, major_sections=16, minor_sections=8)
OBSTACLES = {
    "box": box_piece(np.array([20.0, 5.0, 30.0]), translation((25.0, 0.0, 10.0))),
    "torus": mesh_piece(TORUS.vertices, TORUS.faces, np.eye(4), closed=True),
}


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine.from_code("640123")


def random_stretch(machine: Machine, seed: int, n: int = 25) -> Stretch:
    """A tool that wanders about the obstacle and leans as it goes."""
    rng = np.random.default_rng(seed)
    along = np.linspace(0.0, 1.0, n)[:, None] * rng.uniform(6.0, 20.0, 5) + rng.uniform(0.0, 6.0, 5)
    positions = np.sin(along) * [30.0, 30.0, 20.0, 0.6, 2.0] + [0.0, 0.0, -10.0, 0.0, 0.0]
    return Stretch(machine, lambda q: link_poses(machine, q), positions)


def pair_of(obstacle: str, clearance: float) -> Pair:
    holder = cylinder_piece(8.0, 40.0, translation((0.0, 0.0, 30.0)))
    return Pair(
        "holder",
        SceneBody("holder", "holder", "Z", (holder,)),
        SceneBody(obstacle, "fixture", "C", (OBSTACLES[obstacle],)),
        clearance,
    )


def sampled_depths(pair: Pair, stretch: Stretch, samples: int = SAMPLES) -> np.ndarray:
    """Deepest overlap of samples in the move to each row, 0 where none."""
    (first,), (second,) = pair.first.pieces, pair.second.pieces
    travel = Travel(stretch, first, second, pair.first.link, pair.second.link)
    query = PairQuery(first, second)
    depths = np.zeros(len(stretch))
    depths[0] = query.depth(travel.poses[0])
    for move in range(len(stretch) - 1):
        places = travel.between(np.full(samples, move), np.linspace(0.0, 1.0, samples))
        depths[move + 1] = max(query.depth(place) for place in places)
    return depths


@pytest.mark.parametrize(
    "obstacle", ["box", pytest.param("torus", marks=[pytest.mark.slow, pytest.mark.release])]
)
def test_a_sweep_finds_what_close_samples_find_and_a_clearance_all_that_touches(machine, obstacle):
    judged = {clearance: [] for clearance in (0.0, 2.0)}
    for seed in range(8):
        stretch = random_stretch(machine, seed)
        depths, hits = sampled_depths(pair_of(obstacle, 0.0), stretch), {}
        for clearance in judged:
            pair, every = pair_of(obstacle, clearance), np.ones(len(stretch), dtype=bool)
            hits[clearance] = one = Sweep(TOLERANCE).run(pair, stretch, every)
            found = np.zeros(len(stretch), dtype=bool)
            found[one.rows[one.touching & np.isfinite(one.depths)]] = True
            judged[clearance].append(np.column_stack([found, depths]))
        touching, near = hits.values()
        assert set(touching.rows.tolist()) <= set(near.rows.tolist())
        assert near.rows[near.touching].tolist() == touching.rows.tolist()
    for moves in judged.values():
        found, depths = np.concatenate(moves).T
        assert found[depths > TOLERANCE].all()
        # A sweep may look between two samples, which are nearer together than this.
        assert (found[depths == 0.0] == 0.0).mean() > 0.98
        assert 10 < found.sum() < len(found) - 10


def test_groups_of_short_moves_hide_nothing(machine):
    """A dense path is proven clear in groups, mostly without queries at single locations."""
    stretch, pair = random_stretch(machine, 1, n=600), pair_of("torus", 0.0)
    sweep = Sweep(TOLERANCE)
    hits = sweep.run(pair, stretch, np.ones(len(stretch), dtype=bool))
    found = np.zeros(len(stretch), dtype=bool)
    found[hits.rows] = True
    depths = sampled_depths(pair, stretch, samples=4)
    assert found[depths > TOLERANCE].all()
    assert not found[(depths == 0.0)].any()
    assert 50 < found.sum() < 400
    clear = Sweep(TOLERANCE)
    above = stretch.positions + np.array([0.0, 0.0, 40.0, 0.0, 0.0])
    hits = clear.run(pair, Stretch(machine, stretch.poses, above), np.ones(len(above), dtype=bool))
    assert len(hits.rows) == 0
    assert 0 < clear.queries < len(above) / 10


def test_moves_that_do_not_count_are_not_checked(machine):
    stretch, pair = random_stretch(machine, 0), pair_of("torus", 0.0)
    every = np.ones(len(stretch), dtype=bool)
    rows = Sweep(TOLERANCE).run(pair, stretch, every).rows
    some = every.copy()
    some[rows[::2]] = False
    assert not set(Sweep(TOLERANCE).run(pair, stretch, some).rows.tolist()) & set(rows[::2].tolist())


def test_the_worst_of_a_row_is_the_deepest_then_the_nearest():
    nan = np.nan
    hits = join(
        [
            Hits(
                np.array([3, 3, 5]),
                np.array([0.5, 1.0, 1.0]),
                np.array([nan, 0.2, nan]),
                np.array([1.0, 0, 2]),
            ),
            Hits(np.array([5, 3]), np.array([0.1, 0.2]), np.array([nan, 0.7]), np.array([1.5, 0.0])),
        ]
    ).worst()
    assert hits.rows.tolist() == [3, 5]
    assert hits.shares.tolist() == [0.2, 0.1]
    assert hits.gaps.tolist() == [0.0, 1.5]


def test_nothing_found_is_nothing():
    assert len(join([]).worst().rows) == 0
