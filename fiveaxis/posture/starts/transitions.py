"""The cost of getting from pass to pass, for every pair of openings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.geometry import Array, IntArray, product
from fiveaxis.kinematics import positions_about
from fiveaxis.kinematics.windings import TURN
from fiveaxis.motion import times_rapids
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.starts.reopening import Layout, Side
from fiveaxis.posture.starts.rings import Opening

# Where passes join, a step between them may be longer by this share than the longest one of the path, or than
# the shortest possible.
LONGER = 0.1


@dataclass(frozen=True, eq=False)
class Transitions:
    """Prices of the moves between passes, at the postures found so far.

    On a link the postures are taken to turn evenly from one pass to the next; the refinement that follows
    finds cheaper ones.

    Parameters
    ----------
    problem : of the path as it is
    layout : its rings and links
    rotary : (n, 2), rad, chain order
    """

    problem: Problem
    layout: Layout
    rotary: Array

    @cached_property
    def positions(self) -> Array:
        """(n, k), mm and rad."""
        return self.problem.positions(slice(None), self.rotary)

    @cached_property
    def longest(self) -> float:
        """The longest step, mm, by which one pass joins the next."""
        rings, pivot = self.layout.rings, self.problem.pivot
        joined = [k for k in range(1, len(rings)) if not len(self.layout.link_rows(k))]
        steps = [np.linalg.norm(pivot[rings[k].first] - pivot[rings[k - 1].last], axis=-1) for k in joined]
        return float(max(steps, default=0.0))

    def saved(self, number: int, openings: Sequence[Opening]) -> Array:
        """Price the step that each opening of a ring leaves out, (s,) J; 0 if the first row is repeated."""
        ring = self.layout.rings[number]
        if ring.again or not ring.closed:
            return np.zeros(len(openings))
        return np.diagonal(self._steps(*self._ends(number, openings), ring.first))

    def between(self, number: int, leaving: Sequence[Opening], arriving: Sequence[Opening]) -> Array:
        """Price the moves to a ring from the one before, (e, s) J; infinite where there is none.

        Where passes join, the step has to be about as short as possible (`LONGER`).
        """
        if len(self.layout.link_rows(number)):
            return self._links([(number - 1, o) for o in leaving], [(number, o) for o in arriving], number)
        ends, starts = self._ends(number - 1, leaving)[0], self._ends(number, arriving)[1]
        row = self.layout.rings[number].first
        length = np.linalg.norm(self.problem.pivot[ends][:, None] - self.problem.pivot[starts][None], axis=2)
        cost = self._steps(ends, starts, row) + self._pace(row) * length
        nearest = (1.0 + LONGER) * np.maximum(length.min(axis=1, keepdims=True), self.longest)
        return np.where(length <= nearest, cost, np.inf)

    def approach(self, openings: Sequence[Opening]) -> Array:
        """Price the approach to the first ring, (s,) J."""
        if not len(self.layout.link_rows(0)):
            return np.zeros(len(openings))
        return self._links([None], [(0, o) for o in openings], 0)[0]

    def retract(self, openings: Sequence[Opening]) -> Array:
        """Price the retract from the last ring, (e,) J."""
        link = len(self.layout.rings)
        if not len(self.layout.link_rows(link)):
            return np.zeros(len(openings))
        return self._links([(link - 1, o) for o in openings], [None], link)[:, 0]

    def _ends(self, number: int, openings: Sequence[Opening]) -> tuple[IntArray, IntArray]:
        """Rows at which a ring ends and begins, (s,) each."""
        rows = [self.layout.rings[number].rows(opening)[[-1, 0]] for opening in openings]
        ends, starts = np.array(rows).T
        return ends, starts

    def _pace(self, row: int) -> float:
        """Price of a mm at the feed of the move to a row, J/mm; a rapid's time goes with its axes' travel."""
        if self.layout.path.rapid[row] and times_rapids(self.problem.machine):
            return 0.0
        return self.problem.time_price / float(self.layout.path.feed[row])

    def _steps(self, ends: IntArray, starts: IntArray, row: int) -> Array:
        """Price steps from rows to rows, (e, s) J, at the prices of the step that ends at a row."""
        step = self.positions[starts][None] - self.positions[ends][:, None]
        columns = self.problem.machine.rotary_columns
        step[..., columns] = nearest_turn(step[..., columns])
        return self._travel(step, row)

    def _travel(self, step: Array, row: int) -> Array:
        price = max(row - 1, 0)
        plus, minus = self.problem.plus[price], self.problem.minus[price]
        return product(np.maximum(step, 0.0), plus) - product(np.minimum(step, 0.0), minus)

    def _links(self, leaving: Sequence[Side], arriving: Sequence[Side], link: int) -> Array:
        """Price the links between openings, (e, s) J; infinite where there is none."""
        pairs = [(a, b) for a in leaving for b in arriving]
        pivots = [self.layout.link_pivots(a, b) for a, b in pairs]
        chains = [self._chain(*pair, p) for pair, p in zip(pairs, pivots, strict=True) if p is not None]
        cost = np.full(len(pairs), np.inf)
        if chains:
            exists = [p is not None for p in pivots]
            cost[exists] = self._chain_costs(chains, int(self.layout.link_rows(link)[-1]))
        return cost.reshape(len(leaving), len(arriving))

    def _chain(self, leaving: Side, arriving: Side, pivots: Array) -> tuple[Array, Array]:
        """Put a link between its ends: pivots with normals, (m, 6), and angles, (m, 2) rad."""
        problem, sides = self.problem, ((leaving, -1), (arriving, 0))
        rows = [[] if s is None else [int(self.layout.opened_rows(s)[end])] for s, end in sides]
        before, after = (np.hstack([problem.pivot[row], problem.normal[row]]) for row in rows)
        chain = np.vstack([before, np.hstack([pivots, np.zeros_like(pivots)]), after])
        known = rows[0] + rows[1]
        first, last = self.rotary[known[0]], self.rotary[known[-1]]
        travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain[:, :3], axis=0), axis=1))])
        share = travelled / travelled[-1] if travelled[-1] > 0.0 else travelled
        return chain, first + share[:, None] * nearest_turn(last - first)

    def _chain_costs(self, chains: Sequence[tuple[Array, Array]], row: int) -> Array:
        """Price links with their ends, (c,) J, at the prices of the move to a row."""
        points, rotary = (np.vstack(column) for column in zip(*chains, strict=True))
        problem = self.problem
        positions = positions_about(problem.machine, points[:, :3], rotary, problem.zone, points[:, 3:])[0]
        length = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
        cost = self._travel(np.diff(positions, axis=0), row) + self._pace(row) * length
        firsts = np.cumsum([0, *(len(chain) for chain, _ in chains)])
        # Nothing moves from the end of one link to the start of the next.
        cost[firsts[1:-1] - 1] = 0.0
        summed: Array = np.add.reduceat(cost, firsts[:-1])
        return summed


def nearest_turn(angle: Array) -> Array:
    """Take whole turns off angles, rad, so that they lie within half a turn of 0."""
    return np.remainder(angle + np.pi, TURN) - np.pi
