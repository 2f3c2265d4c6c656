"""What it costs to get from pass to pass, for every way in which the two may be opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import positions_about
from fiveaxis.kinematics.windings import TURN
from fiveaxis.motion import times_rapids
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.starts.reopening import Layout, Side
from fiveaxis.posture.starts.rings import Opening

# Where passes lead straight into each other, ways between them may be longer by this share than the longest
# there is, or than the nearest place asks.
LONGER = 0.1


@dataclass(frozen=True, eq=False)
class Joints:
    """Prices of the ways between passes, at the postures that were found.

    On a link the postures are taken to turn evenly from one pass to the next; the refinement, which comes
    later, finds cheaper ones.

    Parameters
    ----------
    problem : of the path as it is
    layout : its rings, and what lays links
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
    def places(self) -> Array:
        """(n, 6), pivots in mm and normals."""
        return np.hstack([self.problem.pivot, self.problem.normal])

    @cached_property
    def longest(self) -> float:
        """The longest way, mm, on which one pass leads straight into the next."""
        rings, pivot = self.layout.rings, self.problem.pivot
        straight = [k for k in range(1, len(rings)) if not len(self.layout.link_rows(k))]
        ways = [np.linalg.norm(pivot[rings[k].first] - pivot[rings[k - 1].last]) for k in straight]
        return float(max(ways, default=0.0))

    def saved(self, number: int, openings: Sequence[Opening]) -> Array:
        """Price the steps that openings of a ring leave out, (s,) J: none where its last row is its first."""
        ring = self.layout.rings[number]
        if ring.again or not ring.closed:
            return np.zeros(len(openings))
        return np.diagonal(self._steps(*self._ends(number, openings), ring.first))

    def between(self, joint: int, leaving: Sequence[Opening], arriving: Sequence[Opening]) -> Array:
        """Price the ways to a ring from the one before, (e, s) J; infinite where there is none.

        Where passes lead straight into each other the way has to be about as short as it can be (`LONGER`).
        """
        if len(self.layout.link_rows(joint)):
            return self._links([(joint - 1, o) for o in leaving], [(joint, o) for o in arriving], joint)
        ends, starts = self._ends(joint - 1, leaving)[0], self._ends(joint, arriving)[1]
        row = self.layout.rings[joint].first
        way = np.linalg.norm(self.problem.pivot[ends][:, None] - self.problem.pivot[starts][None], axis=2)
        cost = self._steps(ends, starts, row) + self._pace(row) * way
        nearest = (1.0 + LONGER) * np.maximum(way.min(axis=1, keepdims=True), self.longest)
        return np.where(way <= nearest, cost, np.inf)

    def approach(self, openings: Sequence[Opening]) -> Array:
        """Price the way to the first ring, (s,) J."""
        if not len(self.layout.link_rows(0)):
            return np.zeros(len(openings))
        return self._links([None], [(0, o) for o in openings], 0)[0]

    def retreat(self, openings: Sequence[Opening]) -> Array:
        """Price the way from the last ring, (e,) J."""
        joint = len(self.layout.rings)
        if not len(self.layout.link_rows(joint)):
            return np.zeros(len(openings))
        return self._links([(joint - 1, o) for o in openings], [None], joint)[:, 0]

    def _ends(self, number: int, openings: Sequence[Opening]) -> tuple[IntArray, IntArray]:
        """Rows at which a ring ends, and at which it begins, (s,) each."""
        rows = [self.layout.rings[number].rows(opening)[[-1, 0]] for opening in openings]
        ends, starts = np.array(rows).T
        return ends, starts

    def _pace(self, row: int) -> float:
        """Price of a mm at the feed of the move to a row, J/mm: time is paid on any way.

        The time of a rapid move goes with its axes' travel (`least_times`).
        """
        if self.layout.path.rapid[row] and times_rapids(self.problem.machine):
            return 0.0
        return self.problem.time_price / float(self.layout.path.feed[row])

    def _steps(self, ends: IntArray, starts: IntArray, row: int) -> Array:
        """Price steps from rows to rows, (e, s) J, like the step that ends at a row."""
        step = self.positions[starts][None] - self.positions[ends][:, None]
        columns = self.problem.machine.rotary_columns
        step[..., columns] = nearest_turn(step[..., columns])
        return self._travel(step, row)

    def _travel(self, step: Array, row: int) -> Array:
        price = max(row - 1, 0)
        plus, minus = self.problem.plus[price], self.problem.minus[price]
        return np.maximum(step, 0.0) @ plus - np.minimum(step, 0.0) @ minus

    def _links(self, leaving: Sequence[Side], arriving: Sequence[Side], joint: int) -> Array:
        """Price the links between openings, (e, s) J; infinite where there is none."""
        pairs = [(a, b) for a in leaving for b in arriving]
        ways = [self.layout.way(a, b) for a, b in pairs]
        there = [k for k, way in enumerate(ways) if way is not None]
        cost = np.full(len(pairs), np.inf)
        if there:
            chains = [self._chain(*pairs[k], way) for k in there if (way := ways[k]) is not None]
            cost[there] = self._chain_costs(chains, int(self.layout.link_rows(joint)[-1]))
        return cost.reshape(len(leaving), len(arriving))

    def _chain(self, leaving: Side, arriving: Side, way: Array) -> tuple[Array, Array]:
        """Put a link between its ends: pivots with normals, (m, 6), and angles, (m, 2) rad."""
        sides = ((leaving, -1), (arriving, 0))
        rows = [None if s is None else int(self.layout.opened(s)[end]) for s, end in sides]
        before, after = ([] if row is None else [self.places[row]] for row in rows)
        chain = np.vstack([*before, np.hstack([way, np.zeros_like(way)]), *after])
        known = [row for row in rows if row is not None]
        first, last = self.rotary[known[0]], self.rotary[known[-1]]
        passed = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain[:, :3], axis=0), axis=1))])
        share = passed / passed[-1] if passed[-1] > 0.0 else passed
        return chain, first + share[:, None] * nearest_turn(last - first)

    def _chain_costs(self, chains: Sequence[tuple[Array, Array]], row: int) -> Array:
        """Price links that are put between their ends, (c,) J, like the move to a row."""
        places, rotary = (np.vstack(column) for column in zip(*chains, strict=True))
        problem = self.problem
        positions = positions_about(problem.machine, places[:, :3], rotary, problem.zone, places[:, 3:])[0]
        way = np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1)
        cost = self._travel(np.diff(positions, axis=0), row) + self._pace(row) * way
        firsts = np.cumsum([0, *(len(chain) for chain, _ in chains)])
        # Nothing moves from the end of one link to the start of the next.
        cost[firsts[1:-1] - 1] = 0.0
        summed: Array = np.add.reduceat(cost, firsts[:-1])
        return summed


def nearest_turn(angle: Array) -> Array:
    """Take whole turns off angles, rad, so that they lie within half a turn of 0."""
    return np.remainder(angle + np.pi, TURN) - np.pi
