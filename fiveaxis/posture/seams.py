"""Seams: where an axis may change its turn though no location lies there.

An axis of exactly one turn reaches each angle on one turn, and its two ends, the same angle, on two: only
there can it be turned back. With a little more than one turn there is a band of such angles, and a path that
takes long steps may jump over it. Either way a location is put into the move that passes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.toolpath import Toolpath, interpolate
from fiveaxis.toolpath.dividing import through


@dataclass(frozen=True, eq=False)
class Course:
    """A path with the places put in where an axis may change its turn.

    Parameters
    ----------
    toolpath : the locations, and the places
    rotary : (m, 2), rad, chain order, wound
    place : (m,), where on the path as it was each of them is, in rows: 3.25 lies between 3 and 4
    """

    toolpath: Toolpath
    rotary: Array
    place: Array

    @property
    def own(self) -> BoolArray:
        """(m,), whether it is one of the path's own locations."""
        return self.place == np.floor(self.place)


def with_seams(toolpath: Toolpath, machine: Machine, rotary: Array, columns: list[int]) -> Course:
    """Put a location into every move in which an axis passes angles of two turns without a location there.

    Both angles change in proportion to the way, and so does the point of the tool's axis at the height of
    the arc that touches, as in `fiveaxis.motion.fill_in`.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, wound
    columns : of the axes that wind, in the order of the machine's axes
    """
    place, angles = np.arange(len(rotary), dtype=float), rotary
    for column in columns:
        which = machine.rotary_columns.index(column)
        new, seam = passed_seams(angles[:, which], machine.axes[column].limits)
        if not len(new):
            continue
        rows = np.concatenate([np.arange(len(angles), dtype=float), new])
        order = np.argsort(rows, kind="stable")
        exact = np.concatenate([angles[:, which], seam])[order]
        angles = interpolate(angles, rows[order])
        # Interpolation rounds; the angle must be on the seam.
        angles[:, which] = exact
        place = np.interp(rows[order], np.arange(len(place)), place)
    if len(place) == len(toolpath):
        return Course(toolpath, rotary, place)
    centres = toolpath.centres(tool_axes(machine, rotary))
    return Course(through(toolpath, place, centres), angles, place)


def passed_seams(angles: Array, limits: Limits) -> tuple[Array, Array]:
    """Find where an axis passes angles at which two turns are open to it, with no location among them.

    Parameters
    ----------
    angles : (n,), rad, wound

    Returns
    -------
    rows : (s,), fractional: 3.25 is a quarter of the way from location 3 to 4
    seam : (s,), rad, the middle of the angles at which two turns are open
    """
    low, width = limits.low, limits.high - limits.low - TURN
    # With two turns each angle has two; towards an open end nothing is ever turned back.
    if not -ON_LIMIT <= width < TURN:
        return np.empty(0), np.empty(0)
    width = max(width, 0.0)
    least, most = np.minimum(angles[:-1], angles[1:]), np.maximum(angles[:-1], angles[1:])
    # The bands that lie wholly between the two ends of a move.
    first = np.floor((least + ON_LIMIT - low) / TURN).astype(np.int64) + 1
    last = np.ceil((most - ON_LIMIT - low - width) / TURN).astype(np.int64) - 1
    count = np.maximum(last - first + 1, 0)
    row = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    seam = low + width / 2.0 + TURN * (first[row] + number)
    return row + (seam - angles[row]) / (angles[row + 1] - angles[row]), seam
