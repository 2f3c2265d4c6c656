"""Turn changes: where an axis may change its turn between two locations.

An axis of exactly one turn reaches each angle on one turn, and its two ends, the same angle, on two: it can
be rewound only there. With a little more than one turn there is a band of such angles, and a path with long
steps may jump over it. In both cases a location is inserted into the move that passes these angles. The
turns before and after it differ, so every inserted location is needed.

It lies on the path, as inserted blocks do (`fiveaxis.toolpath.filled`), and both angles change in proportion
to the distance; where that would break a bound on the tool's lean, the other angle is changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.toolpath import TiltBounds, Toolpath, filled, interpolate, turned

# Changes of the other angle to try (rad): smallest first, to both sides.
CHANGES = np.radians(np.concatenate([[0.0], np.ravel([[a, -a] for a in np.arange(1, 101) * 0.05])]))


@dataclass(frozen=True, eq=False)
class UnwrappedPath:
    """An unwrapped path with locations inserted where an axis may change its turn.

    Parameters
    ----------
    toolpath : its locations and the inserted ones
    rotary : (m, 2), rad, chain order, unwrapped
    row : (m,), row of each location on the original path; fractional for inserted ones: 3.25 lies between
        locations 3 and 4
    admitted : (m,), whether the bounds on the lean hold; true of the path's own locations
    """

    toolpath: Toolpath
    rotary: Array
    row: Array
    admitted: BoolArray

    @property
    def own(self) -> BoolArray:
        """(m,), whether it is one of the path's own locations."""
        return self.row == np.floor(self.row)


def with_turn_changes(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    columns: list[int],
    tilt: TiltBounds | None = None,
) -> UnwrappedPath:
    """Insert a location into every move in which an axis may change its turn, but at no location.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, unwrapped
    columns : of the axes that wind, among the machine's axes
    tilt : bounds on the lean at the path's locations; between two of them its directions turn evenly
    """
    row, angles = np.arange(len(rotary), dtype=float), rotary
    for column in columns:
        which = machine.rotary_columns.index(column)
        new, changes = find_turn_changes(angles[:, which], machine.axes[column].limits)
        rows = np.concatenate([np.arange(len(angles), dtype=float), new])
        order = np.argsort(rows, kind="stable")
        exact = np.concatenate([angles[:, which], changes])[order]
        angles = interpolate(angles, rows[order])
        # Interpolation rounds; the angle must be exact.
        angles[:, which] = exact
        row = np.interp(rows[order], np.arange(len(row)), row)
    admitted = np.ones(len(row), dtype=bool)
    if len(row) == len(toolpath):
        return UnwrappedPath(toolpath, rotary, row, admitted)
    if tilt is not None:
        between = np.flatnonzero(row != np.floor(row))
        bounds = bounds_between(tilt, row[between])
        for column in columns:
            other = 1 - machine.rotary_columns.index(column)
            angles[between] = keep_lean(machine, angles[between], other, bounds)
        admitted[between] = bounds.admits(tool_axes(machine, angles[between]))
    path = filled(toolpath, row, tool_axes(machine, rotary))
    path = replace(path, normal=turned(toolpath.normal, row), axis=turned(toolpath.axis, row))
    return UnwrappedPath(path, angles, row, admitted)


def bounds_between(tilt: TiltBounds, row: Array) -> TiltBounds:
    """Return bounds on the lean at fractional rows, (m,); they bind between two locations where both do."""
    beside = tuple(bounds_between(b, row) for b in tilt.beside)
    return replace(tilt, reference=turned(tilt.reference, row), beside=beside)


def keep_lean(machine: Machine, rotary: Array, other: int, bounds: TiltBounds) -> Array:
    """Change one angle of postures so that the bounds on the lean hold: by the smallest of `CHANGES`.

    Parameters
    ----------
    rotary : (m, 2), rad, chain order
    other : 0 or 1, the angle to change
    bounds : of the m postures

    Returns
    -------
    (m, 2), rad; unchanged where no such angle keeps the bounds
    """
    tried = np.repeat(rotary[:, None], len(CHANGES), axis=1)
    limits = machine.axes[machine.rotary_columns[other]].limits
    tried[..., other] = np.clip(tried[..., other] + CHANGES, limits.low, limits.high)
    good = bounds.admits(tool_axes(machine, tried))
    # The first that holds; 0, if none does.
    return np.asarray(tried[np.arange(len(rotary)), np.argmax(good, axis=1)])


def find_turn_changes(angles: Array, limits: Limits) -> tuple[Array, Array]:
    """Find where an axis passes angles that two turns reach, with no location at these angles.

    Parameters
    ----------
    angles : (n,), rad, unwrapped

    Returns
    -------
    rows : (s,), fractional: 3.25 is a quarter of the move from location 3 to 4
    changes : (s,), rad, the middle of those angles
    """
    low, width = limits.low, limits.span - TURN
    # With two turns every angle has two; towards an open end nothing is ever rewound.
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
    changes = low + width / 2.0 + TURN * (first[row] + number)
    return row + (changes - angles[row]) / (angles[row + 1] - angles[row]), changes
