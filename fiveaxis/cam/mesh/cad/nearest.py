"""Compiled loops over trimmed faces: nearest points, and whether a ball keeps out of them.

Importing this module loads numba, so `model` does it only when a surface is asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled
from fiveaxis.cam.mesh.cad.kernels import Scratch, dot, scratch, surface
from fiveaxis.cam.mesh.kernels import STACK, box_gap, foot_on_triangle, push_children, triangle_gap

if TYPE_CHECKING:
    from fiveaxis.cam.mesh.cad.records import Shell, Surfaces, Triangles, Trims

# Most places of the mesh from which the nearest point of the surfaces is searched, and their bins in u and v.
STARTS, BINS = 24, 4
# Steps of Newton's method, halvings of one, steps along a border; mm and shares at which they end.
STEPS, HALVINGS, BORDER_STEPS = 30, 12, 8
SETTLED, AT_REST = 1e-10, 1e-12
# mm: where the whole range of a parameter is no longer, there is a pole; directions tried around it, and how
# far beside it, as a share of the way to the middle.
POLE, AROUND, BESIDE = 1e-6, 16, 1e-3

# Of a search: room for one evaluation, (`STARTS`, 4) where it starts, (5,) the foot.
Room: TypeAlias = tuple[Scratch, Array, Array]


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

    The border, (s, 10), has u0, v0, u1, v1, and both ends of each segment in mm.
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
    face: int, q: Array, u: float, v: float, trims: Trims, surfaces: Surfaces, work: Scratch
) -> tuple[float, float, bool]:
    """Find the point of a trimmed face that is nearest to q, (3,) mm, from parameters near it.

    Returns
    -------
    u, v, and whether they lie on the border; the values there are in `work`
    """
    box, border = trims.box[face], trims.border[trims.first[face] : trims.first[face + 1]]
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
def parameters_at(p: Array, triangle: Array, uv: Array) -> tuple[float, float]:
    """Interpolate the parameters of a triangle's corners, (3, 2), at a point of it, (3,) mm."""
    along, beside, r = triangle[1] - triangle[0], triangle[2] - triangle[0], p - triangle[0]
    aa, ab, bb = dot(along, along), dot(along, beside), dot(beside, beside)
    area = aa * bb - ab * ab
    if area <= 0.0:
        return uv[0, 0], uv[0, 1]
    s = (bb * dot(r, along) - ab * dot(r, beside)) / area
    t = (aa * dot(r, beside) - ab * dot(r, along)) / area
    u = uv[0, 0] + s * (uv[1, 0] - uv[0, 0]) + t * (uv[2, 0] - uv[0, 0])
    return u, uv[0, 1] + s * (uv[1, 1] - uv[0, 1]) + t * (uv[2, 1] - uv[0, 1])


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

    Both sides of a seam and all around a pole are begun from, so that none of them is missed. `limit` is in
    mm from q to triangles, `box` (f, 4), u0, u1, v0, v1; `starts`, (`STARTS`, 4), is filled with key (face
    and bin), distance, u, v. How many there are is returned.
    """
    leaves = len(mesh.boxes) // 2
    width = len(mesh.corners) // leaves
    waiting, foot = np.empty(STACK, np.int64), np.empty(3)
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
            f, triangle = mesh.owner[k], mesh.corners[k]
            if (face >= 0 and f != face) or triangle_gap(q, triangle) > limit * limit:
                continue
            distance = np.sqrt(foot_on_triangle(q, triangle, foot))
            u, v = parameters_at(foot, triangle, mesh.uv[k])
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
def make_room() -> Room:
    """Make room for one search."""
    return scratch(), np.empty((STARTS, 4)), np.empty(5)


@compiled
def nearest_foot(q: Array, face: int, limit: float, shell: Shell, room: Room) -> tuple[float, int, bool]:
    """Find the exact surface's point nearest to q, (3,) mm, on faces with a triangle within a limit, mm.

    Parameters
    ----------
    face : the one that is asked, −1 for all
    room : its last array is filled with X, Y, Z, u, v of the point

    Returns
    -------
    Distance, mm, infinite where no triangle is within the limit; face; whether the foot is on its border
    """
    mesh, trims, surfaces = shell
    work, starts, foot = room
    count = starts_near(q, face, limit, mesh, trims.box, starts)
    best, found, on_border = np.inf, -1, False
    for i in range(count):
        f = int(starts[i, 0]) // (BINS * BINS)
        u, v, trimmed = project(f, q, starts[i, 2], starts[i, 3], trims, surfaces, work)
        r = work[0][0] - q
        gap = dot(r, r)
        if gap < best:
            best, found, on_border = gap, f, trimmed
            foot[:3] = work[0][0]
            foot[3], foot[4] = u, v
    return float(np.sqrt(best)), found, on_border


@compiled
def nearest_all(
    points: Array, faces: IntArray, slack: float, shell: Shell
) -> tuple[Array, IntArray, BoolArray]:
    """Find the exact surface's point nearest to each of the given ones, (n, 3) mm, on (n,) faces, −1 for all.

    Every face with a triangle within the mesh's distance and a slack is searched, and the nearest foot wins.
    The slack is twice the mesh's deviation from the surfaces, mm.

    Returns
    -------
    (n, 5) X, Y, Z, u, v of the feet; (n,) their faces; (n,) whether they lie on the face's border
    """
    n, room = len(points), make_room()
    feet, found, on_border = np.empty((n, 5)), np.empty(n, np.int64), np.empty(n, np.bool_)
    for k in range(n):
        limit = nearest_of_face(points[k], faces[k], shell.mesh, np.inf) + slack
        _, found[k], on_border[k] = nearest_foot(points[k], faces[k], limit, shell, room)
        feet[k] = room[2]
    return feet, found, on_border


@compiled
def onto_all(points: Array, faces: IntArray, uv: Array, shell: Shell) -> tuple[Array, IntArray, BoolArray]:
    """Move points, (n, 3) mm, onto their faces, (n,), from parameters near them, (n, 2); as `nearest_all`."""
    _, trims, surfaces = shell
    n, work = len(points), scratch()
    feet, on_border = np.empty((n, 5)), np.empty(n, np.bool_)
    for k in range(n):
        feet[k, 3], feet[k, 4], on_border[k] = project(
            faces[k], points[k], uv[k, 0], uv[k, 1], trims, surfaces, work
        )
        feet[k, :3] = work[0][0]
    return feet, faces, on_border


@compiled
def gap(q: Array, limit: float, bound: float, deviation: float, shell: Shell, room: Room) -> float:
    """Compute the distance from q, mm, at most a bound, so that it is on the right side of a limit.

    The mesh's distance is taken unless it is nearer to the limit than the mesh's deviation.
    """
    flat = nearest_of_face(q, -1, shell.mesh, bound + deviation)
    if abs(flat - limit) > deviation:
        return flat
    return nearest_foot(q, -1, flat + 2.0 * deviation, shell, room)[0]


@compiled
def gaps_all(points: Array, limit: float, deviation: float, shell: Shell) -> Array:
    """Compute `gap` for each row of points, (n, 3) → (n,) mm, no farther than the limit needs."""
    gaps, room = np.empty(len(points)), make_room()
    for i in range(len(points)):
        gaps[i] = gap(points[i], limit, limit + deviation, deviation, shell, room)
    return gaps


@compiled
def reach(start: Array, end: Array, limit: float, finest: float, deviation: float, shell: Shell) -> float:
    """Compute how far a point can move with the surfaces `limit` away, as `cam.mesh.kernels.reach`."""
    room = make_room()
    length = np.sqrt(np.sum((end - start) ** 2))
    done, clear = 0.0, -1.0
    while True:
        share = 0.0 if length == 0.0 else done / length
        ahead = length - done
        q = start + share * (end - start)
        free = gap(q, limit, limit + max(ahead, finest), deviation, shell, room)
        if free < limit:
            return clear
        clear = done
        if ahead <= 0.0:
            return clear
        done = min(length, done + max(free - deviation - limit, finest))
