"""Compiled loops: the gap between two convex bodies, and how deep one is in the other.

A body is the convex hull of circles in planes normal to its z axis, (m, 4) mm: centre and radius, 0 for a
point. A cone has two circles, a box eight points, a triangle three. Two bodies overlap where the differences
of their points, a convex set too, include the origin. The gap is the origin's distance to that set (GJK), the
depth its distance to the set's surface from inside (EPA). Each of both bounds is that of a direction or of a
point, so what isn't exact errs to the safe side.

Importing this module loads numba.

References
----------
Gilbert, Johnson and Keerthi (1988); van den Bergen (2001); Ericson (2005), Real-time collision detection.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, IntArray, innermost

Vector = tuple[float, float, float]
# Of a hull that grows: corners, planes of faces, their corners, and edges of the border.
Hull = tuple[Array, Array, IntArray, IntArray]

# mm: a gap and a depth are this exact; nearer than TOUCHING counts as touching.
EXACT, EXACT_DEPTH, TOUCHING = 1e-9, 1e-6, 1e-12
# A tetrahedron whose volume is a smaller share of its edges' product is flat but for rounding.
FLAT = 1e-14
# Steps towards the nearest points, of which flat bodies need some ten; corners and faces of a growing hull.
MOST_STEPS, MOST_CORNERS, MOST_FACES = 200, 256, 1024


@innermost
def dot(p: Vector, q: Vector) -> float:
    """Scalar product."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@innermost
def minus(p: Vector, q: Vector) -> Vector:
    """Difference of two vectors."""
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@innermost
def times(s: float, p: Vector) -> Vector:
    """Multiple of a vector."""
    return s * p[0], s * p[1], s * p[2]


@innermost
def cross(p: Vector, q: Vector) -> Vector:
    """Vector product."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@innermost
def vector(rows: Array, k: int) -> Vector:
    """First three numbers of a row."""
    return rows[k, 0], rows[k, 1], rows[k, 2]


@innermost
def put(rows: Array, k: int, p: Vector) -> None:
    """Write a vector to a row."""
    rows[k, 0], rows[k, 1], rows[k, 2] = p


@innermost
def farthest(body: Array, d: Vector) -> Vector:
    """Farthest point of a body along a direction, in its own frame, mm."""
    flat = np.sqrt(d[0] * d[0] + d[1] * d[1])
    most, at = -np.inf, 0
    for k in range(len(body)):
        value = body[k, 0] * d[0] + body[k, 1] * d[1] + body[k, 2] * d[2] + body[k, 3] * flat
        if value > most:
            most, at = value, k
    share = body[at, 3] / flat if flat > 0.0 else 0.0
    return body[at, 0] + share * d[0], body[at, 1] + share * d[1], body[at, 2]


@innermost
def placed(pose: Array, p: Vector) -> Vector:
    """Point of the posed frame in the other one, mm."""
    x = pose[0, 0] * p[0] + pose[0, 1] * p[1] + pose[0, 2] * p[2] + pose[0, 3]
    y = pose[1, 0] * p[0] + pose[1, 1] * p[1] + pose[1, 2] * p[2] + pose[1, 3]
    return x, y, pose[2, 0] * p[0] + pose[2, 1] * p[1] + pose[2, 2] * p[2] + pose[2, 3]


@innermost
def turned_back(pose: Array, d: Vector) -> Vector:
    """Direction in the posed frame."""
    x = pose[0, 0] * d[0] + pose[1, 0] * d[1] + pose[2, 0] * d[2]
    y = pose[0, 1] * d[0] + pose[1, 1] * d[1] + pose[2, 1] * d[2]
    return x, y, pose[0, 2] * d[0] + pose[1, 2] * d[1] + pose[2, 2] * d[2]


@innermost
def difference(a: Array, b: Array, pose: Array, d: Vector) -> Vector:
    """Farthest difference of a point of a and one of b along a direction, in a's frame, where b is posed."""
    return minus(farthest(a, d), placed(pose, farthest(b, turned_back(pose, times(-1.0, d)))))


@innermost
def weights_on(p: Vector, q: Vector, r: Vector) -> Vector:
    """Weights of the corners in the point of a triangle nearest to the origin (Ericson, 5.1.5)."""
    u, v = minus(q, p), minus(r, p)
    up, uq, ur = -dot(u, p), -dot(u, q), -dot(u, r)
    vp, vq, vr = -dot(v, p), -dot(v, q), -dot(v, r)
    if up <= 0.0 and vp <= 0.0:
        return 1.0, 0.0, 0.0
    if uq >= 0.0 and vq <= uq:
        return 0.0, 1.0, 0.0
    on_r = up * vq - uq * vp
    if on_r <= 0.0 and up >= 0.0 and uq <= 0.0:
        share = up / (up - uq) if up != uq else 0.0
        return 1.0 - share, share, 0.0
    if vr >= 0.0 and ur <= vr:
        return 0.0, 0.0, 1.0
    on_q = ur * vp - up * vr
    if on_q <= 0.0 and vp >= 0.0 and vr <= 0.0:
        share = vp / (vp - vr) if vp != vr else 0.0
        return 1.0 - share, 0.0, share
    on_p = uq * vr - ur * vq
    if on_p <= 0.0 and vq >= uq and ur >= vr:
        share = (vq - uq) / ((vq - uq) + (ur - vr))
        return 0.0, 1.0 - share, share
    whole = on_p + on_q + on_r
    return on_p / whole, on_q / whole, on_r / whole


@innermost
def same_side(p: Vector, q: Vector, r: Vector, s: Vector) -> bool:
    """Whether s and the origin are on one side of the plane of a triangle, beyond rounding."""
    u, v, w = minus(q, p), minus(r, p), minus(s, p)
    normal = cross(u, v)
    here, there = -dot(normal, p), dot(normal, w)
    rounding = FLAT * np.sqrt(dot(u, u) * dot(v, v)) * (np.sqrt(dot(w, w)) + np.sqrt(dot(p, p)))
    return (here > 0.0 and there > rounding) or (here < 0.0 and there < -rounding)


@innermost
def nearest_of(simplex: Array, n: int) -> tuple[int, Vector]:
    """Find the point of a simplex nearest to the origin, mm, and keep the corners that carry it.

    The simplex is (8, 3) mm, of which n ≥ 2 are corners; afterwards those kept come first. Rows 4 to 6 are
    those of the face that is nearest so far. Return the number of corners kept, 4 if the origin is
    inside, and the point, infinite where rounding leaves none.
    """
    weights, point, least = (0.0, 0.0, 0.0), (np.inf, np.inf, np.inf), np.inf
    inside = n == 4
    for face in range(4 if n == 4 else 1):
        # Two corners are a triangle whose third one is the first.
        p, q, r = (
            vector(simplex, (face + 1) % n),
            vector(simplex, (face + 2) % n),
            vector(simplex, (face + 3) % n),
        )
        if n == 4 and same_side(p, q, r, vector(simplex, face)):
            continue
        inside = False
        shares = weights_on(p, q, r)
        there = minus(times(shares[0], p), minus(times(-shares[1], q), times(shares[2], r)))
        if dot(there, there) < least:
            least, point, weights = dot(there, there), there, shares
            put(simplex, 4, p)
            put(simplex, 5, q)
            put(simplex, 6, r)
    if inside:
        return 4, (0.0, 0.0, 0.0)
    kept = 0
    for k in range(3):
        if weights[k] > 0.0:
            put(simplex, kept, vector(simplex, 4 + k))
            kept += 1
    return kept, point


@innermost
def gap_bounds(
    a: Array, b: Array, pose: Array, near: float, far: float, simplex: Array
) -> tuple[float, float]:
    """Bound the gap between two bodies, (m, 4) mm each, from below and above, mm, to `EXACT` of each other.

    It ends early once the gap is known to be at most `near` or more than `far`, mm. The pose, (4, 4) mm, is
    of b's frame in a's; the simplex, (8, 3), is work space. In its last row is a direction to begin with, or
    0, and afterwards the one that parts the bodies farthest: it often parts those beside them, too.
    """
    d = vector(simplex, 7)
    v = difference(a, b, pose, d)
    put(simplex, 0, v)
    n, lower, upper = 1, max(-dot(d, v), 0.0), np.sqrt(dot(v, v))
    if lower > far:
        return lower, upper
    for _ in range(MOST_STEPS):
        if upper <= near or upper < TOUCHING:
            break
        d = times(-1.0 / upper, v)
        new = difference(a, b, pose, d)
        if -dot(d, new) > lower:
            lower = -dot(d, new)
            put(simplex, 7, d)
        if lower > far or upper - lower <= EXACT:
            break
        put(simplex, n, new)
        n, v = nearest_of(simplex, n + 1)
        if n == 4 and lower == 0.0:
            return 0.0, 0.0
        size = np.sqrt(dot(v, v))
        # Rounding ends the descent: with the origin in a flat simplex, though a direction parts the bodies.
        if n == 4 or not size < upper:
            break
        upper = size
    return lower, upper


@innermost
def put_face(corners: Array, faces: IntArray, planes: Array, at: int, i: int, j: int, k: int) -> None:
    """Write a face of three corners with its plane: outward normal and height above the origin, mm."""
    faces[at, 0], faces[at, 1], faces[at, 2] = i, j, k
    p = vector(corners, i)
    normal = cross(minus(vector(corners, j), p), minus(vector(corners, k), p))
    size = np.sqrt(dot(normal, normal))
    flat = size < 1e-14
    put(planes, at, (0.0, 0.0, 0.0) if flat else times(1.0 / size, normal))
    planes[at, 3] = np.inf if flat else dot(normal, p) / size


@innermost
def first_corners(a: Array, b: Array, pose: Array, corners: Array) -> float:
    """Write the corners of a tetrahedron inside the differences; return a bound of the depth from above, mm.

    It is 0 where the differences have no volume, as of two triangles in one plane.
    """
    d, upper = (1.0, 0.0, 0.0), np.inf
    put(corners, 0, difference(a, b, pose, d))
    for k in range(1, 4):
        edge = minus(vector(corners, 1), vector(corners, 0))
        if k == 2:
            least = min(abs(edge[0]), abs(edge[1]), abs(edge[2]))
            x, y = abs(edge[0]) == least, abs(edge[1]) == least
            d = cross(edge, (1.0, 0.0, 0.0) if x else (0.0, 1.0, 0.0) if y else (0.0, 0.0, 1.0))
        elif k == 3:
            d = cross(edge, minus(vector(corners, 2), vector(corners, 0)))
        size = np.sqrt(dot(d, d))
        if size == 0.0:
            return 0.0
        d, most = times(1.0 / size, d), -1.0
        for sign in (1.0, -1.0):
            new = difference(a, b, pose, times(sign, d))
            upper = min(upper, sign * dot(d, new))
            away = abs(dot(d, minus(new, vector(corners, 0))))
            if away > most:
                most = away
                put(corners, k, new)
    return upper


@innermost
def grow(corners: Array, new: int, faces: IntArray, planes: Array, count: int, edges: IntArray) -> int:
    """Replace the faces that a new corner sees by those to their common border; return the number of faces.

    It is −1 if rounding or lack of room leaves no border.
    """
    border, k = 0, 0
    while k < count:
        if planes[k, 3] < np.inf and dot(vector(planes, k), vector(corners, new)) <= planes[k, 3] + TOUCHING:
            k += 1
            continue
        for c in range(3):
            i, j, twin = faces[k, c], faces[k, (c + 1) % 3], -1
            for m in range(border):
                if edges[m, 0] == j and edges[m, 1] == i:
                    twin = m
            if twin >= 0:  # the face beyond this edge goes, too
                border -= 1
                edges[twin, 0], edges[twin, 1] = edges[border, 0], edges[border, 1]
            else:
                edges[border, 0], edges[border, 1] = i, j
                border += 1
        count -= 1
        put(planes, k, vector(planes, count))
        planes[k, 3] = planes[count, 3]
        for c in range(3):  # numba takes seconds to compile the copy of a row
            faces[k, c] = faces[count, c]
    if border == 0 or count + border > len(faces):
        return -1
    for m in range(border):
        put_face(corners, faces, planes, count + m, edges[m, 0], edges[m, 1], new)
    return count + border


@innermost
def overlap(a: Array, b: Array, pose: Array, floor: float, hull: Hull) -> float:
    """Length of the shortest movement that parts two bodies, mm, to `EXACT_DEPTH` and never too short.

    Once it is known to be at most `floor`, mm, any number up to that may be returned. The differences' hull
    grows outwards at the face nearest to the origin; every direction that is tried bounds the depth from
    above. Bodies and pose are as for `gap_bounds`. The hull is work space: (`MOST_CORNERS`, 3),
    (`MOST_FACES`, 4), (`MOST_FACES`, 3) and (3 `MOST_FACES`, 2).
    """
    corners, planes, faces, edges = hull
    upper = first_corners(a, b, pose, corners)
    if upper <= floor:
        return upper
    for k in range(4):
        i, j, m = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
        put_face(corners, faces, planes, k, i, j, m)
        if dot(vector(planes, k), vector(corners, k)) > planes[k, 3]:
            put_face(corners, faces, planes, k, i, m, j)
    count = k + 1  # numba would compile `grow` once more for the number 4
    for new in range(4, MOST_CORNERS):
        at = 0
        for face in range(count):
            if planes[face, 3] < planes[at, 3]:
                at = face
        d = vector(planes, at)
        found = difference(a, b, pose, d)
        upper = min(upper, dot(d, found))
        if upper <= floor or planes[at, 3] == np.inf or dot(d, found) - planes[at, 3] <= EXACT_DEPTH:
            break
        put(corners, new, found)
        count = grow(corners, new, faces, planes, count, edges)
        if count < 0:
            break
    return upper
