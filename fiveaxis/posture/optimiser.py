"""The optimiser: from a path, a machine and constraints to a solution with its baselines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import power_findings
from fiveaxis.errors import Infeasible, MachineError, ToolpathError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.kinematics import within_limits
from fiveaxis.machine import Machine, with_powers
from fiveaxis.motion import Filling, Interpolation, follow
from fiveaxis.motion.deviation import WRITTEN_TOLERANCE
from fiveaxis.options import Objective
from fiveaxis.posture.bound.lower_bound import bound_energy, bound_travel
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import DEFAULTS, Options
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.strategy import holding
from fiveaxis.posture.strategy.delivery import Delivery, delivered
from fiveaxis.posture.strategy.effort import ROUGH
from fiveaxis.posture.strategy.given_path import refined, solve_given
from fiveaxis.posture.strategy.infeasibility import refusal, without_path
from fiveaxis.posture.strategy.least_time import time_findings
from fiveaxis.posture.strategy.near import Near
from fiveaxis.posture.strategy.program_path import Breach
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.strategy.turn_bounds import turn_bounds
from fiveaxis.posture.turns.unwrapped import path_check, rewind_solution
from fiveaxis.posture.turns.winding import endless, winding_columns
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import Constraints, TiltBounds, Toolpath, knots

# Largest turns, as a share of the smallest one that broke a bound between locations; most mm that are kept
# from the ends of travel; attempts.
SMALLER, MOST_RESERVE, MOST_ATTEMPTS = 0.7, 0.1, 3
# A path of more locations is solved at its knots first, if they are at most this share; how far locations in
# between may be from their chords, mm and ends of unit vectors, and moves from knot to knot.
LONG, SPARSE = 5000, 0.5
APART, TILTED, MOVES = WRITTEN_TOLERANCE, 2e-4, 64
# rad: how far a held end may lean from its axis, so that there is room for a solver.
HELD = np.radians(0.02)
# rad: rounding of a turn.
SAME_TURN = 1e-6

Found = TypeVar("Found", bound=Solution)


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
        an unknown effort.
    """
    if options.is_timed and options.start is None:
        options = replace(options, start=_of_least_energy(toolpath, machine, constraints, options))
    if not toolpath.cutting.any():
        raise ToolpathError("has links only; there is no cut to choose a posture for", file=toolpath.name)
    effort = options.counts()
    cone = Cone.of(constraints)
    machine = holding.hold(with_powers(machine), constraints.hold)
    toolpath = constraints.zoned(toolpath)
    toolpath = replace(toolpath, findings=(*toolpath.findings, *power_findings(machine)))
    if options.is_timed:
        toolpath = replace(toolpath, findings=(*toolpath.findings, *time_findings(machine)))

    def build(narrow: Narrow, path: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
        bounds = constraints.lean_bounds(path)
        if options.holds_ends:
            bounds = replace(bounds, beside=(*bounds.beside, _held_ends(path, narrow.machine)))
        built = Problem.build(
            path,
            narrow.machine,
            bounds,
            up_penalty=options.up_penalty,
            max_turn=turn_bounds(path, narrow.constraints, location, narrow.turning),
            time_price=(machine.base_power or 0.0) if options.time_price is None else options.time_price,
            bend_price=options.smoothing,
        )
        return built, bounds

    starting = effort.nested[0].having(last_barrier=ROUGH)
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

    def posed_on(
        narrow: Narrow, mask: Mask | None, path: Toolpath, start: Array | None, known: Array | None = None
    ) -> tuple[Solution, Delivery]:
        """Find a path to begin with, unless one is known, and what will solve it for its program."""
        problem, bounds = build(narrow, path)
        found = solve_given(problem, path, bounds, starting, mask, replace(options, start=start), known)

        def rebuild(again: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
            return (problem, bounds) if again is path else build(narrow, again, location)

        near, by_length = Near(effort, cone, mask), constraints.turn_rate is not None
        delivery = Delivery(found.toolpath, rebuild, near, filling, options, by_length, known is not None)
        return found, delivery

    def at_knots(narrow: Narrow, mask: Mask | None) -> Array | None:
        """Solve at the knots of a long path; (n, 2) rad, None where that is no less work, or impossible."""
        # The turn that a move may take is no bound on many moves, and least time hangs on each.
        by_moves = narrow.constraints.max_turn is not None or options.objective == "time"
        if len(toolpath) <= LONG or by_moves:
            return None
        rows = knots(toolpath, APART, TILTED, MOVES)
        if len(rows) > SPARSE * len(toolpath):
            return None
        few = replace(toolpath.at(rows), numbers=toolpath.numbered[rows])
        mask = None if mask is None else mask.along(rows.astype(float))
        start = None if options.start is None else options.start[rows]
        try:
            found, delivery = posed_on(narrow, mask, few, start)
        except Infeasible:  # the moves between the knots may be too far, or the mask too narrow there
            return None
        best = delivery.run(found.motion.positions[:, machine.rotary_columns], everywhere=True)
        run, location = np.cumsum(toolpath.lengths), best.posed.location
        at = np.interp(location, np.arange(len(rows)), run[rows])
        rotary = np.stack([np.interp(run, at, angle) for angle in best.rotary.T], axis=1)
        # Where the pivot stands still, several locations are at the same length.
        rotary[rows] = best.rotary[location == np.floor(location)]
        return rotary

    def solved_on(narrow: Narrow, mask: Mask | None) -> _Attempt:
        """Solve on the machine of the bounds."""
        found, delivery = posed_on(narrow, mask, toolpath, options.start, at_knots(narrow, mask))
        others = {} if options.start is None else {"the start given": options.start}
        found, rank, breach = delivered(found, delivery, others)
        rotary, fault = found.motion.positions[found.motion.given][:, machine.rotary_columns], None
        if not delivery.admits(rotary):
            fault = without_path(delivery.given_problem, delivery.given, rotary)
        elif mask is not None:
            refused = ~mask.admits(np.arange(len(toolpath)), rotary)
            if refused.any():
                raise refusal(delivery.given_problem, toolpath, rotary, refused, mask)
        # Without the narrower limits.
        return _Attempt(replace(found, machine=machine), mask, rank, breach, fault)

    # The linear solvers work on small blocks, for which threads of the BLAS only wait for each other.
    with threadpool_limits(limits=1):
        try:
            attempt = _best_attempt(solved, Narrow(machine, constraints))
        except Infeasible:
            if constraints.max_turn is not None or not toolpath.has_axes:
                raise
            attempt = _best_attempt(solved, Narrow(machine, constraints, turning=machine))
        found, mask = attempt.found, attempt.mask
        if found.machine is not machine:
            rotary = found.motion.positions[:, machine.rotary_columns]
            mask = None if mask is None else mask.along(found.motion.location)
            keeps = path_check(found.toolpath, found.machine, rotary, cone, mask)
            found = rewind_solution(found, machine, partial(refined, effort=effort), keeps)
        found = with_findings(found, cone)
        if options.is_bounded:
            found = with_bound(found, constraints, options.objective, options.progress)
        return found


def _of_least_energy(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, options: Options
) -> Array | None:
    """Find the postures of least energy, (n, 2) rad, to begin from; None where there are none, or rewinds.

    A price of time alone says nothing about axes that don't limit a block, so that a search by it ends rough.
    """
    cheap = replace(options, objective="energy", bound=False)
    try:
        found = optimise(toolpath, machine, constraints, cheap)
    except Infeasible:
        return None
    rotary = found.motion.positions[found.motion.given][:, machine.rotary_columns]
    return rotary if len(rotary) == len(toolpath) and found.unwrapped is None else None


def _held_ends(path: Toolpath, machine: Machine) -> TiltBounds:
    """Hold the tool where a path has it at its first and last location, if that is within the limits."""
    axis, ends = np.full((len(path), 3), np.nan), np.array([0, len(path) - 1])
    if path.rotary is not None and np.isfinite(path.rotary[ends]).all():
        there = follow(path.at(ends), machine, path.rotary[ends]).positions
        ends = ends[within_limits(machine, there).all(axis=-1)]
    axis[ends] = path.axis[ends]
    return TiltBounds(axis, 0.0, HELD, "angle to the axis as it was at the ends")


@dataclass(frozen=True, eq=False)
class Narrow:
    """Bounds within which a path is solved, so that those that are given hold between its locations, too.

    Parameters
    ----------
    machine : with limits of its linear axes narrower by `reserve`
    constraints : with the largest turn
    reserve : mm
    turning : whose axes may turn as far as the programmed tool axes need; None for the usual turns
    """

    machine: Machine
    constraints: Constraints
    reserve: float = 0.0
    turning: Machine | None = None

    def within(self, machine: Machine, breach: Breach) -> Narrow:
        """Return the bounds, narrower by what was broken, of a machine."""
        constraints, reserve = self.constraints, self.reserve
        if np.isfinite(breach.hop):
            constraints = replace(constraints, max_turn=SMALLER * breach.hop)
        if breach.overrun > 0.0:
            reserve = min(reserve + 2.0 * breach.overrun, MOST_RESERVE)
        axes = (a if a.is_rotary else replace(a, limits=a.limits.narrower(reserve)) for a in machine.axes)
        narrower = replace(machine, axes=tuple(axes)) if reserve else machine
        return Narrow(narrower, constraints, reserve, self.turning)


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


def with_bound(
    found: Found, constraints: Constraints, objective: Objective, progress: Progress = unheard
) -> Found:
    """Add a certified lower bound of a solution's energy, or of its travel metric if that is minimised.

    The bound holds for every posture that keeps the lean, the axis limits and the largest turns. Collisions,
    a mask and a singular cone, which only raise the cost, aren't looked at. A machine whose drives allow no
    bound gets a finding.

    Parameters
    ----------
    found : the solution
    constraints : that it was found within
    objective : what was minimised
    progress : called with what is being done
    """
    by_tip = found.filling.interpolation is Interpolation.TCP
    bound = bound_travel if objective == "travel" else partial(bound_energy, by_tip=by_tip)
    path = found.toolpath
    turns = _largest_turns(found, constraints)
    try:
        return replace(found, bound=bound(path, found.machine, found.tilt, turns, progress=progress))
    except MachineError as error:
        finding = Finding(Severity.NOTE, "no-bound", f"has no lower bound: {error}", path.place(0))
        return replace(found, toolpath=replace(path, findings=(*path.findings, finding)))


def _largest_turns(found: Solution, constraints: Constraints) -> Array | None:
    """Largest turn in each move of a solution, rad; on links, and where an axis rewinds, there is none."""
    if found.unwrapped is not None:
        return None
    path, location = found.toolpath, found.motion.location
    turns = turn_bounds(path, constraints, location)
    own = np.abs(found.motion.moves[1:, found.machine.rotary_columns]).max(axis=1, initial=0.0)
    if constraints.max_turn is None and (path.cutting[1:] & (own > turns + SAME_TURN)).any():
        turns = turn_bounds(path, constraints, location, found.machine)
    return np.where(found.toolpath.cutting[1:], turns, np.inf)
