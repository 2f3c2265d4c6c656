"""Moves that start and end at rest: trapezoids and triangles of speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.motion.bounds import axis_bounds, require_motion, unaccelerated_times
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.timing import STANDSTILL


@dataclass(frozen=True, eq=False)
class Profile:
    """Speed of moves from rest to rest: they speed up evenly, cruise, and brake as they sped up.

    Distances are in mm, rad, or shares of a block, and speeds and accelerations in the same unit per second.

    Parameters
    ----------
    distance : (…), covered by the whole move, 0 or more
    peak : (…), highest speed that is reached; the given speed, except in a triangle
    acceleration : (…), while speeding up, and its negative while braking; infinite for a jump in speed
    """

    distance: Array
    peak: Array
    acceleration: Array

    @property
    def ramp(self) -> Array:
        """(…), s: how long the move speeds up, and how long it brakes."""
        return self.peak / self.acceleration

    @property
    def cruise(self) -> Array:
        """(…), s: how long the speed stays at its peak, 0 in a triangle."""
        moving = self.peak > 0.0
        ways = np.divide(self.distance, self.peak, out=np.zeros_like(self.peak), where=moving)
        return np.maximum(ways - self.ramp, 0.0)

    @property
    def time(self) -> Array:
        """(…), s: how long the move takes."""
        return self.cruise + 2.0 * self.ramp

    @property
    def durations(self) -> Array:
        """(…, 3), s: the phases: speeding up, cruising, braking."""
        return np.stack([self.ramp, self.cruise, self.ramp], axis=-1)

    @property
    def start_speeds(self) -> Array:
        """(…, 3): speed at the start of every phase."""
        return np.stack([np.zeros_like(self.peak), self.peak, self.peak], axis=-1)

    @property
    def accelerations(self) -> Array:
        """(…, 3): acceleration in every phase."""
        still = np.zeros_like(self.acceleration)
        return np.stack([self.acceleration, still, -self.acceleration], axis=-1)

    def at(self, time: ArrayLike) -> tuple[Array, Array]:
        """Compute way and speed at a time after the start of every move.

        Parameters
        ----------
        time : s, broadcast against the moves; before the start and after the end the move rests

        Returns
        -------
        way, speed : broadcast shape
        """
        now = np.clip(time, 0.0, self.time)
        left = self.time - now
        early, late = np.minimum(now, self.ramp), np.minimum(left, self.ramp)
        # The speed while speeding up is peak · t / ramp: no product of 0 s and an infinite acceleration.
        shape = np.broadcast_shapes(now.shape, self.peak.shape)
        ratio = [
            np.divide(part, self.ramp, out=np.ones(shape), where=np.broadcast_to(self.ramp > 0.0, shape))
            for part in (early, late)
        ]
        way = self.peak * (0.5 * early * ratio[0] + (now - early))
        braked = np.maximum(self.ramp - left, 0.0)
        way = way - 0.5 * self.peak * braked * (1.0 - ratio[1])
        return way, self.peak * np.minimum(ratio[0], ratio[1])


def move_profiles(
    distance: ArrayLike,
    speed: ArrayLike,
    *,
    acceleration: ArrayLike | None = None,
    ramp: ArrayLike | None = None,
) -> Profile:
    """Find the speed profiles of single moves from rest to rest, given acceleration or acceleration time.

    With ``a = v / t_a`` and the ramp's way ``D_a = v t_a / 2`` the move takes::

        t = 2 t_a + (D − 2 D_a) / v     if D ≥ 2 D_a    (trapezoid)
        t = 2 sqrt(D / a)               else            (triangle)

    The paper prints the triangle as ``sqrt(2 t_a D / v)``, which is ``sqrt(2 D / a)``: the time in which half
    the acceleration and no braking covers D. A triangle speeds up over D/2 in ``sqrt(D / a)`` and brakes as
    long; only this meets the trapezoid at ``D = 2 D_a``, where both are ``2 t_a``.

    Parameters
    ----------
    distance : (…), mm or rad, 0 or more
    speed : (…), mm/s or rad/s: the feed
    acceleration : (…), mm/s² or rad/s²
    ramp : (…), s, acceleration time t_a from rest to `speed`, instead of `acceleration`; 0 for a jump

    Returns
    -------
    One profile for the broadcast shape

    Raises
    ------
    SettingError
        A negative distance, a speed or acceleration that isn't positive, both or neither of the last two.

    References
    ----------
    Edem & Balogun (2018), Eqs. (2) and (3), the latter misprinted.
    """
    if (acceleration is None) == (ramp is None):
        raise SettingError("give either an acceleration or an acceleration time (ramp)")
    way, top = np.asarray(distance, dtype=float), np.asarray(speed, dtype=float)
    _require(way >= 0.0, "distance", "0 or more")
    _require((top > 0.0) & np.isfinite(top), "speed", "above 0")
    if acceleration is not None:
        rate = np.asarray(acceleration, dtype=float)
        _require(rate > 0.0, "acceleration", "above 0")
    else:
        seconds = np.asarray(ramp, dtype=float)
        _require((seconds >= 0.0) & np.isfinite(seconds), "ramp", "0 s or more")
        shape = np.broadcast_shapes(top.shape, seconds.shape)
        rate = np.divide(top, seconds, out=np.full(shape, np.inf), where=seconds > 0.0)
    return _peaked(way, top, rate)


def block_profiles(motion: Motion, machine: Machine) -> Profile:
    """Find the speed profiles of the blocks of a motion, each from rest to rest.

    In a block all axes move in proportion: axis a covers its share ``Δq_a`` of the way from 0 to 1. So the
    share's speed is bounded by ``v_a / |Δq_a|`` and its acceleration by ``A_a / |Δq_a|`` of every axis, and
    by the time that the block takes at its feed. An axis's speed is the profile's times ``Δq_a``.

    Parameters
    ----------
    motion : n blocks, with their times at the programmed feed
    machine : highest speeds and accelerations; what an axis doesn't state sets no bound

    Returns
    -------
    (n,), in shares of the block; distance 0 where no axis moves

    Raises
    ------
    ToolpathError, MachineError
        Numbers that aren't finite; axes that the machine hasn't; limits that aren't positive.

    References
    ----------
    Edem & Balogun (2018), Eqs. (2)-(3), for one axis.
    """
    require_motion(motion, machine)
    moves = np.abs(motion.moves)
    moving = (moves > STANDSTILL).any(axis=1)
    with np.errstate(divide="ignore"):  # an axis that stands sets no bound
        rate = (axis_bounds(machine).acceleration / moves).min(axis=1)
    top = np.divide(1.0, unaccelerated_times(motion, machine), out=np.zeros(len(motion)), where=moving)
    return _peaked(moving.astype(float), top, rate)


def _peaked(distance: Array, speed: Array, acceleration: Array) -> Profile:
    way, top, rate = np.broadcast_arrays(distance, speed, acceleration)
    # In a triangle the peak is reached halfway: v² = 2 a D/2.
    triangle = np.sqrt(np.where(way > 0.0, rate, 0.0) * way)
    return Profile(way, np.minimum(top, triangle), rate)


def _require(holds: BoolArray, what: str, bound: str) -> None:
    if not np.all(holds):
        raise SettingError(f"{what} must be {bound} (isn't in {int(np.sum(~holds))} moves)")
