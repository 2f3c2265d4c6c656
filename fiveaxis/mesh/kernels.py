"""Compiled loops: the distance from a point to triangles in a tree of boxes.

Importing this module loads numba, so `distance` does it only when a distance is computed.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray

# Deep enough for any tree: two nodes wait at each of at most 62 levels.
STACK = 128


@compiled
def segment_gap(p: Array, a: Array, b: Array) -> float:
    """Squared distance from a point to the segment from a to b."""
    along = 0.0
    length = 0.0
    for k in range(3):
        along += (p[k] - a[k]) * (b[k] - a[k])
        length += (b[k] - a[k]) ** 2
    t = 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)
    gap = 0.0
    for k in range(3):
        gap += (p[k] - a[k] - t * (b[k] - a[k])) ** 2
    return gap


@compiled
def triangle_gap(p: Array, triangle: Array) -> float:
    """Squared distance from a point to a triangle, (3, 3); also right for one without area."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = nx * nx + ny * ny + nz * nz
    if area2 > 0.0:
        # Barycentric coordinates of the foot of the perpendicular, times area2.
        s = (wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz
        t = (uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz
        if s >= 0.0 and t >= 0.0 and s + t <= area2:
            height = wx * nx + wy * ny + wz * nz
            return float(height * height / area2)
    return min(segment_gap(p, a, b), segment_gap(p, b, c), segment_gap(p, c, a))


@compiled
def box_gap(p: Array, box: Array) -> float:
    """Squared distance from a point to a box, (2, 3); zero inside."""
    gap = 0.0
    for k in range(3):
        out = max(box[0, k] - p[k], p[k] - box[1, k], 0.0)
        gap += out * out
    return gap


@compiled
def push_children(p: Array, boxes: Array, node: int, waiting: IntArray, count: int) -> int:
    """Put a node's children on the stack, and return the number of nodes there.

    The child nearer to p is searched first, as it rules out most of the other.
    """
    swap = box_gap(p, boxes[2 * node]) < box_gap(p, boxes[2 * node + 1])
    waiting[count] = 2 * node + 1 if swap else 2 * node
    waiting[count + 1] = 2 * node if swap else 2 * node + 1
    return count + 2


@compiled
def nearest_triangle(p: Array, triangles: Array, boxes: Array, bound: float) -> tuple[int, float]:
    """Find the row of the nearest triangle, in the tree's order, and its distance, mm.

    If none is within `bound`, they are −1 and `bound`. Of triangles that share the nearest edge or corner,
    the first one met in the tree is returned.

    Parameters
    ----------
    p : (3,), mm
    triangles : (leaves * width, 3, 3), mm, in the order of the leaves
    boxes : (2 * leaves, 2, 3), mm; node i has the children 2i and 2i + 1, the leaves come last
    bound : mm
    """
    leaves = len(boxes) // 2
    width = len(triangles) // leaves
    best = bound * bound
    found = -1
    waiting = np.empty(STACK, np.int64)
    waiting[0] = 1
    count = 1
    while count > 0:
        count -= 1
        node = waiting[count]
        if box_gap(p, boxes[node]) >= best:
            continue
        if node >= leaves:
            for k in range((node - leaves) * width, (node - leaves + 1) * width):
                gap = triangle_gap(p, triangles[k])
                if gap < best:
                    best, found = gap, k
            continue
        count = push_children(p, boxes, node, waiting, count)
    return found, float(np.sqrt(best))


@compiled
def nearest(p: Array, triangles: Array, boxes: Array, bound: float) -> float:
    """Return only the distance of `nearest_triangle`, mm."""
    return nearest_triangle(p, triangles, boxes, bound)[1]


@compiled
def nearest_all(points: Array, triangles: Array, boxes: Array, bound: float) -> Array:
    """Compute `nearest` for each row of points, (n, 3) → (n,)."""
    gaps = np.empty(len(points))
    for i in range(len(points)):
        gaps[i] = nearest(points[i], triangles, boxes, bound)
    return gaps


@compiled
def foot_on_segment(p: Array, a: Array, b: Array) -> Array:
    """Nearest point to p on the segment from a to b, (3,) mm."""
    along = 0.0
    length = 0.0
    for k in range(3):
        along += (p[k] - a[k]) * (b[k] - a[k])
        length += (b[k] - a[k]) ** 2
    t = 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)
    return a + t * (b - a)


@compiled
def foot_on_triangle(p: Array, triangle: Array) -> Array:
    """Nearest point to p on a triangle, (3, 3) → (3,) mm; same cases as `triangle_gap`."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    u, v, w = b - a, c - a, p - a
    n = np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
    area2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    if area2 > 0.0:
        s = (w[1] * v[2] - w[2] * v[1]) * n[0] + (w[2] * v[0] - w[0] * v[2]) * n[1]
        s += (w[0] * v[1] - w[1] * v[0]) * n[2]
        t = (u[1] * w[2] - u[2] * w[1]) * n[0] + (u[2] * w[0] - u[0] * w[2]) * n[1]
        t += (u[0] * w[1] - u[1] * w[0]) * n[2]
        if s >= 0.0 and t >= 0.0 and s + t <= area2:
            return a + (s / area2) * u + (t / area2) * v
    best = foot_on_segment(p, a, b)
    gap = np.sum((p - best) ** 2)
    for one, other in ((b, c), (c, a)):
        foot = foot_on_segment(p, one, other)
        here = np.sum((p - foot) ** 2)
        if here < gap:
            best, gap = foot, here
    return best


@compiled
def feet_all(points: Array, triangles: Array, boxes: Array, bound: float) -> tuple[Array, IntArray, Array]:
    """Find the nearest point of the surface to each row of points.

    Returns
    -------
    feet : (n, 3), mm, NaN where no triangle is within `bound`
    rows : (n,), triangle in the tree's order, −1 there
    distances : (n,), mm, infinite there
    """
    feet = np.full((len(points), 3), np.nan)
    rows = np.empty(len(points), np.int64)
    gaps = np.full(len(points), np.inf)
    for i in range(len(points)):
        row, _ = nearest_triangle(points[i], triangles, boxes, bound)
        rows[i] = row
        if row >= 0:
            feet[i] = foot_on_triangle(points[i], triangles[row])
            gaps[i] = np.sqrt(np.sum((points[i] - feet[i]) ** 2))
    return feet, rows, gaps


@compiled
def reach(start: Array, end: Array, triangles: Array, boxes: Array, limit: float, finest: float) -> float:
    """Compute how far a point can move from start towards end with every triangle at least `limit` away.

    With the nearest triangle at distance d, the point may move by ``d − limit`` without another check, since
    no distance changes faster than the point moves. A step is never shorter than `finest`.

    Returns
    -------
    mm; −1 if the start itself is too near
    """
    length = np.sqrt(np.sum((end - start) ** 2))
    done = 0.0
    clear = -1.0
    while True:
        share = 0.0 if length == 0.0 else done / length
        ahead = length - done
        gap = nearest(start + share * (end - start), triangles, boxes, limit + max(ahead, finest))
        if gap < limit:
            return clear
        clear = done
        if ahead <= 0.0:
            return clear
        done = min(length, done + max(gap - limit, finest))
