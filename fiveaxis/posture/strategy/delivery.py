"""Optimisation of the program itself: locations that it needs in between are solved like the given ones.

With joint interpolation only short blocks keep the tool on its path, so locations have to be inserted where
rotary axes turn. Postures interpolated there would move axes that stand still at the given locations, and
lean the tool where nothing was checked. So inserted locations become part of the problem: tilt, limits, turns
and clearance hold there, and the objective is that of the program's blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from fiveaxis.energy import Energy, block_costs, lifting_costs, travel_costs
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.motion import Filling, feed_times, follow
from fiveaxis.nc import USUAL_CLOCK, Clock
from fiveaxis.posture.baselines import NoBaseline, require_blocks
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution, Stage, blocks_energy, program_energy, timed_energy
from fiveaxis.posture.strategy.least_time import TIME_PRICE, from_rest_to_rest
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import TiltBounds, Toolpath, refined

# Share of a step below which travel counts as none, by round.
SHARPNESS = (0.1, 0.03, 0.01, 0.01, 0.01)
# The rounds at the times of the control begin where these ended.
TIMED_SHARPNESS = 8 * SHARPNESS[-1:]
# A round that saves a smaller share, and inserts no larger share of locations, is the last.
WORTHWHILE, FEW = 2e-3, 1e-3
# Rounds continue up to this many, as sharp as the last, while postures break a bound.
MOST_ROUNDS = 12
# Prices of changes of speed that are tried, s: a change costs as much as going on at that speed for so long.
# Each is solved twice, as the prices of travel change with what stands; the high one first, as what it
# steadies stays so at the low one.
STEADYING = (0.03, 0.03, 0.01, 0.01)
# Violation that is tolerated between two locations (cosine, mm, rad).
BETWEEN = 2e-4

Objective = Literal["energy", "travel", "time"]
# Makes the problem of a path with inserted locations from their fractional indices, (n,), in the given path.
Build = Callable[[Toolpath, Array], tuple[Problem, TiltBounds]]


@dataclass(frozen=True, eq=False)
class Posed:
    """A path with inserted locations, and its problem.

    Parameters
    ----------
    path : n locations
    location : (n,), fractional index of each in the given path
    problem, bounds : with the prices of travel, or of time
    """

    path: Toolpath
    location: Array
    problem: Problem
    bounds: TiltBounds


# Refines a path, (n, 2) rad, of posed locations, by the prices of a problem.
Refine = Callable[[Posed, Problem, Array], Array]


@dataclass(frozen=True)
class Breach:
    """What a path breaks between its locations.

    Parameters
    ----------
    hop : rad, smallest turn in a given move within which the tool leans out of its bounds; infinite for none
    overrun : mm or rad, farthest beyond an axis limit
    """

    hop: float
    overrun: float


@dataclass(frozen=True, eq=False)
class Delivered:
    """A path, the locations that its program needs in addition, and its cost.

    Parameters
    ----------
    posed : what was solved
    rotary : (n, 2), rad, chain order, its postures
    denser : with the additional locations of the program's blocks
    filled : (m, 2), rad, the postures there
    excess : largest violation between the locations; cosine, mm or rad; infinite where axes would jump
    jumps : moves of the given path in which they would, by the location at which they begin
    energy : of the program's blocks
    cost : J, the objective for them
    times : (m,), s, that the control takes for the moves to the denser path's locations
    solved : the problem of which the postures are an optimum, with the prices near them
    """

    posed: Posed
    rotary: Array
    denser: Posed
    filled: Array
    excess: float
    jumps: IntArray
    energy: Energy
    cost: float
    times: Array
    solved: Problem

    @property
    def inserted(self) -> int:
        """Number of locations that the program needs in addition to those that were solved."""
        return len(self.denser.path) - len(self.posed.path)

    @property
    def breach(self) -> Breach | None:
        """What is broken between the locations; None if nothing is."""
        if self.excess <= BETWEEN:
            return None
        problem, location = self.denser.problem, self.denser.location
        positions, excess = problem.placed(slice(None), self.filled)
        leaning = np.ceil(location[excess > BETWEEN]).astype(np.int64) - 1
        moves = np.union1d(leaning, self.jumps)
        given = self.filled[location == np.floor(location)]
        turns = np.abs(np.diff(given, axis=0)).max(axis=1)
        hop = turns[moves[moves >= 0]].min(initial=np.inf)
        return Breach(float(hop), float(problem.limit_excess(positions).max(initial=0.0)))

    @property
    def rank(self) -> tuple[float, float]:
        """Key by which the better of two is smaller: first violation, then cost."""
        return self.broken, self.cost

    @cached_property
    def broken(self) -> float:
        """By how much it breaks bounds, at its locations or between them; 0 if it keeps them."""
        broken = self.posed.problem.violation(self.rotary)
        return (broken if broken > ALLOWED else 0.0) + max(self.excess - BETWEEN, 0.0)

    @property
    def unrest(self) -> tuple[int, float]:
        """Key by which the steadier of two is smaller: starts and reversals, then the travel metric."""
        return self.energy.steadiness.events, self.energy.travel


@dataclass(frozen=True, eq=False)
class Delivery:
    """Solves a path on the locations of its program.

    Parameters
    ----------
    given : the path
    build : makes the problem of a path with inserted locations
    refine : solves one near a start
    filling : what inserted blocks keep
    up_penalty : J/mm, extra price of lifting what a linear axis carries (`lifting_costs`)
    objective : ``energy`` of the blocks reweights the problem's prices; the others keep them
    steady : share of the least energy that may be spent on fewer starts and reversals
    clock : how long the control takes for blocks
    progress : called with what is being done, steps done and steps in all
    """

    given: Toolpath
    build: Build
    refine: Refine
    filling: Filling
    up_penalty: float = 0.0
    objective: Objective = "energy"
    steady: float = 0.0
    clock: Clock = USUAL_CLOCK
    progress: Progress = unheard

    def run(self, rotary: Array) -> tuple[Delivered, list[Stage]]:
        """Insert locations and solve again, until the program needs no more of them.

        Where the control takes longer than the feed says, its times then replace those at the feed in more
        rounds: drives that draw power while a move lasts cost more in moves that take longer, and stops cost
        that power too.

        Parameters
        ----------
        rotary : (n, 2), rad, chain order, at the given locations

        Returns
        -------
        The best of the paths, and what was done
        """
        every = np.arange(len(self.given), dtype=float)
        here = self._priced(Posed(self.given, every, *self.build(self.given, every)), rotary)
        best, stages = self._rounds(here)
        slowed = not self.clock.is_programmed(here.posed.problem.machine)
        if self.objective == "energy" and slowed and len(rotary) > 1:
            other, more = self._rounds(best, timed=True)
            best, stages = min(best, other, key=lambda one: one.rank), [*stages, *more]
        return best, stages

    def steadied(self, best: Delivered) -> tuple[Delivered, list[Stage]]:
        """Solve again with a price of every change of speed; return the steadiest that costs little more.

        A drive that draws its whole power while it moves has no price of travel, and so none of reversals.
        """
        stages: list[Stage] = []
        if self.objective != "energy" or self.steady == 0.0 or len(best.rotary) <= 2 or best.broken:
            return best, stages
        timed = not self.clock.is_programmed(best.posed.problem.machine)
        found, here = [best], best
        for number, price in enumerate(STEADYING):
            self.progress(f"steadying the axes, round {number + 1}", number, len(STEADYING))
            posed, start, path = here.denser, here.filled, here.denser.path
            travel = np.mean(travel_costs(posed.problem.machine, path.feed, path.rapid), axis=(0, 1))
            problem = self._reweighted(posed, start, SHARPNESS[-1], here if timed else None)
            problem = replace(problem, change_price=price * travel)
            before, here = here.cost, self._priced(posed, self.refine(posed, problem, start), problem)
            status = f"{here.energy.steadiness.events} starts and reversals"
            stages.append(Stage(f"program, steadied by {price:g} s", status, 0, before, here.cost))
            if here.broken:
                break
            found.append(here)
        most = (1.0 + self.steady) * min(one.cost for one in found)
        return min((one for one in found if one.cost <= most), key=lambda one: one.unrest), stages

    def _rounds(self, best: Delivered, *, timed: bool = False) -> tuple[Delivered, list[Stage]]:
        """Solve again round by round, with the moves' times at the feed or as the control takes them."""
        stages: list[Stage] = []
        here, sharpnesses = best, TIMED_SHARPNESS if timed else SHARPNESS
        for number in range(MOST_ROUNDS):
            self.progress(f"solving for the program's blocks, round {number + 1}", 0, 1)
            done = number >= len(sharpnesses) or self.objective == "travel"
            if len(here.rotary) == 1 or (done and not here.broken):
                break
            sharpness, coming = (sharpnesses[min(n, len(sharpnesses) - 1)] for n in (number, number + 1))
            posed, start, before = here.denser, here.filled, here.cost
            problem = self._reweighted(posed, start, sharpness, here if timed else None)
            here = self._priced(posed, self.refine(posed, problem, start), problem)
            status = f"{len(posed.path)} locations, {here.inserted} more in the program"
            name = f"program, round {number + 1}{' at the times of the control' if timed else ''}"
            stages.append(Stage(name, status, 0, before, here.cost))
            gain, better = best.cost - here.cost, here.rank < best.rank
            best = here if better else best
            more = here.inserted > FEW * len(posed.path) or (better and gain > WORTHWHILE * here.cost)
            if not more and not here.broken and (number >= 2 or not self.reweights):
                break
            stays = here.inserted == 0 and np.array_equal(here.rotary, start)
            if stays and (here.broken or not self.reweights or coming == sharpness):
                break
        return best, stages

    @property
    def reweights(self) -> bool:
        """Whether the price of blocks depends on the path, so that it is adapted round by round.

        Least time doesn't price the stops of a control with TCP that stops between blocks: concentrating
        turns in few blocks would need more blocks there, and so more stops.
        """
        if self.objective != "time":
            return self.objective == "energy"
        return self.clock.stops_at_turns and not self.clock.limits_words

    def admits(self, rotary: Array) -> bool:
        """Check whether a path, (n, 2) rad, keeps the bounds at all given locations."""
        every = np.arange(len(self.given), dtype=float)
        return self.build(self.given, every)[0].violation(rotary) <= ALLOWED

    def _priced(self, posed: Posed, rotary: Array, solved: Problem | None = None) -> Delivered:
        """Price a path by the blocks of its program, and check the postures between its locations."""
        machine = posed.problem.machine
        fill = self.filling.fill(posed.path, machine, follow(posed.path, machine, rotary))
        row = np.interp(fill.row, np.arange(len(posed.location)), posed.location)
        path = refined(self.given, row)
        denser, filled = Posed(path, row, *self.build(path, row)), fill.motion.positions
        between = filled[:, machine.rotary_columns]
        positions, excess = denser.problem.placed(slice(None), between)
        past = max(float(excess.max()), float(denser.problem.limit_excess(positions).max()))
        jumps = np.floor(posed.location[fill.jumps]).astype(np.int64)
        past = np.inf if len(jumps) else past
        if self.objective == "time" or not self.clock.is_programmed(machine):
            # Redundant blocks would cost the control time, as stops.
            fill = self.filling.thin(fill)
        taken = self.clock(fill.blocks, machine)
        energy = timed_energy(machine, fill.blocks, taken)
        cost, times = self.cost(energy), fill.times(taken.times)
        solved = solved or posed.problem
        return Delivered(posed, rotary, denser, between, past, jumps, energy, cost, times, solved)

    def cost(self, energy: Energy) -> float:
        """Compute the objective of a program, J."""
        if self.objective == "time":
            # Rounded, so that of paths that no axis slows down the first one stays.
            return TIME_PRICE * round(energy.time, 6)
        return energy.total if self.objective == "energy" else energy.travel

    def _reweighted(self, posed: Posed, rotary: Array, sharpness: float, timed: Delivered | None) -> Problem:
        """Price travel by the cost of the program's blocks near a path, (n, 2) rad.

        Their times are those at the feed or, of a program that was timed, those of the control, which also
        gives a price of time: the mean power that the drives draw.
        """
        problem, path = posed.problem, posed.path
        if not self.reweights:
            return problem
        if self.objective == "time":
            return from_rest_to_rest(problem, rotary, sharpness)
        # The duration of rapid moves depends on the posture.
        time = np.where(path.rapid, 0.0, feed_times(path) if timed is None else timed.times)[1:]
        costs = block_costs(problem.machine, path.feed[1:], path.rapid[1:], time=time)
        travel = np.abs(np.diff(problem.positions(slice(None), rotary), axis=0))
        plus, minus = costs.prices(travel, sharpness)
        up, down = lifting_costs(problem.machine, self.up_penalty)
        weighted = replace(problem, plus=plus + up, minus=minus + down)
        if timed is None or not self.clock.stops_at_turns:
            return weighted
        power = max(timed.cost, 0.0) / float(timed.times.sum())
        weighted = replace(weighted, time_price=problem.time_price + power)
        return from_rest_to_rest(weighted, rotary, sharpness, words=self.clock.limits_words)


def delivered(
    solution: Solution, delivery: Delivery, others: Mapping[str, Array]
) -> tuple[Solution, tuple[float, float], Breach | None]:
    """Solve a solution again on the locations of its program; its energies are then those of programs.

    Every baseline is priced as its own program, and given on the locations of the result; one that no program
    can follow is missing. A baseline that is cheaper than the result is refined and replaces it. The best of
    all is steadied.

    Parameters
    ----------
    solution : on the given locations, with its problem
    delivery : what solves it
    others : further paths to begin from by name, (n, 2) rad: travel doesn't tell which leads to least energy

    Returns
    -------
    The solution; its rank (`Delivered.rank`); and what the path that was solved still breaks between its
    locations, even if a baseline took its place
    """
    machine, filling, given = solution.machine, delivery.filling, solution.toolpath
    columns = machine.rotary_columns
    best, stages = delivery.run(solution.motion.positions[:, columns])

    def try_from(name: str, rotary: Array) -> None:
        nonlocal best, stages
        other, more = delivery.run(rotary)
        stages += [replace(stage, name=f"{stage.name}, from {name}") for stage in more]
        best = min(best, other, key=lambda one: one.rank)

    for name, rotary in others.items():
        try_from(name, rotary)
    breach = best.breach
    delivery.progress("pricing baselines as programs", 0, 1)
    filled, missing = {}, dict(solution.missing)
    for name, b in solution.compared.items():
        try:
            filled[name] = require_blocks(filling.fill(b.toolpath or given, machine, b.motion))
        except NoBaseline as reason:
            missing[name] = str(reason)
    energies = {
        name: blocks_energy(machine, filling.thin(fill).blocks, delivery.clock)
        for name, fill in filled.items()
    }
    for name in sorted(energies, key=lambda name: delivery.cost(energies[name])):
        baseline = solution.compared[name]
        rotary = baseline.motion.positions[:, columns]
        cheaper = baseline.toolpath is None and delivery.cost(energies[name]) < best.cost
        if cheaper and delivery.admits(rotary):
            try_from(f"baseline {name}", rotary)
    best, more = delivery.steadied(best)
    stages += more
    path = best.posed.path
    location = None if len(path) == len(given) else best.posed.location
    compared = {}
    for name in filled:
        baseline = solution.compared[name]
        motion = baseline.motion
        if baseline.toolpath is None and location is not None:
            motion = follow(path, machine, filled[name].planes.rotary_at(location))
        compared[name] = replace(baseline, motion=motion, energy=energies[name])
    motion = replace(follow(path, machine, best.rotary), location=location)
    found = replace(
        solution,
        toolpath=replace(path, findings=(*path.findings, *_findings(best))),
        tilt=best.posed.bounds,
        motion=motion,
        energy=program_energy(machine, path, motion, filling, delivery.clock),
        compared=compared,
        missing=missing,
        stages=(*solution.stages, *stages),
        problem=best.solved,
        filling=filling,
        clock=delivery.clock,
    )
    return found, best.rank, breach


def _findings(best: Delivered) -> list[Finding]:
    """Report where postures between locations still break a bound."""
    if best.excess <= BETWEEN:
        return []
    problem = best.denser.problem
    positions, excess = problem.placed(slice(None), best.filled)
    past = np.nan_to_num(problem.limit_excess(positions))
    jumping = np.isin(np.ceil(best.denser.location) - 1.0, best.jumps).astype(float)
    found = []
    for off, fact, remedy in (
        (excess, "the tool leans out of its bounds", "widen the range of its lean"),
        (past, "an axis exceeds its limits", "move the part on the table (work_offset)"),
        (jumping, "axes would have to jump", "allow smaller turns only (--max-turn)"),
    ):
        rows = np.flatnonzero(off > BETWEEN)
        if len(rows):
            message = (
                f"between this location and the one before it {fact} ({len(rows)} blocks in all), and no "
                f"path was found that avoids this; put locations closer together here or {remedy}"
            )
            place = best.denser.path.place(int(np.argmax(off)))
            found.append(Finding(Severity.WARNING, "between-locations", message, place))
    return found
