"""Optimisation of the program itself: locations that it needs in between are solved like the given ones.

With joint interpolation only short blocks keep the tool on its path, so locations have to be inserted where
rotary axes turn. Postures interpolated there would move axes that stand still at the given locations, and
lean the tool where nothing was checked. So inserted locations become part of the problem: tilt, limits, turns
and clearance hold there, and the objective is that of the program's blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial, reduce
from operator import attrgetter

import numpy as np
from scipy.ndimage import binary_dilation

from fiveaxis.energy import BlockCosts, Energy, block_costs, lifting_costs
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.motion import Filling, feed_times, follow
from fiveaxis.posture.baselines import NoBaseline, require_blocks
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import Grain, turning_rows
from fiveaxis.posture.solution import Solution, Stage, program_energy, timed_energy
from fiveaxis.posture.strategy.effort import Effort, grain
from fiveaxis.posture.strategy.least_time import TIME_PRICE, by_time, from_rest_to_rest
from fiveaxis.posture.strategy.near import Near
from fiveaxis.posture.strategy.program_path import Breach, Delivered, Posed
from fiveaxis.posture.strategy.turn_bounds import shared
from fiveaxis.progress import Steps, unheard
from fiveaxis.threads import at_once
from fiveaxis.toolpath import TiltBounds, Toolpath, refined

# Share of a step below which a turn counts as none when time is the objective, by round.
SHARPNESS = (0.1, 0.03, 0.01, 0.01, 0.01)
# A round that saves a smaller share, and inserts no larger share of locations, is the last.
WORTHWHILE, FEW = 2e-3, 1e-3
# Sharpness of the prices of blocks (`BlockCosts.near`), refinement by refinement: from a path of least
# travel, and from one on which axes stand, which may be led away from it and back, or only a little.
BLUNT = (0.3, 0.1, 0.03, 0.01)
POLISHES = (BLUNT[1:], BLUNT[-1:])
# Rounds continue up to this many while postures break a bound; searches of one corridor, and refinements.
MOST_ROUNDS, SETTLING, POLISHING = 12, 8, 1
# The corridor in which inserted locations settle.
SETTLED = grain(0.2, 0.7, 8, 1.5)
# The corridor around postures that a mask refuses, and the first number of locations to each side of them.
WIDE, DETOUR = grain(0.5, 2.0, 400, 60.0), 12
# Locations to each side of an inserted one that settle with it.
AROUND = 3
# A refinement may turn farther in a block by this factor, and by as many rad.
FARTHER, LITTLE = 1.2, np.radians(0.2)
# Fractional indices of locations that lie no farther apart are one.
SAME = 1e-6
# Terms of the objective that are priced at the given locations, beside the program's blocks.
BESIDE = ("bends", "waits", "jerks", "wear")
SEARCHING = "searching which axes can stand"

# Keys by which the better and the steadier of two `Delivered` is smaller.
rank, unrest = attrgetter("rank"), attrgetter("unrest")

# Makes the problem of a path with inserted locations from their fractional indices, (n,), in the given path.
Build = Callable[[Toolpath, Array], tuple[Problem, TiltBounds]]


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
    stages: list[Stage] = field(default_factory=list)

    def run(self, rotary: Array, *, everywhere: bool = False) -> Delivered:
        """Find the best program from a path, (n, 2) rad, chain order, at the given locations.

        Energy and travel are searched, as far as the effort goes, for blocks that cost least. Least time is
        refined from that path and from what has the least energy, until the program needs no more locations.

        Parameters
        ----------
        everywhere : whether to search away from the path, too
        """
        here = self._spread(rotary) if self.at_knots else self.priced(rotary)
        if len(rotary) == 1:
            costs, grain = self._costs(here.posed), self.near.effort.everywhere
            found = self.near.found_anywhere(here.posed, costs, grain, self._steps)
            return self._final(self.priced(found[0]) if found and here.broken else here)
        if self.at_knots and not here.broken:
            return self._final(here)
        if self.options.objective != "time":
            best = self._by_search(self._divided(here), everywhere)
            return min((self._final(one) for one in (here, self._bare(best), best)), key=rank)
        starts = [here]
        if everywhere:
            cheapest = replace(self, options=replace(self.options, objective="energy")).run(
                rotary, everywhere=True
            )
            starts.append(self.priced(cheapest.rotary, self._posed(cheapest.posed.location)))
        return self._final(min(map(self._rounds, starts), key=rank))

    def _spread(self, rotary: Array) -> Delivered:
        """Let axes that stand from knot to knot stand at the locations in between, too."""
        return reduce(self._settled, self.near.effort.after, self._near(self.priced(rotary), SETTLED))

    def _bare(self, program: Delivered) -> Delivered:
        """Leave out inserted locations: where the path is straight in between, no program needs them."""
        return self.priced(program.rotary[np.isin(program.posed.location, self._every)])

    def _divided(self, program: Delivered) -> Delivered:
        """Insert locations also where the direction of the lean turns far in a move."""
        location, further = program.denser.location, turning_rows(self._given.problem)
        known = np.isclose(further, location[np.searchsorted(location, further - SAME)], rtol=0.0, atol=SAME)
        if known.all():
            return program
        rows = np.union1d(location, further[~known])
        rotary = np.stack([np.interp(rows, location, angle) for angle in program.filled.T], axis=1)
        return self.priced(rotary, self._posed(rows))

    def _posed(self, location: Array, path: Toolpath | None = None) -> Posed:
        """Make the problem of a path with inserted locations, by their fractional indices."""
        path = refined(self.given, location) if path is None else path
        problem, bounds = self.build(path, location)
        if self.options.objective == "time":
            problem = by_time(problem, self.options.up_penalty)
        return Posed(path, location, problem, bounds)

    @property
    def _steps(self) -> Steps:
        """Takes the locations that a search has done, and their number."""
        return partial(self.options.progress, SEARCHING)

    @cached_property
    def _pays_standing(self) -> bool:
        """Whether a drive draws power for moving at all, so that the objective hangs on what stands."""
        return self._costs(self._given).has_constant_power

    @cached_property
    def _every(self) -> Array:
        """(n,), the indices of the given locations."""
        return np.arange(len(self.given), dtype=float)

    @cached_property
    def _given(self) -> Posed:
        """The given locations."""
        return self._posed(self._every, self.given)

    def _by_search(self, start: Delivered, everywhere: bool) -> Delivered:
        """Search effort by effort; each begins with what the smaller one found.

        Returns
        -------
        The steadiest program that costs little more than the cheapest, and no more than a smaller effort's.
        """
        efforts = self.near.effort.nested
        tasks: list[Callable[[Delivery], Delivered | None]] = [
            partial(Delivery._searched_near, start=start, after=efforts[0].after)
        ]
        owners = [efforts[0]]
        for effort in efforts if everywhere else ():
            # The smallest effort's start was found by travel.
            known = effort is efforts[0] and self.options.objective == "energy"
            ways = [] if known else [Delivery._searched_by_travel]
            ways += [Delivery._searched_everywhere] if self.options.objective == "energy" else []
            tasks += [partial(way, effort=effort) for way in ways]
            owners += [effort] * len(ways)
        found = self._at_once(tasks)
        best, steadiest = start, None
        for effort in efforts:
            own = [one for one, owner in zip(found, owners, strict=True) if owner is effort and one]
            best = min((best, *own), key=rank)
            best = self._polished(reduce(self._settled, effort.corridors, best))
            steadiest = self._steadied(self._final(best), steadiest, effort.steadying)
        return steadiest or best

    def _at_once(self, tasks: Sequence[Callable[[Delivery], Delivered | None]]) -> list[Delivered | None]:
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
                options=replace(silent if n else self.options, checkpoint=self.options.checkpoint.part(n)),
            )
            for n in range(len(tasks))
        ]
        answers = at_once([partial(task, part) for task, part in zip(tasks, parts, strict=True)])
        self.stages += [stage for part in parts for stage in part.stages]
        return answers

    def _searched_near(self, start: Delivered, after: tuple[Grain, ...]) -> Delivered:
        """Refine a path for the program's blocks, and search corridors about it."""
        return reduce(self._settled, after, self._refined(start, BLUNT))

    def _searched_by_travel(self, effort: Effort) -> Delivered | None:
        """Search the whole range of postures by travel, and near what was found; None for no path."""
        self._steps(0, 1)
        posed = self._posed(turning_rows(self._given.problem, effort.everywhere.rows))
        near = replace(self.near, effort=effort)
        found = self.options.checkpoint.found(partial(near.by_travel, posed, self._steps))
        return None if found is None else self._searched_near(self.priced(found, posed), effort.after)

    def _searched_everywhere(self, effort: Effort) -> Delivered | None:
        """Search the whole range of postures, then corridors about what was found; None for no path."""
        self._steps(0, 1)
        posed = self._posed(turning_rows(self._given.problem, effort.everywhere.rows))

        def search() -> Array | None:
            costs = self._costs(posed)
            paths = self.near.found_anywhere(posed, costs, effort.everywhere, self._steps)
            return np.stack(paths) if paths else None

        paths = self.options.checkpoint.found(search)
        if paths is None:
            return None
        return min((self._searched_about(posed, path, effort) for path in paths), key=rank)

    def _searched_about(self, posed: Posed, path: Array, effort: Effort) -> Delivered:
        """Search corridors about a path, (n, 2) rad, that was found among all postures."""
        here = self.priced(path, posed)
        self.stages.append(Stage("search of all postures", self._status(here), 0, None, here.cost))
        # The program of a path with straight lines in between has locations that no other needs.
        refused = self.near.refused(posed, path)
        here = replace(here, denser=posed, filled=path, refused=refused, times=feed_times(posed.path))
        return reduce(self._settled, effort.after, here)

    def _settled(self, best: Delivered, grain: Grain) -> Delivered:
        """Search a corridor about a program's postures; the program itself if it is better."""
        return min(best, self._near(best, grain), key=rank)

    def _near(self, here: Delivered, grain: Grain) -> Delivered:
        """Search a corridor about a program's postures, and again while that breaks a bound.

        Around postures that the mask refuses a wide corridor is searched, of more and more locations.
        """
        best, refused = here, np.inf
        for number in range(SETTLING):
            if 0 < here.refused.sum() < refused:
                refused = here.refused.sum()
                around = binary_dilation(here.refused, iterations=DETOUR * 2**number)
                here = self._corridor(here, WIDE, around)
            elif here.refused.any():
                break
            else:
                here = self._corridor(here, grain)
            here = self._with_inserted(here)
            best = min(best, here, key=rank)
            if not here.broken:
                break
        return best

    def _with_inserted(self, best: Delivered) -> Delivered:
        """Search narrow corridors until inserted locations cost no more than they have to.

        An axis that stands from one location to the next needn't stand at one that is inserted in between.
        """
        here = best
        for _ in range(SETTLING):
            if not here.inserted:
                break
            known = np.isin(here.denser.location, here.posed.location)
            around = binary_dilation(~known, iterations=AROUND)
            before, here = here, self._corridor(here, SETTLED, around)
            best = min(best, here, key=rank)
            stays = before.cost - here.cost < WORTHWHILE * here.cost
            if stays and (not here.broken or here.broken >= before.broken):
                break
        return best

    def _corridor(self, program: Delivered, grain: Grain, free: BoolArray | None = None) -> Delivered:
        """Search a corridor about a program's postures once, everywhere or where it is free."""
        self._steps(0, 1)
        posed, before = program.denser, program.cost
        costs = self._costs(posed, program)
        search = partial(self.near.searched, posed, costs, grain, program.filled, self._steps, free)
        path = self.options.checkpoint.found(search)
        here = self.priced(path, posed)
        name = f"corridor of {np.degrees(grain.radius):.3g} deg"
        self.stages.append(Stage(name, self._status(here), 0, before, here.cost))
        return here

    def _polished(self, best: Delivered) -> Delivered:
        """Refine a program near its postures, where axes that stand are to go on standing."""
        for _ in range(POLISHING):
            before = best
            best = min(best, *(self._refined(best, sharpness) for sharpness in POLISHES), key=rank)
            if before.cost - best.cost < WORTHWHILE * before.cost:
                break
        return best

    def _refined(self, here: Delivered, sharpness: tuple[float, ...]) -> Delivered:
        """Refine a program by prices of blocks that are sharper from refinement to refinement."""
        near = len(sharpness) == 1
        for share in sharpness if self._pays_standing else sharpness[-1:]:
            self.options.progress(f"solving for the program's blocks, to {share:.0%}", 0, 1)
            posed, before = here.denser, here.cost
            problem = self._local(here, share, near=near)
            path = self.options.checkpoint.found(partial(self.near.refined, posed, problem, here.filled))
            here = self.priced(path, posed, replace(problem, max_turn=posed.problem.max_turn))
            status = self._status(here)
            self.stages.append(Stage(f"program, sharpness {share:g}", status, 0, before, here.cost))
        return here if here.broken else self._with_inserted(here)

    def _steadied(self, best: Delivered, before: Delivered | None, grain: Grain | None) -> Delivered:
        """Search again with dearer starts and reversals; return the steadiest that costs little more.

        Parameters
        ----------
        before : the result of a smaller effort, which may not cost less
        """
        found = [best] if before is None else [best, before]
        least = min(found, key=rank)
        if self.options.steady == 0.0 or self.options.objective != "energy" or grain is None or least.broken:
            return least
        most = (1.0 + self.options.steady) * least.cost
        if before is not None and not before.broken:
            most = min(most, before.cost)
        found.append(self._final(self._refined(self._near(best, grain), POLISHES[-1])))
        return min((one for one in found if not one.broken and one.cost <= most), key=unrest)

    def _rounds(self, best: Delivered) -> Delivered:
        """Refine round by round for least time, on the locations that the program needs."""
        here = best
        for number in range(MOST_ROUNDS):
            self.options.progress(f"solving for the program's blocks, round {number + 1}", 0, 1)
            if number >= len(SHARPNESS) and not here.broken:
                break
            posed, start, before = here.denser, here.filled, here.cost
            sharpness, coming = (SHARPNESS[min(n, len(SHARPNESS) - 1)] for n in (number, number + 1))
            problem = self._at_times(posed.problem, start, sharpness, here)
            path = self.options.checkpoint.found(partial(self.near.refined, posed, problem, start))
            here = self.priced(path, posed, problem)
            name = f"program, round {number + 1}"
            self.stages.append(Stage(name, self._status(here), 0, before, here.cost))
            gain, better = best.cost - here.cost, rank(here) < rank(best)
            best = here if better else best
            more = here.inserted > FEW * len(posed.path) or (better and gain > WORTHWHILE * here.cost)
            if not more and not here.broken and (number >= 2 or not self._prices_stops):
                break
            stays = here.inserted == 0 and np.array_equal(here.rotary, start)
            if stays and (here.broken or not self._prices_stops or coming == sharpness):
                break
        return best

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

    def priced(self, rotary: Array, posed: Posed | None = None, solved: Problem | None = None) -> Delivered:
        """Price a path by the blocks of its program, and check the postures between its locations.

        Parameters
        ----------
        rotary : (n, 2), rad
        posed : its locations; the given ones by default
        solved : the problem of which it is an optimum
        """
        posed = self._given if posed is None else posed
        machine = posed.problem.machine
        fill = self.filling.fill(posed.path, machine, follow(posed.path, machine, rotary))
        row = np.interp(fill.row, np.arange(len(posed.location)), posed.location)
        between = fill.motion.positions[:, machine.rotary_columns]
        # A long path is kept once where nothing is inserted; the given one is normalised by `refined`.
        same = len(row) == len(posed.location) and posed is not self._given
        denser = self._parts(posed, rotary, self._posed(row, posed.path if same else None), between)
        positions, excess = denser.problem.placed(slice(None), between)
        past = max(float(excess.max()), float(denser.problem.limit_excess(positions).max()))
        jumps = np.floor(posed.location[fill.jumps]).astype(np.int64)
        past = np.inf if len(jumps) else past
        if self.options.objective == "time" or not self.options.clock.is_programmed(machine):
            # Redundant blocks would cost the control time, as stops.
            fill = self.filling.thin(fill)
        taken = self.options.clock(fill.blocks, machine)
        energy = timed_energy(machine, fill.blocks, taken)
        cost = self.cost(energy) + self._beside(rotary[np.isin(posed.location, self._every)])
        times = fill.times(taken.times)
        solved = solved or posed.problem
        refused, turned = self.near.refused(denser, between), self.near.turned(denser, between)
        return Delivered(
            posed, rotary, denser, between, past, jumps, refused, turned, energy, cost, times, solved
        )

    def _parts(self, posed: Posed, rotary: Array, denser: Posed, filled: Array) -> Posed:
        """Let inserted locations turn as the path, (n, 2) rad, does that they come from."""
        if self.by_length or len(denser.location) == len(posed.location):
            return denser
        known, turned = np.abs(np.diff(rotary, axis=0)), np.abs(np.diff(filled, axis=0))
        most = shared(posed.problem.max_turn, known, posed.location, denser.location, turned)
        return replace(denser, problem=replace(denser.problem, max_turn=most))

    def _final(self, program: Delivered) -> Delivered:
        """Price a program without redundant blocks, as it is delivered."""
        machine, path = program.posed.problem.machine, program.posed.path
        motion = follow(path, machine, program.rotary)
        blocks = self.filling.blocks(path, machine, motion)
        energy = timed_energy(machine, blocks, self.options.clock(blocks, machine))
        solved = program.solved
        if self.options.objective != "time" and solved is program.posed.problem:
            # It was searched: of these prices it is an optimum, as far as it is one.
            solved = self._repriced(program.posed, program.rotary, self._costs(program.posed))
        beside = self._beside(program.rotary[np.isin(program.posed.location, self._every)])
        return replace(program, energy=energy, cost=self.cost(energy) + beside, solved=solved)

    def _beside(self, rotary: Array) -> float:
        """Sum the prices of bends, delay and wear of a path, (n, 2) rad, at the given locations, J."""
        terms = [term for term in self._given.problem.terms if term.name in BESIDE and term.has_price]
        if self.options.objective == "time" or not terms:
            return 0.0
        quantities = self._given.problem.quantities(self._given.problem.positions(slice(None), rotary))
        return sum(term.cost(term.values(quantities)) for term in terms)

    def cost(self, energy: Energy) -> float:
        """Compute what a program costs by the objective, J, without the prices `BESIDE` it."""
        if self.options.objective == "time":
            # Rounded, so that of paths that no axis slows down the first one stays.
            return TIME_PRICE * round(energy.time, 6)
        return energy.total if self.options.objective == "energy" else energy.travel

    def _costs(self, posed: Posed, program: Delivered | None = None) -> BlockCosts:
        """Compute what blocks cost, at the feed or as long as the control takes for those of a program."""
        machine = posed.problem.machine
        if self.options.objective == "travel":
            return BlockCosts.of_travel(posed.problem.plus, posed.problem.minus)
        slowed = program is not None and not self.options.clock.is_programmed(machine)
        times = program.times if program is not None and slowed else feed_times(posed.path)
        # The duration of rapid moves depends on the posture.
        lasting = np.where(posed.path.rapid, 0.0, times)[1:]
        costs = block_costs(machine, posed.path.feed[1:], posed.path.rapid[1:], time=lasting)
        up, down = lifting_costs(machine, self.options.up_penalty)
        return replace(costs, slope=costs.slope + np.stack([up, down])[:, None])

    def _local(self, program: Delivered, sharpness: float, *, near: bool) -> Problem:
        """Make the problem of a refinement of a program; `near` it axes turn hardly farther."""
        costs = self._costs(program.denser, program)
        problem = self._repriced(program.denser, program.filled, costs, sharpness)
        if near:
            # Else it would need more locations.
            turned = np.abs(np.diff(program.filled, axis=0))
            most = np.minimum(problem.max_turn, FARTHER * turned + LITTLE)
            problem = replace(problem, max_turn=most)
        return self._at_times(problem, program.filled, SHARPNESS[-1], program)

    def _repriced(
        self, posed: Posed, rotary: Array, costs: BlockCosts, sharpness: float = BLUNT[-1]
    ) -> Problem:
        """Price travel by the cost of blocks near a path, (n, 2) rad."""
        travel = np.abs(np.diff(posed.problem.positions(slice(None), rotary), axis=0))
        plus, minus = costs.near(travel, sharpness)
        return replace(posed.problem, plus=plus, minus=minus)

    def _at_times(self, problem: Problem, rotary: Array, sharpness: float, program: Delivered) -> Problem:
        """Add the price of a control's stops near a path, (n, 2) rad, and of the power that time costs."""
        if self.options.objective == "time":
            return from_rest_to_rest(problem, rotary, sharpness) if self._prices_stops else problem
        slowed = not self.options.clock.is_programmed(problem.machine)
        if self.options.objective == "travel" or not slowed or not self.options.clock.stops_at_turns:
            return problem
        power = max(program.cost, 0.0) / float(program.times.sum())
        problem = replace(problem, time_price=problem.time_price + power)
        return from_rest_to_rest(problem, rotary, sharpness, words=self.options.clock.limits_words)

    def _status(self, here: Delivered) -> str:
        broken = f", bounds broken by {here.broken:.2g}" if here.broken else ""
        return f"{len(here.posed.path)} locations, {here.inserted} more in the program{broken}"


def delivered(
    solution: Solution, delivery: Delivery, candidates: Mapping[str, Array]
) -> tuple[Solution, tuple[float, float], Breach | None]:
    """Solve a solution again on the locations of its program; its energies are then those of programs.

    Every baseline is priced as its own program, and given on the locations of the result; one that no program
    can follow is missing. A baseline that is cheaper than the result is refined and replaces it.

    Parameters
    ----------
    solution : on the given locations, with its problem
    delivery : what solves it
    candidates : further paths to begin from by name, (n, 2) rad: travel doesn't tell which costs least

    Returns
    -------
    The solution; its rank (`Delivered.rank`); and what the path that was solved still breaks between its
    locations, even if a baseline took its place
    """
    machine, filling, given = solution.machine, delivery.filling, solution.toolpath
    columns = machine.rotary_columns
    best = delivery.run(solution.motion.positions[:, columns], everywhere=True)
    breach = best.breach
    priced = partial(delivery.options.progress, "pricing baselines as programs")
    energies, planes, missing = {}, {}, dict(solution.missing)
    for number, (name, b) in enumerate(solution.compared.items()):
        priced(number, 2 * len(solution.compared))
        try:
            fill = require_blocks(filling.fill(b.toolpath or given, machine, b.motion))
        except NoBaseline as reason:
            missing[name] = str(reason)
            continue
        blocks, planes[name] = filling.thin(fill).blocks, fill.planes
        energies[name] = timed_energy(machine, blocks, delivery.options.clock(blocks, machine))
        del fill, blocks  # a path may be long
    others = dict(candidates)
    for name in sorted(energies, key=lambda name: delivery.cost(energies[name])):
        baseline = solution.compared[name]
        if baseline.toolpath is None and delivery.cost(energies[name]) < best.cost:
            others[f"baseline {name}"] = baseline.motion.positions[:, columns]
    for name, rotary in others.items():
        if not delivery.admits(rotary):
            continue
        before = len(delivery.stages)
        best = min(best, delivery.run(rotary), key=rank)
        named = [replace(stage, name=f"{stage.name}, from {name}") for stage in delivery.stages[before:]]
        delivery.stages[before:] = named
    path = best.posed.path
    location = None if len(path) == len(given) else best.posed.location
    compared = {}
    for number, name in enumerate(planes, start=len(solution.compared)):
        priced(number, 2 * len(solution.compared))
        baseline, energy = solution.compared[name], energies[name]
        motion = baseline.motion
        if baseline.toolpath is None and location is not None:
            motion = follow(path, machine, planes[name].rotary_at(location))
            # Priced as it is given, so that everyone who prices it finds the same.
            energy = program_energy(machine, path, motion, filling, delivery.options.clock)
        compared[name] = replace(baseline, motion=motion, energy=energy)
    motion = replace(follow(path, machine, best.rotary), location=location)
    findings = best.findings(delivery.near.mask or Mask())
    found = replace(
        solution,
        toolpath=replace(path, findings=(*path.findings, *findings)),
        tilt=best.posed.bounds,
        motion=motion,
        energy=program_energy(machine, path, motion, filling, delivery.options.clock),
        compared=compared,
        missing=missing,
        stages=(*solution.stages, *delivery.stages),
        problem=best.solved,
        filling=filling,
        clock=delivery.options.clock,
    )
    return found, best.rank, breach
