"""The points of a front, and the prices of bends between the cheapest path and the smoothest one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy import Energy
from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array
from fiveaxis.motion import Motion, follow, peak_rates
from fiveaxis.options import Objective
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.turns.unwrapped import with_path
from fiveaxis.toolpath import Toolpath

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


def solved(solution: Solution) -> tuple[Problem, Array]:
    """Return the problem that a solution solved, and its path, (n, 2) rad; before rewinds if it has any."""
    unwrapped, problem = solution.unwrapped, solution.problem
    if unwrapped is not None:
        return unwrapped.problem, unwrapped.rotary
    if problem is None or len(problem) != len(solution.toolpath):
        raise SettingError("a front needs a solution with its problem; this one was put together by hand")
    return problem, solution.motion.positions[:, solution.machine.rotary_columns]


def interrupted_cuts(solution: Solution, rotary: Array) -> int:
    """Count the cuts that a path, (n, 2) rad, interrupts to rewind an axis."""
    rewinds = with_path(solution, rotary)[1]
    return 0 if rewinds is None else sum(r.in_cut for r in rewinds.rewinds)


def prices_of_bends(solution: Solution, n: int, smoothest: float | None) -> Array:
    """Compute the price of bends at each point, (n,) J/rad²: 0, then a geometric series."""
    bend = _bend(_path(solution), solved(solution)[1])
    # For a path without bends any price will do.
    middle = solution.energy.total / bend if bend > 0.0 else 1.0
    strongest = STRONGEST * middle if smoothest is None else smoothest
    shares = np.linspace(0.0, 1.0, n - 1)[::-1].tolist()
    return np.array([0.0, *(strongest * (FAINTEST / STRONGEST) ** share for share in shares)])


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
