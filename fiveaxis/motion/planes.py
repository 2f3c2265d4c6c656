"""The plane of the tool's directions before and after a cut, and rotary angles that keep the tool axis in it.

Rotary axes that turn in proportion take the tool axis along a cone. Where that leaves the plane by more than
`AXIS_TOLERANCE`, blocks inserted into the cut hold the axis in the plane instead.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between
from fiveaxis.kinematics import (
    linear_positions,
    rotary_angles,
    singular_angles,
    singular_direction,
    tool_axes,
    within_limits,
)
from fiveaxis.machine import Machine
from fiveaxis.machine.freedom import why_not_orienting
from fiveaxis.toolpath import Toolpath, interpolate

# rad: largest angle between the tool axis and the plane of its directions at both ends of a cut, and between
# the tool axis of a thinned motion and that of the given one.
AXIS_TOLERANCE = math.radians(0.05)
# In the plane no rotary axis turns faster, in any of so many equal parts of a cut, than so many times the
# quicker of both does where they turn in proportion. Next to the singular direction it would turn most of its
# way at one place, and in a move of more than half a turn the other way round.
FASTEST, PARTS = 1.25, 16
# Next to the singular direction all of that may happen between two of the parts: as shares of the cut, places
# that are looked at on both sides of where it passes nearest.
BESIDE = np.array([0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2])
# Directions whose cross product is shorter than this span no plane.
NO_PLANE = 1e-9
# rad: an axis that moves by no more has kept still.
STILL = 1e-9
TURN = 2.0 * math.pi
Kind = TypeVar("Kind", bound=np.generic)


@dataclass(frozen=True, eq=False)
class AxisPlanes:
    """The planes of a path's moves, and which moves are filled in them.

    Parameters
    ----------
    machine : two rotary and three linear axes
    rotary : (n, 2), rad, chain order, at the given rows
    axes : (n, 3), unit vectors, the tool axes there
    normal : (n − 1, 3), unit vectors at right angles to both directions of each move; zero where they span
        no plane
    cutting : (n − 1,), which moves cut
    off : (n − 1,), rad, how far the axis leaves the plane where rotary axes turn in proportion; 0 in moves
        that don't cut, and in those that turn too little to leave it by more than the tolerance
    kept : (n − 1,), moves in which inserted rows lie in the plane
    """

    machine: Machine
    rotary: Array
    axes: Array
    normal: Array
    cutting: BoolArray
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
        """Measure the moves of a path, and choose those that are filled in their plane.

        They are the cuts in which the tool axis would leave its plane by more than the tolerance. Where a
        rotary axis would turn faster than `FASTEST` in the plane, a held one move, an axis pass a limit or
        the tool enter a cone that they keep where the rotary axes turn in proportion, these do.

        Parameters
        ----------
        toolpath : n locations
        rotary : (n, 2), rad, chain order
        hold : letters of rotary axes that stand still
        cone : rad, half angle about the singular direction
        """
        axes = tool_axes(machine, rotary)
        across = np.cross(axes[:-1], axes[1:])
        size = np.linalg.norm(across, axis=1, keepdims=True)
        normal = np.divide(across, size, out=np.zeros_like(across), where=size > NO_PLANE)
        # A curve on the sphere leaves its chord by an eighth of its length squared at most.
        length = np.abs(np.diff(rotary, axis=0)).sum(axis=1)
        cutting, none = toolpath.cutting[1:], np.zeros(len(normal))
        turning = np.flatnonzero(cutting & (length**2 / 8.0 > AXIS_TOLERANCE))
        planes = cls(machine, rotary, axes, normal, cutting, none, none > 0.0)
        off, kept = planes.off.copy(), planes.kept.copy()
        if len(turning):
            off[turning] = _Trial(planes, toolpath, turning).off
        # Rotary axes that don't lean the tool in two directions have no choice.
        able = why_not_orienting(machine.chain) is None
        leaving = np.flatnonzero(able & (off > AXIS_TOLERANCE) & normal.any(axis=1))
        if len(leaving):
            trial = _Trial(planes, toolpath, leaving)
            kept[leaving] = (
                trial.turns_evenly & trial.keeps_limits() & trial.keeps_still(hold) & trial.keeps_out(cone)
            )
        return replace(planes, off=off, kept=kept)

    @property
    def left(self) -> BoolArray:
        """(n − 1,), cuts in which the tool axis leaves its plane, and is let."""
        return (self.off > AXIS_TOLERANCE) & ~self.kept

    def angles(self, move: IntArray, axis: Array) -> Array:
        """Measure how far tool axes, (m, 3), are from the planes of their moves, (m,) rad.

        Where both directions of a move are the same, that one stands for the plane.
        """
        out = np.arcsin(np.minimum(np.abs(np.einsum("ni,ni->n", axis, self.normal[move])), 1.0))
        none = np.flatnonzero(~self.normal[move].any(axis=1))
        if len(none):
            ends = (angle_between(axis[none], self.axes[move[none] + end]) for end in (0, 1))
            out[none] = np.minimum(*ends)
        return np.asarray(out)

    def rotary_at(self, row: Array) -> Array:
        """Give the rotary angles of a filled path, (m, 2) rad, at fractional rows, (m,)."""
        found = interpolate(self.rotary, row)
        move = np.floor(row).astype(np.int64)
        some = np.flatnonzero((row > move) & np.append(self.kept, False)[move])
        if len(some):
            found[some] = self.within(move[some], row[some] - move[some])
        return found

    def demanded(self, row: Array) -> Array:
        """Give the normals of the planes that a filled path keeps in the moves to its rows, (m, 3).

        A move that doesn't cut, or leaves its plane, has none to keep, and a zero.
        """
        move = np.maximum(np.ceil(row).astype(np.int64) - 1, 0)
        keeps = self.cutting[move] & ~self.left[move] & (row > 0.0)
        return np.asarray(np.where(keeps[:, None], self.normal[move], 0.0))

    def fastest(self, row: Array) -> float:
        """Measure how much faster a rotary axis turns in a block of a kept move than evenly along the move.

        Returns
        -------
        The quickest turn of a block along `row`, as a multiple of the move's larger turn; at least 1
        """
        move = np.ceil(row[1:]).astype(np.int64) - 1
        some = np.flatnonzero(self.kept[move])
        turns = np.abs(np.diff(self.rotary_at(row), axis=0))[some].max(axis=1)
        most = np.abs(np.diff(self.rotary, axis=0)).max(axis=1)[move[some]]
        return float((turns / most / np.diff(row)[some]).max(initial=1.0))

    def in_proportion(self, move: IntArray, share: Array) -> Array:
        """Give the angles at shares of moves, (m, 2) rad, where both axes turn in proportion."""
        before, after = self.rotary[move], self.rotary[move + 1]
        return np.asarray(before + share[:, None] * (after - before))

    def within(self, move: IntArray, share: Array) -> Array:
        """Solve the angles at shares of moves, (m, 2) rad, where the axis turns evenly in the plane.

        Of the branches and their turns they are those next to where the axes are in proportion; NaN where the
        machine can't turn the tool there.
        """
        near = self.in_proportion(move, share)
        found = rotary_angles(self.machine, turned(self.axes[move], self.axes[move + 1], share))
        found += TURN * np.round((near - found) / TURN)
        far = np.abs(found - near).max(axis=-1)
        best = np.where(np.isnan(far), math.inf, far).argmin(axis=0)
        return np.asarray(found[best, np.arange(len(best))])


@dataclass(frozen=True, eq=False)
class _Trial:
    """Moves, (c,), looked at within: in proportion, and in their plane."""

    planes: AxisPlanes
    path: Toolpath
    moves: IntArray

    @cached_property
    def shares(self) -> Array:
        """(c, p), the places in each move that are looked at, in order: equal parts, and beside the pole."""
        even = np.tile(np.arange(1, PARTS) / PARTS, (len(self.moves), 1))
        beside = self._nearest_to_pole()[:, None] + np.concatenate([-BESIDE[1:], BESIDE])
        return np.sort(np.hstack([even, np.clip(beside, 0.0, 1.0)]), axis=1)

    @cached_property
    def move(self) -> IntArray:
        """(c · p,), the move of each place that is looked at."""
        return np.repeat(self.moves, self.shares.shape[1])

    @property
    def share(self) -> Array:
        """As many: where in the move that is."""
        return self.shares.reshape(-1)

    def _nearest_to_pole(self) -> Array:
        """Give the share of each move, (c,), at which the plane is nearest to the singular direction."""
        first, last = self.planes.axes[self.moves], self.planes.axes[self.moves + 1]
        pole, angle = singular_direction(self.planes.machine), angle_between(first, last)
        # Along ``a cos ψ + e sin ψ`` from ψ = 0 to the angle, or at the end that is nearer.
        ahead = np.cross(self.planes.normal[self.moves], first)
        peak = np.arctan2(ahead @ pole, first @ pole) % math.pi
        share = np.divide(peak, angle, out=np.full_like(peak, 2.0), where=angle > NO_PLANE)
        return np.where(share <= 1.0, share, np.abs(last @ pole) > np.abs(first @ pole))

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
        """(c,), rad, how far the axis leaves the plane in proportion."""
        angles = self.planes.angles(self.move, tool_axes(self.planes.machine, self.linear))
        return np.asarray(self._by_move(angles).max(axis=1))

    @property
    def turns_evenly(self) -> BoolArray:
        """(c,), whether no axis turns faster in the plane than `FASTEST`."""
        before, after = self.planes.rotary[self.moves], self.planes.rotary[self.moves + 1]
        course = np.concatenate([before[:, None], self._by_move(self.found), after[:, None]], axis=1)
        steps = np.abs(np.diff(course, axis=1)).max(axis=2)
        parts = np.diff(self.shares, axis=1, prepend=0.0, append=1.0)
        most = FASTEST * parts * np.abs(after - before).max(axis=1, keepdims=True)
        return np.asarray((steps <= most + STILL).all(axis=1))

    def keeps_limits(self) -> BoolArray:
        """Tell where no axis passes a limit in the plane that it keeps in proportion, (c,)."""
        machine, centre = self.planes.machine, self.path.centres(self.planes.axes)
        middle = centre[self.move] + self.share[:, None] * (centre[self.move + 1] - centre[self.move])

        def passes(rotary: Array) -> BoolArray:
            tip = middle - self.path.zone.height * tool_axes(machine, rotary)
            return ~within_limits(machine, linear_positions(machine, tip, rotary))

        found = passes(self.found)
        return self._no_worse(passes(self.linear) if found.any() else found, found)

    def keeps_still(self, hold: Collection[str]) -> BoolArray:
        """Tell where held axes are in the plane where they are in proportion, (c,)."""
        held = [self.planes.machine.rotaries.index(letter) for letter in hold]
        still = np.abs(self.found - self.linear)[:, held] <= STILL
        return np.asarray(self._by_move(still).all(axis=(1, 2)))

    def keeps_out(self, cone: float) -> BoolArray:
        """Tell where the plane leads the tool into no cone that it keeps out of in proportion, (c,).

        The cone stands about the singular direction.
        """
        if not cone:
            return np.ones(len(self.moves), dtype=bool)
        machine = self.planes.machine
        return self._no_worse(
            *(singular_angles(machine, tool_axes(machine, way)) < cone for way in (self.linear, self.found))
        )

    def _no_worse(self, linear: BoolArray, found: BoolArray) -> BoolArray:
        """Tell where a fault is anywhere in a move in the plane only if it is in proportion, too, (c,)."""
        return np.asarray(self._by_move(linear).any(axis=1) | ~self._by_move(found).any(axis=1))

    def _by_move(self, values: NDArray[Kind]) -> NDArray[Kind]:
        """Put values at all places, (c · p, …), move by move, (c, p, …)."""
        return values.reshape(*self.shares.shape, *values.shape[1:])


def turned(first: Array, last: Array, share: Array) -> Array:
    """Turn unit vectors, (m, 3), by a share, (m,), of the angle to others in the plane of both.

    ``(sin((1 − s)θ) a + sin(sθ) b) / sin θ``; NaN where both span no plane.

    References
    ----------
    Shoemake (1985), "Animating rotation with quaternion curves".
    """
    angle = angle_between(first, last)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.sin(np.stack([(1.0 - share) * angle, share * angle])) / np.sin(angle)
    return np.asarray(weights[0][:, None] * first + weights[1][:, None] * last)
