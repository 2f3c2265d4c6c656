"""The stock as a mesh, and as one mesh for all of the time in which it is cut (surface nets)."""

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
from fiveaxis.check.stock.sweeping import Poses, Sweep, swept
from fiveaxis.model import Tool

# Nodes along the longest side of the lattice that a mesh is made on.
MOST_NODES = 120
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
    sweeps = swept(tool, divided, moves, sweep_tolerance(thin.resolution), bounds)
    last = np.searchsorted(places, ends)
    by_step = tuple(sweep._replace(block=np.searchsorted(last, sweep.block)) for sweep in sweeps)
    for step in range(len(ends)):
        parts = of_blocks(by_step, step, step + 1)
        yield _lost(thin, parts) if parts else (None, 0.0)


def _lost(stock: Stock, parts: Sequence[Sweep]) -> tuple[Array | None, float]:
    """Cut, and return the box, (2, 3) in cells, in which rays have lost something, and how much, mm³."""
    from fiveaxis.check.stock.surface_nets import widen

    before = [(bundle.ends.copy(), bundle.count.copy()) for bundle in stock.bundles]
    removed = float(stock.cut(*parts, blocks=1).volume.mean())
    box = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
    for d, (bundle, (ends, count)) in enumerate(zip(stock.bundles, before, strict=True)):
        at = d, stock.pitch, stock.cells
        widen(*at, bundle.ends, bundle.count, ends, count, box)
        widen(*at, ends, count, bundle.ends, bundle.count, box)
    return (box if box[0, 0] < box[1, 0] else None), removed


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
        self.count = 0, 0
        self.renew(0, np.array([np.zeros(3), self.stock.cells]))

    def renew(self, step: int, box: Array) -> None:
        """Renew the surface in a box, (2, 3) in cells, in which rays have changed."""
        from fiveaxis.check.stock import surface_nets as loops

        stock, held = self.stock, np.array(self.sign.shape)
        at = stock.pitch, stock.cells
        # Nodes are in the middle of cells, after the one in the air; edges, cubes and quads lie about them.
        low, high = np.floor(box[0]).astype(np.int64), np.ceil(box[1]).astype(np.int64)
        nodes = np.clip([low, high + 2], 0, held)
        cubes, quads = (np.clip([low - 1, high + k], 0, held) for k in (2, 3))
        z = stock.bundles[2]
        loops.find_signs(*at, z.ends, z.count, nodes, self.sign)
        found = 0
        for d, bundle in enumerate(stock.bundles):
            found += loops.find_crossings(d, *at, bundle.ends, bundle.count, quads, self.sign, self.cross[d])
        self._make_room(4 * found, found)
        points, many = self.count
        points = loops.find_vertices(
            stock.pitch, cubes, self.sign, self.cross, self.vertex, self.points, points
        )
        for d in range(3):
            held_by = self.sign, self.cross[d], self.vertex, self.quad[d]
            many = loops.find_quads(d, quads, *held_by, self.quads, self.lives, step, many)
        self.count = points, many

    def _make_room(self, points: int, quads: int) -> None:
        """Make room for more vertices and quads."""
        for name, more in (("points", points), ("quads", quads), ("lives", quads)):
            held, many = getattr(self, name), self.count[name != "points"]
            if many + more > len(held):
                room = np.full((max(many + more, 2 * len(held)), held.shape[1]), STAYS, held.dtype)
                room[: len(held)] = held
                setattr(self, name, room)

    def playback(self, removed: Array) -> Playback:
        """Return what was found in all steps, in which so much was removed, (s,) mm³."""
        points, many = self.count
        vertices, cell = self.stock.low + self.points[:points], self.stock.resolution
        return Playback(vertices, self.quads[:many], self.lives[:many], cell, removed)


def stride_of(stock: Stock) -> int:
    """Return the cells from node to node of the lattice that a mesh is made on."""
    return max(1, int(np.ceil(stock.cells.max() / MOST_NODES)))


def mesh_of(stock: Stock) -> Mesh:
    """Make a closed mesh of a stock, mm, on a lattice of at most `MOST_NODES` along its longest side."""
    return _Nets(stock.thinned(stride_of(stock))).playback(np.zeros(0)).mesh()
