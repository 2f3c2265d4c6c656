"""Compiled loops: the depth of a convex body of revolution in the exact surfaces behind a mesh.

Triangles are divided in the parameters of their faces, with exact corners, where they may be deepest. A
division leaves about a quarter of the distance between triangle and surface. Depth changes no faster than a
point moves, so the depth in a triangle, more or less that distance, bounds the one in the surface.

On a border the mesh's chords in the parameters stand for the border itself.

Importing this module loads numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import Array, compiled
from fiveaxis.cam import PLANE, STACK, Scratch, dot, scratch, surface
from fiveaxis.check.verification.gouge_kernel import (
    Body,
    box_bound,
    deepest_in_triangle,
    frame_of,
    put_in_frame,
)

if TYPE_CHECKING:
    from fiveaxis.cam import Surfaces, Triangles

# mm: accuracy of a depth. Divisions of one triangle, each of which leaves at most three quarters for later.
EXACT, DIVISIONS = 1e-4, 12
WAITING = 3 * DIVISIONS + 3
# Length of a derivative, as a share of the other one, below which there is a pole.
POLE = 1e-6
# Between triangle and surface there may be half of the most that was found at the middles of the sides before
# the division (a third, if the surface bends evenly), and at least this share of what there might be then.
OF_SIDES, OF_BEFORE = 0.5, 0.125


@compiled
def place(
    face: int, uv: Array, tip: Array, frame: Array, surfaces: Surfaces, work: Scratch, out: Array
) -> None:
    """Write the place of a face's parameters in the tool's frame, mm, to `out`, (3,)."""
    surface(face, uv[0], uv[1], surfaces, work)
    away = work[0][0] - tip
    for j in range(3):
        out[j] = frame[j, 0] * away[0] + frame[j, 1] * away[1] + frame[j, 2] * away[2]


@compiled
def deepest_in_face(
    face: int,
    start: Array,
    tip: Array,
    frame: Array,
    body: Body,
    off: float,
    best: float,
    surfaces: Surfaces,
    work: Scratch,
) -> float:
    """Largest depth in the piece of a surface between three of its parameters, or `best` if none is larger.

    The parameters to start from are (3, 2); the triangle is off its surface by `off` at most, mm.
    """
    uv, corners, offs = np.empty((WAITING, 3, 2)), np.empty((WAITING, 3, 3)), np.empty(WAITING)
    middle_uv, middle = np.empty((3, 2)), np.empty((3, 3))
    uv[0], offs[0], count, pole, still = start, off, 1, -1, 0
    for i in range(3):
        place(face, start[i], tip, frame, surfaces, work, corners[0, i])
        for d in range(2):
            if dot(work[0][1 + d], work[0][1 + d]) <= POLE**2 * dot(work[0][2 - d], work[0][2 - d]):
                pole, still = i, d
    if pole >= 0:
        # In the parameters there are two triangles where the mesh has one: at the pole, a parameter changes
        # nothing. Their surfaces are at most as far away as the opposite side is long.
        j, k = (pole + 1) % 3, (pole + 2) % 3
        uv[1] = start
        uv[1, pole, still], uv[0, pole, still] = start[j, still], start[k, still]
        uv[1, k], corners[1], count = uv[0, pole], corners[0], 2
        corners[1, k] = corners[0, pole]
        away = corners[0, k] - corners[0, j]
        offs[:2] = max(off, np.sqrt(np.sum(away * away)))
    while count > 0:
        count -= 1
        off = offs[count]
        depth = deepest_in_triangle(corners[count], body, best - off)
        best = max(best, depth - off)
        if depth + off <= best + EXACT or count + 4 > WAITING:
            continue
        sides = 0.0
        for i in range(3):
            k = (i + 1) % 3
            middle_uv[i] = 0.5 * (uv[count, i] + uv[count, k])
            place(face, middle_uv[i], tip, frame, surfaces, work, middle[i])
            away = middle[i] - 0.5 * (corners[count, i] + corners[count, k])
            sides = max(sides, np.sqrt(np.sum(away * away)))
        left = max(OF_SIDES * sides, OF_BEFORE * off)
        for i in range(3):  # the corner triangles; the middle one takes the place of the divided one
            uv[count + i + 1, 0], corners[count + i + 1, 0] = uv[count, i], corners[count, i]
            for k, side in ((1, i), (2, (i + 2) % 3)):
                uv[count + i + 1, k], corners[count + i + 1, k] = middle_uv[side], middle[side]
        uv[count], corners[count] = middle_uv, middle
        offs[count : count + 4] = left
        count += 4
    return best


@compiled
def deepest_all(
    tips: Array, axes: Array, body: Body, mesh: Triangles, surfaces: Surfaces, deviation: float, floors: Array
) -> Array:
    """Depth of one body in surfaces at each of (n, 3) tips and axes, at least the floor, (n,) → (n,) mm.

    The mesh leaves the surfaces by the deviation, mm, at most.
    """
    leaves = len(mesh.boxes) // 2
    width = len(mesh.corners) // leaves
    depths, work, local = floors.copy(), scratch(), np.empty((3, 3))
    waiting = np.empty(STACK, np.int64)
    for n in range(len(tips)):
        tip, best, frame = tips[n], floors[n], frame_of(axes[n])
        waiting[0], count = 1, 1
        while count > 0:
            count -= 1
            node = waiting[count]
            if box_bound(tip, axes[n], mesh.boxes[node], body) + deviation <= best:
                continue
            if node < leaves:
                one = box_bound(tip, axes[n], mesh.boxes[2 * node], body)
                two = box_bound(tip, axes[n], mesh.boxes[2 * node + 1], body)
                waiting[count + 1] = 2 * node if one > two else 2 * node + 1
                waiting[count] = 4 * node + 1 - waiting[count + 1]
                count += 2
                continue
            for k in range((node - leaves) * width, (node - leaves + 1) * width):
                put_in_frame(mesh.corners[k], tip, frame, local)
                if deepest_in_triangle(local, body, best - deviation) + deviation <= best:
                    continue
                face = mesh.owner[k]
                off = 0.0 if surfaces.kind[face] == PLANE else deviation
                best = deepest_in_face(face, mesh.uv[k], tip, frame, body, off, best, surfaces, work)
        depths[n] = best
    return depths
