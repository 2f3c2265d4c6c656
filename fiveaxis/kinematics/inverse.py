"""Axis values for a wanted tool tip and tool axis: every branch."""

from __future__ import annotations

import numpy as np

from fiveaxis.errors import DegenerateChain, ToolpathError
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics.orientation import Held, missed_axes, rotary_angles
from fiveaxis.kinematics.poses import linear_positions, require_positioning, tool_axes
from fiveaxis.machine import Machine
from fiveaxis.machine.freedom import spare_axes

# More rotary axes than these are redundant: a tool axis is two numbers.
ORIENTING = 2
# How far the squared length of a unit vector may be off: six decimals of a file leave about half of it.
UNIT_LENGTH = 1e-5


def axis_positions(machine: Machine, tip: Array, axis: Array, *, held: Held | None = None) -> Array:
    """Solve all axes for wanted tool tips and tool axes.

    Parameters
    ----------
    machine : three linear and up to three rotary axes
    tip : (n, 3), mm, workpiece frame
    axis : (n, 3), unit vectors from tip to shank, workpiece frame
    held : rad by letter, 0 where not named: where an axis is held whose angle doesn't matter. That is the
        first rotary axis where the tool lies along it, a rotary axis that only spins the tool or the part,
        and, of three rotary axes, the redundant one (the one named here, else `redundant_axis`)

    Returns
    -------
    (branches, n, k), mm and rad, columns in the order of `machine.axes`; a whole row is NaN where a branch
    doesn't exist. Limits aren't applied; angles lie in (−π, π]. Two branches with two or three rotary axes,
    one with fewer; tool axes further than `AXIS_TOLERANCE` from what fewer can do have none.

    Raises
    ------
    DegenerateChain
        The axes can't give every position, or two rotary axes don't give two directions of freedom.
    MachineError
        `held` names an axis that the machine doesn't have.
    ToolpathError
        Tips and tool axes aren't rows of three, or a tool axis isn't a unit vector; NaN rows are no fault.
    """
    require_positioning(machine)
    for letter in () if held is None else held:
        machine.column(letter)
    if len(machine.rotaries) > ORIENTING:
        return _around_redundant(machine, tip, axis, {} if held is None else held)
    wanted = np.asarray(axis, dtype=float)
    points = np.asarray(tip, dtype=float)
    _require_rows(points, wanted)
    rotary = rotary_angles(machine, wanted, held=held)
    positions = linear_positions(machine, points[None], rotary)
    missing: BoolArray = np.any(np.isnan(positions), axis=-1)
    if len(machine.rotaries) < ORIENTING:
        missing |= missed_axes(tool_axes(machine, rotary), wanted)
    positions[missing] = np.nan
    return positions


def _require_rows(tip: Array, axis: Array) -> None:
    if tip.ndim != 2 or tip.shape[1] != 3 or axis.shape != tip.shape:
        raise ToolpathError(f"tips {tip.shape} and tool axes {axis.shape} must both be rows of three, (n, 3)")
    off = np.abs(np.einsum("ij,ij->i", axis, axis) - 1.0)
    if (off > UNIT_LENGTH).any():
        row = int(np.nanargmax(off))
        raise ToolpathError(f"location {row}: the tool axis {axis[row]} isn't a unit vector; normalise it")


def redundant_axis(machine: Machine) -> str:
    """Name the rotary axis, of three, that is held still: the one nearest the tool that can be spared.

    Raises
    ------
    DegenerateChain
        No two of the rotary axes lean the tool in two directions.
    """
    spare = spare_axes(machine.chain)
    if spare:
        return spare[0]
    raise DegenerateChain(
        f"machine {machine.name!r}: no two of {', '.join(machine.rotaries)} lean the tool in two directions"
    )


def _around_redundant(machine: Machine, tip: Array, axis: Array, held: Held) -> Array:
    """Solve the other axes with the redundant one held."""
    named = [c for c in held if c in spare_axes(machine.chain)]
    spare = named[0] if named else redundant_axis(machine)
    value = held.get(spare, 0.0)
    rest = {letter: angle for letter, angle in held.items() if letter != spare}
    found = axis_positions(machine.holding(spare, value), tip, axis, held=rest)
    column = machine.column(spare)
    positions = np.insert(found, column, value, axis=-1)
    positions[np.isnan(found).any(axis=-1)] = np.nan
    return positions
