"""The stock as an obstacle that the moves of a path take away."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import fiveaxis as fx
from fiveaxis.check import Blank, Surroundings
from fiveaxis.check.collision.accessibility import find_accessible
from fiveaxis.check.collision.obstacles import Solid
from fiveaxis.check.collision.shrinking import ShrinkingStock
from fiveaxis.check.stock.sources import load_stock
from fiveaxis.model import Tool
from fiveaxis.model.toolpath import shapes
from fiveaxis.model.toolpath.tool import Holder, Section

RADIUS, HEIGHT, RESOLUTION = 3.0, 5.0, 0.5
LENGTH, WIDTH = 40.0, 30.0


@pytest.fixture(scope="module")
def blank():
    """A plate below z = 0, and material on it up to 5 mm, less than the ball's diameter."""
    part = trimesh.creation.box(extents=(LENGTH, WIDTH, 10.0))
    part.apply_translation((0.0, 0.0, -5.0))
    return Blank.of(load_stock(f"box:{LENGTH}:{WIDTH}:{10.0 + HEIGHT}", part, RESOLUTION), part)


@pytest.fixture(scope="module")
def path():
    """Parallel passes along x over the plate, from the front to the back."""
    x = np.linspace(-25.0, 25.0, 26)
    contact = np.array([[[a, y, 0.0] for a in x] for y in np.arange(-16.0, 16.5, 1.0)]).reshape(-1, 3)
    tool = Tool(shapes.ball(2 * RADIUS), 5.0, Holder(20.0, (Section(20.0, 16.0),)))
    up = np.tile([0.0, 0.0, 1.0], (len(contact), 1))
    return fx.Toolpath.from_contacts(contact, up, tool=tool, feed_mm_min=1000.0)


def _left(path, row, points):
    """Whether points, (n, 3), are left when a location is reached, by distances to all chords so far."""
    here = np.zeros(len(points), dtype=bool)
    for a, b in zip(path.pivot[:row], path.pivot[1 : row + 1], strict=True):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        here |= np.linalg.norm(points - a - along[:, None] * (b - a), axis=1) < RADIUS
    return ~here


def test_it_is_what_chords_of_the_ball_leave(blank, path):
    """Points of the material against cylinders about drawn axes; voxels may round a surface by their half."""
    draw = np.random.default_rng(3)
    # Crests between passes are thinner than a voxel.
    points = draw.uniform([-20.0, -15.0, RESOLUTION], [20.0, 15.0, HEIGHT], (12_000, 3))
    slim, wide = (
        ShrinkingStock.build(blank, path, (Solid("shank", np.array([[4.0, r, 60.0, r]])),))
        for r in (2.0, 4.0)
    )
    for row in (20, 300, 500, 857):
        left = points[_left(path, row, points)]
        axis = draw.normal(size=(300, 3))
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        tip = path.pivot[row] - RADIUS * axis
        off = left[:, None] - tip
        up = (off * axis).sum(axis=2)
        within = np.linalg.norm(off - up[..., None] * axis, axis=2) <= 3.0
        truth = (within & (up >= 4.0 - RESOLUTION) & (up <= 60.0)).any(axis=0)
        rows = np.full(300, row)
        assert not (slim.hit_by(rows, tip, axis) & ~truth).any()
        inner = (within & (up >= 4.0 + RESOLUTION)).any(axis=0)
        assert not (inner & ~wide.hit_by(rows, tip, axis)).any()
        assert row == 857 or 0.1 < truth.mean() < 0.95


def test_a_move_takes_away_what_is_between_its_ends(blank, path):
    slim = (Solid("shank", np.array([[4.0, 1.0, 60.0, 1.0]])),)
    stock = ShrinkingStock.build(blank, path.at(16 * 26 + np.array([0, 25])), slim)
    tip, axis = np.tile([0.0, 0.0, -3.0], (2, 1)), np.tile([0.0, 0.0, 1.0], (2, 1))
    assert stock.hit_by(np.array([0, 1]), tip, axis).tolist() == [True, False]


def test_postures_over_what_was_cut_open_up(blank, path):
    mask = find_accessible(
        path, fx.load_machine("hayashi-640123"), Surroundings(part=blank.mesh, blank=blank, stock=blank.mesh)
    )
    tilt = np.radians(55.0)
    towards, away = ([[0.0, s * np.sin(tilt), np.cos(tilt)]] for s in (1.0, -1.0))
    middle = np.array([16 * 26 + 13])
    assert mask.clear(middle, np.array(away)).all()
    assert not mask.clear(middle, np.array(towards)).any()
    # Of a path in the other order the other half is cut.
    back = find_accessible(
        path.at(np.arange(len(path))[::-1]),
        mask.machine,
        Surroundings(part=blank.mesh, blank=blank, stock=blank.mesh),
    )
    row = len(path) - 1 - middle
    assert back.clear(row, np.array(towards)).all()
    assert not back.clear(row, np.array(away)).any()


def test_an_edge_takes_nothing_of_which_the_posture_isnt_known(blank, path):
    """Only a ball inside the cutter at any lean does; of a flat end mill there is none."""
    solid = (Solid("shank", np.array([[4.0, 2.0, 60.0, 2.0]])),)
    flat = replace(path, tool=Tool(shapes.flat(6.0)))
    last = np.array([len(path) - 1])
    tip, axis = np.array([[0.0, 0.0, -3.0]]), np.array([[0.0, 0.0, 1.0]])
    assert not ShrinkingStock.build(blank, path, solid).hit_by(last, tip, axis)[0]
    assert ShrinkingStock.build(blank, flat, solid).hit_by(last, tip, axis)[0]
