"""What is known of a leaning cutter before the postures are: by the bounds that they will keep."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fiveaxis.base import Array, ToolError
from fiveaxis.model import Constraints, Range, Tool, Zone

# Angles to the normal at which strips are computed, and 1/mm, step of curvatures along the feed.
ANGLES, BEND_STEP = 61, 1e-3
# rad: a cutter at 90 deg to the normal has a lead or a lean without a finite tangent.
NEARLY_SQUARE = math.radians(89.9)


@dataclass(frozen=True)
class Leaning:
    """The zone of a cutter that touches, and how it may lean.

    Parameters
    ----------
    zone : of the profile
    low, high : rad, smallest and largest angle between axis and surface normal
    lead, lean : rad; None for no bound
    outer : mm, radius of the ball about the point of the axis at the height of the arc's centre that holds
        all of the profile, whatever the tool axis
    """

    zone: Zone
    low: float
    high: float
    lead: Range | None
    lean: Range | None
    outer: float

    @classmethod
    def of(cls, tool: Tool, bounds: Constraints) -> Leaning:
        """Find the zone that touches within bounds, without any the one that is meant to cut.

        Raises
        ------
        ToolError
            No single zone touches within the bounds, or the tool doesn't mill with an arc or an edge.
        """
        cutter, angles = tool.cutter, bounds.angles
        zone = tool.zone if cutter.is_ball or angles is None else cutter.zone_for(*angles)
        if not (zone.radius or zone.offset):
            raise ToolError(f"tool {tool}: passes aren't planned for a point; give for example ball:10")
        low, high = (zone.least, zone.high) if angles is None else angles
        profile = np.vstack([part.outline() for part in cutter.zones]) - [0.0, zone.height]
        outer = float(np.linalg.norm(profile, axis=1).max()) if zone.offset else zone.radius
        return cls(zone, max(low, zone.least), min(high, zone.high), bounds.lead, bounds.lean, outer)

    @property
    def turns_in_place(self) -> bool:
        """Whether the touching arc is a ball, which no lean moves."""
        return not self.zone.offset

    @property
    def ball(self) -> float:
        """Radius, mm, of the largest ball inside the cutter that touches where it does, at any lean."""
        return self.zone.principal_radii(self.low)[0]

    @property
    def roundest(self) -> float | None:
        """Largest radius of curvature, mm, with which the cutter touches; None for a ball."""
        return None if self.turns_in_place else self.zone.principal_radii(self.low)[1]

    def strip_radius(self, height: float, bend: Array) -> Array:
        """Return the smallest radius across the feed of the strip cut at any allowed lean, (m,) mm.

        Parameters
        ----------
        height : mm, of the ridges beside it
        bend : (m,), 1/mm, of the surface along the feed, positive where it is convex; hollow counts as flat
        """
        if self.turns_in_place:
            return np.full(len(bend), self.zone.radius)
        steps, which = np.unique(np.ceil(np.maximum(bend, 0.0) / BEND_STEP), return_inverse=True)
        return np.array([_narrowest_strip(self, height, step * BEND_STEP) for step in steps.tolist()])[which]

    def postures(self) -> tuple[Array, Array]:
        """Return the angles to the normal at which strips are narrowest, (2k,) rad, and how far across.

        The latter is the share of the lean that is across the feed, as of `Zone.strip_radius`: at each angle
        the least and the largest one. `ToolError` if the bounds allow no posture.
        """
        high = min(self.high, NEARLY_SQUARE)
        angle = np.linspace(min(self.low, high), high, ANGLES)
        square = (np.sin(angle) / np.cos(angle)) ** 2
        ahead, sideways = (_squares(ends) for ends in (self.lead, self.lean))
        # tan² of the angle is the sum of those of lead and lean.
        shares = np.maximum(sideways[0], square - ahead[1]), np.minimum(sideways[1], square - ahead[0])
        possible = shares[0] <= shares[1] * (1.0 + 1e-9)
        if not possible.any():
            raise ToolError("tilt, lead and lean allow no common posture; widen one of them")
        return np.tile(angle[possible], 2), np.concatenate([(share / square)[possible] for share in shares])


# Passes ask for the same few curvatures again and again.
@lru_cache(maxsize=4096)
def _narrowest_strip(leaning: Leaning, height: float, bend: float) -> float:
    return float(leaning.zone.strip_radius(*leaning.postures(), bend, height).min())


def _squares(ends: Range | None) -> Range:
    """Return the least and the largest tan² of the angles of a range."""
    low, high = (-NEARLY_SQUARE, NEARLY_SQUARE) if ends is None else ends
    least = max(low, -high, 0.0)
    return math.tan(least) ** 2, math.tan(max(abs(low), abs(high))) ** 2
