"""From a problem to its best path: search some locations globally, refine, fill in the rest, refine again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.geometry import Array, IntArray
from fiveaxis.posture.local.ipopt import SOLVED
from fiveaxis.posture.local.refinement import STRUCTURED, Refinement, refine
from fiveaxis.posture.masks.clearance import Clearance
from fiveaxis.posture.masks.confinement import Confinement, Solver
from fiveaxis.posture.masks.mask import CheckedStates, clean_path, precomputed
from fiveaxis.posture.masks.replanning import WIDER, Reach, Replanning
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.lattice import (
    SLACK,
    Coordinates,
    Lattice,
    choose_coordinates,
    grid_lattice,
    is_narrow,
    level_lattice,
)
from fiveaxis.posture.search.shortest import LONG, density, refill, shortest_path, thin
from fiveaxis.posture.solution import Baseline, Stage
from fiveaxis.posture.strategy.effort import DEGREE, ROUGH, ROUND, Effort, LatticeSearch
from fiveaxis.posture.strategy.recording import Recorded, side_by_side

T = TypeVar("T")

# Windows around broken bounds; a path with more than this share of broken locations isn't replanned.
BROKEN = tuple(Reach(margin, 200) for margin in (12, 24, 48, 96, 192, 384))
MOST_BROKEN = 0.1
# A search considers at least about this many locations.
LEAST_ROWS = 100
# Stride of the locations to which a searched path is extended before all.
MIDDLE = 4
# Levels between neighbours of a searched path; steps of the corridors in which a path is extended to more
# locations (rad, mm or rad).
LEVEL_REACH, WIDTHS = 3, ((1.0 * DEGREE, 0.25), (0.5 * DEGREE, 0.12))
# Iterations of the NLP on some locations and on all: what converges needs fewer; and IPOPT's first barrier
# parameter, J, from a searched and from an extended start.
COARSE_ITERATIONS, ITERATIONS, COARSE_BARRIER, BARRIER = 100, 120, 1e-1, 4e-2
# IPOPT's iterations on a path that is nearly right: it will be solved again, with other prices.
ROUND_ITERATIONS = 40
# Most searches of a lattice within a mask.
MASKED_SEARCHES = 6
# Rounds of refinement within a mask of a path on some locations, on all, and on all of a long one: the first
# two yield nearly all of the savings.
COARSE_ROUNDS, ROUNDS, LONG_ROUNDS = 1, 4, 2


@dataclass(eq=False)
class Portfolio(Recorded):
    """Searches of some of the locations, each refined; the best is extended to all of them.

    Parameters
    ----------
    problem : what to solve
    effort : how much may be done
    clear : what a mask admits; None without one
    """

    problem: Problem
    effort: Effort
    clear: Clearance | None = None

    def best_path(self, compared: Mapping[str, Baseline]) -> Array:
        """Find the cheapest admissible path, (n, 2) rad, never costlier than an admissible baseline."""
        best: Refinement | None = None
        if len(self.problem) > 1:
            best = self._replanned_once(self._searched(self.effort.searches))
        start = self._cheapest(compared)
        if start is not None:
            name, rotary = start
            if best is None or self._is_worse(best, rotary):
                best = self._refined(f"refine, from baseline {name}", None, rotary)
        if best is None:
            raise Infeasible(
                "every location has an admissible posture, but the search found no sequence of them along "
                "the path; allow larger turns between locations (--max-turn), put the locations closer "
                "together, or widen the tilt range",
                (),
            )
        return best.rotary

    def refined_from(self, name: str, start: Array) -> Array:
        """Refine a path, (n, 2) rad, on all locations; the start itself if that is no improvement."""
        return self._refined(f"refine, from {name}", None, start).rotary

    def refined_near(self, start: Array) -> Array:
        """Refine a path, (n, 2) rad, that is nearly right, within the mask if there is one."""
        few, last = ROUND_ITERATIONS, min(self.effort.last_barrier, ROUND)
        problem, solve = self.problem.eased(start), self._solver(few, last)
        if self.clear is None:
            return solve(problem, start, (False, False))[0]
        return Confinement(problem, self.clear, solve).refined(start, 1)

    def _replanned_once(self, found: Refinement | None) -> Refinement | None:
        """Replan a path around the few locations at which it breaks bounds, and refine it again."""
        if found is None or self.clear is not None or self.problem.violation(found.rotary) <= ALLOWED:
            return found
        path = self._replanned(self.problem, found.rotary)
        before, after = (int(self.problem.broken(p).sum()) for p in (found.rotary, path))
        if after == before:
            return found
        status = f"{before} of {len(path)} locations broke a bound, {after} do now"
        self.stages.append(
            Stage("local replanning", status, before, found.cost, self.problem.path_cost(path))
        )
        return self._refined("refine, replanned", None, path)

    def _searched(self, searches: tuple[LatticeSearch, ...]) -> Refinement | None:
        coordinates = choose_coordinates(self.problem)
        found: dict[int, tuple[IntArray, Refinement]] = {}
        sparser = density(self.problem)
        strides, tasks = [], []
        for number, search in enumerate(searches):
            # A short path is searched more densely: a turn of the wall must not fall between the rows.
            stride = min(search.stride * sparser, max(1, len(self.problem) // LEAST_ROWS))
            rows = thin(self.problem, stride)
            near = replace(search, stride=min(search.stride, stride))
            strides.append((stride, rows))
            tasks.append(
                partial(Portfolio._search, search=near, rows=rows, coordinates=coordinates, number=number)
            )
        for (stride, rows), candidate in zip(strides, self._at_once(tasks), strict=True):
            if candidate is not None and (stride not in found or candidate.cost < found[stride][1].cost):
                found[stride] = rows, candidate
        if not found:
            return None
        middle = np.unique(
            np.concatenate([thin(self.problem, MIDDLE * sparser), *(r for r, _ in found.values())])
        )
        denser = self.problem.thinned(middle)
        starts = self._at_once(
            [
                partial(Portfolio._extended, known=rows, rows=middle, found=r, coordinates=coordinates)
                for rows, r in found.values()
            ]
        )
        start = min(starts, key=denser.priced)
        best = self._refined(f"refine, {len(middle)} locations", middle, start)
        everywhere = np.arange(len(self.problem))
        rotary = self._extended(middle, everywhere, best, coordinates)
        return self._refined("refine, all locations", None, rotary, near=True)

    def _at_once(self, tasks: Sequence[Callable[[Portfolio], T]]) -> list[T]:
        """Run independent tasks, on a long path in threads."""
        # A mask need not be safe for threads.
        if len(self.problem) <= LONG or self.effort.solver != STRUCTURED or self.clear is not None:
            return [task(self) for task in tasks]
        return side_by_side(self, tasks)

    def _search(
        self, search: LatticeSearch, rows: IntArray, coordinates: Coordinates, number: int
    ) -> Refinement | None:
        problem = self.problem.thinned(rows)
        name = f"{len(rows)} locations, {np.degrees(search.step):.3g} deg"
        path = None
        # Far neighbours cost time, and a dense path needs none; one with long moves isn't possible without
        # them. A search within narrow bounds may exceed them, and leaves the rest to the refinement.
        slacks = (0.0, SLACK) if is_narrow(problem) else (0.0,)
        for wider, slack in ((wider, slack) for slack in slacks for wider in WIDER):
            lattice = self.lattice(problem, search, coordinates, wider, slack)
            path = self._shortest(problem, lattice, rows, number)
            if path is not None:
                break
        if path is None:
            return None
        self.stages.append(Stage(f"search, {name}", "found", len(problem), None, problem.cost(path)))
        rotary = path[:, self.problem.machine.rotary_columns]
        return self._refined(f"refine, {name}", rows, rotary, coarse=True)

    def _shortest(self, problem: Problem, lattice: Lattice, rows: IntArray, number: int) -> Array | None:
        """Find the cheapest path through a lattice, within the mask if there is one."""
        if self.clear is None:
            name = f"searching postures, {number + 1}"
            return shortest_path(problem, lattice, partial(self.progress, name))
        clear = self.clear.at(rows)
        lattice = precomputed(clear.priced(lattice, problem.machine.rotary_columns, np.inf), len(rows))
        checked = CheckedStates(clear.mask, clear.rows, problem)
        return clean_path(lattice, checked, MASKED_SEARCHES, or_last=True)

    def lattice(
        self, problem: Problem, search: LatticeSearch, coordinates: Coordinates, wider: int, slack: float
    ) -> Lattice:
        """Make the lattice of a search, with the reach in the second coordinate times `wider`."""
        if coordinates.level is None:
            fixed = problem.machine.axes[coordinates.second_column(problem)].limits.is_fixed
            # With one axis held there are few states, and the other can be searched finely.
            steps = (search.step / (8.0 if fixed else 1.0), 0.75 * search.step)
            first = np.pi if fixed else 4.0 * DEGREE * search.stride
            second = 0.0 if fixed else 2.0 * DEGREE * search.stride
            return grid_lattice(problem, coordinates, steps, (first, second * wider), slack)
        levels = min(LEVEL_REACH * wider, search.levels)
        return level_lattice(problem, coordinates, search.step, search.levels, (np.pi, levels), slack)

    def _extended(
        self, known: IntArray, rows: IntArray, found: Refinement, coordinates: Coordinates
    ) -> Array:
        """Extend a refined path to more locations, (m, 2) rad."""
        path = self.problem.thinned(known).positions(slice(None), found.rotary)
        at = np.searchsorted(rows, known)
        clear = None if self.clear is None else self.clear.at(rows)
        full = refill(self.problem.thinned(rows), coordinates, at, path, WIDTHS, clear=clear)
        return full[:, self.problem.machine.rotary_columns]

    def _refined(
        self, name: str, rows: IntArray | None, start: Array, *, coarse: bool = False, near: bool = False
    ) -> Refinement:
        """Refine a path on some locations, or on all, within the mask if there is one."""
        problem = self.problem if rows is None else self.problem.thinned(rows)
        if self.clear is None:
            return self._unmasked(name, problem, start, coarse=coarse, near=near)
        clear = self.clear if rows is None else self.clear.at(rows)
        most = ROUNDS if len(problem) <= LONG else LONG_ROUNDS
        return self._confined(name, problem, clear, start, most if rows is None else COARSE_ROUNDS)

    def _confined(
        self, name: str, problem: Problem, clear: Clearance, start: Array, rounds: int
    ) -> Refinement:
        """Refine a path within the mask."""
        before = problem.path_cost(start)
        if len(problem) == 1:
            return Refinement(start, before, "one location, nothing to refine", 0)
        if rounds > COARSE_ROUNDS and not clear.admits(start).all():
            return Refinement(start, before, "to be replanned first", 0)
        inside = Confinement(problem.eased(start), clear, self._solver(ITERATIONS, self.effort.last_barrier))
        found = inside.refined(start, rounds)
        cost = problem.path_cost(found)
        status = f"{np.count_nonzero(~clear.admits(found))} of {len(problem)} locations refused"
        self.stages.append(Stage(f"{name}, within the mask", status, inside.iterations, before, cost))
        return Refinement(found, cost, SOLVED, inside.iterations)

    def _solver(self, iterations: int, last: float) -> Solver:
        """Return a function that refines a problem, or a part of it, from a start near its solution."""
        refine_near = partial(
            refine,
            iterations=iterations,
            barrier=BARRIER,
            near=True,
            last=last,
            solver=self.effort.solver,
        )

        def solve(problem: Problem, start: Array, held: tuple[bool, bool]) -> tuple[Array, int]:
            found = refine_near(problem, start, held=held)
            return found.rotary, found.iterations

        return solve

    def _unmasked(self, name: str, problem: Problem, start: Array, *, coarse: bool, near: bool) -> Refinement:
        """Refine a path; where that fails, from a start without broken bounds."""
        everywhere = len(problem) == len(self.problem)
        before = problem.path_cost(start)
        if len(problem) == 1:
            return Refinement(start, before, "one location, nothing to refine", 0)
        problem = problem.eased(start)
        solve = partial(
            refine,
            iterations=ITERATIONS if everywhere else COARSE_ITERATIONS,
            barrier=COARSE_BARRIER if coarse else BARRIER,
            last=self.effort.last_barrier if everywhere else ROUGH,
            solver=self.effort.solver,
        )
        found = solve(problem, start, near=near)
        if near and found.status != SOLVED:
            found = solve(problem, found.rotary)
        self.stages.append(Stage(name, found.status, found.iterations, before, found.cost))
        unbroken = start if coarse or found.status == SOLVED else self._unbroken(problem, start)
        if unbroken is not start:
            found = solve(problem, unbroken)
            name = f"{name}, replanned start"
            self.stages.append(Stage(name, found.status, found.iterations, before, found.cost))
        self.progress("refining postures", 0, 1)
        return found

    def _unbroken(self, problem: Problem, start: Array) -> Array:
        """Replan a start, (n, 2) rad, that the refinement couldn't fix; the start unless all is kept then."""
        if not problem.broken(start).any():
            return start
        path = self._replanned(problem, start)
        return start if problem.broken(path).any() else path

    def _replanned(self, problem: Problem, path: Array) -> Array:
        """Replan a path around the locations at which it breaks a bound."""
        return Replanning(problem, self.lattice, WIDTHS).replanned(path, BROKEN, MOST_BROKEN)

    def _cheapest(self, compared: Mapping[str, Baseline]) -> tuple[str, Array] | None:
        """Find the name and rotary angles of the cheapest baseline that keeps all bounds."""
        columns = self.problem.machine.rotary_columns
        paths = {name: baseline.motion.positions[:, columns] for name, baseline in compared.items()}
        kept = [name for name, path in paths.items() if self.problem.violation(path) <= ALLOWED]
        name = min(kept, key=lambda n: self.problem.cost(compared[n].motion.positions), default=None)
        return None if name is None else (name, paths[name])

    def _is_worse(self, found: Refinement, rotary: Array) -> bool:
        violation = self.problem.violation(found.rotary)
        return violation > ALLOWED or found.cost > self.problem.path_cost(rotary)
