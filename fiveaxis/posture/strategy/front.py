"""Energy against steadiness: solutions between the cheapest path and the smoothest one."""

from __future__ import annotations

import itertools
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
from fiveaxis.posture.masks.mask import MaskFunction
from fiveaxis.posture.optimiser import optimise
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Solution, Stage
from fiveaxis.posture.strategy.effort import effort_of
from fiveaxis.posture.strategy.portfolio import Portfolio, Progress
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.turns.unwrapped import path_check, with_path, wrap_mask
from fiveaxis.toolpath import Constraints, Toolpath

# The price at which all bends cost as much as all travel is the middle of the sweep: from a hundredth of it …
FAINTEST = 0.01
# … to this many times as much.
STRONGEST = 100.0
# A way shorter than this, mm, tells no turn per mm.
SHORTEST_WAY = 1e-3
# Codes of findings about a path's postures (`with_findings`).
OF_POSTURES = ("rapid-speed-unknown", "singular-turn", "singular-crossing", "rotary-slows")


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """One solution of a front.

    Parameters
    ----------
    smoothing : J/rad², price of bends that it was found with
    time_price : W, price of delay that it was found with
    motion, energy : the solution
    cost : J, of the path without a price on bends: travel, and delay at the price it has at the first point
    bend : rad², Σ‖Δρ‖² over all moves but those on which an axis is turned back
    steepest : rad/mm, largest turn of a rotary axis over the way of the pivot in a cutting move
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
    points : by growing cost, which is the energy where time has no price; the first is the solution, the last
        the smoothest
    dominated : how many solutions were found that another one beats in everything
    solution : the cheapest path that was found for any point, with its baselines
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
        """Give a solution by its number, from 1, the cheapest; the steadiest where there aren't so many."""
        return self.solutions[min(number, len(self.solutions)) - 1]

    def as_dict(self) -> dict[str, Any]:
        """Return the points as plain data for JSON."""
        return {"points": [point.as_dict() for point in self.points], "dominated": self.dominated}


def find_front(
    toolpath: Toolpath,
    machine: Machine,
    constraints: Constraints,
    n: int = 8,
    *,
    smoothest: float | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Front:
    """Find solutions between the cheapest path and the smoothest one asked for.

    The first is what `optimise` finds, or a cheaper path met on the way. The others have a growing price on
    bends, and on delay where the machine's highest speeds are known. Each is searched for, and refined from
    its neighbours' paths, once on the way up and once on the way down; the cheapest of the three is kept. A
    path from a neighbour alone may lie in a poor valley: what is cheap without a price on bends needn't
    become the best steady path. Where a rotary axis has too few turns all this is done without end, and each
    path is then rewound; none interrupts more cuts than the first.

    Parameters
    ----------
    toolpath, machine, constraints : as for `optimise`
    n : how many solutions are looked for, at least two
    smoothest : J/rad², the highest price of bends; by default a hundred times the one at which the first
        solution's bends cost as much as its travel
    progress : as for `optimise`; the stage ``front`` tells how far the whole is
    options : further keywords of `optimise`, but for ``smoothing``

    Returns
    -------
    The front: solutions that another one beats in energy, bends and time are left out and counted.

    Raises
    ------
    SettingError
        Fewer than two solutions; a price that isn't positive; ``smoothing`` given.
    Infeasible, MachineError, ToolError, ToolpathError
        As `optimise`.
    """
    if n < 2:
        raise SettingError(f"a front of {n} solutions has no two ends; ask for at least 2")
    if "smoothing" in options:
        raise SettingError(
            "a front has a smoothing of its own at each point; give smoothest, or leave it out"
        )
    if smoothest is not None and not (np.isfinite(smoothest) and smoothest > 0.0):
        raise SettingError(f"smoothest is {smoothest:g} J/rad²; it must be above 0")
    tell, of_point = _telling(progress, 1 + 3 * (n - 1))
    solution = optimise(toolpath, machine, constraints, progress=of_point, **options)
    tell()
    cone = Cone.of(constraints)
    posed, start = _posed(solution)
    problems = _priced(posed, _shares(solution, start, n, smoothest), solution)
    allowed = _allowing(solution, start, cone, options.get("mask"))
    effort = effort_of(options.get("effort", "normal"))
    effort = replace(effort, solver=options.get("solver", effort.solver))

    def found(number: int, start: Array | None) -> Array | None:
        run = Portfolio(problems[number], effort, of_point)
        tell()
        try:
            path = (
                run.best_path({}) if start is None else run.refined_from(f"point {number + 1} of {n}", start)
            )
        except Infeasible:
            return None
        return path if allowed(path) else None

    with threadpool_limits(limits=1):
        paths = _swept(problems, start, found)
    points = [
        _point(solution, rotary, problem, posed) for rotary, problem in zip(paths, problems, strict=True)
    ]
    kept = undominated(points)
    led = [_led_by(solution, paths[points.index(p)], cone, number) for number, p in enumerate(kept, start=1)]
    return Front(tuple(kept), len(points) - len(kept), led[0], tuple(led[1:]))


def _telling(progress: Progress | None, runs: int) -> tuple[Callable[[], None], Progress | None]:
    """Make what counts the runs of a sweep, and what tells the stages of each under names of their own."""
    if progress is None:
        return (lambda: None), None
    done = itertools.count(1)
    return (
        lambda: progress("front", next(done), runs),
        lambda stage, step, steps: progress(f"{stage} (one point)", step, steps),
    )


def _posed(solution: Solution) -> tuple[Problem, Array]:
    """Give what a solution solved, or what it was rewound from, and its path, (n, 2) rad."""
    unwrapped, posed = solution.unwrapped, solution.problem
    if unwrapped is not None:
        return unwrapped.problem, unwrapped.rotary
    if posed is None or len(posed) != len(solution.toolpath):
        raise SettingError("a front needs a solution with its problem; this one was put together by hand")
    return posed, solution.motion.positions[:, solution.machine.rotary_columns]


def _allowing(
    solution: Solution, start: Array, cone: Cone | None, mask: MaskFunction | None
) -> Callable[[Array], bool]:
    """Make what tells whether a path, (n, 2) rad, keeps what isn't in the problem.

    These are the cone and the mask, and where the solution is rewound, that no more cuts are interrupted.
    """
    unwrapped, posed = solution.unwrapped, _posed(solution)[0]
    path = solution.toolpath if unwrapped is None else unwrapped.toolpath
    if unwrapped is not None and mask is not None:
        mask = wrap_mask(solution.machine, mask)
    keeps = path_check(path, posed.machine, start, cone, mask)
    most = _marks(solution, start)

    def allowed(rotary: Array) -> bool:
        try:
            return keeps(rotary) and _marks(solution, rotary) <= most
        except Infeasible:
            return False

    return allowed


def _marks(solution: Solution, rotary: Array) -> int:
    """Count the cuts that a path, (n, 2) rad, interrupts to turn an axis back."""
    rewinds = with_path(solution, rotary)[1]
    return 0 if rewinds is None else sum(r.in_cut for r in rewinds.rewinds)


def _led_by(solution: Solution, rotary: Array, cone: Cone | None, number: int) -> Solution:
    """Put a path of the front, (n, 2) rad, in place of the one that the sweep began with."""
    if np.array_equal(rotary, _posed(solution)[1]):
        return solution
    cheaper = with_path(solution, rotary)[0]
    # What was said of the other path isn't true of this one.
    kept = tuple(f for f in cheaper.toolpath.findings if f.code not in OF_POSTURES)
    said = "cheapest of its paths" if number == 1 else f"solution {number}"
    stage = Stage("front", said, 0, solution.energy.total, cheaper.energy.total)
    path = replace(cheaper.toolpath, findings=kept)
    return with_findings(replace(cheaper, toolpath=path, stages=(*solution.stages, stage)), cone)


def _shares(solution: Solution, start: Array, n: int, smoothest: float | None) -> Array:
    """Give the price of bends at each point, (n,) J/rad²: 0, then growing by one factor."""
    bend = _bend(start)
    # A path that hardly turns has no bends to pay for: any price does.
    middle = solution.energy.total / bend if bend > 0.0 else 1.0
    strongest = STRONGEST * middle if smoothest is None else smoothest
    return np.concatenate([[0.0], np.geomspace(strongest * FAINTEST / STRONGEST, strongest, n - 1)])


def _priced(posed: Problem, prices: Array, solution: Solution) -> list[Problem]:
    """Pose the problem at each price of bends, (n,) J/rad².

    Where speeds are known delay grows dearer in step, from its own price to as much power as the travel takes
    at the price in the middle.
    """
    time = float(posed.least_time.sum())
    power = solution.energy.total / time if np.isfinite(posed.top_speed).any() and time > 0.0 else 0.0
    share = prices / (prices[-1] / STRONGEST)
    return [
        replace(
            posed,
            bend_price=np.full(len(posed) - 1, price),
            time_price=posed.time_price + power * float(s),
        )
        for price, s in zip(prices, share, strict=True)
    ]


def _swept(
    problems: Sequence[Problem], start: Array, found: Callable[[int, Array | None], Array | None]
) -> list[Array]:
    """Find a path at each price: searched for, and from its neighbours on the way up and on the way down."""
    paths = [start]
    for number in range(1, len(problems)):
        neighbour = paths[-1]
        tried = found(number, neighbour), found(number, None)
        paths.append(_cheapest(problems[number], neighbour, *tried))
    for number in range(len(problems) - 2, -1, -1):
        paths[number] = _cheapest(problems[number], paths[number], found(number, paths[number + 1]))
    # What is found for steadiness may be the cheapest of all, as each search ends in a valley of its own.
    paths[0] = _cheapest(problems[0], *paths)
    return paths


def _cheapest(problem: Problem, known: Array, *tried: Array | None) -> Array:
    """Give the cheapest of paths, of equals the known one."""
    return min([known, *(path for path in tried if path is not None)], key=lambda p: _objective(problem, p))


def _objective(problem: Problem, rotary: Array) -> float:
    """Give the cost of a path, endless where it isn't admissible."""
    if problem.violation(rotary) > ALLOWED:
        return float("inf")
    return problem.cost(problem.positions(slice(None), rotary))


def _point(solution: Solution, rotary: Array, problem: Problem, unpriced: Problem) -> FrontPoint:
    """Measure a path, (n, 2) rad; its turns are those without its rewinds, on which nothing is cut."""
    other, rewinds = with_path(solution, rotary)
    path = solution.toolpath if solution.unwrapped is None else solution.unwrapped.toolpath
    driven = other.motion if rewinds is None else follow(path, unpriced.machine, rotary)
    turn = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1)
    cuts = path.cutting & (path.lengths > SHORTEST_WAY)
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


def undominated(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Keep what no other point beats, cheapest first; of equals the first."""
    figures = np.array([(p.cost, p.energy.total, p.bend, p.energy.time) for p in points])
    kept = []
    for i, own in enumerate(figures):
        beaten = (figures <= own).all(axis=1) & ((figures < own).any(axis=1) | (np.arange(len(figures)) < i))
        if not beaten.any():
            kept.append(points[i])
    return sorted(kept, key=lambda p: p.cost)
