"""Bounds on the angle between the tool axis and a direction; lead and lean, along the feed and across it.

At each cut the feed direction ``t``, the surface normal ``n`` and the side ``b = n × t`` make a frame::

            n   o                       n   o
            |  /                        |  /
            | / lead > 0                | / lean > 0
            |/                          |/
    --------+--------> t  feed  --------+--------> b  to the left of the feed
        seen from the side          seen from behind

The *lead* is the angle of the tool axis ``o`` seen from the side, ``atan2(o·t, o·n)``; with a positive lead
the shank is tipped forwards and the tip trails. The *lean* is the angle seen along the feed,
``atan2(o·b, o·n)``. Each end of a range is a plane through the contact, hence a bound on the angle to a
direction: lead ≤ λ is ``(n sin λ − t cos λ)·o ≥ 0``, an angle of at most 90° to that vector.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    IntArray,
    SettingError,
    ToolpathError,
    angle_between,
    arctan2,
    normalise,
    perpendicular,
)
from fiveaxis.model.toolpath.path import Toolpath

# Most sweeps over all bounds in `TiltBounds.draw_in`; two planes at a sharp angle take the most.
MOST_ROUNDS = 60
# Prefix in names of half-spaces, 0…90° of a direction; the rest of the name is the bound's text.
INSIDE_OF = "inside of "
Range = tuple[float, float]
# Distance of tool axes from the ends of the tilt range (rad), so that rounding doesn't push them out of it.
INSIDE = 1e-9

# mm: a shorter travel perpendicular to the reference has no direction.
SHORTEST_TRAVEL = 1e-9


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
        """Check whether tool axes, (m, ..., 3), at the given locations keep every bound, (m, ...)."""
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
        other until all hold, to so many rad inside each, at most its middle. Where bounds barely or never
        meet, the result may still break one: check it with `admits`.
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


def feed_directions(toolpath: Toolpath, reference: Array) -> Array:
    """Return the feed direction perpendicular to the reference at each location, (n, 3) unit vectors.

    Any perpendicular direction where there is no travel across the reference; NaN where the reference is NaN.
    """
    ahead = _travel_directions(toolpath, reference)
    still = np.isfinite(reference).all(axis=1) & np.isnan(ahead).any(axis=1)
    ahead[still] = perpendicular(reference[still])
    return ahead


def lead_lean(toolpath: Toolpath, axis: Array) -> tuple[Array, Array]:
    """Compute lead and lean, (n,) rad each, of tool axes, (n, 3), at locations; NaN without normals."""
    feed = feed_directions(toolpath, toolpath.normal)
    upright = np.sum(axis * toolpath.normal, axis=1)
    across = np.cross(toolpath.normal, feed)
    lead, lean = (arctan2(np.sum(axis * side, axis=1), upright) for side in (feed, across))
    return lead, lean


def require_lead_lean(name: str, low: float, high: float) -> None:
    """Check a range of lead or lean: not empty, not reversed, within −90…90°; `SettingError` else."""
    if not -90.0 < low < high < 90.0:
        raise SettingError(
            f"{name} range {low:g}…{high:g} deg is empty, reversed or not inside -90…90 deg; write the "
            "smaller angle first, for example -5:20"
        )


def tilt_of(lead: Range | None, lean: Range | None) -> Range:
    """Compute the range of angles to the normal that ranges of lead and lean imply, rad.

    ``tan² tilt = tan² lead + tan² lean``; a missing range is −90…90°.
    """
    square = math.pi / 2.0
    ends = [(-square, square) if r is None else r for r in (lead, lean)]
    least = [max(low, -high, 0.0) for low, high in ends]
    most = [max(abs(low), abs(high)) for low, high in ends]
    if max(most) >= square:
        return _combined_tilt(least), square
    return _combined_tilt(least), _combined_tilt(most)


def require_common_tilt(tilt: Range, lead: Range | None, lean: Range | None) -> None:
    """Check that a range of the tilt, deg, meets what lead and lean, rad, give; `SettingError` else."""
    low, high = (math.degrees(end) for end in tilt_of(lead, lean))
    if high <= tilt[0] or low >= tilt[1]:
        raise SettingError(
            f"tilt range {tilt[0]:g}…{tilt[1]:g} deg is never met: lead and lean lean the tool by "
            f"{low:.4g}…{high:.4g} deg; change one of the ranges"
        )


def lead_lean_bounds(toolpath: Toolpath, lead: Range | None, lean: Range | None) -> tuple[TiltBounds, ...]:
    """Return ranges of lead and lean, rad or None, as bounds, two for each range.

    `ToolpathError` for a path without normals at its cuts, or a location without a feed direction.
    """
    ranges = {name: ends for name, ends in (("lead", lead), ("lean", lean)) if ends is not None}
    if not ranges:
        return ()
    if not toolpath.has_normals:
        raise ToolpathError(
            f"has no surface normals, so {' and '.join(ranges)} mean nothing; say which surface it cuts "
            "(part, --part), or use cone (--cone 20)",
            file=toolpath.name,
        )
    normal, forward = toolpath.normal, _directions_at_cuts(toolpath)
    across = {"lead": forward, "lean": np.cross(normal, forward)}
    bounds = []
    for name, (low, high) in ranges.items():
        for sign, end, side in ((1.0, low, ">="), (-1.0, high, "<=")):
            inside = sign * (math.cos(end) * across[name] - math.sin(end) * normal)
            text = f"{INSIDE_OF}{name} {side} {math.degrees(end):g} deg"
            bounds.append(TiltBounds(inside, 0.0, math.pi / 2.0, text))
    return tuple(bounds)


def require_touching(toolpath: Toolpath, what: str) -> None:
    """Raise `ToolpathError` unless it is known where the cutter touches, in words of what hangs on that."""
    if not toolpath.has_normals:
        raise ToolpathError(
            f"has no surface normals, so where the cutter touches isn't known, nor {what}; say which surface "
            "it cuts (part, --part)",
            file=toolpath.name,
        )


def cutting_speed_bounds(toolpath: Toolpath, speed: float, spindle: float) -> TiltBounds:
    """Return the angles to the normal at which the cutting edge is at least so fast, mm/s, at the contact.

    `ToolpathError` for a path without normals; `SettingError` if no part of the cutter's zone is that fast,
    at the spindle's speed in rad/s.
    """
    require_touching(toolpath, "how fast its edge cuts")
    zone, radius = toolpath.zone, speed / spindle
    fastest = float(zone.contact_radius(math.pi / 2.0))
    if radius >= fastest:
        raise SettingError(
            f"least_cutting_speed {60e-3 * speed:g} m/min is out of reach: at {30.0 * spindle / math.pi:g} "
            f"rev/min {toolpath.tool} cuts at less than {60e-3 * fastest * spindle:.4g} m/min wherever it "
            "touches; raise the spindle's speed or lower this one"
        )
    low = zone.least_angle(radius)
    return TiltBounds(toolpath.normal, low, math.pi - low, "normal")


def _combined_tilt(angles: list[float]) -> float:
    """Compute the tilt of a lead and a lean, rad."""
    return math.atan(math.hypot(*(math.tan(a) for a in angles)))


def _directions_at_cuts(toolpath: Toolpath) -> Array:
    """Return feed directions at cuts; a location without travel takes the nearest one along the path.

    `ToolpathError` where no neighbour has one either.
    """
    ahead, normal = _travel_directions(toolpath, toolpath.normal), toolpath.normal
    known = np.flatnonzero(np.isfinite(ahead).all(axis=1))
    still = np.flatnonzero(np.isfinite(normal).all(axis=1) & np.isnan(ahead).any(axis=1))
    if len(known):
        after = np.searchsorted(known, still).clip(1, max(len(known) - 1, 1))
        sides = known[np.stack([after - 1, after.clip(max=len(known) - 1)])]
        nearest = np.where(still - sides[0] <= sides[1] - still, sides[0], sides[1])
        ahead[still] = _perpendicular_directions(ahead[nearest], normal[still])
    lost = still[np.isnan(ahead[still]).any(axis=1)]
    if len(lost):
        raise ToolpathError(
            f"location {lost[0]} has no feed direction, because the path doesn't move across its surface "
            "normal there, so lead and lean mean nothing; use tilt (--tilt 15:75), the angle to the normal",
            file=toolpath.name,
            line=toolpath.place(int(lost[0])).line,
        )
    return ahead


def _travel_directions(toolpath: Toolpath, reference: Array) -> Array:
    """Return the direction of travel perpendicular to the reference, (n, 3) unit vectors, else NaN.

    That of a given location doesn't depend on what was inserted beside it.
    """
    ahead = _directions_between(toolpath, reference)
    if toolpath.inserted.any():
        given = np.flatnonzero(~toolpath.inserted)
        ahead[given] = _directions_between(toolpath.shaped(toolpath.shape), reference[given])
    return ahead


def _directions_between(toolpath: Toolpath, reference: Array) -> Array:
    steps = np.diff(toolpath.pivot, axis=0, prepend=np.nan, append=np.nan)
    into, out = steps[:-1], steps[1:]
    curved, curve = np.append(toolpath.curved, False), toolpath.curve
    if curve is not None:
        into, out = into + curve.bows[:, 1], out + np.append(curve.bows[1:, 0], np.zeros((1, 3)), axis=0)
    before, after = (np.linalg.norm(step, axis=1) for step in (into, out))
    # A step more than twice as long as its neighbour leads to another pass, and a step of length 0 comes from
    # a repeated location: neither has the feed direction.
    jumped, jumps = (before > 2.0 * after) & (after > 0.0), (after > 2.0 * before) & (before > 0.0)
    # A chord beside a curve that doesn't continue it does so, too.
    jumped, jumps = jumped | (curved[1:] & ~curved[:-1]), jumps | (curved[:-1] & ~curved[1:])
    into = np.where((jumped | ~(before > 0.0))[:, None], 0.0, into)
    out = np.where((jumps | ~(after > 0.0))[:, None], 0.0, out)
    return _perpendicular_directions(into + out, reference)


def _perpendicular_directions(travel: Array, reference: Array) -> Array:
    """Return the travel, (n, 3) mm, perpendicular to the reference as unit vectors; NaN where too short."""
    across = travel - reference * np.sum(travel * reference, axis=1, keepdims=True)
    known = np.linalg.norm(across, axis=1) > SHORTEST_TRAVEL
    return normalise(np.where(known[:, None], across, np.nan))
