"""The cheapest path at the given locations, and the baselines it is compared with."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import INSIDE, NoBaseline, find_baselines, follow_axes, moved_clear, uphill
from fiveaxis.posture.bound.relaxed import relaxed_path
from fiveaxis.posture.masks.enforcement import Enforcement, Refused, or_cheaper_baseline
from fiveaxis.posture.masks.mask import Mask, MaskFunction
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Optima, Solution
from fiveaxis.posture.strategy.effort import Effort
from fiveaxis.posture.strategy.infeasibility import long_turns, unreachable
from fiveaxis.posture.strategy.portfolio import Portfolio
from fiveaxis.posture.strategy.singular import Cone, hold_in_cone
from fiveaxis.posture.turns.unwrapped import wrap_mask
from fiveaxis.posture.turns.winding import endless, winding_columns
from fiveaxis.progress import Progress
from fiveaxis.toolpath import TiltBounds, Toolpath

logger = logging.getLogger(__name__)

# Names of the portfolio's own start among several, and of the path that touches the boxes of the lower bound.
OWN, RELAXED = "searches", "relaxed path"


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


def solve_given(given: GivenProblem, mask: MaskFunction | None) -> tuple[Solution, Mask | None]:
    """Find the cheapest path, if possible within the turns that the axes have.

    Returns
    -------
    A solution on the machine, or on the `endless` one, and the mask that counted its queries

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


def _within_turns(given: GivenProblem, mask: MaskFunction | None) -> tuple[Solution, Mask | None]:
    """Solve within the turns that the axes have, or where that fails, on the `endless` machine."""
    machine, counted = given.problem.machine, None if mask is None else Mask(mask)
    try:
        return _solve(given, counted), counted
    except Infeasible:
        if not winding_columns(machine):
            raise
    # The axis turns as far as the path needs; afterwards it is rewound where that is cheap.
    counted = None if mask is None else Mask(wrap_mask(machine, mask))
    return _solve(given.endless(), counted), counted


def _solve(given: GivenProblem, mask: Mask | None) -> Solution:
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
    run, optima = Portfolio(problem, effort, progress), None

    def solve(bounded: Problem, start: Array) -> Array:
        again = Portfolio(bounded, effort, progress, run.stages)
        near = again.refined_from("path within wider bounds", start)
        return near if bounded.violation(near) <= ALLOWED else again.best_path(starts)

    # IPOPT's linear solver works on small blocks, for which threads of the BLAS only wait for each other.
    with threadpool_limits(limits=1):
        if given.start is not None:
            rotary = solve(problem, given.start)
        elif effort.is_many:
            more = leaning_paths(toolpath, machine, bounds, effort)
            progress("tracing the relaxed path of the lower bound", 0, 1)
            relaxed = relaxed_path(problem, toolpath, bounds)
            more |= {} if relaxed is None else {RELAXED: relaxed}
            rotary, optima = best_of_starts(run, starts, more)
        else:
            rotary = run.best_path(starts)
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
    return Solution(
        machine, toolpath, bounds, motion, energy, compared, missing, tuple(run.stages), problem, optima
    )


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


def best_of_starts(
    run: Portfolio, compared: Mapping[str, Baseline], more: Mapping[str, Array]
) -> tuple[Array, Optima]:
    """Find the cheapest admissible path from all starts of the effort.

    The portfolio's own searches come first, so the result is never costlier than without the other starts.

    Parameters
    ----------
    run : the portfolio; the stages of the other starts are added to its own
    compared : the baselines
    more : further starts by name, (n, 2) rad (`leaning_paths`, `relaxed_path`)

    Returns
    -------
    The path, (n, 2) rad, and the spread of what was found.

    Raises
    ------
    Infeasible
        No start leads to a path.
    """
    problem, effort = run.problem, run.effort
    found = {OWN: _searched(run, compared)}
    for number, searches in enumerate(effort.others, start=1):
        name = f"{OWN}, set {number}"
        other = Portfolio(problem, replace(effort, searches=searches), run.progress)
        found[name] = _searched(other, {})
        run.stages += [replace(stage, name=f"{name}: {stage.name}") for stage in other.stages]
    columns = problem.machine.rotary_columns
    own = {f"baseline {name}": b.motion.positions[:, columns] for name, b in compared.items()}
    for name, start in ({**own, **more} if effort.from_baselines else more).items():
        found[name] = run.refined_from(name, start)
    return _cheapest(problem, found)


def leaning_paths(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, effort: Effort) -> dict[str, Array]:
    """Compute paths with a constant upward lean, (n, 2) rad, of those angles that the limits allow."""
    paths = {}
    upwards = uphill(tilt.reference, machine.chain.tool_home[:3, 2])
    for share in effort.leans:
        angle = (1.0 - share) * (tilt.low + INSIDE) + share * (tilt.high - INSIDE)
        axis = np.cos(angle) * tilt.reference + np.sin(angle) * upwards
        try:
            paths[f"lean of {np.degrees(angle):.3g} deg"] = follow_axes(toolpath, machine, axis)
        except NoBaseline:
            continue
    return paths


def _searched(run: Portfolio, compared: Mapping[str, Baseline]) -> Array | Infeasible:
    try:
        return run.best_path(compared)
    except Infeasible as reason:
        return reason


def _cheapest(problem: Problem, found: Mapping[str, Array | Infeasible]) -> tuple[Array, Optima]:
    paths = {name: path for name, path in found.items() if not isinstance(path, Infeasible)}
    sound = {n: problem.path_cost(path) for n, path in paths.items() if problem.violation(path) <= ALLOWED}
    optima = Optima(sound, tuple(name for name in found if name not in sound))
    if sound:
        return paths[min(sound, key=lambda name: sound[name])], optima
    # If no path is admissible, the portfolio's own shows why.
    first = found[OWN]
    if isinstance(first, Infeasible):
        raise first
    return first, optima
