"""Corners of a lattice over both rotary angles and the linear axes, near the postures of one location.

A location *touches* every corner of each box of the lattice in which its postures may lie. Touched corners
are kept in groups, one for each corner of the rotary angles: a dense block over the linear axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.posture.bound.cells import Enclosed, Side

# Stands for "not reached" among costs, in quanta, and for no corner; a 32-bit number, as costs are.
FAR = np.int64(1) << 30


@dataclass(frozen=True, eq=False)
class Lattice:
    """A lattice over both rotary angles and the linear axes, the same for a whole path.

    Parameters
    ----------
    sides : cells of the rotary angles
    factor : how many cells are one step of a rotary angle; it divides the cells of an angle that wraps
    low, high : (3,) mm, between which the linear axes are enclosed: postures beyond are moved onto the end,
        which makes no path longer
    step : (3,) mm
    """

    sides: tuple[Side, Side]
    factor: int
    low: Array
    high: Array
    step: Array

    @property
    def counts(self) -> tuple[int, int]:
        """Corners of each rotary angle; the last one of an angle that wraps is next to the first."""
        first, second = (-(-side.parts // self.factor) + (not side.wraps) for side in self.sides)
        return first, second

    @property
    def steps(self) -> Array:
        """(5,) rad and mm, both rotary angles first."""
        return np.array([*(side.step * self.factor for side in self.sides), *self.step])

    def touch(self, enclosed: Enclosed) -> Corners:
        """Find the corners that a location touches."""
        cell, low, high = enclosed
        top = np.ceil((self.high - self.low) / self.step)
        # A cell lies between this corner of the rotary angles and the next.
        at = np.stack(np.divmod(cell, self.sides[1].parts), axis=1) // self.factor
        first = np.clip(np.floor((low - self.low) / self.step), 0.0, top).astype(np.int64)
        last = np.clip(np.ceil((high - self.low) / self.step), 0.0, top).astype(np.int64)
        return Corners(*_touch(at, first, last, self.counts), len(at))


class Corners(NamedTuple):
    """The corners that a location touches, in g groups.

    Parameters
    ----------
    at : (g, 2), corner of both rotary angles of each group
    group : (p, q), group of each corner of the rotary angles, −1 for none
    first, extent : (g, 3), corners of the linear axes: the lowest of the block, and how many
    start : (g + 1,), where the blocks begin in the arrays of all corners, the last linear axis fastest
    touched : (n,), corners of blocks that are touched
    cost : (n,), least cost of reaching each corner, in quanta; `FAR` for those that aren't touched
    cells : of the rotary angles that touch corners
    """

    at: IntArray
    group: IntArray
    first: IntArray
    extent: IntArray
    start: IntArray
    touched: BoolArray
    cost: IntArray
    cells: int


@compiled
def _touch(
    cell: IntArray, first: IntArray, last: IntArray, counts: tuple[int, int]
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray, BoolArray, IntArray]:
    """Group the touched corners of cells that lie behind a corner of the rotary angles; see `Corners`."""
    at, group, low, extent, start = _blocks(cell, first, last, counts)
    touched = np.zeros(start[-1], np.bool_)
    for c in range(len(cell)):
        for i in (cell[c, 0], (cell[c, 0] + 1) % counts[0]):
            for j in (cell[c, 1], (cell[c, 1] + 1) % counts[1]):
                g = group[i, j]
                for a in range(first[c, 0] - low[g, 0], last[c, 0] - low[g, 0] + 1):
                    for b in range(first[c, 1] - low[g, 1], last[c, 1] - low[g, 1] + 1):
                        row = start[g] + (a * extent[g, 1] + b) * extent[g, 2] - low[g, 2]
                        for n in range(row + first[c, 2], row + last[c, 2] + 1):
                            touched[n] = True
    return at, group, low, extent, start, touched, np.full(start[-1], FAR, np.int32)


@compiled
def _blocks(
    cell: IntArray, first: IntArray, last: IntArray, counts: tuple[int, int]
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray]:
    """Find the blocks of the corners of the rotary angles at some cells: the first five of `Corners`."""
    lowest, highest = np.full((*counts, 3), FAR), np.full((*counts, 3), -FAR)
    for c in range(len(cell)):
        for i in (cell[c, 0], (cell[c, 0] + 1) % counts[0]):
            for j in (cell[c, 1], (cell[c, 1] + 1) % counts[1]):
                for k in range(3):
                    lowest[i, j, k] = min(lowest[i, j, k], first[c, k])
                    highest[i, j, k] = max(highest[i, j, k], last[c, k])
    most = counts[0] * counts[1]
    at, group, groups = np.empty((most, 2), np.int64), np.full(counts, -1), 0
    low, extent = np.empty((most, 3), np.int64), np.empty((most, 3), np.int64)
    start = np.zeros(most + 1, np.int64)
    for i in range(counts[0]):
        for j in range(counts[1]):
            if lowest[i, j, 0] > highest[i, j, 0]:
                continue
            at[groups, 0], at[groups, 1] = i, j
            group[i, j] = groups
            low[groups] = lowest[i, j]
            extent[groups] = highest[i, j] - lowest[i, j] + 1
            start[groups + 1] = start[groups] + extent[groups, 0] * extent[groups, 1] * extent[groups, 2]
            groups += 1
    return at[:groups], group, low[:groups], extent[:groups], start[: groups + 1]
