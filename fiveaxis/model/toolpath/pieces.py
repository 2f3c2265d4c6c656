"""The cutting portion of a tool as the union of convex bodies of revolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model.toolpath.cutter import Zone
from fiveaxis.model.toolpath.tool import Tool

QUARTER = math.pi / 2.0


@dataclass(frozen=True, eq=False)
class ConvexPiece:
    """A convex body of revolution, or a ball.

    Parameters
    ----------
    zones : (m, 7), see `fiveaxis.model.toolpath.profile.inside`
    low, high : mm above the tip, ends of the body; ∓∞ where its own profile closes it
    is_ball : whether it is the whole ball about ``(0, zones[0].height)``
    """

    zones: Array
    low: float
    high: float
    is_ball: bool = False


def cutter_height(tool: Tool) -> float:
    """Return the height of the cutter's upper end, mm above the tip.

    A cutter that states no cutting length ends with its profile, at least at the height of its radius.
    """
    cutter = tool.cutter
    top = float(np.vstack([zone.outline() for zone in cutter.zones])[-1, 1])
    return max(top, tool.radius) if cutter.length is None else cutter.length


def cutter_pieces(tool: Tool) -> tuple[ConvexPiece, ...]:
    """Split a tool's cutter into convex bodies; a ball without cutting length is the whole ball."""
    zones, height = tool.cutter.zones, cutter_height(tool)
    if tool.cutter.is_ball:
        return _ball_pieces(tool, height)
    return _pieces(zones, float(np.vstack([zone.outline() for zone in zones])[-1, 1]), height)


def revolved_pieces(outline: Array) -> tuple[ConvexPiece, ...]:
    """Build the cylinders and cones of an outline, (2m, 2) mm: radius and height of each one's ends."""
    return tuple(
        _frustum(*low, *high) for low, high in zip(outline[::2].tolist(), outline[1::2].tolist(), strict=True)
    )


def _frustum(lower: float, low: float, upper: float, high: float) -> ConvexPiece:
    # The side's normal is at this angle to the way down the axis.
    side = math.atan2(high - low, upper - lower)
    ends = [Zone("low", 0.0, lower, low, 0.0, side), Zone("high", 0.0, upper, high, side, math.pi)]
    return ConvexPiece(_rows(ends), low, high)


def _ball_pieces(tool: Tool, height: float) -> tuple[ConvexPiece, ...]:
    """Build the whole ball and the cylinder above it: as wide as the ball, or a lollipop's neck."""
    ball = ConvexPiece(_rows(tool.cutter.zones), 0.0, 2.0 * tool.radius, is_ball=True)
    end, top = tool.cutter.zones[0].outline()[-1]
    return (ball, _above(end, top, height)) if height > top + 1e-9 else (ball,)


def _pieces(zones: tuple[Zone, ...], top: float, height: float) -> tuple[ConvexPiece, ...]:
    """Split a profile where it stops being convex; above a profile that narrows there is a cylinder."""
    first, last = zones[0], zones[-1]
    if first.low > 0.0:
        zones = (Zone("tip", 0.0, 0.0, 0.0, 0.0, first.low), *zones)
    end = float(last.outline()[-1, 0])
    if last.high > QUARTER + 1e-9:
        if height > top:
            return ConvexPiece(_rows(zones), -math.inf, top), _above(end, top, height)
        return (ConvexPiece(_rows([*zones, _lid(end, top, last.high)]), -math.inf, math.inf),)
    rim = Zone("rim", 0.0, end, top, last.high, QUARTER)
    return (ConvexPiece(_rows([*zones, rim, _lid(end, height)]), -math.inf, math.inf),)


def _above(radius: float, low: float, high: float) -> ConvexPiece:
    """Build the cylinder above a profile."""
    side = Zone("side", 0.0, radius, 0.0, QUARTER, QUARTER)
    return ConvexPiece(_rows([side, _lid(radius, high)]), low, math.inf)


def _lid(radius: float, height: float, low: float = QUARTER) -> Zone:
    """Close a profile at its end, so that depth grows gradually for what enters from above."""
    return Zone("lid", 0.0, radius, height, low, math.pi)


def _rows(zones: list[Zone] | tuple[Zone, ...]) -> Array:
    ends = [[f(angle) for angle in (z.low, z.high) for f in (math.sin, math.cos)] for z in zones]
    return np.array([[z.radius, z.offset, z.height, *end] for z, end in zip(zones, ends, strict=True)])
