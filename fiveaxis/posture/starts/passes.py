"""The start points of closed passes, chosen to fit the pass before.

A path of closed passes cuts the same wherever each ring is opened. What differs is the moves from pass to
pass (`Transitions`) and, for a ring that doesn't repeat its first location, which of its steps isn't cut.
Starts are chosen by dynamic programming over the postures found so far, and the path is then refined again. A
pass reached by a link begins elsewhere only if a planner that knows the part (`fiveaxis.toolpath.passes`) can
plan the link anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray, product
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.kinematics.windings import TURN
from fiveaxis.motion import follow, times_rapids
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.starts.rings import Layout, Opening, Ring, Side, find_rings, known_rings, reopen
from fiveaxis.toolpath import TiltBounds, Toolpath
from fiveaxis.toolpath.passes import Passes

# Candidate starts of a ring: where passes join, and where each needs a link.
STARTS, LINKED_STARTS = 72, 16
# Candidate starts of a whole path without links.
BEGINNINGS = 8
# Rounds of choosing starts by the postures found for the previous choice.
ROUNDS = 2

Build = Callable[[Toolpath], tuple[Problem, TiltBounds]]
Refine = Callable[[Problem, Array], Array]
# Where passes join, a step between them may be longer by this share than the longest one of the path, or than
# the shortest possible.
LONGER = 0.1


@dataclass(frozen=True, eq=False)
class Candidate:
    """A path with postures, and what it costs.

    Parameters
    ----------
    layout : the path and its rings
    problem, bounds : posed on it
    rotary : (n, 2), rad, chain order
    both : whether rings may be followed in both directions
    """

    layout: Layout
    problem: Problem
    bounds: TiltBounds
    rotary: Array
    both: bool

    @property
    def cost(self) -> float:
        """The objective with the price of the time at the programmed feed, J: path lengths differ."""
        travel = self.problem.cost(self.problem.positions(slice(None), self.rotary))
        return travel + self.problem.time_price * float(self.problem.least_time.sum())

    def openings(self) -> list[list[Opening]]:
        """List the candidate openings of each ring."""
        path = self.layout.path
        most = STARTS if self.layout.relink is None else LINKED_STARTS
        return [
            ring.openings(path.cutting, most=most, both=self.both) if self.layout.is_free(k) else [ring.own]
            for k, ring in enumerate(self.layout.rings)
        ]


def choose_openings(transitions: Transitions, openings: Sequence[Sequence[Opening]]) -> list[Opening]:
    """Choose how to open every ring so that a path costs least.

    What counts is the step that opening a ring there saves, and the moves from the ring before.

    Parameters
    ----------
    transitions : prices of those
    openings : candidates of each ring

    Returns
    -------
    One opening for each ring; empty if no choice joins all passes
    """
    saved = [transitions.saved(k, choice) for k, choice in enumerate(openings)]
    cost, came = transitions.approach(openings[0]) - saved[0], []
    for k in range(1, len(openings)):
        total = cost[:, None] + transitions.between(k, openings[k - 1], openings[k])
        came.append(np.argmin(total, axis=0))
        cost = total.min(axis=0) - saved[k]
    cost = cost + transitions.retract(openings[-1])
    if not np.isfinite(cost).any():
        return []
    chosen = [int(np.argmin(cost))]
    for back in reversed(came):
        chosen.append(int(back[chosen[-1]]))
    return [choice[k] for choice, k in zip(openings, reversed(chosen), strict=True)]


def orders(here: Candidate) -> Iterator[list[Opening]]:
    """Yield the openings worth refining: the cheapest and, without links, those of several path starts.

    The postures suit the present openings, so the cheapest choice by them is seldom far from these. On links
    postures are free, and the start of the path matters little.
    """
    transitions, openings = Transitions(here.problem, here.layout, here.rotary), here.openings()
    tried = [choose_openings(transitions, openings)]
    if here.layout.relink is None:
        for begin in openings[0][:: max(1, len(openings[0]) // BEGINNINGS)]:
            tried.append(choose_openings(transitions, [[begin], *openings[1:]]))
    seen: list[list[Opening]] = [[ring.own for ring in here.layout.rings], []]
    for chosen in tried:
        if chosen not in seen:
            seen.append(chosen)
            yield chosen


def free_starts(
    solution: Solution,
    build: Build,
    refine: Refine,
    *,
    passes: Passes | None = None,
    both_directions: bool = False,
) -> Solution:
    """Let closed passes begin where that is cheapest; the result never costs more than the given solution.

    Parameters
    ----------
    solution : with its problem
    build : poses the problem, with the bounds on the lean, for the path in another order
    refine : refines a path from a start
    passes : of the path, with the planner of links; by default passes are found, and links are kept
    both_directions : whether passes may be followed backwards too

    Returns
    -------
    The solution on the path in its new order, or the given one; in both cases with a finding ``free-start``
    that says what changed, or why nothing did

    Raises
    ------
    SettingError
        The passes belong to another path.
    """
    path, problem = solution.toolpath, solution.problem
    if problem is None:
        return _with_finding(solution, "rotary axes rewind between locations, so passes keep their start")
    if passes is not None and passes.locations != len(path):
        fact = f"free_start: these passes have {passes.locations} locations, and the path has {len(path)}"
        raise SettingError(f"{fact}; give the passes planned with it")
    rings = find_rings(path) if passes is None else known_rings(path, passes)
    layout = Layout(path, rings, None if passes is None else passes.relink)
    closed = sum(ring.closed for ring in rings)
    free = sum(layout.is_free(k) for k in range(len(rings)))
    if closed == 0:
        return _with_finding(solution, "no pass is closed, so none can begin elsewhere")
    linked = ""
    if free < closed:
        linked = (
            f"; {closed - free} keep their start: they are reached or left by links, and other links need "
            "a path planned on its part"
        )
    rotary = solution.motion.positions[:, problem.machine.rotary_columns]
    given = Candidate(layout, problem, solution.tilt, rotary, both_directions)
    best = _improve(given, build, refine) if free else given
    if best.layout is given.layout:
        fact = "" if not free else f"none of {free} closed passes begins elsewhere: that would not be cheaper"
        return _with_finding(solution, (fact + linked).removeprefix("; "))
    return _with_finding(_solution_of(solution, best), _summary(given, best, free) + linked)


def _improve(given: Candidate, build: Build, refine: Refine) -> Candidate:
    """Open passes elsewhere as long as that gets cheaper; backwards only if that is cheaper still."""
    best = given
    if given.both:
        best = replace(_improve(replace(given, both=False), build, refine), both=True)
    for _ in range(ROUNDS if given.layout.relink is not None else 1):
        here = best
        for openings in orders(here):
            other = _refine_opened(here, openings, build, refine)
            sound = other.problem.violation(other.rotary) <= ALLOWED
            if sound and other.cost < best.cost and _travel(other) <= _travel(best):
                best = other
        if best is here:
            break
    return best


def _refine_opened(here: Candidate, openings: list[Opening], build: Build, refine: Refine) -> Candidate:
    found = reopen(here.layout, openings)
    problem, bounds = build(found.toolpath)
    rotary = refine(problem, found.start(problem, here.rotary))
    return Candidate(
        Layout(found.toolpath, found.rings, here.layout.relink), problem, bounds, rotary, here.both
    )


def _travel(path: Candidate) -> float:
    motion = follow(path.layout.path, path.problem.machine, path.rotary)
    return motion_energy(path.problem.machine, motion).travel


def _solution_of(solution: Solution, best: Candidate) -> Solution:
    path = best.layout.path
    motion = follow(path, solution.machine, best.rotary)
    return replace(
        solution,
        toolpath=path,
        tilt=best.bounds,
        motion=motion,
        energy=motion_energy(solution.machine, motion),
        compared={
            name: replace(b, toolpath=b.toolpath or solution.toolpath)
            for name, b in solution.compared.items()
        },
        problem=best.problem,
    )


def _summary(given: Candidate, best: Candidate, free: int) -> str:
    """Describe how many passes begin elsewhere or run backwards, and what that saves."""
    pairs = list(zip(given.layout.rings, best.layout.rings, strict=True))
    before, after = given.layout.path.pivot, best.layout.path.pivot
    moved = sum(bool((before[a.first] != after[b.first]).any()) for a, b in pairs)
    fact = f"{moved} of {free} closed passes begin elsewhere"
    if given.both:
        fact += f" and {sum(_is_reversed(given, best, a, b) for a, b in pairs)} run backwards"
    return f"{fact}, which saves {given.cost - best.cost:.1f} J"


def _is_reversed(given: Candidate, best: Candidate, before: Ring, after: Ring) -> bool:
    """Check whether a ring is followed backwards: its second location came before its first."""
    old, new = given.layout.path.pivot, best.layout.path.pivot
    own = old[before.first : before.last + 1]
    if before.again:
        own = own[1:]
    first, second = (int(np.argmin(np.linalg.norm(own - new[after.first + k], axis=1))) for k in (0, 1))
    return (second - first) % len(own) == len(own) - 1


def _with_finding(solution: Solution, message: str) -> Solution:
    path = solution.toolpath
    finding = Finding(Severity.NOTE, "free-start", message, path.place(0))
    return replace(solution, toolpath=replace(path, findings=(*path.findings, finding)))


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
        tip = problem.zone.tip(points[:, :3], points[:, 3:], tool_axes(problem.machine, rotary))
        positions = linear_positions(problem.machine, tip, rotary)
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
