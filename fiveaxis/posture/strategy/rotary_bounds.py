"""Bounds on rotary axes: how far they may turn in a move; axes that are held (4-axis and 3+2 machining)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, SettingError, angle_between, every_pair
from fiveaxis.model import (
    ON_LIMIT,
    STANDSTILL,
    TURN,
    Constraints,
    Limits,
    Machine,
    Toolpath,
    feed_times,
    one_turn_from,
    rotary_angles,
)

# Default speed of rotary axes at the programmed feed, rad/s: that of most trunnion tables, 30 1/min.
USUAL_SPEED = np.radians(180.0)
# Links may turn this many times as far as cuts: nothing is cut there.
LINK_SHARE = 3.0
# An axis may turn this many times as far as at the programmed tool axes: postures near them need room, too.
PROGRAMMED_SHARE = 1.5
# Default where the pivot stands still, so that the feed gives no time for the turn (rad).
ON_THE_SPOT = np.radians(15.0)
# rad: by which every step may turn; step of the free axis's angle if the other is held.
LEAST_TURN, FREE_STEP = np.radians([0.01, 0.25]).tolist()


def turn_bounds(
    toolpath: Toolpath,
    constraints: Constraints,
    location: Array | None = None,
    machine: Machine | None = None,
) -> Array:
    """Bound the turn of every rotary axis in each move of a path, (n − 1,) rad.

    Locations inserted in a given move share its bound. A move may turn as far as the program itself turns the
    tool; without a given bound, also as far as the surface turns or an axis of `machine` at the programmed
    tool axes. By default how densely a path is given doesn't matter: a program divides what turns far.

    Parameters
    ----------
    constraints : `max_turn` in a cutting move, by default `USUAL_SPEED` at the programmed feed, and
        `turn_rate` over the path of the contact in cuts; links turn up to `LINK_SHARE` times as far
    location : (n,), fractional index of each in the given path; by default all are given
    machine : whose axes turn, where no path was found otherwise; None where only the tool's own turns count
    """
    max_turn, turn_rate = constraints.max_turn, constraints.turn_rate
    cutting = toolpath.cutting[1:]
    share = np.ones(len(toolpath) - 1) if location is None else np.minimum(np.diff(location), 1.0)
    if max_turn is None:
        most = USUAL_SPEED * feed_times(toolpath)[1:]
        most = np.where(toolpath.lengths[1:] > STANDSTILL, most, ON_THE_SPOT * share)
        if machine is not None and toolpath.has_axes:
            turns = np.abs(np.diff(rotary_angles(machine, toolpath.axis), axis=1))
            turns = np.nan_to_num(np.minimum(turns, np.abs(TURN - turns)).max(axis=2)).min(axis=0)
            most = np.maximum(most, PROGRAMMED_SHARE * turns)
    else:
        most = max_turn * share
    most = np.where(cutting, most, LINK_SHARE * most)
    for direction in (toolpath.axis, toolpath.normal)[: 2 if max_turn is None else 1]:
        most = np.maximum(most, np.nan_to_num(angle_between(direction[1:], direction[:-1])))
    if turn_rate is not None:
        # Two locations with the same contact would not be allowed any turn.
        steep = np.maximum(turn_rate * toolpath.lengths[1:], LEAST_TURN)
        most = np.where(cutting, np.minimum(most, steep), most)
    return np.maximum(most, LEAST_TURN)


def shared(most: Array, known: Array, location: Array, rows: Array, turned: Array) -> Array:
    """Share the bounds of moves among their parts, so that a path which keeps them may turn as it does.

    What the path leaves of a bound is shared by length; where the path turns too far, the whole bound is.
    Bounds and turns, `known`, (n − 1, 2) rad, are of moves, with ends at fractional indices in the given
    path, `location`, (n,); those of parts are `turned`, (m − 1, 2) rad, and `rows`, (m,).
    """
    move = np.searchsorted(location, rows[1:]) - 1
    share = (np.diff(rows) / np.diff(location)[move])[:, None]
    total = np.zeros_like(most)
    np.add.at(total, move, turned)
    left = np.maximum(most - total, 0.0)
    return np.where((known <= most)[move], turned + share * left[move], share * most[move])


def hold(machine: Machine, angles: Mapping[str, float]) -> Machine:
    """Return the machine with rotary axes fixed at angles, rad by axis letter, as equal limits.

    `SettingError` for a letter that isn't a rotary axis of the machine, or an angle outside its limits.
    """
    for letter, angle in angles.items():
        if letter not in machine.rotaries:
            raise SettingError(
                f"{letter!r} can't be held: the rotary axes of {machine.name} are "
                f"{', '.join(machine.rotaries)}; write for example C=30"
            )
        axis = machine.axis(letter)
        if not axis.limits.contains(angle, ON_LIMIT):
            low, high = axis.shown(axis.limits.low), axis.shown(axis.limits.high)
            raise SettingError(
                f"{letter} can't be held at {math.degrees(angle):g} deg, outside its limits "
                f"{low:g}…{high:g} deg; give an angle within them"
            )
    limits = {letter: Limits(angle, angle) for letter, angle in angles.items()}
    axes = tuple(replace(a, limits=limits.get(a.letter, a.limits)) for a in machine.axes)
    return replace(machine, axes=axes)


def is_holding(machine: Machine) -> bool:
    """Whether a rotary axis of the machine is held."""
    return any(machine.axes[column].limits.is_fixed for column in machine.rotary_columns)


def free_angles(machine: Machine, step: float = FREE_STEP) -> Array:
    """List a grid of the rotary angles within the limits, (a, 2) rad, at most one turn of each axis."""
    choices = []
    for column in machine.rotary_columns:
        limits = machine.axes[column].limits
        low = one_turn_from(limits)
        high = limits.high if limits.span <= TURN else low + TURN - step
        choices.append(np.linspace(low, high, math.ceil((high - low) / step) + 1))
    return every_pair(*choices).reshape(-1, 2)
