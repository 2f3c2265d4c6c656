"""The shapes of cutters: profiles from catalogue dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable

from fiveaxis.base import ToolError
from fiveaxis.model.toolpath.cutter import Cutter, Zone, require_dimension

QUARTER = math.pi / 2.0


def ball(diameter: float, *, length: float | None = None) -> Cutter:
    """Create a ball end mill (spherical) of a diameter, mm."""
    require_positive("ball", diameter=diameter)
    radius = diameter / 2.0
    return Cutter(
        "ball", (diameter,), diameter, (Zone("ball", radius, 0.0, radius, 0.0, QUARTER),), 0, length
    )


def flat(diameter: float, *, length: float | None = None) -> Cutter:
    """Create a square end mill (flat, cylindrical) of a diameter, mm; it touches with its edge."""
    require_positive("flat", diameter=diameter)
    zone = Zone("edge", 0.0, diameter / 2.0, 0.0, 0.0, QUARTER)
    return Cutter("flat", (diameter,), diameter, (zone,), 0, length)


def bull(diameter: float, corner_radius: float, *, length: float | None = None) -> Cutter:
    """Create a bull-nose end mill (toroidal) of a diameter and a corner radius, mm."""
    require_positive("bull", diameter=diameter, corner_radius=corner_radius)
    if corner_radius >= diameter / 2.0:
        raise ToolError(
            f"tool bull:{diameter:g}:{corner_radius:g}: corner radius {corner_radius:g} mm must be below "
            f"half the diameter, {diameter / 2.0:g} mm; write ball:{diameter:g} for a ball"
        )
    zone = Zone("corner", corner_radius, diameter / 2.0 - corner_radius, corner_radius, 0.0, QUARTER)
    return Cutter("bull", (diameter, corner_radius), diameter, (zone,), 0, length)


def lollipop(diameter: float, neck_diameter: float, *, length: float | None = None) -> Cutter:
    """Create a ball on a thinner neck, mm: it also cuts undercuts, up to where the neck meets the ball."""
    require_positive("lollipop", diameter=diameter, neck_diameter=neck_diameter)
    if neck_diameter >= diameter:
        raise ToolError(
            f"tool lollipop:{diameter:g}:{neck_diameter:g}: the neck must be thinner than the ball; write "
            f"ball:{diameter:g} for a ball without a neck"
        )
    radius = diameter / 2.0
    highest = math.pi - math.asin(neck_diameter / diameter)
    zone = Zone("ball", radius, 0.0, radius, 0.0, highest)
    return Cutter("lollipop", (diameter, neck_diameter), diameter, (zone,), 0, length)


def taper(tip_diameter: float, half_angle: float, diameter: float, *, length: float | None = None) -> Cutter:
    """Create a tapered ball end mill.

    Parameters
    ----------
    tip_diameter : mm, of the ball at the tip
    half_angle : **degrees**, between the cone and the axis
    diameter : mm, of the cone's upper end
    """
    require_positive("taper", tip_diameter=tip_diameter, half_angle=half_angle, diameter=diameter)
    radius, slope = tip_diameter / 2.0, math.radians(half_angle)
    if half_angle >= 90.0 or diameter / 2.0 <= radius * math.cos(slope):
        raise ToolError(
            f"tool taper:{tip_diameter:g}:{half_angle:g}:{diameter:g}: the half angle must be below 90 deg, "
            f"and the upper diameter above {tip_diameter * math.cos(slope):.4g} mm, where the cone begins"
        )
    top = radius * (1.0 - math.sin(slope)) + (diameter / 2.0 - radius * math.cos(slope)) / math.tan(slope)
    zones = (
        Zone("ball", radius, 0.0, radius, 0.0, QUARTER - slope),
        Zone("edge", 0.0, diameter / 2.0, top, QUARTER - slope, QUARTER),
    )
    return Cutter("taper", (tip_diameter, half_angle, diameter), diameter, zones, 0, length)


def barrel(
    diameter: float, barrel_radius: float, nose_radius: float, *, length: float | None = None
) -> Cutter:
    """Create a tangential barrel cutter: a ball nose tangent to an arc of a much larger radius.

    The arc touches the cylinder of the diameter from inside: the cutter is widest at the height of the arc's
    centre.

    Parameters
    ----------
    diameter : mm, the largest
    barrel_radius : mm, above half the diameter
    nose_radius : mm, of the ball at the tip, below half the diameter
    """
    require_positive("barrel", diameter=diameter, barrel_radius=barrel_radius, nose_radius=nose_radius)
    half = diameter / 2.0
    if not nose_radius < half < barrel_radius:
        raise ToolError(
            f"tool barrel:{diameter:g}:{barrel_radius:g}:{nose_radius:g}: a nose radius below and a barrel "
            f"radius above half the diameter, {half:g} mm, are needed"
        )
    offset, gap = half - barrel_radius, barrel_radius - nose_radius
    height = nose_radius + math.sqrt(gap * gap - offset * offset)
    joint = math.asin(-offset / gap)
    zones = (
        Zone("ball", nose_radius, 0.0, nose_radius, 0.0, joint),
        Zone("barrel", barrel_radius, offset, height, joint, QUARTER),
    )
    return Cutter("barrel", (diameter, barrel_radius, nose_radius), diameter, zones, 1, length)


def drill(diameter: float, point_angle: float, *, length: float | None = None) -> Cutter:
    """Create a drill of a diameter, mm, and a point angle, **degrees**."""
    require_positive("drill", diameter=diameter, point_angle=point_angle)
    if point_angle >= 180.0:
        raise ToolError(f"tool drill:{diameter:g}:{point_angle:g}: the point angle must be below 180 deg")
    bottom = QUARTER - math.radians(point_angle) / 2.0
    zones = (
        Zone("tip", 0.0, 0.0, 0.0, 0.0, bottom),
        Zone("edge", 0.0, diameter / 2.0, diameter / 2.0 * math.tan(bottom), bottom, QUARTER),
    )
    return Cutter("drill", (diameter, point_angle), diameter, zones, 0, length)


SHAPES: dict[str, tuple[Callable[..., Cutter], tuple[str, ...]]] = {
    "ball": (ball, ("diameter",)),
    "flat": (flat, ("diameter",)),
    "bull": (bull, ("diameter", "corner_radius")),
    "lollipop": (lollipop, ("diameter", "neck_diameter")),
    "taper": (taper, ("tip_diameter", "half_angle", "diameter")),
    "barrel": (barrel, ("diameter", "barrel_radius", "nose_radius")),
    "drill": (drill, ("diameter", "point_angle")),
}


def require_positive(shape: str, **figures: float) -> None:
    """Raise `ToolError` if a dimension of a shape isn't one that a tool can have."""
    for name, value in figures.items():
        require_dimension(f"tool {shape}: {name}", value, "deg" if name.endswith("angle") else "mm")
