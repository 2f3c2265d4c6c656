"""From tool axes to rotary angles: choice of branches and turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.energy import travel_costs
from fiveaxis.errors import FiveAxisError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import hold_singular, linear_positions, rotary_angles, within_limits
from fiveaxis.kinematics.windings import ON_LIMIT, TURN, fit_turns, into_limits
from fiveaxis.machine import Machine
from fiveaxis.motion import Fill
from fiveaxis.posture.baselines.kernel import cheapest_branches
from fiveaxis.toolpath import Toolpath


class NoBaseline(FiveAxisError):
    """The baseline doesn't exist for the path; the message is the reason."""


@dataclass(frozen=True, eq=False)
class Postures:
    """Axis values that give tool axes, for both branches.

    Parameters
    ----------
    positions : (2, n, k), mm and rad; angles are shifted into the limits by whole turns if possible
    allowed : (2, n), whether the branch exists and keeps every limit
    """

    positions: Array
    allowed: BoolArray


def postures(machine: Machine, toolpath: Toolpath, axis: Array) -> Postures:
    """Solve both branches for tool axes and check the limits.

    Parameters
    ----------
    axis : (n, 3), unit vectors, workpiece frame; NaN rows give no posture
    """
    rotary = hold_singular(rotary_angles(machine, axis), axis, machine)
    rotary = into_limits(machine, rotary)
    positions = linear_positions(machine, toolpath.tips(axis)[None], rotary)
    return Postures(positions, within_limits(machine, positions))


def require_blocks(fill: Fill) -> Fill:
    """Return the filled path of a baseline if a program can follow it.

    Raises
    ------
    NoBaseline
        The axes would have to jump between two locations.
    """
    jumps = fill.jumps
    if len(jumps):
        why = "the linear axes' directions come to lie in one plane"
        if fill.given.zone.offset:
            bottom = f"the flat bottom of {fill.given.tool.cutter}"
            why = f"the tool axis passes through the surface normal, where the contact jumps across {bottom}"
        raise NoBaseline(
            f"no blocks can follow it: {why}, in {len(jumps)} of {len(fill.given) - 1} moves, first from "
            f"location {jumps[0]} to {jumps[0] + 1}"
        )
    return fill


def cheapest_sequence(machine: Machine, toolpath: Toolpath, found: Postures) -> Array | None:
    """Choose the branch of every location so that the travel metric is minimal.

    Each rotary axis takes the shorter turn unless its limits forbid that; turns accumulate.

    Returns
    -------
    (n, 2), rad, chain order; None where some location has no allowed branch
    """
    if not found.allowed.any(axis=0).all():
        return None
    columns = machine.rotary_columns
    low, high = machine.low[columns], machine.high[columns]
    # An axis with several turns may start on any of them: it is unwrapped first, then shifted as a whole.
    winding = high - low >= TURN
    unwrapped = _cheapest(
        machine, toolpath, found, np.where(winding, -np.inf, low), np.where(winding, np.inf, high)
    )
    fitted = [fit_turns(angles, *limits) for angles, *limits in zip(unwrapped.T, low, high, strict=True)]
    if all(angles is not None for angles in fitted):
        return np.stack([angles for angles in fitted if angles is not None], axis=1)
    return _cheapest(machine, toolpath, found, low, high)


def _cheapest(machine: Machine, toolpath: Toolpath, found: Postures, low: Array, high: Array) -> Array:
    """Choose branches and turns with the compiled loop, (n, 2) rad."""
    plus, minus = travel_costs(machine, toolpath.feed, toolpath.rapid)
    columns = np.array(machine.rotary_columns)
    return cheapest_branches(found.positions, found.allowed, columns, low, high, ON_LIMIT, plus, minus)


def spread_over_links(toolpath: Toolpath, rows: IntArray, rotary: Array) -> Array:
    """Interpolate the angles of locations between known ones over the length of the path.

    Parameters
    ----------
    rows : (m,), indices of the known locations
    rotary : (m, 2), rad, their angles

    Returns
    -------
    (n, 2), rad; before the first and after the last known location the angles are held
    """
    length = np.cumsum(toolpath.lengths)
    spread = np.stack([np.interp(length, length[rows], rotary[:, k]) for k in range(2)], axis=1)
    # Where the pivot stands still, as in an inside corner, several locations are at the same length.
    spread[rows] = rotary
    return spread


def follow_axes(toolpath: Toolpath, machine: Machine, axis: Array) -> Array:
    """Compute the rotary angles of tool axes on the cheapest branches; (n, 2) rad.

    Parameters
    ----------
    axis : (n, 3), unit vectors; in NaN rows (links) angles are interpolated between the neighbours

    Raises
    ------
    NoBaseline
        A location where neither branch keeps the limits.
    """
    rows = np.flatnonzero(np.isfinite(axis).all(axis=1)).astype(np.int64)
    part = toolpath.at(rows)
    found = postures(machine, part, axis[rows])
    rotary = cheapest_sequence(machine, part, found)
    if rotary is None:
        unreached = rows[~found.allowed.any(axis=0)]
        raise NoBaseline(
            f"{len(unreached)} locations have a tool axis outside the axis limits, first location "
            f"{unreached[0]}"
        )
    return spread_over_links(toolpath, rows, rotary)
