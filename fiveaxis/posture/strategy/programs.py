"""The program of a path: its locations and blocks, what they cost, and the problem of making them cheaper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, Severity
from fiveaxis.model import (
    BlockCosts,
    Energy,
    Filling,
    TiltBounds,
    Toolpath,
    block_costs,
    feed_times,
    follow,
    lifting_costs,
    program_energy,
    refined,
    timed_energy,
)
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Instance, Problem
from fiveaxis.posture.strategy.least_time import SHARPNESS, TIME_PRICE, by_time, from_rest_to_rest
from fiveaxis.posture.strategy.near import FREE, Near
from fiveaxis.posture.strategy.rotary_bounds import shared
from fiveaxis.posture.terms import bends, terms_of, waits

# Violation that is tolerated between two locations (cosine, mm, rad).
BETWEEN = 2e-4
# Terms of the objective that are priced at the given locations, beside the program's blocks.
BESIDE = bends, waits

# Makes the problem of a path with inserted locations from their fractional indices, (n,), in the given path.
Build = Callable[[Toolpath, Array], tuple[Problem, TiltBounds]]


@dataclass(frozen=True)
class Breach:
    """What a path breaks between its locations.

    A hop is the smallest turn of a move in which the tool leans out of bounds; the overrun is in mm or rad.
    """

    hop: float
    overrun: float


@dataclass(frozen=True, eq=False)
class Delivered:
    """A path, the locations that its program needs in addition, and its cost.

    Parameters
    ----------
    instance : what was solved
    rotary : (n, 2), rad, chain order, its postures
    denser : with the additional locations of the program's blocks
    filled : (m, 2), rad, the postures there
    excess : largest violation between the locations; cosine, mm or rad; infinite where axes would jump
    jumps : moves of the given path in which they would, by the location at which they begin
    refused : (m,), whether a mask refuses the posture there
    turned : rad, by which the first rotary axis turns too far within the singular cone
    energy : of the program's blocks
    cost : J, the objective for them
    times : (m,), s, that the control takes for the moves to the denser path's locations
    solved : the problem of which the postures are an optimum, with the prices near them
    planes : (n, p), what confined them to a mask (`fiveaxis.posture.strategy.near.Planes.columns`), or `FREE`
    """

    instance: Instance
    rotary: Array
    denser: Instance
    filled: Array
    excess: float
    jumps: IntArray
    refused: BoolArray
    turned: float
    energy: Energy
    cost: float
    times: Array
    solved: Problem
    planes: Array = field(default_factory=lambda: FREE)

    @property
    def breach(self) -> Breach | None:
        """What is broken between the locations; None if nothing is."""
        if self.excess <= BETWEEN:
            return None
        problem, location = self.denser.problem, self.denser.location
        positions, excess = problem.placed(slice(None), self.filled)
        leaning = np.ceil(location[excess > BETWEEN]).astype(np.int64) - 1
        moves = np.union1d(leaning, self.jumps)
        turns = np.abs(np.diff(self.filled[self.denser.own], axis=0)).max(axis=1)
        hop = turns[moves[moves >= 0]].min(initial=np.inf)
        return Breach(float(hop), float(problem.limit_excess(positions).max(initial=0.0)))

    @property
    def rank(self) -> tuple[float, float]:
        """Key by which the better of two is smaller: first violation, then cost."""
        return self.broken, self.cost

    @cached_property
    def broken(self) -> float:
        """How far it breaks bounds, 0 if it keeps them; a broken location counts as a refused posture."""
        problem = self.instance.problem
        past = problem.excess(self.rotary)
        # At inserted locations what is tolerated between locations is none.
        past = np.where(~self.instance.own & (past <= BETWEEN), 0.0, past)
        worst = max(0.0, float(past.max()), float(problem.turn_excess(self.rotary).max(initial=0.0)))
        broken = (1.0 + worst if worst > ALLOWED else 0.0) + max(self.excess - BETWEEN, 0.0)
        return broken + self.turned + int(np.count_nonzero(self.refused))

    def findings(self, mask: Mask) -> list[Finding]:
        """Report where postures between locations still break a bound."""
        if not self.broken:
            return []
        problem = self.denser.problem
        positions, excess = problem.placed(slice(None), self.filled)
        past = np.nan_to_num(problem.limit_excess(positions))
        jumping = np.isin(np.ceil(self.denser.location) - 1.0, self.jumps).astype(float)
        found = []
        for off, fact, remedy in (
            (excess, "the tool leans out of its bounds", "widen the range of its lean"),
            (past, "an axis exceeds its limits", "move the part on the table (work_offset)"),
            (jumping, "axes would have to jump", "allow smaller turns only (--max-turn)"),
            (1.0 * self.refused, mask.wording.refused, mask.wording.remedy),
        ):
            rows = np.flatnonzero(off > BETWEEN)
            if len(rows):
                message = (
                    f"between this location and the one before it {fact} ({len(rows)} blocks in all), and no "
                    f"path was found that avoids this; put locations closer together here or {remedy}"
                )
                place = self.denser.path.place(int(np.argmax(off)))
                found.append(Finding(Severity.WARNING, "between-locations", message, place))
        return found


@dataclass(frozen=True, eq=False)
class Candidate:
    """What a search of all postures found on few locations of an instance.

    Costs are of the blocks between the few; the path, (m, 2) rad, is refined on them, empty before a search.
    Of two the better has the smaller rank: how many postures a mask refuses, then the cost of the blocks
    between the few, J, with the price of what they break.
    """

    instance: Instance
    few: Instance
    costs: BlockCosts
    path: Array = field(default_factory=lambda: np.empty((0, 2)))
    rank: tuple[int, float] = (0, np.inf)

    @property
    def rotary(self) -> Array:
        """(n, 2), rad, straight between the locations that were searched: it may break bounds there."""
        at, known = self.instance.location, self.few.location
        return np.stack([np.interp(at, known, angle) for angle in self.path.T], axis=1)


@dataclass(eq=False)
class Programs:
    """Programs of a path on the given locations, and on further ones in between.

    The problem of a path with inserted locations is made by `build`; filling says what inserted blocks keep,
    options what a program costs. `by_length` bounds turns over the length of a move's parts.
    """

    given: Toolpath
    build: Build
    near: Near
    filling: Filling
    options: Options
    by_length: bool

    @cached_property
    def given_instance(self) -> Instance:
        """The given locations."""
        return self._built(np.arange(len(self.given), dtype=float), self.given)

    def instance(self, location: Array, path: Toolpath | None = None) -> Instance:
        """Make the problem of a path with inserted locations, by their fractional indices; kept without."""
        if len(location) == len(self.given):
            return self.given_instance
        return self._built(location, refined(self.given, location) if path is None else path)

    def _built(self, location: Array, path: Toolpath) -> Instance:
        problem, bounds = self.build(path, location)
        if self.options.is_timed:
            problem = by_time(problem, self.options.up_penalty)
        return Instance(path, location, problem, bounds)

    def admits(self, rotary: Array) -> bool:
        """Check whether a path, (n, 2) rad, keeps the bounds at all given locations."""
        return self.given_instance.problem.violation(rotary) <= ALLOWED

    def priced(
        self, rotary: Array, instance: Instance | None = None, solved: Problem | None = None
    ) -> Delivered:
        """Price a path, (n, 2) rad, by its program's blocks, and check the postures between its locations.

        The locations are the given ones by default; `solved` is the problem of which it is an optimum.
        """
        instance = self.given_instance if instance is None else instance
        machine = instance.problem.machine
        fill = self.filling.fill(instance.path, machine, follow(instance.path, machine, rotary))
        row = np.interp(fill.row, np.arange(len(instance.location)), instance.location)
        between = fill.motion.positions[:, machine.rotary_columns]
        # A long path is kept once where nothing is inserted.
        same = len(row) == len(instance.location)
        denser = self.instance(row, instance.path if same else None)
        denser = denser if same or self.by_length else _turning_alike(instance, rotary, denser, between)
        jumps = np.floor(instance.location[fill.jumps]).astype(np.int64)
        past = np.inf if len(jumps) else float(denser.problem.excess(between).max())
        if self.options.is_timed or self.has_clock:
            # Redundant blocks would cost the control time, as stops.
            fill = self.filling.thin(fill)
        taken = self.options.clock(fill.blocks, machine)
        energy = timed_energy(machine, fill.blocks, taken)
        return Delivered(
            instance,
            rotary,
            denser,
            filled=between,
            excess=past,
            jumps=jumps,
            refused=self.near.refused(denser, between),
            turned=self.near.turned(denser, between),
            energy=energy,
            cost=self._cost_at(instance, rotary, energy),
            times=fill.times(taken.times),
            solved=solved or instance.problem,
        )

    def final(self, program: Delivered) -> Delivered:
        """Price a program without redundant blocks, as it is delivered."""
        instance, rotary, solved = program.instance, program.rotary, program.solved
        machine, path = instance.problem.machine, instance.path
        motion = follow(path, machine, rotary)
        energy = program_energy(machine, path, motion, self.filling, self.options.clock)
        if not self.options.is_timed and solved is instance.problem:
            # It was searched: of these prices it is an optimum, as far as it is one.
            solved = self.repriced(instance, rotary, self.costs(instance))
        return replace(program, energy=energy, cost=self._cost_at(instance, rotary, energy), solved=solved)

    def bare(self, program: Delivered) -> Delivered:
        """Leave out inserted locations: where the path is straight in between, no program needs them."""
        if len(program.instance.path) == len(self.given):
            return program
        return self.priced(program.rotary[program.instance.own])

    def cost(self, energy: Energy) -> float:
        """Compute what a program costs by the objective, J, without the prices `BESIDE` it."""
        if self.options.is_timed:
            # Rounded, so that of paths that no axis slows down the first one stays.
            return TIME_PRICE * round(energy.time, 6)
        return energy.total if self.options.objective == "energy" else energy.travel

    def _cost_at(self, instance: Instance, rotary: Array, energy: Energy) -> float:
        """Compute what a program costs, J, with the prices of bends and delay at its given locations."""
        cost, problem = self.cost(energy), self.given_instance.problem
        if self.options.is_timed or not (terms := terms_of(problem, BESIDE)):
            return cost
        quantities = problem.quantities(problem.positions(slice(None), rotary[instance.own]))
        return cost + sum(term.cost(term.values(quantities)) for term in terms)

    def costs(self, instance: Instance, program: Delivered | None = None) -> BlockCosts:
        """Compute what blocks cost: energy where that is minimised, else in proportion to travel.

        Where a clock is known, blocks take the times of a program.
        """
        problem, path = instance.problem, instance.path
        if self.options.objective != "energy":
            return BlockCosts.of_travel(problem.plus, problem.minus)
        times = program.times if program is not None and self.has_clock else feed_times(path)
        # The duration of rapid moves depends on the posture.
        lasting = np.where(path.rapid, 0.0, times)[1:]
        costs = block_costs(problem.machine, path.feed[1:], path.rapid[1:], time=lasting)
        up, down = lifting_costs(problem.machine, self.options.up_penalty)
        return replace(costs, slope=costs.slope + np.stack([up, down])[:, None])

    def local(self, instance: Instance, rotary: Array, costs: BlockCosts) -> Problem:
        """Make the problem of a refinement near a path, (n, 2) rad, by the costs of its blocks."""
        if not self.options.is_timed:
            return self.repriced(instance, rotary, costs)
        stops = self._prices_stops
        return from_rest_to_rest(instance.problem, rotary) if stops else instance.problem

    def repriced(
        self, instance: Instance, rotary: Array, costs: BlockCosts, sharpness: float = SHARPNESS
    ) -> Problem:
        """Price travel by the cost of blocks near a path, (n, 2) rad."""
        travel = np.abs(np.diff(instance.problem.positions(slice(None), rotary), axis=0))
        plus, minus = costs.near(travel, sharpness)
        return replace(instance.problem, plus=plus, minus=minus)

    def at_times(self, problem: Problem, rotary: Array, program: Delivered) -> Problem:
        """Add the price of a control's stops near a program's path, (n, 2) rad."""
        clock = self.options.clock
        if self.options.objective != "energy" or not (self.has_clock and clock.stops_at_turns):
            return problem
        power = max(program.cost, 0.0) / float(program.times.sum())
        problem = replace(problem, time_price=problem.time_price + power)
        return from_rest_to_rest(problem, rotary, words=clock.limits_words)

    @property
    def has_clock(self) -> bool:
        """Whether the control's clock is known, so that blocks don't just take their time at the feed."""
        return not self.options.clock.is_programmed(self.given_instance.problem.machine)

    @property
    def _prices_stops(self) -> bool:
        """Whether, in least time, a block that turns costs a stop, so that prices hang on the path.

        With TCP it doesn't: turns concentrated in few blocks would need more blocks, and so more stops.
        """
        return self.options.clock.stops_at_turns and not self.options.clock.limits_words


def _turning_alike(instance: Instance, rotary: Array, denser: Instance, filled: Array) -> Instance:
    """Let inserted locations turn as the path, (n, 2) rad, does that they come from."""
    known, turned = np.abs(np.diff(rotary, axis=0)), np.abs(np.diff(filled, axis=0))
    most = shared(instance.problem.max_turn, known, instance.location, denser.location, turned)
    return replace(denser, problem=replace(denser.problem, max_turn=most))
