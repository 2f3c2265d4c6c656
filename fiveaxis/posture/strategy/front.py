"""Energy against steadiness: solutions between the cheapest path and the smoothest one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import Energy
from fiveaxis.errors import Infeasible, SettingError
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion, follow, peak_rates
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.optimiser import optimise
from fiveaxis.posture.options import DEFAULTS, Options
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution, Stage
from fiveaxis.posture.strategy.given_path import by_travel, refined
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.turns.unwrapped import path_check, with_path
from fiveaxis.progress import Progress
from fiveaxis.toolpath import Constraints, Toolpath

# Ends of the sweep, in multiples of the price at which all bends cost as much as all travel.
FAINTEST, STRONGEST = 0.01, 100.0
# Shortest move, mm, with a meaningful turn per mm.
SHORTEST_MOVE = 1e-3
# Codes of findings about a path's postures (`with_findings`).
OF_POSTURES = ("rapid-speed-unknown", "singular-turn", "singular-crossing", "rotary-slows")


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """One solution of a front.

    Parameters
    ----------
    smoothing : J/rad², price of bends with which it was found
    time_price : W, price of delay with which it was found
    motion, energy : the solution
    cost : J, without a price on bends: travel, and delay at the first point's price
    bend : rad², Σ‖Δρ‖² over all moves except rewinds
    steepest : rad/mm, largest turn of a rotary axis over the path of the pivot in a cutting move
    fastest : rad/s, highest mean speed of a rotary axis in a move
    """

    smoothing: float
    time_price: float
    motion: Motion
    energy: Energy
    cost: float
    bend: float
    steepest: float
    fastest: float

    def as_dict(self) -> dict[str, float]:
        """Return the figures as plain data for JSON, angles in degrees but for ``bend``."""
        return {
            "smoothing_J_rad2": self.smoothing,
            "time_price_W": self.time_price,
            "energy_J": self.energy.total,
            "cost_J": self.cost,
            "bend_rad2": self.bend,
            "steepest_deg_mm": float(np.degrees(self.steepest)),
            "time_s": self.energy.time,
            "fastest_deg_s": float(np.degrees(self.fastest)),
        }


@dataclass(frozen=True, eq=False)
class Front:
    """Solutions none of which is better than another in energy, steadiness and time at once.

    Parameters
    ----------
    points : by increasing energy, or cost with another objective; the first is the solution, the last the
        smoothest
    dominated : how many solutions were left out because another one is better in everything
    solution : the cheapest path found for any point, with its baselines
    others : the solutions of the other points, in their order
    """

    points: tuple[FrontPoint, ...]
    dominated: int
    solution: Solution
    others: tuple[Solution, ...] = ()

    @property
    def solutions(self) -> tuple[Solution, ...]:
        """The solution of each point."""
        return (self.solution, *self.others)

    def pick(self, number: int) -> Solution:
        """Return a solution by its number; 1 is the cheapest, a number too large gives the steadiest."""
        return self.solutions[min(number, len(self.solutions)) - 1]

    def as_dict(self) -> dict[str, Any]:
        """Return the points as plain data for JSON."""
        return {"points": [point.as_dict() for point in self.points], "dominated": self.dominated}


def find_front(
    toolpath: Toolpath,
    machine: Machine,
    constraints: Constraints,
    n: int = 8,
    options: Options = DEFAULTS,
    *,
    smoothest: float | None = None,
) -> Front:
    """Find solutions between the cheapest path and the smoothest one.

    The first is what `optimise` finds, or a cheaper path found during the sweep. The others have an
    increasing price on bends, and on delay if the machine's highest speeds are known. Each is searched for,
    and refined from its neighbours' paths, once in each direction of the sweep; the cheapest of the three is
    kept. A neighbour's path alone may lead to a poor local optimum: a path that is cheap without a price on
    bends needn't become the best steady one. Where a rotary axis has too few turns, this is done with
    unlimited travel, and each path is then rewound; none interrupts more cuts than the first.

    Parameters
    ----------
    toolpath, machine, constraints : as for `optimise`
    n : how many solutions are sought, at least two
    options : as for `optimise`, without `smoothing` and `bound`; the stage ``front`` of its progress counts
        the runs
    smoothest : J/rad², the highest price of bends; by default a hundred times the one at which the first
        solution's bends cost as much as its travel

    Returns
    -------
    The front; solutions that another one beats in energy, bends and time are only counted.

    Raises
    ------
    SettingError
        Fewer than two solutions; a price that isn't positive; ``smoothing`` given.
    Infeasible, MachineError, ToolError, ToolpathError
        As `optimise`.
    """
    if n < 2:
        raise SettingError(f"a front of {n} solutions has no two ends; it needs at least 2")
    if options.smoothing:
        raise SettingError(
            "a front has its own smoothing at each point; give smoothest instead, or leave it out"
        )
    if smoothest is not None and not (np.isfinite(smoothest) and smoothest > 0.0):
        raise SettingError(f"smoothest is {smoothest:g} J/rad²; it must be above 0")
    count_run, of_run = _split_progress(options.progress, 1 + 3 * (n - 1))
    solution = optimise(toolpath, machine, constraints, replace(options, bound=False, progress=of_run))
    count_run()
    cone = Cone.of(constraints)
    problem, start = _solved(solution)
    problems = _priced(problem, _prices(solution, start, n, smoothest), solution)
    is_admissible = _make_check(solution, cone, Mask.of(options.mask))
    effort = options.counts()

    def found(number: int, start: Array | None) -> Array | None:
        of_run("searching" if start is None else "refining", 0, 1)
        problem = problems[number]
        path = by_travel(problem, effort) if start is None else refined(problem, start, effort)
        count_run()
        if path is None or problem.violation(path) > ALLOWED:
            return None
        return path if is_admissible(path) else None

    with threadpool_limits(limits=1):
        paths = _swept(problems, start, found)
    points = [
        _point(solution, rotary, priced, problem) for rotary, priced in zip(paths, problems, strict=True)
    ]
    kept = undominated(points, by_energy=options.objective == "energy")
    solutions = [
        _with_path(solution, paths[points.index(p)], cone, number) for number, p in enumerate(kept, start=1)
    ]
    return Front(tuple(kept), len(points) - len(kept), solutions[0], tuple(solutions[1:]))


def _split_progress(progress: Progress, runs: int) -> tuple[Callable[[], None], Progress]:
    """Return a function that counts the runs of a sweep, and a progress for the stages of one run."""
    done = 0

    def count_run() -> None:
        nonlocal done
        done += 1
        progress("front", done, runs)

    def tell(stage: str, step: int, steps: int) -> None:
        progress(f"front, run {done + 1} of {runs}: {stage}", step, steps)

    return count_run, tell


def _solved(solution: Solution) -> tuple[Problem, Array]:
    """Return the problem that a solution solved, and its path, (n, 2) rad; before rewinds if it has any."""
    unwrapped, problem = solution.unwrapped, solution.problem
    if unwrapped is not None:
        return unwrapped.problem, unwrapped.rotary
    if problem is None or len(problem) != len(solution.toolpath):
        raise SettingError("a front needs a solution with its problem; this one was put together by hand")
    return problem, solution.motion.positions[:, solution.machine.rotary_columns]


def _make_check(solution: Solution, cone: Cone | None, mask: Mask | None) -> Callable[[Array], bool]:
    """Return a check of a path, (n, 2) rad, for what isn't in the problem: cone, mask, interrupted cuts.

    A path that is rewound may interrupt no more cuts than the solution's.
    """
    unwrapped, (problem, start) = solution.unwrapped, _solved(solution)
    path = solution.toolpath if unwrapped is None else unwrapped.toolpath
    if mask is not None:
        # The path has locations between those given.
        along = mask.along(solution.motion.location)
        mask = along if unwrapped is None else mask.wrapped(solution.machine)
    keeps = path_check(path, problem.machine, start, cone, mask)
    most = _interrupted_cuts(solution, start)

    def is_admissible(rotary: Array) -> bool:
        try:
            return keeps(rotary) and _interrupted_cuts(solution, rotary) <= most
        except Infeasible:
            return False

    return is_admissible


def _interrupted_cuts(solution: Solution, rotary: Array) -> int:
    """Count the cuts that a path, (n, 2) rad, interrupts to rewind an axis."""
    rewinds = with_path(solution, rotary)[1]
    return 0 if rewinds is None else sum(r.in_cut for r in rewinds.rewinds)


def _with_path(solution: Solution, rotary: Array, cone: Cone | None, number: int) -> Solution:
    """Return the solution with another path of the front, (n, 2) rad."""
    if np.array_equal(rotary, _solved(solution)[1]):
        return solution
    cheaper = with_path(solution, rotary)[0]
    # Findings about the former path don't apply to this one.
    kept = tuple(f for f in cheaper.toolpath.findings if f.code not in OF_POSTURES)
    status = "cheapest of its paths" if number == 1 else f"solution {number}"
    stage = Stage("front", status, 0, solution.energy.total, cheaper.energy.total)
    path = replace(cheaper.toolpath, findings=kept)
    return with_findings(replace(cheaper, toolpath=path, stages=(*solution.stages, stage)), cone)


def _prices(solution: Solution, start: Array, n: int, smoothest: float | None) -> Array:
    """Compute the price of bends at each point, (n,) J/rad²: 0, then a geometric series."""
    bend = _bend(start)
    # For a path without bends any price will do.
    middle = solution.energy.total / bend if bend > 0.0 else 1.0
    strongest = STRONGEST * middle if smoothest is None else smoothest
    shares = np.linspace(1.0, 0.0, n - 1).tolist()
    return np.array([0.0, *(strongest * (FAINTEST / STRONGEST) ** share for share in shares)])


def _priced(problem: Problem, prices: Array, solution: Solution) -> list[Problem]:
    """Return the problem at each price of bends, (n,) J/rad².

    If speeds are known, the price of delay rises with it: in the middle of the sweep by the mean power of the
    travel.
    """
    time = float(problem.least_time.sum())
    power = solution.energy.total / time if np.isfinite(problem.top_speed).any() and time > 0.0 else 0.0
    share = prices / (prices[-1] / STRONGEST)
    return [
        replace(
            problem,
            bend_price=np.full(len(problem) - 1, price),
            time_price=problem.time_price + power * float(s),
        )
        for price, s in zip(prices, share, strict=True)
    ]


def _swept(
    problems: Sequence[Problem], start: Array, found: Callable[[int, Array | None], Array | None]
) -> list[Array]:
    """Find a path at each price: by a search, and from its neighbours in both directions of the sweep."""
    paths = [start]
    for number in range(1, len(problems)):
        neighbour = paths[-1]
        tried = found(number, neighbour), found(number, None)
        paths.append(_cheapest(problems[number], neighbour, *tried))
    for number in range(len(problems) - 2, -1, -1):
        paths[number] = _cheapest(problems[number], paths[number], found(number, paths[number + 1]))
    # A search for a steady path may find the cheapest of all, as each ends in a local optimum.
    paths[0] = _cheapest(problems[0], *paths)
    return paths


def _cheapest(problem: Problem, known: Array, *tried: Array | None) -> Array:
    """Return the cheapest of paths, of equals the known one."""
    return min([known, *(path for path in tried if path is not None)], key=lambda p: _objective(problem, p))


def _objective(problem: Problem, rotary: Array) -> float:
    """Return the cost of a path, infinite if it isn't admissible."""
    return problem.path_cost(rotary) if problem.violation(rotary) <= ALLOWED else float("inf")


def _point(solution: Solution, rotary: Array, problem: Problem, unpriced: Problem) -> FrontPoint:
    """Evaluate a path, (n, 2) rad; its turns are those without rewinds, which don't cut."""
    other, rewinds = with_path(solution, rotary)
    path = solution.toolpath if solution.unwrapped is None else solution.unwrapped.toolpath
    driven = other.motion if rewinds is None else follow(path, unpriced.machine, rotary)
    turn = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1)
    cuts = path.cutting & (path.lengths > SHORTEST_MOVE)
    cost = unpriced.cost(driven.positions)
    if rewinds is not None:
        cost += rewinds.energy + unpriced.time_price * rewinds.time
    return FrontPoint(
        smoothing=float(problem.bend_price.max(initial=0.0)),
        time_price=problem.time_price,
        motion=other.motion,
        energy=other.energy,
        cost=cost,
        bend=_bend(rotary),
        steepest=float(np.max(turn[cuts] / path.lengths[cuts], initial=0.0)),
        fastest=max(rate.speed for rate in peak_rates(solution.machine, driven).values()),
    )


def _bend(rotary: Array) -> float:
    return float((np.diff(rotary, axis=0) ** 2).sum())


def undominated(points: Sequence[FrontPoint], *, by_energy: bool = False) -> list[FrontPoint]:
    """Return the points that no other one dominates, cheapest first; of equals the first.

    Parameters
    ----------
    by_energy : whether the cheapest takes the least energy of the program
    """
    costs = [p.energy.total if by_energy else p.cost for p in points]
    figures = np.array(
        [(c, p.energy.total, p.bend, p.energy.time) for c, p in zip(costs, points, strict=True)]
    )
    kept = []
    for i, own in enumerate(figures):
        beaten = (figures <= own).all(axis=1) & ((figures < own).any(axis=1) | (np.arange(len(figures)) < i))
        if not beaten.any():
            kept.append(points[i])
    return sorted(kept, key=lambda p: p.energy.total if by_energy else p.cost)
