"""The stock as a mesh, and as one mesh for all of the time in which it is cut (surface nets).

All three bundles of rays pass through the middles of cells. So whether a node of the lattice there is in the
material is told by its Z ray, and where an edge of the lattice leaves it can be read off the ray along the
edge, exactly. Node 0 and the last one of each direction lie outside the grid, in the air.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray
from fiveaxis.cam import Mesh
from fiveaxis.check.stock.comparing import sweep_tolerance
from fiveaxis.check.stock.cutting import of_blocks
from fiveaxis.check.stock.dexels import Stock
from fiveaxis.check.stock.sweeping import Poses, Sweep, cutter_bodies, swept
from fiveaxis.model import Tool

# Nodes along the longest side of the lattice that a mesh is made on.
MOST_NODES = 120
# mm: by which a crossing may be beyond its edge; share of a cell by which a vertex moves before it counts as
# another one.
ROUNDED, STILL = 1e-3, 0.005
# Corners of a cube; its edges, each with axis and first node; and the cubes about an edge along each axis.
CORNERS = np.array(list(np.ndindex(2, 2, 2)))
EDGES = [(d, np.roll([0, *side], d)) for d in range(3) for side in np.ndindex(2, 2)]
AROUND = [[np.roll([0, i, j], d) for i, j in ((1, 1), (0, 1), (0, 0), (1, 0))] for d in range(3)]
# Step of what is never gone.
STAYS = np.iinfo(np.int32).max


@dataclass(frozen=True, eq=False)
class Playback:
    """The surface of a stock while it is cut: quads, each of which is there for some steps.

    Parameters
    ----------
    vertices : (v, 3), mm, workpiece frame
    quads : (q, 4), their vertices, anticlockwise seen from outside
    lives : (q, 2), step at which each appears, ascending, and at which it is gone; `STAYS` for none.
        Step 0 is the stock before
    cell : mm, distance of the rays that were cut
    removed : (s,), mm³ that each step removes
    """

    vertices: Array
    quads: NDArray[np.int32]
    lives: NDArray[np.int32]
    cell: float
    removed: Array

    def at(self, step: int) -> NDArray[np.int32]:
        """Return the quads that are there after a step, (q, 4)."""
        return self.quads[(self.lives[:, 0] <= step) & (step < self.lives[:, 1])]

    def mesh(self, step: int = 0) -> Mesh:
        """Return the closed mesh after a step, mm."""
        used, index = np.unique(self.at(step), return_inverse=True)
        quads = index.reshape(-1, 4)
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return Mesh(self.vertices[used], faces)


def play(stock: Stock, tool: Tool, poses: Poses, rows: int, ends: Array) -> Playback:
    """Cut a stock by a program's moves, step by step, on every few of its rays.

    Parameters
    ----------
    stock : before; stays as it is
    tool : its cutter removes what it sweeps
    poses : of the tool, at fractional rows of the program
    rows : number of rows
    ends : (s,), fractional rows at which the steps end, ascending
    """
    thin = stock.thinned(stride_of(stock))
    nets, removed = _Nets(thin), np.zeros(len(ends))
    for step, (box, volume) in enumerate(
        _cut_in_steps(thin, stock, tool, poses, np.arange(rows), ends), start=1
    ):
        removed[step - 1] = volume
        if box is not None:
            nets.renew(step, box)
    return nets.playback(removed)


def _cut_in_steps(
    thin: Stock, stock: Stock, tool: Tool, poses: Poses, rows: IntArray, ends: Array
) -> Iterator[tuple[Array | None, float]]:
    """Cut in steps, and give what each has changed, a box, (2, 3) in cells, or None, and removed, mm³."""
    # A move is divided where a step ends within it.
    places = np.unique(np.concatenate([rows, ends]))

    def divided(place: Array) -> tuple[Array, Array]:
        return poses(np.interp(place, np.arange(len(places)), places))

    moves, bounds = np.arange(1, len(places)), np.array([stock.low, stock.high])
    sweeps = swept(cutter_bodies(tool), divided, moves, sweep_tolerance(thin.resolution), bounds)
    last = np.searchsorted(places, ends)
    by_step = tuple(sweep._replace(block=np.searchsorted(last, sweep.block)) for sweep in sweeps)
    for step in range(len(ends)):
        parts = of_blocks(by_step, step, step + 1)
        yield _lost(thin, parts) if parts else (None, 0.0)


def _lost(stock: Stock, parts: Sequence[Sweep]) -> tuple[Array | None, float]:
    """Cut, and return the box, (2, 3) in cells, in which rays have lost something, and how much, mm³."""
    before = stock.copy().bundles
    removed, found = float(stock.cut(*parts, blocks=1).volume.mean()), []
    for d, (old, new) in enumerate(zip(before, stock.bundles, strict=True)):
        changed = (old.ends != new.ends[:, : old.ends.shape[1]]).any(axis=1) | (old.count != new.count)
        rays = np.flatnonzero(changed)
        lost = old.at(rays).without(new.at(rays))
        row, column = np.nonzero(lost.held)
        found.append(stock.on_rays(d, rays[row], lost.ends[row, column], row).points)
    places = (np.concatenate(found) - stock.low) / stock.pitch
    return (np.array([places.min(axis=0), places.max(axis=0)]) if len(places) else None), removed


class _Nets:
    """Surface nets: a vertex in each cube that the surface crosses, a quad about each edge that does."""

    def __init__(self, stock: Stock) -> None:
        self.stock = stock
        shape = tuple(int(k) for k in stock.cells + 2)
        self.sign = np.zeros(shape, dtype=bool)
        self.cross = np.full((3, *shape), np.nan, np.float32)
        self.vertex = np.full([k - 1 for k in shape], -1)
        self.quad = np.full((3, *shape), -1)
        self.points = np.zeros((0, 3), np.float32)
        self.quads = np.zeros((0, 4), np.int32)
        self.lives = np.zeros((0, 2), np.int32)
        self.count = {"points": 0, "quads": 0, "lives": 0}
        self.renew(0, np.array([np.zeros(3), self.stock.cells]))

    def renew(self, step: int, box: Array) -> None:
        """Renew the surface in a box, (2, 3) in cells, in which rays have changed."""
        held = np.array(self.sign.shape)
        # Nodes are in the middle of cells, after the one in the air; edges, cubes and quads lie about them.
        low, high = np.floor(box[0]).astype(np.int64), np.ceil(box[1]).astype(np.int64)
        self._find_signs(np.clip([low, high + 2], 1, held - 1))
        edges = np.clip([low - 1, high + 3], 0, held)
        for d in range(3):
            self._find_crossings(d, edges)
        self._find_vertices(np.clip([low - 1, high + 2], 0, held - 1))
        for d in range(3):
            self._find_quads(d, edges, step)

    def _find_signs(self, window: IntArray) -> None:
        """Tell which nodes of a window, (2, 3), are in the material, by the Z rays."""
        from fiveaxis.check.stock.rays import covered

        stock, rays = self.stock, self.stock.bundles[2]
        x, y, z = np.ix_(*map(np.arange, *window))
        ray, place = np.broadcast_arrays((x - 1) * stock.cells[1] + y - 1, (z - 0.5) * stock.pitch[2])
        inside = covered(rays.ends, rays.count, ray.ravel(), place.ravel())
        self.sign[_slices(window)] = inside.reshape(ray.shape)

    def _find_crossings(self, d: int, window: IntArray) -> None:
        """Find where edges along d, from a window's nodes on, cross the surface, mm; NaN for none."""
        stock, rays, along = self.stock, self.stock.bundles[d], np.eye(3, dtype=np.int64)[d]
        self.cross[d][_slices(window)] = np.nan
        inner = np.minimum(window, np.array(self.sign.shape) - along)
        changes = self.sign[_slices(inner)] != self.sign[_slices(inner + along)]
        at = np.argwhere(changes) + inner[0]
        leaves = self.sign[tuple(at.T)][:, None]
        u, v = (d + 1) % 3, (d + 2) % 3
        ray = (at[:, u] - 1) * stock.cells[v] + at[:, v] - 1
        some = rays.at(ray)
        ends = np.where(leaves, some.ends[:, 1::2], some.ends[:, ::2])
        low = (at[:, d, None] - 0.5) * stock.pitch[d]
        high = low + stock.pitch[d]
        on_edge = some.held[:, ::2] & (low - ROUNDED <= ends) & (ends <= high + ROUNDED)
        first = np.take_along_axis(ends, on_edge.argmax(axis=1, keepdims=True), axis=1)
        place = np.where(on_edge.any(axis=1, keepdims=True), first, (low + high) / 2.0)
        self.cross[d][tuple(at.T)] = place[:, 0]

    def _find_vertices(self, window: IntArray) -> None:
        """Put a vertex into each cube of a window that has crossings, at their mean.

        A vertex that stays where it was keeps its number, any other gets the next one; -1 is none.
        """
        corners = [self.sign[_slices(window + corner)] for corner in CORNERS]
        crossed = np.any(corners, axis=0) & ~np.all(corners, axis=0)
        self.vertex[_slices(window)][~crossed] = -1
        at = np.argwhere(crossed) + window[0]
        total, found = np.zeros((len(at), 3)), np.zeros((len(at), 1))
        for d, first in EDGES:
            edge = at + first
            place = (edge - 0.5) * self.stock.pitch
            place[:, d] = self.cross[d][tuple(edge.T)]
            known = np.isfinite(place[:, d, None])
            total += np.where(known, place, 0.0)
            found += known
        mean, number = total / found, self.vertex[tuple(at.T)]
        stays = number >= 0
        away = np.abs(self.points[number[stays]] - mean[stays]) > STILL * self.stock.pitch
        stays[stays] = ~away.any(axis=1)
        number[~stays] = self._append("points", mean[~stays])
        self.vertex[tuple(at.T)] = number

    def _find_quads(self, d: int, window: IntArray, step: int) -> None:
        """Put a quad about each edge along d that crosses the surface, in a window.

        One whose vertices stay is kept; any other ends its life at this step, and a new one begins.
        """
        at = np.argwhere(np.isfinite(self.cross[d][_slices(window)])) + window[0]
        # Seen from outside anticlockwise, whether the edge leaves or enters the material.
        around = np.stack([self.vertex[tuple((at - back).T)] for back in AROUND[d]], axis=1)
        around = np.where(self.sign[tuple(at.T)][:, None], around, around[:, ::-1])
        number, held = self.quad[d][tuple(at.T)], self.quad[d][_slices(window)]
        stays = number >= 0
        stays[stays] = (self.quads[number[stays]] == around[stays]).all(axis=1)
        self.lives[held[held >= 0], 1] = step
        self.lives[number[stays], 1] = STAYS
        number[~stays] = self._append("quads", around[~stays])
        self._append("lives", np.tile([step, STAYS], (len(around) - int(stays.sum()), 1)))
        held[:] = -1
        self.quad[d][tuple(at.T)] = number

    def _append(self, name: str, rows: Array) -> IntArray:
        """Append rows to what was found, with room for as many again, and return their numbers."""
        held, begin = getattr(self, name), self.count[name]
        end = self.count[name] = begin + len(rows)
        if end > len(held):
            held = np.concatenate([held[:begin], np.empty((end, held.shape[1]), held.dtype)])
            setattr(self, name, held)
        held[begin:end] = rows
        return np.arange(begin, end)

    def playback(self, removed: Array) -> Playback:
        """Return what was found in all steps, in which so much was removed, (s,) mm³."""
        points, many = self.count["points"], self.count["quads"]
        vertices, cell = self.stock.low + self.points[:points], self.stock.resolution
        return Playback(vertices, self.quads[:many], self.lives[:many], cell, removed)


def _slices(window: IntArray) -> tuple[slice, ...]:
    """Return a window, (2, 3), as slices."""
    return tuple(map(slice, *window))


def stride_of(stock: Stock) -> int:
    """Return the cells from node to node of the lattice that a mesh is made on."""
    return max(1, int(np.ceil(stock.cells.max() / MOST_NODES)))


def mesh_of(stock: Stock) -> Mesh:
    """Make a closed mesh of a stock, mm, on a lattice of at most `MOST_NODES` along its longest side."""
    return _Nets(stock.thinned(stride_of(stock))).playback(np.zeros(0)).mesh()
