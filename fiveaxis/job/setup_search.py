"""Search for cheap setups within a job's ranges, on some of the path's locations.

Of a costly function over a box few values are taken, always the same: scattered points, then a compass.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.collision.accessibility import find_accessible
from fiveaxis.errors import Infeasible, JobError
from fiveaxis.geometry import Array
from fiveaxis.job.description import Job, SetupSearch, SetupTable
from fiveaxis.machine import Machine
from fiveaxis.posture import Options, optimise_postures
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import Toolpath

# Scattered points for each side; at most this share of all calls.
SCATTERED, SCATTERED_SHARE = 6, 0.5
# The compass's first and last step, as shares of a side.
FIRST_STEP, LAST_STEP = 0.25, 1.0 / 200.0
logger = logging.getLogger(__name__)

# Share of the tries that is kept for the neighbourhood of the best setup that can be kept clear.
CLEAR_SHARE = 0.25
# Most locations of the path on which a setup is priced.
ROUGH_LOCATIONS = 120
# Decimals of a setup's mm and deg: nobody sets a part up more finely.
DIGITS = 2


def search_setups(
    job: Job,
    machine: Machine,
    toolpath: Toolpath,
    progress: Progress = unheard,
    around: Surroundings | None = None,
) -> SetupTrials:
    """Search for cheap setups within a job's ranges, with rough costs.

    Parameters
    ----------
    machine : in the given setup
    toolpath : the whole path
    around : what the tool keeps clear of; None where it needn't

    Raises
    ------
    JobError
        The job has no ranges.
    """
    if job.setup.search is None:
        raise JobError("setup.search is missing; give ranges of x, y, z or angle", file=job.input)
    tries = job.setup.search.tries
    costs = SetupCosts(job, machine, toolpath, around)
    steps = 0

    def cost(setup: SetupTable) -> float:
        nonlocal steps
        steps += 1
        progress("trying setups", min(steps, tries), tries)
        return costs.free(setup)

    trials = SetupTrials(job.setup, job.setup.search, cost, costs.clear if costs.has_obstacles else None)
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
    """Rough costs of setups, J, with the price of time; `Infeasible` is raised where no path exists.

    Parameters
    ----------
    job : with its bounds and effort
    machine : in the given setup
    toolpath : the whole path
    around : part, stock and fixtures to keep clear of; None for none
    """

    def __init__(
        self, job: Job, machine: Machine, toolpath: Toolpath, around: Surroundings | None = None
    ) -> None:
        stride = -(-len(toolpath) // ROUGH_LOCATIONS)
        rows = np.unique(np.append(np.arange(0, len(toolpath), stride), len(toolpath) - 1))
        thinned = toolpath.at(rows)
        self.toolpath = thinned if thinned.cutting.any() else toolpath
        self.machine, self.around = machine, around
        bounds = job.constraints
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


@dataclass(frozen=True)
class Tried:
    """A setup that was tried.

    Parameters
    ----------
    setup : where the workpiece stood
    rough : J, cost of the thinned path with the price of its time; None where no path exists
    clear : J, the same with the tool kept clear; None where that wasn't tried, or isn't possible
    why : why the setup can't be used
    """

    setup: SetupTable
    rough: float | None
    why: str = ""
    clear: float | None = None


@dataclass
class SetupTrials:
    """Setups that were tried, with their rough costs.

    Parameters
    ----------
    given : the job's setup
    search : the ranges
    cost : rough cost of a setup, J; raises `Infeasible`
    clear : the same with the tool kept clear; None where there is nothing to keep clear of
    """

    given: SetupTable
    search: SetupSearch
    cost: Callable[[SetupTable], float]
    clear: Callable[[SetupTable], float] | None = None
    tried: dict[SetupTable, Tried] = field(default_factory=dict)

    def try_freely(self, setup: SetupTable) -> float:
        """Price a setup without obstacles; infinite where it can't be used."""
        if setup not in self.tried:
            try:
                self.tried[setup] = Tried(setup, self.cost(setup))
            except Infeasible as fault:
                self.tried[setup] = Tried(setup, None, why=str(fault))
            logger.debug("setup %s: %s", setup, self.tried[setup].rough)
        rough = self.tried[setup].rough
        return np.inf if rough is None else rough

    def try_clear(self, setup: SetupTable) -> float:
        """Price a setup with the tool kept clear; infinite where it can't be used."""
        self.try_freely(setup)
        tried = self.tried[setup]
        if tried.rough is not None and tried.clear is None and not tried.why and self.clear is not None:
            try:
                tried = replace(tried, clear=self.clear(setup))
            except Infeasible as fault:
                tried = replace(tried, why=f"the tool can't be kept clear: {fault}")
            self.tried[setup] = tried
            logger.debug("setup %s, kept clear: %s", setup, tried.clear)
        return np.inf if tried.clear is None else tried.clear

    def find_clear(self, calls: int) -> None:
        """Try the cheap setups again with the tool kept clear, and search on around the best one.

        Keeping clear only removes postures, so a setup then costs at least about what it costs without
        obstacles: this ends at the first setup that costs more without obstacles than the best clear one.
        At most `calls` are tried around that one; if none can be kept clear, further scattered setups are.
        """

        def cost(point: Array) -> float:
            return self.try_clear(self.setup_at(point))

        least, best = np.inf, None
        for tried in self._by_cost("rough"):
            if tried.rough is not None and tried.rough >= least:
                break
            found = self.try_clear(tried.setup)
            if found < least:
                least, best = found, tried.setup
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
    def ranked(self) -> list[Tried]:
        """The setups that can be used, cheapest first; of equals the one that was tried first."""
        return self._by_cost("rough" if self.clear is None else "clear")

    def _by_cost(self, name: str) -> list[Tried]:
        known = (tried for tried in self.tried.values() if getattr(tried, name) is not None)
        return sorted(known, key=lambda tried: float(getattr(tried, name)))


def search_box(cost: Callable[[Array], float], start: Array, calls: int) -> None:
    """Search for the point of the unit box at which a cost is least; `cost` records what it finds.

    The start and evenly scattered points (Halton) come first; a compass search continues from the best one.

    Parameters
    ----------
    cost : of a point (d,), each side 0…1; infinite where the point isn't admissible
    start : (d,), the first point
    calls : most calls of `cost`

    References
    ----------
    Kolda, Lewis & Torczon (2003), SIAM Review 45(3), section 1.1: compass search.
    """
    sides = len(start)
    scattered = min(SCATTERED * sides, int(SCATTERED_SHARE * calls))
    points = [start, *halton(scattered, sides)][:calls]
    costs = [cost(point) for point in points]
    best = int(np.argmin(costs))
    follow_compass(cost, points[best], costs[best], calls - len(points))


def follow_compass(cost: Callable[[Array], float], here: Array, least: float, calls: int) -> None:
    """Search on from a point of the unit box: a step along each side, halved where no step improves.

    Parameters
    ----------
    cost, calls : as for `search_box`
    here, least : the point, (d,), and its cost

    References
    ----------
    Kolda, Lewis & Torczon (2003), SIAM Review 45(3), section 1.1.
    """
    step, seen = FIRST_STEP, {here.tobytes()}
    while step >= LAST_STEP:
        better = False
        for direction in np.vstack([np.eye(len(here)), -np.eye(len(here))]):
            there = np.clip(here + step * direction, 0.0, 1.0)
            if there.tobytes() in seen:
                continue
            if calls == 0:
                return
            calls -= 1
            seen.add(there.tobytes())
            found = cost(there)
            if found < least:
                here, least, better = there, found, True
        if not better:
            step /= 2.0


def halton(count: int, sides: int) -> Array:
    """Scatter points evenly over the unit box, (count, sides), the same ones every time; not its corner.

    References
    ----------
    Halton (1960), Numerische Mathematik 2: radical inverses in different prime bases.
    """
    # Takes long to import.
    from scipy.stats.qmc import Halton

    return np.asarray(Halton(sides, scramble=False).fast_forward(1).random(count))
