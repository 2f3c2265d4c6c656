"""Circular moves: from centre or radius to points on the arc."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array
from fiveaxis.nc.writing.table_parts import ArcBounds

Pair = tuple[float, float]

# Of controls whose table doesn't say it.
USUAL = ArcBounds()

# mm: closer points are equal, and the arc between them is a full circle.
SAME_POINT = 1e-9


@dataclass(frozen=True)
class Arc:
    """An arc in its plane; if the radii differ, the radius changes in proportion to the angle.

    Parameters
    ----------
    centre : mm
    start : rad, from the plane's first axis to its second
    sweep : rad, negative clockwise
    radii : mm, at start and end
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
        """Return the number of equal chords within a tolerance, mm, of the arc; at least four for a circle.

        The deviation of a chord over the angle φ is ``r (1 − cos φ/2)``.
        """
        share = min(tolerance / max(self.radii), 1.0)
        step = min(4.0 * math.asin(math.sqrt(share / 2.0)), math.pi / 2.0)
        # 1e-9: rounding must not divide a circle of quarter steps into five.
        return max(1, math.ceil(abs(self.sweep) / step - 1e-9))

    def points(self, parts: int) -> Array:
        """Return the ends of equal chords, (parts, 2) mm, without the start of the arc."""
        share = np.arange(1, parts + 1) / parts
        angle = self.start + self.sweep * share
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * share
        return np.array(self.centre) + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def arc_about(start: Pair, end: Pair, centre: Pair, *, clockwise: bool, bounds: ArcBounds = USUAL) -> Arc:
    """Return the arc about a centre, mm in the plane; a full circle if start and end are equal.

    `ValueError` for no radius, or radii at start and end that differ by more than the control allows.
    """
    first, last = math.dist(start, centre), math.dist(end, centre)
    if first < SAME_POINT:
        raise ValueError("the arc starts at its centre; correct I, J, K")
    if min(first, last) < (bounds.reach or 0.0):
        raise ValueError(f"a radius of {min(first, last):.3g} mm, below {bounds.reach:g} mm; correct I, J, K")
    difference, most = abs(first - last), max(bounds.rounding, bounds.share * max(first, last))
    if difference > min(most, bounds.largest):
        raise ValueError(
            f"the arc starts {first:.6g} mm from its centre and ends {last:.6g} mm from it, more than "
            f"{min(most, bounds.largest):.4g} mm apart; correct the end or I, J, K, which are taken from the "
            "start to the centre"
        )
    angle = math.atan2(start[1] - centre[1], start[0] - centre[0])
    turn = math.atan2(end[1] - centre[1], end[0] - centre[0]) - angle
    full = 2.0 * math.pi
    sweep = (-turn if clockwise else turn) % full
    if sweep == 0.0 or math.dist(start, end) < SAME_POINT:
        sweep = full
    return Arc(centre, angle, -sweep if clockwise else sweep, (first, last))


def arc_of_radius(
    start: Pair, end: Pair, radius: float, *, clockwise: bool, bounds: ArcBounds = USUAL
) -> Arc:
    """Return the arc of a radius, mm: below half a turn, or above if the radius is negative.

    Start and end are mm in the plane; `ValueError` if they are equal, or further apart than the diameter.
    """
    chord = math.dist(start, end)
    if chord < SAME_POINT:
        raise ValueError("a full circle can't be given by R; write I, J, K")
    half = chord / 2.0
    most = max(bounds.rounding, bounds.share * abs(radius)) if bounds.reach is None else bounds.reach
    if half - abs(radius) > most:
        raise ValueError(f"R{radius:g} is too small for ends {chord:.6g} mm apart; correct R or the end")
    height = math.sqrt(max(radius * radius - half * half, 0.0))
    # Clockwise, the centre of the shorter arc lies to the right of the chord.
    side = height / chord if clockwise == (radius > 0.0) else -height / chord
    dx, dy = end[0] - start[0], end[1] - start[1]
    centre = ((start[0] + end[0]) / 2.0 + side * dy, (start[1] + end[1]) / 2.0 - side * dx)
    return arc_about(start, end, centre, clockwise=clockwise, bounds=bounds)
