"""Where a search begins at the given locations: the baselines, and a path of little travel."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import find_baselines, moved_clear
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import sampled
from fiveaxis.posture.solution import Baseline, Solution, Stage
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.infeasibility import long_turns, unreachable
from fiveaxis.posture.strategy.near import by_travel, refined
from fiveaxis.progress import Progress
from fiveaxis.toolpath import TiltBounds, Toolpath

logger = logging.getLogger(__name__)

# Postures tried at a location before it is reported to have none that the mask admits.
SAMPLES = 400


class Refused(Infeasible):
    """There are locations at which the mask refuses every posture: no other turns would help."""


@dataclass(frozen=True, eq=False)
class GivenProblem:
    """What is solved at the given locations.

    Parameters
    ----------
    problem, bounds, toolpath : of the path's locations
    start : (n, 2), rad, chain order, a path that is refined; None for a search
    effort : how much may be done
    progress : called with what is being done, steps done and steps in all
    """

    problem: Problem
    bounds: TiltBounds
    toolpath: Toolpath
    start: Array | None
    effort: Effort
    progress: Progress


def solve_given(given: GivenProblem, mask: Mask | None) -> Solution:
    """Find the baselines and a path to begin with, which the mask needn't admit.

    Raises
    ------
    Infeasible
        Locations out of reach; moves that turn too far.
    """
    problem, toolpath, bounds, effort = given.problem, given.toolpath, given.bounds, given.effort
    machine = problem.machine
    blocked = unreachable(toolpath, machine, bounds)
    if blocked:
        share = f"{len(blocked)} of {len(toolpath)} locations"
        raise Infeasible(f"{share} have no admissible posture on {machine.name}", blocked)
    given.progress("computing baselines", 0, 1)
    compared, missing = find_baselines(toolpath, machine, bounds)
    baselines = compared
    if mask is not None:
        compared, refused = moved_clear(compared, problem, toolpath, bounds, mask)
        missing = missing | refused

    def searched() -> Array:
        admits, found = None if mask is None else mask.roughly_admits, None
        for grain in (effort.everywhere, *effort.everywhere.finer):
            found = by_travel(problem, replace(effort, everywhere=grain), admits)
            if found is not None and problem.violation(found) <= ALLOWED:
                return found
        kept = _cheapest(problem, baselines)
        if kept is None:
            raise without_path(problem, found, toolpath)
        return refined(problem, kept, effort)

    given.progress("searching postures that travel little", 0, 1)
    rotary = searched() if given.start is None else refined(problem, given.start, effort)
    if given.start is not None and problem.violation(rotary) > ALLOWED:
        rotary = searched()
    motion = follow(toolpath, machine, rotary)
    energy = motion_energy(machine, motion)
    logger.info("%d locations on %s: %.1f J to begin with", len(toolpath), machine.name, energy.total)
    stages = (Stage("path of little travel", "found", 0, None, problem.path_cost(rotary)),)
    return Solution(machine, toolpath, bounds, motion, energy, compared, missing, stages, problem)


def _cheapest(problem: Problem, compared: dict[str, Baseline]) -> Array | None:
    """Find the rotary angles, (n, 2) rad, of the cheapest baseline that keeps all bounds."""
    paths = [b.motion.positions[:, problem.machine.rotary_columns] for b in compared.values()]
    return min((p for p in paths if problem.violation(p) <= ALLOWED), key=problem.path_cost, default=None)


def without_path(problem: Problem, found: Array | None, toolpath: Toolpath) -> Infeasible:
    """Say where no sequence of postures was found; the best path, (n, 2) rad, breaks bounds."""
    turning = long_turns(problem, toolpath)
    if turning:
        share = f"{len(turning)} of {len(toolpath) - 1} moves"
        return Infeasible(
            f"no sequence of postures along the path: {share} exceed the largest turn in the best one found",
            turning,
        )
    if found is None:
        return Infeasible(
            "every location has an admissible posture, but the search found no sequence of them along "
            "the path; allow larger turns between locations (--max-turn), put the locations closer "
            "together, or widen the tilt range",
            (),
        )
    positions, excess = problem.placed(slice(None), found)
    broken = {
        "the tilt range": excess > ALLOWED,
        "an axis limit": problem.limit_excess(positions) > ALLOWED,
        "the largest rotary step": np.concatenate([[0.0], problem.turn_excess(found)]) > ALLOWED,
    }
    findings = [
        Finding(
            Severity.ERROR,
            "no-posture",
            f"no posture was found that keeps {what} and can be reached from its neighbours; allow larger "
            "turns (--max-turn), put the locations closer together, or widen the tilt range",
            toolpath.place(int(row)),
        )
        for what, rows in broken.items()
        for row in np.flatnonzero(rows)
    ]
    return Infeasible(f"{len(findings)} locations have no admissible posture in sequence", findings)


def refusal(
    problem: Problem, toolpath: Toolpath, rotary: Array, refused: BoolArray, mask: Mask
) -> Infeasible:
    """Say of each refused location, (n,), whether the mask admits a posture there.

    Parameters
    ----------
    rotary : (n, 2), rad, the path's postures, of which the mask refuses some
    """
    findings, kind = [], Infeasible
    for row in np.flatnonzero(refused):
        # Samples may miss a narrow tilt range; the path has a posture in it.
        states = np.vstack([rotary[row], sampled(problem, int(row))])
        states = states[np.unique(np.linspace(0, len(states) - 1, SAMPLES).astype(np.int64))]
        if mask.admits(np.full(len(states), row), states).any():
            text = f"{mask.wording.some}, but none was found within reach of its neighbours"
        else:
            kind = Refused
            text = f"{mask.wording.none} ({len(states)})"
        remedy = f"widen the tilt range, allow larger turns (--max-turn) or {mask.wording.remedy}"
        place = toolpath.place(int(row))
        findings.append(Finding(Severity.ERROR, "no-posture", f"{text}; {remedy}", place))
    share = f"{len(findings)} of {len(problem)} locations"
    return kind(f"{share} have no posture in sequence {mask.wording.admitted}", findings)
