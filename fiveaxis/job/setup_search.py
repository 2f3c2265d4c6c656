"""Search for cheap setups within a job's ranges, on some of the path's locations."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.base import (
    SCATTERED,
    STAGES,
    Array,
    Infeasible,
    Progress,
    follow_compass,
    halton,
    search_box,
    unheard,
)
from fiveaxis.check import Surroundings, find_accessible
from fiveaxis.job.description import SetupSearch, SetupTable
from fiveaxis.job.task import JobTask
from fiveaxis.model import Machine
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.show import TriedSetup

logger = logging.getLogger(__name__)

# Share of the tries that is kept for the neighbourhood of the best setup that can be kept clear.
CLEAR_SHARE = 0.25
# Most locations of the path on which a setup is priced.
ROUGH_LOCATIONS = 120
# Decimals of a setup's mm and deg: nobody sets a part up more finely.
DIGITS = 2


def search_setups(task: JobTask, search: SetupSearch, progress: Progress = unheard) -> SetupTrials:
    """Search for cheap setups within ranges, by rough costs."""
    job, tries = task.job, search.tries
    costs = SetupCosts(task)
    steps = 0

    def cost(setup: SetupTable) -> float:
        nonlocal steps
        steps += 1
        progress(STAGES["setups"], min(steps, tries), tries)
        return costs.free(setup)

    trials = SetupTrials(job.setup, search, cost, costs.clear if costs.has_obstacles else None)
    given = job.setup.model_copy(update={"search": None})
    trials.try_freely(given)
    kept = 0 if trials.clear is None else int(CLEAR_SHARE * tries)
    search_box(
        lambda point: trials.try_freely(trials.setup_at(point)), trials.point_of(given), tries - 1 - kept
    )
    if trials.clear is not None:
        trials.find_clear(kept)
    return trials


class SetupCosts:
    """Rough costs of setups, J, with the price of time; `Infeasible` is raised where no path exists."""

    def __init__(self, task: JobTask) -> None:
        job, machine, toolpath = task.job, task.machine, task.toolpath
        stride = -(-len(toolpath) // ROUGH_LOCATIONS)
        rows = np.unique(np.append(np.arange(0, len(toolpath), stride), len(toolpath) - 1))
        thinned = toolpath.at(rows)
        self.toolpath = thinned if thinned.cutting.any() else toolpath
        self.machine, self.around = machine, task.obstacles
        bounds = task.constraints
        turn = None if bounds.max_turn is None else stride * bounds.max_turn
        self.constraints = replace(bounds, max_turn=turn if turn is None or turn < math.pi else 2.0 * math.pi)
        price = job.search.time_price
        self.options = Options(
            # A thinned path has no program of its own.
            objective="travel",
            up_penalty=job.search.up_penalty,
            time_price=price,
            effort="quick",
        )
        self.zoned = bounds.zoned(self.toolpath)
        self.price = (machine.base_power or 0.0) if price is None else price

    @property
    def has_obstacles(self) -> bool:
        """Whether there is anything that an inclined tool could touch."""
        return self.around is not None and find_accessible(self.zoned, self.machine, self.around) is not None

    def free(self, setup: SetupTable) -> float:
        """Price a setup without obstacles."""
        return self._price(self._machine_at(setup), None)

    def clear(self, setup: SetupTable) -> float:
        """Price a setup with the tool kept clear of part, stock and fixtures.

        Moves between locations and the head aren't checked: the moves of a thinned path aren't the path's.
        """
        there = self._machine_at(setup)
        return self._price(there, find_accessible(self.zoned, there, self.around or Surroundings()))

    def _machine_at(self, setup: SetupTable) -> Machine:
        return self.machine.with_setup(setup.offset, setup.rotation)

    def _price(self, machine: Machine, mask: Any) -> float:
        energy = optimise_postures(
            self.toolpath, machine, self.constraints, replace(self.options, mask=mask)
        ).energy
        return energy.travel + self.price * energy.time


@dataclass
class SetupTrials:
    """Setups that were tried, with their rough costs.

    Parameters
    ----------
    given : the job's setup
    search : the ranges
    cost : rough cost of a setup, J; raises `Infeasible`
    clear : the same with the tool kept clear; None where there is nothing to keep clear of
    tried : what was found; not yet the energy in full
    """

    given: SetupTable
    search: SetupSearch
    cost: Callable[[SetupTable], float]
    clear: Callable[[SetupTable], float] | None = None
    tried: dict[SetupTable, TriedSetup] = field(default_factory=dict)

    def try_freely(self, setup: SetupTable) -> float:
        """Price a setup without obstacles; infinite where it can't be used."""
        if setup not in self.tried:
            found = TriedSetup(setup.offset, setup.rotation)
            try:
                found = replace(found, rough=self.cost(setup))
            except Infeasible as fault:
                found = replace(found, why=str(fault))
            self.tried[setup] = found
            logger.debug("setup %s: %s", setup, self.tried[setup].rough)
        rough = self.tried[setup].rough
        return np.inf if rough is None else rough

    def try_clear(self, setup: SetupTable) -> float:
        """Price a setup with the tool kept clear; infinite where it can't be used."""
        self.try_freely(setup)
        tried = self.tried[setup]
        if tried.rough is not None and tried.kept_clear is None and not tried.why and self.clear is not None:
            try:
                tried = replace(tried, kept_clear=self.clear(setup))
            except Infeasible as fault:
                tried = replace(tried, why=f"the tool can't be kept clear: {fault}")
            self.tried[setup] = tried
            logger.debug("setup %s, kept clear: %s", setup, tried.kept_clear)
        return np.inf if tried.kept_clear is None else tried.kept_clear

    def find_clear(self, calls: int) -> None:
        """Try the cheap setups again with the tool kept clear, and search on around the best one.

        Keeping clear only removes postures, so a setup then costs at least about what it costs without
        obstacles: this ends at the first setup that costs more without obstacles than the best clear one.
        At most `calls` are tried around that one; if none can be kept clear, further scattered setups are.
        """

        def cost(point: Array) -> float:
            return self.try_clear(self.setup_at(point))

        least, best = np.inf, None
        for setup in self._by_cost("rough"):
            if self.try_freely(setup) >= least:
                break
            found = self.try_clear(setup)
            if found < least:
                least, best = found, setup
        if best is not None:
            return follow_compass(cost, self.point_of(best), least, calls)
        sides = len(self.search.ranges)
        scattered = halton(SCATTERED * sides + calls, sides)[-calls:]
        for left, point in zip(range(calls - 1, -1, -1), scattered, strict=True):
            least = cost(point)
            if least < np.inf:
                return follow_compass(cost, point, least, left)
        return None

    def point_of(self, setup: SetupTable) -> Array:
        """Return the point of the unit box that a setup belongs to, clipped to the box."""
        x, y, z = setup.offset
        given = {"x": x, "y": y, "z": z, "angle": setup.rotation[2]}
        shares = [(given[name] - low) / (high - low) for name, (low, high) in self.search.ranges.items()]
        return np.clip(np.array(shares), 0.0, 1.0)

    def setup_at(self, point: Array) -> SetupTable:
        """Return the setup at a point of the unit box."""
        chosen = {
            name: round(low + float(share) * (high - low), DIGITS) + 0.0
            for share, (name, (low, high)) in zip(point, self.search.ranges.items(), strict=True)
        }
        x, y, z = (chosen.get(name, old) for name, old in zip("xyz", self.given.offset, strict=True))
        turned = (*self.given.rotation[:2], chosen.get("angle", self.given.rotation[2]))
        return self.given.model_copy(update={"offset": (x, y, z), "rotation": turned, "search": None})

    @property
    def ranked(self) -> list[SetupTable]:
        """The setups that can be used, cheapest first; of equals the one that was tried first."""
        return self._by_cost("rough" if self.clear is None else "kept_clear")

    def _by_cost(self, name: str) -> list[SetupTable]:
        costs = {setup: getattr(tried, name) for setup, tried in self.tried.items()}
        return sorted((setup for setup in costs if costs[setup] is not None), key=lambda setup: costs[setup])
