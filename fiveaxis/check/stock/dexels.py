"""The stock: three bundles of rays, each with its intervals of material (tri-dexels)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, IntArray, SettingError, at_once
from fiveaxis.check.stock.sweeping import BallSweep, Sweep

# Cells along the part's longest side at the default resolution: 0.1 mm on 60 mm; most along the stock's.
DEFAULT_CELLS, MOST_CELLS = 600, 1200
# Bytes that a stock may take, and intervals of a ray for which it is reckoned.
MOST_MEMORY, RECKONED = 2**30, 4
# Intervals of a ray that there is room for at first, and the most there may be.
FIRST_INTERVALS, MOST_INTERVALS = 2, 128
# Parts of a bundle that are cut at once; their number, and so every sum, is the same on every computer.
STRIPS = 4
# Segments that take no longer than threads to begin.
FEW = 16
# Name on ends that no block has cut.
UNCUT = -1


@dataclass(eq=False)
class Bundle:
    """Parallel rays; ray ``i·n[v] + j`` is in the middle of cell i along u and j along v.

    Parameters
    ----------
    ends : (rays, 2K) float32, sorted ends of the intervals, mm from the grid's low corner
    cut_by : (rays, 2K) int32, block that made each end; `UNCUT` for none
    count : (rays,) uint8, intervals of each ray
    tiles : (a, b, 2) float32, mm, range of the material of each tile, which cutting keeps; None before that
    """

    ends: NDArray[np.float32]
    cut_by: NDArray[np.int32]
    count: NDArray[np.uint8]
    tiles: NDArray[np.float32] | None = None

    @classmethod
    def empty(cls, rays: int) -> Bundle:
        """Make rays without material."""
        shape = rays, 2 * FIRST_INTERVALS
        return cls(np.zeros(shape, np.float32), np.full(shape, UNCUT, np.int32), np.zeros(rays, np.uint8))

    @property
    def held(self) -> BoolArray:
        """Which of the ends are those of intervals, (rays, 2K); the others hold what was there before."""
        return np.asarray(np.arange(self.ends.shape[1]) < 2 * self.count[:, None].astype(np.int64))

    @property
    def length(self) -> float:
        """Length of the material on all rays, mm."""
        lengths = self.ends[:, 1::2] - self.ends[:, ::2]
        return float(lengths[self.held[:, ::2]].sum(dtype=float))

    def copy(self) -> Bundle:
        """Copy all arrays."""
        return Bundle(self.ends.copy(), self.cut_by.copy(), self.count.copy())

    def at(self, rays: IntArray) -> Bundle:
        """Select rays, (r,)."""
        return Bundle(self.ends[rays], self.cut_by[rays], self.count[rays])

    def without(self, other: Bundle) -> Bundle:
        """Return what the same rays of another stock don't have."""
        from fiveaxis.check.stock.rays import remove_held

        left = self.copy()
        while remove_held(left.ends, left.cut_by, left.count, other.ends, other.count, UNCUT):
            left.grow()
        left.trim()
        return left

    def grow(self) -> None:
        """Double the intervals that a ray can hold."""
        if self.ends.shape[1] >= 2 * MOST_INTERVALS:
            raise SettingError(
                f"a ray of the stock has more than {MOST_INTERVALS} intervals of material; take a coarser "
                "stock_resolution, or a mesh with less detail"
            )
        self.ends = np.hstack([self.ends, np.zeros_like(self.ends)])
        self.cut_by = np.hstack([self.cut_by, np.full_like(self.cut_by, UNCUT)])

    def trim(self) -> None:
        """Give up room that no ray needs."""
        most = max(FIRST_INTERVALS, int(self.count.max(initial=0)))
        self.ends = np.ascontiguousarray(self.ends[:, : 2 * most])
        self.cut_by = np.ascontiguousarray(self.cut_by[:, : 2 * most])


@dataclass(frozen=True, eq=False)
class Removal:
    """What blocks removed.

    Parameters
    ----------
    volume : (3, blocks), mm³ by x, y and z rays, each an estimate of its own
    contact : (blocks,), mm² of new surface that the cutter touches at each block's end, without the bottom of
        a flat one
    """

    volume: Array
    contact: Array


@dataclass(frozen=True, eq=False)
class Surface:
    """The ends of all intervals, which lie on the stock's surface.

    Parameters
    ----------
    points : (n, 3), mm, workpiece frame
    direction : (n,), axis along which each ray runs
    ray : (n,), its index in the bundle
    cut_by : (n,), the block that made the end; `UNCUT` for none
    """

    points: Array
    direction: IntArray
    ray: IntArray
    cut_by: IntArray

    def at(self, rows: BoolArray | IntArray) -> Surface:
        """Select ends."""
        return Surface(self.points[rows], self.direction[rows], self.ray[rows], self.cut_by[rows])

    @classmethod
    def joined(cls, *parts: Surface) -> Surface:
        """Join ends."""
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


@dataclass(eq=False)
class Stock:
    """Material on a grid in the workpiece frame; cutting changes it, `copy` keeps what was.

    Parameters
    ----------
    low : (3,), mm, low corner of the grid
    pitch : (3,), mm, distance of rays along each axis
    cells : (3,), number of cells
    bundles : the rays along X, Y and Z
    blocks : number of blocks that have cut it: their names are 0 to this
    """

    low: Array
    pitch: Array
    cells: IntArray
    bundles: tuple[Bundle, Bundle, Bundle]
    blocks: int = 0

    @classmethod
    def empty(cls, bounds: Array, resolution: float) -> Stock:
        """Make a grid without material that fits bounds exactly: planes between rays would be rounded.

        The bounds, (2, 3) mm, are low and high corner; the resolution, mm, is the largest distance of rays.
        `SettingError` unless that is above 0, and takes at most `MOST_MEMORY`.
        """
        cells = require_room(bounds, resolution)
        rays = [int(cells[(d + 1) % 3] * cells[(d + 2) % 3]) for d in range(3)]
        x, y, z = (Bundle.empty(number) for number in rays)
        return cls(bounds[0].copy(), (bounds[1] - bounds[0]) / cells, cells, (x, y, z))

    def copy(self) -> Stock:
        """Copy the stock with all of its material."""
        x, y, z = (bundle.copy() for bundle in self.bundles)
        return Stock(self.low, self.pitch, self.cells, (x, y, z), self.blocks)

    def without(self, other: Stock) -> Stock:
        """Return what another stock on the same grid doesn't have."""
        x, y, z = (a.without(b) for a, b in zip(self.bundles, other.bundles, strict=True))
        return replace(self, bundles=(x, y, z))

    def emptied(self) -> Stock:
        """Return the same grid without material."""
        x, y, z = (Bundle.empty(len(bundle.count)) for bundle in self.bundles)
        return Stock(self.low, self.pitch, self.cells, (x, y, z))

    def thinned(self, stride: int) -> Stock:
        """Return a stock of every few rays; the first one stays, in the middle of a larger cell."""
        cells, pitch = -(-self.cells // stride), stride * self.pitch
        low = self.low - (pitch - self.pitch) / 2.0
        bundles = []
        for d, bundle in enumerate(self.bundles):
            grid = np.arange(len(bundle.count)).reshape(self.cells[(d + 1) % 3], -1)
            some = grid[::stride, ::stride].ravel()
            ends = (bundle.ends[some] + (self.low - low)[d]).astype(np.float32)
            bundles.append(Bundle(ends, bundle.cut_by[some], bundle.count[some]))
        x, y, z = bundles
        return Stock(low, pitch, cells, (x, y, z), self.blocks)

    @property
    def high(self) -> Array:
        """High corner of the grid, (3,) mm."""
        return np.asarray(self.low + self.cells * self.pitch)

    @property
    def resolution(self) -> float:
        """Largest distance of rays, mm."""
        return float(self.pitch.max())

    @property
    def memory(self) -> int:
        """Bytes that it takes."""
        arrays = [(b.ends, b.cut_by, b.count) for b in self.bundles]
        return sum(array.nbytes for bundle in arrays for array in bundle)

    def ray_area(self, d: int) -> float:
        """Return the cross-section that a ray along axis d stands for, mm²."""
        return float(self.pitch[(d + 1) % 3] * self.pitch[(d + 2) % 3])

    def volumes(self) -> Array:
        """Compute the volume by x, y and z rays, (3,) mm³."""
        return np.array([bundle.length * self.ray_area(d) for d, bundle in enumerate(self.bundles)])

    def cut(self, *sweeps: Sweep, blocks: int) -> Removal:
        """Remove what the convex bodies of a cutter sweep; what several would remove counts for the first.

        Rows of tiles are independent, so they are cut at once. A ray that needs more intervals than there is
        room for gets twice the room, and its segment is repeated: a second cut of the same removes nothing.
        Blocks of the sweeps begin at 0; on ends they are called `Stock.blocks` and on, which counts on.
        """
        figures = self._run(sweeps, blocks)
        self.blocks += blocks
        return Removal(figures[:, :, 0], figures[:, :, 1].sum(axis=0))

    def touched(self, *sweeps: Sweep, blocks: int) -> Array:
        """Measure what bodies sweep of the material, which stays: (blocks,) mm³, the most of the bundles'."""
        return np.asarray(self._run(sweeps, blocks, keep=True)[:, :, 0].max(axis=0))

    def _run(self, sweeps: Sequence[Sweep], blocks: int, *, keep: bool = False) -> Array:
        """Cut all bundles, or only measure what would be cut; (3, blocks, 2), volume and contact of each."""
        figures = np.zeros((3, blocks, 2))
        for sweep in sweeps:
            placed = sweep.moved(-self.low)
            for d in range(3):
                figures[d] += self._run_along(d, placed, blocks, keep)
        return figures

    def _run_along(self, d: int, sweep: Sweep, blocks: int, keep: bool) -> Array:
        """Cut the bundle along d in strips; (blocks, 2)."""
        from fiveaxis.check.stock.ball_sweep import sweep_balls
        from fiveaxis.check.stock.body_sweep import sweep_bodies
        from fiveaxis.check.stock.rays import TILE, Rays, fit_tiles

        bundle, nu, nv = self.bundles[d], self.cells[(d + 1) % 3], self.cells[(d + 2) % 3]
        rows = -(-int(nu) // TILE)
        edges = np.linspace(0, rows, min(STRIPS, rows) + 1).astype(int).tolist()
        strips = list(pairwise(edges))
        if bundle.tiles is None:
            bundle.tiles = np.empty((rows, -(-int(nv) // TILE), 2), np.float32)
            fit_tiles(bundle.tiles, bundle.ends, bundle.count, nu, nv)
        found = np.zeros((len(strips), blocks, 2))
        begin = [0] * len(strips)
        loop: Callable[..., int] = sweep_balls if isinstance(sweep, BallSweep) else sweep_bodies
        while min(begin) < len(sweep.block):
            held = bundle.ends, bundle.cut_by, bundle.count, bundle.tiles
            rays = Rays(d, self.pitch, self.cells, *held)
            tasks = [
                partial(loop, rays, sweep, strip, start, self.blocks, figure, keep)
                for strip, start, figure in zip(strips, begin, found, strict=True)
            ]
            begin = at_once(tasks) if len(sweep.block) > FEW else [task() for task in tasks]
            if min(begin) < len(sweep.block):
                bundle.grow()
        return np.asarray(found.sum(axis=0))

    def surface(self) -> Surface:
        """Return the ends of all intervals."""
        parts = []
        for d, bundle in enumerate(self.bundles):
            ray, column = np.nonzero(bundle.held)
            named = bundle.cut_by[ray, column].astype(np.int64)
            parts.append(self.on_rays(d, ray, bundle.ends[ray, column], named))
        return Surface.joined(*parts)

    def on_rays(self, d: int, ray: IntArray, along: Array | NDArray[np.float32], cut_by: IntArray) -> Surface:
        """Return points on rays along axis d, at places, (n,) mm from the grid's low corner."""
        u, v = (d + 1) % 3, (d + 2) % 3
        points = np.empty((len(ray), 3))
        points[:, d] = along
        points[:, u] = (ray // self.cells[v] + 0.5) * self.pitch[u]
        points[:, v] = (ray % self.cells[v] + 0.5) * self.pitch[v]
        return Surface(self.low + points, np.full(len(ray), d), ray, cut_by)

    def holds(self, surface: Surface) -> BoolArray:
        """Check which ends of a stock on the same grid are within the material of this one, (n,)."""
        from fiveaxis.check.stock.rays import covered

        inside = np.zeros(len(surface.points), dtype=bool)
        for d, bundle in enumerate(self.bundles):
            on = surface.direction == d
            places = np.ascontiguousarray(surface.points[on, d] - self.low[d])
            inside[on] = covered(bundle.ends, bundle.count, surface.ray[on], places)
        return inside

    def __repr__(self) -> str:
        size = " × ".join(f"{side:.4g}" for side in self.high - self.low)
        volume, memory = float(self.volumes().mean()), self.memory / 2**20
        return f"<Stock {size} mm at {self.resolution:.3g} mm: {volume:.5g} mm3, {memory:.0f} MiB>"


def default_resolution(part: Array, size: Array) -> float:
    """Return the resolution for a part's bounds, (2, 3) mm, in a stock of a size, (3,) mm.

    It is the part's longest side in `DEFAULT_CELLS`, coarser in a stock of more than `MOST_CELLS` of them.
    """
    return max(float((part[1] - part[0]).max()) / DEFAULT_CELLS, float(size.max()) / MOST_CELLS)


def require_room(bounds: Array, resolution: float) -> IntArray:
    """Return the cells, (3,), of a grid over bounds, (2, 3) mm, before any memory is taken."""
    if not (math.isfinite(resolution) and resolution > 0.0):
        raise SettingError(f"stock_resolution is {resolution:g} mm; it must be a number above 0 mm")
    size = bounds[1] - bounds[0]
    cells = np.maximum(np.ceil(size / resolution - 1e-9), 1.0)
    rays = float(cells[0] * cells[1] + cells[1] * cells[2] + cells[2] * cells[0])
    memory = rays * (RECKONED * 16 + 1)
    if memory > MOST_MEMORY:
        enough = resolution * math.sqrt(memory / MOST_MEMORY)
        sides = " × ".join(f"{side:.4g}" for side in size)
        raise SettingError(
            f"a stock of {sides} mm at stock_resolution {resolution:.3g} mm takes {memory / 2**30:.3g} GiB "
            f"of memory, and {MOST_MEMORY / 2**30:g} GiB are allowed; take {enough:.2g} mm or coarser"
        )
    return cells.astype(np.int64)
