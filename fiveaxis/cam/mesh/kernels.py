"""Compiled loops: the distance from a point to triangles in a tree of boxes.

Importing this module loads numba, so `distance` does it only when a distance is computed.
"""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import Array, IntArray, compiled, inner, innermost

Point = tuple[float, float, float]
# Deep enough for any tree: two nodes wait at each of at most 62 levels.
STACK = 128
# A triangle so many times larger than those beside it is flat, not a facet of a curved surface.
MUCH_LARGER = 4.0
# A squared distance is larger beyond rounding if it is so by this factor.
MORE = 1.0 + 1e-9


@innermost
def share_along(p: Array, a: Array, b: Array) -> float:
    """Share, 0…1, of the segment from a to b at which it is nearest to a point."""
    along = 0.0
    length = 0.0
    for k in range(3):
        along += (p[k] - a[k]) * (b[k] - a[k])
        length += (b[k] - a[k]) ** 2
    return 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)


@innermost
def segment_gap(p: Array, a: Array, b: Array) -> float:
    """Squared distance from a point to the segment from a to b."""
    t = share_along(p, a, b)
    gap = 0.0
    for k in range(3):
        gap += (p[k] - a[k] - t * (b[k] - a[k])) ** 2
    return gap


@innermost
def offset(a: Array, b: Array) -> Point:
    """Vector from one point to another."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


@innermost
def cross(u: Point, v: Point) -> Point:
    """Cross product of two vectors."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@innermost
def dot(u: Point, v: Point) -> float:
    """Scalar product of two vectors."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@innermost
def shares_on(p: Array, triangle: Array) -> tuple[float, float, float]:
    """Shares of the edges from the first corner to the foot of p's perpendicular, and its squared length.

    The last is −1 where the foot isn't on the triangle, or the triangle has no area.
    """
    u, v, w = offset(triangle[0], triangle[1]), offset(triangle[0], triangle[2]), offset(triangle[0], p)
    n = cross(u, v)
    area2 = dot(n, n)
    if area2 > 0.0:
        # Barycentric coordinates of the foot, times area2.
        s, t = dot(cross(w, v), n), dot(cross(u, w), n)
        if s >= 0.0 and t >= 0.0 and s + t <= area2:
            height = dot(w, n)
            return s / area2, t / area2, height * height / area2
    return 0.0, 0.0, -1.0


@innermost
def triangle_gap(p: Array, triangle: Array) -> float:
    """Squared distance from a point to a triangle, (3, 3); also right for one without area."""
    _s, _t, gap = shares_on(p, triangle)
    if gap >= 0.0:
        return gap
    a, b, c = triangle[0], triangle[1], triangle[2]
    return min(segment_gap(p, a, b), segment_gap(p, b, c), segment_gap(p, c, a))


@innermost
def lies_beyond(p: Array, triangle: Array, best: float) -> bool:
    """Check whether a plane facing a triangle's middle proves it farther from p than a squared distance.

    That takes a fraction of the time of the distance itself.
    """
    u, v, w = offset(p, triangle[0]), offset(p, triangle[1]), offset(p, triangle[2])
    d = u[0] + v[0] + w[0], u[1] + v[1] + w[1], u[2] + v[2] + w[2]
    nearest = min(dot(u, d), dot(v, d), dot(w, d))
    return nearest > 0.0 and nearest * nearest > MORE * best * dot(d, d)


@innermost
def box_gap(p: Array, box: Array) -> float:
    """Squared distance from a point to a box, (2, 3); zero inside."""
    gap = 0.0
    for k in range(3):
        out = max(box[0, k] - p[k], p[k] - box[1, k], 0.0)
        gap += out * out
    return gap


@innermost
def push_children(p: Array, boxes: Array, node: int, waiting: IntArray, count: int) -> int:
    """Put a node's children on the stack, and return the number of nodes there.

    The child nearer to p is searched first, as it rules out most of the other.
    """
    swap = box_gap(p, boxes[2 * node]) < box_gap(p, boxes[2 * node + 1])
    waiting[count] = 2 * node + 1 if swap else 2 * node
    waiting[count + 1] = 2 * node if swap else 2 * node + 1
    return count + 2


@inner
def nearest_triangle(p: Array, triangles: Array, boxes: Array, bound: float) -> tuple[int, float]:
    """Find the row of the triangle nearest to p, (3,) mm, in the tree's order, and its distance, mm.

    If none is within `bound`, they are −1 and `bound`. Of triangles that share the nearest edge or corner,
    the first one met in the tree is returned. Triangles and boxes are as of `TriangleTree`.
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
                if lies_beyond(p, triangles[k], best):
                    continue
                gap = triangle_gap(p, triangles[k])
                if gap < best:
                    best, found = gap, k
            continue
        count = push_children(p, boxes, node, waiting, count)
    return found, float(np.sqrt(best))


@compiled
def nearest_all(points: Array, triangles: Array, boxes: Array, bound: float) -> Array:
    """Compute the distance of `nearest_triangle` for each row of points, (n, 3) → (n,)."""
    gaps = np.empty(len(points))
    for i in range(len(points)):
        gaps[i] = nearest_triangle(points[i], triangles, boxes, bound)[1]
    return gaps


@innermost
def foot_on_triangle(p: Array, triangle: Array, foot: Array) -> float:
    """Find the nearest point to p on a triangle, (3, 3): foot, (3,) mm, is filled in.

    The squared distance is returned.
    """
    a, b, c = triangle[0], triangle[1], triangle[2]
    s, t, gap = shares_on(p, triangle)
    for k in range(3):
        foot[k] = a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k])
    if gap < 0.0:
        gap = np.inf
        for one, other in ((a, b), (b, c), (c, a)):
            here = segment_gap(p, one, other)
            if here < gap:
                gap, share = here, share_along(p, one, other)
                for k in range(3):
                    foot[k] = one[k] + share * (other[k] - one[k])
    return (p[0] - foot[0]) ** 2 + (p[1] - foot[1]) ** 2 + (p[2] - foot[2]) ** 2


@compiled
def feet_all(points: Array, triangles: Array, boxes: Array, bound: float) -> tuple[Array, IntArray, Array]:
    """Find the nearest point of the surface to each row of points.

    (n, 3) mm, NaN where no triangle is within `bound`; (n,) triangle in the tree's order, −1 there; and (n,)
    distance, mm, infinite there
    """
    feet, rows, gaps = np.empty((len(points), 3)), np.empty(len(points), np.int64), np.empty(len(points))
    for i in range(len(points)):
        rows[i], gaps[i] = nearest_triangle(points[i], triangles, boxes, bound)
        if rows[i] >= 0:
            gaps[i] = math.sqrt(foot_on_triangle(points[i], triangles[rows[i]], feet[i]))
        else:
            gaps[i] = np.inf
            for k in range(3):
                feet[i, k] = np.nan
    return feet, rows, gaps


@compiled
def reach(start: Array, end: Array, triangles: Array, boxes: Array, limit: float, finest: float) -> float:
    """Compute how far, mm, a point can move from start towards end with every triangle at least `limit` away.

    With the nearest triangle at distance d, the point may move by ``d − limit`` without another check, since
    no distance changes faster than the point moves. A step is never shorter than `finest`. The result is −1
    if the start itself is too near.
    """
    way, place = offset(start, end), np.empty(3)
    length = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
    done = 0.0
    clear = -1.0
    while True:
        share = 0.0 if length == 0.0 else done / length
        ahead = length - done
        for k in range(3):
            place[k] = start[k] + share * way[k]
        _, gap = nearest_triangle(place, triangles, boxes, limit + max(ahead, finest))
        if gap < limit:
            return clear
        clear = done
        if ahead <= 0.0:
            return clear
        done = min(length, done + max(gap - limit, finest))


@compiled
def encloses(triangles: Array, point: Array) -> bool:
    """Check whether a point is inside a closed mesh, by the solid angle of its triangles.

    Parameters
    ----------
    triangles : (t, 3, 3), mm, anticlockwise seen from outside
    point : (3,), mm, not on the surface

    References
    ----------
    Van Oosterom and Strackee (1983), The solid angle of a plane triangle.
    """
    angle = 0.0
    for t in range(len(triangles)):
        a, b, c = (
            offset(point, triangles[t, 0]),
            offset(point, triangles[t, 1]),
            offset(point, triangles[t, 2]),
        )
        la, lb, lc = math.sqrt(dot(a, a)), math.sqrt(dot(b, b)), math.sqrt(dot(c, c))
        below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
        angle += 2.0 * math.atan2(dot(a, cross(b, c)), below)
    return bool(abs(angle) > 2.0 * math.pi)


@compiled
def sums_near(
    order: IntArray, first: IntArray, angles: Array, facets: Array, areas: Array, least: float
) -> Array:
    """Sum the normals of the triangles around every corner that face its own triangle's way; (3f, 3).

    Their weights are those of `fiveaxis.cam.mesh.surface.corner_normals`. `order` has the corners sorted by
    vertex, `first`, (v + 1,), where those of each vertex begin in it; angles are (3f,) rad by corner, areas
    (f,) mm². The cosine of two normals must exceed the least one.
    """
    total = np.empty((len(order), 3))
    for vertex in range(len(first) - 1):
        for i in range(first[vertex], first[vertex + 1]):
            own = facets[order[i] // 3]
            sums = total[order[i]]
            sums[0], sums[1], sums[2], turn, thin = 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(first[vertex], first[vertex + 1]):
                near, area = facets[order[j] // 3], areas[order[j] // 3]
                if area > 0.0 and own[0] * near[0] + own[1] * near[1] + own[2] * near[2] > least:
                    turn += angles[order[j]]
                    thin += angles[order[j]] / area
            for j in range(first[vertex], first[vertex + 1]):
                near, area = facets[order[j] // 3], areas[order[j] // 3]
                if area > 0.0 and own[0] * near[0] + own[1] * near[1] + own[2] * near[2] > least:
                    larger = area * thin / (MUCH_LARGER * turn) if turn > 0.0 else 1.0
                    for k in range(3):
                        sums[k] += angles[order[j]] * max(larger, 1.0) ** 3 * near[k]
    return total
