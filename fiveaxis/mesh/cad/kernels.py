"""Compiled loops over exact surfaces: evaluation, trimming, nearest points.

Importing this module loads numba, so `model` does it only when a surface is asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.mesh.kernels import STACK, box_gap, push_children, triangle_gap

if TYPE_CHECKING:
    from fiveaxis.mesh.cad.model import Surfaces, Triangles, Trims

# Kinds of surfaces, as numbers of `fiveaxis.mesh.cad.model.KINDS`.
PLANE, CYLINDER, CONE, SPHERE, TORUS, SPLINE = range(6)
# Values of a B-spline's basis at one parameter: its degree is at most 25, as in Open Cascade.
BASIS = 26
# Most places of the mesh from which the nearest point of the surfaces is searched, and their bins in u and v.
STARTS, BINS = 24, 4
# Steps of Newton's method, halvings of one, steps along a border; mm and shares at which they end.
STEPS, HALVINGS, BORDER_STEPS = 30, 12, 8
SETTLED, AT_REST = 1e-10, 1e-12
# mm: where the whole range of a parameter is no longer, there is a pole; directions tried around it, and how
# far beside it, as a share of the way to the middle.
POLE, AROUND, BESIDE = 1e-6, 16, 1e-3

Scratch: TypeAlias = tuple[Array, Array, Array, Array]


@compiled
def scratch() -> Scratch:
    """Make room for one evaluation: S and its derivatives (6, 3), two bases (3, `BASIS`), sums (6, 4)."""
    return np.empty((6, 3)), np.empty((3, BASIS)), np.empty((3, BASIS)), np.empty((6, 4))


@compiled
def dot(a: Array, b: Array) -> float:
    """Multiply two vectors, (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def differentiate(out: Array, row: int, knots: Array, begin: int, span: int, p: int) -> None:
    """Turn a row of `out` from basis functions of degree p − 1 into the derivatives of those of degree p.

    ``N'[i, p] = p (N[i, p−1] / (k[i+p] − k[i]) − N[i+1, p−1] / (k[i+p+1] − k[i+1]))``
    """
    before = 0.0
    for j in range(p + 1):
        now = 0.0
        if j < p:
            now = out[row, j] / (knots[begin + span + 1 + j] - knots[begin + span + 1 - p + j])
        out[row, j] = p * (before - now)
        before = now


@compiled
def basis(knots: Array, begin: int, count: int, degree: int, t: float, out: Array) -> int:
    """Evaluate the B-spline functions that aren't zero at a parameter, with two derivatives.

    Parameters
    ----------
    knots, begin, count, degree : of the direction: its knots begin at `begin`, `count` is that of its poles
    t : clamped to the knots' range
    out : (3, `BASIS`), filled with values, first and second derivatives by function

    Returns
    -------
    Index of the first of these functions

    References
    ----------
    Piegl and Tiller (1997), The NURBS Book, algorithms A2.2 and A2.3.
    """
    t = min(max(t, knots[begin + degree]), knots[begin + count])
    low, high = degree, count - 1
    while low < high:
        middle = (low + high + 1) // 2
        if knots[begin + middle] <= t:
            low = middle
        else:
            high = middle - 1
    while low > degree and knots[begin + low + 1] <= knots[begin + low]:
        low -= 1
    for d in range(3):
        for j in range(degree + 1):
            out[d, j] = 0.0
    # Columns hold the functions of degree q; rows 1 and 2 keep those of the degrees p − 1 and p − 2.
    out[0, 0] = 1.0
    if degree <= 2:
        out[degree, 0] = 1.0
    for q in range(1, degree + 1):
        saved = 0.0
        for j in range(q):
            left, right = knots[begin + low - q + 1 + j], knots[begin + low + 1 + j]
            part = out[0, j] / (right - left)
            out[0, j] = saved + (right - t) * part
            saved = (t - left) * part
        out[0, q] = saved
        for d in range(1, 3):
            if q == degree - d:
                for j in range(q + 1):
                    out[d, j] = out[0, j]
    if degree >= 2:
        differentiate(out, 2, knots, begin, low, degree - 1)
        differentiate(out, 2, knots, begin, low, degree)
    differentiate(out, 1, knots, begin, low, degree)
    return low - degree


@compiled
def spline(face: int, u: float, v: float, surfaces: Surfaces, work: Scratch) -> None:
    """Evaluate a rational B-spline surface into the first array of `work`, as `surface` does."""
    out, across, along, sums = work
    p, q, n, m, knots_u, knots_v, poles = surfaces.form[face]
    first = basis(surfaces.knots, knots_u, n, p, u, across)
    second = basis(surfaces.knots, knots_v, m, q, v, along)
    sums[:] = 0.0
    for i in range(p + 1):
        for j in range(q + 1):
            pole = surfaces.poles[poles + (first + i) * m + second + j]
            for x in range(4):
                sums[0, x] += across[0, i] * along[0, j] * pole[x]
                sums[1, x] += across[1, i] * along[0, j] * pole[x]
                sums[2, x] += across[0, i] * along[1, j] * pole[x]
                sums[3, x] += across[2, i] * along[0, j] * pole[x]
                sums[4, x] += across[1, i] * along[1, j] * pole[x]
                sums[5, x] += across[0, i] * along[2, j] * pole[x]
    w = sums[0, 3]
    for x in range(3):
        s = sums[0, x] / w
        su = (sums[1, x] - sums[1, 3] * s) / w
        sv = (sums[2, x] - sums[2, 3] * s) / w
        out[0, x], out[1, x], out[2, x] = s, su, sv
        out[3, x] = (sums[3, x] - 2.0 * sums[1, 3] * su - sums[3, 3] * s) / w
        out[4, x] = (sums[4, x] - sums[1, 3] * sv - sums[2, 3] * su - sums[4, 3] * s) / w
        out[5, x] = (sums[5, x] - 2.0 * sums[2, 3] * sv - sums[5, 3] * s) / w


@compiled
def surface(face: int, u: float, v: float, surfaces: Surfaces, work: Scratch) -> None:
    """Evaluate a face's surface: S, Su, Sv, Suu, Suv, Svv into the first array of `work`.

    The parameters of planes, cylinders, cones, spheres and tori are those of ISO 10303-42.
    """
    kind = surfaces.kind[face]
    if kind == SPLINE:
        spline(face, u, v, surfaces, work)
        return
    out = work[0]
    out[3:] = 0.0
    su, cu, sv, cv = np.sin(u), np.cos(u), np.sin(v), np.cos(v)
    large, small = surfaces.size[face]
    for x in range(3):
        origin, e1, e2, e3 = surfaces.frame[face, :, x]
        radial, around = cu * e1 + su * e2, cu * e2 - su * e1
        if kind == PLANE:
            out[0, x], out[1, x], out[2, x] = origin + u * e1 + v * e2, e1, e2
        elif kind == CYLINDER:
            out[0, x], out[1, x], out[2, x] = origin + large * radial + v * e3, large * around, e3
            out[3, x] = -large * radial
        elif kind == CONE:
            sine, cosine = np.sin(small), np.cos(small)
            reach = large + v * sine
            out[0, x] = origin + reach * radial + v * cosine * e3
            out[1, x], out[2, x] = reach * around, sine * radial + cosine * e3
            out[3, x], out[4, x] = -reach * radial, sine * around
        else:
            # A sphere is a torus without a circle in its middle.
            middle, tube = (0.0, large) if kind == SPHERE else (large, small)
            reach = middle + tube * cv
            out[0, x] = origin + reach * radial + tube * sv * e3
            out[1, x], out[2, x] = reach * around, tube * (cv * e3 - sv * radial)
            out[3, x], out[4, x] = -reach * radial, -tube * sv * around
            out[5, x] = -tube * (cv * radial + sv * e3)


@compiled
def evaluate_all(faces: IntArray, uv: Array, surfaces: Surfaces) -> Array:
    """Evaluate surfaces at parameters, (n,) and (n, 2); (n, 6, 3) as by `surface`."""
    values = np.empty((len(faces), 6, 3))
    work = scratch()
    for i in range(len(faces)):
        surface(faces[i], uv[i, 0], uv[i, 1], surfaces, work)
        values[i] = work[0]
    return values


@compiled
def inside(u: float, v: float, border: Array) -> bool:
    """Check by the even-odd rule whether parameters lie inside a face's border, (s, ≥ 4): u0, v0, u1, v1."""
    odd = False
    for i in range(len(border)):
        u0, v0, u1, v1 = border[i, 0], border[i, 1], border[i, 2], border[i, 3]
        if (v0 > v) != (v1 > v) and u < u0 + (v - v0) / (v1 - v0) * (u1 - u0):
            odd = not odd
    return odd


@compiled
def onto_border(face: int, q: Array, border: Array, surfaces: Surfaces, work: Scratch) -> tuple[float, float]:
    """Find the parameters of the point of a face's border that is nearest to q, (3,) mm.

    Parameters
    ----------
    border : (s, 10), of the face: u0, v0, u1, v1, and both ends of the segment in mm
    """
    best, row, share = np.inf, 0, 0.0
    for i in range(len(border)):
        along, length, gap = 0.0, 0.0, 0.0
        for x in range(3):
            step = border[i, 7 + x] - border[i, 4 + x]
            along += (q[x] - border[i, 4 + x]) * step
            length += step * step
        t = 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)
        for x in range(3):
            gap += (border[i, 4 + x] + t * (border[i, 7 + x] - border[i, 4 + x]) - q[x]) ** 2
        if gap < best:
            best, row, share = gap, i, t
    u0, v0 = border[row, 0], border[row, 1]
    du, dv = border[row, 2] - u0, border[row, 3] - v0
    for _ in range(BORDER_STEPS):
        surface(face, u0 + share * du, v0 + share * dv, surfaces, work)
        tangent = work[0][1] * du + work[0][2] * dv
        length = dot(tangent, tangent)
        if length == 0.0:
            break
        new = min(max(share - dot(work[0][0] - q, tangent) / length, 0.0), 1.0)
        rests = abs(new - share) < AT_REST
        share = new
        if rests:
            break
    return u0 + share * du, v0 + share * dv


@compiled
def newton_step(q: Array, values: Array) -> tuple[float, float]:
    """Return the step in u and v towards the point of the surface nearest to q, at its values (6, 3)."""
    r = values[0] - q
    g, h = dot(r, values[1]), dot(r, values[2])
    e, f, i = dot(values[1], values[1]), dot(values[1], values[2]), dot(values[2], values[2])
    a, b, c = e + dot(r, values[3]), f + dot(r, values[4]), i + dot(r, values[5])
    if a <= 0.0 or a * c - b * b <= 1e-6 * e * i:
        a, b, c = e, f, i  # Gauss and Newton's, where the distance isn't convex
    determinant = a * c - b * b
    if determinant <= 1e-14 * a * c:  # a pole: along one parameter
        return (-g / a if a > 0.0 else 0.0), (-h / c if c > 0.0 else 0.0)
    return (b * h - c * g) / determinant, (b * g - a * h) / determinant


@compiled
def descend(
    face: int, q: Array, u: float, v: float, box: Array, surfaces: Surfaces, work: Scratch
) -> tuple[float, float]:
    """Follow Newton's steps, damped, from parameters to a nearest point within the box of a face.

    The values there are left in `work`.
    """
    values = work[0]
    surface(face, u, v, surfaces, work)
    for _ in range(STEPS):
        du, dv = newton_step(q, values)
        length_u, length_v = np.sqrt(dot(values[1], values[1])), np.sqrt(dot(values[2], values[2]))
        r = values[0] - q
        before, size, new_u, new_v = dot(r, r), 1.0, u, v
        for _ in range(HALVINGS):
            new_u = min(max(u + size * du, box[0]), box[1])
            new_v = min(max(v + size * dv, box[2]), box[3])
            surface(face, new_u, new_v, surfaces, work)
            r = values[0] - q
            if dot(r, r) <= before * (1.0 + 1e-14):
                break
            size *= 0.5
        moved = abs(new_u - u) * length_u + abs(new_v - v) * length_v
        u, v = new_u, new_v
        if moved < SETTLED:
            break
    return u, v


@compiled
def leave_pole(
    face: int, q: Array, u: float, v: float, box: Array, surfaces: Surfaces, work: Scratch
) -> tuple[float, float]:
    """Return parameters beside a pole in the direction of q; the given ones where there is no pole.

    At a pole one parameter changes nothing, so no step leads out of it.
    """
    values = work[0]
    wide, high = box[1] - box[0], box[3] - box[2]
    pole_in_u = dot(values[1], values[1]) * wide**2 < POLE**2
    if not pole_in_u and not dot(values[2], values[2]) * high**2 < POLE**2:
        return u, v
    best, best_u, best_v = np.inf, u, v
    for i in range(AROUND):
        share = (i + 0.5) / AROUND
        if pole_in_u:
            new_u, new_v = box[0] + share * wide, v + BESIDE * (0.5 * (box[2] + box[3]) - v)
        else:
            new_u, new_v = u + BESIDE * (0.5 * (box[0] + box[1]) - u), box[2] + share * high
        surface(face, new_u, new_v, surfaces, work)
        r = values[0] - q
        gap = dot(r, r)
        if gap < best:
            best, best_u, best_v = gap, new_u, new_v
    return best_u, best_v


@compiled
def project(
    face: int, q: Array, u: float, v: float, box: Array, border: Array, surfaces: Surfaces, work: Scratch
) -> tuple[float, float, bool]:
    """Find the point of a trimmed face that is nearest to q, from parameters near it.

    Parameters
    ----------
    q : (3,), mm
    box : (4,), u0, u1, v0, v1 of the face
    border : (s, 10), its border

    Returns
    -------
    u, v, and whether they lie on the border; the values there are in `work`
    """
    u, v = descend(face, q, u, v, box, surfaces, work)
    r = work[0][0] - q
    gap = dot(r, r)
    beside_u, beside_v = leave_pole(face, q, u, v, box, surfaces, work)
    if beside_u != u or beside_v != v:
        new_u, new_v = descend(face, q, beside_u, beside_v, box, surfaces, work)
        r = work[0][0] - q
        if dot(r, r) < gap:
            u, v = new_u, new_v
        else:
            surface(face, u, v, surfaces, work)
    trimmed = not inside(u, v, border) and len(border) > 0
    if trimmed:
        u, v = onto_border(face, q, border, surfaces, work)
        surface(face, u, v, surfaces, work)
    return u, v, trimmed


@compiled
def weights(q: Array, triangle: Array) -> Array:
    """Compute the barycentric coordinates, (3,), of the point of a triangle, (3, 3), nearest to q.

    References
    ----------
    Ericson (2005), Real-Time Collision Detection, section 5.1.5.
    """
    a, b, c = triangle[0], triangle[1], triangle[2]
    ab, ac, ap, bp, cp = b - a, c - a, q - a, q - b, q - c
    d1, d2, d3, d4, d5, d6 = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    s, t = 0.0, 0.0  # shares of b and c
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        s = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3) if d1 != d3 else 0.0
    elif d6 >= 0.0 and d5 <= d6:
        t = 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6) if d2 != d6 else 0.0
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        whole = (d4 - d3) + (d5 - d6)
        t = (d4 - d3) / whole if whole != 0.0 else 0.0
        s = 1.0 - t
    elif va + vb + vc != 0.0:
        s, t = vb / (va + vb + vc), vc / (va + vb + vc)
    return np.array([1.0 - s - t, s, t])


@compiled
def nearest_of_face(q: Array, face: int, mesh: Triangles, bound: float) -> float:
    """Compute the distance, mm, at most a bound, from q to the triangles of a face, or of all if it is −1."""
    leaves = len(mesh.boxes) // 2
    width = len(mesh.corners) // leaves
    best = bound * bound
    waiting = np.empty(STACK, np.int64)
    waiting[0], count = 1, 1
    while count > 0:
        count -= 1
        node = waiting[count]
        if box_gap(q, mesh.boxes[node]) >= best:
            continue
        if node < leaves:
            count = push_children(q, mesh.boxes, node, waiting, count)
            continue
        for k in range((node - leaves) * width, (node - leaves + 1) * width):
            if face < 0 or mesh.owner[k] == face:
                best = min(best, triangle_gap(q, mesh.corners[k]))
    return float(np.sqrt(best))


@compiled
def starts_near(q: Array, face: int, limit: float, mesh: Triangles, box: Array, starts: Array) -> int:
    """Collect where to search from: each face's nearest place within a limit, in each of its 4 × 4 bins.

    Both sides of a seam and all around a pole are begun from, so that none of them is missed.

    Parameters
    ----------
    limit : mm, from q to triangles
    box : (f, 4), u0, u1, v0, v1
    starts : (`STARTS`, 4), filled with key (face and bin), distance, u, v

    Returns
    -------
    How many there are
    """
    leaves = len(mesh.boxes) // 2
    width = len(mesh.corners) // leaves
    waiting = np.empty(STACK, np.int64)
    waiting[0], count, found = 1, 1, 0
    while count > 0:
        count -= 1
        node = waiting[count]
        if box_gap(q, mesh.boxes[node]) > limit * limit:
            continue
        if node < leaves:
            count = push_children(q, mesh.boxes, node, waiting, count)
            continue
        for k in range((node - leaves) * width, (node - leaves + 1) * width):
            f, triangle, uv = mesh.owner[k], mesh.corners[k], mesh.uv[k]
            if (face >= 0 and f != face) or triangle_gap(q, triangle) > limit * limit:
                continue
            w = weights(q, triangle)
            r = w[0] * triangle[0] + w[1] * triangle[1] + w[2] * triangle[2] - q
            distance = np.sqrt(dot(r, r))
            u = w[0] * uv[0, 0] + w[1] * uv[1, 0] + w[2] * uv[2, 0]
            v = w[0] * uv[0, 1] + w[1] * uv[1, 1] + w[2] * uv[2, 1]
            column = min(int(BINS * (u - box[f, 0]) / max(box[f, 1] - box[f, 0], 1e-300)), BINS - 1)
            row = min(int(BINS * (v - box[f, 2]) / max(box[f, 3] - box[f, 2], 1e-300)), BINS - 1)
            key = float((f * BINS + column) * BINS + row)
            i = 0
            while i < found and starts[i, 0] != key:
                i += 1
            if i == found and found < STARTS:
                starts[i, 1] = np.inf
                found += 1
            elif i == found:
                i = int(np.argmax(starts[:, 1]))  # no room: the farthest gives way
            if distance < starts[i, 1]:
                starts[i, 0], starts[i, 1], starts[i, 2], starts[i, 3] = key, distance, u, v
    return found


@compiled
def nearest_foot(
    q: Array,
    face: int,
    limit: float,
    mesh: Triangles,
    trims: Trims,
    surfaces: Surfaces,
    work: Scratch,
    starts: Array,
    foot: Array,
) -> tuple[float, int, bool]:
    """Find the exact surface's point nearest to q, (3,) mm, on faces with a triangle within a limit, mm.

    Parameters
    ----------
    face : the one that is asked, −1 for all
    starts : (`STARTS`, 4), room
    foot : (5,), filled with X, Y, Z, u, v

    Returns
    -------
    Distance, mm, infinite where no triangle is within the limit; face; whether the foot is on its border
    """
    count = starts_near(q, face, limit, mesh, trims.box, starts)
    best, found, on_border = np.inf, -1, False
    for i in range(count):
        f = int(starts[i, 0]) // (BINS * BINS)
        border = trims.border[trims.first[f] : trims.first[f + 1]]
        u, v, trimmed = project(f, q, starts[i, 2], starts[i, 3], trims.box[f], border, surfaces, work)
        r = work[0][0] - q
        gap = dot(r, r)
        if gap < best:
            best, found, on_border = gap, f, trimmed
            foot[:3] = work[0][0]
            foot[3], foot[4] = u, v
    return float(np.sqrt(best)), found, on_border


@compiled
def nearest_all(
    points: Array, faces: IntArray, slack: float, mesh: Triangles, trims: Trims, surfaces: Surfaces
) -> tuple[Array, IntArray, BoolArray]:
    """Find the exact surface's point nearest to each of the given ones.

    Every face with a triangle within the mesh's distance and a slack is searched, and the nearest foot wins.

    Parameters
    ----------
    points : (n, 3), mm
    faces : (n,), the face that is asked, −1 for all
    slack : mm, twice the mesh's deviation from the surfaces

    Returns
    -------
    feet : (n, 5), X, Y, Z, u, v
    found : (n,), face
    on_border : (n,), whether the foot lies on the face's border
    """
    n = len(points)
    feet, found, on_border = np.empty((n, 5)), np.empty(n, np.int64), np.empty(n, np.bool_)
    work, starts = scratch(), np.empty((STARTS, 4))
    for k in range(n):
        limit = nearest_of_face(points[k], faces[k], mesh, np.inf) + slack
        _, found[k], on_border[k] = nearest_foot(
            points[k], faces[k], limit, mesh, trims, surfaces, work, starts, feet[k]
        )
    return feet, found, on_border


@compiled
def onto_all(
    points: Array, faces: IntArray, uv: Array, trims: Trims, surfaces: Surfaces
) -> tuple[Array, IntArray, BoolArray]:
    """Move points, (n, 3) mm, onto their faces, (n,), from parameters near them, (n, 2); as `nearest_all`."""
    n = len(points)
    feet, on_border, work = np.empty((n, 5)), np.empty(n, np.bool_), scratch()
    for k in range(n):
        f = faces[k]
        border = trims.border[trims.first[f] : trims.first[f + 1]]
        feet[k, 3], feet[k, 4], on_border[k] = project(
            f, points[k], uv[k, 0], uv[k, 1], trims.box[f], border, surfaces, work
        )
        feet[k, :3] = work[0][0]
    return feet, faces, on_border


@compiled
def gap(
    q: Array,
    limit: float,
    bound: float,
    deviation: float,
    mesh: Triangles,
    trims: Trims,
    surfaces: Surfaces,
    work: Scratch,
    starts: Array,
    foot: Array,
) -> float:
    """Compute the distance from q, mm, at most a bound, so that it is on the right side of a limit.

    The mesh's distance is taken unless it is nearer to the limit than the mesh's deviation.
    """
    flat = nearest_of_face(q, -1, mesh, bound + deviation)
    if abs(flat - limit) > deviation:
        return flat
    return nearest_foot(q, -1, flat + 2.0 * deviation, mesh, trims, surfaces, work, starts, foot)[0]


@compiled
def gaps_all(
    points: Array, limit: float, deviation: float, mesh: Triangles, trims: Trims, surfaces: Surfaces
) -> Array:
    """Compute `gap` for each row of points, (n, 3) → (n,) mm, no farther than the limit needs."""
    gaps = np.empty(len(points))
    work, starts, foot = scratch(), np.empty((STARTS, 4)), np.empty(5)
    for i in range(len(points)):
        gaps[i] = gap(
            points[i], limit, limit + deviation, deviation, mesh, trims, surfaces, work, starts, foot
        )
    return gaps


@compiled
def reach(
    start: Array,
    end: Array,
    limit: float,
    finest: float,
    deviation: float,
    mesh: Triangles,
    trims: Trims,
    surfaces: Surfaces,
) -> float:
    """Compute how far a point can move with the surfaces `limit` away, as `fiveaxis.mesh.kernels.reach`."""
    work, starts, foot = scratch(), np.empty((STARTS, 4)), np.empty(5)
    length = np.sqrt(np.sum((end - start) ** 2))
    done, clear = 0.0, -1.0
    while True:
        share = 0.0 if length == 0.0 else done / length
        ahead = length - done
        q = start + share * (end - start)
        free = gap(q, limit, limit + max(ahead, finest), deviation, mesh, trims, surfaces, work, starts, foot)
        if free < limit:
            return clear
        clear = done
        if ahead <= 0.0:
            return clear
        done = min(length, done + max(free - deviation - limit, finest))
