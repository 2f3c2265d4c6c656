"""Solutions between the cheapest program and the fastest or steadiest one, none of them dominated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.base import CHOOSING, Objective, SettingError, within
from fiveaxis.model import (
    Constraints,
    Energy,
    Machine,
    Motion,
    Toolpath,
    follow,
    move_powers,
    peak_rates,
    program_energy,
    travel_costs,
)
from fiveaxis.posture.optimiser import optimise_postures
from fiveaxis.posture.options import DEFAULTS, Options
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.solution import Optimum, Unwrapped

# How many shares of the feed are tried in each move; relative difference of costs that is rounding.
TRIED, SAME = 7, 1e-9
# Ends of the sweep, in multiples of the price at which all bends cost as much as all travel.
FAINTEST, STRONGEST = 0.01, 100.0
# Shortest move, mm, with a meaningful turn per mm.
SHORTEST_MOVE = 1e-3
# Least and highest price of time along a front by the clock, in mean powers of the drives.
DELAYS = (0.1, 10.0)
# Prices of time with which feeds are chosen, in mean powers of the drives.
PATIENCE = (0.0, 0.3)


@dataclass(frozen=True, eq=False)
class Front:
    """Solutions none of which is dominated: no other one is at least as good in every figure.

    Parameters
    ----------
    points : by increasing energy, or cost with another objective; the last is the fastest or smoothest
    dominated : how many solutions were left out because another one is as good in everything
    solutions : of each point, with its baselines
    """

    points: tuple[FrontPoint, ...]
    dominated: int
    solutions: tuple[Optimum, ...]

    @property
    def solution(self) -> Optimum:
        """The cheapest path found for any point."""
        return self.solutions[0]

    def pick(self, number: int) -> Optimum:
        """Return a solution by its number; 1 is the cheapest, a number too large gives the last."""
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
    feed_share: float | None = None,
) -> Front:
    """Find solutions between the cheapest program and the fastest or smoothest one.

    The first is what `optimise_postures` finds. Where the control's clock is known, the others are searched
    with increasing prices of time, and the last for least time; elsewhere with increasing prices of bends.
    None interrupts more cuts than the first to rewind an axis.

    Parameters
    ----------
    toolpath, machine, constraints : as for `optimise_postures`
    n : how many solutions are sought, at least two
    options : as for `optimise_postures`, without `smoothing` and `bound`
    feed_share : least share of the feed, 0…1, to which cuts may be slowed where that saves energy; by default
        they keep their feed

    Raises
    ------
    SettingError
        A share of the feed with another objective than energy.
    Infeasible, MachineError, ToolError, ToolpathError
        As `optimise_postures`.
    """
    if feed_share is not None and options.objective != "energy":
        raise SettingError(
            f"feed_share slows cuts to save energy, and the objective is {options.objective}; leave one out"
        )
    done = 0

    def searched(**changes: Any) -> Optimum:
        nonlocal done
        of_run = within(options.progress, f"front, run {done + 1} of {n}", done, n, CHOOSING)
        own = replace(options, bound=False, progress=of_run, **changes)
        found = optimise_postures(toolpath, machine, constraints, own)
        done += 1
        return found

    solution = searched()
    search = _by_bends if options.is_timed or options.clock.is_programmed(machine) else _by_clock
    members = search(solution, n, options, searched)
    if feed_share is not None:
        slower = [_slower(*member, feed_share, patience) for member in members for patience in PATIENCE]
        members += [one for one in slower if one is not None]
    figures = [point.figures(point.energy, options.objective) for point, _ in members]
    kept = [members[k] for k in undominated(figures)]
    points, solutions = zip(*kept, strict=True)
    return Front(points, len(members) - len(kept), solutions)


def _by_clock(solution: Optimum, n: int, options: Options, searched: Callable[..., Optimum]) -> list[Member]:
    """Search solutions with an increasing price of time, the last for least time where speeds are known."""
    problem = solved(solution).problem
    least = (solution.machine.base_power or 0.0) if options.time_price is None else options.time_price
    power, (faintest, strongest) = _mean_power(solution), DELAYS
    # The last is the strongest, also of one.
    shares = np.linspace(1.0, 0.0, n - 1)[::-1].tolist()
    prices = [least + power * faintest * (strongest / faintest) ** share for share in shares]
    speeds = [axis.max_speed for axis in solution.machine.axes if not axis.limits.is_fixed]
    members = [(measured(solution, problem.time_price, problem), solution)]
    for number, price in enumerate(prices, start=1):
        if number == n - 1 and None not in speeds:
            found = searched(objective="time", time_price=None)
        else:
            found = searched(time_price=price)
        if interrupted_cuts(found) <= interrupted_cuts(solution):
            members.append((measured(found, price, _unpriced(found, problem)), found))
    return members


def _by_bends(solution: Optimum, n: int, options: Options, searched: Callable[..., Optimum]) -> list[Member]:
    """Search solutions with an increasing price of bends, J/rad²; at each price the best of all stays.

    Prices are 0 and a geometric series about the one at which the bends of the first solution cost as much
    as its program. If speeds are known, the price of delay rises, too: in the middle by the mean power.
    """
    problem, bend = solved(solution).problem, _bend(solved(solution))
    least = (solution.machine.base_power or 0.0) if options.time_price is None else options.time_price
    # For a path without bends any price will do.
    middle = solution.energy.total / bend if bend > 0.0 else 1.0
    shares = np.linspace(0.0, 1.0, n - 1)[::-1].tolist()
    prices = [0.0, *(STRONGEST * middle * (FAINTEST / STRONGEST) ** share for share in shares)]
    power = _mean_power(solution) if np.isfinite(problem.top_speed).any() else 0.0
    found = [solution]
    for price in prices[1:]:
        delay = {} if options.is_timed else {"time_price": least + power * price * STRONGEST / prices[-1]}
        other = searched(smoothing=price, **delay)
        if interrupted_cuts(other) <= interrupted_cuts(solution):
            found.append(other)
    points = []
    for one in found:
        own = solved(one).problem
        free = replace(own, bend_price=0.0 * own.bend_price)
        unpriced = free if options.is_timed else _unpriced(one, problem)
        points.append(measured(one, own.time_price, unpriced))
    members = []
    for price in prices:
        best = min(range(len(points)), key=lambda k: points[k].cost + price * points[k].bend)
        members.append((replace(points[best], smoothing=price), found[best]))
    return members


def _unpriced(solution: Optimum, first: Problem) -> Problem:
    """Return the problem of a solution by the travel metric, at the first point's prices of delay."""
    path, own = solved(solution).toolpath, solved(solution).problem
    plus, minus = travel_costs(own.machine, path.feed, path.rapid)
    return replace(
        own,
        plus=plus[1:],
        minus=minus[1:],
        bend_price=np.zeros(len(own) - 1),
        ramps=None,
        time_price=first.time_price,
        excess_price=first.excess_price,
    )


def undominated(figures: Sequence[Sequence[float]]) -> list[int]:
    """Return the rows that no other one dominates, by their first figure; of equals the first.

    A row dominates another one if none of its figures is larger, and one is smaller.
    """
    rows = np.array(figures)
    before = np.arange(len(rows))
    kept = []
    for i, own in enumerate(rows):
        beaten = (rows <= own).all(axis=1) & ((rows < own).any(axis=1) | (before < i))
        if not beaten.any():
            kept.append(i)
    return sorted(kept, key=lambda i: tuple(figures[i]))


def _mean_power(solution: Optimum) -> float:
    """Return the drives' mean power, W; 0 of a path of one location."""
    energy = solution.energy
    return energy.total / energy.time if energy.time > 0.0 else 0.0


def _slower(
    point: FrontPoint, solution: Optimum, share: float, patience: float
) -> tuple[FrontPoint, Optimum] | None:
    """Return a point whose cuts are slowed down where that saves energy; None where none is."""
    found = slowed(solution, share, patience * _mean_power(solution))
    if found is None:
        return None
    least = float((found.toolpath.feed / solution.toolpath.feed).min())
    return replace(point, motion=found.motion, energy=found.energy, slowest=least), found


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

        It is what is minimised, the energy of the program with base power where that is known, and the time
        on the control's clock; where accelerations aren't known, bends stand for what it would lose.
        """
        spent = energy.total if energy.with_base is None else energy.with_base
        if objective != "time" and energy.timing == "accelerations":
            return (spent if objective == "energy" else energy.travel), energy.time
        cost = () if objective == "energy" else (self.cost,)
        return (*cost, spent, energy.time, self.bend)


# A point of a front, and its solution.
Member = tuple[FrontPoint, Optimum]


def solved(solution: Optimum) -> Unwrapped:
    """Return what was solved for a solution, before rewinds if it has any."""
    found = solution.before_rewinds
    if found is None or len(found.problem) != len(found.toolpath):
        raise SettingError("a front needs a solution with its problem; this one was put together by hand")
    return found


def interrupted_cuts(solution: Optimum) -> int:
    """Count the cuts that a solution interrupts to rewind an axis."""
    return sum(rewind.in_cut for rewind in solved(solution).rewinds)


def measured(solution: Optimum, time_price: float, unpriced: Problem) -> FrontPoint:
    """Evaluate a solution found with a price of delay, W; `unpriced` is its problem at the first prices."""
    found = solved(solution)
    path, rotary, rewinds = found.toolpath, found.rotary, found.rewinds
    driven = solution.motion if solution.unwrapped is None else follow(path, unpriced.machine, rotary)
    spent, lasting = sum(r.energy for r in rewinds), sum(r.time for r in rewinds)
    turn = np.abs(np.diff(rotary, axis=0, prepend=rotary[:1])).max(axis=1)
    cuts = path.cutting & (path.lengths > SHORTEST_MOVE)
    return FrontPoint(
        smoothing=0.0,
        time_price=time_price,
        motion=solution.motion,
        energy=solution.energy,
        cost=unpriced.cost(driven.positions) + spent + unpriced.time_price * lasting,
        bend=_bend(found),
        steepest=float(np.max(turn[cuts] / path.lengths[cuts], initial=0.0)),
        fastest=max(rate.speed for rate in peak_rates(solution.machine, driven).values()),
    )


def _bend(path: Unwrapped) -> float:
    """Sum ‖Δρ‖² between given locations, rad²: how finely moves are divided in between doesn't count."""
    return float((np.diff(path.rotary[~path.toolpath.inserted], axis=0) ** 2).sum())


def slowed(solution: Optimum, share: float, price: float) -> Optimum | None:
    """Slow the cuts of a solution down, to a least share of the feed, where that saves energy.

    Of some feeds each move between given locations takes the cheapest, by the drives' power at the mean
    speeds of its parts, the base power where that is known, and a price of time, W. The same postures at
    other feeds are returned, with the baselines as they were; None where no cut is slower.
    """
    machine, path, motion = solution.machine, solution.toolpath, solution.motion
    shares, begins = np.linspace(share, 1.0, TRIED), np.flatnonzero(~path.inserted[:-1]) + 1
    costs = []
    for tried in shares.tolist():
        lasting = motion.time / np.where(path.cutting, tried, 1.0)
        power = move_powers(machine, replace(motion, time=lasting)).sum(axis=1)
        costs.append(np.add.reduceat((power + price + (machine.base_power or 0.0)) * lasting, begins))
    # Of costs that differ by rounding the highest feed.
    cheap = np.array(costs) <= np.min(costs, axis=0) * (1.0 + SAME)
    best = shares[len(shares) - 1 - np.argmax(cheap[::-1], axis=0)]
    along = np.append(1.0, np.repeat(best, np.diff(begins, append=len(path))))
    slower = np.where(path.cutting, along, 1.0)
    if not (slower < 1.0).any():
        return None
    slow = replace(path, feed=path.feed * slower)
    rotary = motion.positions[:, machine.rotary_columns]
    driven = replace(follow(slow, machine, rotary), location=motion.location)
    return replace(
        solution,
        toolpath=slow,
        motion=driven,
        energy=program_energy(machine, slow, driven, solution.filling, solution.clock),
        compared={name: replace(b, toolpath=b.toolpath or path) for name, b in solution.compared.items()},
    )
