"""Closed passes may begin anywhere: their starts are chosen to fit the pass before.

A path of closed passes that lead straight into each other, as waterlines do that step down on the wall, is
the same cut wherever each ring is opened. What differs is the way and the turns from pass to pass, and which
step of each ring isn't taken. Starts are chosen by dynamic programming over the postures that were found, and
the path is refined again from there. A pass that is reached by a link keeps its start: another one would need
an approach of its own, which only a planner that knows the part can lay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.motion import follow
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.toolpath import TiltBounds, Toolpath

# A step this many times as long as the median one leads to another pass; a ring is closed where its ends are
# no farther apart than this many median steps. One whose last row is its first again has no gap to move:
# begun elsewhere it would leave a piece uncut, so it keeps its start.
JUMP, CLOSED, AGAIN = 2.0, 1.5, 0.5
# Ways between passes may be longer by this share than the longest there is, or than the nearest place asks.
LONGER = 0.1
# Places of a ring that are looked at as its start.
STARTS = 72
# Places at which the whole path is tried to begin.
BEGINNINGS = 8

Build = Callable[[Toolpath], tuple[Problem, TiltBounds]]
Refine = Callable[[Problem, Array], Array]


@dataclass(frozen=True)
class Ring:
    """A run of cuts.

    Parameters
    ----------
    first, last : rows
    closed : whether it ends where it began, so that it could begin anywhere
    """

    first: int
    last: int
    closed: bool

    def starts(self) -> IntArray:
        """Give the rows at which it may begin, its own first."""
        count = self.last - self.first + 1
        step = max(1, count // STARTS)
        return self.first + np.arange(0, count if self.closed else 1, step)

    def from_start(self, start: int) -> IntArray:
        """Give its rows in order from a start."""
        return self.first + np.roll(np.arange(self.last - self.first + 1), self.first - start)

    def end(self, starts: IntArray) -> IntArray:
        """Give the rows at which it ends when it begins at some starts."""
        return np.where(starts == self.first, self.last, starts - 1)


def find_rings(toolpath: Toolpath) -> list[Ring]:
    """Split a path without links where a step is much longer than its others."""
    steps = toolpath.lengths[1:]
    middle = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    ends = np.append(np.flatnonzero(steps > JUMP * middle), len(toolpath) - 1)
    rings, first = [], 0
    for last in ends.tolist():
        rings.append(Ring(first, last, _is_one_turn(toolpath.pivot[first : last + 1], middle)))
        first = last + 1
    return rings


def _is_one_turn(pivot: Array, step: float) -> bool:
    """Tell whether a run, (m, 3) mm, comes back to its begin once, at its end, but for about a step.

    Several turns that lie close above each other look like one run: begun elsewhere, lower ones would be cut
    before upper ones.
    """
    if len(pivot) < 4:
        return False
    apart = np.linalg.norm(pivot - pivot[0], axis=1)
    return bool(AGAIN * step < apart[-1] <= CLOSED * step and (apart[2:-2] > CLOSED * step).all())


def choose_starts(problem: Problem, rings: list[Ring], rotary: Array, begin: int | None = None) -> list[int]:
    """Choose the start of every ring so that the postures of a path, (n, 2) rad, cost least.

    What counts is the step that opening a ring there saves, and the way to it from the end of the one before,
    which has to be about as short as it can be (`LONGER`).

    Parameters
    ----------
    begin : the row at which the path begins; None for the best one

    Returns
    -------
    The row at which each ring begins; none where the passes can't follow each other from there
    """
    positions = problem.positions(slice(None), rotary)
    ways = [np.linalg.norm(problem.pivot[b.first] - problem.pivot[a.last]) for a, b in pairwise(rings)]
    longest = max(ways, default=0.0)
    starts = [ring.starts() for ring in rings]
    if begin is not None:
        starts[0] = np.array([begin])
    saved = [
        np.diagonal(_costs(problem, positions, r.end(s), s, r.first))
        for r, s in zip(rings, starts, strict=True)
    ]
    cost, came = -saved[0], []
    for at, (before, here) in enumerate(pairwise(rings)):
        ends = before.end(starts[at])
        way = np.linalg.norm(problem.pivot[ends][:, None] - problem.pivot[starts[at + 1]][None], axis=2)
        total = cost[:, None] + _costs(problem, positions, ends, starts[at + 1], here.first)
        nearest = (1.0 + LONGER) * np.maximum(way.min(axis=1, keepdims=True), longest)
        total = np.where(way <= nearest, total, np.inf)
        came.append(np.argmin(total, axis=0))
        cost = total.min(axis=0) - saved[at + 1]
    if not np.isfinite(cost).any():
        return []
    chosen = [int(np.argmin(cost))]
    for back in reversed(came):
        chosen.append(int(back[chosen[-1]]))
    return [int(s[k]) for s, k in zip(starts, reversed(chosen), strict=True)]


def _costs(problem: Problem, positions: Array, ends: IntArray, starts: IntArray, row: int) -> Array:
    """Cost of stepping from rows to rows, (e, s) J, at the prices of the step that ends at a row."""
    step = positions[starts][None] - positions[ends][:, None]
    columns = problem.machine.rotary_columns
    step[..., columns] = np.remainder(step[..., columns] + np.pi, TURN) - np.pi
    price = max(row - 1, 0)
    return np.maximum(step, 0.0) @ problem.plus[price] - np.minimum(step, 0.0) @ problem.minus[price]


def reordered(rings: list[Ring], starts: list[int]) -> IntArray:
    """Give the rows of a path in the order in which rings with other starts take them."""
    return np.concatenate([ring.from_start(s) for ring, s in zip(rings, starts, strict=True)])


def reopened(path: Toolpath, rings: list[Ring], rows: IntArray) -> Toolpath:
    """Take a path in another order; the move to a ring keeps its feed and kind, wherever the ring begins."""
    feed, kind = path.feed.copy(), path.kind.copy()
    for ring in rings:
        start = int(rows[ring.first])
        if start != ring.first:
            for column in (feed, kind):
                column[start], column[ring.first] = column[ring.first], column[ring.first + 1]
    return replace(path, feed=feed, kind=kind).at(rows)


def orders(problem: Problem, rings: list[Ring], rotary: Array) -> Iterator[IntArray]:
    """Give the orders of rows that are worth refining: the cheapest, and those of a few other beginnings.

    The postures that were found suit the starts that they were found for, so the cheapest order by them is
    seldom far from the one there is.
    """
    first = rings[0].starts()
    tried = [choose_starts(problem, rings, rotary)]
    for begin in first[:: max(1, len(first) // BEGINNINGS)]:
        tried.append(choose_starts(problem, rings, rotary, int(begin)))
    seen = [tuple(ring.first for ring in rings), ()]
    for starts in tried:
        if tuple(starts) not in seen:
            seen.append(tuple(starts))
            yield reordered(rings, starts)


def unwound(problem: Problem, rotary: Array) -> Array:
    """Shift angles, (n, 2) rad, by whole turns next to the ones before, where the axis has no limits."""
    found = rotary.copy()
    for which, column in enumerate(problem.machine.rotary_columns):
        if problem.machine.axes[column].limits.unlimited:
            found[:, which] = np.unwrap(rotary[:, which])
    return found


def freed(solution: Solution, build: Build, refine: Refine) -> Solution:
    """Let closed passes begin where that is cheapest; never dearer than the solution given.

    Parameters
    ----------
    solution : with its problem
    build : makes the problem, and the bounds on the lean, of the path in another order
    refine : refines a path from a start

    Returns
    -------
    The solution on the path in its new order, or the one given; either way the path has a finding
    ``free-start`` that says what was done, or why nothing.
    """
    path, problem = solution.toolpath, solution.problem
    if problem is None or not path.cutting[1:].all():
        why = "passes reached by links keep their start: another one would need an approach of its own"
        return _told(solution, why)
    rings = find_rings(path)
    closed = sum(ring.closed for ring in rings)
    if closed == 0:
        return _told(solution, "no pass is closed, so none can begin elsewhere")
    rotary = solution.motion.positions[:, problem.machine.rotary_columns]
    before = least = problem.cost(problem.positions(slice(None), rotary))
    best = None
    for rows in orders(problem, rings, rotary):
        other, bounds = build(reopened(path, rings, rows))
        found = refine(other, unwound(other, rotary[rows]))
        cost = other.cost(other.positions(slice(None), found))
        if other.violation(found) <= ALLOWED and cost < least:
            least, best = cost, (rows, other, bounds, found)
    if best is None:
        return _told(solution, f"none of {closed} closed passes begins elsewhere: that would not be cheaper")
    rows, other, bounds, found = best
    moved = reopened(path, rings, rows)
    motion = follow(moved, solution.machine, found)
    better = replace(
        solution,
        toolpath=moved,
        tilt=bounds,
        motion=motion,
        energy=motion_energy(solution.machine, motion),
        compared={n: replace(b, toolpath=b.toolpath or path) for n, b in solution.compared.items()},
        problem=other,
    )
    shifted = sum(int(rows[ring.first]) != ring.first for ring in rings)
    return _told(
        better, f"{shifted} of {closed} closed passes begin elsewhere, which saves {before - least:.1f} J"
    )


def _told(solution: Solution, message: str) -> Solution:
    path = solution.toolpath
    finding = Finding(Severity.NOTE, "free-start", message, path.place(0))
    return replace(solution, toolpath=replace(path, findings=(*path.findings, finding)))
