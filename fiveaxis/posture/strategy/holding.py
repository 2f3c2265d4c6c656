"""Held rotary axes: one for 4-axis machining, both for 3+2."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, SettingError, every_pair
from fiveaxis.model import ON_LIMIT, TURN, Limits, Machine, one_turn_from

# Step of the free axis's angle if the other is held (rad).
FREE_STEP = np.radians(0.25)


def hold(machine: Machine, angles: Mapping[str, float]) -> Machine:
    """Return the machine with one or both rotary axes fixed at angles, rad by axis letter.

    They remain axes of the machine, with equal limits, so that motions keep their columns. `SettingError` for
    a letter that isn't a rotary axis of the machine, or an angle outside its limits.
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
    axes = tuple(
        replace(a, limits=Limits(angles[a.letter], angles[a.letter])) if a.letter in angles else a
        for a in machine.axes
    )
    return replace(machine, axes=axes)


def is_holding(machine: Machine) -> bool:
    """Whether a rotary axis of the machine is held."""
    return any(machine.axes[column].limits.is_fixed for column in machine.rotary_columns)


def free_angles(machine: Machine, step: float = FREE_STEP) -> Array:
    """List a grid of the rotary angles within the limits, (a, 2) rad, at most one turn of each axis."""
    choices = []
    for column in machine.rotary_columns:
        limits = machine.axes[column].limits
        low, high = one_turn_from(limits), limits.high
        if limits.span > TURN:
            high = low + TURN - step
        choices.append(np.linspace(low, high, math.ceil((high - low) / step) + 1))
    return every_pair(*choices).reshape(-1, 2)
