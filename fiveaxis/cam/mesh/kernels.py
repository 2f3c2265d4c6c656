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
    area2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    if area2 > 0.0:
        # Barycentric coordinates of the foot, times area2.
        one, other = cross(w, v), cross(u, w)
        s = one[0] * n[0] + one[1] * n[1] + one[2] * n[2]
        t = other[0] * n[0] + other[1] * n[1] + other[2] * n[2]
        if s >= 0.0 and t >= 0.0 and s + t <= area2:
            height = w[0] * n[0] + w[1] * n[1] + w[2] * n[2]
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
def nearest_all(points: Array, triangles: Array, boxes: Array, bound: float) -> Array:
    """Compute the distance of `nearest_triangle` for each row of points, (n, 3) → (n,)."""
    gaps = np.empty(len(points))
    for i in range(len(points)):
        gaps[i] = nearest_triangle(points[i], triangles, boxes, bound)[1]
    return gaps


@innermost
def foot_on_triangle(p: Array, triangle: Array, foot: Array) -> float:
    """Find the nearest point to p on a triangle, (3, 3): foot, (3,) mm, is filled in.

    Returns
    -------
    The squared distance
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

    Returns
    -------
    feet : (n, 3), mm, NaN where no triangle is within `bound`
    rows : (n,), triangle in the tree's order, −1 there
    distances : (n,), mm, infinite there
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
        within = limit + max(ahead, finest)
        _, gap = nearest_triangle(start + share * (end - start), triangles, boxes, within)
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
    """Sum the normals of the triangles around every corner that face its own triangle's way.

    Their weights are those of `fiveaxis.cam.mesh.surface.corner_normals`.

    Parameters
    ----------
    order : (3f,), the corners sorted by vertex
    first : (v + 1,), index in `order` of each vertex's first corner
    angles : (3f,), rad, of each corner
    facets : (f, 3), unit vectors or zero
    areas : (f,), mm²
    least : the cosine that two normals must exceed

    Returns
    -------
    (3f, 3), by corner
    """
    total = np.zeros((len(order), 3))
    for vertex in range(len(first) - 1):
        for i in range(first[vertex], first[vertex + 1]):
            own = facets[order[i] // 3]
            sums = total[order[i]]
            turn, thin = 0.0, 0.0
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


@compiled
def merge_rows(rows: Array) -> tuple[IntArray, IntArray]:
    """Find the distinct rows of finite numbers, in the order of their first occurrence.

    A hash table of twice as many places as rows, which sorting them would take five times as long as.

    Parameters
    ----------
    rows : (n, 3)

    Returns
    -------
    first : (d,), the first row of each value
    number : (n,), which of these values each row has
    """
    places = 16
    while places < 2 * len(rows):
        places *= 2
    table = np.zeros(places, dtype=np.int32)  # the number of a value, from 1
    bits = rows.view(np.uint64)
    first = np.empty(len(rows), dtype=np.int64)
    number = np.empty(len(rows), dtype=np.int64)
    count = 0
    for i in range(len(rows)):
        key = np.uint64(0)
        for k in range(3):
            # Steps of SplitMix64: neighbouring numbers differ in few bits.
            key = (key ^ bits[i, k]) * np.uint64(0xBF58476D1CE4E5B9)
            key ^= key >> np.uint64(32)
        place = np.int64(key & np.uint64(places - 1))
        while True:
            found = table[place] - 1
            if found < 0:
                first[count] = i
                number[i] = count
                count += 1
                table[place] = count
                break
            row = first[found]
            if bits[row, 0] == bits[i, 0] and bits[row, 1] == bits[i, 1] and bits[row, 2] == bits[i, 2]:
                number[i] = found
                break
            place = (place + 1) & (places - 1)
    return first[:count].copy(), number


@innermost
def halve(keys: Array, rows: IntArray) -> None:
    """Move the smaller half, by key and then by row, before the larger one, in place.

    References
    ----------
    Hoare (1961), Algorithm 65: Find.
    """
    low, high, middle = 0, len(keys) - 1, len(keys) // 2
    while low < high:
        key, row = keys[(low + high) // 2], rows[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while keys[i] < key or (keys[i] == key and rows[i] < row):
                i += 1
            while key < keys[j] or (key == keys[j] and row < rows[j]):
                j -= 1
            if i <= j:
                keys[i], keys[j] = keys[j], keys[i]
                rows[i], rows[j] = rows[j], rows[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled
def sort_into_leaves(rows: IntArray, centres: Array, leaf: int) -> None:
    """Halve each node along its longest extent down to leaves, in place; rows of a leaf are in no order.

    Parameters
    ----------
    rows : (n,), of `centres`; n is a power of two
    centres : (f, 3), mm
    leaf : rows of a leaf, a power of two
    """
    keys = np.empty(len(rows))
    size = len(rows)
    while size > leaf:
        for begin in range(0, len(rows), size):
            part, along = rows[begin : begin + size], keys[begin : begin + size]
            axis, longest = 0, -1.0
            for k in range(3):
                low, high = centres[part[0], k], centres[part[0], k]
                for row in part:
                    low, high = min(low, centres[row, k]), max(high, centres[row, k])
                if high - low > longest:
                    axis, longest = k, high - low
            for i in range(size):
                along[i] = centres[part[i], axis]
            halve(along, part)
        size //= 2
