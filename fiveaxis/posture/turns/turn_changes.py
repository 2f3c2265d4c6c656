"""Seams: where an axis may change its turn though no location lies there.

An axis of exactly one turn reaches each angle on one turn, and its two ends, the same angle, on two: only
there can it be turned back. With a little more than one turn there is a band of such angles, and a path that
takes long steps may jump over it. Either way a location is put into the move that passes it. The
turns before and behind it differ, so no place is put in for nothing.

The contact there lies on the straight way between two contacts, and both angles change in proportion to the
way; where that would break a bound on the tool's lean, the other angle gives way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray, normalise
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.toolpath import TiltBounds, Toolpath, interpolate
from fiveaxis.toolpath.dividing import through

# How far the other angle may give way (rad): least first, to both sides.
GIVING_WAY = np.radians(np.concatenate([[0.0], np.ravel([[a, -a] for a in np.arange(1, 101) * 0.05])]))


@dataclass(frozen=True, eq=False)
class Course:
    """A path with the places put in where an axis may change its turn.

    Parameters
    ----------
    toolpath : the locations, and the places
    rotary : (m, 2), rad, chain order, unwrapped
    place : (m,), where on the path as it was each of them is, in rows: 3.25 lies between 3 and 4
    admitted : (m,), whether the bounds on the lean hold; true of the path's own locations
    """

    toolpath: Toolpath
    rotary: Array
    place: Array
    admitted: BoolArray

    @property
    def own(self) -> BoolArray:
        """(m,), whether it is one of the path's own locations."""
        return self.place == np.floor(self.place)


def with_seams(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    columns: list[int],
    tilt: TiltBounds | None = None,
) -> Course:
    """Put a location into every move in which an axis passes angles of two turns without a location there.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, unwrapped
    columns : of the axes that wind, in the order of the machine's axes
    tilt : bounds on the lean at the path's locations; between two of them its directions turn evenly
    """
    place, angles = np.arange(len(rotary), dtype=float), rotary
    for column in columns:
        which = machine.rotary_columns.index(column)
        new, seam = passed_seams(angles[:, which], machine.axes[column].limits)
        rows = np.concatenate([np.arange(len(angles), dtype=float), new])
        order = np.argsort(rows, kind="stable")
        exact = np.concatenate([angles[:, which], seam])[order]
        angles = interpolate(angles, rows[order])
        # Interpolation rounds; the angle must be on the seam.
        angles[:, which] = exact
        place = np.interp(rows[order], np.arange(len(place)), place)
    admitted = np.ones(len(place), dtype=bool)
    if len(place) == len(toolpath):
        return Course(toolpath, rotary, place, admitted)
    if tilt is not None:
        between = np.flatnonzero(place != np.floor(place))
        bounds = bounds_between(tilt, place[between])
        for column in columns:
            other = 1 - machine.rotary_columns.index(column)
            angles[between] = give_way(machine, angles[between], other, bounds)
        admitted[between] = bounds.admits(tool_axes(machine, angles[between]))
    return Course(_path_through(toolpath, machine, rotary, place), angles, place, admitted)


def _path_through(toolpath: Toolpath, machine: Machine, rotary: Array, place: Array) -> Toolpath:
    """Lead a path through places between its locations: on the straight way of the contact, if it's known.

    Else it is the way of the point of the tool's axis at the height of the arc that touches, as in
    `fiveaxis.motion.fill_in`.
    """
    path = through(toolpath, place, toolpath.centres(tool_axes(machine, rotary)))
    contact, normal = _evenly(toolpath.contact, place), directions_between(toolpath.normal, place)
    touches = (np.isfinite(contact) & np.isfinite(normal)).all(axis=1, keepdims=True)
    own = (place == np.floor(place))[:, None]
    pivot = np.where(touches & ~own, toolpath.zone.pivot(contact, normal), path.pivot)
    unknown = np.where(touches | own, 0.0, np.nan)
    return replace(
        path,
        pivot=pivot,
        contact=np.where(own, path.contact, contact + unknown),
        normal=np.where(own, path.normal, normal + unknown),
        axis=directions_between(toolpath.axis, place),
    )


def bounds_between(tilt: TiltBounds, place: Array) -> TiltBounds:
    """Give bounds on the lean at places, (m,) in rows; they bind between two locations where both do."""
    every = [replace(b, reference=directions_between(b.reference, place), beside=()) for b in tilt.all]
    return replace(every[0], beside=tuple(every[1:]))


def directions_between(vectors: Array, place: Array) -> Array:
    """Turn unit vectors, (n, 3), evenly from row to row; (m, 3) at places, NaN next to unknown ones."""
    between = place != np.floor(place)
    found = vectors[np.floor(place).astype(np.int64)]
    found[between] = normalise(_evenly(vectors, place[between]))
    return found


def _evenly(columns: Array, place: Array) -> Array:
    """Take columns, (n, k), at places, (m,); unknown only next to unknown ones."""
    low, high = np.floor(place).astype(np.int64), np.ceil(place).astype(np.int64)
    share = (place - low)[:, None]
    return np.where(share > 0.0, (1.0 - share) * columns[low] + share * columns[high], columns[low])


def give_way(machine: Machine, rotary: Array, other: int, bounds: TiltBounds) -> Array:
    """Change one angle of postures so that the bounds on the lean hold, as little as `GIVING_WAY` knows.

    Parameters
    ----------
    rotary : (m, 2), rad, chain order
    other : 0 or 1, the angle that gives way
    bounds : of the m postures

    Returns
    -------
    (m, 2), rad; unchanged where no such angle keeps the bounds
    """
    tried = np.repeat(rotary[:, None], len(GIVING_WAY), axis=1)
    limits = machine.axes[machine.rotary_columns[other]].limits
    tried[..., other] = np.clip(tried[..., other] + GIVING_WAY, limits.low, limits.high)
    good = bounds.admits(tool_axes(machine, tried))
    # The first that holds; where none does, the posture as it was.
    return np.asarray(tried[np.arange(len(rotary)), np.argmax(good, axis=1)])


def passed_seams(angles: Array, limits: Limits) -> tuple[Array, Array]:
    """Find where an axis passes angles at which two turns are open to it, with no location among them.

    Parameters
    ----------
    angles : (n,), rad, unwrapped

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
