"""The cheapest path at the locations that are given, and what it is compared with."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import find_baselines, moved_clear
from fiveaxis.posture.masks.mask import Mask, MaskFunction
from fiveaxis.posture.masks.repair import Repair, never_dearer
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.portfolio import Portfolio, Progress
from fiveaxis.posture.strategy.reach import unreachable
from fiveaxis.posture.strategy.restarts import best_of_starts, leaning_paths
from fiveaxis.posture.strategy.sequence import long_turns
from fiveaxis.posture.strategy.singular import Cone, held
from fiveaxis.posture.turns.unwrapped import wrap_mask
from fiveaxis.posture.turns.winding import endless, winding_columns
from fiveaxis.toolpath import TiltBounds, Toolpath

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class GivenProblem:
    """What is solved at the locations that are given.

    Parameters
    ----------
    problem : of its locations
    machine : as it is
    toolpath, bounds : as they were given
    start : (n, 2), rad, chain order, a path that is refined; None for a search
    allowed : how much may be done
    progress : called with a stage's name, steps done and steps in all
    singular : the cone in which the first rotary axis is bound; None without one
    """

    problem: Problem
    machine: Machine
    toolpath: Toolpath
    bounds: TiltBounds
    start: Array | None
    allowed: Effort
    progress: Progress | None = None
    singular: Cone | None = None

    def endless(self) -> GivenProblem:
        """Pose the same where rotary axes turn without end."""
        problem = replace(self.problem, machine=endless(self.problem.machine))
        return replace(self, problem=problem, machine=endless(self.machine))


def solve_given(given: GivenProblem, mask: MaskFunction | None) -> tuple[Solution, Mask | None]:
    """Find the cheapest path as `_within_turns` does, or say where there is none.

    Raises
    ------
    Infeasible
        Locations out of reach; moves that turn too far.
    """
    problem, toolpath = given.problem, given.toolpath
    blocked = unreachable(toolpath, given.machine, given.bounds)
    if blocked:
        share = f"{len(blocked)} of {len(toolpath)} locations"
        raise Infeasible(f"{share} have no admissible posture on {given.machine.name}", blocked)
    try:
        return _within_turns(given, mask)
    except Infeasible:
        turning = long_turns(problem, toolpath)
        if not turning:
            raise
        moves = (
            f"{len(turning)} of {len(toolpath) - 1} moves turn further than they may on the best way found"
        )
        raise Infeasible(f"no way along the path: {moves}", turning) from None


def _within_turns(given: GivenProblem, mask: MaskFunction | None) -> tuple[Solution, Mask | None]:
    """Find the cheapest path in the turns that the axes have, or where there is none, one without end.

    Returns
    -------
    A solution on the machine, or on the `endless` one; and the mask as it was asked
    """
    asked = None if mask is None else Mask(mask)
    try:
        return _solved(given, asked), asked
    except Infeasible:
        if not winding_columns(given.machine):
            raise
    # No way within its turns: the axis winds as far as the path wants, and is turned back where it is cheap.
    asked = None if mask is None else Mask(wrap_mask(given.machine, mask))
    return _solved(given.endless(), asked), asked


def _solved(given: GivenProblem, mask: Mask | None) -> Solution:
    """Find the cheapest path of a problem, and what it is compared with."""
    problem, machine, toolpath, bounds = given.problem, given.machine, given.toolpath, given.bounds
    allowed, progress, singular = given.allowed, given.progress, given.singular
    compared, missing = find_baselines(toolpath, machine, bounds)
    # A baseline that the mask refuses is still a start.
    starts = compared
    if mask is not None:
        compared, refused = moved_clear(compared, problem, toolpath, machine, bounds, mask)
        missing = missing | refused
    run, optima = Portfolio(problem, allowed, progress), None

    def solve(bounded: Problem, start: Array) -> Array:
        again = Portfolio(bounded, allowed, progress, run.stages)
        near = again.refined_from("path within wider bounds", start)
        return near if bounded.violation(near) <= ALLOWED else again.best_path(starts)

    # IPOPT's linear solver works on small blocks: threads of the BLAS under it only wait for each other.
    with threadpool_limits(limits=1):
        if given.start is not None:
            rotary = solve(problem, given.start)
        elif allowed.is_many:
            leaning = leaning_paths(toolpath, machine, bounds, allowed)
            rotary, optima = best_of_starts(run, starts, leaning)
        else:
            rotary = run.best_path(starts)
        if singular is not None:
            rotary = held(problem, toolpath, rotary, solve, singular)
        if mask is not None:
            rotary = Repair(run, mask).repaired(rotary, toolpath, compared)
            rotary = never_dearer(problem, rotary, compared)
    for stage in run.stages:
        logger.debug("%s: %s, %d steps, %.1f J", stage.name, stage.status, stage.iterations, stage.after)
    _require_admissible(problem, rotary, toolpath)
    motion = follow(toolpath, machine, rotary)
    energy = motion_energy(machine, motion)
    logger.info("%d locations on %s: %.1f J", len(toolpath), machine.name, energy.total)
    return Solution(
        machine, toolpath, bounds, motion, energy, compared, missing, tuple(run.stages), problem, optima
    )


def _require_admissible(problem: Problem, rotary: Array, toolpath: Toolpath) -> None:
    """Refuse to hand out a path that breaks a bound, naming the places.

    Raises
    ------
    Infeasible
        Tilt, limit or rotary step broken somewhere by more than rounding.
    """
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
            f"no posture was found that keeps {what} and joins its neighbours; allow larger turns "
            "(--max-turn), put the locations closer together, or widen the tilt range",
            toolpath.place(int(row)),
        )
        for what, rows in broken.items()
        for row in np.flatnonzero(rows)
    ]
    if findings:
        raise Infeasible(f"{len(findings)} locations have no admissible posture in sequence", findings)
