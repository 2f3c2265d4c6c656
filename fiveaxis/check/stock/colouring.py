"""Colours of a finished part: what is gouged, what is finished and what is left."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray
from fiveaxis.check.stock.comparing import Deviations

# Colours of gouged, finished and left places, and of those that no block has cut.
GOUGED, FINISHED, LEFT, UNCUT = (178, 24, 43), (120, 190, 120), (33, 102, 172), (205, 205, 205)
# Tolerances: gouges are wholly red and what is left wholly blue from these depths and heights on.
DEEP, HIGH = 4.0, 10.0
# Share of red or blue right beyond the tolerance.
LEAST = 0.25
# More cells than any stock has along an axis.
MOST_ALONG = 2**20


def colours_of(found: Deviations, tolerance: float) -> NDArray[np.uint8]:
    """Return the colour of each point, (n, 3): within the tolerance, mm, or that of the rays, finished."""
    allowed, distance = max(tolerance, found.uncertainty), found.distance[:, None]
    full = np.where(distance < 0.0, DEEP, HIGH) * allowed
    share = LEAST + (1.0 - LEAST) * (np.abs(distance) - allowed) / (full - allowed)
    share = np.where(np.abs(distance) <= allowed, 0.0, np.minimum(share, 1.0))
    ends = np.where(distance < 0.0, np.array(GOUGED), np.array(LEFT))
    colours = (1.0 - share) * np.array(FINISHED) + share * ends
    return np.where(found.cut[:, None], np.rint(colours), np.array(UNCUT)).astype(np.uint8)


def colours_at(points: Array, found: Deviations, tolerance: float, cell: float) -> NDArray[np.uint8]:
    """Return the colour at places of the finished surface, (n, 3); `UNCUT` where the part isn't near.

    Each takes the strongest colour of its cell, so that no gouge is hidden between the places; without any,
    that of the nearest cell that has one.

    Parameters
    ----------
    points : (n, 3), mm
    cell : mm, distance of the places
    """
    from scipy.spatial import cKDTree

    colours = np.full((len(points), 3), UNCUT, np.uint8)
    rank = np.where(found.cut, found.distance / np.where(found.distance < 0.0, -DEEP, HIGH), -1.0)
    order = np.argsort(-rank, kind="stable")
    low = np.vstack([points, found.surface.points]).min(axis=0) if len(order) else np.zeros(3)

    def number(places: Array) -> IntArray:
        """Return the number of each place's cell, (n,)."""
        x, y, z = ((places - low) / cell).astype(np.int64).T
        return np.asarray((x * MOST_ALONG + y) * MOST_ALONG + z)

    held, first = np.unique(number(found.surface.points[order]), return_index=True)
    if not len(held) or not len(points):
        return colours
    worst, own = order[first], number(points)
    at = np.searchsorted(held, own).clip(0, len(held) - 1)
    away, nearest = cKDTree(found.surface.points[worst]).query(points)
    of = worst[np.where(held[at] == own, at, nearest)]
    near = away <= 2.0 * cell
    colours[near] = colours_of(found, tolerance)[of[near]]
    return colours
