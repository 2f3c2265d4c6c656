"""What a mask admits, for searches: roughly everywhere, exactly where it is worth asking.

A search of a whole path looks at a million postures. Where a mask has no rough answer of its own, it is asked
on a grid of rotary angles at some of the locations, each node once and only when a search wants to know; a
posture then counts as its nearest node at the nearest such location does.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN, one_turn_from
from fiveaxis.machine import Limits
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.lattice import Lattice
from fiveaxis.posture.strategy.effort import DEGREE

# Nodes lie about this far apart in each rotary angle (rad), at every so many-th location.
NODE_STEP, NODE_STRIDE = 4.0 * DEGREE, 12
# What is known of a node.
UNKNOWN, REFUSED, CLEAN = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Nodes:
    """Angles of a rotary axis at which a mask is asked.

    Parameters
    ----------
    first, step : rad
    count : of the nodes
    period : rad, after which they come again; 0 for none
    """

    first: float
    step: float
    count: int
    period: float

    @classmethod
    def of(cls, limits: Limits) -> Nodes:
        """Lay nodes over the range of an axis, or over one turn of it."""
        width = limits.high - limits.low
        if width >= TURN:
            count = int(np.ceil(TURN / NODE_STEP))
            return cls(one_turn_from(limits), TURN / count, count, TURN)
        count = int(np.ceil(width / NODE_STEP)) + 1
        return cls(limits.low, width / max(count - 1, 1) or 1.0, count, 0.0)

    def nearest(self, angle: Array) -> IntArray:
        """Find the numbers of the nodes next to angles, rad."""
        number = np.rint((angle - self.first) / self.step).astype(np.int64)
        return number % self.count if self.period else np.clip(number, 0, self.count - 1)


@dataclass(eq=False)
class NodeMap:
    """A mask's answers on a grid, asked when they are wanted.

    Parameters
    ----------
    mask : asked
    rows : (m,), locations at which it is asked
    nodes : of both rotary axes, chain order
    """

    mask: Mask
    rows: IntArray
    nodes: tuple[Nodes, Nodes]
    _known: NDArray[np.int8] = field(init=False)

    def __post_init__(self) -> None:
        self._known = np.zeros((len(self.rows), *(n.count for n in self.nodes)), dtype=np.int8)

    @classmethod
    def of(cls, mask: Mask, problem: Problem) -> NodeMap:
        """Lay a grid over the postures of a path."""
        count = len(problem)
        rows = np.unique(np.append(np.arange(0, count, NODE_STRIDE), count - 1)).astype(np.int64)
        limits = [problem.machine.axes[column].limits for column in problem.machine.rotary_columns]
        return cls(mask, rows, (Nodes.of(limits[0]), Nodes.of(limits[1])))

    def admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell about which postures, (m, 2) rad, of locations, (m,), are admissible."""
        middles = (self.rows[1:] + self.rows[:-1]) / 2.0
        place = np.searchsorted(middles, rows)
        first, second = (n.nearest(rotary[:, i]) for i, n in enumerate(self.nodes))
        cell = np.ravel_multi_index((place, first, second), self._known.shape)
        known = self._known.reshape(-1)
        wanted = np.unique(cell[known[cell] == UNKNOWN])
        if len(wanted):
            at = np.unravel_index(wanted, self._known.shape)
            angles = [n.first + n.step * number for n, number in zip(self.nodes, at[1:], strict=True)]
            clean = self.mask.admits(self.rows[at[0]], np.stack(angles, axis=1))
            known[wanted] = np.where(clean, CLEAN, REFUSED)
        answer: BoolArray = known[cell] == CLEAN
        return answer


@dataclass(frozen=True, eq=False)
class Clearance:
    """What a mask admits along a path, or at some of its locations.

    Parameters
    ----------
    mask : the last word
    nodes : its answers on a grid, for a mask that has no rough ones
    rows : (n,), the path's locations that this one's are
    """

    mask: Mask
    nodes: NodeMap | None
    rows: IntArray

    @classmethod
    def of(cls, mask: Mask, problem: Problem) -> Clearance:
        """Take all locations of a path."""
        nodes = None if mask.is_rough else NodeMap.of(mask, problem)
        return cls(mask, nodes, np.arange(len(problem)))

    def at(self, rows: IntArray) -> Clearance:
        """Return what is admitted at some of the locations."""
        return replace(self, rows=self.rows[rows])

    def exactly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Ask the mask itself about postures, (m, 2) rad, of locations, (m,)."""
        return self.mask.admits(self.rows[rows], rotary)

    def roughly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell about which postures, (m, 2) rad, of locations, (m,), are admissible."""
        if self.nodes is None:
            return self.mask.roughly_admits(self.rows[rows], rotary)
        return self.nodes.admits(self.rows[rows], rotary)

    def priced(self, lattice: Lattice, columns: list[int], price: float) -> Lattice:
        """Return the lattice with a price on states that are roughly not admissible; infinite forbids them.

        Parameters
        ----------
        columns : of the rotary axes
        """

        def states(rows: IntArray) -> tuple[Array, Array]:
            positions, prices = lattice.states(rows)
            at = np.nonzero(np.isfinite(prices))
            clean = self.roughly(rows[at[0]], positions[at][:, columns])
            prices = prices.copy()
            prices[at] += np.where(clean, 0.0, price)
            return positions, prices

        return replace(lattice, states=states)
