"""Cones of tool axes in which a solid is proven clear of an obstacle, location by location.

A search asks for dozens of postures of each location. Of a shank, which is near to what the cutter touches
but seldom in its way, one query of all that it sweeps in a wide cone about the normal answers most of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, arctan2
from fiveaxis.check.collision.obstacles import Obstacle, Solid
from fiveaxis.model import Toolpath

# rad: half angle of the cones, just above a usual highest tilt, as wider ones take more; largest angle
# between a swept side and the cone's axis, above which all around the pivot counts as swept.
WIDE, FLATTEST = np.radians(76.0), np.radians(88.0)
# mm: what is swept is taken larger by this, more than rounding; the same of a cosine.
LARGER, INSIDE = 1e-6, 1e-9
UNKNOWN, CLEAR, OPEN = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Coned(Obstacle):
    """An obstacle whose answers inside a clear cone take no query.

    Parameters
    ----------
    swept : what the solids sweep in a cone, about its axis and from the pivot
    pivot, normal : (n, 3), of the locations, mm and unit vectors, workpiece frame; a normal of 0 has no cone
    proven : (n,), what is known of their cones
    """

    swept: Obstacle
    pivot: Array
    normal: Array
    proven: Array

    @classmethod
    def of(cls, obstacle: Obstacle, toolpath: Toolpath) -> Obstacle:
        """Give an obstacle its cones; without one where the tool turns about a pivot off its axis."""
        zone = toolpath.zone
        if zone.offset:
            return obstacle
        below = zone.height * np.array([1.0, 0.0, 1.0, 0.0])
        swept = (Solid(s.name, swept_in_cone(s.frusta - below, WIDE)) for s in obstacle.solids)
        return cls(
            **vars(obstacle),
            swept=replace(obstacle, solids=tuple(swept)),
            pivot=toolpath.pivot,
            normal=np.nan_to_num(toolpath.normal),
            proven=np.full(len(toolpath), UNKNOWN, dtype=np.uint8),
        )

    def hit_by(self, rows: IntArray, tip: Array, axis: Array) -> BoolArray:
        """Find which tools reach into it, exactly, as `Obstacle.hit_by`."""
        inside = np.einsum("ij,ij->i", axis, self.normal[rows]) > np.cos(WIDE) + INSIDE
        new = np.unique(rows[inside & (self.proven[rows] == UNKNOWN)])
        if len(new):
            met = self.swept.hit_by(new, self.pivot[new], self.normal[new])
            self.proven[new] = np.where(met, OPEN, CLEAR)
        hit = ~(inside & (self.proven[rows] == CLEAR))
        asked = np.flatnonzero(hit)
        hit[asked] = super().hit_by(rows[asked], tip[asked], axis[asked])
        return hit


def swept_in_cone(frusta: Array, half: float) -> Array:
    """Enclose what a stack of frusta sweeps while its axis leans by up to an angle, rad; (1 or 2, 4) mm.

    Heights of the frusta, (m, 4) mm, are over the pivot. Turned by up to the angle, a point at the distance d
    reaches ``d cos(max(θ − half, 0))`` in a direction at θ to it. That is convex in the point, so over a
    frustum it is largest at a corner. Bounded in this way are the lower end and the side that is the lowest
    frustum's where it leans most; all else is within the largest distance from the pivot.
    """
    ends = frusta.reshape(-1, 2)
    corners = np.concatenate([ends, ends * [1.0, 0.0]])
    distance, angle = np.hypot(*corners.T), arctan2(corners[:, 1], corners[:, 0])

    def reach(direction: float) -> float:
        turned = np.maximum(np.abs(direction - angle) - half, 0.0)
        return float((distance * np.cos(turned)).max()) + LARGER

    far, (height, radius) = float(distance.max()) + LARGER, ends[1] - ends[0]
    low, side = -reach(np.pi), half + math.atan2(radius, height)
    if not 0.0 < side < FLATTEST:
        return np.array([[-far, far, far, far]])
    out = reach(np.pi / 2.0 + side)
    narrow, wide = (out + np.sin(side) * low) / np.cos(side), (np.cos(side) * far - out) / np.sin(side)
    if not (0.0 <= narrow < far and low < wide < far):
        return np.array([[low, far, far, far]])
    return np.array([[low, narrow, wide, far], [wide, far, far, far]])
