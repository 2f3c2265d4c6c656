"""Optimisation of the program itself: locations that it needs in between are solved like the given ones.

With joint interpolation only short blocks keep the tool on its path, so locations have to be inserted where
rotary axes turn. Postures interpolated there would move axes that otherwise stand still, and lean the tool
where nothing was checked. So all bounds hold there, too, and the objective is that of the program's blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import attrgetter
from typing import TypeVar

import numpy as np

from fiveaxis.base import STAGES, Array, BoolArray, NoBaseline, Steps, at_once, unheard
from fiveaxis.model import Energy, axis_bounds, follow, interpolate, program_energy, timed_energy
from fiveaxis.posture.baselines.branches import require_blocks
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import Instance
from fiveaxis.posture.search.splicing import spliced
from fiveaxis.posture.search.successors import Resolution, sparse_rows, turning_rows, widened
from fiveaxis.posture.solution import Baseline, Optimum, SolverStep
from fiveaxis.posture.strategy.effort import resolution
from fiveaxis.posture.strategy.fairing import faired, within_turns
from fiveaxis.posture.strategy.programs import Breach, Candidate, Delivered, Programs

# A round that saves a smaller share is the last; rounds of a refinement at most, and searches of a corridor.
WORTHWHILE, MOST_ROUNDS, MOST_CURES = 2e-3, 12, 8
# The corridor about a path that breaks a bound between its locations.
CURING = resolution(0.2, 0.7, 16, 6.0)
# The corridor around postures that a mask refuses, and the first number of locations to each side of them.
WIDE, DETOUR = resolution(0.5, 2.0, 400, 60.0), 12
# From one round to the next, axes may turn farther in a block by this factor, and by as many rad.
FARTHER, LITTLE = 1.5, np.radians(0.5)
# rad: how far postures are moved to run smoothly.
FARTHEST = tuple(np.radians([0.02, 0.05, 0.1, 0.2]))

# Key by which the better of two programs or candidates is smaller.
rank = attrgetter("rank")

Found = TypeVar("Found")


@dataclass(eq=False)
class Delivery(Programs):
    """Solves a path on the locations of its program; stages record what was done.

    With `at_knots` the path to begin with was searched and refined on some of its locations.
    """

    at_knots: bool = False
    stages: list[SolverStep] = field(default_factory=list)

    def delivered(
        self, solution: Optimum, candidates: Mapping[str, Array]
    ) -> tuple[Optimum, tuple[float, float], Breach | None]:
        """Solve a solution again on the locations of its program; its energies are then those of programs.

        Every baseline is priced as its own program, and given on the locations of the result; one that no
        program can follow is missing. Travel doesn't tell which path costs least: a baseline that is cheaper
        than the result is refined and may replace it, and so are `candidates`, by name, (n, 2) rad.

        Return the solution; its rank (`Delivered.rank`); and what the path that was solved still breaks
        between its locations, even if a baseline took its place.
        """
        columns, given = solution.machine.rotary_columns, solution.compared
        best = self._quieter(self.run(solution.motion.positions[:, columns], everywhere=True))
        breach = best.breach
        energies, missing = self._baselines(solution)
        others = dict(candidates)
        for name in sorted(energies, key=lambda name: self.cost(energies[name])):
            if self.cost(energies[name]) < best.cost:
                others[f"baseline {name}"] = given[name].motion.positions[:, columns]
        for name, rotary in others.items():
            if self.admits(rotary):
                before = len(self.stages)
                best = min(best, self._quieter(self.run(rotary)), key=rank)
                named = [replace(one, name=f"{one.name}, from {name}") for one in self.stages[before:]]
                self.stages[before:] = named
        best = min([best, *self.faired(best)], key=rank)
        path = best.instance.path
        motion = follow(path, solution.machine, best.rotary)
        motion = motion if len(path) == len(self.given) else replace(motion, location=best.instance.location)
        compared = {}
        for number, (name, energy) in enumerate(energies.items(), start=len(given)):
            self._steps("price")(number, 2 * len(given))
            compared[name] = self._compared(given[name], energy, best, motion.location)
        findings = best.findings(self.near.mask or Mask())
        found = replace(
            solution,
            toolpath=replace(path, findings=(*path.findings, *findings)),
            tilt=best.instance.bounds,
            motion=motion,
            energy=best.energy,
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
        missing, energies, machine = dict(solution.missing), dict[str, Energy](), solution.machine
        for number, (name, baseline) in enumerate(solution.compared.items()):
            self._steps("price")(number, 2 * len(solution.compared))
            fill = self.filling.fill(self.given, machine, baseline.motion)
            try:
                blocks = self.filling.thin(require_blocks(fill)).blocks
                energies[name] = timed_energy(machine, blocks, self.options.clock(blocks, machine))
            except NoBaseline as reason:
                missing[name] = str(reason)
        return energies, missing

    def _compared(
        self, baseline: Baseline, energy: Energy, best: Delivered, location: Array | None
    ) -> Baseline:
        """Give a baseline on the locations of the best program, and say whether it breaks bounds."""
        path, machine, motion = best.instance.path, best.instance.problem.machine, baseline.motion
        rotary = motion.positions[:, machine.rotary_columns]
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
        return replace(baseline, motion=motion, energy=energy)

    def run(self, rotary: Array, *, everywhere: bool = False) -> Delivered:
        """Find the best program from a path, (n, 2) rad, chain order, at the given locations.

        With `everywhere` also away from the path, as far as the effort goes.
        """
        here = self.priced(rotary)
        if len(rotary) == 1:
            resolution = self.near.effort.nested[0].everywhere[0]
            costs = self.costs(here.instance)
            found = self.near.found_anywhere(here.instance, costs, resolution, self._steps())
            return self.final(here if found is None or not here.broken else self.priced(found))
        if self.at_knots:
            # It was solved at its knots until nothing more was saved; in between once is enough.
            here = min(self._rounds(here, 1), here, key=rank)
            if not here.broken:
                return self.final(here)
        if everywhere:
            return self._by_search(here)
        return self.final(min(self._improved(here), here, key=rank))

    def _steps(self, stage: str = "search") -> Steps:
        """Return what takes the steps of a stage that are done, and their number."""
        return partial(self.options.progress, STAGES[stage])

    def _by_search(self, start: Delivered) -> Delivered:
        """Search effort by effort; each begins with what the smaller one found.

        Returned is the steadiest program that costs little more than the cheapest, and no more than before.
        """
        best, steadiest, pool, tried = start, None, list[Candidate](), dict[Candidate, None]()
        for effort in self.near.effort.nested:
            own = replace(self, near=replace(self.near, effort=effort))
            seeds = [partial(Delivery._candidate, resolution=one) for one in effort.everywhere]
            if best is start and not start.refused.any():
                seeds.append(partial(seeds[0], known=start.rotary))
            searched = [one for one in own._at_once(seeds) if one]
            pool += searched
            pool += own._spliced(pool) if pool else ()
            # Few locations may mislead about a splice: a larger effort tries the best search, too.
            kinds = (pool, searched) if effort.contains else (pool,)
            chosen = dict.fromkeys(min(some, key=rank) for some in kinds if some)
            tasks = [partial(Delivery._refined, candidate=one) for one in chosen if one not in tried]
            tried |= chosen
            if begun := own._at_once(tasks):
                first = min(begun, key=rank)
                best = min(own._improved(first), first, best, key=rank)
            if best is start or best.broken:
                best = min(own._improved(start), best, key=rank)
            found = [best]
            for corridor in effort.corridors:
                near = own._corridor(best, corridor)
                found.append(min(near, own._rounds(near), key=rank))
                best = min(best, found[-1], key=rank)
            found = [self.final(min(self.bare(one), one, key=rank)) for one in found]
            steadiest = self._steadied(found, steadiest)
        return steadiest or best

    def faired(self, program: Delivered) -> Iterator[Delivered]:
        """Price a program with smoother postures, where the control's clock is known."""
        problem = program.instance.problem
        if not self.has_clock:
            return
        for farthest in FARTHEST:
            rotary = faired(problem, program.rotary, farthest)
            if axis_bounds(problem.machine).limits_jerk:
                rotary = within_turns(problem, program.rotary, rotary)
            here = self.final(self.priced(rotary, program.instance))
            self._note("fairing", here, program.cost)
            yield here

    def _quieter(self, program: Delivered) -> Delivered:
        """Return a program, or its best fairing where jerk is limited: only faired paths compare there."""
        if not axis_bounds(program.instance.problem.machine).limits_jerk:
            return program
        return min([program, *self.faired(program)], key=rank)

    def _at_once(self, tasks: Sequence[Callable[[Delivery], Found]]) -> list[Found]:
        """Run independent tasks in threads; a mask need not be safe for them.

        Each has its own stages, recorded in the tasks' order: the result doesn't depend on which ends first.
        """
        if self.near.mask:
            return [task(self) for task in tasks]
        parts: list[Delivery] = []
        for _ in tasks:
            # Only the first reports progress.
            progress = unheard if parts else self.options.progress
            own = replace(self.options, progress=progress, checkpoint=self.options.checkpoint.part())
            parts.append(replace(self, stages=[], options=own))
        answers = at_once([partial(task, part) for task, part in zip(tasks, parts, strict=True)])
        self.stages += [stage for part in parts for stage in part.stages]
        return answers

    def _candidate(
        self, resolution: Resolution, known: Array | None = None, queries_all: bool = False
    ) -> Candidate | None:
        """Search all postures on some of the locations, and refine what is found there; None for no path.

        A known path, (n, 2) rad, is refined instead; with `queries_all` the mask is queried everywhere.
        """
        self._steps()(0, 1)
        instance = self.given_instance
        if self.given.slack is None:
            # Else the program is revised in its own lines, and gets no further ones for the search.
            instance = self.instance(turning_rows(instance.problem, resolution.rows))
        rows = sparse_rows(instance.problem, resolution.rows)
        problem, bounds = instance.problem.thinned(rows), instance.bounds.at(rows)
        few = Instance(instance.path.at(rows), instance.location[rows], problem, bounds)
        costs = self.costs(instance).thinned(rows)
        unsearched = Candidate(instance, few, costs)

        def search() -> Array | None:
            if known is not None:
                return interpolate(known, few.location)
            return self.near.found_anywhere(few, costs, resolution, self._steps(), queries_all)

        name = "path to begin with" if known is not None else "search of all postures"
        found = self._found(search, name, unsearched)
        if found is None or not found.rank[0] or known is not None or queries_all:
            return found
        # What was found past the mask in places leaves no way within it there.
        again = self._candidate(resolution, queries_all=True)
        return min((one for one in (found, again) if one), key=rank)

    def _found(self, search: Callable[[], Array | None], name: str, before: Candidate) -> Candidate | None:
        """Refine what a search finds on the few locations of a candidate; None if it finds nothing."""
        few, costs = before.few, before.costs

        def found() -> Array | None:
            path = search()
            return None if path is None else self.near.refined(few, self.local(few, path, costs), path)[:, :2]

        path = self.options.checkpoint.found(found)
        if path is None:
            return None
        cost = self.repriced(few, path, costs, 0.0).priced(path)
        self.stages.append(SolverStep(name, f"{len(path)} locations", None, cost))
        refused = int(np.count_nonzero(self.near.refused(few, path)))
        return replace(before, path=path, rank=(refused, cost))

    def _spliced(self, pool: Sequence[Candidate]) -> list[Candidate]:
        """Refine the cheapest path of parts of candidates that are as good as the best, if it is new."""
        best = min(pool, key=rank)
        alike = [one for one in pool if one.rank[0] == best.rank[0]]
        paths = [one.path for one in alike if np.array_equal(one.few.location, best.few.location)]
        path = spliced(best.few.problem, best.costs, paths)
        if any(np.allclose(path, one) for one in paths):
            return []
        found = self._found(lambda: path, "parts of what was found", best)
        return [found] if found else []

    def _refined(self, candidate: Candidate) -> Delivered:
        """Search about what was found among all postures, and refine it once on its program's locations."""
        for around in self.near.effort.around:
            few, costs, path = candidate.few, candidate.costs, candidate.path
            search = partial(self.near.searched, few, costs, around, path, self._steps())
            near = self._found(search, "search about it", candidate)
            candidate = min((one for one in (near, candidate) if one), key=rank)
        here = self.priced(candidate.rotary, candidate.instance)
        return self._rounds(here, 1, again=True)

    def _improved(self, start: Delivered) -> Delivered:
        """Refine a program's path, and cure what it breaks between its locations."""
        best = self._rounds(start)
        if not best.broken:
            return best
        cured = self._cured(best)
        return min(cured, self._rounds(cured), key=rank)

    def _rounds(self, start: Delivered, most: int = MOST_ROUNDS, again: bool = False) -> Delivered:
        """Refine by prices of blocks near the path, round by round, until nothing worthwhile is saved.

        What a round finds may need further locations, which the next one solves, too. What will be refined
        `again` may be rough.
        """
        instance, rotary, planes = start.denser, start.filled, start.planes
        here: Delivered | None = None
        tried: list[Delivered] = []
        for number in range(most):
            self.options.progress(STAGES["blocks"], number, most)
            problem = self.local(instance, rotary, self.costs(instance, here))
            if here is not None:
                # Else turns crowd in ever shorter blocks.
                most_turn = np.minimum(problem.max_turn, FARTHER * np.abs(np.diff(rotary, axis=0)) + LITTLE)
                problem = self.at_times(replace(problem, max_turn=most_turn), rotary, here)
            refine = partial(self.near.refined, instance, problem, rotary, again, planes)
            path, planes = np.split(self.options.checkpoint.found(refine), [2], axis=1)
            was = None if here is None else here.cost
            solved = replace(problem, max_turn=instance.problem.max_turn)
            here = replace(self.priced(path, instance, solved), planes=planes)
            self._note(f"program, round {number + 1}", here, was)
            saves = (here.broken, (1.0 + WORTHWHILE) * here.cost) < min(map(rank, tried or [start]))
            tried.append(here)
            if not saves:
                break
            instance, rotary = here.denser, here.filled
        return min(tried, key=rank)

    def _cured(self, here: Delivered) -> Delivered:
        """Search corridors, wide ones around refused postures, while a program breaks a bound."""
        best, refused = here, np.inf
        for number in range(MOST_CURES):
            if 0 < here.refused.sum() < refused:
                refused = here.refused.sum()
                here = self._corridor(here, WIDE, widened(here.refused, DETOUR * 2**number))
            elif here.refused.any():
                break
            else:
                here = self._corridor(here, CURING)
            best = min(best, here, key=rank)
            if not here.broken:
                break
        return best

    def _corridor(
        self, program: Delivered, resolution: Resolution, free: BoolArray | None = None
    ) -> Delivered:
        """Search a corridor about a program's postures once, everywhere or where it is free."""
        self._steps()(0, 1)
        instance = program.denser
        costs = self.costs(instance, program)
        search = partial(self.near.searched, instance, costs, resolution, program.filled, self._steps(), free)
        path = self.options.checkpoint.found(search)
        here = self.priced(path, instance)
        self._note(f"corridor of {np.degrees(resolution.radius):.3g} deg", here, program.cost)
        return here

    def _steadied(self, found: Sequence[Delivered], before: Delivered | None) -> Delivered:
        """Return the steadiest program that costs little more than the cheapest and no more than `before`."""
        kept = [one for one in (*found, before) if one is not None]
        least = min(kept, key=rank)
        if self.options.steady == 0.0 or self.options.objective != "energy" or least.broken:
            return least
        most = (1.0 + self.options.steady) * least.cost
        if before is not None and not before.broken:
            most = min(most, before.cost)
        kept = [one for one in kept if not one.broken and one.cost <= most]
        return min(kept, key=lambda one: (one.energy.steadiness.events, one.energy.travel))

    def _note(self, name: str, here: Delivered, before: float | None) -> None:
        """Record a step that has led from a cost, J, to a program."""
        broken = f", bounds broken by {here.broken:.2g}" if here.broken else ""
        solved = len(here.instance.path)
        status = f"{solved} locations, {len(here.denser.path) - solved} more in the program{broken}"
        self.stages.append(SolverStep(name, status, before, here.cost))
