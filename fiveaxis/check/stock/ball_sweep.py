"""Compiled loops: the swept ball with the cylinder above it, in closed form.

The sweep is all points within R of the surface that the cutter's axis describes between the ball's centre and
the upper end. That surface is given as triangles, and each segment's figure is a line (a ball alone), two
triangles, a fan of four about the saddle's middle (a turning axis describes a saddle: a fan leaves it by a
sixteenth of its twist, two triangles by a quarter), or one triangle. On a ray the sweep is the hull of what
its spheres, cylinders and slabs cover.

Importing this module loads numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import Array, compiled
from fiveaxis.check.stock.rays import HALF_DIAGONAL, TILE, Rays, cut, fit_tile, overlap

if TYPE_CHECKING:
    from fiveaxis.check.stock.sweeping import BallSweep

# Figures of segments, by what their nodes are: centre at the start, at the end, upper end at the end, at the
# start, and the saddle's middle.
LINE, QUAD, FAN, TRIANGLE = 0, 1, 2, 3
NODES = np.array([2, 4, 5, 3])
# Number of edges and faces of each figure, and their nodes.
EDGES_OF, FACES_OF = np.array([1, 5, 8, 3]), np.array([0, 2, 4, 1])
EDGES = np.zeros((4, 8, 2), np.int64)
EDGES[LINE, :1] = [[0, 1]]
EDGES[QUAD, :5] = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]]
EDGES[FAN] = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]]
EDGES[TRIANGLE, :3] = [[0, 1], [1, 2], [2, 0]]
FACES = np.zeros((4, 4, 3), np.int64)
FACES[QUAD, :2] = [[0, 1, 2], [0, 2, 3]]
FACES[FAN] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
FACES[TRIANGLE, :1] = [[0, 1, 2]]
# Parts of the pose at a segment's end: the sphere about node 1, and the cylinder about edge 1.
END_SPHERE, END_CYLINDER = 1, 11
# mm: shorter edges are points; share below which a face is edge-on to the rays.
SHORT, EDGE_ON = 1e-9, 1e-6


@compiled
def frame_figure(d: int, kind: int, p: Array, way: Array, size: Array, face: Array) -> None:
    """Prepare edges and faces for rays along d.

    Parameters
    ----------
    p : (5, 3), mm, nodes
    way, size : (8, 3) and (8,), direction and length of the edges
    face : (4, 9); normal (u, v, d), barycentric slopes in u and v of two corners, their rises along d
    """
    u, v = (d + 1) % 3, (d + 2) % 3
    for e in range(EDGES_OF[kind]):
        way[e] = p[EDGES[kind, e, 1]] - p[EDGES[kind, e, 0]]
        size[e] = np.sqrt(np.sum(way[e] ** 2))
        if size[e] > SHORT:
            way[e] /= size[e]
    for f in range(FACES_OF[kind]):
        a, b, c = p[FACES[kind, f, 0]], p[FACES[kind, f, 1]], p[FACES[kind, f, 2]]
        nd = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u])
        mu = (b[v] - a[v]) * (c[d] - a[d]) - (b[d] - a[d]) * (c[v] - a[v])
        mv = (b[d] - a[d]) * (c[u] - a[u]) - (b[u] - a[u]) * (c[d] - a[d])
        area = np.sqrt(nd * nd + mu * mu + mv * mv)
        face[f, 2] = nd / area if area > SHORT else 0.0
        if abs(face[f, 2]) < EDGE_ON:
            face[f, 2] = 0.0
            continue
        face[f, 0], face[f, 1] = mu / area, mv / area
        face[f, 3], face[f, 4] = (c[v] - a[v]) / nd, -(b[v] - a[v]) / nd
        face[f, 5], face[f, 6] = -(c[u] - a[u]) / nd, (b[u] - a[u]) / nd
        face[f, 7], face[f, 8] = b[d] - a[d], c[d] - a[d]


@compiled
def ball_on_ray(
    d: int, kind: int, p: Array, way: Array, size: Array, face: Array, radius: float, x: float, y: float
) -> tuple[float, float, float, float, int, int]:
    """Where a ray is within a radius of a figure.

    Returns
    -------
    low, high : mm; ∞ and −∞ if it isn't
    slope_low, slope_high : R·|n_d| there, mm, of the surface's normal n
    part_low, part_high : what it meets there: a sphere's node, 10 + an edge, or 20 + a face
    """
    u, v = (d + 1) % 3, (d + 2) % 3
    low, high, slope_low, slope_high, part_low, part_high = np.inf, -np.inf, 0.0, 0.0, 0, 0
    for k in range(NODES[kind]):
        du, dv = x - p[k, u], y - p[k, v]
        rest = radius * radius - du * du - dv * dv
        if rest > 0.0:
            w = np.sqrt(rest)
            if p[k, d] - w < low:
                low, slope_low, part_low = p[k, d] - w, w, k
            if p[k, d] + w > high:
                high, slope_high, part_high = p[k, d] + w, w, k
    for e in range(EDGES_OF[kind]):
        if size[e] <= SHORT:
            continue
        a = EDGES[kind, e, 0]
        du, dv, wd = x - p[a, u], y - p[a, v], way[e, d]
        along = du * way[e, u] + dv * way[e, v]
        square = 1.0 - wd * wd
        if square < SHORT:
            continue
        half = -wd * along
        rest = half * half - square * (du * du + dv * dv - along * along - radius * radius)
        if rest <= 0.0:
            continue
        w = np.sqrt(rest)
        s = (-half - w) / square
        if p[a, d] + s < low and 0.0 <= along + s * wd <= size[e]:
            low, slope_low, part_low = p[a, d] + s, w, 10 + e
        s = (-half + w) / square
        if p[a, d] + s > high and 0.0 <= along + s * wd <= size[e]:
            high, slope_high, part_high = p[a, d] + s, w, 10 + e
    for f in range(FACES_OF[kind]):
        if face[f, 2] == 0.0:
            continue
        a = FACES[kind, f, 0]
        for sign in (-1.0, 1.0):
            # The foot on the triangle's plane of a point that is the radius away from it.
            du = x - sign * radius * face[f, 0] - p[a, u]
            dv = y - sign * radius * face[f, 1] - p[a, v]
            b = face[f, 3] * du + face[f, 5] * dv
            c = face[f, 4] * du + face[f, 6] * dv
            if b >= 0.0 and c >= 0.0 and b + c <= 1.0:
                s = p[a, d] + b * face[f, 7] + c * face[f, 8] + sign * radius * face[f, 2]
                if s < low:
                    low, slope_low, part_low = s, radius * abs(face[f, 2]), 20 + f
                if s > high:
                    high, slope_high, part_high = s, radius * abs(face[f, 2]), 20 + f
    return low, high, slope_low, slope_high, part_low, part_high


@compiled
def sweep_balls(
    rays: Rays,
    sweep: BallSweep,
    tile_rows: tuple[int, int],
    begin: int,
    first: int,
    figures: Array,
    keep: bool,
) -> int:
    """Remove swept balls from the rays of some rows of tiles.

    Parameters
    ----------
    sweep : with nodes in mm from the grid's low corner
    tile_rows : first row of tiles, and the one behind the last
    begin : segment to begin with
    first : what is added to a segment's block for its name on the ends that it makes
    keep : whether nothing is removed, and the figures are what would be
    figures : (blocks, 2), mm³ that each block removes and mm² of contact at its end, added to

    Returns
    -------
    Number of segments done; less than all if a ray would need more intervals

    Notes
    -----
    `sweep_bodies` goes through tiles and rays in the same way. One loop for both, with a branch at each ray,
    takes a fifth longer for balls.
    """
    d, h, n, ends, cut_by, count, tiles = rays
    kinds, nodes, radius, block = sweep
    u, v = (d + 1) % 3, (d + 2) % 3
    nu, nv, area = n[u], n[v], h[u] * h[v]
    wider = radius + TILE * HALF_DIAGONAL * max(h[u], h[v])
    way, size, face = np.empty((8, 3)), np.empty(8), np.empty((4, 9))
    top = n[d] * h[d]
    for g in range(begin, len(block)):
        p, kind = nodes[g], kinds[g]
        d_low = d_high = p[0, d]
        u_low = u_high = p[0, u]
        v_low = v_high = p[0, v]
        for k in range(1, NODES[kind]):
            d_low, d_high = min(d_low, p[k, d]), max(d_high, p[k, d])
            u_low, u_high = min(u_low, p[k, u]), max(u_high, p[k, u])
            v_low, v_high = min(v_low, p[k, v]), max(v_high, p[k, v])
        d_low, d_high = d_low - radius, d_high + radius
        i0 = max(tile_rows[0] * TILE, int(np.ceil((u_low - radius) / h[u] - 0.5)))
        i1 = min(nu - 1, tile_rows[1] * TILE - 1, int(np.floor((u_high + radius) / h[u] - 0.5)))
        j0 = max(0, int(np.ceil((v_low - radius) / h[v] - 0.5)))
        j1 = min(nv - 1, int(np.floor((v_high + radius) / h[v] - 0.5)))
        if d_high <= 0.0 or d_low >= top or i1 < i0 or j1 < j0:
            continue
        frame_figure(d, kind, p, way, size, face)
        last = g + 1 == len(block) or block[g + 1] != block[g]
        for a in range(i0 // TILE, i1 // TILE + 1):
            for b in range(j0 // TILE, j1 // TILE + 1):
                # The sweep within a tile is within the wider sweep on the tile's middle ray.
                if tiles[a, b, 0] >= d_high or tiles[a, b, 1] <= d_low:
                    continue
                x, y = (a + 0.5) * TILE * h[u], (b + 0.5) * TILE * h[v]
                low, high, _, _, _, _ = ball_on_ray(d, kind, p, way, size, face, wider, x, y)
                if low >= high or low >= tiles[a, b, 1] or high <= tiles[a, b, 0]:
                    continue
                changed = False
                for i in range(max(i0, a * TILE), min(i1, a * TILE + TILE - 1) + 1):
                    for j in range(max(j0, b * TILE), min(j1, b * TILE + TILE - 1) + 1):
                        ray = i * nv + j
                        m = count[ray]
                        if m == 0 or ends[ray, 0] >= d_high or ends[ray, 2 * m - 1] <= d_low:
                            continue
                        x, y = (i + 0.5) * h[u], (j + 0.5) * h[v]
                        low, high, slope_low, slope_high, part_low, part_high = ball_on_ray(
                            d, kind, p, way, size, face, radius, x, y
                        )
                        if low >= high:
                            continue
                        if keep:
                            figures[block[g], 0] += overlap(ends, count, ray, low, high) * area
                            continue
                        removed, made = cut(ends, cut_by, count, ray, low, high, first + block[g])
                        if removed < 0.0:
                            return g
                        if removed > 0.0:
                            changed = True
                            figures[block[g], 0] += removed * area
                            if last and made & 1 and part_low in (END_SPHERE, END_CYLINDER):
                                figures[block[g], 1] += slope_low / radius * area
                            if last and made & 2 and part_high in (END_SPHERE, END_CYLINDER):
                                figures[block[g], 1] += slope_high / radius * area
                if changed:
                    fit_tile(tiles, a, b, ends, count, nu, nv)
    return len(block)
