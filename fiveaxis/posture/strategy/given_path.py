"""The cheapest path at the given locations, and the baselines it is compared with."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import find_baselines, moved_clear
from fiveaxis.posture.masks.enforcement import Enforcement, Refused, or_cheaper_baseline
from fiveaxis.posture.masks.mask import Mask, MaskFunction
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Solution
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.infeasibility import long_turns, unreachable
from fiveaxis.posture.strategy.portfolio import Portfolio
from fiveaxis.posture.strategy.singular import Cone, hold_in_cone
from fiveaxis.posture.turns.unwrapped import wrap_mask
from fiveaxis.posture.turns.winding import endless, winding_columns
from fiveaxis.progress import Progress
from fiveaxis.toolpath import TiltBounds, Toolpath

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class GivenSolution:
    """What was found at the given locations.

    Parameters
    ----------
    solution : on the machine, or on the `endless` one
    mask : with the number of its queries; None without one
    others : (n, 2) rad each, the paths of other efforts' searches, by name
    """

    solution: Solution
    mask: Mask | None
    others: dict[str, Array]


@dataclass(frozen=True, eq=False)
class GivenProblem:
    """What is solved at the given locations.

    Parameters
    ----------
    problem, bounds, toolpath : of the path's locations
    start : (n, 2), rad, chain order, a path that is refined; None for a search
    effort : how much may be done
    progress : called with what is being done, steps done and steps in all
    cone : in which the first rotary axis is bounded; None without one
    """

    problem: Problem
    bounds: TiltBounds
    toolpath: Toolpath
    start: Array | None
    effort: Effort
    progress: Progress
    cone: Cone | None

    def endless(self) -> GivenProblem:
        """Return the same problem with rotary axes of unlimited travel."""
        return replace(self, problem=replace(self.problem, machine=endless(self.problem.machine)))


def solve_given(given: GivenProblem, mask: MaskFunction | None) -> GivenSolution:
    """Find the cheapest path, if possible within the turns that the axes have.

    Raises
    ------
    Infeasible
        Locations out of reach; moves that turn too far.
    """
    toolpath, machine = given.toolpath, given.problem.machine
    blocked = unreachable(toolpath, machine, given.bounds)
    if blocked:
        share = f"{len(blocked)} of {len(toolpath)} locations"
        raise Infeasible(f"{share} have no admissible posture on {machine.name}", blocked)
    try:
        return _within_turns(given, mask)
    except Refused:
        raise
    except Infeasible:
        turning = long_turns(given.problem, toolpath)
        if not turning:
            raise
        share = f"{len(turning)} of {len(toolpath) - 1} moves"
        raise Infeasible(
            f"no sequence of postures along the path: {share} exceed the largest turn in the best one found",
            turning,
        ) from None


def _within_turns(given: GivenProblem, mask: MaskFunction | None) -> GivenSolution:
    """Solve within the turns that the axes have, or where that fails, on the `endless` machine."""
    machine, counted = given.problem.machine, None if mask is None else Mask(mask)
    try:
        return _solve(given, counted)
    except Infeasible:
        if not winding_columns(machine):
            raise
    # The axis turns as far as the path needs; afterwards it is rewound where that is cheap.
    counted = None if mask is None else Mask(wrap_mask(machine, mask))
    return _solve(given.endless(), counted)


def _solve(given: GivenProblem, mask: Mask | None) -> GivenSolution:
    """Find the baselines and the cheapest path of a problem."""
    problem, toolpath, bounds = given.problem, given.toolpath, given.bounds
    machine = problem.machine
    effort, progress, cone = given.effort, given.progress, given.cone
    progress("computing baselines", 0, 1)
    compared, missing = find_baselines(toolpath, machine, bounds)
    # A baseline that the mask refuses is still a start.
    starts = compared
    if mask is not None:
        compared, refused = moved_clear(compared, problem, toolpath, bounds, mask)
        missing = missing | refused
    run = Portfolio(problem, effort, progress=progress)
    found: dict[str, Array] = {}

    def solve(bounded: Problem, start: Array) -> Array:
        again = Portfolio(bounded, effort, progress=progress, stages=run.stages)
        near = again.refined_from("path within wider bounds", start)
        return near if bounded.violation(near) <= ALLOWED else again.best_path(starts)

    if given.start is not None:
        rotary = solve(problem, given.start)
    else:
        found = _searched(run, starts)
        rotary = min(found.values(), key=partial(_rank, problem))
    if cone is not None:
        rotary = hold_in_cone(problem, toolpath, rotary, solve, cone)
    if mask is not None:
        rotary = Enforcement(run, mask).enforced(rotary, toolpath, compared)
        rotary = or_cheaper_baseline(problem, rotary, compared)
    for stage in run.stages:
        logger.debug("%s: %s, %d steps, %.1f J", stage.name, stage.status, stage.iterations, stage.after)
    _require_admissible(problem, rotary, toolpath)
    motion = follow(toolpath, machine, rotary)
    energy = motion_energy(machine, motion)
    logger.info("%d locations on %s: %.1f J", len(toolpath), machine.name, energy.total)
    solution = Solution(
        machine, toolpath, bounds, motion, energy, compared, missing, tuple(run.stages), problem
    )
    # Within a mask or a cone, a path is sound only after what was done to the best one.
    alone = cone is None and mask is None
    others = {name: path for name, path in found.items() if path is not rotary} if alone else {}
    return GivenSolution(solution, mask, others)


def _searched(run: Portfolio, compared: Mapping[str, Baseline]) -> dict[str, Array]:
    """Find the path of every effort's searches, (n, 2) rad, from the smallest effort on.

    Raises
    ------
    Infeasible
        None of them leads to a path.
    """
    found: dict[str, Array] = {}
    failure: Infeasible | None = None
    for number, effort in enumerate(run.effort.nested, start=1):
        try:
            found[f"searches, set {number}"] = replace(run, effort=effort).best_path(compared)
        except Infeasible as reason:
            failure = failure or reason
    if failure is not None and not found:
        raise failure
    return found


def _rank(problem: Problem, path: Array) -> tuple[float, float]:
    violation = problem.violation(path)
    return (violation if violation > ALLOWED else 0.0), problem.path_cost(path)


def _require_admissible(problem: Problem, rotary: Array, toolpath: Toolpath) -> None:
    """Raise `Infeasible` if a path breaks a bound by more than rounding, with a finding for each location."""
    positions, excess = problem.placed(slice(None), rotary)
    turned = np.concatenate([[0.0], problem.turn_excess(rotary)])
    broken = {
        "the tilt range": excess > ALLOWED,
        "an axis limit": problem.limit_excess(positions) > ALLOWED,
        "the largest rotary step": turned > ALLOWED,
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
    if findings:
        raise Infeasible(f"{len(findings)} locations have no admissible posture in sequence", findings)
