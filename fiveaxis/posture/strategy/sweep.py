"""The sweep over prices of bends, from the cheapest path to the smoothest one, and the points of a front."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fiveaxis.energy import Energy
from fiveaxis.errors import Infeasible, SettingError
from fiveaxis.geometry import Array
from fiveaxis.motion import Motion, follow, peak_rates
from fiveaxis.options import Objective
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.options import Options
from fiveaxis.posture.problem import ALLOWED, Problem, parts_of_moves
from fiveaxis.posture.solution import Solution, Stage
from fiveaxis.posture.strategy.given_path import by_travel, refined
from fiveaxis.posture.strategy.singular import Cone, with_findings
from fiveaxis.posture.turns.unwrapped import path_check, with_path
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
    bend : rad², Σ‖Δρ‖² between given locations, without rewinds
    steepest : rad/mm, largest turn of a rotary axis over the path of the pivot in a cutting move
    fastest : rad/s, highest mean speed of a rotary axis in a move
    slowest : least share of the path's feed in a cut
    """

    smoothing: float
    time_price: float
    motion: Motion
    energy: Energy
    cost: float
    bend: float
    steepest: float
    fastest: float
    slowest: float = 1.0

    def as_dict(self) -> dict[str, float | None]:
        """Return the figures as plain data for JSON, angles in degrees but for ``bend``."""
        return {
            "smoothing_J_rad2": self.smoothing,
            "time_price_W": self.time_price,
            "energy_J": self.energy.total,
            "with_base_J": self.energy.with_base,
            "cost_J": self.cost,
            "bend_rad2": self.bend,
            "steepest_deg_mm": float(np.degrees(self.steepest)),
            "time_s": self.energy.time,
            "fastest_deg_s": float(np.degrees(self.fastest)),
            "least_feed_share": self.slowest,
        }

    def figures(self, energy: Energy, objective: Objective = "energy") -> tuple[float, ...]:
        """Return what the points of a front are compared by, less is better; the first is their order.

        It is what is minimised, the energy with base power where that is known, and the time on the control's
        clock. Where that isn't known, since the machine states no accelerations, bends stand for what it
        would lose.

        Parameters
        ----------
        energy : of the program
        """
        spent = energy.total if energy.with_base is None else energy.with_base
        if objective != "time" and energy.timing == "accelerations":
            return (spent if objective == "energy" else energy.travel), energy.time
        cost = () if objective == "energy" else (self.cost,)
        return (*cost, spent, energy.time, self.bend)


# A point of a front, and its solution.
Member = tuple[FrontPoint, Solution]


@dataclass(frozen=True, eq=False)
class Sweep:
    """Problems with an increasing price on bends, and on delay if the machine's highest speeds are known.

    Each is searched for, and refined from its neighbours' paths, once in each direction; the cheapest of the
    three is kept. A neighbour's path alone may lead to a poor local optimum: a path that is cheap without a
    price on bends needn't become the best steady one. The last is also searched as `optimise` does. Where a
    rotary axis has too few turns, all this is done with unlimited travel, and each path is then rewound.

    Parameters
    ----------
    solution : the first
    prices : (n,), J/rad², of bends, the first 0
    problems : at these prices
    """

    solution: Solution
    prices: Array
    problems: Sequence[Problem]

    @classmethod
    def of(cls, solution: Solution, n: int, smoothest: float | None) -> Sweep:
        """Choose n prices, up to `smoothest`, J/rad², where that is given."""
        prices = _prices(solution, solved(solution)[1], n, smoothest)
        return cls(solution, prices, _priced(solved(solution)[0], prices, solution))

    def members(
        self, end: Solution, constraints: Constraints, options: Options, count_run: Callable[[], None]
    ) -> list[Member]:
        """Find a solution at each price.

        Parameters
        ----------
        end : what `optimise` finds at the last price
        constraints, options : of the first solution
        count_run : called after each of ``3 n − 2`` runs
        """
        solution, effort, cone = self.solution, options.counts(), Cone.of(constraints)
        start = solved(solution)[1]
        is_admissible = _make_check(solution, cone, Mask.of(options.mask))

        def found(number: int, start: Array | None) -> Array | None:
            options.progress("searching" if start is None else "refining", 0, 1)
            problem = self.problems[number]
            path = by_travel(problem, effort) if start is None else refined(problem, start, effort)
            count_run()
            if path is None or problem.violation(path) > ALLOWED:
                return None
            return path if is_admissible(path) else None

        with threadpool_limits(limits=1):
            paths = _swept(self.problems, start, _along(solution, end), found)
        first, last, price = self.problems[0], self.problems[-1], float(self.prices[-1])
        members = [
            (measured(solution, path, float(own), priced, first), _with_path(solution, path, cone, number))
            for number, (path, own, priced) in enumerate(
                zip(paths, self.prices, self.problems, strict=True), start=1
            )
        ]
        if interrupted_cuts(end, solved(end)[1]) <= interrupted_cuts(solution, start):
            own, rotary = solved(end)
            free = replace(own, bend_price=np.zeros(len(own) - 1), time_price=first.time_price)
            point = measured(end, rotary, price, last, free)
            members[-1] = min(members[-1], (point, end), key=lambda one: one[0].cost + price * one[0].bend)
        return members


def solved(solution: Solution) -> tuple[Problem, Array]:
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
    unwrapped, (problem, start) = solution.unwrapped, solved(solution)
    path = _path(solution)
    if mask is not None:
        # The path has locations between those given.
        along = mask.along(solution.motion.location)
        mask = along if unwrapped is None else mask.wrapped(solution.machine)
    keeps = path_check(path, problem.machine, start, cone, mask)
    most = interrupted_cuts(solution, start)

    def is_admissible(rotary: Array) -> bool:
        try:
            return keeps(rotary) and interrupted_cuts(solution, rotary) <= most
        except Infeasible:
            return False

    return is_admissible


def interrupted_cuts(solution: Solution, rotary: Array) -> int:
    """Count the cuts that a path, (n, 2) rad, interrupts to rewind an axis."""
    rewinds = with_path(solution, rotary)[1]
    return 0 if rewinds is None else sum(r.in_cut for r in rewinds.rewinds)


def _with_path(solution: Solution, rotary: Array, cone: Cone | None, number: int) -> Solution:
    """Return the solution with another path of the front, (n, 2) rad."""
    if np.array_equal(rotary, solved(solution)[1]):
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
    bend = _bend(_path(solution), start)
    # For a path without bends any price will do.
    middle = solution.energy.total / bend if bend > 0.0 else 1.0
    strongest = STRONGEST * middle if smoothest is None else smoothest
    shares = np.linspace(0.0, 1.0, n - 1)[::-1].tolist()
    return np.array([0.0, *(strongest * (FAINTEST / STRONGEST) ** share for share in shares)])


def _priced(problem: Problem, prices: Array, solution: Solution) -> list[Problem]:
    """Return the problem at each price of bends, (n,) J/rad².

    If speeds are known, the price of delay rises with it: in the middle of the sweep by the mean power of the
    travel.
    """
    time = float(problem.least_time.sum())
    power = solution.energy.total / time if np.isfinite(problem.top_speed).any() and time > 0.0 else 0.0
    share = prices / (prices[-1] / STRONGEST)
    parts = parts_of_moves(_path(solution))
    return [
        replace(
            problem,
            bend_price=price * parts,
            time_price=problem.time_price + power * float(s),
        )
        for price, s in zip(prices, share, strict=True)
    ]


def _along(solution: Solution, end: Solution) -> Array:
    """Return the last path at the locations of the first, (n, 2) rad; that itself if one is rewound."""
    if solution.unwrapped is not None or end.unwrapped is not None:
        return solved(solution)[1]
    own, other = (
        np.arange(len(m), dtype=np.float64) if m.location is None else m.location
        for m in (solution.motion, end.motion)
    )
    return np.stack([np.interp(own, other, angle) for angle in solved(end)[1].T], axis=1)


def _swept(
    problems: Sequence[Problem],
    start: Array,
    end: Array,
    found: Callable[[int, Array | None], Array | None],
) -> list[Array]:
    """Find a path at each price: by a search, and from its neighbours in both directions of the sweep.

    The last begins from `end`, too.
    """
    paths = [start]
    for number in range(1, len(problems)):
        neighbour = paths[-1]
        tried = found(number, neighbour), found(number, None)
        paths.append(_cheapest(problems[number], neighbour, *tried))
    paths[-1] = _cheapest(problems[-1], paths[-1], found(len(problems) - 1, end))
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


def measured(
    solution: Solution, rotary: Array, smoothing: float, problem: Problem, unpriced: Problem
) -> FrontPoint:
    """Evaluate a path, (n, 2) rad; its turns are those without rewinds, which don't cut."""
    other, rewinds = with_path(solution, rotary)
    path = _path(solution)
    driven = other.motion if rewinds is None else follow(path, unpriced.machine, rotary)
    turn = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1)
    cuts = path.cutting & (path.lengths > SHORTEST_MOVE)
    cost = unpriced.cost(driven.positions)
    if rewinds is not None:
        cost += rewinds.energy + unpriced.time_price * rewinds.time
    return FrontPoint(
        smoothing=smoothing,
        time_price=problem.time_price,
        motion=other.motion,
        energy=other.energy,
        cost=cost,
        bend=_bend(path, rotary),
        steepest=float(np.max(turn[cuts] / path.lengths[cuts], initial=0.0)),
        fastest=max(rate.speed for rate in peak_rates(solution.machine, driven).values()),
    )


def _path(solution: Solution) -> Toolpath:
    """Return the path that a solution's problem is of: before rewinds if it has any."""
    return solution.toolpath if solution.unwrapped is None else solution.unwrapped.toolpath


def _bend(path: Toolpath, rotary: Array) -> float:
    """Sum ‖Δρ‖² between given locations, rad²: how finely moves are divided in between doesn't count."""
    return float((np.diff(rotary[~path.inserted], axis=0) ** 2).sum())
