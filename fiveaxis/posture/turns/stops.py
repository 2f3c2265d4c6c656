"""Stops: what it costs, at each location of a path, to back off there and turn an axis back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy import travel_costs
from fiveaxis.geometry import Array
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.turns.retreat import retreats
from fiveaxis.posture.turns.turn_changes import Course
from fiveaxis.toolpath import Toolpath

# J: a rewind that interrupts a cut leaves a mark, so it is taken only where there is no other.
CUT_PRICE = 1e9


@dataclass(frozen=True, eq=False)
class Stops:
    """What rewinding one axis costs at each location.

    Parameters
    ----------
    axis : letter
    retract : (n,), mm; 0 where there is no room
    energy : (n,), J, of backing off and coming back
    up, down : (n,), J, of each turn, with its time's price
    turn_energy : (2,), J, of one turn forwards and back, without it
    times : s, of one turn and (n,) of backing off and coming back
    in_cut : (n,), whether a cut goes on where it stopped
    price : (n,), J, what `plan_turns` counts; infinite where there is no room
    """

    axis: str
    retract: Array
    energy: Array
    up: Array
    down: Array
    turn_energy: Array
    times: tuple[float, Array]
    in_cut: Array
    price: Array


def find_stops(course: Course, machine: Machine, column: int, clearance: float, time_price: float) -> Stops:
    """Work out what rewinding an axis costs at each location.

    Parameters
    ----------
    course : the path, unwrapped
    column : the axis, in the order of the machine's axes
    clearance : mm, between tool and part while the axis rewinds
    time_price : J/s
    """
    toolpath, rotary, n = course.toolpath, course.rotary, len(course.place)
    cutting = toolpath.cutting
    # A rewind at the last location would serve nothing; one at the first is a matter of where to begin.
    in_cut = np.append(cutting[1:], False) & (cutting | (np.arange(n) == 0))
    retract = np.full(n, np.inf)
    rows = 1 + np.flatnonzero(course.admitted[1:-1])
    retract[rows] = retreats(toolpath, machine, rotary, column, rows, clearance)
    way = np.where(np.isfinite(retract), retract, 0.0)
    axes = tool_axes(machine, rotary)
    tip = toolpath.tips(axes)
    feed = link_feed(toolpath)
    move = linear_positions(machine, tip + way[:, None] * axes, rotary) - linear_positions(
        machine, tip, rotary
    )
    plus, minus = (c[0] for c in travel_costs(machine, np.array([feed])))
    energy = np.abs(move) @ (plus + minus)
    speed = turn_feed(machine, column, feed)
    plus, minus = (c[0, column] for c in travel_costs(machine, np.array([speed])))
    turning = TURN * np.array([plus, minus])
    times = 360.0 / speed, 2.0 * way / feed
    price = np.where(np.isfinite(retract), energy + time_price * times[1], np.inf) + CUT_PRICE * in_cut
    up, down = (np.full(n, joules + time_price * times[0]) for joules in turning)
    return Stops(machine.axes[column].letter, way, energy, up, down, turning, times, in_cut, price)


def link_feed(toolpath: Toolpath) -> float:
    """Highest feed of links and rapid moves, mm/s; of the cuts where there are none."""
    links = toolpath.feed[~toolpath.cutting]
    return float((links if len(links) else toolpath.feed).max())


def turn_feed(machine: Machine, column: int, feed: float) -> float:
    """Feed of a move in which one rotary axis turns alone: deg/s, its highest speed if that is known."""
    fastest = machine.axes[column].max_speed
    return feed if fastest is None else float(np.degrees(fastest))
