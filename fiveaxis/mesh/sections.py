"""Plane sections of the part's surface, chained to directed loops."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.geometry import Array, IntArray, product
from fiveaxis.mesh.surface import Surface


@dataclass(frozen=True, eq=False)
class Loop:
    """One curve of a section: a chain of straight segments, one in each triangle it crosses.

    It runs with the material to its right (seen from above), so that ``direction = normal × z``.

    Parameters
    ----------
    faces : (m,), triangle of each segment
    points : (m, 2, 3), mm, start and end of each segment
    normals : (m, 2, 3), smoothed normals there in the segment's triangle (not unit length)
    closed : whether the last segment's end is the first one's start
    """

    faces: IntArray
    points: Array
    normals: Array
    closed: bool

    def turned(self, frame: Array) -> Loop:
        """Express a curve in another frame, whose axes are the rows of a (3, 3)."""
        return replace(self, points=product(self.points, frame.T), normals=product(self.normals, frame.T))


def section_loops(surface: Surface, level: float) -> list[Loop]:
    """Cut the surface at a height and chain the segments.

    Vertices on the level count as above it, so every crossed triangle has one edge that rises through the
    level and one that falls. Neighbours are found by the edges they share, without a tolerance. On an open
    mesh a chain ends where a neighbour is missing.

    Parameters
    ----------
    surface : the part
    level : mm

    Returns
    -------
    Loops in a fixed order: open chains first, then closed ones, each by its first triangle
    """
    low, high = surface.heights
    crossed = np.flatnonzero((low < level) & (high >= level))
    if len(crossed) == 0:
        return []
    entry = _crossing(surface, crossed, level, rising=True)
    leaving = _crossing(surface, crossed, level, rising=False)
    points = np.stack([entry[1], leaving[1]], axis=1)
    normals = np.stack([entry[2], leaving[2]], axis=1)
    chains = _chains(entry[0].tolist(), leaving[0].tolist())
    return [Loop(crossed[rows], points[rows], normals[rows], closed) for rows, closed in chains]


def _crossing(
    surface: Surface, crossed: IntArray, level: float, *, rising: bool
) -> tuple[IntArray, Array, Array]:
    """Find where the edge that rises (or falls) through the level meets it.

    Returns
    -------
    key : (m,), number of the edge, the same for both of its triangles
    points : (m, 3), mm
    normals : (m, 3), smoothed normal of the triangle at the point
    """
    faces = surface.faces[crossed]
    above = surface.vertices[faces, 2] >= level
    next_above = np.roll(above, -1, axis=1)
    row, corner = np.nonzero(~above & next_above if rising else above & ~next_above)
    lower, upper = (corner, (corner + 1) % 3) if rising else ((corner + 1) % 3, corner)
    # Always from the lower to the upper vertex: both triangles of the edge get the same point, bit for bit.
    low, high = surface.vertices[faces[row, lower]], surface.vertices[faces[row, upper]]
    t = ((level - low[:, 2]) / (high[:, 2] - low[:, 2]))[:, None]
    at_corners = surface.corner_normals[crossed]
    normals = (1.0 - t) * at_corners[row, lower] + t * at_corners[row, upper]
    points = (1.0 - t) * low + t * high
    points[:, 2] = level
    return faces[row, lower] * len(surface.vertices) + faces[row, upper], points, normals


def _chains(entry: list[int], leaving: list[int]) -> list[tuple[IntArray, bool]]:
    """Chain triangles from leaving edge to entry edge; each is in one chain."""
    entered_by: dict[int, list[int]] = {}
    for row, key in enumerate(entry):
        entered_by.setdefault(key, []).append(row)
    # A non-manifold edge is the entry of several triangles, which are used in their order.
    follower = [rows.pop(0) if (rows := entered_by.get(key)) else -1 for key in leaving]
    followed = set(follower)
    heads = [row for row in range(len(entry)) if row not in followed]
    seen = [False] * len(entry)
    chains = []
    for head in [*heads, *range(len(entry))]:
        rows, row = [], head
        while row >= 0 and not seen[row]:
            seen[row] = True
            rows.append(row)
            row = follower[row]
        if rows:
            chains.append((np.array(rows), row == head))
    return chains
