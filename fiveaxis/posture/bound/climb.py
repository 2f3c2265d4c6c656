"""How finely a path is bounded, so that a fixed amount of work gives a high bound.

A finer lattice, closer enclosures of the postures and more visits raise the bound, each by more or less. They
are tried on coarse levels first; then the work that is left goes into the level that promises most.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

# The first level: rad, steps of its lattice, with its number of cells in a step, and its number of visits.
FIRST_STEP, FIRST_CELLS, FIRST_VISITS = np.radians(16.0), 4, 60
# Steps of a finer lattice, in times of those before; cells that a step of closer enclosures has more.
FINER, CLOSER = 0.7, 2
# Least growth of the work by a step of each kind.
COSTS = {"finer": 1.6, "closer": 1.05, "denser": 1.8}
# Growth of the logarithm of that of a finer lattice, from a step to the next.
DEARER = 0.1
# Share of the work for trying each kind of step; of what is left then, that a level may be expected to take.
TRIED, USED = 0.15, 0.9
# What each further step gives, in times of the one before.
FADING = {"finer": 0.7, "closer": 0.5, "denser": 0.7}
# Steps that are taken at once; closer enclosures are also given up for a finer lattice.
AT_ONCE = {"closer": range(-2, 5), "denser": range(5)}
# Corners of a visit, and cells of the rotary angles, that fit into memory; how many times as many a finer
# lattice has.
MOST_CORNERS, MOST_CELLS = 4e7, 5e5
MORE_CORNERS = 4.0
# Share by which a level has to promise to raise the bound.
WORTHWHILE = 2e-3


@dataclass(frozen=True)
class Crossed:
    """What it costs at least to cross all visits, J; infinite if some location has no admissible posture.

    Work, in times of a source, is what was looked at; a visit has at most so many corners, and the rotary
    angles so many cells.
    """

    total: float
    work: int
    most: int
    cells: int


class Steps(NamedTuple):
    """Steps from one level to another, of each kind; a finer lattice also by parts of a step."""

    finer: float = 0.0
    closer: int = 0
    denser: int = 0


ONE_FINER = Steps(finer=1.0)


@dataclass(frozen=True)
class Level:
    """How finely a path is bounded.

    The lattice's rotary angles have steps, rad, each divided into cells of postures; visits have a stride.
    """

    step: float
    cells: int
    stride: int

    @classmethod
    def first(cls, count: int) -> Level:
        """Begin coarsely, for a number of locations."""
        return cls(FIRST_STEP, FIRST_CELLS, max(count // FIRST_VISITS, 1))

    def after(self, steps: Steps) -> Level:
        """Take steps: a finer lattice, more cells in each of its steps, half the stride."""
        return Level(
            self.step * FINER**steps.finer,
            self.cells + CLOSER * steps.closer,
            max(self.stride >> steps.denser, 1),
        )


@dataclass
class Climb:
    """Levels whose bounds are known, and what steps of each kind gave; `most` is the work in all.

    A step makes the work grow by its cost, and the logarithm of the bound by its rate times that of the cost.
    """

    bound: Callable[[Level], Crossed]
    most: float
    known: dict[Level, Crossed] = field(default_factory=dict)
    rates: dict[str, float] = field(default_factory=lambda: dict.fromkeys(COSTS, np.inf))
    costs: dict[str, float] = field(default_factory=COSTS.copy)

    def best(self, first: Level) -> tuple[Level, Crossed]:
        """Climb from a first level, and find the highest bound."""
        self.known[first], here = self.bound(first), first
        # Where boxes are wider than the path, nothing has to be travelled from one to another.
        while self.known[here].total == 0.0 and self._is_possible(here, ONE_FINER):
            here = here.after(ONE_FINER)
            self.known[here] = self.bound(here)
        if 0.0 < self.known[here].total < np.inf:
            self._try(here)
            while self._leap():
                pass
        best = max(self.known, key=lambda level: self.known[level].total)
        return best, self.known[best]

    @property
    def _spent(self) -> float:
        return sum(each.work for each in self.known.values())

    def _try(self, here: Level) -> None:
        """Take single steps of the kind that gives most, and learn what they give."""
        while True:
            kinds = [kind for kind in COSTS if self._is_possible(here, Steps(**{kind: 1}))]
            kind = max(kinds, key=self.rates.__getitem__, default=None)
            if kind is None or self.rates[kind] < WORTHWHILE:
                return
            there = here.after(Steps(**{kind: 1}))
            if there in self.known:
                here = there
                continue
            before, found = self.known[here], self.bound(there)
            self.known[there] = found
            if found.total == np.inf:
                return
            self.costs[kind] = max(found.work / before.work, COSTS[kind])
            self.rates[kind] = math.log(max(found.total / before.total, 1.0)) / math.log(self.costs[kind])

    def _leap(self) -> bool:
        """Put the work that is left into the level that promises most; False if none promises enough."""
        best = max(found.total for found in self.known.values())
        left = USED * (self.most - self._spent)
        if best == np.inf or left <= 0.0:
            return False
        promises = {
            (level, steps): self.known[level].total * math.exp(self._gain(steps))
            for level in self.known
            for steps in self._reachable(level, left)
        }
        level, steps = max(promises, key=promises.__getitem__, default=(None, Steps()))
        if level is None or promises[level, steps] < (1.0 + WORTHWHILE) * best:
            return False
        there = level.after(steps)
        self.known[there] = self.bound(there)
        # What was promised too high here is promised too high elsewhere.
        gained = math.log(max(self.known[there].total / self.known[level].total, 1.0))
        kept = min(gained / self._gain(steps), 1.0)
        self.rates = {kind: kept * rate for kind, rate in self.rates.items()}
        return True

    def _gain(self, steps: Steps) -> float:
        """Tell by how much steps are to raise the logarithm of the bound."""
        gain = 0.0
        for kind, count in steps._asdict().items():
            if count != 0 and np.isfinite(self.rates[kind]):
                times = (1.0 - FADING[kind] ** abs(count)) / (1.0 - FADING[kind])
                gain += np.sign(count) * times * self.rates[kind] * math.log(self.costs[kind])
        return gain

    def _reachable(self, level: Level, left: float) -> Iterator[Steps]:
        """Combine steps from a level that use the work that is left, a finer lattice the rest of it."""
        found = self.known[level]
        for closer, denser in itertools.product(*AT_ONCE.values()):
            steps = Steps(0.0, closer, denser)
            if level.stride >> denser == 0 or level.after(steps).cells < 1:
                continue
            work = found.work * self.costs["closer"] ** max(closer, 0) * self.costs["denser"] ** denser
            cells = found.cells * (level.after(steps).cells / level.cells) ** 2
            finer = min(
                self._finer(math.log(left / work)),
                math.log(MOST_CORNERS / found.most) / math.log(MORE_CORNERS),
                math.log(MOST_CELLS / cells) / math.log(FINER**-2),
            )
            if finer >= 0.0 and level.after(steps._replace(finer=finer)) not in self.known:
                yield steps._replace(finer=finer)

    def _finer(self, work: float) -> float:
        """Compute how many steps of a finer lattice make the logarithm of the work grow by so much."""
        half = 0.5 * (math.log(self.costs["finer"]) + 0.5 * DEARER)
        return float((np.sqrt(half**2 + 0.5 * DEARER * work) - half) / (0.5 * DEARER)) if work > 0.0 else -1.0

    def _is_possible(self, level: Level, steps: Steps) -> bool:
        """Check that steps lead to another level, with the work that is left for trying."""
        there, left = level.after(steps), TRIED * self.most - self._spent
        work = self.known[level].work * np.prod([self.costs[k] ** n for k, n in steps._asdict().items()])
        return there != level and (there in self.known or work <= left)
