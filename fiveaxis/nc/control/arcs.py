"""Circular moves as a control reads them: from centre or radius to points on the arc."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array

Pair = tuple[float, float]

# mm: so much may the radii at begin and end of an arc differ, as in LinuxCNC: always up to the first, and up
# to the second where it is less than the share of the radius.
ROUNDING, LARGEST_DIFFERENCE, LARGEST_SHARE = 0.005, 0.5, 0.001

# mm: nearer points are one point, and the arc between them a full circle.
SAME_POINT = 1e-9


@dataclass(frozen=True)
class Arc:
    """An arc in its plane; its radius grows in proportion to the angle where the ends differ.

    Parameters
    ----------
    centre : mm
    start : rad, from the plane's first axis to its second
    sweep : rad, negative clockwise
    radii : mm, at begin and end
    """

    centre: Pair
    start: float
    sweep: float
    radii: Pair

    @property
    def length(self) -> float:
        """Length in the plane, mm."""
        return abs(self.sweep) * (self.radii[0] + self.radii[1]) / 2.0

    def parts(self, tolerance: float) -> int:
        """Count the equal chords that stay within a tolerance, mm, of the arc; at least four for a circle.

        A chord over the angle φ is ``r (1 − cos φ/2)`` off at its middle.
        """
        share = min(tolerance / max(self.radii), 1.0)
        step = min(4.0 * math.asin(math.sqrt(share / 2.0)), math.pi / 2.0)
        # The step of a quarter divides a circle into four, not into five, whatever the last digit says.
        return max(1, math.ceil(abs(self.sweep) / step - 1e-9))

    def points(self, parts: int) -> Array:
        """Place the ends of equal chords, (parts, 2) mm; the begin of the arc isn't among them."""
        share = np.arange(1, parts + 1) / parts
        angle = self.start + self.sweep * share
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * share
        return np.array(self.centre) + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def arc_about(begin: Pair, end: Pair, centre: Pair, *, clockwise: bool) -> Arc:
    """Make an arc about a centre; from a point to the same point it is a full circle.

    Parameters
    ----------
    begin, end, centre : mm, in the plane

    Raises
    ------
    ValueError
        No radius, or radii at begin and end that rounding doesn't explain; the message says which.
    """
    first, last = math.dist(begin, centre), math.dist(end, centre)
    if first < SAME_POINT:
        raise ValueError("the arc begins at its centre; correct I, J, K")
    difference = abs(first - last)
    if difference > LARGEST_DIFFERENCE or difference > max(ROUNDING, LARGEST_SHARE * first):
        raise ValueError(
            f"the arc begins {first:.6g} mm from its centre and ends {last:.6g} mm from it; correct the end "
            "or I, J, K, which are read as the way from begin to centre"
        )
    start = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    turn = math.atan2(end[1] - centre[1], end[0] - centre[0]) - start
    full = 2.0 * math.pi
    sweep = (-turn if clockwise else turn) % full
    if sweep == 0.0 or math.dist(begin, end) < SAME_POINT:
        sweep = full
    return Arc(centre, start, -sweep if clockwise else sweep, (first, last))


def arc_of_radius(begin: Pair, end: Pair, radius: float, *, clockwise: bool) -> Arc:
    """Make the arc of a radius: the one below half a turn, or the one above if the radius is negative.

    Parameters
    ----------
    begin, end : mm, in the plane
    radius : mm

    Raises
    ------
    ValueError
        Begin and end are one point, or further apart than the diameter; the message says which.
    """
    way = math.dist(begin, end)
    if way < SAME_POINT:
        raise ValueError("an arc of radius R from a point to itself may lie anywhere; give I, J, K")
    half = way / 2.0
    if half - abs(radius) > max(ROUNDING, LARGEST_SHARE * abs(radius)):
        raise ValueError(
            f"R{radius:g} is too small: begin and end of the arc are {way:.6g} mm apart; correct R or the end"
        )
    height = math.sqrt(max(radius * radius - half * half, 0.0))
    # Clockwise, the centre of the shorter arc lies to the right of the way from begin to end.
    side = height / way if clockwise == (radius > 0.0) else -height / way
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    centre = ((begin[0] + end[0]) / 2.0 + side * dy, (begin[1] + end[1]) / 2.0 - side * dx)
    return arc_about(begin, end, centre, clockwise=clockwise)
