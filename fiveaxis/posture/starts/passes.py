"""The start points of closed passes, chosen to fit the pass before.

A path of closed passes cuts the same wherever each ring is opened. What differs is the moves from pass to
pass and, for a ring that doesn't repeat its first location, which of its steps isn't cut. Starts are chosen
by dynamic programming over the postures found so far, and the path is then refined again. A pass reached by
a link begins elsewhere only if a planner that knows the part (`fiveaxis.toolpath.passes`) can plan the link
anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.motion import follow
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.starts.reopening import Layout, reopen
from fiveaxis.posture.starts.rings import Opening, Ring, find_rings, known_rings
from fiveaxis.posture.starts.transitions import Transitions
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
            if other.problem.violation(other.rotary) <= ALLOWED and _is_cheaper(other, best):
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


def _is_cheaper(one: Candidate, other: Candidate) -> bool:
    """Check whether one path costs less than another without costing more in travel."""
    return one.cost < other.cost and _travel(one) <= _travel(other)


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
