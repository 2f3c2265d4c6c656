"""Setups within bounds, looked at one after the other, and what each of them costs."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fiveaxis.errors import Infeasible, JobError
from fiveaxis.geometry import Array
from fiveaxis.job.box_search import SCATTERED, follow_compass, halton
from fiveaxis.job.description import SEARCHED, Job, SetupSearch, SetupTable

logger = logging.getLogger(__name__)

# A place is set up to 0.01 mm and 0.01 deg: a finer one can't be.
DIGITS = 2


@dataclass(frozen=True)
class Tried:
    """A setup that was looked at.

    Parameters
    ----------
    setup : where the workpiece stood
    rough : J, what the thinned path costs there, with the price of its time; None where it can't be followed
    clear : J, likewise where the tool is kept clear; None where that wasn't looked at, or can't be
    energy : J, of the feed drives in the whole program; None where it wasn't run
    why : what was against it
    """

    setup: SetupTable
    rough: float | None
    energy: float | None = None
    why: str = ""
    clear: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON, mm and deg."""
        place = {"offset": list(self.setup.offset), "rotation_deg": list(self.setup.rotation)}
        costs = {"rough": self.rough, "kept_clear": self.clear, "energy": self.energy}
        return {**place, **costs, "why": self.why}


@dataclass
class SetupTrials:
    """Setups within bounds, looked at one after the other.

    Parameters
    ----------
    job : with the bounds
    cost : J, of a setup, roughly; raises `Infeasible`
    clear : J, likewise where the tool is kept clear; None where there is nothing to keep clear of
    """

    job: Job
    cost: Callable[[SetupTable], float]
    clear: Callable[[SetupTable], float] | None = None
    tried: dict[SetupTable, Tried] = field(default_factory=dict)

    def look(self, point: Array) -> float:
        """Tell what the setup at a point of the unit box costs, roughly; infinite where it can't be used."""
        return self.look_at(self.setup_at(point))

    def look_at(self, setup: SetupTable) -> float:
        """Tell what a setup costs, roughly."""
        if setup not in self.tried:
            try:
                self.tried[setup] = Tried(setup, self.cost(setup))
            except Infeasible as fault:
                self.tried[setup] = Tried(setup, None, why=str(fault))
            logger.debug("setup %s: %s", setup, self.tried[setup].rough)
        rough = self.tried[setup].rough
        return np.inf if rough is None else rough

    def look_clear(self, point: Array) -> float:
        """Tell what the setup at a point of the unit box costs where the tool is kept clear, roughly."""
        return self.look_clear_at(self.setup_at(point))

    def look_clear_at(self, setup: SetupTable) -> float:
        """Tell what a setup costs where the tool is kept clear, roughly; infinite where that can't be."""
        self.look_at(setup)
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
        """Look again at what is cheap, with the tool kept clear, and from the best one go on.

        Keeping clear only takes postures away, so a setup costs at least about what it costs with nothing in
        the way: the look again ends where that is more than the best one that was kept clear. Where none can
        be, places are scattered on.

        Parameters
        ----------
        calls : how many setups may be looked at in the neighbourhood of the best one
        """
        least, best = np.inf, None
        for tried in self._by_cost("rough"):
            if tried.rough is not None and tried.rough >= least:
                break
            found = self.look_clear_at(tried.setup)
            if found < least:
                least, best = found, tried.setup
        if best is not None:
            return follow_compass(self.look_clear, self.point_of(best), least, calls)
        sides = len(self.ranges)
        for left, point in zip(
            range(calls - 1, -1, -1), halton(SCATTERED * sides + calls, sides)[-calls:], strict=True
        ):
            least = self.look_clear(point)
            if least < np.inf:
                return follow_compass(self.look_clear, point, least, left)
        return None

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """What may be chosen, lowest and highest, mm and deg."""
        return ranges_of(self.job)

    def point_of(self, setup: SetupTable) -> Array:
        """Give a setup's place in the unit box, moved into it."""
        x, y, z = setup.offset
        given = {"x": x, "y": y, "z": z, "angle": setup.rotation[2]}
        shares = [(given[name] - low) / (high - low) for name, (low, high) in self.ranges.items()]
        return np.clip(np.array(shares), 0.0, 1.0)

    def setup_at(self, point: Array) -> SetupTable:
        """Give the setup at a point of the unit box."""
        chosen = {
            name: round(low + float(share) * (high - low), DIGITS) + 0.0
            for share, (name, (low, high)) in zip(point, self.ranges.items(), strict=True)
        }
        given = self.job.setup
        x, y, z = (chosen.get(name, old) for name, old in zip("xyz", given.offset, strict=True))
        turned = (*given.rotation[:2], chosen.get("angle", given.rotation[2]))
        return SetupTable(offset=(x, y, z), rotation=turned)

    @property
    def ranked(self) -> list[Tried]:
        """What can be used, cheapest first; of equals the one that was looked at first."""
        return self._by_cost("rough" if self.clear is None else "clear")

    def _by_cost(self, name: str) -> list[Tried]:
        known = (tried for tried in self.tried.values() if getattr(tried, name) is not None)
        return sorted(known, key=lambda tried: float(getattr(tried, name)))


def ranges_of(job: Job) -> dict[str, tuple[float, float]]:
    """Give what a job's search may choose, by name, mm and deg."""
    limits = limits_of(job)
    return {name: ends for name in SEARCHED if (ends := getattr(limits, name)) is not None}


def limits_of(job: Job) -> SetupSearch:
    """Give the bounds of a job's search.

    Raises
    ------
    JobError
        The job has none.
    """
    if job.setup.search is None:
        raise JobError("setup.search is missing; give ranges of x, y, z or angle", file=job.input)
    return job.setup.search
