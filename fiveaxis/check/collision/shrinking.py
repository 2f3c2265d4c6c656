"""The stock as an obstacle that shrinks: shank and holder stay clear of what earlier moves have left of it.

The material is divided into voxels, each with the move that takes it away, and these are gathered into blocks
with the last of their moves. So one structure answers for every location of the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.cam import STACK, segment_gap
from fiveaxis.check.collision.obstacles import Solid, in_chunks, near_box
from fiveaxis.check.stock.cutting import Blank
from fiveaxis.check.stock.rays import covered
from fiveaxis.model import MoveKind, Toolpath

# Most voxels along the stock's longest side.
MOST_VOXELS = 160
# Voxels, as of `ShrinkingStock`: low, side, cells, begin and move.
Grid = tuple[Array, Array, IntArray, IntArray, NDArray[np.int32]]
# Move of voxels without material.
NEVER = -1


@dataclass(frozen=True, eq=False)
class ShrinkingStock:
    """Material that the moves of a path take away, and the solids of the tool that must stay clear of it.

    Only the ball about the pivot takes material, which is in the cutter at any lean: what the rest of it cuts
    depends on the postures. A voxel is at its centre; verification cuts the stock as finely as it is given.

    Parameters
    ----------
    name : stock
    solids : each grown by its clearance
    low, side : (3,), mm, low corner of the grid and sides of a voxel
    cells : (levels, 3), of the voxels, then of blocks of eight of the level before
    begin : (levels,), of each level's cells in `move`
    move : row of the path that takes a voxel away, the last such row of a block; the number of rows where it
        stays, `NEVER` where it was none
    """

    name: str
    solids: tuple[Solid, ...]
    low: Array
    side: Array
    cells: IntArray
    begin: IntArray
    move: NDArray[np.int32]

    @classmethod
    def build(cls, blank: Blank, toolpath: Toolpath, solids: tuple[Solid, ...]) -> ShrinkingStock:
        """Take away what the ball about the pivot sweeps in every move, rapid ones excepted.

        The part in the blank is an obstacle of its own.
        """
        stride = -(-int(blank.stock.cells.max()) // MOST_VOXELS)
        stock, part = (one.thinned(stride) for one in (blank.stock, blank.part))
        i, j, k = np.indices(tuple(stock.cells)).reshape(3, -1)
        rays, places = i * stock.cells[1] + j, (k + 0.5) * stock.pitch[2]
        whole, finished = (
            covered(b.ends, b.count, rays, places) for b in (stock.bundles[2], part.bundles[2])
        )
        left = np.where(whole & ~finished, len(toolpath), NEVER)
        move = left.astype(np.int32).reshape(stock.cells)
        zone, moving = toolpath.zone, np.flatnonzero(toolpath.kind != MoveKind.RAPID)
        # The arc of a barrel is larger than the cutter.
        if zone.radius and zone.offset >= 0.0:
            _take_away(move, stock.pitch, toolpath.pivot - stock.low, zone.radius, moving[moving > 0])
        return cls("stock", solids, stock.low, stock.pitch, *_gathered(move))

    def hit_by(self, rows: IntArray, tip: Array, axis: Array) -> BoolArray:
        """Find which tools reach into the material that is left when the location is reached, (m,).

        Tips and axes, (m, 3) mm and unit vectors, are in the workpiece frame; rows, (m,), are locations of
        the path.
        """
        grid = self.low, self.side, self.cells, self.begin, self.move
        return in_chunks(_meets_all, rows, tip, axis, self.solids, grid)


def _gathered(move: NDArray[np.int32]) -> tuple[IntArray, IntArray, NDArray[np.int32]]:
    """Gather voxels into blocks of eight, up to a single one: cells, first places and moves of the levels."""
    levels = [move]
    while max(levels[-1].shape) > 1:
        last = levels[-1]
        even = np.pad(last, [(0, n % 2) for n in last.shape], constant_values=NEVER)
        halves = [n // 2 for n in even.shape]
        levels.append(even.reshape(halves[0], 2, halves[1], 2, halves[2], 2).max(axis=(1, 3, 5)))
    cells = np.array([level.shape for level in levels], dtype=np.int64)
    begin = np.concatenate([[0], np.cumsum(cells.prod(axis=1))[:-1]]).astype(np.int64)
    return cells, begin, np.concatenate([level.ravel() for level in levels])


@compiled
def _take_away(move: NDArray[np.int32], side: Array, pivot: Array, radius: float, rows: IntArray) -> None:
    """Set the first of the moves to `rows`, ascending, in which a ball comes over a voxel's centre.

    `move`, of the voxels, is changed; pivots of the ball, (n, 3), are in mm from the grid's low corner.
    """
    first, behind = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    place = np.empty(3)
    kept = len(pivot)
    for row in rows:
        a, b = pivot[row - 1], pivot[row]
        for d in range(3):
            first[d] = max(0, int(np.ceil((min(a[d], b[d]) - radius) / side[d] - 0.5)))
            behind[d] = min(move.shape[d], int(np.floor((max(a[d], b[d]) + radius) / side[d] + 0.5)))
        for i in range(first[0], behind[0]):
            place[0] = (i + 0.5) * side[0]
            for j in range(first[1], behind[1]):
                place[1] = (j + 0.5) * side[1]
                for k in range(first[2], behind[2]):
                    place[2] = (k + 0.5) * side[2]
                    if move[i, j, k] == kept and segment_gap(place, a, b) <= radius * radius:
                        move[i, j, k] = row


@compiled
def _meets_all(
    rows: IntArray, tip: Array, axis: Array, frusta: Array, _begin: IntArray, grid: Grid
) -> BoolArray:
    """Find which tools, (m,), meet a voxel that is taken away after their rows."""
    low, side, cells, begin, move = grid
    met = np.zeros(len(tip), dtype=np.bool_)
    stack, box = np.empty((STACK, 4), dtype=np.int64), np.empty((1, 6))
    for m in range(len(tip)):
        place, along = (tip[m, 0], tip[m, 1], tip[m, 2]), (axis[m, 0], axis[m, 1], axis[m, 2])
        top = 1
        stack[0] = len(cells) - 1, 0, 0, 0
        while top > 0 and not met[m]:
            top -= 1
            level, i, j, k = stack[top]
            if move[begin[level] + (i * cells[level, 1] + j) * cells[level, 2] + k] <= rows[m]:
                continue
            for d in range(3):
                size = side[d] * 2.0**level
                box[0, d] = low[d] + (stack[top, d + 1] + 0.5) * size
                box[0, 3 + d] = size / 2.0 if level else 0.0
            if not near_box(place, along, frusta, box, 0):
                continue
            if level == 0:
                met[m] = True
                continue
            level -= 1
            for child in range(8):
                ci, cj, ck = 2 * i + child // 4, 2 * j + child // 2 % 2, 2 * k + child % 2
                if ci < cells[level, 0] and cj < cells[level, 1] and ck < cells[level, 2]:
                    stack[top] = level, ci, cj, ck
                    top += 1
    return met
