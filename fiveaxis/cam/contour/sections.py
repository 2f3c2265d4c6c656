"""Plane sections of the part's surface: their heights, and their curves, chained to directed loops.

Heights are equally spaced, or as far apart as the ridges between passes allow.

Two passes of a ball of radius R, a distance d apart on a surface of normal curvature κ across them (κ > 0
where it is convex, 0 where it is flat), leave a ridge of height h::

    d = 4/κ · asin(κ/2 · sqrt((2 R h − h²) / ((1 + κ R) (1 + κ h))))    →  2 sqrt(2 R h − h²)  for κ → 0

The ball's centres lie ``1/κ + R`` from the centre of curvature, and the ridge where their circles meet lies
``1/κ + h`` from it. To first order in h this is the ``sqrt(8 h R / (1 + κ R))`` of the literature.

A wall whose normal makes the angle α with that of the section planes climbs ``sin α`` per length, so there
are ``∫ dz / (d sin α)`` steps d on it between two levels. At each height the wall with the largest integrand
counts, and a level lies wherever that integral has grown by one: no wall then has more than one step between
neighbouring levels.

References
----------
Suresh, Yang (1994), constant scallop-height machining of free-form surfaces; Lin, Koren (1996), efficient
tool-path planning for machining free-form surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, BoolArray, IntArray, angle_between, arcsin, product
from fiveaxis.cam.contour.options import FLATTEST_WALL
from fiveaxis.cam.mesh.surface import Surface, units

# mm: a level this near to vertices would run along the edges between them.
VERTEX_DISTANCE = 1e-6
# Shifts of a level that meets vertices, as shares of the step, in the order of trial.
SHIFTS = (0.0, 0.01, -0.01, 0.02, -0.02)
# The same for scallop levels, whose number is raised by the last factor to make up for a shift.
FINE_SHIFTS, SHIFT_RESERVE = (0.0, 0.001, -0.001, 0.002, -0.002), 1.004
# Limits of the curvature, as multiples of 1/R: convex bends of a radius below R/4 are shorter than a step,
# and only half of the larger step that a concave wall would allow is used.
TIGHTEST, HOLLOWEST = 4.0, -0.5
# The same limit where the surface is exact: a hollow that is nearly the ball's own leaves hardly any ridge.
HOLLOWEST_EXACT = -0.9
# Bins of heights per smallest step, and at most.
BINS_PER_STEP, MOST_BINS = 4, 50_000


def section_levels(surface: Surface, step: float) -> Array:
    """Choose heights of the sections, mm, equally spaced by a step, from the top down.

    The first lies half a step below the top, so no section lies in the part's top or bottom face. A level
    that meets vertices is shifted by a hundredth of a step or two, since a section along a ring of vertices
    would lie in no triangle.
    """
    bottom, top = surface.bounds[:, 2]
    count = max(1, int(np.floor((top - bottom) / step + 0.5)))
    step = min(step, top - bottom)
    levels = top - step * (np.arange(count) + 0.5)
    heights = np.unique(surface.vertices[:, 2])
    return np.array([_off_vertices(z, step, heights, SHIFTS) for z in levels[levels > bottom]])


def scallop_levels(
    surface: Surface, walls: BoolArray, *, radius: float | Array, scallop: float, step: float | None = None
) -> Array:
    """Choose heights of the sections, mm, from the top down, that keep the ridges on walls low enough.

    Heights without walls get no section. In each range of heights with walls the first level lies half a step
    below the top of the range, and the last half a step above its bottom.

    Parameters
    ----------
    surface, walls : the part, in the section frame, and which of its triangles count, (f,)
    radius : mm, of the ball; or (f,), of the strip that another cutter cuts at each triangle
    scallop, step : mm, the highest ridge, and the largest distance of levels
    """
    edges, rate = _steps_per_height(surface, walls, radius, scallop)
    if step is not None:
        rate = np.where(rate > 0.0, np.maximum(rate, 1.0 / step), 0.0)
    heights = np.unique(surface.vertices[:, 2])
    levels: list[float] = []
    for first, last in runs(rate > 0.0):
        grown = np.concatenate([[0.0], np.cumsum(rate[first:last] * np.diff(edges[first : last + 1]))])
        count = max(1, int(np.ceil(SHIFT_RESERVE * grown[-1])))
        wanted = (np.arange(count) + 0.5) * grown[-1] / count
        for z in np.interp(wanted, grown, edges[first : last + 1]):
            local = 1.0 / rate[np.clip(np.searchsorted(edges, z) - 1, 0, len(rate) - 1)]
            levels.append(_off_vertices(z, local, heights, FINE_SHIFTS))
    return np.array(levels[::-1])


def scallop_step(radius: float | Array, scallop: float, curvature: ArrayLike = 0.0) -> Array:
    """Compute the distance of passes, mm along the surface, that leaves ridges of a given height.

    Parameters
    ----------
    radius, scallop : mm, of the ball and the ridge
    curvature : 1/mm, of the surface across the passes, positive where it is convex; above ``−1/radius``
    """
    k = np.asarray(curvature, dtype=float)
    chord = np.sqrt((2.0 * radius * scallop - scallop**2) / ((1.0 + k * radius) * (1.0 + k * scallop)))
    # At smaller curvatures the arc equals its chord, and the quotient would be rounding errors.
    flat = np.abs(k) * radius < 1e-6
    safe = np.where(flat, 1.0, k)
    return np.where(flat, 2.0 * chord, 4.0 / safe * arcsin(np.clip(safe * chord / 2.0, -1.0, 1.0)))


def _steps_per_height(
    surface: Surface, walls: BoolArray, radius: float | Array, scallop: float
) -> tuple[Array, Array]:
    """Compute the most steps per height that a wall needs: edges of bins, (m + 1,) mm, and (m,) 1/mm."""
    bottom, top = surface.bounds[:, 2]
    least, is_ball = float(np.min(radius)), np.ndim(radius) == 0
    radius = np.broadcast_to(radius, walls.shape)[walls]
    finest = float(scallop_step(least, scallop, TIGHTEST / least)) * np.sin(FLATTEST_WALL)
    count = int(np.clip(np.ceil((top - bottom) / finest * BINS_PER_STEP), 16, MOST_BINS))
    edges = np.linspace(bottom, top, count + 1)
    heights = surface.triangles[walls][:, :, 2]
    if len(heights) == 0:
        return edges, np.zeros(count)
    slope = np.sin(angle_between(surface.facet_normals[walls], np.array([[0.0, 0.0, 1.0]])))
    # The strip of another cutter may be far wider than the bends that several of its steps lie on.
    tightest = TIGHTEST / (radius if is_ball else scallop_step(radius, scallop))
    curvature = np.clip(climbing_curvature(surface)[walls], HOLLOWEST / radius, tightest)
    need = 1.0 / (scallop_step(radius, scallop, curvature) * slope)
    low, high = (
        np.clip(np.searchsorted(edges, z, side="right") - 1, 0, count - 1)
        for z in (heights.min(axis=1), heights.max(axis=1))
    )
    return edges, _range_largest(low, high, need, count)


def climbing_curvature(surface: Surface) -> Array:
    """Compute the normal curvature along the steepest direction in each triangle, (f,) 1/mm, convex > 0.

    The smoothed normals change linearly over a triangle. A horizontal triangle, or one without area, has 0.
    """
    return _curvature(surface, _climb(surface))


def level_curvature(surface: Surface) -> Array:
    """Compute the normal curvature along sections in each triangle, as `climbing_curvature`."""
    return _curvature(surface, np.cross(surface.facet_normals, _climb(surface)))


def _climb(surface: Surface) -> Array:
    """Return the steepest direction in each triangle, (f, 3) unit vectors; 0 in horizontal ones."""
    facet = surface.facet_normals
    return units(np.array([0.0, 0.0, 1.0]) - facet[:, 2:] * facet, 1e-6)


def _curvature(surface: Surface, along: Array) -> Array:
    """Compute the normal curvature along directions in the triangles, (f, 3) unit vectors; (f,) 1/mm."""
    corners, normals, facet = surface.triangles, surface.corner_normals, surface.facet_normals
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # along = a u + b v, solved from its products with u and v.
    uu, uv, vv = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v)))
    cu, cv = np.einsum("ij,ij->i", along, u), np.einsum("ij,ij->i", along, v)
    area2 = uu * vv - uv * uv
    solid = np.linalg.norm(facet, axis=1) > 0.5
    safe = np.where(solid, area2, 1.0)
    a, b = (cu * vv - cv * uv) / safe, (cv * uu - cu * uv) / safe
    change = a[:, None] * (normals[:, 1] - normals[:, 0]) + b[:, None] * (normals[:, 2] - normals[:, 0])
    return np.where(solid, np.einsum("ij,ij->i", change, along), 0.0)


def _range_largest(first: IntArray, last: IntArray, value: Array, count: int) -> Array:
    """Find the largest value among the ranges first…last that cover each of `count` bins, 0 where none does.

    Two ranges whose length is the power of two below its own cover each range. The values of each power are
    then passed down to the next lower one.
    """
    power = np.frexp(last - first + 1)[1] - 1
    table = np.zeros((int(power.max(initial=0)) + 1, count))
    np.maximum.at(table, (power, first), value)
    np.maximum.at(table, (power, last - 2**power + 1), value)
    for k in range(len(table) - 1, 0, -1):
        half = 2 ** (k - 1)
        table[k - 1] = np.maximum(table[k - 1], table[k])
        table[k - 1, half:] = np.maximum(table[k - 1, half:], table[k, :-half])
    return table[0]


def runs(wanted: BoolArray) -> list[tuple[int, int]]:
    """Return the first and one past the last index of each run of true values."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], wanted.astype(np.int64), [0]])))
    return [(int(a), int(b)) for a, b in ends.reshape(-1, 2)]


def _off_vertices(level: float, step: float, heights: Array, shifts: tuple[float, ...]) -> float:
    """Shift a level off the vertices' heights, if one of the shifts does."""
    for shift in shifts:
        z = level + shift * step
        k = np.searchsorted(heights, z - VERTEX_DISTANCE)
        if k == len(heights) or heights[k] > z + VERTEX_DISTANCE:
            return z
    return level


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
    """Cut the surface at a height, mm, and chain the segments.

    Vertices on the level count as above it, so every crossed triangle has one edge that rises through the
    level and one that falls. Neighbours are found by the edges they share, without a tolerance. On an open
    mesh a chain ends where a neighbour is missing. Open chains come first, then closed ones, each by its
    first triangle.
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
    """Find where the edge that rises (or falls) through the level meets it, (m, 3) mm, and the normals there.

    Before them stand the numbers of the edges, (m,), the same for both triangles of an edge.
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
