"""The cutter's profile, and where it touches a surface.

A cutter is a body of revolution. Its profile is a chain of arcs (a sharp corner is an arc of radius 0) with
straight lines between them. On a convex profile the angle φ between the tool axis *o* and the surface normal
*n* determines which arc touches. With the arc's radius r, its centre at radius a and height b above the tip,
and ``e`` the unit vector along the component of *n* perpendicular to *o* (from the contact to the axis)::

    contact = tip + b·o − a·e − r·n

A ball has a = 0 and b = r, so turning it about its centre keeps the contact; every other cutter has to be
moved as it leans. This is the relation of cutter contact and cutter location for general (APT) cutters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, ToolError, angle_between

# rad: below this lean the contact of a flat bottom may be anywhere on it.
LEAST_LEAN = math.radians(1.0)
# rad, tolerance at the ends of a zone.
ROUNDING = 1e-9
# rad, largest angle between points of an outline.
OUTLINE_STEP = math.radians(5.0)
# Shares of a range of angles that are tried for the widest place of a strip, and how often it is narrowed.
TRIED, NARROWINGS = np.linspace(-1.0, 1.0, 33), 6
# mm and deg: beyond these a figure is a slip, and squares and ratios of two leave what a number can hold.
SMALLEST, LARGEST = 1e-9, 1e4


@dataclass(frozen=True)
class Zone:
    """One arc of a cutter's profile.

    Parameters
    ----------
    name : ``ball``, ``corner``, ``edge``, ``barrel``…
    radius : mm, of the arc; 0 for an edge
    offset : mm, of the arc's centre from the tool axis; negative where it lies beyond the axis (barrels)
    height : mm, of the arc's centre above the tip
    low, high : rad, angle between tool axis and surface normal at which the arc touches
    """

    name: str
    radius: float
    offset: float
    height: float
    low: float
    high: float

    @property
    def least(self) -> float:
        """Smallest angle, rad, at which the contact is one point: above 0 next to a flat bottom."""
        return max(self.low, LEAST_LEAN) if self.offset else self.low

    def holds(self, low: float, high: float) -> bool:
        """Check whether a range of angles, rad, lies within the zone."""
        return self.least - ROUNDING <= low and high <= self.high + ROUNDING

    def contact_radius(self, angle: ArrayLike) -> Array:
        """Compute the contact's distance from the axis, mm, at angles to the normal, rad: ``a + r sin φ``.

        Twice that is the cutter's effective diameter; for a ball it is ``D sin φ``.
        """
        return np.asarray(self.offset + self.radius * np.sin(angle))

    def least_angle(self, radius: float) -> float:
        """Return the least angle to the normal, rad, at which the contact is a radius, mm, off the axis.

        It is 0 where all contacts are farther off; a right angle where none is.
        """
        return math.asin(min(max((radius - self.offset) / self.radius, 0.0), 1.0)) if self.radius else 0.0

    def pivot(self, contact: Array, normal: Array) -> Array:
        """Compute the arc's centre for contacts, (n, 3) mm: ``contact + r·n``."""
        return contact + self.radius * normal

    def tip(self, pivot: Array, normal: Array, axis: Array) -> Array:
        """Compute the tool tip, (..., 3) mm, for the arc's centre: ``pivot − b·o + a·e``.

        Where the normal is NaN the axis passes through the pivot.
        """
        aside = self.offset * across(normal, axis) if self.offset else 0.0
        return pivot - self.height * axis + aside

    def pivot_of_tip(self, tip: Array, normal: Array, axis: Array) -> Array:
        """Invert `tip`: ``tip + b·o − a·e``, (..., 3) mm."""
        return tip + self.height * axis - self.offset * across(normal, axis)

    def principal_radii(self, angle: float) -> tuple[float, float]:
        """Smaller and larger principal radius of curvature of the cutter where it touches at an angle, mm.

        They are r in the plane of axis and normal, and ``r + a / sin θ`` across it. From this angle on, no
        contact of the zone has a smaller or a larger one.
        """
        across_plane = self.radius + (self.offset / math.sin(angle) if self.offset else 0.0)
        return min(self.radius, across_plane), max(self.radius, across_plane)

    def strip_radius(self, angle: Array, sideways: Array, bend: float, height: float) -> Array:
        """Compute the radius of the strip that the arc cuts, in the section across the feed, mm.

        It is that of the circle as wide as the strip at a height above the contact: ridges of that height
        remain between strips of that width. Along a surface of curvature κ the posture keeps to the feed, so
        the cutter turns about an axis 1/κ below. It consists of balls about the circle of the arc's centres;
        each sweeps a ring, and the widest one at the height is searched along the circle (own derivation; a
        barrel, whose arc's centre lies beyond the axis, is what all these balls have in common). On a
        straight feed this is the cutter's outline seen along it, whose radius tends to
        ``r + a sin²ψ / sin θ`` for low ridges, with ψ between the section and the plane of axis and normal.

        Parameters
        ----------
        angle : rad, θ between axis and normal
        sideways : 0…1, cos²ψ: 0 where the cutter leans along the feed, 1 where it leans across it
        bend : 1/mm, κ, at least 0: convex along the feed
        height : mm, above 0

        References
        ----------
        Vickers, Quan (1989), Ball-mills versus end-mills for curved surface machining, for an edge that leans
        along the feed.
        """
        angle, sideways = np.broadcast_arrays(angle, sideways)
        sine, cosine = np.sin(angle)[..., None], np.cos(angle)[..., None]
        ahead, across_feed = np.sqrt(1.0 - sideways)[..., None], np.sqrt(sideways)[..., None]
        sign, width = (-1.0 if self.offset < 0.0 else 1.0), np.zeros(np.shape(angle))

        def reach(side: float, turn: Array) -> Array:
            rise, swing = self.offset * (1.0 - np.cos(turn)), self.offset * np.sin(turn)
            y = side * (ahead * swing - across_feed * cosine * rise)
            x, z = across_feed * swing + ahead * cosine * rise, self.radius + sine * rise
            far = 1.0 + np.sqrt((1.0 + bend * z) ** 2 + (bend * x) ** 2)
            above = (z * (2.0 + bend * z) + bend * x * x) / far - height
            above = above if sign < 0.0 else np.maximum(above, 0.0)
            wide = np.sqrt(np.maximum(self.radius**2 - above**2, 0.0))
            return np.where(above <= self.radius, sign * (y + wide), -np.inf)

        for side in (1.0, -1.0):
            best, step = np.zeros(np.shape(angle)), math.pi
            for _ in range(NARROWINGS):
                turn = best[..., None] + step * TRIED
                far = reach(side, turn)
                best = np.take_along_axis(turn, far.argmax(axis=-1)[..., None], axis=-1)[..., 0]
                step *= 4.0 / len(TRIED)
            width += sign * far.max(axis=-1)
        return np.asarray((width**2 / 4.0 + height**2) / (2.0 * height))

    def outline(self) -> Array:
        """Sample the arc from its lower end, (m, 2) mm: distance from the axis, height above the tip."""
        parts = max(1, math.ceil((self.high - self.low) / OUTLINE_STEP)) if self.radius else 0
        # The samples include the widest point, where the surface is vertical.
        widest = [math.pi / 2.0] if self.low < math.pi / 2.0 < self.high and self.radius else []
        angle = np.union1d(np.linspace(self.low, self.high, parts + 1), widest)
        along = self.offset + self.radius * np.sin(angle), self.height - self.radius * np.cos(angle)
        return np.column_stack(along)


def require_dimension(what: str, value: float, unit: str = "mm") -> None:
    """Raise `ToolError` unless a tool's dimension is a number from `SMALLEST` to `LARGEST`."""
    if not (math.isfinite(value) and value > 0.0):
        raise ToolError(f"{what} is {value:g} {unit}; it must be a number above 0")
    if not SMALLEST <= value <= LARGEST:
        raise ToolError(f"{what} is {value:g} {unit}; it must be from {SMALLEST:g} to {LARGEST:g} {unit}")


@dataclass(frozen=True)
class Cutter:
    """A cutter's profile, from the tip upwards.

    Parameters
    ----------
    shape : its name in `fiveaxis.model.toolpath.shapes.SHAPES`
    figures : dimensions of the shape, in the order of its short form
    diameter : mm, the largest
    zones : by increasing angle, adjoining
    main : index of the zone that is meant to cut
    length : mm, from the tip to the upper end of the cutting edges; None if unknown
    """

    shape: str
    figures: tuple[float, ...]
    diameter: float
    zones: tuple[Zone, ...]
    main: int = 0
    length: float | None = None

    def __post_init__(self) -> None:
        for figure in (*self.figures, self.diameter):
            if not math.isfinite(figure):
                raise ToolError(f"tool {self}: {figure:g} isn't a finite number")
        if self.length is not None:
            require_dimension(f"tool {self}: cutting length", self.length)
        top = self.outline()[-1, 1]
        if self.length is not None and self.length < top - 1e-9:
            raise ToolError(
                f"tool {self}: cutting length {self.length:g} mm must be at least {top:g} mm, where its "
                "profile ends"
            )

    def __str__(self) -> str:
        return ":".join([self.shape, *(f"{figure:g}" for figure in self.figures)])

    @property
    def is_ball(self) -> bool:
        """Whether the tool turns about one point in all of its zones: a ball's centre."""
        return len(self.zones) == 1 and self.zones[0].offset == 0.0 and self.zones[0].radius > 0.0

    def zone_for(self, low: float, high: float) -> Zone:
        """Find the zone that touches over a range of angles between tool axis and normal, rad.

        `ToolError` if the range spans several zones, or none touches there.
        """
        # The main zone comes first, as both zones match at a shared end.
        zones = [self.zones[self.main], *self.zones]
        zone = next((z for z in zones if z.holds(low, high)), None)
        if zone is None:
            known = ", ".join(
                f"{math.degrees(z.least):.4g}…{math.degrees(z.high):.4g} deg ({z.name})" for z in self.zones
            )
            raise ToolError(
                f"tool {self} touches with one part of its profile within {known}; the tilt range "
                f"{math.degrees(low):.4g}…{math.degrees(high):.4g} deg isn't within one of these; narrow it "
                "or use another cutter"
            )
        return zone

    def zones_at(self, angle: Array) -> tuple[Array, Array, Array]:
        """Return radius, offset and height, (n,) mm each, of the zone that touches at angles, (n,) rad.

        `ToolError` if none does at one of them, or the cutter stands on its flat bottom.
        """
        figures = np.full((3, len(angle)), np.nan)
        for zone in (*self.zones, self.zones[self.main]):
            here = (angle >= zone.least - ROUNDING) & (angle <= zone.high + ROUNDING)
            figures[:, here] = np.array([zone.radius, zone.offset, zone.height])[:, None]
        bad = np.flatnonzero(np.isnan(figures[0]) & ~np.isnan(angle))
        if len(bad):
            least, most = self.zones[0].least, self.zones[-1].high
            raise ToolError(
                f"tool {self} has no single contact at {math.degrees(angle[bad[0]]):.4g} deg between its "
                f"axis and the surface normal (row {bad[0]}, {len(bad)} such rows); it touches at "
                f"{math.degrees(least):.4g}…{math.degrees(most):.4g} deg"
            )
        return figures[0], figures[1], figures[2]

    def tips(self, contact: Array, normal: Array, axis: Array) -> Array:
        """Compute the tip for contacts, (n, 3) mm, each with the zone that touches at its angle.

        `ToolError` as `zones_at`.
        """
        radius, offset, height = self.zones_at(angle_between(axis, normal))
        across_axis = across(normal, axis)
        pivot = contact + radius[:, None] * normal
        return pivot - height[:, None] * axis + offset[:, None] * across_axis

    def contacts(self, tip: Array, normal: Array, axis: Array) -> Array:
        """Compute where the cutter touches surfaces of given normals, (n, 3) mm; the inverse of `tips`."""
        return tip + (tip - self.tips(tip, normal, axis))

    def outline(self) -> Array:
        """Sample the profile from the tip upwards, (m, 2) mm: distance from the axis, height."""
        points = np.vstack([np.zeros((1, 2)), *(zone.outline() for zone in self.zones)])
        if self.length is not None and self.length > points[-1, 1]:
            points = np.vstack([points, [points[-1, 0], self.length]])
        new = np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9)
        return np.asarray(points[new])


def across(normal: Array, axis: Array) -> Array:
    """Return the unit vector along the normal's component perpendicular to the tool axis, (..., 3).

    Zero where the normal is unknown (NaN) or parallel to the axis.
    """
    rest = normal - np.sum(normal * axis, axis=-1, keepdims=True) * axis
    length = np.linalg.norm(rest, axis=-1, keepdims=True)
    found = length > 1e-12  # false for NaN
    return np.divide(rest, length, out=np.zeros_like(rest), where=np.broadcast_to(found, rest.shape))
