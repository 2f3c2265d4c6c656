"""Which postures keep the tool clear of what stands with the workpiece: the mask of the optimiser.

Tool against part depends on the direction of the tool alone, not on the branch that reaches it nor on the
turn of an axis. So what was asked is remembered by location and cell of directions, and shared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import Any

import numpy as np

from fiveaxis.collision.directions import cell_centres, cells_of
from fiveaxis.collision.obstacles import Obstacle
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath

# Cells to a side of the map of directions: some 3 deg each, as far apart as the postures of a search.
CELLS = 64
UNKNOWN, CLEAR, MET = 0, 1, 2


@dataclass(eq=False)
class Accessibility:
    """A mask that admits the postures in which no solid of the tool reaches into an obstacle.

    Called with locations and rotary angles it answers exactly for each; `rough` answers for the middle of the
    cell of directions that a posture lies in, from a map that is filled as it is asked. Both answers
    depend on the question alone, so neither the order of questions nor threads change anything.

    Parameters
    ----------
    toolpath : the tool touches where this says, however it leans
    machine : its rotary axes give the tool's direction
    obstacles : what must stay clear
    asked : postures that were looked at, those found in the map not counted
    """

    toolpath: Toolpath
    machine: Machine
    obstacles: Sequence[Obstacle]
    asked: int = 0
    _slots: dict[int, int] = field(default_factory=dict, repr=False)
    _map: Array = field(default_factory=lambda: np.zeros((0, CELLS * CELLS), dtype=np.uint8), repr=False)
    _lock: Any = field(default_factory=Lock, repr=False)

    def __call__(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell exactly which postures are clear.

        Parameters
        ----------
        rows : (m,), locations
        rotary : (m, 2), rad, chain order

        Returns
        -------
        (m,), True where every solid is clear of every obstacle by its clearance
        """
        return self.clear(rows, tool_axes(self.machine, rotary))

    def clear(self, rows: IntArray, axis: Array) -> BoolArray:
        """Tell exactly which tool axes, (m, 3) unit vectors in the workpiece frame, are clear; (m,)."""
        path = self.toolpath
        tip = path.zone.tip(path.pivot[rows], np.nan_to_num(path.normal[rows]), axis)
        self.asked += len(rows)
        free = np.ones(len(rows), dtype=bool)
        for obstacle in self.obstacles:
            open_rows = np.flatnonzero(free)
            free[open_rows] = ~obstacle.met(tip[open_rows], axis[open_rows])
        return free

    def blockers(self, row: int, axis: Array) -> dict[str, float]:
        """Tell what blocks tool axes, (m, 3) unit vectors, at a location: pair of bodies → share of them."""
        rows = np.full(len(axis), row)
        path = self.toolpath
        tip = path.zone.tip(path.pivot[rows], np.nan_to_num(path.normal[rows]), axis)
        met: dict[str, BoolArray] = {}
        for obstacle in self.obstacles:
            for solid in obstacle.solids:
                pair = f"{solid.name} with {obstacle.name}"
                hit = replace(obstacle, solids=(solid,)).met(tip, axis)
                met[pair] = met[pair] | hit if pair in met else hit
        shares = {pair: float(hit.mean()) for pair, hit in met.items() if hit.any()}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def rough(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell about which postures are clear, by the middle of their cell; as `__call__` otherwise."""
        with self._lock:
            return self._looked_up(rows, cells_of(tool_axes(self.machine, rotary), CELLS)) == CLEAR

    def _looked_up(self, rows: IntArray, cells: IntArray) -> Array:
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
            places, first = np.unique(keys[unknown], return_index=True)
            asked = rows[unknown[first]]
            free = self.clear(asked, cell_centres(places % (CELLS * CELLS), CELLS))
            flat[places] = np.where(free, CLEAR, MET)
        return flat[keys]
