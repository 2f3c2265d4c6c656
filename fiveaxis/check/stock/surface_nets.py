"""Compiled loops: surface nets on a stock's lattice, renewed where it was cut (`check.stock.display`).

All three bundles pass through the middles of cells. So whether a node of the lattice is in the material is
told by its Z ray, and where an edge of the lattice leaves it can be read off the ray along the edge, exactly.
Node 0 and the last one of each direction lie outside the grid, in the air.

Importing this module loads numba.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.check.stock.rays import Counts, Ends

# mm: by which a crossing may be beyond its edge.
ROUNDED = 1e-3
# Share of a cell by which a vertex moves before it counts as another one.
STILL = 0.005


@compiled
def widen(
    d: int, h: Array, n: IntArray, ends: Ends, count: Counts, other: Ends, other_count: Counts, box: Array
) -> None:
    """Widen a box, (2, 3) in cells, by the ends of rays along d that the same rays of another stock lack."""
    u, v = (d + 1) % 3, (d + 2) % 3
    for ray in range(len(count)):
        for k in range(2 * count[ray]):
            known = k < 2 * other_count[ray] and ends[ray, k] == other[ray, k]
            for m in range(0 if known else 2 * other_count[ray]):
                known = known or ends[ray, k] == other[ray, m]
            if known:
                continue
            place = ends[ray, k] / h[d]
            box[0, d], box[1, d] = min(box[0, d], place), max(box[1, d], place)
            box[0, u], box[1, u] = min(box[0, u], ray // n[v]), max(box[1, u], ray // n[v] + 1)
            box[0, v], box[1, v] = min(box[0, v], ray % n[v]), max(box[1, v], ray % n[v] + 1)


@compiled
def find_signs(
    h: Array, n: IntArray, ends: Ends, count: Counts, w: IntArray, sign: NDArray[np.bool_]
) -> None:
    """Tell which nodes of a window, (2, 3), are in the material, by the Z rays."""
    for a in range(max(w[0, 0], 1), min(w[1, 0], n[0] + 1)):
        for b in range(max(w[0, 1], 1), min(w[1, 1], n[1] + 1)):
            ray = (a - 1) * n[1] + b - 1
            for c in range(max(w[0, 2], 1), min(w[1, 2], n[2] + 1)):
                z, inside = (c - 0.5) * h[2], False
                for m in range(count[ray]):
                    inside |= ends[ray, 2 * m] < z < ends[ray, 2 * m + 1]
                sign[a, b, c] = inside


@compiled
def find_crossings(
    d: int,
    h: Array,
    n: IntArray,
    ends: Ends,
    count: Counts,
    w: IntArray,
    sign: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> int:
    """Find where edges along d, from a window's nodes on, cross the surface, mm; NaN for none. Count them."""
    u, v = (d + 1) % 3, (d + 2) % 3
    at, many = np.zeros(3, np.int64), 0
    beyond = np.zeros(3, np.int64)
    for a in range(w[0, 0], w[1, 0]):
        for b in range(w[0, 1], w[1, 1]):
            for c in range(w[0, 2], w[1, 2]):
                at[0], at[1], at[2] = a, b, c
                beyond[:] = at
                beyond[d] += 1
                out[a, b, c] = np.nan
                if beyond[d] >= sign.shape[d]:
                    continue
                here = sign[a, b, c]
                if here == sign[beyond[0], beyond[1], beyond[2]]:
                    continue
                many += 1
                low = (at[d] - 0.5) * h[d]
                high = low + h[d]
                out[a, b, c] = (low + high) / 2.0
                ray = (at[u] - 1) * n[v] + at[v] - 1
                for m in range(count[ray]):
                    s = ends[ray, 2 * m + 1] if here else ends[ray, 2 * m]
                    if low - ROUNDED <= s <= high + ROUNDED:
                        out[a, b, c] = s
                        break
    return many


@compiled
def find_vertices(
    h: Array,
    w: IntArray,
    sign: NDArray[np.bool_],
    cross: NDArray[np.float32],
    vertex: IntArray,
    points: NDArray[np.float32],
    many: int,
) -> int:
    """Put a vertex into each cube of a window that has crossings, at their mean; return how many there are.

    A vertex that stays where it was keeps its number, any other gets the next one; -1 is none.
    """
    mean = np.zeros(3)
    for a in range(w[0, 0], min(w[1, 0], vertex.shape[0])):
        for b in range(w[0, 1], min(w[1, 1], vertex.shape[1])):
            for c in range(w[0, 2], min(w[1, 2], vertex.shape[2])):
                found, inside = 0, 0
                for corner in range(8):
                    inside += sign[a + (corner >> 2), b + (corner >> 1 & 1), c + (corner & 1)]
                if inside in (0, 8):
                    vertex[a, b, c] = -1
                    continue
                mean[:] = 0.0
                for d in range(3):
                    for i in range(2):
                        for j in range(2):
                            e0 = a + (0, j, i)[d]
                            e1 = b + (i, 0, j)[d]
                            e2 = c + (j, i, 0)[d]
                            s = cross[d, e0, e1, e2]
                            if np.isnan(s):
                                continue
                            found += 1
                            mean[0] += s if d == 0 else (e0 - 0.5) * h[0]
                            mean[1] += s if d == 1 else (e1 - 0.5) * h[1]
                            mean[2] += s if d == 2 else (e2 - 0.5) * h[2]
                last, moved = vertex[a, b, c], vertex[a, b, c] < 0
                for k in range(3):
                    mean[k] /= found
                    moved = moved or abs(points[last, k] - mean[k]) > STILL * h[k]
                if moved:
                    vertex[a, b, c] = many
                    points[many, :] = mean
                    many += 1
    return many


@compiled
def find_quads(
    d: int,
    w: IntArray,
    sign: NDArray[np.bool_],
    cross: NDArray[np.float32],
    vertex: IntArray,
    quad: IntArray,
    quads: NDArray[np.int32],
    lives: NDArray[np.int32],
    step: int,
    many: int,
) -> int:
    """Put a quad about each edge along d that crosses the surface, in a window; return how many there are.

    One whose vertices stay is kept; any other ends its life at this step, and a new one begins.
    """
    u, v = (d + 1) % 3, (d + 2) % 3
    around, cube = np.zeros(4, np.int64), np.zeros(3, np.int64)
    for a in range(w[0, 0], w[1, 0]):
        for b in range(w[0, 1], w[1, 1]):
            for c in range(w[0, 2], w[1, 2]):
                last, is_there = quad[a, b, c], not np.isnan(cross[a, b, c])
                same = is_there and last >= 0
                if is_there:
                    for k in range(4):
                        cube[0], cube[1], cube[2] = a, b, c
                        cube[u] -= k in (0, 3)
                        cube[v] -= k in (0, 1)
                        # Seen from outside anticlockwise, whether the edge leaves or enters the material.
                        place = k if sign[a, b, c] else 3 - k
                        around[place] = vertex[cube[0], cube[1], cube[2]]
                    for k in range(4):
                        same = same and quads[last, k] == around[k]
                if same:
                    continue
                if last >= 0:
                    lives[last, 1] = step
                quad[a, b, c] = -1
                if is_there:
                    quads[many, :] = around
                    lives[many, 0] = step
                    quad[a, b, c] = many
                    many += 1
    return many
