"""How far the tool may lean at each location, from what the user asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.geometry import angle_between
from fiveaxis.toolpath.bounds import TiltBounds
from fiveaxis.toolpath.lead_lean import Range, lead_lean_bounds, require_lead_lean, tilt_of
from fiveaxis.toolpath.path import SHORTEST_DIRECTION, Toolpath

# How far from a plane the tool axis may lie and still count as in it: the play that the search needs.
PLANE_TOLERANCE = math.radians(0.5)


def tilt_bounds(
    toolpath: Toolpath,
    tilt: Range | None = None,
    cone: float | None = None,
    *,
    lead: Range | None = None,
    lean: Range | None = None,
    plane: Sequence[float] | None = None,
) -> TiltBounds:
    """Make the bounds of a path; all that are given hold at once, where a cut ends or begins.

    Between, in links and rapid moves, nothing is cut and the tool leans as it likes.

    Parameters
    ----------
    toolpath : with normals for `tilt`, `lead` and `lean`, with tool axes for `cone`
    tilt : smallest and largest angle between tool axis and surface normal, degrees
    cone : largest angle between tool axis and programmed axis, degrees; not together with `tilt`
    lead : smallest and largest angle, degrees, by which the tool axis is tipped forwards into the feed, seen
        from the side (`lead_lean`)
    lean : the same to the left of the feed, seen along it
    plane : (3,), any length, workpiece frame: a vector at right angles to a plane that the tool axis stays
        in, within `PLANE_TOLERANCE`; beside one of the others

    Raises
    ------
    SettingError
        None given, or both `tilt` and `cone`; a range that is empty, reversed or outside 0…180° (lead and
        lean: −90…90°); a plane's vector without direction.
    ToolpathError
        The path lacks the direction that the range refers to.
    ToolError
        The cutter doesn't touch with one part of its profile over the range (`for_tilt` chooses the part).
    """
    asked, low, high = _asked(toolpath, tilt, cone, lead, lean)
    beside = lead_lean_bounds(toolpath, lead, lean)
    if asked == "cone":
        zone = toolpath.zone
        if zone.offset != 0.0 or len(toolpath.tool.cutter.zones) > 1:
            beside = (TiltBounds(toolpath.normal, zone.least, zone.high, "normal"), *beside)
        bounds = TiltBounds(toolpath.axis, low, high, "programmed axis", beside)
    elif tilt is not None:
        bounds = TiltBounds(toolpath.normal, low, high, "normal", beside)
    else:
        # Lead and lean say how far the tool may lean; the cutter, where it touches at all.
        bounds = TiltBounds(toolpath.normal, toolpath.zone.least, toolpath.zone.high, "normal", beside)
    bounds = bounds if plane is None else _in_plane(bounds, plane)
    return bounds.only(toolpath.bounding)


def for_tilt(
    toolpath: Toolpath,
    tilt: Range | None = None,
    cone: float | None = None,
    *,
    lead: Range | None = None,
    lean: Range | None = None,
) -> Toolpath:
    """Return the path with the part of the cutter's profile that touches where the bounds let the tool lean.

    For a tilt range, or the one that lead and lean leave, it is the part that touches all over the range; for
    a cone, the one that touches at the programmed axes. Arguments as for `tilt_bounds`, with the same errors.
    """
    asked, low, high = _asked(toolpath, tilt, cone, lead, lean)
    cutter = toolpath.tool.cutter
    if asked != "cone":
        return toolpath.in_zone(cutter.zone_for(low, high))
    if cutter.zones[0].offset == 0.0 and len(cutter.zones) == 1:
        return toolpath
    cuts = toolpath.cutting
    if not toolpath.has_normals:
        raise ToolpathError(
            f"has no surface normals, and {toolpath.tool} has to be moved about its contact as it leans; say "
            "which surface it cuts (part, --part)",
            file=toolpath.name,
        )
    angle = angle_between(toolpath.axis[cuts], toolpath.normal[cuts])
    return toolpath.in_zone(cutter.zone_for(float(angle.min()), float(angle.max())))


def _in_plane(bounds: TiltBounds, plane: Sequence[float]) -> TiltBounds:
    """Add the bound that keeps the tool axis in a plane, given by a vector at right angles to it."""
    across = np.asarray(plane, dtype=float)
    if across.shape != (3,) or not np.linalg.norm(across) > SHORTEST_DIRECTION:
        raise SettingError(
            f"plane is {tuple(across.tolist())}; give the three components of a vector at right angles to "
            "it, not all 0"
        )
    bound = np.isfinite(bounds.reference).all(axis=1, keepdims=True)
    reference = np.where(bound, across / np.linalg.norm(across), np.nan)
    square = math.pi / 2.0
    low, high = square - PLANE_TOLERANCE, square + PLANE_TOLERANCE
    name = "plane's vector {:g} {:g} {:g}".format(*across)
    return replace(bounds, beside=(*bounds.beside, TiltBounds(reference, low, high, name)))


def _asked(
    toolpath: Toolpath, tilt: Range | None, cone: float | None, lead: Range | None, lean: Range | None
) -> tuple[str, float, float]:
    """Check what the caller asks for; name its first bound, and give its range in rad."""
    leaning = lead is not None or lean is not None
    if (tilt is not None and cone is not None) or (tilt is None and cone is None and not leaning):
        raise SettingError(
            "give either tilt (angle to the surface normal, --tilt 15:75) or cone (angle to the programmed "
            "axis, --cone 20)"
        )
    if cone is not None:
        name, ends = "cone", (0.0, float(cone))
    elif tilt is not None:
        name, ends = "tilt", (float(tilt[0]), float(tilt[1]))
    else:
        for what, given in (("lead", lead), ("lean", lean)):
            if given is not None:
                require_lead_lean(what, *given)
        name, ends = "tilt", tilt_of(lead, lean)
    require_range(*ends, name)
    _require_reference(toolpath, name)
    return name, math.radians(ends[0]), math.radians(ends[1])


def require_range(low: float, high: float, name: str = "tilt") -> None:
    """Check a range of angles in degrees.

    Raises
    ------
    SettingError
        Empty, reversed or outside 0…180°.
    """
    if not 0.0 <= low < high <= 180.0:
        raise SettingError(
            f"{name} range {low:g}…{high:g} deg is empty, reversed or outside 0…180 deg; "
            "write the smaller angle first, for example 15:75"
        )


def _require_reference(toolpath: Toolpath, name: str) -> None:
    if name == "tilt" and not toolpath.has_normals:
        raise ToolpathError(
            "has no surface normals, so a tilt range means nothing; use cone (--cone 20), the angle about "
            "the programmed tool axis",
            file=toolpath.name,
        )
    if name == "cone" and not toolpath.has_axes:
        raise ToolpathError(
            "has no programmed tool axes, so a cone means nothing; use tilt (--tilt 15:75), the angle to the "
            "surface normal",
            file=toolpath.name,
        )
