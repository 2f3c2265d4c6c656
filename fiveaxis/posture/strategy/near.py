"""What is done near a path on the locations of its program, and away from all paths, within mask and cone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.energy import BlockCosts
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.posture.local.refinement import refine
from fiveaxis.posture.masks.confinement import Confinement
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import Admits, Grain, Holding, cheapest_path, paths_anywhere
from fiveaxis.posture.strategy.effort import Effort, grain
from fiveaxis.posture.strategy.program_path import Posed
from fiveaxis.posture.strategy.singular import Cone, bounded_within, turning_within

# IPOPT's iterations and first barrier parameter, J, near a path; and the structured method's last one of a
# path that will be solved again, with other prices.
ITERATIONS, BARRIER, LAST = 40, 4e-2, 1e-5
# The same where a path is only searched, and for the last time.
MORE_ITERATIONS = 120
# States by which a path of little travel is searched: it is a start.
ENOUGH = 300
# Cells of the costliest axis are larger where prices are in proportion to travel: few levels are worth it.
COARSER = 4.0
# The corridor in which a path is extended from some of the locations to all, and how often.
EXTENDED, MOST_EXTENDED = grain(0.3, 1.0, 24, 6.0), 3


@dataclass(frozen=True, eq=False)
class Near:
    """Refinements and searches of posed locations.

    Parameters
    ----------
    effort : with the solver and its last barrier
    cone : in which the first rotary axis is bounded; None without one
    mask : that postures have to pass; None without one
    """

    effort: Effort
    cone: Cone | None
    mask: Mask | None

    def refined(self, posed: Posed, problem: Problem, start: Array) -> Array:
        """Solve a problem, which has other prices than `posed`, near a start, (n, 2) rad."""
        problem = self._within_cone(posed, problem, start).eased(start)
        last = min(self.effort.last_barrier, LAST)

        def solve(problem: Problem, start: Array, held: tuple[bool, bool]) -> Array:
            return refine(
                problem,
                start,
                iterations=ITERATIONS,
                barrier=BARRIER,
                held=held,
                near=True,
                last=last,
                solver=self.effort.solver,
            ).rotary

        if self.mask is None:
            return solve(problem, start, (False, False))
        return Confinement(problem, self.mask.along(posed.location), solve).refined(start)

    def searched(
        self, posed: Posed, costs: BlockCosts, grain: Grain, start: Array, free: BoolArray | None = None
    ) -> Array:
        """Search a corridor about a start, (n, 2) rad, where that is free to change."""
        admits = None if self.mask is None else self.mask.along(posed.location).admits
        found = cheapest_path(posed.problem, costs, grain, start, free, admits, self._holding(posed))
        return start if found is None else found

    def by_travel(self, posed: Posed) -> Array | None:
        """Search the whole range of postures by travel; see `by_travel`."""
        mask = None if self.mask is None else self.mask.along(posed.location)
        few = replace(self.effort.everywhere, states=min(self.effort.everywhere.states, ENOUGH))
        effort, admits = replace(self.effort, everywhere=few), None if mask is None else mask.roughly_admits
        return by_travel(posed.problem, effort, admits)

    def found_anywhere(self, posed: Posed, costs: BlockCosts, grain: Grain) -> list[Array]:
        """Search the whole range of postures."""
        mask = None if self.mask is None else self.mask.along(posed.location)
        admits = None if mask is None else mask.roughly_admits
        return paths_anywhere(posed.problem, costs, grain, admits, self._holding(posed))

    def refused(self, posed: Posed, rotary: Array) -> BoolArray:
        """Find the postures, (n, 2) rad, that the mask refuses; (n,)."""
        if self.mask is None:
            return np.zeros(len(rotary), dtype=bool)
        return ~self.mask.along(posed.location).admits(np.arange(len(rotary)), rotary)

    def turned(self, posed: Posed, rotary: Array) -> float:
        """Sum how far the first rotary axis turns too far within the cone on a path, (n, 2) rad; rad."""
        if self.cone is None:
            return 0.0
        machine, path = posed.problem.machine, posed.path
        moves = turning_within(path, machine, rotary, self.cone)
        most = self.cone.rate * path.lengths[1:]
        return float((np.abs(np.diff(rotary[:, 0])) - most)[moves].sum())

    def _holding(self, posed: Posed) -> Holding | None:
        if self.cone is None:
            return None
        most = np.where(posed.path.cutting[1:], self.cone.rate * posed.path.lengths[1:], np.inf)
        return Holding(self.cone.angle, most)

    def _within_cone(self, posed: Posed, problem: Problem, start: Array) -> Problem:
        if self.cone is None:
            return problem
        problem = bounded_within(problem, posed.path, start, self.cone)
        turned = np.abs(np.diff(start, axis=0))
        return replace(problem, max_turn=np.maximum(problem.max_turn, turned))


def by_travel(problem: Problem, effort: Effort, admits: Admits | None = None) -> Array | None:
    """Search the whole range of postures for the path that travels least, and refine it if there is no mask.

    Parameters
    ----------
    admits : what a mask admits

    Returns
    -------
    (n, 2), rad; None where no sequence of postures was found. It may break bounds
    """
    costs = BlockCosts.of_travel(problem.plus, problem.minus)
    grain = replace(effort.everywhere, level=COARSER * effort.everywhere.level, both_ways=False)
    paths = paths_anywhere(problem, costs, grain, admits)
    if not paths:
        return None
    (found,) = paths
    for _ in range(MOST_EXTENDED):
        if problem.violation(found) <= ALLOWED:
            break
        extended = cheapest_path(problem, costs, EXTENDED, found, admits=admits)
        if extended is None:
            break
        found = extended
    return found if admits else refined(problem, found, effort)


def refined(problem: Problem, start: Array, effort: Effort) -> Array:
    """Refine a path, (n, 2) rad; the start itself if that is no improvement."""
    return refine(
        problem.eased(start),
        start,
        iterations=MORE_ITERATIONS,
        barrier=BARRIER,
        last=effort.last_barrier,
        solver=effort.solver,
    ).rotary
