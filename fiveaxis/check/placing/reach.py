"""Which places of the part let the machine reach a path: limits, and what the tool must keep clear of."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, IntArray, cross, perpendicular, product, search_box
from fiveaxis.check.collision.accessibility import find_accessible
from fiveaxis.check.collision.assumed import is_described
from fiveaxis.check.collision.surroundings import Clearances, Surroundings
from fiveaxis.model import (
    INSIDE,
    Constraints,
    Limits,
    Machine,
    Toolpath,
    Triple,
    as_triple,
    hold_singular,
    into_limits,
    linear_positions,
    rotary_angles,
    within_limits,
)

# Locations of the path, and tool axes at each of them, on which places are tried.
LOCATIONS, RINGS, AXES_PER_RING = 120, 4, 16
# Places that are tried in the whole range, and again around the best one; the second range, as a share.
TRIES, AROUND = 400, 0.1
# Distance to keep from the ends of linear axes: mm, and at most this share of their travel; and from bodies.
MARGIN, MARGIN_SHARE = 10.0, 0.05
# What a mm away from the table's centre counts beside a mm beyond a limit, at one location.
ASIDE = 1e-3
# What a location without a posture counts, as mm beyond a limit.
LOST = 1000.0
# Every so many postures of a location are tested against bodies before all others are.
FEW = 8


@dataclass(frozen=True, eq=False)
class Reach:
    """Optimum of some locations of a path, with the axis values that they need wherever the part stands.

    With the rotary angles given, the linear axes' values are linear in the work offset.

    Parameters
    ----------
    toolpath : the locations, n
    machine : with its bodies, at any place of the part
    rotation : deg, of the part
    clearances : to keep; None where nothing is kept clear
    axis : (n, a, 3), sampled tool axes, unit vectors, workpiece frame
    positions : (n, a, b, l), mm, of the linear axes with the offset 0, for each branch of rotary angles
    allowed : (n, a, b), postures that the bounds and the rotary axes allow, clear of part and fixtures
    slopes : (n, a, b, l, 3), mm per mm of offset
    low, high : (l,), mm, limits
    """

    toolpath: Toolpath
    machine: Machine
    rotation: Triple
    clearances: Clearances | None
    axis: Array
    positions: Array
    allowed: BoolArray
    slopes: Array
    low: Array
    high: Array

    @classmethod
    def of(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        constraints: Constraints,
        rotation: Triple,
        around: Surroundings | None = None,
    ) -> Reach:
        """Sample tool axes within the bounds at some of the locations where a cut begins or ends.

        They are kept clear of part and fixtures around, as of the machine's bodies; with None, of nothing.
        """
        zoned = constraints.zoned(toolpath)
        tilt = constraints.lean_bounds(zoned)
        known = np.flatnonzero(zoned.bounding & np.isfinite(tilt.reference).all(axis=1))
        rows = spread(zoned.pivot, known)
        leans = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, RINGS)
        turns = np.linspace(0.0, 2.0 * np.pi, AXES_PER_RING, endpoint=False)
        reference = tilt.reference[rows]
        across = perpendicular(reference)
        aside = cross(reference, across)
        axes = [
            np.cos(lean) * reference + np.sin(lean) * (np.cos(turn) * across + np.sin(turn) * aside)
            for lean, turn in itertools.product(leans, turns)
        ]
        ways = np.stack(axes, axis=1)
        by_axis = np.stack(axes)
        found = hold_singular(rotary_angles(machine, by_axis), by_axis, machine)
        # For each tool axis and branch: (axes, branches, n, …).
        rotary = into_limits(machine, found.swapaxes(0, 1))
        located = zoned.at(rows)
        tips = located.tips(by_axis)[:, None]
        zero, *shifted = (
            linear_positions(machine.with_setup(offset, rotation), tips, rotary)
            for offset in ((0.0, 0.0, 0.0), *map(as_triple, np.eye(3)))
        )
        allowed = within_limits(_endless(machine), zero) & tilt.admits(ways, rows).T[:, None]
        columns = machine.linear_columns
        slopes = np.stack([(one - zero)[..., columns] for one in shifted], axis=-1)

        def by_location(found: NDArray[Any]) -> NDArray[Any]:
            return np.moveaxis(found, 2, 0)

        free = by_location(allowed)
        if around is not None:
            own = tuple(body for body in machine.bodies if body.link != machine.code.links[0])
            beside = replace(around, stock=None, blank=None)
            if is_described(machine, machine.code.table):
                beside = replace(beside, above_table=None)
            mask = find_accessible(located, replace(machine, bodies=own), beside)
            if mask is not None:
                where = np.nonzero(free.any(axis=2))
                free[where] &= mask.clear(where[0], ways[where])[:, None]
        return cls(
            located,
            machine,
            rotation,
            None if around is None else around.clearances,
            ways,
            np.nan_to_num(by_location(zero[..., columns])),
            free,
            np.nan_to_num(by_location(slopes)),
            machine.low[columns],
            machine.high[columns],
        )

    def __len__(self) -> int:
        return len(self.positions)

    def excess(self, offset: Triple, margin: Array | float = 0.0) -> Array:
        """Compute how far postures are beyond the linear limits, (n, a, b) mm; negative inside."""
        positions = self.positions + product(self.slopes, np.array(offset))
        past = np.max(np.maximum(positions - self.high, self.low - positions) + margin, axis=-1)
        return np.asarray(np.where(self.allowed, past, np.inf))

    def clear(self, offset: Triple, wanted: BoolArray, margin: float = 0.0) -> BoolArray:
        """Check which locations have a posture, of those wanted, (n, a, b), clear of the table, (n,).

        All of the head counts as if it turned about the tool axis. The margin, mm, is added to every
        clearance.
        """
        axes = np.any(wanted, axis=2)
        there = self.machine.with_setup(offset, self.rotation)
        mask = None
        if self.clearances is not None:
            around = Surroundings(clearances=self.clearances)
            mask = find_accessible(self.toolpath, there, around, extra=margin, whole_head=True)
        if mask is None:
            return np.asarray(axes.any(axis=1))
        found = np.zeros(len(self), dtype=bool)
        for step in (FEW, 1):
            rows, tried = np.nonzero(axes[:, ::step] & ~found[:, None])
            found[rows[mask.clear(rows, self.axis[rows, step * tried])]] = True
        return found

    def reached(self, offset: Triple) -> BoolArray:
        """Check which locations have a posture within all limits that is clear, (n,)."""
        return self.clear(offset, self.excess(offset) <= 0.0)

    def reached_wherever(self) -> BoolArray:
        """Check which locations have a posture that some place of the part may allow, (n,)."""
        return np.asarray(self.allowed.any(axis=(1, 2)))

    def nearest(self, start: Triple) -> Triple:
        """Find a place, no lower than `start` and near it, at which most locations are reached; whole mm."""
        if not len(self):
            return start
        span = self.high - self.low
        margin = np.minimum(MARGIN, MARGIN_SHARE * span)
        best, least = np.array(start), math.inf

        def cost(offset: Array) -> float:
            nonlocal best, least
            there = as_triple(offset)
            past = self.excess(there, margin)
            # A posture that no place allows counts as a metre, and so does a mm into the table.
            lost = np.clip(past.min(axis=(1, 2)), 0.0, LOST)
            sunk = LOST * len(self) * max(start[2] - offset[2], 0.0)
            found = float(lost.sum() + sunk + ASIDE * np.linalg.norm(offset - start, axis=-1))
            if found < least:  # else bodies can't make it the best
                found += LOST * float(((lost == 0.0) & ~self.clear(there, past <= 0.0, MARGIN)).sum())
            if found < least:
                best, least = offset, found
            return found

        side = 2.0 * float(np.max(span[np.isfinite(span)], initial=MARGIN))
        for size in (side, AROUND * side):
            origin = best
            search_box(lambda u: cost(np.round(origin + (u - 0.5) * size)), np.full(3, 0.5), TRIES)  # noqa: B023
        return as_triple(best + 0.0)  # no -0


def spread(pivot: Array, rows: IntArray) -> IntArray:
    """Choose locations evenly along a path, and those at its ends in each direction."""
    if not len(rows):
        return rows
    even = rows[np.unique(np.linspace(0, len(rows) - 1, LOCATIONS).astype(np.int64))]
    ends = [rows[f(pivot[rows, k])] for f in (np.argmin, np.argmax) for k in range(3)]
    return np.unique(np.concatenate([even, ends]))


def _endless(machine: Machine) -> Machine:
    """Return the machine without limits of its linear axes."""
    axes = tuple(axis if axis.is_rotary else replace(axis, limits=Limits()) for axis in machine.axes)
    return replace(machine, axes=axes)
