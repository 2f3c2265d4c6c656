"""Where a search begins: the baselines, and a path of little travel."""

from __future__ import annotations

import logging
from functools import partial

from fiveaxis.energy import BlockCosts, motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.geometry import Array
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import find_baselines, moved_clear
from fiveaxis.posture.local.optima import refine
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import path_anywhere
from fiveaxis.posture.solution import Solution, Stage
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.infeasibility import unreachable, without_path
from fiveaxis.toolpath import TiltBounds, Toolpath

logger = logging.getLogger(__name__)

# First barrier parameter, J, near a path.
BARRIER = 1e-2
# IPOPT's iterations where a path is searched, and for the last time.
ITERATIONS = 120


def solve_given(
    problem: Problem,
    toolpath: Toolpath,
    bounds: TiltBounds,
    effort: Effort,
    mask: Mask | None,
    options: Options,
    known: Array | None = None,
) -> Solution:
    """Find the baselines and a path to begin with, which the mask needn't admit.

    Parameters
    ----------
    options : with the path that is refined instead of a search, if there is one
    known : (n, 2), rad, chain order, a path that takes the place of both

    Raises
    ------
    Infeasible
        Locations out of reach; moves that turn too far.
    """
    machine, start, progress = problem.machine, options.start, options.progress
    blocked = unreachable(toolpath, machine, bounds)
    if blocked:
        share = f"{len(blocked)} of {len(toolpath)} locations"
        raise Infeasible(f"{share} have no admissible posture on {machine.name}", blocked)
    progress("computing baselines", 0, 1)
    compared, missing = find_baselines(toolpath, machine, bounds, options.checkpoint)
    baselines = compared
    if mask is not None:
        compared, refused = moved_clear(compared, problem, toolpath, bounds, mask)
        missing = missing | refused

    def searched() -> Array:
        paths = [b.motion.positions[:, machine.rotary_columns] for b in baselines.values()]
        sound = [path for path in paths if problem.violation(path) <= ALLOWED]
        if sound:
            return min(sound, key=problem.path_cost)
        progress("searching postures", 0, 1)
        costs = BlockCosts.of_travel(problem.plus, problem.minus)
        admits = None if mask is None else mask.roughly_admits
        found = path_anywhere(problem, costs, effort.everywhere[0], admits)
        if len(found) == len(problem):
            found = refined(problem, found, effort)
            if problem.violation(found) <= ALLOWED:
                return found
        raise without_path(problem, toolpath, found, mask)

    rotary = known
    if rotary is None and start is not None:
        rotary = options.checkpoint.found(partial(refined, problem, start, effort))
    if rotary is None or (known is None and problem.violation(rotary) > ALLOWED):
        rotary = options.checkpoint.found(searched)
    motion = follow(toolpath, machine, rotary)
    energy = motion_energy(machine, motion)
    logger.info("%d locations on %s: %.1f J to begin with", len(toolpath), machine.name, energy.total)
    stages = (Stage("path to begin with", "found", 0, None, problem.path_cost(rotary)),)
    return Solution(machine, toolpath, bounds, motion, energy, compared, missing, stages, problem)


def refined(problem: Problem, start: Array, effort: Effort) -> Array:
    """Refine a path, (n, 2) rad; the start itself if that is no improvement."""
    return refine(
        problem.eased(start),
        start,
        iterations=ITERATIONS,
        barrier=BARRIER,
        last=effort.last_barrier,
        solver=effort.solver,
    ).rotary
