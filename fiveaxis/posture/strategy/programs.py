"""The program of a path: its locations and blocks, what they cost, and the problem of making them cheaper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model import (
    BlockCosts,
    Energy,
    Filling,
    Machine,
    Motion,
    TiltBounds,
    Toolpath,
    block_costs,
    feed_times,
    follow,
    lifting_costs,
    refined,
)
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import program_energy, timed_energy
from fiveaxis.posture.strategy.least_time import TIME_PRICE, by_time, from_rest_to_rest
from fiveaxis.posture.strategy.near import Near
from fiveaxis.posture.strategy.program_path import Delivered, Instance
from fiveaxis.posture.strategy.turn_bounds import shared
from fiveaxis.posture.terms import bends, terms_of, waits

# Share of a step, or of a turn, below which it counts as none.
SHARPEST = 0.01
# Terms of the objective that are priced at the given locations, beside the program's blocks.
BESIDE = bends, waits

# Makes the problem of a path with inserted locations from their fractional indices, (n,), in the given path.
Build = Callable[[Toolpath, Array], tuple[Problem, TiltBounds]]


@dataclass(eq=False)
class Programs:
    """Programs of paths on the given locations, and on further ones in between.

    Parameters
    ----------
    given : the path
    build : makes the problem of a path with inserted locations
    near : what is done near a path, within mask and cone
    filling : what inserted blocks keep
    options : what the program costs, and its control
    by_length : whether turns are bounded over the length of a move's parts
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

    def energy(self, blocks: Motion, machine: Machine) -> Energy:
        """Compute the energy of blocks in the control's time."""
        return timed_energy(machine, blocks, self.options.clock(blocks, machine))

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

    def costs(
        self, instance: Instance, program: Delivered | None = None, *, other: bool = False
    ) -> BlockCosts:
        """Compute what blocks cost: energy where that is minimised, else in proportion to travel.

        With `other` it is the other of both. Blocks take the times of a program, where a clock is known, or
        else those at the feed.
        """
        problem, path = instance.problem, instance.path
        if (self.options.objective == "energy") == other:
            return BlockCosts.of_travel(problem.plus, problem.minus)
        times = program.times if program is not None and self.has_clock else feed_times(path)
        # The duration of rapid moves depends on the posture.
        lasting = np.where(path.rapid, 0.0, times)[1:]
        costs = block_costs(problem.machine, path.feed[1:], path.rapid[1:], time=lasting)
        up, down = lifting_costs(problem.machine, self.options.up_penalty)
        return replace(costs, slope=costs.slope + np.stack([up, down])[:, None])

    def local(self, instance: Instance, rotary: Array, sharpness: float, costs: BlockCosts) -> Problem:
        """Make the problem of a refinement near a path, (n, 2) rad, by the costs of its blocks."""
        if not self.options.is_timed:
            return self.repriced(instance, rotary, costs, sharpness)
        stops = self._prices_stops
        return from_rest_to_rest(instance.problem, rotary, sharpness) if stops else instance.problem

    def repriced(
        self, instance: Instance, rotary: Array, costs: BlockCosts, sharpness: float = SHARPEST
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
        return from_rest_to_rest(problem, rotary, SHARPEST, words=clock.limits_words)

    @property
    def has_clock(self) -> bool:
        """Whether the control's clock is known, so that blocks don't just take their time at the feed."""
        return not self.options.clock.is_programmed(self.given_instance.problem.machine)

    @cached_property
    def is_flat(self) -> bool:
        """Whether prices don't depend on the path."""
        if self.options.is_timed:
            return not self._prices_stops
        return not self.costs(self.given_instance).has_constant_power

    @property
    def _prices_stops(self) -> bool:
        """Whether, in least time, a block that turns costs a stop, so that prices hang on the path.

        A control with TCP that stops between blocks would need more blocks, and so more stops, for turns that
        are concentrated in few of them.
        """
        return self.options.clock.stops_at_turns and not self.options.clock.limits_words


def _turning_alike(instance: Instance, rotary: Array, denser: Instance, filled: Array) -> Instance:
    """Let inserted locations turn as the path, (n, 2) rad, does that they come from."""
    known, turned = np.abs(np.diff(rotary, axis=0)), np.abs(np.diff(filled, axis=0))
    most = shared(instance.problem.max_turn, known, instance.location, denser.location, turned)
    return replace(denser, problem=replace(denser.problem, max_turn=most))
