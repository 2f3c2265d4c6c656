"""The optimiser: from a path, a machine and constraints to a solution with its baselines."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.base import STAGES, Array, Infeasible, ToolpathError
from fiveaxis.model import (
    WRITTEN_TOLERANCE,
    BlockCosts,
    Constraints,
    Filling,
    Machine,
    TiltBounds,
    Toolpath,
    follow,
    knots,
    motion_energy,
    power_findings,
    with_powers,
    within_limits,
)
from fiveaxis.posture.baselines.catalogue import find_baselines
from fiveaxis.posture.baselines.clear import moved_clear
from fiveaxis.posture.bound.lower_bound import with_bound
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import DEFAULTS, Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import path_anywhere
from fiveaxis.posture.solution import Optimum, SolverStep
from fiveaxis.posture.strategy.delivery import Delivery
from fiveaxis.posture.strategy.effort import ROUGH, Effort
from fiveaxis.posture.strategy.infeasibility import refusal, unreachable, without_path
from fiveaxis.posture.strategy.least_time import time_findings
from fiveaxis.posture.strategy.near import Near, refined
from fiveaxis.posture.strategy.programs import Breach
from fiveaxis.posture.strategy.rotary_bounds import hold, turn_bounds
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.turns.rewinding import endless, winding_columns
from fiveaxis.posture.turns.unwrapped import path_check, rewind_solution

# Largest turns, as a share of the smallest that broke a bound between locations; most mm that are kept from
# the ends of travel; attempts.
SMALLER, MOST_RESERVE, MOST_ATTEMPTS = 0.7, 0.1, 3
# A path of more locations is solved at its knots first, if they are at most this share; how far locations in
# between may be from their chords, mm and ends of unit vectors, and moves from knot to knot.
LONG, SPARSE = 5000, 0.5
APART, TILTED, MOVES = WRITTEN_TOLERANCE, 2e-4, 64
# rad: how far a held end may lean from its axis, so that there is room for a solver.
HELD = np.radians(0.02)

logger = logging.getLogger(__name__)


def optimise_postures(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, options: Options = DEFAULTS
) -> Optimum:
    """Choose the rotary angles of every cutter location so that its program costs the least.

    Exact postures are searched, by the price of the program's blocks and by the travel metric
    ``Σ W⁺Δq⁺ + W⁻Δq⁻`` (`fiveaxis.posture.search`), and what is found is refined by the exact NLP on the
    locations that the program needs (`fiveaxis.posture.strategy.delivery`). The result is the best local
    optimum found, not proven global.

    Parameters
    ----------
    toolpath : cutter locations
    machine : two rotary and three linear axes, all with powers
    constraints : on the tool's lean and the rotary axes' turns (`turn_bounds` has the default)
    options : objective, prices, effort and the rest

    Returns
    -------
    The solution with its baselines and a record of what the solver did. Its path includes the locations that
    its program needs between those given (`Motion.location`), and links on which an axis with too few turns
    for the path rewinds, each with a finding.

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
    effort, machine = options.counts(), hold(with_powers(machine), constraints.hold)
    toolpath, timed = constraints.zoned(toolpath), time_findings(machine) if options.is_timed else ()
    toolpath = replace(toolpath, findings=(*toolpath.findings, *power_findings(machine), *timed))

    # The linear solvers work on small blocks, for which threads of the BLAS only wait for each other.
    with threadpool_limits(limits=1):
        attempts = Attempts(toolpath, machine, constraints, options, effort, Cone.of(constraints))
        try:
            best = attempts.best(Narrow(machine, constraints))
        except Infeasible:
            if constraints.max_turn is not None or not toolpath.has_axes:
                raise
            best = attempts.best(Narrow(machine, constraints, turning=machine))
        found = with_findings(attempts.rewound(best), attempts.cone)
        if options.is_bounded:
            found = with_bound(found, constraints, options.objective, options.progress)
        return found


def _of_least_energy(
    toolpath: Toolpath, machine: Machine, constraints: Constraints, options: Options
) -> Array | None:
    """Find the postures of least energy, (n, 2) rad, to begin from; None where there are none, or rewinds.

    A price of time alone says nothing of axes that don't limit a block: they would end rough. All efforts
    begin from the same, so that a larger one is never worse.
    """
    cheap = replace(options, objective="energy", bound=False, effort=options.counts().nested[0])
    try:
        found = optimise_postures(toolpath, machine, constraints, cheap)
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
    """Bounds at a path's locations, narrow enough for those that are given to hold in between, too.

    Limits of the machine's linear axes are narrower by a reserve, mm; the constraints have the largest turn.
    Axes of the machine `turning` may turn as far as the programmed tool axes need; None for the usual turns.
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
class Attempt:
    """A solution within some bounds; rank and breach are as of `Delivery.delivered`.

    A fault says why it can't be delivered.
    """

    found: Optimum
    rank: tuple[float, float]
    breach: Breach | None
    fault: Infeasible | None


@dataclass(frozen=True, eq=False)
class Attempts:
    """Attempts to solve a path, within bounds that may have to be narrower than those that are given.

    Parameters are as for `optimise_postures`; the toolpath has its zone, the machine powers and held axes.
    """

    toolpath: Toolpath
    machine: Machine
    constraints: Constraints
    options: Options
    effort: Effort
    cone: Cone | None

    def best(self, given: Narrow) -> Optimum:
        """Solve a path, again within narrower bounds where bounds are broken between its locations.

        Large turns may hop over directions too near to the normal, and inserted blocks go beyond a limit.
        """
        attempts = [self._on_turns(given)]
        narrow = given
        while attempts[-1].breach is not None and len(attempts) <= MOST_ATTEMPTS:
            narrow = narrow.within(given.machine, attempts[-1].breach)
            try:
                attempts.append(self._on_turns(narrow))
            except Infeasible:
                break
        best = min(attempts, key=lambda one: one.rank)
        if best.fault is not None:
            raise best.fault
        stages = [stage for attempt in attempts for stage in attempt.found.stages]
        return replace(best.found, stages=tuple(stages))

    def rewound(self, found: Optimum) -> Optimum:
        """Bring a solution into the limits of axes that it turns farther than they go."""
        if found.machine is self.machine:
            return found
        rotary, mask = found.motion.positions[:, self.machine.rotary_columns], self._unwrapped_mask
        mask = None if mask is None else mask.along(found.motion.location)
        keeps = path_check(found.toolpath, found.machine, rotary, self.cone, mask)
        return rewind_solution(found, self.machine, partial(refined, effort=self.effort), keeps)

    def _on_turns(self, narrow: Narrow) -> Attempt:
        """Solve within the turns that the axes have, if possible, or else without an end of them."""
        winding = winding_columns(narrow.machine)
        try:
            attempt = self._within(narrow, Mask.of(self.options.mask))
            if attempt.fault is None or not winding:
                return attempt
        except Infeasible:
            if not winding:
                raise
        # The axis turns as far as the path needs; afterwards it is rewound where that is cheap.
        attempt = self._within(replace(narrow, machine=endless(narrow.machine)), self._unwrapped_mask)
        return replace(attempt, found=replace(attempt.found, machine=endless(self.machine)))

    @property
    def _unwrapped_mask(self) -> Mask | None:
        mask = Mask.of(self.options.mask)
        return None if mask is None else mask.wrapped(self.machine)

    def _within(self, narrow: Narrow, mask: Mask | None) -> Attempt:
        """Solve on the machine of some bounds."""
        start, columns = self.options.start, self.machine.rotary_columns
        found, delivery = self._begun(narrow, mask, self.toolpath, start, self._at_knots(narrow, mask))
        others = {} if start is None else {"the start given": start}
        found, rank, breach = delivery.delivered(found, others)
        rotary, fault = found.motion.positions[found.motion.given][:, columns], None
        if not delivery.admits(rotary):
            fault = without_path(delivery.given_instance.problem, delivery.given, rotary)
        elif mask is not None:
            refused = ~mask.admits(np.arange(len(self.toolpath)), rotary)
            if refused.any():
                raise refusal(delivery.given_instance.problem, self.toolpath, rotary, refused, mask)
        # Without the narrower limits.
        return Attempt(replace(found, machine=self.machine), rank, breach, fault)

    def _at_knots(self, narrow: Narrow, mask: Mask | None) -> Array | None:
        """Solve at the knots of a long path; (n, 2) rad, None where that is no less work, or impossible."""
        path = self.toolpath
        # The turn that a move may take is no bound on many moves, and least time hangs on each.
        by_moves = narrow.constraints.max_turn is not None or self.options.is_timed
        if len(path) <= LONG or by_moves:
            return None
        rows = knots(path, APART, TILTED, MOVES)
        if len(rows) > SPARSE * len(path):
            return None
        few = replace(path.at(rows), numbers=path.numbered[rows])
        mask = None if mask is None else mask.along(rows.astype(float))
        start = None if self.options.start is None else self.options.start[rows]
        try:
            found, delivery = self._begun(narrow, mask, few, start)
        except Infeasible:  # the moves between the knots may be too far, or the mask too narrow there
            return None
        best = delivery.run(found.motion.positions[:, self.machine.rotary_columns], everywhere=True)
        run, location = np.cumsum(path.lengths), best.instance.location
        at = np.interp(location, np.arange(len(rows)), run[rows])
        rotary = np.stack([np.interp(run, at, angle) for angle in best.rotary.T], axis=1)
        # Where the pivot stands still, several locations are at the same length.
        rotary[rows] = best.rotary[best.instance.own]
        return rotary

    def _begun(
        self,
        narrow: Narrow,
        mask: Mask | None,
        path: Toolpath,
        start: Array | None,
        known: Array | None = None,
    ) -> tuple[Optimum, Delivery]:
        """Find the baselines and a path to begin with, and what will solve that for its program.

        A start, (n, 2) rad, is refined instead of a search; a known path, (n, 2) rad, is taken as it is. The
        path may be one that the mask refuses. `Infeasible` says which locations are out of reach, or where
        moves turn too far.
        """
        problem, bounds = self._problem(narrow, path)
        machine, options = problem.machine, self.options
        blocked = unreachable(path, machine, bounds)
        if blocked:
            share = f"{len(blocked)} of {len(path)} locations"
            raise Infeasible(f"{share} have no admissible posture on {machine.name}", blocked)
        options.progress(STAGES["baselines"], 0, 1)
        baselines, missing = find_baselines(path, machine, bounds, options.checkpoint)
        compared = baselines
        if mask is not None:
            compared, refused = moved_clear(baselines, problem, path, mask)
            missing = missing | refused
        rotary = known
        if rotary is None and start is not None:
            rotary = options.checkpoint.found(partial(refined, problem, start, self._starting))
        if rotary is None or (known is None and problem.violation(rotary) > ALLOWED):
            paths = [b.motion.positions[:, machine.rotary_columns] for b in baselines.values()]
            rotary = options.checkpoint.found(partial(self._sound, problem, path, paths, mask))
        motion = follow(path, machine, rotary)
        energy = motion_energy(machine, motion)
        logger.info("%d locations on %s: %.1f J to begin with", len(path), machine.name, energy.total)
        stages = (SolverStep("path to begin with", "found", None, problem.path_cost(rotary)),)
        found = Optimum(machine, path, bounds, motion, energy, compared, missing, stages, problem)

        def rebuild(again: Toolpath, location: Array | None = None) -> tuple[Problem, TiltBounds]:
            return (problem, bounds) if again is path else self._problem(narrow, again, location)

        near, by_length = Near(self.effort, self.cone, mask, rotary), self.constraints.turn_rate is not None
        filling = Filling.of(self.constraints, options.interpolation)
        return found, Delivery(path, rebuild, near, filling, options, by_length, known is not None)

    @property
    def _starting(self) -> Effort:
        """The effort of what will be solved again, with other prices."""
        return self.effort.nested[0].having(last_barrier=ROUGH)

    def _sound(self, problem: Problem, path: Toolpath, known: list[Array], mask: Mask | None) -> Array:
        """Return the known path of least cost that keeps all bounds, or else search one of little travel."""
        sound = [rotary for rotary in known if problem.violation(rotary) <= ALLOWED]
        if sound:
            return min(sound, key=problem.path_cost)
        self.options.progress(STAGES["search"], 0, 1)
        costs = BlockCosts.of_travel(problem.plus, problem.minus)
        admits = None if mask is None else mask.halfway(np.arange(float(len(problem)))).roughly_admits
        found = path_anywhere(problem, costs, self._starting.everywhere[0], admits)
        if len(found) == len(problem):
            found = refined(problem, found, self._starting)
            if problem.violation(found) <= ALLOWED:
                return found
        raise without_path(problem, path, found, mask)

    def _problem(
        self, narrow: Narrow, path: Toolpath, location: Array | None = None
    ) -> tuple[Problem, TiltBounds]:
        """Build the problem of a path, whose locations have fractional indices, (n,), in the given one."""
        bounds, options = self.constraints.lean_bounds(path), self.options
        if options.holds_ends:
            bounds = replace(bounds, beside=(*bounds.beside, _held_ends(path, narrow.machine)))
        price = options.time_price
        built = Problem.build(
            path,
            narrow.machine,
            bounds,
            up_penalty=options.up_penalty,
            max_turn=turn_bounds(path, narrow.constraints, location, narrow.turning),
            time_price=(self.machine.base_power or 0.0) if price is None else price,
            bend_price=options.smoothing,
        )
        return built, bounds
