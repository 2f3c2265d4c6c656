"""Closed passes may begin anywhere: their starts are chosen to fit the pass before.

A path of closed passes is the same cut wherever each ring is opened. What differs is the way and the turns
from pass to pass and, where a ring doesn't come to its first location again, which of its steps isn't taken.
Starts are chosen by dynamic programming over the postures that were found, and the path is refined again
from there. A pass that is reached by a link begins elsewhere only where the link can be laid anew, by a
planner that knows the part (`fiveaxis.toolpath.passes`).
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
from fiveaxis.posture.starts.reopening import Layout, Reopened, reopened
from fiveaxis.posture.starts.rings import Opening, Ring, find_rings, known_rings
from fiveaxis.posture.starts.seams import Joints
from fiveaxis.toolpath import TiltBounds, Toolpath
from fiveaxis.toolpath.passes import Passes

# Places of a ring that are looked at as its start: where passes join, and where each needs a link.
STARTS, LINKED_STARTS = 72, 16
# Places at which a path without links is tried to begin.
BEGINNINGS = 8
# So often starts are chosen again by the postures found for those before.
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
    both : whether rings may be followed either way
    """

    layout: Layout
    problem: Problem
    bounds: TiltBounds
    rotary: Array
    both: bool

    @property
    def cost(self) -> float:
        """The objective with the price of the time at the programmed feed, J: another way is another time."""
        travel = self.problem.cost(self.problem.positions(slice(None), self.rotary))
        return travel + self.problem.time_price * float(self.problem.least_time.sum())

    def openings(self) -> list[list[Opening]]:
        """Give the openings that are looked at, of each ring."""
        path = self.layout.path
        most = STARTS if self.layout.relink is None else LINKED_STARTS
        return [
            ring.openings(path.cutting, most=most, both=self.both) if self.layout.is_free(k) else [ring.own]
            for k, ring in enumerate(self.layout.rings)
        ]


def choose_openings(joints: Joints, openings: Sequence[Sequence[Opening]]) -> list[Opening]:
    """Choose how to open every ring so that the postures of a path cost least.

    What counts is the step that opening a ring there saves, and the way to it from the end of the one before.

    Parameters
    ----------
    joints : prices of the ways
    openings : of each ring, those to choose from

    Returns
    -------
    One for each ring; none where the passes can't follow each other
    """
    saved = [joints.saved(k, choice) for k, choice in enumerate(openings)]
    cost, came = joints.approach(openings[0]) - saved[0], []
    for k in range(1, len(openings)):
        total = cost[:, None] + joints.between(k, openings[k - 1], openings[k])
        came.append(np.argmin(total, axis=0))
        cost = total.min(axis=0) - saved[k]
    cost = cost + joints.retreat(openings[-1])
    if not np.isfinite(cost).any():
        return []
    chosen = [int(np.argmin(cost))]
    for back in reversed(came):
        chosen.append(int(back[chosen[-1]]))
    return [choice[k] for choice, k in zip(openings, reversed(chosen), strict=True)]


def orders(here: Candidate) -> Iterator[list[Opening]]:
    """Give the openings that are worth refining: the cheapest, and without links those of a few beginnings.

    The postures that were found suit the starts that they were found for, so the cheapest order by them is
    seldom far from the one there is. On links postures are free, and beginnings don't matter so far.
    """
    joints, openings = Joints(here.problem, here.layout, here.rotary), here.openings()
    tried = [choose_openings(joints, openings)]
    if here.layout.relink is None:
        for begin in openings[0][:: max(1, len(openings[0]) // BEGINNINGS)]:
            tried.append(choose_openings(joints, [[begin], *openings[1:]]))
    seen: list[list[Opening]] = [[ring.own for ring in here.layout.rings], []]
    for chosen in tried:
        if chosen not in seen:
            seen.append(chosen)
            yield chosen


def freed(
    solution: Solution,
    build: Build,
    refine: Refine,
    *,
    passes: Passes | None = None,
    both_ways: bool = False,
) -> Solution:
    """Let closed passes begin where that is cheapest; never dearer than the solution given.

    Parameters
    ----------
    solution : with its problem
    build : makes the problem, and the bounds on the lean, of the path in another order
    refine : refines a path from a start
    passes : those of the path, with what lays links anew; by default they are found, and links are kept
    both_ways : whether they may be followed backwards, too

    Returns
    -------
    The solution on the path in its new order, or the one given; either way the path has a finding
    ``free-start`` that says what was done, or why nothing.

    Raises
    ------
    SettingError
        Passes of another path.
    """
    path, problem = solution.toolpath, solution.problem
    if problem is None:
        return _told(solution, "rotary axes are turned back between locations, so passes keep their start")
    if passes is not None and passes.locations != len(path):
        fact = f"free_start has the passes of {passes.locations} locations, and the path has {len(path)}"
        raise SettingError(f"{fact}; give those that were planned with it")
    rings = find_rings(path) if passes is None else known_rings(path, passes)
    layout = Layout(path, rings, None if passes is None else passes.relink)
    closed = sum(ring.closed for ring in rings)
    free = sum(layout.is_free(k) for k in range(len(rings)))
    if closed == 0:
        return _told(solution, "no pass is closed, so none can begin elsewhere")
    bound = ""
    if free < closed:
        bound = (
            f"; {closed - free} keep their start: they are reached or left by links, and others can be laid "
            "only where the path is planned on its part"
        )
    rotary = solution.motion.positions[:, problem.machine.rotary_columns]
    given = Candidate(layout, problem, solution.tilt, rotary, both_ways)
    best = _improved(given, build, refine) if free else given
    if best.layout is given.layout:
        told = "" if not free else f"none of {free} closed passes begins elsewhere: that would not be cheaper"
        return _told(solution, (told + bound).removeprefix("; "))
    return _told(_solved(solution, best), _summary(given, best, free) + bound)


def _improved(given: Candidate, build: Build, refine: Refine) -> Candidate:
    """Open passes elsewhere as long as that gets cheaper; backwards only where that is better still."""
    best = given
    if given.both:
        best = replace(_improved(replace(given, both=False), build, refine), both=True)
    for _ in range(ROUNDS if given.layout.relink is not None else 1):
        here = best
        for openings in orders(here):
            other = _refined(here, openings, build, refine)
            if other.problem.violation(other.rotary) <= ALLOWED and _is_cheaper(other, best):
                best = other
        if best is here:
            break
    return best


def _refined(here: Candidate, openings: list[Opening], build: Build, refine: Refine) -> Candidate:
    found: Reopened = reopened(here.layout, openings)
    problem, bounds = build(found.toolpath)
    rotary = refine(problem, found.start(problem, here.rotary))
    return Candidate(
        Layout(found.toolpath, found.rings, here.layout.relink), problem, bounds, rotary, here.both
    )


def _is_cheaper(one: Candidate, other: Candidate) -> bool:
    """Whether one path costs less than another, and its travel alone is no dearer."""
    return one.cost < other.cost and _travel(one) <= _travel(other)


def _travel(path: Candidate) -> float:
    motion = follow(path.layout.path, path.problem.machine, path.rotary)
    return motion_energy(path.problem.machine, motion).travel


def _solved(solution: Solution, best: Candidate) -> Solution:
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
    """Say how many passes begin elsewhere, how many run backwards, and what that saves."""
    pairs = list(zip(given.layout.rings, best.layout.rings, strict=True))
    before, after = given.layout.path.pivot, best.layout.path.pivot
    moved = sum(bool((before[a.first] != after[b.first]).any()) for a, b in pairs)
    told = f"{moved} of {free} closed passes begin elsewhere"
    if given.both:
        told += f" and {sum(_is_turned(given, best, a, b) for a, b in pairs)} run the other way"
    return f"{told}, which saves {given.cost - best.cost:.1f} J"


def _is_turned(given: Candidate, best: Candidate, before: Ring, after: Ring) -> bool:
    """Tell whether a ring is followed the other way: its second location came before its first."""
    old, new = given.layout.path.pivot, best.layout.path.pivot
    own = old[before.first : before.last + 1]
    if before.again:
        own = own[1:]
    first, second = (int(np.argmin(np.linalg.norm(own - new[after.first + k], axis=1))) for k in (0, 1))
    return (second - first) % len(own) == len(own) - 1


def _told(solution: Solution, message: str) -> Solution:
    path = solution.toolpath
    finding = Finding(Severity.NOTE, "free-start", message, path.place(0))
    return replace(solution, toolpath=replace(path, findings=(*path.findings, finding)))
