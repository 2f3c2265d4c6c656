"""The optimiser: from a path, a machine and constraints to a solution with its baselines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.errors import Infeasible, SettingError, ToolpathError
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine, power_findings, with_powers
from fiveaxis.motion import USUAL_CLOCK, Clock, Filling, Interpolation
from fiveaxis.options import Objective, Search, completed, defaults
from fiveaxis.posture.masks.mask import Mask, MaskFunction
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.starts.passes import free_starts
from fiveaxis.posture.strategy import holding
from fiveaxis.posture.strategy.bounding import with_bound
from fiveaxis.posture.strategy.delivery import Delivery, delivered
from fiveaxis.posture.strategy.effort import ROUGH, Effort, effort_of
from fiveaxis.posture.strategy.given_path import GivenProblem, refusal, solve_given, without_path
from fiveaxis.posture.strategy.least_time import time_findings
from fiveaxis.posture.strategy.near import Near, refined
from fiveaxis.posture.strategy.program_path import Breach
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.strategy.turn_bounds import turn_bounds
from fiveaxis.posture.turns.unwrapped import path_check, rewind_solution
from fiveaxis.posture.turns.winding import endless, winding_columns
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import Constraints, TiltBounds, Toolpath
from fiveaxis.toolpath.passes import Passes

# Largest turns, as a share of the smallest one that broke a bound between locations; most mm that are kept
# from the ends of travel; attempts.
SMALLER, MOST_RESERVE, MOST_ATTEMPTS = 0.7, 0.1, 3
SEARCH = cast("Search", defaults(Search))


@dataclass(frozen=True, eq=False)
class Options:
    """What is minimised and how: the options of `fiveaxis.options.Search`, and what only code can give.

    Parameters
    ----------
    mask : which postures are admissible; a function that `Mask.of` takes, too
    passes : closed passes from which new links are laid, where these may begin elsewhere; by default the
        path's rings
    interpolation, clock : of the program
    start : (n, 2), rad, chain order, postures to begin from beside those that are searched
    progress : called with what is being done, steps done and steps in all
    """

    objective: Objective = SEARCH["objective"]
    up_penalty: float = SEARCH["up_penalty"]
    smoothing: float = SEARCH["smoothing"]
    steady: float = SEARCH["steady"]
    time_price: float | None = SEARCH["time_price"]
    effort: str | Effort = SEARCH["effort"]
    solver: str = SEARCH["solver"]
    bound: bool | None = SEARCH["bound"]
    free_start: bool = SEARCH["free_start"]
    free_direction: bool = SEARCH["free_direction"]
    mask: Mask | MaskFunction | None = None
    passes: Passes | None = None
    interpolation: Interpolation = Interpolation.JOINT
    clock: Clock = USUAL_CLOCK
    start: Array | None = None
    progress: Progress = unheard

    @property
    def is_bounded(self) -> bool:
        """Whether a lower bound is computed: by default only with the effort ``thorough``."""
        return self.effort == "thorough" if self.bound is None else self.bound

    @property
    def is_timed(self) -> bool:
        """Whether time is the objective."""
        return self.objective == "time"

    def counts(self) -> Effort:
        """Look up the effort by its name; `solver` replaces the effort's own.

        Raises
        ------
        SettingError
            An unknown effort or solver.
        """
        return effort_of(self.effort).having(solver=self.solver)

    def without_free_start(self) -> Options:
        """Return the options with which passes stay as they are."""
        return replace(self, free_start=False, free_direction=False)

    def require_consistent(self, constraints: Constraints) -> None:
        """Raise an error if options contradict each other or the constraints.

        Raises
        ------
        SettingError
            A value out of its range, an unknown word; `free_start` with a mask or a singular cone,
            `free_direction` without `free_start`, `time_price` with the objective ``time``.
        """
        own = {name: getattr(self, name) for name in SEARCH}
        completed(Search, own | ({"effort": SEARCH["effort"]} if isinstance(self.effort, Effort) else {}))
        if self.free_start and (self.mask is not None or constraints.singular_cone is not None):
            raise SettingError("free_start can't be combined with a mask or a singular cone; leave one out")
        if self.free_direction and not self.free_start:
            raise SettingError("free_direction goes with free_start only; give that, too")
        if self.is_timed and self.time_price is not None:
            raise SettingError("time_price can't be combined with the objective time; leave one out")


DEFAULTS = Options()


def optimise(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, options: Options = DEFAULTS
) -> Solution:
    """Choose the rotary angles of every cutter location so that its program costs the least.

    Exact postures are searched, by the price of the program's blocks and by the travel metric
    ``Σ W⁺Δq⁺ + W⁻Δq⁻``, and what is found is refined by the exact NLP, on the locations that the program
    needs (`fiveaxis.posture.search.successors`, `fiveaxis.posture.strategy.delivery`). The result is the best
    local optimum found, not proven global.

    Parameters
    ----------
    toolpath : cutter locations
    machine : two rotary and three linear axes, all with powers
    constraints : on the tool's lean and the rotary axes' turns (`turn_bounds` has the default)
    options : objective, prices, effort and the rest

    Returns
    -------
    The solution with its baselines and a record of what the solver did. Its path includes the locations that
    its program needs between those given (`Motion.location`). Where a rotary axis has too few turns for the
    path, the toolpath contains links on which the axis rewinds, each with a finding
    (`fiveaxis.posture.turns.rewinding`).

    Raises
    ------
    Infeasible
        Some locations have no admissible posture; each is listed with its reason.
    MachineError
        The machine has no powers, too few axes, or no highest speeds where time is the objective.
    ToolError, ToolpathError
        The cutter doesn't touch with one part of its profile over the range; the path has no cut, or lacks
        the direction that the range refers to.
    SettingError
        Nothing bounds the tool's lean; a held axis that the machine doesn't have, or held outside its limits;
        options that contradict each other (`Options.require_consistent`), or an unknown effort or solver.
    """
    if not toolpath.cutting.any():
        raise ToolpathError("has links only; there is no cut to choose a posture for", file=toolpath.name)
    options.require_consistent(constraints)
    effort = options.counts()
    progress, smoothing, up_penalty = options.progress, options.smoothing, options.up_penalty
    cone = Cone.of(constraints)
    machine = holding.hold(with_powers(machine), constraints.hold)
    toolpath = constraints.zoned(toolpath)
    toolpath = replace(toolpath, findings=(*toolpath.findings, *power_findings(machine)))
    if options.is_timed:
        toolpath = replace(toolpath, findings=(*toolpath.findings, *time_findings(machine)))

    def build(narrow: Narrow, path: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
        bounds = constraints.lean_bounds(path)
        built = Problem.build(
            path,
            narrow.machine,
            bounds,
            up_penalty=up_penalty,
            max_turn=turn_bounds(path, narrow.constraints, location),
            time_price=(machine.base_power or 0.0) if options.time_price is None else options.time_price,
            bend_price=smoothing,
        )
        return built, bounds

    own, filling = Mask.of(options.mask), Filling.of(constraints, options.interpolation)

    def solved(narrow: Narrow) -> _Attempt:
        """Solve within narrower bounds, if possible within the turns that the axes have."""
        winding = winding_columns(narrow.machine)
        try:
            attempt = solved_on(narrow, own)
            if attempt.fault is None or not winding:
                return attempt
        except Infeasible:
            if not winding:
                raise
        # The axis turns as far as the path needs; afterwards it is rewound where that is cheap.
        mask = None if own is None else own.wrapped(machine)
        attempt = solved_on(replace(narrow, machine=endless(narrow.machine)), mask)
        return replace(attempt, found=replace(attempt.found, machine=endless(machine)))

    def solved_on(narrow: Narrow, mask: Mask | None) -> _Attempt:
        """Solve on the machine of the bounds."""
        problem, bounds = build(narrow, toolpath)
        starting = effort.nested[0].having(last_barrier=ROUGH)
        given = GivenProblem(problem, bounds, toolpath, options.start, starting, progress)
        found = solve_given(given, mask)

        def rebuild(path: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
            return build(narrow, path, location)

        if options.free_start:
            again, both = partial(refined, effort=starting), options.free_direction
            found = free_starts(found, rebuild, again, passes=options.passes, both_directions=both)
        delivery = Delivery(
            found.toolpath,
            rebuild,
            Near(effort, cone, mask),
            filling,
            effort,
            up_penalty,
            smoothing,
            options.objective,
            options.steady,
            options.clock,
            constraints.turn_rate is not None,
            progress=progress,
        )
        others = {} if options.start is None or options.free_start else {"the start given": options.start}
        found, rank, breach = delivered(found, delivery, others, everywhere=True)
        rotary, location = found.motion.positions[:, machine.rotary_columns], found.motion.location
        rotary = rotary if location is None else rotary[location == np.floor(location)]
        fault = None
        if not delivery.admits(rotary):
            fault = without_path(rebuild(delivery.given)[0], rotary, delivery.given)
        elif mask is not None:
            refused = ~mask.admits(np.arange(len(toolpath)), rotary)
            if refused.any():
                raise refusal(problem, toolpath, rotary, refused, mask)
        # Without the narrower limits.
        return _Attempt(replace(found, machine=machine), mask, rank, breach, fault)

    # The linear solvers work on small blocks, for which threads of the BLAS only wait for each other.
    with threadpool_limits(limits=1):
        attempt = _best_attempt(solved, Narrow(machine, constraints))
        found, mask = attempt.found, attempt.mask
        if found.machine is not machine:
            rotary = found.motion.positions[:, machine.rotary_columns]
            mask = None if mask is None else mask.along(found.motion.location)
            keeps = path_check(found.toolpath, found.machine, rotary, cone, mask)
            found = rewind_solution(found, machine, partial(refined, effort=effort), keeps)
        found = with_findings(found, cone)
        return with_bound(found, constraints, options.objective, progress) if options.is_bounded else found


@dataclass(frozen=True, eq=False)
class Narrow:
    """Bounds within which a path is solved, so that those that are given hold between its locations, too.

    Parameters
    ----------
    machine : with limits of its linear axes narrower by `reserve`
    constraints : with the largest turn
    reserve : mm
    """

    machine: Machine
    constraints: Constraints
    reserve: float = 0.0

    def within(self, machine: Machine, breach: Breach) -> Narrow:
        """Return the bounds, narrower by what was broken, of a machine."""
        constraints, reserve = self.constraints, self.reserve
        if np.isfinite(breach.hop):
            constraints = replace(constraints, max_turn=SMALLER * breach.hop)
        if breach.overrun > 0.0:
            reserve = min(reserve + 2.0 * breach.overrun, MOST_RESERVE)
        axes = (a if a.is_rotary else replace(a, limits=a.limits.narrower(reserve)) for a in machine.axes)
        return Narrow(replace(machine, axes=tuple(axes)) if reserve else machine, constraints, reserve)


@dataclass(frozen=True, eq=False)
class _Attempt:
    """A solution within some bounds.

    Parameters
    ----------
    found, mask : the solution, and the mask that it was found within
    rank : key by which the better of two is smaller: what is broken, then the cost
    breach : what the path that was solved breaks between locations, even if a baseline took its place
    fault : why it can't be delivered; None where it can
    """

    found: Solution
    mask: Mask | None
    rank: tuple[float, float]
    breach: Breach | None
    fault: Infeasible | None


def _best_attempt(solved: Callable[[Narrow], _Attempt], given: Narrow) -> _Attempt:
    """Solve again within narrower bounds while one is broken between locations; return the best of all.

    Directions that keep a least angle to the normal surround a hole, over which a turn within one move hops;
    and blocks between two locations at the end of an axis's travel may go some micrometres beyond it.
    """
    attempts = [solved(given)]
    narrow = given
    while attempts[-1].breach is not None and len(attempts) <= MOST_ATTEMPTS:
        narrow = narrow.within(given.machine, attempts[-1].breach)
        try:
            attempts.append(solved(narrow))
        except Infeasible:
            break
    best = min(attempts, key=lambda one: one.rank)
    if best.fault is not None:
        raise best.fault
    stages = [stage for attempt in attempts for stage in attempt.found.stages]
    return replace(best, found=replace(best.found, stages=tuple(stages)))
