"""The optimiser: from a path, a machine and bounds to a solution with its baselines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import Filling, Interpolation
from fiveaxis.nc import Clock
from fiveaxis.posture.local.refinement import STRUCTURED, require_solver
from fiveaxis.posture.masks.clearance import Clearance
from fiveaxis.posture.masks.mask import Mask, MaskFunction
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.starts.passes import free_starts
from fiveaxis.posture.strategy import holding
from fiveaxis.posture.strategy.delivery import Delivery, Objective, Posed, delivered
from fiveaxis.posture.strategy.effort import ROUGH, Effort, effort_of
from fiveaxis.posture.strategy.given_path import GivenProblem, solve_given
from fiveaxis.posture.strategy.least_time import by_time, time_findings
from fiveaxis.posture.strategy.portfolio import Portfolio, Progress
from fiveaxis.posture.strategy.singular import Cone, bounded_within, with_findings
from fiveaxis.posture.strategy.turn_bounds import turn_bounds
from fiveaxis.posture.turns.unwrapped import path_check, rewind_solution
from fiveaxis.toolpath import Constraints, TiltBounds, Toolpath
from fiveaxis.toolpath.passes import Passes


def optimise(
    toolpath: Toolpath,
    machine: Machine,
    constraints: Constraints,
    *,
    mask: MaskFunction | None = None,
    objective: Objective = "energy",
    up_penalty: float = 0.0,
    smoothing: float = 0.0,
    time_price: float | None = None,
    free_start: bool | Passes = False,
    free_direction: bool = False,
    effort: str | Effort = "normal",
    interpolation: Interpolation = Interpolation.JOINT,
    clock: Clock | None = None,
    solver: str = STRUCTURED,
    start: Array | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Choose the rotary angles of every cutter location so that its program costs the least.

    A portfolio of global searches on some of the locations gives starts; each is refined by the exact NLP,
    and the best are extended to all locations and refined there, all by the travel metric
    ``Σ W⁺Δq⁺ + W⁻Δq⁻`` with the price of delay and of bends (`Problem`). Then locations are inserted where
    the program needs blocks, and the whole is solved for the energy of those blocks
    (`fiveaxis.posture.strategy.delivery`). The result is the best local optimum found, not proven global.

    Parameters
    ----------
    toolpath : cutter locations
    machine : two rotary and three linear axes, all with powers
    constraints : on the tool's lean and the rotary axes' turns. By default an axis turns by 180 deg/s at the
        programmed feed; links turn three times as far, and farther only where there is no other way. While
        the tool axis passes the singular cone in a cut, the first rotary axis is held, or turns at most by
        the singular rate; what can't be held is told by a finding
    mask : tells for locations (m,) and rotary angles (m, 2), rad, chain order, which are admissible, (m,)
        bool (`fiveaxis.posture.masks.mask`); asked only about what a search is going to use. Where a rotary
        axis is rewound it holds at the locations of the path, and not on the way off the part and back
    objective : what is least: ``energy``, ∫P dt of the feed drives in the program's blocks; ``travel``, the
        travel metric of form-shaping Eq. 1; ``time``, what the control takes for the blocks under the axes'
        highest speeds and accelerations, and the steadiest posture where that costs none (`by_time`)
    up_penalty : J/mm, extra price of the machine's Z moving up
    smoothing : J/rad², price μ of ‖Δρ‖² in each move: dearer travel for a steadier posture
    time_price : W, of time that a posture costs beyond the programmed feed's, where an axis would have to be
        faster than its highest speed; by default the machine's base power, 0 where that is unknown. Not with
        the objective ``time``, which knows no other price
    free_start : whether closed passes may begin elsewhere (`fiveaxis.posture.starts.passes`); the
        solution's path then has them in another order. Those that are reached by links do so only if the
        path's `Plan.passes` (`fiveaxis.contour.plan_passes`), which know how to lay other links, are given
        in place of True
    free_direction : whether those may also be followed backwards: climb milling turns to conventional there
    effort : ``quick``, ``normal`` or ``thorough``, or counts of one's own: how much is done, with what that
        promises in
        `fiveaxis.posture.strategy.effort.EFFORTS`
    interpolation : of the control that the program is for
    clock : how long that control takes for blocks; by default it passes corners within 5 µm
    solver : ``structured``, the interior-point method made for paths, or ``ipopt``, a second opinion on the
        same terms (`fiveaxis.posture.local`), in place of the effort's
    start : (n, 2), rad, chain order, postures that are refined in place of a search
    progress : called with a stage's name, steps done and steps in all

    Returns
    -------
    The solution with its baselines and a record of what the solver did. Its path has the locations that its
    program needs between those given (`Motion.location`). Where a rotary axis has too few turns
    for any way along the path, its toolpath holds links on which the axis is turned back, each with a finding
    (`fiveaxis.posture.turns.rewinding`).

    Raises
    ------
    Infeasible
        Some locations have no admissible posture; each is listed with its reason.
    MachineError
        The machine has no powers, too few axes, or no highest speeds where time is the objective.
    ToolError, ToolpathError
        The cutter doesn't touch with one part of its profile over the range; the path lacks the direction
        that the range refers to.
    SettingError
        Nothing bounds the tool's lean; a held axis that the machine hasn't got, or held out of its limits; an
        unknown effort or solver; a price of time where that is the objective.
    """
    _require_options(
        toolpath,
        begins_elsewhere=bool(free_start),
        both_ways=free_direction,
        stays=mask is not None or constraints.singular_cone is not None,
        timed=objective == "time",
        time_price=time_price,
    )
    require_solver(solver)
    allowed = replace(effort_of(effort), solver=solver)
    if objective != "travel":
        # The prices of travel are but a start for those of blocks.
        allowed = replace(allowed, last_barrier=ROUGH)
    singular = Cone.of(constraints)
    machine = holding.hold(machine, constraints.hold)
    toolpath = constraints.zoned(toolpath)
    timed = objective == "time"
    if timed:
        toolpath = replace(toolpath, findings=(*toolpath.findings, *time_findings(machine)))

    def build(path: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
        leaning = constraints.lean_bounds(path)
        built = Problem.build(
            path,
            machine,
            leaning,
            up_penalty=up_penalty,
            max_turn=turn_bounds(path, constraints, location),
            time_price=(machine.base_power or 0.0) if time_price is None else time_price,
            bend_price=smoothing,
        )
        return by_time(built, up_penalty, smoothing) if timed else built, leaning

    problem, bounds = build(toolpath)
    given = GivenProblem(problem, machine, toolpath, bounds, start, allowed, progress, singular)
    found, asked = solve_given(given, mask)

    def rebuild(path: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
        other, leaning = build(path, location)
        return replace(other, machine=found.machine), leaning

    if free_start:
        again = _refiner(allowed, progress, "another start")
        passes = None if free_start is True else free_start
        found = free_starts(found, rebuild, again, passes=passes, both_directions=free_direction)
    filling = Filling.of(constraints, interpolation)
    refine = _Refinement(allowed, singular, asked)
    clock = (clock or Clock()) if timed else None
    found = delivered(found, Delivery(found.toolpath, rebuild, refine, filling, up_penalty, objective, clock))
    if found.machine is not machine:
        rotary = found.motion.positions[:, machine.rotary_columns]
        admits = None if asked is None else asked.along(found.motion.location).admits
        keeps = path_check(found.toolpath, found.machine, rotary, singular, admits)
        found = rewind_solution(found, machine, _refiner(allowed, progress, "one turn less"), keeps)
    return with_findings(found, singular)


def _require_options(
    toolpath: Toolpath,
    *,
    begins_elsewhere: bool,
    both_ways: bool,
    stays: bool,
    timed: bool,
    time_price: float | None,
) -> None:
    """Refuse options that contradict each other or the path.

    Raises
    ------
    SettingError, ToolpathError
        As `optimise`.
    """
    if not toolpath.cutting.any():
        raise ToolpathError("has links only; there is no cut to choose a posture for", file=toolpath.name)
    if begins_elsewhere and stays:
        raise SettingError("free_start can't be combined with a mask or a singular cone; leave one out")
    if both_ways and not begins_elsewhere:
        raise SettingError("free_direction goes with free_start only; give that, too")
    if timed and time_price is not None:
        raise SettingError("time_price can't be combined with the objective time; leave one out")


@dataclass(frozen=True, eq=False)
class _Refinement:
    """Refines a path on the locations of its program, within the mask and the singular cone."""

    allowed: Effort
    singular: Cone | None
    mask: Mask | None

    def __call__(self, posed: Posed, problem: Problem, start: Array) -> Array:
        """Solve a problem of posed locations near a start, (n, 2) rad."""
        if self.singular is not None:
            problem = bounded_within(problem, posed.path, start, self.singular)
            turned = np.abs(np.diff(start, axis=0))
            problem = replace(problem, max_turn=np.maximum(problem.max_turn, turned))
        clear = None if self.mask is None else Clearance.of(self.mask.along(posed.location), problem)
        with threadpool_limits(limits=1):
            return Portfolio(problem, self.allowed, None, clear=clear).refined_near(start)


def _refiner(allowed: Effort, progress: Progress | None, name: str) -> Callable[[Problem, Array], Array]:
    """Make what refines a path on a problem of its own."""

    def refine(problem: Problem, start: Array) -> Array:
        with threadpool_limits(limits=1):
            return Portfolio(problem, allowed, progress).refined_from(name, start)

    return refine
