"""Lead and lean: how the tool leans along the feed and across it.

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

import numpy as np

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.geometry import Array, arctan2, normalise, perpendicular
from fiveaxis.toolpath.bounds import INSIDE_OF, TiltBounds
from fiveaxis.toolpath.path import Toolpath

Range = tuple[float, float]

# mm: a shorter travel perpendicular to the reference has no direction.
SHORTEST_TRAVEL = 1e-9


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
    """Check a range of lead or lean in degrees.

    Raises
    ------
    SettingError
        Empty, reversed or outside −90…90°.
    """
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


def lead_lean_bounds(toolpath: Toolpath, lead: Range | None, lean: Range | None) -> tuple[TiltBounds, ...]:
    """Return ranges of lead and lean as bounds, two for each range.

    Parameters
    ----------
    toolpath : with surface normals at its cuts
    lead, lean : smallest and largest angle, rad; None for no bound

    Raises
    ------
    ToolpathError
        A path without normals, or a location without a feed direction.
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


def _combined_tilt(angles: list[float]) -> float:
    """Compute the tilt of a lead and a lean, rad."""
    return math.atan(math.hypot(*(math.tan(a) for a in angles)))


def _directions_at_cuts(toolpath: Toolpath) -> Array:
    """Return feed directions at cuts; a location without travel takes the nearest one along the path.

    Raises
    ------
    ToolpathError
        Neither a location nor its neighbour has a direction.
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
    """Return the direction of travel perpendicular to the reference, (n, 3) unit vectors, else NaN."""
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
