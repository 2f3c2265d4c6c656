"""Least time as the objective: seconds with a price, and what breaks ties where nothing costs any.

A second has a price that makes costs of the size the solvers are tuned for: 1 J of the objective is 1 ms.
What a path takes at its feed no posture changes; postures cost the time by which an axis at its highest speed
is late, and that which changes of speed beyond an axis's acceleration cost. Where neither does, the least
travel and the evenest turns are chosen, at prices so small that no second is given for them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Axis, Machine
from fiveaxis.posture.problem import Problem

# W, of time.
TIME_PRICE = 1000.0
# Travel costs this share of the time that the axis takes for it at its highest speed; steady turns this share
# of their time, times the square of their speed over the highest one. 100 s of travel, or of turning at full
# speed, are worth 0.1 s of the program.
TRAVEL_SHARE = BEND_SHARE = 1e-3
# s: blocks aren't shorter. rad: an axis that turns less in one stands.
SHORTEST, STANDING = 1e-4, 1e-7


def by_time(problem: Problem, up_penalty: float = 0.0, smoothing: float = 0.0) -> Problem:
    """Price a problem by the time that its path takes.

    *Speed*: a step waits for the axis that has farthest to go, at `TIME_PRICE`. *Acceleration*: an axis j
    that has to change its speed by Δv within the time T in which it can change it by A T costs about
    ``e / (2 A)`` seconds, ``e = Δv − A T``. For where the control slows down by a factor s it asks for
    ``s Δv ≤ A T / s``, and T becomes ``T √(1 + e / (A T))``, that is ``e / (2 A)`` more while e is small;
    and where there is no time at all, as at a corner, an axis that stops from v and starts again with −v
    is late by ``v / A``, which is ``e / (2 A)`` again. *Ties*: travel and the squares of turns, see
    `TRAVEL_SHARE`; turning by Δ in the time t costs ``Δ² / (t v²)``, however many steps it is cut into.

    Parameters
    ----------
    problem : with other prices; the highest speeds of all axes
    up_penalty : J/mm, added to the price of the machine's Z moving up
    smoothing : J/rad², added to the price of bends

    Returns
    -------
    The problem, which asks for no axis's power
    """
    speed, push, least = problem.top_speed, problem.top_acceleration, problem.least_time
    travel = np.broadcast_to(TIME_PRICE * TRAVEL_SHARE / speed, problem.plus.shape)
    plus = travel.copy()
    plus[:, problem.machine.column("Z")] += up_penalty
    turning = speed[problem.machine.rotary_columns].min()
    lasting = np.where(least > 0.0, least, np.inf)
    return replace(
        problem,
        plus=plus,
        minus=travel,
        time_price=TIME_PRICE,
        excess_price=TIME_PRICE / (2.0 * push),
        bend_price=smoothing + TIME_PRICE * BEND_SHARE / (lasting * turning**2),
    )


def from_rest_to_rest(problem: Problem, rotary: Array, sharpness: float) -> Problem:
    """Price a problem by the time of blocks that run from rest to rest where they turn, near a path.

    A block of the time t at its feed whose axis j travels Δ at the acceleration A takes ``t + Δ / (A t)``
    while it reaches its feed, ``2 √(Δ / A)`` where it doesn't, and ``Δ / v + v / A`` at the axis's highest
    speed v. Each is met with its slope at the given travel: the second is concave, and so never priced too
    low. A block that turns nothing is passed without a rest, so what the rest costs is a price of turning at
    all, shared out over the turn as in `BlockCosts.prices`. Changes of speed between blocks cost nothing:
    there the axes stand.

    Parameters
    ----------
    problem : of `by_time`
    rotary : (n, 2), rad, chain order
    sharpness : share of a turn at the highest speed below which it counts as none
    """
    speed, push, columns = problem.top_speed, problem.top_acceleration, problem.machine.rotary_columns
    travel = np.abs(np.diff(problem.positions(slice(None), rotary), axis=0))
    least = problem.least_time[:, None]
    lasting = np.maximum(least, SHORTEST)
    root = np.sqrt(travel / push)
    pace, time = 1.0 / (lasting * push), lasting + travel / (lasting * push)
    short = root > lasting
    pace = np.where(short, 1.0 / (np.maximum(root, SHORTEST) * push), pace)
    time = np.where(short, 2.0 * root, time)
    fast = np.where(short, travel > speed**2 / push, travel > speed * lasting)
    pace = np.where(fast, 1.0 / speed, pace)
    time = np.where(fast, travel / speed + speed / push, time)
    turn = travel[:, columns].max(axis=1)
    turning = (turn > STANDING)[:, None]
    ramps = np.stack(
        [
            np.where(turning, pace, np.broadcast_to(1.0 / speed, pace.shape)),
            np.where(turning, least - (time - pace * travel), np.broadcast_to(least, pace.shape)),
        ]
    )
    rest = np.where(problem.least_time > 0.0, (time - least).max(axis=1), 0.0)
    price = TIME_PRICE * rest / (turn + sharpness * speed[columns].min() * lasting[:, 0])
    plus, minus = problem.plus.copy(), problem.minus.copy()
    plus[:, columns] += price[:, None]
    minus[:, columns] += price[:, None]
    return replace(problem, plus=plus, minus=minus, ramps=ramps, excess_price=np.zeros_like(push))


def time_findings(machine: Machine) -> tuple[Finding, ...]:
    """Say which accelerations least time doesn't know of; one finding, or none.

    Raises
    ------
    MachineError
        An axis whose highest speed isn't known: nobody can say what slows the path down.
    """
    unknown = _letters(machine, "max_speed")
    if unknown:
        raise MachineError(
            f"machine {machine.name!r} doesn't tell the highest speed of {', '.join(unknown)}, so nobody can "
            f"say which postures slow it down; add max_speed to [axes.{unknown[0]}] of its file, or choose "
            "another objective"
        )
    unknown = _letters(machine, "max_acceleration")
    if not unknown:
        return ()
    message = (
        f"machine {machine.name!r} doesn't tell the acceleration of {', '.join(unknown)}: times are as if "
        "they could change their speed at once, and postures are chosen so; add max_acceleration to "
        f"[axes.{unknown[0]}] of its file"
    )
    return (Finding(Severity.WARNING, "acceleration-unknown", message),)


def _letters(machine: Machine, figure: str) -> list[str]:
    """Name the axes that don't state a figure; one that is held needs none."""
    axes: tuple[Axis, ...] = machine.axes
    return [axis.letter for axis in axes if getattr(axis, figure) is None and not axis.limits.is_fixed]
