"""Rotary axes that are held: one for 4-axis machining, both for 3+2."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import tool_axes, within_limits
from fiveaxis.kinematics.windings import ON_LIMIT, TURN, one_turn_from
from fiveaxis.machine import Limits, Machine
from fiveaxis.motion import follow
from fiveaxis.posture.branches import spread_over_links
from fiveaxis.toolpath import TiltBounds, Toolpath

# Step in which the angle of the axis that isn't held is tried, and locations that are tried at once.
FREE_STEP = np.radians(0.25)
CHUNK = 64


def hold(machine: Machine, angles: Mapping[str, float]) -> Machine:
    """Return a machine whose rotary axes may not leave an angle.

    The axes stay axes of the machine, with limits that are one value: motions keep their columns.

    Parameters
    ----------
    angles : degrees by axis letter, one or both rotary axes

    Raises
    ------
    SettingError
        A letter that isn't a rotary axis of the machine; an angle outside its limits.
    """
    for letter, degrees in angles.items():
        if letter not in machine.rotaries:
            raise SettingError(
                f"{letter!r} can't be held: the rotary axes of {machine.name} are "
                f"{', '.join(machine.rotaries)}; write for example C=30"
            )
        axis, angle = machine.axis(letter), math.radians(degrees)
        low, high = axis.limits.low, axis.limits.high
        if not low - ON_LIMIT <= angle <= high + ON_LIMIT:
            raise SettingError(
                f"{letter} can't be held at {degrees:g} deg, outside its limits {axis.shown(low):g}…"
                f"{axis.shown(high):g} deg; give an angle within them"
            )
    held = {letter: math.radians(degrees) for letter, degrees in angles.items()}
    axes = tuple(
        replace(a, limits=Limits(held[a.letter], held[a.letter])) if a.letter in held else a
        for a in machine.axes
    )
    return replace(machine, axes=axes)


def is_holding(machine: Machine) -> bool:
    """Whether a rotary axis of the machine is held."""
    return any(machine.axes[column].limits.is_fixed for column in machine.rotary_columns)


def free_angles(machine: Machine) -> Array:
    """List the rotary angles that a machine with held axes can take, (a, 2) rad, one turn of each axis."""
    choices = []
    for column in machine.rotary_columns:
        limits = machine.axes[column].limits
        low, high = limits.low, limits.high
        if high - low > TURN:
            low = one_turn_from(limits)
            high = low + TURN - FREE_STEP
        choices.append(np.linspace(low, high, math.ceil((high - low) / FREE_STEP) + 1))
    return np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(-1, 2)


def nearest_held(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find for each location the posture nearest to the reference among those that held axes leave.

    Returns
    -------
    rotary : (n, 2), rad; links get angles in proportion to the way between their neighbours
    open_rows : (n,), locations without an admissible posture
    """
    angles = free_angles(machine)
    axis = tool_axes(machine, angles)
    bound: BoolArray = np.all(np.isfinite(tilt.reference), axis=1)
    rows = np.flatnonzero(bound).astype(np.int64)
    rotary, open_rows = np.zeros((len(toolpath), 2)), bound.copy()
    for begin in range(0, len(rows), CHUNK):
        part = rows[begin : begin + CHUNK]
        # Nearest first, so that only the first admissible ones have to be placed on the machine.
        order = np.argsort(-(tilt.reference[part] @ axis.T), axis=1, kind="stable")
        admitted = np.take_along_axis(tilt.admits(np.tile(axis, (len(part), 1, 1)), part), order, axis=1)
        for row, ranked, inside in zip(part, order, admitted, strict=True):
            tried = angles[ranked[inside]]
            reached = np.flatnonzero(_reached(toolpath, machine, int(row), tried))
            if len(reached):
                rotary[row], open_rows[row] = tried[reached[0]], False
    return _with_links(toolpath, rows[~open_rows[rows]], rotary), open_rows


def _reached(toolpath: Toolpath, machine: Machine, row: int, rotary: Array) -> BoolArray:
    """Tell which rotary angles, (m, 2) rad, put a location inside all limits."""
    part = toolpath.at(np.full(max(len(rotary), 1), row))
    if not len(rotary):
        return np.zeros(0, dtype=bool)
    return within_limits(machine, follow(part, machine, rotary).positions)


def _with_links(toolpath: Toolpath, rows: IntArray, rotary: Array) -> Array:
    return spread_over_links(toolpath, rows, rotary[rows]) if len(rows) else rotary
