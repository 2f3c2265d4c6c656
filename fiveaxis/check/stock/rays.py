"""Compiled loops on the rays of a bundle: intervals of material, tiles, and where rays meet triangles.

The rays along axis d form a grid over the axes u = d + 1, v = d + 2 (modulo 3) through the middles of its
cells; ray ``i·n[v] + j`` holds up to K intervals as 2K sorted ends, in mm from the grid's low corner. Tiles
of `TILE` × `TILE` rays keep the range of their material: a cutter that misses the range misses all of them.

Importing this module loads numba.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import Array, IntArray, compiled

Ends = NDArray[np.float32]
Names = NDArray[np.int32]
Counts = NDArray[np.uint8]


class Rays(NamedTuple):
    """A bundle as the loops take it.

    Parameters
    ----------
    axis : along which its rays run
    pitch, cells : (3,), mm, and cells of the grid
    ends, cut_by, counts, tiles : as of `fiveaxis.check.stock.dexels.Bundle`
    """

    axis: int
    pitch: Array
    cells: IntArray
    ends: Ends
    cut_by: Names
    counts: Counts
    tiles: Ends


# Rays along the side of a tile.
TILE = 8
# mm: thinner material is dropped, and a shallower cut is none.
TINY = 1e-4
# Half of a tile's diagonal in sides of a tile, rounded up.
HALF_DIAGONAL = 0.7072


@compiled
def cut(
    ends: Ends, cut_by: Names, count: Counts, ray: int, low: float, high: float, name: int
) -> tuple[float, int]:
    """Remove what lies between two places of a ray; return how much, mm, and which ends were made.

    It is −1 if the ray would need more intervals than it can hold, and then nothing is changed. Ends made are
    1 if `low` is one now, 2 if `high` is, 3 both.
    """
    many, k, removed, made = int(count[ray]), 0, 0.0, 0
    while k < many:
        begin, end = ends[ray, 2 * k], ends[ray, 2 * k + 1]
        if end <= low + TINY:
            k += 1
            continue
        if begin >= high - TINY:
            break
        left, right = low - begin > TINY, end - high > TINY
        if left and right:
            if 2 * many >= ends.shape[1]:
                return -1.0, 0
            for j in range(2 * many - 1, 2 * k, -1):
                ends[ray, j + 2], cut_by[ray, j + 2] = ends[ray, j], cut_by[ray, j]
            ends[ray, 2 * k + 1], ends[ray, 2 * k + 2] = low, high
            cut_by[ray, 2 * k + 1] = cut_by[ray, 2 * k + 2] = name
            count[ray] = many + 1
            return high - low, 3
        if left:
            ends[ray, 2 * k + 1], cut_by[ray, 2 * k + 1] = low, name
            removed += end - low
            made |= 1
            k += 1
        elif right:
            ends[ray, 2 * k], cut_by[ray, 2 * k] = high, name
            removed += high - begin
            made |= 2
            k += 1
        else:
            removed += end - begin
            for j in range(2 * k, 2 * many - 2):
                ends[ray, j], cut_by[ray, j] = ends[ray, j + 2], cut_by[ray, j + 2]
            many -= 1
    count[ray] = many
    return removed, made


@compiled
def overlap(ends: Ends, count: Counts, ray: int, low: float, high: float) -> float:
    """Length of the material between two places of a ray, mm."""
    total = 0.0
    for k in range(count[ray]):
        total += max(0.0, min(float(ends[ray, 2 * k + 1]), high) - max(float(ends[ray, 2 * k]), low))
    return total


@compiled
def fit_tile(tiles: Ends, a: int, b: int, ends: Ends, count: Counts, nu: int, nv: int) -> None:
    """Fit the range of the material on a tile's rays; from ∞ to −∞ if there is none."""
    low, high = np.inf, -np.inf
    for i in range(a * TILE, min(nu, a * TILE + TILE)):
        for j in range(b * TILE, min(nv, b * TILE + TILE)):
            ray = i * nv + j
            if count[ray] > 0:
                low, high = min(low, ends[ray, 0]), max(high, ends[ray, 2 * count[ray] - 1])
    tiles[a, b, 0], tiles[a, b, 1] = low, high


@compiled
def fit_tiles(tiles: Ends, ends: Ends, count: Counts, nu: int, nv: int) -> None:
    """Fit all tiles, (a, b, 2) mm."""
    for a in range(tiles.shape[0]):
        for b in range(tiles.shape[1]):
            fit_tile(tiles, a, b, ends, count, nu, nv)


@compiled
def covered(ends: Ends, count: Counts, rays: IntArray, places: Array) -> NDArray[np.bool_]:
    """Whether places on rays, (n,) mm, are within material; (n,)."""
    out = np.zeros(len(rays), np.bool_)
    for i in range(len(rays)):
        for k in range(count[rays[i]]):
            out[i] |= ends[rays[i], 2 * k] < places[i] < ends[rays[i], 2 * k + 1]
    return out


@compiled
def side_of_edge(p: Array, q: Array, u: int, v: int, x: float, y: float) -> float:
    """Side of a point beside an edge, exactly opposite for the two triangles that share it, and never 0."""
    swap = q[u] < p[u] or (q[u] == p[u] and q[v] < p[v])
    a, b = (q, p) if swap else (p, q)
    side = (b[u] - a[u]) * (y - a[v]) - (b[v] - a[v]) * (x - a[u])
    side = side if side != 0.0 else 1e-300
    return float(-side if swap else side)


@compiled
def scan_triangles(d: int, h: Array, n: IntArray, triangles: Array, hits: Ends, many: IntArray) -> None:
    """Find where the rays of a bundle cross triangles, (t, 3, 3) mm from the grid's low corner.

    Hits, (rays, m) mm, are filled unsorted as far as they go; `many`, (rays,), counts all crossings.
    """
    u, v = (d + 1) % 3, (d + 2) % 3
    for g in range(len(triangles)):
        a, b, c = triangles[g, 0], triangles[g, 1], triangles[g, 2]
        whole = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u])
        if whole == 0.0:
            continue
        i0 = max(0, int(np.ceil(min(a[u], b[u], c[u]) / h[u] - 0.5)))
        i1 = min(n[u] - 1, int(np.floor(max(a[u], b[u], c[u]) / h[u] - 0.5)))
        j0 = max(0, int(np.ceil(min(a[v], b[v], c[v]) / h[v] - 0.5)))
        j1 = min(n[v] - 1, int(np.floor(max(a[v], b[v], c[v]) / h[v] - 0.5)))
        for i in range(i0, i1 + 1):
            x = (i + 0.5) * h[u]
            for j in range(j0, j1 + 1):
                y = (j + 0.5) * h[v]
                s0 = side_of_edge(b, c, u, v, x, y)
                s1 = side_of_edge(c, a, u, v, x, y)
                s2 = side_of_edge(a, b, u, v, x, y)
                up = whole > 0.0
                if (s0 > 0.0) == up and (s1 > 0.0) == up and (s2 > 0.0) == up:
                    ray = i * n[v] + j
                    if many[ray] < hits.shape[1]:
                        place = (s0 * a[d] + s1 * b[d] + s2 * c[d]) / (s0 + s1 + s2)
                        hits[ray, many[ray]] = place
                    many[ray] += 1


@compiled
def remove_held(ends: Ends, cut_by: Names, count: Counts, held: Ends, held_count: Counts, name: int) -> bool:
    """Remove another stock's material from the same rays; whether a ray would need more intervals."""
    for ray in range(len(count)):
        for k in range(held_count[ray]):
            if cut(ends, cut_by, count, ray, held[ray, 2 * k], held[ray, 2 * k + 1], name)[0] < 0.0:
                return True
    return False
