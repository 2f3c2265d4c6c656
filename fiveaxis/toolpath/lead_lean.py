"""Lead and lean: how the tool leans along the feed and across it.

At each cut the feed direction ``t``, the surface normal ``n`` and the side ``b = n × t`` make a frame::

            n   o                       n   o
            |  /                        |  /
            | / lead > 0                | / lean > 0
            |/                          |/
    --------+--------> t  feed  --------+--------> b  to the left of the feed
        seen from the side          seen from behind

The *lead* is the angle at which the tool axis ``o`` is seen from the side: ``atan2(o·t, o·n)``; positive, it
is tipped forwards, its tip lagging behind. The *lean* is the angle seen along the feed: ``atan2(o·b, o·n)``.
Each end of a range is a plane through the contact, so each is a bound on the angle to a direction: lead ≤ λ
is ``(n sin λ − t cos λ)·o ≥ 0``, an angle of at most 90° to that vector.
"""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.geometry import Array, normalise, perpendicular
from fiveaxis.toolpath.bounds import INSIDE_OF, TiltBounds
from fiveaxis.toolpath.path import Toolpath

Range = tuple[float, float]

# A way across the reference shorter than this (mm) has no direction.
SHORTEST_WAY = 1e-9


def feed_directions(toolpath: Toolpath, reference: Array) -> Array:
    """Give the direction of travel across the reference at each location, (n, 3) unit vectors.

    A location that doesn't travel across it gets some direction at right angles; NaN where the reference is.
    """
    ahead = _ways(toolpath, reference)
    still = np.isfinite(reference).all(axis=1) & np.isnan(ahead).any(axis=1)
    ahead[still] = perpendicular(reference[still])
    return ahead


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
    """Give the angles to the normal, rad, that ranges of lead and lean, rad, leave.

    ``tan² tilt = tan² lead + tan² lean``; a missing range is −90…90°.
    """
    square = math.pi / 2.0
    ends = [(-square, square) if r is None else r for r in (lead, lean)]
    least = [max(low, -high, 0.0) for low, high in ends]
    most = [max(abs(low), abs(high)) for low, high in ends]
    if max(most) >= square:
        return _joined(least), square
    return _joined(least), _joined(most)


def lead_lean_bounds(toolpath: Toolpath, lead: Range | None, lean: Range | None) -> tuple[TiltBounds, ...]:
    """Make the bounds that ranges of lead and lean are.

    Parameters
    ----------
    toolpath : with surface normals at its cuts
    lead, lean : smallest and largest angle, rad; None for no bound

    Returns
    -------
    Two bounds a range; links are bound by none.

    Raises
    ------
    ToolpathError
        A path without normals, or a location without a feed direction.
    """
    asked = {"lead": lead, "lean": lean}
    ranges = {name: ends for name, ends in asked.items() if ends is not None}
    if not ranges:
        return ()
    if not toolpath.has_normals:
        raise ToolpathError(
            f"has no surface normals, so {' and '.join(ranges)} mean nothing; say which surface it cuts "
            "(part, --part), or use cone (--cone 20)",
            file=toolpath.name,
        )
    normal, forward = toolpath.normal, _known_ways(toolpath)
    across = {"lead": forward, "lean": np.cross(normal, forward)}
    bounds = []
    for name, (low, high) in ranges.items():
        for sign, end, side in ((1.0, low, ">="), (-1.0, high, "<=")):
            inside = sign * (math.cos(end) * across[name] - math.sin(end) * normal)
            said = f"{INSIDE_OF}{name} {side} {math.degrees(end):g} deg"
            bounds.append(TiltBounds(inside, 0.0, math.pi / 2.0, said))
    return tuple(bounds)


def _joined(angles: list[float]) -> float:
    """Give the tilt of a lead and a lean, rad."""
    return math.atan(math.hypot(*(math.tan(a) for a in angles)))


def _known_ways(toolpath: Toolpath) -> Array:
    """Give feed directions at cuts; one that stands still takes its nearest neighbour's along the path.

    Raises
    ------
    ToolpathError
        A location has no direction, its neighbour's included.
    """
    ahead, normal = _ways(toolpath, toolpath.normal), toolpath.normal
    known = np.flatnonzero(np.isfinite(ahead).all(axis=1))
    still = np.flatnonzero(np.isfinite(normal).all(axis=1) & np.isnan(ahead).any(axis=1))
    if len(known):
        after = np.searchsorted(known, still).clip(1, max(len(known) - 1, 1))
        sides = known[np.stack([after - 1, after.clip(max=len(known) - 1)])]
        nearest = np.where(still - sides[0] <= sides[1] - still, sides[0], sides[1])
        ahead[still] = _directions(_across(ahead[nearest], normal[still]))
    lost = still[np.isnan(ahead[still]).any(axis=1)]
    if len(lost):
        raise ToolpathError(
            f"location {lost[0]} has no feed direction, because the path doesn't move across its surface "
            "normal there, so lead and lean mean nothing; use tilt (--tilt 15:75), the angle to the normal",
            file=toolpath.name,
            line=toolpath.place(int(lost[0])).line,
        )
    return ahead


def _ways(toolpath: Toolpath, reference: Array) -> Array:
    """Give the direction of travel across the reference, (n, 3) unit vectors, NaN where there is none."""
    steps = np.diff(toolpath.pivot, axis=0, prepend=np.nan, append=np.nan)
    into, out = steps[:-1], steps[1:]
    before, after = (np.linalg.norm(step, axis=1) for step in (into, out))
    # A step twice as long as the one on the other side is the change to another pass, not the path's way.
    # A location given twice has one side only.
    jumped, jumps = (before > 2.0 * after) & (after > 0.0), (after > 2.0 * before) & (before > 0.0)
    into = np.where((jumped | ~(before > 0.0))[:, None], 0.0, into)
    out = np.where((jumps | ~(after > 0.0))[:, None], 0.0, out)
    return _directions(_across(into + out, reference))


def _directions(ways: Array) -> Array:
    """Scale ways, (n, 3) mm, to unit length; NaN where they are too short."""
    known = np.linalg.norm(ways, axis=1) > SHORTEST_WAY
    return normalise(np.where(known[:, None], ways, np.nan))


def _across(way: Array, reference: Array) -> Array:
    """Take from ways, (n, 3), what runs along the reference."""
    across: Array = way - reference * np.sum(way * reference, axis=1, keepdims=True)
    return across
