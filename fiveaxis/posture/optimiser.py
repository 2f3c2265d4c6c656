"""The optimiser: search a few locations globally, refine, fill in more, refine again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible, ToolpathError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import find_baselines
from fiveaxis.posture.lattice import (
    Coordinates,
    Lattice,
    choose_coordinates,
    grid_lattice,
    level_lattice,
)
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.reach import unreachable
from fiveaxis.posture.refine import SOLVED, Refinement, refine, refine_windows
from fiveaxis.posture.search import refill, shortest_path, thin
from fiveaxis.posture.solution import Baseline, Solution, Stage
from fiveaxis.toolpath import Toolpath, for_tilt, tilt_bounds

Progress = Callable[[str, int, int], None]

DEGREE = np.pi / 180.0
# Links may turn this many times as far as cuts: nothing is touched there.
LINK_SHARE = 3.0
# How many times as far as usual the neighbours of a search lie, one try after the other.
WIDER = (1, 4, 12)
# A search looks at no fewer locations than about this.
LEAST_ROWS = 100


@dataclass(frozen=True)
class Search:
    """One search of the portfolio.

    Parameters
    ----------
    stride : it looks at every stride-th location
    step : rad, grid of the spin angle
    levels : how many levels the dear axis's range is cut into
    """

    stride: int
    step: float
    levels: int


@dataclass(frozen=True)
class Budget:
    """How much the optimiser may do: counts, never seconds, so that every run gives the same numbers.

    Parameters
    ----------
    searches : the portfolio; each search's path is refined on its own locations
    middle : the best of each stride go on to every middle-th location
    kept : how many of them, by their cost there, are refined
    level_reach : levels between neighbours of a searched path
    widths : steps of the tubes in which a path is extended to more locations (rad, mm or rad)
    coarse_iterations, iterations : of the NLP, on some locations and on all; what converges at all does so
        sooner
    coarse_barrier, barrier : IPOPT's first barrier parameter, from a searched and from an extended start
    whole : locations up to which the NLP takes a path at once; the windows take a longer one, and one on
        which it didn't converge
    window : locations in a window
    window_iterations : of the NLP in a window
    """

    searches: tuple[Search, ...] = (
        Search(12, 4.0 * DEGREE, 36),
        Search(8, 4.0 * DEGREE, 36),
        Search(24, 6.0 * DEGREE, 36),
    )
    middle: int = 4
    kept: int = 2
    level_reach: int = 3
    widths: tuple[tuple[float, float], ...] = (
        (1.0 * DEGREE, 0.25),
        (1.0 * DEGREE, 0.25),
        (0.5 * DEGREE, 0.12),
    )
    coarse_iterations: int = 100
    iterations: int = 120
    coarse_barrier: float = 1e-1
    barrier: float = 1e-2
    whole: int = 5000
    window: int = 150
    window_iterations: int = 150


def optimise(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: tuple[float, float] | None = None,
    cone: float | None = None,
    up_penalty: float = 0.0,
    max_turn: float | None = 15.0,
    budget: Budget | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Choose the rotary angles of every cutter location so that the feed drives spend the least energy.

    The travel metric ``Σ W⁺Δq⁺ + W⁻Δq⁻`` is minimised within the tilt range and the axis limits. A portfolio
    of global searches on some of the locations gives starts; each is refined by the exact NLP, and the best
    are extended to all locations and refined there. The result is the best local optimum found, not proven
    global.

    Parameters
    ----------
    toolpath : cutter locations
    machine : two rotary and three linear axes, all with powers
    tilt : smallest and largest angle between tool axis and surface normal, **degrees**
    cone : largest angle between tool axis and programmed axis, **degrees**, in place of `tilt`
    up_penalty : J/mm, extra price of the machine's Z moving up
    max_turn : largest turn of a rotary axis in one cutting move, **degrees**; None for no bound. Without one
        the travel metric, which knows no rates and sees locations only, hops over inadmissible postures from
        one location to the next, which a control driving the axes would not. Links turn three times as far,
        and farther only where there is no other way
    budget : how much may be done; the default is meant for everyday use
    progress : called with a stage's name, steps done and steps in all

    Returns
    -------
    The solution with its baselines and a record of what the solver did.

    Raises
    ------
    Infeasible
        Some locations have no admissible posture; each is listed with its reason.
    MachineError
        The machine has no powers, or too few axes.
    ToolError, ToolpathError
        The cutter doesn't touch with one part of its profile over the range; the path lacks the direction
        that the range refers to.
    SettingError
        A range that is empty or reversed.
    """
    if not toolpath.cutting.any():
        raise ToolpathError("has links only; there is no cut to choose a posture for", file=toolpath.name)
    toolpath = for_tilt(toolpath, tilt, cone)
    bounds = tilt_bounds(toolpath, tilt, cone)
    turn = None if max_turn is None else float(np.radians(max_turn))
    problem = Problem.build(
        toolpath,
        machine,
        bounds,
        up_penalty=up_penalty,
        max_turn=turn,
        link_turn=None if turn is None else LINK_SHARE * turn,
    )
    blocked = unreachable(toolpath, machine, bounds)
    if blocked:
        share = f"{len(blocked)} of {len(toolpath)} locations"
        raise Infeasible(f"{share} have no admissible posture on {machine.name}", blocked)
    compared, missing = find_baselines(toolpath, machine, bounds)
    run = _Run(problem, budget or Budget(), progress)
    # IPOPT's linear solver works on small blocks: threads of the BLAS under it only wait for each other.
    with threadpool_limits(limits=1):
        rotary = run.best_path(compared)
    _require_admissible(problem, rotary, toolpath)
    motion = follow(toolpath, machine, rotary)
    energy = motion_energy(machine, motion)
    return Solution(machine, toolpath, bounds, motion, energy, compared, missing, tuple(run.stages))


@dataclass(eq=False)
class _Run:
    """One optimisation under way: the problem, and the stages so far."""

    problem: Problem
    budget: Budget
    progress: Progress | None
    stages: list[Stage] = field(default_factory=list)

    def best_path(self, compared: Mapping[str, Baseline]) -> Array:
        """Find the cheapest admissible path, (n, 2) rad, never dearer than an admissible baseline."""
        best: Refinement | None = None
        if len(self.problem) > 1:
            best = self._searched()
        start = self._cheapest(compared)
        if start is not None and (best is None or self._is_worse(best, start)):
            name, rotary = start
            best = self._refined(f"refine, from baseline {name}", self.problem, rotary)
        if best is None:
            raise Infeasible(
                "no way along the path was found: every location has an admissible posture, but the search "
                "found no sequence of them; allow larger turns between locations (--max-turn), put the "
                "locations closer together, or widen the tilt range",
                (),
            )
        return best.rotary

    def _searched(self) -> Refinement | None:
        coordinates = choose_coordinates(self.problem)
        found: dict[int, tuple[IntArray, Refinement]] = {}
        for number, search in enumerate(self.budget.searches):
            # A short path is searched more densely: a turn of the wall must not fall between the rows.
            stride = min(search.stride, max(1, len(self.problem) // LEAST_ROWS))
            rows = thin(self.problem, stride)
            candidate = self._search(replace(search, stride=stride), rows, coordinates, number)
            if candidate is None:
                continue
            if stride not in found or candidate.cost < found[stride][1].cost:
                found[stride] = rows, candidate
        if not found:
            return None
        middle = np.unique(
            np.concatenate([thin(self.problem, self.budget.middle), *(r for r, _ in found.values())])
        )
        denser = self.problem.thinned(middle)
        starts = [self._carried(rows, middle, r, coordinates) for rows, r in found.values()]
        starts.sort(key=denser.priced)
        name = f"refine, {len(middle)} locations"
        halfway = [self._refined(name, denser, start) for start in starts[: self.budget.kept]]
        best = min(halfway, key=lambda r: denser.priced(r.rotary))
        everywhere = np.arange(len(self.problem))
        rotary = self._carried(middle, everywhere, best, coordinates)
        return self._refined("refine, all locations", self.problem, rotary)

    def _search(
        self, search: Search, rows: IntArray, coordinates: Coordinates, number: int
    ) -> Refinement | None:
        problem = self.problem.thinned(rows)
        name = f"{len(rows)} locations, {np.degrees(search.step):g} deg"
        path = None
        # Far neighbours cost time, and a dense path needs none; one with long moves has no way without them.
        for wider in WIDER:
            lattice = self._lattice(problem, search, coordinates, wider)
            path = shortest_path(problem, lattice, self._tell(f"search {number + 1}"))
            if path is not None:
                break
        if path is None:
            return None
        self.stages.append(Stage(f"search, {name}", "found", len(problem), None, problem.cost(path)))
        rotary = path[:, self.problem.machine.rotary_columns]
        return self._refined(f"refine, {name}", problem, rotary, coarse=True)

    def _lattice(self, problem: Problem, search: Search, coordinates: Coordinates, wider: int) -> Lattice:
        """Lay the lattice of a search whose neighbours in the second coordinate lie so many times as far."""
        if coordinates.level is None:
            steps = (search.step, 0.75 * search.step)
            reach = (4.0 * DEGREE * search.stride, 2.0 * DEGREE * search.stride * wider)
            return grid_lattice(problem, coordinates, steps, reach)
        levels = min(self.budget.level_reach * wider, search.levels)
        return level_lattice(problem, coordinates, search.step, search.levels, (np.pi, levels))

    def _carried(self, known: IntArray, rows: IntArray, found: Refinement, coordinates: Coordinates) -> Array:
        """Carry a refined path over to more locations, (m, 2) rad."""
        path = self.problem.thinned(known).positions(slice(None), found.rotary)
        at = np.searchsorted(rows, known)
        full = refill(self.problem.thinned(rows), coordinates, at, path, self.budget.widths)
        return full[:, self.problem.machine.rotary_columns]

    def _refined(self, name: str, problem: Problem, start: Array, *, coarse: bool = False) -> Refinement:
        """Refine a path as a whole, and window by window where that is too much or doesn't converge."""
        budget = self.budget
        barrier = budget.coarse_barrier if coarse else budget.barrier
        limit = budget.iterations if len(problem) == len(self.problem) else budget.coarse_iterations
        before = problem.cost(problem.positions(slice(None), start))
        if len(problem) == 1:
            return Refinement(start, before, "one location, nothing to refine", 0)
        found = Refinement(start, before, "", 0)
        problem = problem.eased(start)
        if len(problem) <= budget.whole:
            found = refine(problem, start, iterations=limit, barrier=barrier)
            self.stages.append(Stage(name, found.status, found.iterations, before, found.cost))
        if found.status != SOLVED and len(problem) > 2:
            whole = found.cost
            found = refine_windows(
                problem,
                found.rotary,
                size=budget.window,
                iterations=budget.window_iterations,
                barrier=barrier,
            )
            self.stages.append(
                Stage(f"{name}, in windows", found.status, found.iterations, whole, found.cost)
            )
        if self.progress is not None:
            done = sum(stage.name.startswith("refine") for stage in self.stages)
            self.progress("refine", done, max(done, len(budget.searches) + budget.kept + 1))
        return found

    def _cheapest(self, compared: Mapping[str, Baseline]) -> tuple[str, Array] | None:
        """Name the cheapest baseline that keeps all bounds, with its rotary angles."""
        columns = self.problem.machine.rotary_columns
        paths = {name: baseline.motion.positions for name, baseline in compared.items()}
        kept = {n: p for n, p in paths.items() if self.problem.violation(p[:, columns]) <= ALLOWED}
        if not kept:
            return None
        name = min(kept, key=lambda n: self.problem.cost(kept[n]))
        return name, kept[name][:, columns]

    def _is_worse(self, found: Refinement, start: tuple[str, Array]) -> bool:
        if self.problem.violation(found.rotary) > ALLOWED:
            return True
        return found.cost > self.problem.cost(self.problem.positions(slice(None), start[1]))

    def _tell(self, stage: str) -> Callable[[int, int], None] | None:
        progress = self.progress
        return None if progress is None else lambda done, total: progress(stage, done, total)


def _require_admissible(problem: Problem, rotary: Array, toolpath: Toolpath) -> None:
    """Refuse to hand out a path that breaks a bound, naming the places.

    Raises
    ------
    Infeasible
        Tilt, limit or rotary step broken somewhere by more than rounding.
    """
    positions, excess = problem.placed(slice(None), rotary)
    turned = np.concatenate([[0.0], problem.turn_excess(rotary)])
    broken = {
        "the tilt range": excess > ALLOWED,
        "an axis limit": problem.limit_excess(positions) > ALLOWED,
        "the largest rotary step": turned > ALLOWED,
    }
    findings = [
        Finding(
            Severity.ERROR,
            "no-posture",
            f"no posture was found that keeps {what} and joins its neighbours; allow larger turns "
            "(--max-turn), put the locations closer together, or widen the tilt range",
            toolpath.place(int(row)),
        )
        for what, rows in broken.items()
        for row in np.flatnonzero(rows)
    ]
    if findings:
        raise Infeasible(f"{len(findings)} locations have no admissible posture in sequence", findings)
