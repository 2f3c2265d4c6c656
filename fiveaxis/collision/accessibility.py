"""Postures that keep the tool clear of the workpiece side: the optimiser's collision mask.

Whether the tool clears the part depends only on the tool axis, not on the kinematic branch or the turn count
that reaches it. So answers are cached by location and by cell of tool-axis directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import Any

import numpy as np

from fiveaxis.collision.obstacles import Obstacle
from fiveaxis.geometry import Array, BoolArray, IntArray, normalise
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath

# Cells per side of the map of directions: about 3 deg each, the spacing of a search's postures.
CELLS = 64
UNKNOWN, CLEAR, BLOCKED = 0, 1, 2


@dataclass(eq=False)
class Accessibility:
    """A mask that admits the postures in which no solid of the tool reaches into an obstacle.

    A call answers exactly. `rough` answers for the centre of the direction cell that a posture falls in, from
    a map that is filled on demand. Both answers depend on the query alone, so neither the order of queries
    nor threads change them.

    Parameters
    ----------
    toolpath : contact points, which the tool keeps at any lean
    machine : its rotary axes set the tool's direction
    obstacles : bodies to stay clear of
    tested : number of postures tested, those found in the map not counted
    """

    toolpath: Toolpath
    machine: Machine
    obstacles: Sequence[Obstacle]
    tested: int = 0
    _slots: dict[int, int] = field(default_factory=dict, repr=False)
    _map: Array = field(default_factory=lambda: np.zeros((0, CELLS * CELLS), dtype=np.uint8), repr=False)
    _lock: Any = field(default_factory=Lock, repr=False)

    def __call__(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check exactly which postures are clear.

        Parameters
        ----------
        rows : (m,), locations
        rotary : (m, 2), rad, chain order

        Returns
        -------
        (m,), True where every solid keeps its clearance to every obstacle
        """
        return self.clear(rows, tool_axes(self.machine, rotary))

    def clear(self, rows: IntArray, axis: Array) -> BoolArray:
        """Check exactly which tool axes, (m, 3) unit vectors in the workpiece frame, are clear; (m,)."""
        tip = self._tips(rows, axis)
        self.tested += len(rows)
        free = np.ones(len(rows), dtype=bool)
        for obstacle in self.obstacles:
            open_rows = np.flatnonzero(free)
            free[open_rows] = ~obstacle.hit_by(tip[open_rows], axis[open_rows])
        return free

    def blockers(self, row: int, axis: Array) -> dict[str, float]:
        """Find what blocks tool axes, (m, 3) unit vectors, at a location: pair of bodies → share of them."""
        tip = self._tips(np.full(len(axis), row), axis)
        blocked: dict[str, BoolArray] = {}
        for obstacle in self.obstacles:
            for solid in obstacle.solids:
                pair = f"{solid.name} with {obstacle.name}"
                hit = replace(obstacle, solids=(solid,)).hit_by(tip, axis)
                blocked[pair] = blocked.get(pair, False) | hit
        shares = {pair: float(hit.mean()) for pair, hit in blocked.items() if hit.any()}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def rough(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check which postures are clear at the centre of their cell; arguments as for `__call__`."""
        with self._lock:
            return self._look_up(rows, cells_of(tool_axes(self.machine, rotary), CELLS)) == CLEAR

    def _tips(self, rows: IntArray, axis: Array) -> Array:
        path = self.toolpath
        return path.zone.tip(path.pivot[rows], np.nan_to_num(path.normal[rows]), axis)

    def _look_up(self, rows: IntArray, cells: IntArray) -> Array:
        kinds, which = np.unique(rows, return_inverse=True)
        new = [int(row) for row in kinds if int(row) not in self._slots]
        for row in new:
            self._slots[row] = len(self._slots)
        if len(self._slots) > len(self._map):
            # Twice as many as needed: locations come a few at a time.
            more = np.zeros((2 * len(self._slots) - len(self._map), CELLS * CELLS), dtype=np.uint8)
            self._map = np.concatenate([self._map, more])
        slots = np.array([self._slots[int(row)] for row in kinds], dtype=np.int64)[which]
        keys, flat = slots * (CELLS * CELLS) + cells, self._map.reshape(-1)
        unknown = np.flatnonzero(flat[keys] == UNKNOWN)
        if len(unknown):
            new_keys, first = np.unique(keys[unknown], return_index=True)
            free = self.clear(rows[unknown[first]], cell_centres(new_keys % (CELLS * CELLS), CELLS))
            flat[new_keys] = np.where(free, CLEAR, BLOCKED)
        return flat[keys]


def cells_of(directions: Array, count: int) -> IntArray:
    """Find the cell of each direction, (m, 3) of any length, in a map of `count` cells per side; (m,).

    The sphere is projected onto an octahedron and unfolded to a square, which is divided into equal cells.
    Unlike on a grid of longitude and latitude, neighbouring directions share a cell or lie in neighbouring
    ones, and the cells are of similar size.
    """
    x, y, z = (directions / np.abs(directions).sum(axis=1, keepdims=True)).T
    # The lower half is folded outwards over the square's corners.
    folded = 1.0 - np.abs(np.stack([y, x]))
    u, v = np.where(z < 0.0, np.copysign(folded, np.stack([x, y])), np.stack([x, y]))
    column, row = (np.clip(((c + 1.0) / 2.0 * count).astype(np.int64), 0, count - 1) for c in (u, v))
    return np.asarray(row * count + column)


def cell_centres(cells: IntArray, count: int) -> Array:
    """Return the direction at the centre of each cell, (m, 3) unit vectors; the inverse of `cells_of`."""
    row, column = np.divmod(cells, count)
    u, v = (2.0 * (column + 0.5) / count - 1.0, 2.0 * (row + 0.5) / count - 1.0)
    z = 1.0 - np.abs(u) - np.abs(v)
    folded = np.maximum(-z, 0.0)
    return normalise(np.column_stack([u - np.copysign(folded, u), v - np.copysign(folded, v), z]))
