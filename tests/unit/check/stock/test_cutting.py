"""What cutters remove: closed forms, poses one by one, and laws of the balance."""

import math
import os

import numpy as np
import pytest

from fiveaxis.check.stock.dexels import Removal, Stock
from fiveaxis.check.stock.sources import box
from fiveaxis.check.stock.sweeping import Poses, cutter_bodies, swept
from fiveaxis.model import Tool
from fiveaxis.model.toolpath import shapes
from fiveaxis.model.toolpath.pieces import cutter_height, cutter_pieces

# mm: a coarse pitch, and shares within which it measures volumes and areas.
PITCH, VOLUME, AREA = 0.25, 0.005, 0.03
# Poses between which the brute force of a turning cutter moves by some micrometres.
FINE = 800
UP = (0.0, 0.0, 1.0)


def through(tips: list, axes: list) -> Poses:
    """Poses whose tips and axes move in proportion between rows."""
    given, lean = np.array(tips, dtype=float), np.array(axes, dtype=float)
    lean = lean / np.linalg.norm(lean, axis=1, keepdims=True)

    def poses(place):
        low = np.minimum(np.floor(place).astype(int), len(given) - 2)
        share = (place - low)[:, None]
        axis = lean[low] + share * (lean[low + 1] - lean[low])
        return given[low] + share * (given[low + 1] - given[low]), axis / np.linalg.norm(
            axis, axis=1, keepdims=True
        )

    return poses


def cut(stock: Stock, tool: Tool, tips: list, axes: list, tolerance: float = 0.1 * PITCH) -> Removal:
    rows, bounds = np.arange(1, len(tips)), np.array([stock.low, stock.high])
    return stock.cut(
        *swept(cutter_bodies(tool), through(tips, axes), rows, tolerance, bounds), blocks=len(tips)
    )


def block(size: tuple[float, float, float]) -> Stock:
    return box(np.array([(0.0, 0.0, 0.0), size]), PITCH)


SLOT = math.hypot(11.0, 0.28)
SLOTS = {
    "flat": (shapes.flat(6.0, length=25.0), (6.0 * SLOT + 9.0 * math.pi) * 4.0),
    "bull": (
        shapes.bull(6.0, 1.0, length=25.0),
        SLOT * (22.0 + math.pi / 2.0) + math.pi * (31.0 + math.pi + 2.0 / 3.0),
    ),
    "ball": (
        shapes.ball(6.0, length=25.0),
        SLOT * (6.0 + 4.5 * math.pi) + 18.0 * math.pi + 9.0 * math.pi,
    ),
}


@pytest.mark.parametrize("name", SLOTS)
def test_a_slot_has_its_volume_by_all_three_bundles(name):
    cutter, volume = SLOTS[name]
    stock = block((24.0, 12.0, 6.0))
    removal = cut(stock, Tool(cutter), [(6.0, 6.02, 2.0), (17.0, 6.3, 2.0)], [UP, UP])
    assert removal.volume.sum(axis=1) == pytest.approx(volume, rel=VOLUME)


@pytest.mark.parametrize("degrees", [30.0, 60.0])
def test_a_leaning_cylinder_has_its_volume(degrees):
    lean = math.radians(degrees)
    axis = np.array([math.sin(lean), 0.0, math.cos(lean)])
    stock, middle = block((30.0, 12.0, 5.0)), np.array([14.0, 6.03, 2.5])
    tool = Tool(shapes.flat(6.0, length=40.0))
    removal = cut(stock, tool, [middle + 10.0 * axis, middle - 10.0 * axis], [axis, axis])
    assert removal.volume.sum(axis=1).mean() == pytest.approx(
        9.0 * math.pi * 5.0 / math.cos(lean), rel=VOLUME
    )


@pytest.mark.parametrize(
    ("cutter", "lead", "step", "height"),
    [
        (shapes.ball(8.0, length=25.0), 0.0, 1.0, 4.0 - math.sqrt(16.0 - 0.25)),
        (
            shapes.flat(10.0, length=25.0),
            15.0,
            2.0,
            5.0 * math.sin(math.radians(15.0)) * (1.0 - math.sqrt(1.0 - 0.04)),
        ),
    ],
    ids=["ball", "flat"],
)
def test_passes_leave_the_scallops_of_their_closed_form(cutter, lead, step, height):
    stock, lean = block((10.0, 12.0, 3.0)), math.radians(lead)
    axis = np.array([-math.sin(lean), 0.0, math.cos(lean)])
    lift = 0.0 if lead == 0.0 else 5.0 * math.sin(lean)
    # Crests lie on rays, whose distance is a quarter of a millimetre.
    for y in np.arange(-1.875, 14.0, step):
        cut(stock, Tool(cutter), [(-15.0, y, 2.0 + lift), (25.0, y, 2.0 + lift)], [axis, axis])
    tops = stock.bundles[2].ends[:, 1].reshape(stock.cells[:2])[8:-8, 8:-8]
    # Rays read the valley of a flat's ellipse up to a quarter of their distance beside it.
    assert tops.max() - tops.min() == pytest.approx(height, rel=0.02)


def test_a_spiral_of_a_ball_leaves_a_sphere():
    radius, pitch = 4.0, 0.6
    turns = math.pi * radius / pitch
    down = np.linspace(1e-3, math.pi - 1e-3, int(40 * turns))
    around = 2.0 * turns * down
    axis = np.column_stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)])
    stock = box(np.array([(-5.0,) * 3, (5.0,) * 3]), PITCH)
    cut(stock, Tool.ball(6.0), radius * axis, axis)
    distance = np.linalg.norm(stock.surface().points, axis=1) - radius
    gap = pitch / radius * (radius + 3.0) / 2.0
    crest = math.sqrt((radius + 3.0) ** 2 - gap**2) - math.sqrt(9.0 - gap**2) - radius
    chord = (radius + 3.0) * (1.0 - math.cos(math.pi / 40.0))
    assert -chord - 1e-3 < distance.min()
    assert distance.max() < crest + 1e-3


def test_a_ball_through_a_flat_touches_half_of_its_cap():
    stock = block((30.0, 14.0, 5.0))
    tool = Tool(shapes.ball(8.0, length=25.0))
    removal = cut(stock, tool, [(-8.0, 7.0, 3.5), (12.0, 7.0, 3.5)], [UP, UP])
    assert removal.contact.sum() == pytest.approx(math.pi * 4.0 * 1.5, rel=AREA)


MOVES = {
    "aside": [(4.0, 6.0, 3.5), (8.0, 6.0, 3.5), (0.0, -0.09, 1.0), (0.0, 0.09, 1.0)],
    "along": [(4.0, 6.0, 3.5), (8.0, 6.0, 3.5), (-0.09, 0.0, 1.0), (0.09, 0.0, 1.0)],
    "on the spot": [(7.0, 6.0, 3.0), (7.0, 6.0, 3.0), (-0.2, 0.1, 1.0), (0.2, 0.1, 1.0)],
    "plunge": [(7.0, 6.0, 6.0), (7.3, 6.0, 3.0), (0.1, 0.1, 1.0), (-0.1, 0.1, 1.0)],
}
TURNING = {
    "ball": shapes.ball(8.0, length=25.0),
    "flat": shapes.flat(8.0, length=25.0),
    "bull": shapes.bull(8.0, 1.0, length=25.0),
    "taper": shapes.taper(4.0, 10.0, 10.0, length=25.0),
    "barrel": shapes.barrel(8.0, 60.0, 2.0),
    "lollipop": shapes.lollipop(8.0, 5.0, length=25.0),
}


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("name", TURNING)
def test_a_cutter_that_turns_in_a_move_keeps_within_a_tenth_of_the_pitch(name, move):
    """Depth of the cut surface in thousands of poses: 0 where it is right."""
    tool, (*tips, first, last) = Tool(TURNING[name]), MOVES[move]
    stock = block((14.0, 12.0, 10.0))
    cut(stock, tool, tips, [first, last])
    surface = stock.surface()
    points = surface.points[surface.cut_by >= 0]
    points = points[np.random.default_rng(1).permutation(len(points))[:150]]
    tip, axis = through(tips, [first, last])(np.linspace(0.0, 1.0, FINE))
    depth = np.array([deepest(tool, point - tip, axis) for point in points])
    assert np.abs(depth).max() < 0.1 * PITCH


def deepest(tool: Tool, off: np.ndarray, axis: np.ndarray) -> float:
    """Largest depth of a point in any of the poses, by the supporting planes of the profile."""
    z = np.einsum("ij,ij->i", off, axis)
    rho = np.sqrt(np.maximum(np.einsum("ij,ij->i", off, off) - z * z, 0.0))
    best = -math.inf
    for piece in cutter_pieces(tool):
        if piece.is_ball:
            depth = tool.radius - np.hypot(rho, z - tool.radius)
        else:
            depth = np.minimum(z - max(piece.low, 0.0), min(piece.high, cutter_height(tool)) - z)
            for radius, offset, height, *ends in piece.zones:
                angle = np.linspace(math.atan2(*ends[:2]), math.atan2(*ends[2:]), 60)
                planes = (offset - rho[:, None]) * np.sin(angle) + (z[:, None] - height) * np.cos(angle)
                depth = np.minimum(depth, radius + planes.min(axis=1))
        best = max(best, float(depth.max()))
    return best


def zigzag(tool: Tool, stock: Stock) -> Removal:
    rng = np.random.default_rng(3)
    tips = [(x, 6.0 + 5.0 * (-1.0) ** i, 3.0 + rng.uniform(-1.0, 1.0)) for i, x in enumerate(range(12))]
    return cut(stock, tool, tips, [(0.1 * rng.normal(), 0.1 * rng.normal(), 1.0) for _ in tips])


@pytest.mark.parametrize("name", ["ball", "flat", "lollipop"])
def test_what_is_removed_and_what_remains_are_what_was_there(name):
    stock = block((12.0, 12.0, 6.0))
    removal = zigzag(Tool(TURNING[name]), stock)
    assert removal.volume.sum(axis=1) + stock.volumes() == pytest.approx(12.0 * 12.0 * 6.0, abs=1e-4)
    assert (removal.volume >= 0.0).all()
    assert stock.blocks == 12


@pytest.mark.parametrize("name", ["ball", "bull"])
def test_the_result_doesnt_depend_on_the_number_of_threads(name, monkeypatch):
    stocks = [block((12.0, 12.0, 6.0)) for _ in range(2)]
    found = []
    for stock, cores in zip(stocks, (1, 4), strict=True):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append(zigzag(Tool(TURNING[name]), stock))
    assert (found[0].volume == found[1].volume).all()
    assert (found[0].contact == found[1].contact).all()
    for one, other in zip(stocks[0].bundles, stocks[1].bundles, strict=True):
        assert (one.ends == other.ends).all()
        assert (one.cut_by == other.cut_by).all()


def test_a_second_cut_of_the_same_removes_nothing():
    stock = block((12.0, 12.0, 6.0))
    zigzag(Tool(TURNING["bull"]), stock)
    assert zigzag(Tool(TURNING["bull"]), stock).volume.sum() < 0.05


def test_combs_of_more_intervals_than_there_is_room_for_are_cut_whole():
    stock, tool = block((30.0, 6.0, 6.0)), Tool(shapes.flat(1.0, length=25.0))
    for x in np.arange(1.0, 29.0, 2.0):
        cut(stock, tool, [(x, -2.0, 2.0), (x, 8.0, 2.0)], [UP, UP])
    assert int(stock.bundles[0].count.max()) == 15
    assert stock.volumes()[0] == pytest.approx(30.0 * 36.0 - 14.0 * 6.0 * 4.0, rel=VOLUME)
