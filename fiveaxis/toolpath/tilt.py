"""How far the tool may lean at each location."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.geometry import Array, IntArray, angle_between
from fiveaxis.toolpath.path import Toolpath


@dataclass(frozen=True, eq=False)
class TiltBounds:
    """Bounds on the angle between the tool axis and a reference direction.

    Parameters
    ----------
    reference : (n, 3), unit vectors in the workpiece frame; NaN where the location binds nothing (links)
    low, high : rad, 0 ≤ low < high ≤ π
    name : what the reference is: ``normal`` or ``programmed axis``
    touching : the angles to the surface normal at which the cutter touches with the part of its profile that
        the path is made for; None where the reference is the normal, or the cutter turns about one point
    """

    reference: Array
    low: float
    high: float
    name: str
    touching: TiltBounds | None = None

    @property
    def all(self) -> tuple[TiltBounds, ...]:
        """Every bound that holds at once."""
        return (self,) if self.touching is None else (self, self.touching)

    def at(self, rows: IntArray | slice) -> TiltBounds:
        """Return the bounds of some locations, without those that hold beside them."""
        return replace(self, reference=self.reference[rows], touching=None)

    @property
    def cosines(self) -> tuple[float, float]:
        """Smallest and largest cosine of the angle."""
        return math.cos(self.high), math.cos(self.low)

    def angles(self, axis: Array) -> Array:
        """Measure the tilt of tool axes, (n, 3) unit vectors; (n,) rad, NaN where nothing binds."""
        return angle_between(axis, self.reference)


def tilt_bounds(
    toolpath: Toolpath, tilt: tuple[float, float] | None = None, cone: float | None = None
) -> TiltBounds:
    """Make the bounds of a path: a tilt range to the surface normal, or a cone about the programmed axis.

    Parameters
    ----------
    toolpath : with normals for `tilt`, with tool axes for `cone`
    tilt : smallest and largest angle between tool axis and surface normal, degrees
    cone : largest angle between tool axis and programmed axis, degrees

    Raises
    ------
    SettingError
        Neither or both given; a range that is empty, reversed or outside 0…180°.
    ToolpathError
        The path lacks the direction that the range refers to.
    ToolError
        The cutter doesn't touch with one part of its profile over the range (`for_tilt` chooses the part).
    """
    _, low, high = _asked(toolpath, tilt, cone)
    if cone is None:
        return TiltBounds(toolpath.normal, low, high, "normal")
    zone = toolpath.zone
    if zone.offset == 0.0 and len(toolpath.tool.cutter.zones) == 1:
        return TiltBounds(toolpath.axis, low, high, "programmed axis")
    touching = TiltBounds(toolpath.normal, zone.least, zone.high, "normal")
    return TiltBounds(toolpath.axis, low, high, "programmed axis", touching)


def for_tilt(
    toolpath: Toolpath, tilt: tuple[float, float] | None = None, cone: float | None = None
) -> Toolpath:
    """Return the path with the part of the cutter's profile that touches where the bounds let the tool lean.

    For a tilt range it is the part that touches all over the range; for a cone, the one that touches at the
    programmed axes. Arguments as for `tilt_bounds`, which raises the same.
    """
    what, low, high = _asked(toolpath, tilt, cone)
    cutter = toolpath.tool.cutter
    if what == "tilt":
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


def _asked(
    toolpath: Toolpath, tilt: tuple[float, float] | None, cone: float | None
) -> tuple[str, float, float]:
    """Check what the caller asks for; name it, and give its range in rad."""
    if (tilt is None) == (cone is None):
        raise SettingError(
            "give either tilt (angle to the surface normal, --tilt 15:75) or cone (angle to the programmed "
            "axis, --cone 20)"
        )
    low, high = (0.0, float(cone)) if cone is not None else (float(t) for t in tilt or ())
    name = "tilt" if cone is None else "cone"
    require_range(low, high, name)
    _require_reference(toolpath, name)
    return name, math.radians(low), math.radians(high)


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
