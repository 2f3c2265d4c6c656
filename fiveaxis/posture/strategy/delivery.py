"""Optimisation of the program itself: locations that it needs in between are solved like the given ones.

With joint interpolation only short blocks keep the tool on its path, so locations have to be inserted where
rotary axes turn. Postures interpolated there would move axes that stand still at the given locations, and
lean the tool where nothing was checked. So inserted locations become part of the problem: tilt, limits, turns
and clearance hold there, and the objective is that of the program's blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from operator import attrgetter
from typing import TypeVar

import numpy as np

from fiveaxis.base import STAGES, Array, BoolArray, NoBaseline, Steps, at_once, unheard
from fiveaxis.model import (
    BlockCosts,
    Energy,
    Filling,
    Machine,
    Motion,
    TiltBounds,
    Toolpath,
    axis_bounds,
    block_costs,
    feed_times,
    follow,
    interpolate,
    lifting_costs,
    refined,
)
from fiveaxis.posture.baselines.branches import require_blocks
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import Resolution, sparse_rows, turning_rows, widened
from fiveaxis.posture.solution import Baseline, Optimum, SolverStep, program_energy, timed_energy
from fiveaxis.posture.strategy.effort import resolution
from fiveaxis.posture.strategy.fairing import faired, within_turns
from fiveaxis.posture.strategy.least_time import TIME_PRICE, by_time, from_rest_to_rest
from fiveaxis.posture.strategy.near import Near
from fiveaxis.posture.strategy.program_path import Breach, Delivered, Instance
from fiveaxis.posture.strategy.turn_bounds import shared
from fiveaxis.posture.terms import bends, waits

# Share of a step below which a turn counts as none when time is the objective, by round.
SHARPNESS = (0.1, 0.03, 0.01, 0.01, 0.01)
# A round that saves a smaller share, and inserts no larger share of locations, is the last.
WORTHWHILE, FEW = 2e-3, 1e-3
# Rounds of a refinement continue up to this many while they save something; searches of one corridor.
MOST_ROUNDS, MOST_CURES = 12, 8
# The corridor about a path that breaks a bound between its locations.
CURING = resolution(0.2, 0.7, 16, 6.0)
# The corridor around postures that a mask refuses, and the first number of locations to each side of them.
WIDE, DETOUR = resolution(0.5, 2.0, 400, 60.0), 12
# From one round to the next, axes may turn farther in a block by this factor, and by as many rad.
FARTHER, LITTLE = 1.5, np.radians(0.5)
# Terms of the objective that are priced at the given locations, beside the program's blocks.
BESIDE = bends, waits
FAIRING = "fairing"
# rad: how far postures are moved to run smoothly.
FARTHEST = tuple(np.radians([0.02, 0.05, 0.1, 0.2]))

# Keys by which the better and the steadier of two `Delivered` is smaller.
rank, starts_and_travel = attrgetter("rank"), attrgetter("starts_and_travel")

# Makes the problem of a path with inserted locations from their fractional indices, (n,), in the given path.
Build = Callable[[Toolpath, Array], tuple[Problem, TiltBounds]]
Found = TypeVar("Found")


@dataclass(eq=False)
class Delivery:
    """Solves a path on the locations of its program.

    Parameters
    ----------
    given : the path
    build : makes the problem of a path with inserted locations
    near : what is done near a path, within mask and cone
    filling : what inserted blocks keep
    options : what the program costs, and its control
    by_length : whether turns are bounded over the length of a move's parts
    at_knots : whether the path to begin with was searched and refined on some of its locations
    stages : what was done so far
    """

    given: Toolpath
    build: Build
    near: Near
    filling: Filling
    options: Options
    by_length: bool = False
    at_knots: bool = False
    stages: list[SolverStep] = field(default_factory=list)

    def delivered(
        self, solution: Optimum, candidates: Mapping[str, Array]
    ) -> tuple[Optimum, tuple[float, float], Breach | None]:
        """Solve a solution again on the locations of its program; its energies are then those of programs.

        Every baseline is priced as its own program, and given on the locations of the result; one that no
        program can follow is missing. A baseline that is cheaper than the result is refined and replaces it.
        So do `candidates`, further paths to begin from by name, (n, 2) rad: travel doesn't tell which costs
        least.

        Return the solution; its rank (`Delivered.rank`); and what the path that was solved still breaks
        between its locations, even if a baseline took its place.
        """
        machine, columns = solution.machine, solution.machine.rotary_columns
        best = self._quieter(self.run(solution.motion.positions[:, columns], everywhere=True))
        breach = best.breach
        energies, missing = self._baselines(solution)
        others = dict(candidates)
        for name in sorted(energies, key=lambda name: self.cost(energies[name])):
            if self.cost(energies[name]) < best.cost:
                others[f"baseline {name}"] = solution.compared[name].motion.positions[:, columns]
        for name, rotary in others.items():
            if self.admits(rotary):
                before = len(self.stages)
                best = min(best, self._quieter(self.run(rotary)), key=rank)
                named = [replace(one, name=f"{one.name}, from {name}") for one in self.stages[before:]]
                self.stages[before:] = named
        best = min([best, *self.faired(best)], key=rank)
        path = best.instance.path
        location = None if len(path) == len(self.given) else best.instance.location
        compared = {}
        for number, (name, energy) in enumerate(energies.items(), start=len(solution.compared)):
            self._pricing(number, 2 * len(solution.compared))
            baseline = solution.compared[name]
            motion = baseline.motion
            rotary = motion.positions[:, columns]
            # One that is cheaper than the result breaks bounds between its locations, if not at them.
            cheaper = self.cost(energy) < best.cost
            if not self.admits(rotary) or (cheaper and self.priced(rotary).broken):
                note = "; ".join(filter(None, (baseline.note, "it breaks bounds that are asked for")))
                baseline = replace(baseline, note=note, admitted=False)
            if location is not None:
                planes = self.filling.planes(self.given, machine, motion)
                motion = replace(follow(path, machine, planes.rotary_at(location)), location=location)
                # Priced as it is given, so that everyone who prices it finds the same.
                energy = program_energy(machine, path, motion, self.filling, self.options.clock)
            compared[name] = replace(baseline, motion=motion, energy=energy)
        motion = replace(follow(path, machine, best.rotary), location=location)
        findings = best.findings(self.near.mask or Mask())
        found = replace(
            solution,
            toolpath=replace(path, findings=(*path.findings, *findings)),
            tilt=best.instance.bounds,
            motion=motion,
            energy=program_energy(machine, path, motion, self.filling, self.options.clock),
            compared=compared,
            missing=missing,
            stages=(*solution.stages, *self.stages),
            problem=best.solved,
            filling=self.filling,
            clock=self.options.clock,
        )
        return found, best.rank, breach

    def _baselines(self, solution: Optimum) -> tuple[dict[str, Energy], Mapping[str, str]]:
        """Price baselines as programs: energies by name; of those without a program, the reason."""
        missing, energies = dict(solution.missing), dict[str, Energy]()

        def blocks(baseline: Baseline) -> Motion:
            fill = self.filling.fill(self.given, solution.machine, baseline.motion)
            return self.filling.thin(require_blocks(fill)).blocks

        for number, (name, baseline) in enumerate(solution.compared.items()):
            self._pricing(number, 2 * len(solution.compared))
            try:
                energies[name] = self._energy(blocks(baseline), solution.machine)
            except NoBaseline as reason:
                missing[name] = str(reason)
        return energies, missing

    def _energy(self, blocks: Motion, machine: Machine) -> Energy:
        return timed_energy(machine, blocks, self.options.clock(blocks, machine))

    @property
    def _pricing(self) -> Steps:
        """Takes the baselines that have been priced, and their number."""
        return partial(self.options.progress, STAGES["price"])

    def run(self, rotary: Array, *, everywhere: bool = False) -> Delivered:
        """Find the best program from a path, (n, 2) rad, chain order, at the given locations.

        With `everywhere` also away from the path, as far as the effort goes.
        """
        here = self.priced(rotary)
        if len(rotary) == 1:
            resolution = self.near.effort.nested[0].everywhere[0]
            found = self.near.found_anywhere(
                here.instance, self._costs(here.instance), resolution, self._steps
            )
            return self._final(here if found is None or not here.broken else self.priced(found))
        if self.at_knots:
            # It was solved at its knots until nothing more was saved; in between once is enough.
            here = min(self._rounds(here, self._sharpness[-1:], 1), here, key=rank)
            if not here.broken:
                return self._final(here)
        if everywhere:
            return self._by_search(here)
        return self._final(min(self._improved(here), here, key=rank))

    def _instance(self, location: Array, path: Toolpath | None = None) -> Instance:
        """Make the problem of a path with inserted locations, by their fractional indices; kept without."""
        if len(location) == len(self.given):
            return self._given
        return self._made(location, refined(self.given, location) if path is None else path)

    def _made(self, location: Array, path: Toolpath) -> Instance:
        problem, bounds = self.build(path, location)
        if self.options.objective == "time":
            problem = by_time(problem, self.options.up_penalty)
        return Instance(path, location, problem, bounds)

    @property
    def _steps(self) -> Steps:
        """Takes the locations that a search has done, and their number."""
        return partial(self.options.progress, STAGES["search"])

    @cached_property
    def _every(self) -> Array:
        """(n,), the indices of the given locations."""
        return np.arange(len(self.given), dtype=float)

    @cached_property
    def _given(self) -> Instance:
        """The given locations."""
        return self._made(self._every, self.given)

    def _by_search(self, start: Delivered) -> Delivered:
        """Search effort by effort; each begins with what the smaller one found.

        The steadiest program is returned that costs little more than the cheapest, and no more than a smaller
        effort's.
        """
        best, steadiest = start, None
        for effort in self.near.effort.nested:
            own = replace(self, near=replace(self.near, effort=effort))
            resolutions = effort.everywhere
            if self.options.objective == "time":
                # Many postures cost no time: what costs little energy is another good start.
                resolutions += tuple(
                    replace(one, by_other_price=True) for one in resolutions if not one.by_other_price
                )
            seeds = [partial(Delivery._candidate, resolution=one) for one in resolutions]
            if not start.refused.any():
                seeds.append(partial(Delivery._candidate, resolution=resolutions[0], known=start.rotary))
            candidates = sorted((one for one in own._at_once(seeds) if one), key=rank)
            tasks = [partial(Delivery._refined, candidate=one) for one in candidates[: effort.whole]]
            begun = own._at_once(tasks)
            if begun:
                # What is a little out of bounds between locations comes back when these are solved, too.
                first = min(begun, key=lambda one: (np.floor(one.broken), one.cost))
                # Of programs that cost the same one that was refined stays.
                best = min(
                    own._improved(first, own._sharpness[1:] or own._sharpness),
                    first,
                    best,
                    key=rank,
                )
            if best is start or best.broken:
                best = min(own._improved(start), best, key=rank)
            found = [best]
            for corridor in effort.corridors:
                near = own._corridor(best, corridor)
                found.append(min(near, own._rounds(near, own._sharpness[-1:]), key=rank))
                best = min(best, found[-1], key=rank)
            found = [self._final(min(self._bare(one), one, key=rank)) for one in found]
            steadiest = self._steadied(found, steadiest)
        return steadiest or best

    def faired(self, program: Delivered) -> Iterator[Delivered]:
        """Price a program with smoother postures, where the control's clock is known."""
        problem = program.instance.problem
        if self.options.clock.is_programmed(problem.machine):
            return
        for farthest in FARTHEST:
            rotary = faired(problem, program.rotary, farthest)
            if axis_bounds(problem.machine).limits_jerk:
                rotary = within_turns(problem, program.rotary, rotary)
            here = self._final(self.priced(rotary, program.instance))
            self._note(FAIRING, here, program.cost)
            yield here

    def _quieter(self, program: Delivered) -> Delivered:
        """Return a program, or its best fairing where jerk is limited: only faired paths compare there."""
        if not axis_bounds(program.instance.problem.machine).limits_jerk:
            return program
        return min([program, *self.faired(program)], key=rank)

    def _bare(self, program: Delivered) -> Delivered:
        """Leave out inserted locations: where the path is straight in between, no program needs them."""
        if len(program.instance.path) == len(self.given):
            return program
        return self.priced(program.rotary[np.isin(program.instance.location, self._every)])

    def _at_once(self, tasks: Sequence[Callable[[Delivery], Found]]) -> list[Found]:
        """Run independent tasks in threads; a mask need not be safe for them.

        Each has its own stages, recorded in the order of the tasks: the result doesn't depend on which one
        ends first, or how many run at once.
        """
        if self.near.mask:
            return [task(self) for task in tasks]
        # Only the first reports progress.
        silent = replace(self.options, progress=unheard)
        parts = [
            replace(
                self,
                stages=[],
                options=replace(silent if n else self.options, checkpoint=self.options.checkpoint.part()),
            )
            for n in range(len(tasks))
        ]
        answers = at_once([partial(task, part) for task, part in zip(tasks, parts, strict=True)])
        self.stages += [stage for part in parts for stage in part.stages]
        return answers

    def _candidate(
        self, resolution: Resolution, known: Array | None = None, queries_all: bool = False
    ) -> Candidate | None:
        """Search all postures on some of the locations, and refine what is found there; None for no path.

        A known path, (n, 2) rad at the given locations, is refined instead. With `queries_all` the mask is
        queried everywhere.
        """
        self._steps(0, 1)
        # A program that is revised in its own lines gets no further ones for the search.
        own = self.given.slack is not None
        instance = self._given if own else self._instance(turning_rows(self._given.problem, resolution.rows))
        rows = sparse_rows(instance.problem, resolution.rows)
        problem, bounds = instance.problem.thinned(rows), instance.bounds.at(rows)
        few = Instance(instance.path.at(rows), instance.location[rows], problem, bounds)
        costs = self._costs(instance).thinned(rows)

        def search() -> Array | None:
            if known is not None:
                return interpolate(known, few.location)
            prices = self._costs(instance, other=True).thinned(rows) if resolution.by_other_price else costs
            return self.near.found_anywhere(few, prices, resolution, self._steps, queries_all)

        name = "path to begin with" if known is not None else "search of all postures"
        found = self._candidate_of(search, name, instance, few, costs)
        if found is None or not found.rank[0] or known is not None or queries_all:
            return found
        # What was found past the mask in places leaves no way within it there.
        again = self._candidate(resolution, queries_all=True)
        return min((one for one in (found, again) if one), key=rank)

    def _candidate_of(
        self,
        search: Callable[[], Array | None],
        name: str,
        instance: Instance,
        few: Instance,
        costs: BlockCosts,
    ) -> Candidate | None:
        """Refine what a search finds on few locations of a path; None if it finds nothing."""

        def found() -> Array | None:
            path = search()
            if path is None:
                return None
            for share in self._sharpness:
                path = self.near.refined(few, self._local(few, path, share, costs), path)[:, :2]
            return path

        path = self.options.checkpoint.found(found)
        if path is None:
            return None
        cost = self._repriced(few, path, costs, 0.0).priced(path)
        self.stages.append(SolverStep(name, f"{len(path)} locations", 0, None, cost))
        refused = int(np.count_nonzero(self.near.refused(few, path)))
        return Candidate(instance, few, costs, path, (refused, cost))

    def _refined(self, candidate: Candidate) -> Delivered:
        """Search about what was found among all postures, and refine it once on its program's locations."""
        for around in self.near.effort.around:
            start, few, costs = candidate.path, candidate.few, candidate.costs
            search = partial(self.near.searched, few, costs, around, start, self._steps)
            near = self._candidate_of(search, "search about it", candidate.instance, few, costs)
            candidate = min((one for one in (near, candidate) if one), key=rank)
        here = self.priced(candidate.rotary, candidate.instance)
        return self._rounds(here, self._sharpness[:1], 1, again=True)

    def _improved(self, start: Delivered, sharpness: Sequence[float] = ()) -> Delivered:
        """Refine a program's path, and cure what it breaks between its locations."""
        best = self._rounds(start, sharpness or self._sharpness)
        if not best.broken:
            return best
        cured = self._cured(best, CURING)
        return min(cured, self._rounds(cured, self._sharpness[-1:]), key=rank)

    def _rounds(
        self, start: Delivered, sharpness: Sequence[float], most: int = MOST_ROUNDS, again: bool = False
    ) -> Delivered:
        """Refine by prices of blocks that are sharper from round to round, until nothing more is saved.

        What a round finds may need further locations: the next one solves them, too. Within a mask each takes
        many queries, so there the first one has to save something over the start. A result that will be
        refined `again` may be rough.
        """
        instance, rotary, planes = start.denser, start.filled, start.planes
        here: Delivered | None = None
        tried: list[Delivered] = []
        for number in range(most):
            self.options.progress(STAGES["blocks"], number, most)
            share = sharpness[min(number, len(sharpness) - 1)]
            problem = self._local(instance, rotary, share, self._costs(instance, here))
            if here is not None:
                # Else turns crowd in ever shorter blocks.
                most_turn = np.minimum(problem.max_turn, FARTHER * np.abs(np.diff(rotary, axis=0)) + LITTLE)
                problem = self._at_times(replace(problem, max_turn=most_turn), rotary, here)
            rough = again or number + 1 < len(sharpness)
            refine = partial(self.near.refined, instance, problem, rotary, rough, planes)
            path, planes = np.split(self.options.checkpoint.found(refine), [2], axis=1)
            was = None if here is None else here.cost
            solved = replace(problem, max_turn=instance.problem.max_turn)
            here = replace(self.priced(path, instance, solved), planes=planes)
            self._note(f"program, round {number + 1}", here, was)
            known = tried or [start] * bool(self.near.mask)
            saves = not known or (here.broken, (1.0 + WORTHWHILE) * here.cost) < min(map(rank, known))
            tried.append(here)
            if (number + 1 >= len(sharpness) or self._is_flat) and not saves:
                break
            instance, rotary = here.denser, here.filled
        return min(tried, key=rank)

    def _cured(self, here: Delivered, resolution: Resolution) -> Delivered:
        """Search a corridor about a program's postures, and again while that breaks a bound.

        Around postures that the mask refuses a wide corridor is searched, of more and more locations.
        """
        best, refused = here, np.inf
        for number in range(MOST_CURES):
            if 0 < here.refused.sum() < refused:
                refused = here.refused.sum()
                around = widened(here.refused, DETOUR * 2**number)
                here = self._corridor(here, WIDE, around)
            elif here.refused.any():
                break
            else:
                here = self._corridor(here, resolution)
            best = min(best, here, key=rank)
            if not here.broken:
                break
        return best

    def _corridor(
        self, program: Delivered, resolution: Resolution, free: BoolArray | None = None
    ) -> Delivered:
        """Search a corridor about a program's postures once, everywhere or where it is free."""
        self._steps(0, 1)
        instance = program.denser
        costs = self._costs(instance, program)
        search = partial(self.near.searched, instance, costs, resolution, program.filled, self._steps, free)
        path = self.options.checkpoint.found(search)
        here = self.priced(path, instance)
        self._note(f"corridor of {np.degrees(resolution.radius):.3g} deg", here, program.cost)
        return here

    def _steadied(self, found: Sequence[Delivered], before: Delivered | None) -> Delivered:
        """Return the steadiest program that costs little more than the cheapest.

        `before` is the result of a smaller effort; what costs more than that is none.
        """
        kept = [one for one in (*found, before) if one is not None]
        least = min(kept, key=rank)
        if self.options.steady == 0.0 or self.options.objective != "energy" or least.broken:
            return least
        most = (1.0 + self.options.steady) * least.cost
        if before is not None and not before.broken:
            most = min(most, before.cost)
        return min((one for one in kept if not one.broken and one.cost <= most), key=starts_and_travel)

    @property
    def _sharpness(self) -> Sequence[float]:
        """Sharpness of prices, round by round; within a mask each takes many queries, and one has to do."""
        shares = SHARPNESS if self.options.objective == "time" else self.near.effort.sharpness
        return shares[-1:] if self.near.mask else shares

    @cached_property
    def _is_flat(self) -> bool:
        """Whether prices don't depend on the path."""
        if self.options.objective == "time":
            return not self._prices_stops
        return not self._costs(self._given).has_constant_power

    @property
    def _prices_stops(self) -> bool:
        """Whether, in least time, a block that turns costs a stop, so that prices hang on the path.

        Least time doesn't price the stops of a control with TCP that stops between blocks: concentrating
        turns in few blocks would need more blocks there, and so more stops.
        """
        return self.options.clock.stops_at_turns and not self.options.clock.limits_words

    @property
    def given_problem(self) -> Problem:
        """The problem of the given locations."""
        return self._given.problem

    def admits(self, rotary: Array) -> bool:
        """Check whether a path, (n, 2) rad, keeps the bounds at all given locations."""
        return self._given.problem.violation(rotary) <= ALLOWED

    def priced(
        self, rotary: Array, instance: Instance | None = None, solved: Problem | None = None
    ) -> Delivered:
        """Price a path, (n, 2) rad, by its program's blocks, and check the postures between its locations.

        The locations are the given ones by default; `solved` is the problem of which it is an optimum.
        """
        instance = self._given if instance is None else instance
        machine = instance.problem.machine
        fill = self.filling.fill(instance.path, machine, follow(instance.path, machine, rotary))
        row = np.interp(fill.row, np.arange(len(instance.location)), instance.location)
        between = fill.motion.positions[:, machine.rotary_columns]
        # A long path is kept once where nothing is inserted.
        same = len(row) == len(instance.location)
        denser = self._parts(instance, rotary, self._instance(row, instance.path if same else None), between)
        positions, excess = denser.problem.placed(slice(None), between)
        past = max(float(excess.max()), float(denser.problem.limit_excess(positions).max()))
        jumps = np.floor(instance.location[fill.jumps]).astype(np.int64)
        past = np.inf if len(jumps) else past
        if self.options.objective == "time" or not self.options.clock.is_programmed(machine):
            # Redundant blocks would cost the control time, as stops.
            fill = self.filling.thin(fill)
        taken = self.options.clock(fill.blocks, machine)
        energy = timed_energy(machine, fill.blocks, taken)
        cost = self._priced_at(instance, rotary, energy)
        times = fill.times(taken.times)
        solved = solved or instance.problem
        refused, turned = self.near.refused(denser, between), self.near.turned(denser, between)
        return Delivered(
            instance, rotary, denser, between, past, jumps, refused, turned, energy, cost, times, solved
        )

    def _parts(self, instance: Instance, rotary: Array, denser: Instance, filled: Array) -> Instance:
        """Let inserted locations turn as the path, (n, 2) rad, does that they come from."""
        if self.by_length or len(denser.location) == len(instance.location):
            return denser
        known, turned = np.abs(np.diff(rotary, axis=0)), np.abs(np.diff(filled, axis=0))
        most = shared(instance.problem.max_turn, known, instance.location, denser.location, turned)
        return replace(denser, problem=replace(denser.problem, max_turn=most))

    def _final(self, program: Delivered) -> Delivered:
        """Price a program without redundant blocks, as it is delivered."""
        machine, path = program.instance.problem.machine, program.instance.path
        motion = follow(path, machine, program.rotary)
        energy = self._energy(self.filling.blocks(path, machine, motion), machine)
        solved = program.solved
        if self.options.objective != "time" and solved is program.instance.problem:
            # It was searched: of these prices it is an optimum, as far as it is one.
            solved = self._repriced(program.instance, program.rotary, self._costs(program.instance))
        cost = self._priced_at(program.instance, program.rotary, energy)
        return replace(program, energy=energy, cost=cost, solved=solved)

    def _priced_at(self, instance: Instance, rotary: Array, energy: Energy) -> float:
        """Compute what a program costs, J, with the prices of bends and delay at its given locations."""
        problem = self._given.problem
        terms = [term for term in (write(problem) for write in BESIDE) if term is not None]
        if self.options.objective == "time" or not terms:
            return self.cost(energy)
        at_given = rotary[np.isin(instance.location, self._every)]
        quantities = problem.quantities(problem.positions(slice(None), at_given))
        return self.cost(energy) + sum(term.cost(term.values(quantities)) for term in terms)

    def cost(self, energy: Energy) -> float:
        """Compute what a program costs by the objective, J, without the prices `BESIDE` it."""
        if self.options.objective == "time":
            # Rounded, so that of paths that no axis slows down the first one stays.
            return TIME_PRICE * round(energy.time, 6)
        return energy.total if self.options.objective == "energy" else energy.travel

    def _costs(
        self, instance: Instance, program: Delivered | None = None, *, other: bool = False
    ) -> BlockCosts:
        """Compute what blocks cost: energy where that is minimised, else in proportion to travel.

        With `other` it is the other of both. Blocks take the times of a program, where a clock is known, or
        else those at the feed.
        """
        problem, path = instance.problem, instance.path
        if (self.options.objective == "energy") == other:
            return BlockCosts.of_travel(problem.plus, problem.minus)
        slowed = program is not None and not self.options.clock.is_programmed(problem.machine)
        times = program.times if program is not None and slowed else feed_times(path)
        # The duration of rapid moves depends on the posture.
        lasting = np.where(path.rapid, 0.0, times)[1:]
        costs = block_costs(problem.machine, path.feed[1:], path.rapid[1:], time=lasting)
        up, down = lifting_costs(problem.machine, self.options.up_penalty)
        return replace(costs, slope=costs.slope + np.stack([up, down])[:, None])

    def _local(self, instance: Instance, rotary: Array, sharpness: float, costs: BlockCosts) -> Problem:
        """Make the problem of a refinement near a path, (n, 2) rad, by the costs of its blocks."""
        if self.options.objective == "time":
            return (
                from_rest_to_rest(instance.problem, rotary, sharpness)
                if self._prices_stops
                else instance.problem
            )
        return self._repriced(instance, rotary, costs, sharpness)

    def _repriced(
        self, instance: Instance, rotary: Array, costs: BlockCosts, sharpness: float = 0.01
    ) -> Problem:
        """Price travel by the cost of blocks near a path, (n, 2) rad."""
        travel = np.abs(np.diff(instance.problem.positions(slice(None), rotary), axis=0))
        plus, minus = costs.near(travel, sharpness)
        return replace(instance.problem, plus=plus, minus=minus)

    def _at_times(self, problem: Problem, rotary: Array, program: Delivered) -> Problem:
        """Add the price of a control's stops near a program's path, (n, 2) rad."""
        slowed = not self.options.clock.is_programmed(problem.machine)
        if self.options.objective != "energy" or not slowed or not self.options.clock.stops_at_turns:
            return problem
        power = max(program.cost, 0.0) / float(program.times.sum())
        problem = replace(problem, time_price=problem.time_price + power)
        return from_rest_to_rest(problem, rotary, SHARPNESS[-1], words=self.options.clock.limits_words)

    def _note(self, name: str, here: Delivered, before: float | None) -> None:
        """Record a step that has led from a cost, J, to a program."""
        broken = f", bounds broken by {here.broken:.2g}" if here.broken else ""
        status = f"{len(here.instance.path)} locations, {here.inserted} more in the program{broken}"
        self.stages.append(SolverStep(name, status, 0, before, here.cost))


@dataclass(frozen=True, eq=False)
class Candidate:
    """What a search of all postures found.

    Parameters
    ----------
    instance, few : the locations of a path, and those of them that were searched
    costs : of the blocks between the few
    path : (m, 2), rad, refined on the few
    rank : key by which the better of two is smaller: how many postures a mask refuses, then the cost of the
        blocks between the few, J, with the price of what they break
    """

    instance: Instance
    few: Instance
    costs: BlockCosts
    path: Array
    rank: tuple[int, float]

    @property
    def rotary(self) -> Array:
        """(n, 2), rad, straight between the locations that were searched: it may break bounds there."""
        return np.stack(
            [np.interp(self.instance.location, self.few.location, angle) for angle in self.path.T], axis=1
        )
