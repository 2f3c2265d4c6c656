"""What a mask admits, for searches: approximately everywhere, exactly where a query is worth its cost.

A search of a whole path considers a million postures. A mask without rough answers is queried on a grid of
rotary angles at some of the locations, each node once and only when a search needs it; a posture then gets
the answer of the nearest node at the nearest such location.
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

# Approximate distance of nodes in each rotary angle (rad), and stride of their locations.
NODE_STEP, NODE_STRIDE = 4.0 * DEGREE, 12
# State of a node.
UNKNOWN, REFUSED, CLEAN = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Nodes:
    """Angles of a rotary axis at which a mask is queried.

    Parameters
    ----------
    first, step : rad
    count : of the nodes
    period : rad, after which they repeat; 0 if they don't
    """

    first: float
    step: float
    count: int
    period: float

    @classmethod
    def of(cls, limits: Limits) -> Nodes:
        """Space nodes over the range of an axis, at most one turn."""
        width = limits.span
        if width >= TURN:
            count = int(np.ceil(TURN / NODE_STEP))
            return cls(one_turn_from(limits), TURN / count, count, TURN)
        count = int(np.ceil(width / NODE_STEP)) + 1
        return cls(one_turn_from(limits), width / max(count - 1, 1) or 1.0, count, 0.0)

    def nearest(self, angle: Array) -> IntArray:
        """Find the indices of the nodes nearest to angles, rad."""
        number = np.rint((angle - self.first) / self.step).astype(np.int64)
        return number % self.count if self.period else np.clip(number, 0, self.count - 1)


@dataclass(eq=False)
class NodeMap:
    """A mask's answers on a grid, queried on demand.

    Parameters
    ----------
    mask : what is queried
    rows : (m,), its locations
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
        """Span the postures of a path with a grid."""
        count = len(problem)
        rows = np.unique(np.append(np.arange(0, count, NODE_STRIDE), count - 1)).astype(np.int64)
        limits = [problem.machine.axes[column].limits for column in problem.machine.rotary_columns]
        return cls(mask, rows, (Nodes.of(limits[0]), Nodes.of(limits[1])))

    def admits(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Return approximately which postures, (m, 2) rad, of locations, (m,), are admissible."""
        middles = (self.rows[1:] + self.rows[:-1]) / 2.0
        nearest = np.searchsorted(middles, rows)
        first, second = (n.nearest(rotary[:, i]) for i, n in enumerate(self.nodes))
        cell = np.ravel_multi_index((nearest, first, second), self._known.shape)
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
    mask : exact
    nodes : its answers on a grid, for a mask without rough ones
    rows : (n,), the path's locations in question
    """

    mask: Mask
    nodes: NodeMap | None
    rows: IntArray

    @classmethod
    def of(cls, mask: Mask, problem: Problem) -> Clearance:
        """Describe all locations of a path."""
        nodes = None if mask.is_rough else NodeMap.of(mask, problem)
        return cls(mask, nodes, np.arange(len(problem)))

    def at(self, rows: IntArray) -> Clearance:
        """Return what is admitted at some of the locations."""
        return replace(self, rows=self.rows[rows])

    def exactly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Query the mask itself for postures, (m, 2) rad, of locations, (m,)."""
        return self.mask.admits(self.rows[rows], rotary)

    def admits(self, path: Array) -> BoolArray:
        """Query the mask itself for a path through all locations, (n, 2) rad."""
        return self.mask.admits(self.rows, path)

    def roughly(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Return approximately which postures, (m, 2) rad, of locations, (m,), are admissible."""
        if self.nodes is None:
            return self.mask.roughly_admits(self.rows[rows], rotary)
        return self.nodes.admits(self.rows[rows], rotary)

    def priced(self, lattice: Lattice, columns: list[int], price: float) -> Lattice:
        """Return the lattice with a price, J, on states that are roughly refused; infinite forbids them.

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
