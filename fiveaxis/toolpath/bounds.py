"""Bounds on the angle between the tool axis and a direction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray, angle_between, normalise, perpendicular

# Most sweeps over all bounds in `TiltBounds.draw_in`; two planes at a sharp angle take the most.
MOST_ROUNDS = 60
# Prefix in names of half-spaces, 0…90° of a direction; the rest of the name is the bound's text.
INSIDE_OF = "inside of "


@dataclass(frozen=True, eq=False)
class TiltBounds:
    """Bounds on the angle between the tool axis and a reference direction.

    Parameters
    ----------
    reference : (n, 3), unit vectors in the workpiece frame; NaN where the tool axis is free (within links and
        rapid moves)
    low, high : rad, 0 ≤ low < high ≤ π
    name : of the reference: ``normal`` or ``programmed axis``
    beside : further bounds that hold at once: angles to the normal at which the path's zone of the cutter
        touches, lead and lean, a plane
    """

    reference: Array
    low: float
    high: float
    name: str
    beside: tuple[TiltBounds, ...] = ()

    def __repr__(self) -> str:
        return f"<TiltBounds at {len(self.reference)} locations: {' and '.join(b.text for b in self.all)}>"

    @property
    def all(self) -> tuple[TiltBounds, ...]:
        """Every bound that holds at once."""
        return (self, *self.beside)

    def at(self, rows: IntArray | slice) -> TiltBounds:
        """Return the bounds of some locations."""
        return replace(self, reference=self.reference[rows], beside=tuple(b.at(rows) for b in self.beside))

    def only(self, rows: BoolArray) -> TiltBounds:
        """Return the bounds restricted to some locations, (n,); the others are free."""
        free = np.where(rows[:, None], 0.0, np.nan)
        return replace(self, reference=self.reference + free, beside=tuple(b.only(rows) for b in self.beside))

    @property
    def text(self) -> str:
        """The bound in words, without those in `beside`."""
        if self.name.startswith(INSIDE_OF):
            return self.name.removeprefix(INSIDE_OF)
        return f"{math.degrees(self.low):g}…{math.degrees(self.high):g} deg of the {self.name}"

    @property
    def cosines(self) -> tuple[float, float]:
        """Smallest and largest cosine of the angle."""
        return math.cos(self.high), math.cos(self.low)

    def angles(self, axis: Array) -> Array:
        """Compute the tilt of tool axes, (n, 3) unit vectors; (n,) rad, NaN where they are free."""
        return angle_between(axis, self.reference)

    def admits(self, axis: Array, rows: IntArray | slice = slice(None)) -> BoolArray:
        """Check whether tool axes keep every bound.

        Parameters
        ----------
        axis : (m, ..., 3), unit vectors, for m locations
        rows : their indices

        Returns
        -------
        (m, ...)
        """
        shape = (-1, *(1,) * (axis.ndim - 2), 3)
        inside = np.ones(axis.shape[:-1], dtype=bool)
        for bound in self.all:
            cosine = np.sum(axis * bound.reference[rows].reshape(shape), axis=-1)
            low, high = bound.cosines
            inside &= ~((cosine < low) | (cosine > high))
        return inside

    def draw_in(self, axis: Array, inset: float) -> Array:
        """Turn tool axes, (n, 3) unit vectors, into the bounds by small rotations.

        An axis outside a bound is turned straight towards or away from its reference, one bound after the
        other until all hold. Where bounds barely or never meet, the result may still break one: check it
        with `admits`.

        Parameters
        ----------
        inset : rad, how far inside each bound to stop; at most its middle
        """
        drawn = axis.copy()
        for _ in range(MOST_ROUNDS):
            before = drawn
            for bound in self.all:
                drawn = bound._turned_in(drawn, inset)
            if drawn is before or not np.nanmax(np.abs(drawn - before), initial=0.0) > 0.0:
                break
        return drawn

    def _turned_in(self, axis: Array, inset: float) -> Array:
        inset = min(inset, (self.high - self.low) / 2.0)
        angle = self.angles(axis)
        wanted = np.clip(angle, self.low + inset, self.high - inset)
        outside = np.flatnonzero((angle < self.low) | (angle > self.high))
        if not len(outside):
            return axis
        reference, turned = self.reference[outside], axis.copy()
        across = axis[outside] - reference * np.sum(axis[outside] * reference, axis=1, keepdims=True)
        along = ~(np.linalg.norm(across, axis=1) > 1e-9)
        across[along] = perpendicular(reference[along])
        target = wanted[outside, None]
        turned[outside] = np.cos(target) * reference + np.sin(target) * normalise(across)
        return turned
