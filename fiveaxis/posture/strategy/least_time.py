"""Least time as the objective: a price on seconds, and tie-breakers where no posture costs any.

The price brings costs to the size for which the solvers are tuned: 1 J of the objective is 1 ms. Postures
cost the time by which an axis at its highest speed is late for the feed, and what changes of speed beyond an
acceleration lose; else the least travel and the most even turns are chosen, at prices too small to cost time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, Finding, MachineError, Severity
from fiveaxis.model import Machine, lifting_costs
from fiveaxis.posture.problem import Problem

# W, of time.
TIME_PRICE = 1000.0
# Travel costs this share of its time at the axis's highest speed, and a steady turn of its own, times the
# square of its speed relative to that: 100 s at full speed are worth 0.1 s of the program.
TRAVEL_SHARE = BEND_SHARE = 1e-3
# Share of a step, or of a turn, below which it counts as none.
SHARPNESS = 0.01
# Shortest block, s, and the turn in a block below which an axis stands still, rad.
SHORTEST, STANDING = 1e-4, 1e-7
# mm/s and mm/s² of axes whose limits don't count.
UNLIMITED = 1e9


def by_time(problem: Problem, up_penalty: float = 0.0) -> Problem:
    """Return a problem priced by the time of its path.

    *Speed*: a step waits for the slowest axis, at `TIME_PRICE`. *Acceleration*: an axis that has to change
    its speed by Δv within a time T, in which it can change it by A T, costs about ``e / (2 A)`` seconds,
    ``e = Δv − A T``. A control that slows down by a factor s needs ``s Δv ≤ A T / s``, so T becomes
    ``T √(1 + e / (A T))``, that is ``e / (2 A)`` more for small e. With no time at all, as at a corner, an
    axis that stops from v and starts again with −v is late by ``v / A``, again ``e / (2 A)``. *Ties*: travel
    and the squares of turns, see `TRAVEL_SHARE`; turning by Δ in the time t costs ``Δ² / (t v²)`` however
    many steps it is divided into.

    Parameters
    ----------
    problem : with the price of bends, and the highest speeds of all axes; other prices are replaced
    up_penalty : J/mm, added to the price of lifting what a linear axis carries (`lifting_costs`)
    """
    speed, push, least = problem.top_speed, problem.top_acceleration, problem.least_time
    travel = np.broadcast_to(TIME_PRICE * TRAVEL_SHARE / speed, problem.plus.shape)
    up, down = lifting_costs(problem.machine, up_penalty)
    turning = speed[problem.machine.rotary_columns].min()
    lasting = np.where(least > 0.0, least, np.inf)
    return replace(
        problem,
        plus=travel + up,
        minus=travel + down,
        time_price=TIME_PRICE,
        excess_price=TIME_PRICE / (2.0 * push),
        bend_price=problem.bend_price + TIME_PRICE * BEND_SHARE / (lasting * turning**2),
    )


def from_rest_to_rest(problem: Problem, rotary: Array, *, words: bool = False) -> Problem:
    """Return a problem priced by the time of blocks that stop at both ends if they turn, near a path.

    A block of the time t at its feed, with an axis that travels Δ at the acceleration A, takes
    ``t + Δ / (A t)`` if it reaches its feed, ``2 √(Δ / A)`` if it doesn't, and ``Δ / v + v / A`` at the
    axis's highest speed v. Each is linearised at the given travel; the second is concave, and so never priced
    too low. A block without turns is passed without a stop, so a stop is the price of turning at all,
    distributed over the turn as in `BlockCosts.near`. The axes stand still between blocks: changes of speed
    cost nothing there.

    Parameters
    ----------
    problem : with its price of time
    rotary : (n, 2), rad, chain order
    words : whether the linear axes' limits apply to the tip's words, which are the same for all postures
    """
    speed, push, columns = problem.top_speed, problem.top_acceleration, problem.machine.rotary_columns
    if words:
        speed, push = speed.copy(), push.copy()
        speed[problem.machine.linear_columns] = push[problem.machine.linear_columns] = UNLIMITED
    travel = np.abs(np.diff(problem.positions(slice(None), rotary), axis=0))
    least = problem.least_time[:, None]
    lasting = np.maximum(least, SHORTEST)
    root = np.sqrt(travel / push)
    short = root > lasting
    fast = np.where(short, travel > speed**2 / push, travel > speed * lasting)
    paces = 1.0 / speed, 1.0 / (np.maximum(root, SHORTEST) * push), 1.0 / (lasting * push)
    times = travel / speed + speed / push, 2.0 * root, lasting + travel / (lasting * push)
    pace, time = (np.where(fast, one, np.where(short, two, three)) for one, two, three in (paces, times))
    turn = travel[:, columns].max(axis=1)
    turning = (turn > STANDING)[:, None]
    grace = np.where(turning, least - (time - pace * travel), least)
    ramps = np.stack([np.where(turning, pace, 1.0 / speed), grace])
    rest = np.where(problem.least_time > 0.0, (time - least).max(axis=1), 0.0)
    price = problem.time_price * rest / (turn + SHARPNESS * speed[columns].min() * lasting[:, 0])
    stops = np.where(problem.machine.is_rotary, price[:, None], 0.0)
    plus, minus = problem.plus + stops, problem.minus + stops
    return replace(problem, plus=plus, minus=minus, ramps=ramps, excess_price=np.zeros_like(push))


def time_findings(machine: Machine) -> tuple[Finding, ...]:
    """Report unknown accelerations, if any; `MachineError` if an axis's highest speed is unknown."""
    unknown = _letters(machine, "max_speed")
    if unknown:
        raise MachineError(
            f"machine {machine.name!r} has no highest speed of {', '.join(unknown)}, so the time of postures "
            f"is unknown; add max_speed to [axes.{unknown[0]}] of its file, or choose another objective"
        )
    unknown = _letters(machine, "max_acceleration")
    if not unknown:
        return ()
    message = (
        f"machine {machine.name!r} has no acceleration of {', '.join(unknown)}: postures are chosen, and "
        "times computed, as if they changed speed at once; add max_acceleration to "
        f"[axes.{unknown[0]}] of its file"
    )
    return (Finding(Severity.WARNING, "acceleration-unknown", message),)


def _letters(machine: Machine, figure: str) -> list[str]:
    """List the axes that lack a figure; a held one needs none."""
    return [a.letter for a in machine.axes if getattr(a, figure) is None and not a.limits.is_fixed]
