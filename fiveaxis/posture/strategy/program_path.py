"""A path and the program that comes of it: its blocks, what they cost, and what they break."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, IntArray, Severity
from fiveaxis.model import BlockCosts, Energy, TiltBounds, Toolpath
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem

# Violation that is tolerated between two locations (cosine, mm, rad).
BETWEEN = 2e-4
# No planes that confine a path.
FREE: Array = np.empty((0, 0))


@dataclass(frozen=True, eq=False)
class Instance:
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

    @property
    def own(self) -> BoolArray:
        """(n,), whether it is one of the given path's locations."""
        return self.location == np.floor(self.location)


@dataclass(frozen=True)
class Breach:
    """What a path breaks between its locations.

    The hop is the smallest turn, rad, of a given move in which the tool leans out of its bounds, infinite for
    none; the overrun, mm or rad, is the farthest beyond an axis limit.
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
    def inserted(self) -> int:
        """Number of locations that the program needs in addition to those that were solved."""
        return len(self.denser.path) - len(self.instance.path)

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

    @property
    def starts_and_travel(self) -> tuple[int, float]:
        """Key by which the steadier of two is smaller: starts and reversals, then the travel metric."""
        return self.energy.steadiness.events, self.energy.travel

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
    """What a search of all postures found.

    Parameters
    ----------
    instance, few : the locations of a path, and those of them that were searched
    costs : of the blocks between the few
    path : (m, 2), rad, refined on the few; empty before a search
    rank : key by which the better of two is smaller: how many postures a mask refuses, then the cost of the
        blocks between the few, J, with the price of what they break
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
