"""The stock as it is cut: speed, memory, closed forms and planted gouges, in one table.

Usage: python tests/benchmarks/stock.py [--moves 2000 100000] [--pitch 0.1]
"""

import argparse
import math
import time
from collections.abc import Iterator

import numpy as np
import trimesh

from fiveaxis.check import Blank
from fiveaxis.check.stock.comparing import sweep_tolerance
from fiveaxis.check.stock.cutting import cut_stock
from fiveaxis.check.stock.dexels import Stock
from fiveaxis.check.stock.sources import box, load_stock
from fiveaxis.check.stock.sweeping import Poses, cutter_bodies, swept
from fiveaxis.model import Tool
from fiveaxis.model.toolpath import shapes

UP = (0.0, 0.0, 1.0)
# mm, depths of planted gouges.
DEPTHS = (0.05, 0.1, 0.2, 0.5, 1.0)


def through(tips: np.ndarray, axes: np.ndarray) -> Poses:
    """Return poses whose tips and axes move in proportion between rows."""
    tips, axes = np.asarray(tips, dtype=float), np.asarray(axes, dtype=float)
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)

    def poses(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        low = np.minimum(np.floor(place).astype(int), len(tips) - 2)
        share = (place - low)[:, None]
        axis = axes[low] + share * (axes[low + 1] - axes[low])
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        return tips[low] + share * (tips[low + 1] - tips[low]), axis

    return poses


def cut(stock: Stock, tool: Tool, tips: object, axes: object) -> np.ndarray:
    """Cut a stock and return the removed volume by each bundle, (3,) mm³."""
    poses, rows = through(np.array(tips), np.array(axes)), np.arange(1, len(np.array(tips)))
    bounds = np.array([stock.low, stock.high])
    sweeps = swept(cutter_bodies(tool), poses, rows, sweep_tolerance(stock.resolution), bounds)
    return stock.cut(*sweeps, blocks=len(rows) + 1).volume.sum(axis=1)


def over_dome(moves: int, radius: float = 30.0) -> tuple[np.ndarray, np.ndarray]:
    """Return tips and axes of a 5-axis spiral over a dome whose axis leans 10 degrees off the normal."""
    turns = math.sqrt(moves / 40.0)
    down = np.linspace(0.02, 1.45, moves + 1)
    around = 2.0 * math.pi * turns * down / 1.45
    normal = np.column_stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)])
    ahead = np.gradient(normal, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    lean = math.radians(10.0)
    axis = math.cos(lean) * normal + math.sin(lean) * ahead
    return (radius + 4.0) * normal - 4.0 * axis, axis


def speed(moves: int, pitch: float, cutter: object, name: str) -> str:
    """Time 5-axis moves that take 0.5 mm off a dome of 60 mm."""
    tool, part = Tool(cutter), trimesh.creation.icosphere(subdivisions=5, radius=30.0)
    stock = load_stock("part+0.5", part, pitch)
    poses, rows = through(*over_dome(moves)), np.arange(1, moves + 1)
    cut(stock.copy(), tool, *(array[:9] for array in over_dome(moves)))  # compiles
    begin, memory = time.process_time(), stock.memory
    sweeps = swept(
        cutter_bodies(tool), poses, rows, sweep_tolerance(pitch), np.array([stock.low, stock.high])
    )
    stock.cut(*sweeps, blocks=moves + 1)
    spent = time.process_time() - begin
    segments = sum(len(sweep.block) for sweep in sweeps)
    return (
        f"{name}, {moves} moves, {segments} segments: {spent:.2f} s of processor, {moves / spent:.0f} per s, "
        f"{max(memory, stock.memory) / 2**20:.0f} MiB"
    )


def closed_forms(pitch: float) -> Iterator[str]:
    """Measure volumes and scallops beside their closed forms."""
    way = math.hypot(11.0, 0.28)
    slots = {
        "flat": (shapes.flat(6.0, length=25.0), (6.0 * way + 9.0 * math.pi) * 4.0),
        "bull": (
            shapes.bull(6.0, 1.0, length=25.0),
            way * (22.0 + math.pi / 2.0) + math.pi * (31.0 + math.pi + 2.0 / 3.0),
        ),
        "ball": (shapes.ball(6.0, length=25.0), way * (6.0 + 4.5 * math.pi) + 27.0 * math.pi),
    }
    for name, (cutter, volume) in slots.items():
        found = cut(slab(24.0, 12.0, 6.0, pitch), Tool(cutter), [(6, 6.02, 2), (17, 6.3, 2)], [UP, UP])
        yield f"slot, {name}: {100.0 * (found.mean() / volume - 1.0):+.3f} % of its volume"
    for degrees in (30.0, 60.0):
        lean, middle = math.radians(degrees), np.array([14.0, 6.03, 2.5])
        axis = np.array([math.sin(lean), 0.0, math.cos(lean)])
        ends = [middle + 10.0 * axis, middle - 10.0 * axis]
        found = cut(slab(30.0, 12.0, 5.0, pitch), Tool(shapes.flat(6.0, length=40.0)), ends, [axis, axis])
        volume = 45.0 * math.pi / math.cos(lean)
        yield f"cylinder, {degrees:g} deg: {100.0 * (found.mean() / volume - 1.0):+.3f} % of its volume"
    stock = slab(10.0, 12.0, 3.0, pitch)
    for y in np.arange(-1.95, 14.0, 1.0):
        cut(stock, Tool(shapes.ball(8.0, length=25.0)), [(-15.0, y, 2.0), (25.0, y, 2.0)], [UP, UP])
    tops = stock.bundles[2].ends[:, 1].reshape(stock.cells[:2])[20:-20, 20:-20]
    height = 4.0 - math.sqrt(15.75)
    yield f"scallop of a ball: {tops.max() - tops.min():.5f} mm, closed form {height:.5f} mm"
    yield spiral(pitch)


def spiral(pitch: float, radius: float = 7.0, step: float = 0.6) -> str:
    """A ball along a spiral leaves a sphere with crests."""
    turns = math.pi * radius / step
    down = np.linspace(1e-3, math.pi - 1e-3, int(60 * turns))
    around = 2.0 * turns * down
    axis = np.column_stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)])
    stock = box(np.array([(-9.0,) * 3, (9.0,) * 3]), pitch)
    cut(stock, Tool(shapes.ball(6.0, length=25.0)), radius * axis, axis)
    distance = np.linalg.norm(stock.surface().points, axis=1) - radius
    gap = step / radius * (radius + 3.0) / 2.0
    crest = math.sqrt((radius + 3.0) ** 2 - gap**2) - math.sqrt(9.0 - gap**2) - radius
    chord = (radius + 3.0) * (1.0 - math.cos(math.pi / 60.0))
    volume = 100.0 * (stock.volumes().mean() / (4.0 / 3.0 * math.pi * radius**3) - 1.0)
    return (
        f"sphere by a spiral: {distance.min():+.5f} … {distance.max():+.5f} mm, closed form {-chord:+.5f} … "
        f"{crest:+.5f} mm; volume {volume:+.3f} % of the sphere's"
    )


def slab(x: float, y: float, z: float, pitch: float) -> Stock:
    """Return a block with a corner at the origin."""
    return box(np.array([(0.0, 0.0, 0.0), (x, y, z)]), pitch)


def planted(pitch: float) -> Iterator[str]:
    """Sink one location of a pass over a block, and look where the part lacks material."""
    part = trimesh.creation.box(extents=(30.0, 30.0, 10.0))
    part.apply_translation((0.0, 0.0, 5.0))
    blank = Blank.of(load_stock("part+1", part, pitch), part)
    tips = np.array(
        [
            (x * (-1.0) ** i, y, 10.0)
            for i, y in enumerate(np.arange(-16.0, 16.0, 0.5))
            for x in range(-18, 19, 2)
        ]
    )
    at = int(np.argmin(np.linalg.norm(tips[:, :2] - [4.0, 3.0], axis=1)))
    for depth in (0.0, *DEPTHS):
        sunk = tips.copy()
        sunk[at, 2] -= depth
        axes = np.tile(UP, (len(tips), 1))
        found = cut_stock(blank, Tool.ball(6.0), through(sunk, axes), np.arange(1, len(tips)), len(tips))
        worst = int(np.argmin(found.deviations.distance))
        place = found.deviations.surface.points[worst]
        name = int(found.deviations.surface.cut_by[worst]) - found.first
        off = float(np.linalg.norm(place[:2] - tips[at, :2]))
        yield (
            f"planted {depth:.2f} mm at row {at}: found {found.deviations.deepest:.4f} mm"
            + (f", {off:.2f} mm from its place, by block {name}" if depth else "")
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, nargs="+", default=[2000, 100_000])
    parser.add_argument("--pitch", type=float, default=0.1)
    given = parser.parse_args()
    for moves in given.moves:
        print(speed(moves, given.pitch, shapes.ball(8.0, length=25.0), "ball"), flush=True)
    for name, cutter in (
        ("flat", shapes.flat(8.0, length=25.0)),
        ("bull", shapes.bull(8.0, 1.0, length=25.0)),
    ):
        print(speed(min(given.moves), given.pitch, cutter, name), flush=True)
    for line in (*closed_forms(given.pitch), *planted(given.pitch)):
        print(line, flush=True)


if __name__ == "__main__":
    main()
