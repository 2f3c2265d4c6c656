"""Rotary angles that keep the tool axis in the plane of its directions before and after a cut.

Rotary axes that turn in proportion move the tool axis along a cone. Where it leaves the plane by more than
`AXIS_TOLERANCE`, blocks inserted into the cut keep it in the plane. Along a curve the plane is the chord of a
cone, and the tool axis may be between both.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, BoolArray, IntArray, angle_between, arcsin, arctan2, product
from fiveaxis.model.kinematics.inverse import rotary_angles
from fiveaxis.model.kinematics.poses import linear_positions, tool_axes
from fiveaxis.model.kinematics.singularity import singular_angles, singular_direction
from fiveaxis.model.kinematics.windings import within_limits
from fiveaxis.model.machine.chain import why_not_orienting
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.toolpath.dividing import blended, interpolate
from fiveaxis.model.toolpath.path import Toolpath

# rad: largest angle between the tool axis and the plane of its directions at both ends of a cut, and between
# the tool axis of a thinned motion and that of the given one.
AXIS_TOLERANCE = math.radians(0.05)
# Largest speed of a rotary axis in the plane, as a multiple of that of the faster one in proportion, measured
# in this many equal parts of a cut. Near the singular direction an axis would turn nearly all at once, and in
# a move of more than half a turn it would reverse.
FASTEST, PARTS = 1.25, 16
# As this may happen within one part: shares of the cut, measured on both sides of where the tool axis passes
# the singular direction.
BESIDE = np.array([0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2])
# rad: most by which a curve of tool axes is taken to leave the plane of a move.
MOST_BOW = math.radians(0.2)
# Directions with a shorter cross product span no plane.
NO_PLANE = 1e-9
# rad: an axis that moves by no more stands.
STILL = 1e-9
TURN = 2.0 * math.pi
Kind = TypeVar("Kind", bound=np.generic)


@dataclass(frozen=True, eq=False)
class AxisPlanes:
    """The planes of a path's moves, and the moves filled in their plane.

    Parameters
    ----------
    machine : two rotary and three linear axes
    rotary : (n, 2), rad, chain order, at the given rows
    axes : (n, 3), unit vectors, the tool axes there
    normal : (n − 1, 3), unit normal of each move's plane; zero where the directions span no plane
    cutting : (n − 1,), which moves cut
    allowed : (n − 1,), rad, by how much the axis may leave the plane
    off : (n − 1,), rad, by how much the axis leaves the plane if the rotary axes turn in proportion; 0 in
        moves that don't cut, or turn too little to exceed the tolerance
    kept : (n − 1,), moves in which inserted rows lie in the plane
    """

    machine: Machine
    rotary: Array
    axes: Array
    normal: Array
    cutting: BoolArray
    allowed: Array
    off: Array
    kept: BoolArray

    @classmethod
    def of(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        rotary: Array,
        *,
        hold: Collection[str] = (),
        cone: float = 0.0,
    ) -> AxisPlanes:
        """Measure the moves of a path, and choose those to fill in their plane.

        These are the cuts in which the tool axis would leave its plane by more than the tolerance, except
        where in the plane a rotary axis would turn faster than `FASTEST` or, unlike in proportion, a held
        axis would move, an axis exceed a limit or the tool enter the cone: of a half angle, rad, about the
        singular direction. Rotary angles, (n, 2) rad, are in chain order.
        """
        axes = tool_axes(machine, rotary)
        across = np.cross(axes[:-1], axes[1:])
        size = np.linalg.norm(across, axis=1, keepdims=True)
        normal = np.divide(across, size, out=np.zeros_like(across), where=size > NO_PLANE)
        # A curve on the sphere leaves its chord by at most an eighth of its squared length.
        length = np.abs(np.diff(rotary, axis=0)).sum(axis=1)
        cutting, none = toolpath.cutting[1:], np.zeros(len(normal))
        turning = np.flatnonzero(cutting & (length**2 / 8.0 > AXIS_TOLERANCE))
        allowed = AXIS_TOLERANCE + np.minimum(_bows(toolpath, axes, normal), MOST_BOW)
        planes = cls(machine, rotary, axes, normal, cutting, allowed, none, none > 0.0)
        off, kept = planes.off.copy(), planes.kept.copy()
        if len(turning):
            off[turning] = _Trial(planes, toolpath, turning).off
        # Rotary axes that tilt the tool in one direction only have no alternative.
        able = why_not_orienting(machine.chain) is None
        leaving = np.flatnonzero(able & (off > allowed) & normal.any(axis=1))
        if len(leaving):
            trial = _Trial(planes, toolpath, leaving)
            kept[leaving] = (
                trial.turns_evenly & trial.keeps_limits() & trial.keeps_still(hold) & trial.keeps_out(cone)
            )
        return replace(planes, off=off, kept=kept)

    @property
    def left(self) -> BoolArray:
        """(n − 1,), cuts in which the tool axis leaves its plane and no inserted rows prevent it."""
        return (self.off > self.allowed) & ~self.kept

    def angles(self, move: IntArray, axis: Array) -> Array:
        """Measure the angle between tool axes, (m, 3), and the planes of their moves, (m,) rad.

        If both directions of a move are equal, the angle is measured from that direction.
        """
        out = arcsin(np.minimum(np.abs(np.einsum("ni,ni->n", axis, self.normal[move])), 1.0))
        none = np.flatnonzero(~self.normal[move].any(axis=1))
        if len(none):
            ends = (angle_between(axis[none], self.axes[move[none] + end]) for end in (0, 1))
            out[none] = np.minimum(*ends)
        return np.asarray(out)

    def rotary_at(self, row: Array) -> Array:
        """Compute the rotary angles of a filled path, (m, 2) rad, at fractional rows, (m,)."""
        found = interpolate(self.rotary, row)
        move = np.floor(row).astype(np.int64)
        some = np.flatnonzero((row > move) & np.append(self.kept, False)[move])
        if len(some):
            found[some] = self.within(move[some], row[some] - move[some])
        return found

    def demanded(self, row: Array) -> Array:
        """Return the normals of the planes that a filled path keeps in the moves to its rows, (m, 3).

        They are zero for moves that don't cut, leave their plane, or may leave it.
        """
        move = np.maximum(np.ceil(row).astype(np.int64) - 1, 0)
        keeps = self.cutting & (self.kept | (self.off <= AXIS_TOLERANCE))
        keeps = keeps[move] & (row > 0.0)
        return np.asarray(np.where(keeps[:, None], self.normal[move], 0.0))

    def fastest(self, row: Array) -> float:
        """Measure the fastest turn in a block of a kept move, as a multiple of an even turn along the move.

        It is at least 1; the even turn is that of the axis with the larger one.
        """
        move = np.ceil(row[1:]).astype(np.int64) - 1
        some = np.flatnonzero(self.kept[move])
        turns = np.abs(np.diff(self.rotary_at(row), axis=0))[some].max(axis=1)
        most = np.abs(np.diff(self.rotary, axis=0)).max(axis=1)[move[some]]
        return float((turns / most / np.diff(row)[some]).max(initial=1.0))

    def in_proportion(self, move: IntArray, share: Array) -> Array:
        """Return the angles at shares of moves, (m, 2) rad, if both axes turn in proportion."""
        before, after = self.rotary[move], self.rotary[move + 1]
        return np.asarray(before + share[:, None] * (after - before))

    def within(self, move: IntArray, share: Array) -> Array:
        """Solve the angles at shares of moves, (m, 2) rad, with the tool axis turning evenly in the plane.

        Branch and turn are those closest to the angles in proportion; NaN where the machine can't orient the
        tool.
        """
        near = self.in_proportion(move, share)
        found = rotary_angles(self.machine, blended(self.axes[move], self.axes[move + 1], share))
        found += TURN * np.round((near - found) / TURN)
        far = np.abs(found - near).max(axis=-1)
        best = np.where(np.isnan(far), math.inf, far).argmin(axis=0)
        return np.asarray(found[best, np.arange(len(best))])


@dataclass(frozen=True, eq=False)
class _Trial:
    """Comparison, within c moves, of angles in proportion and angles in the plane, at p shares."""

    planes: AxisPlanes
    path: Toolpath
    moves: IntArray

    @cached_property
    def shares(self) -> Array:
        """(c, p), ascending shares of each move: equal parts, and near the singular direction."""
        even = np.tile(np.arange(1, PARTS) / PARTS, (len(self.moves), 1))
        beside = self._nearest_to_pole()[:, None] + np.concatenate([-BESIDE[1:], BESIDE])
        return np.sort(np.hstack([even, np.clip(beside, 0.0, 1.0)]), axis=1)

    @cached_property
    def move(self) -> IntArray:
        """(c · p,), the move of each share."""
        return np.repeat(self.moves, self.shares.shape[1])

    @property
    def share(self) -> Array:
        """(c · p,), the shares."""
        return self.shares.reshape(-1)

    def _nearest_to_pole(self) -> Array:
        """Find the share of each move, (c,), at which the tool axis is nearest to the singular direction."""
        first, last = self.planes.axes[self.moves], self.planes.axes[self.moves + 1]
        pole, angle = singular_direction(self.planes.machine), angle_between(first, last)
        # On ``a cos ψ + e sin ψ`` for ψ from 0 to the angle, or at the nearer end.
        ahead = np.cross(self.planes.normal[self.moves], first)
        peak = arctan2(product(ahead, pole), product(first, pole)) % math.pi
        share = np.divide(peak, angle, out=np.full_like(peak, 2.0), where=angle > NO_PLANE)
        return np.where(share <= 1.0, share, np.abs(product(last, pole)) > np.abs(product(first, pole)))

    @cached_property
    def linear(self) -> Array:
        """(c · p, 2), rad, in proportion."""
        return self.planes.in_proportion(self.move, self.share)

    @cached_property
    def found(self) -> Array:
        """(c · p, 2), rad, in the plane."""
        return self.planes.within(self.move, self.share)

    @property
    def off(self) -> Array:
        """(c,), rad, by how much the axis leaves the plane in proportion."""
        angles = self.planes.angles(self.move, tool_axes(self.planes.machine, self.linear))
        return np.asarray(self._by_move(angles).max(axis=1))

    @property
    def turns_evenly(self) -> BoolArray:
        """(c,), whether no axis turns faster in the plane than `FASTEST`."""
        before, after = self.planes.rotary[self.moves], self.planes.rotary[self.moves + 1]
        angles = np.concatenate([before[:, None], self._by_move(self.found), after[:, None]], axis=1)
        steps = np.abs(np.diff(angles, axis=1)).max(axis=2)
        parts = np.diff(self.shares, axis=1, prepend=0.0, append=1.0)
        most = FASTEST * parts * np.abs(after - before).max(axis=1, keepdims=True)
        return np.asarray((steps <= most + STILL).all(axis=1))

    def keeps_limits(self) -> BoolArray:
        """Check in which moves, (c,), the plane exceeds no limit that is kept in proportion."""
        machine, centre = self.planes.machine, self.path.centres(self.planes.axes)
        middle = centre[self.move] + self.share[:, None] * (centre[self.move + 1] - centre[self.move])

        def exceeds(rotary: Array) -> BoolArray:
            tip = middle - self.path.zone.height * tool_axes(machine, rotary)
            return ~within_limits(machine, linear_positions(machine, tip, rotary))

        found = exceeds(self.found)
        return self._no_worse(exceeds(self.linear) if found.any() else found, found)

    def keeps_still(self, hold: Collection[str]) -> BoolArray:
        """Check in which moves, (c,), held axes have the same angles in the plane as in proportion."""
        held = [self.planes.machine.rotaries.index(letter) for letter in hold]
        still = np.abs(self.found - self.linear)[:, held] <= STILL
        return np.asarray(self._by_move(still).all(axis=(1, 2)))

    def keeps_out(self, cone: float) -> BoolArray:
        """Check in which moves, (c,), the plane enters no singular cone that is avoided in proportion."""
        if not cone:
            return np.ones(len(self.moves), dtype=bool)
        machine, both = self.planes.machine, (self.linear, self.found)
        return self._no_worse(*(singular_angles(machine, tool_axes(machine, r)) < cone for r in both))

    def _no_worse(self, linear: BoolArray, found: BoolArray) -> BoolArray:
        """Check in which moves, (c,), the plane has no fault, or the angles in proportion have one too."""
        return np.asarray(self._by_move(linear).any(axis=1) | ~self._by_move(found).any(axis=1))

    def _by_move(self, values: NDArray[Kind]) -> NDArray[Kind]:
        """Reshape values at all shares, (c · p, …) → (c, p, …)."""
        return values.reshape(*self.shares.shape, *values.shape[1:])


def _bows(toolpath: Toolpath, axes: Array, normal: Array) -> Array:
    """Measure how far the curve of the tool axes leaves the plane in each move, (n − 1,) rad; 0 along chords.

    The curve's second derivative at a location is that of the parabola through it and its neighbours; of the
    two of a move the smaller one counts if they have one sign.
    """
    curved = toolpath.curved[1:]
    if not curved.any():
        return np.zeros(len(normal))
    length = np.where(curved, toolpath.lengths[1:], 1.0)[:, None]
    slope = np.diff(axes, axis=0) / length
    inner = np.append(False, curved[1:] & curved[:-1])
    bend = np.zeros_like(axes)
    bend[: len(inner)][inner] = (2.0 * np.diff(slope, axis=0) / (length[1:] + length[:-1]))[inner[1:]]
    begin, end = np.einsum("ni,ni->n", bend[:-1], normal), np.einsum("ni,ni->n", bend[1:], normal)
    # Where the curve ends it goes on as it did before.
    known = np.append(inner, False)
    begin, end = np.where(known[:-1], begin, end), np.where(known[1:], end, begin)
    least = np.where(begin * end > 0.0, np.minimum(np.abs(begin), np.abs(end)), 0.0)
    return np.asarray(np.where(curved, least * length[:, 0] ** 2 / 8.0, 0.0))
