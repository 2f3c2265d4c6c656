"""Which passes lie beside each other on the surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fiveaxis.contour.passes import Pass
from fiveaxis.contour.walls import FLATTEST_WALL
from fiveaxis.geometry import Array

# Passes of neighbouring sections lie this many times the sections' distance apart, at most: on the flattest
# wall, and a little more because of its curvature.
FARTHEST = 1.1 / float(np.sin(FLATTEST_WALL))
# Contacts whose normals differ by more are on different walls, or on both sides of a thin one.
WIDEST_TURN = np.radians(60.0)


def neighbours(upper: Sequence[Pass], lower: Sequence[Pass], plane: Array) -> set[tuple[int, int]]:
    """Pair the passes of two neighbouring sections that lie beside each other.

    Two passes are neighbours if a contact of one has its nearest contact of the other section on the other,
    near enough for that to be the same wall.

    Parameters
    ----------
    upper, lower : passes of each section
    plane : (3,), unit normal of the sections

    Returns
    -------
    Pairs of indices, of the upper and the lower pass
    """
    if not upper or not lower:
        return set()
    gap = float((upper[0].contacts.points[0] - lower[0].contacts.points[0]) @ plane)
    reach = FARTHEST * abs(gap)
    down = _nearest(lower, upper, reach)
    return {(b, a) for a, b in down} | _nearest(upper, lower, reach)


def _nearest(own: Sequence[Pass], others: Sequence[Pass], reach: float) -> set[tuple[int, int]]:
    """Pairs (own, other) in which some contact of own has its nearest one on the other."""
    from scipy.spatial import cKDTree

    points, normals, owner = _contacts(own)
    places, facing, holder = _contacts(others)
    distance, nearest = cKDTree(places).query(points, distance_upper_bound=reach)
    found = np.isfinite(distance)
    owner, normals, nearest = owner[found], normals[found], nearest[found]
    same = np.einsum("ij,ij->i", normals, facing[nearest]) > np.cos(WIDEST_TURN)
    pairs = np.unique(np.stack([owner[same], holder[nearest[same]]], axis=1), axis=0)
    return {(int(a), int(b)) for a, b in pairs}


def _contacts(passes: Sequence[Pass]) -> tuple[Array, Array, np.ndarray]:
    """Points, normals and pass of all rows that touch."""
    rows = [found.touching() for found in passes]
    points = np.vstack([p.contacts.points[r] for p, r in zip(passes, rows, strict=True)])
    normals = np.vstack([p.contacts.normals[r] for p, r in zip(passes, rows, strict=True)])
    return points, normals, np.repeat(np.arange(len(passes)), [len(r) for r in rows])
