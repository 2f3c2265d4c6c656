"""Compiled loops: the swept ball with the cylinder above it, in closed form.

The sweep is all points within R of the surface that the cutter's axis describes between the ball's centre and
the upper end. That surface is given as triangles, and each segment's figure is a line (a ball alone), two
triangles, a fan of four about the saddle's middle (a turning axis describes a saddle: a fan leaves it by a
sixteenth of its twist, two triangles by a quarter), or one triangle. On a ray the sweep is the hull of what
its spheres, cylinders and slabs cover.

Importing this module loads numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fiveaxis.base import Array, compiled, inner, innermost
from fiveaxis.check.stock.sweep_loop import sweep_loop

if TYPE_CHECKING:
    from fiveaxis.check.stock.sweeping import BallSweep

# Figure; its nodes, (5, 3) mm; direction and length of its edges, (8, 3) and (8,); its faces, (4, 9): normal
# (u, v, d), barycentric slopes in u and v of two corners, their rises along d; the radius, mm.
Segment: TypeAlias = tuple[int, Array, Array, Array, Array, float]

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


@inner
def frame_ball(d: int, segment: Segment) -> None:
    """Prepare edges and faces of a segment for rays along d."""
    kind, p, way, size, face, _ = segment
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
    d: int, segment: Segment, wider: float, x: float, y: float
) -> tuple[float, float, float, float, int, int]:
    """Where a ray is within a segment whose ball is wider, mm: low and high, ∞ and −∞ if it isn't.

    Then, for each of both, R·|n_d| of the surface's normal n, and what the ray meets: a sphere's node, 10 +
    an edge, or 20 + a face.
    """
    kind, p, way, size, face, narrow = segment
    u, v, radius = (d + 1) % 3, (d + 2) % 3, narrow + wider
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


@inner
def start_ball(sweep: BallSweep) -> tuple[Array, Array, Array]:
    """Make room for the edges and faces of a figure."""
    return np.empty((8, 3)), np.empty(8), np.empty((4, 9))


@inner
def ball_segment(sweep: BallSweep, g: int, room: tuple[Array, Array, Array]) -> Segment:
    """Return a segment: figure, nodes, room, radius."""
    return sweep.kinds[g], sweep.nodes[g], *room, sweep.radius


@innermost
def bound_ball(segment: Segment, low: Array, high: Array) -> None:
    """Bound a segment."""
    kind, p, _, _, _, radius = segment
    for k in range(3):
        low[k] = high[k] = p[0, k]
        for node in range(1, NODES[kind]):
            low[k], high[k] = min(low[k], p[node, k]), max(high[k], p[node, k])
        low[k], high[k] = low[k] - radius, high[k] + radius


@innermost
def ball_near(d: int, segment: Segment, x: float, y: float, wider: float, low: float, high: float) -> bool:
    """Whether a ray comes within a wider ball between two places."""
    begin, end, _, _, _, _ = ball_on_ray(d, segment, wider, x, y)
    return begin < end and begin < high and end > low


@innermost
def ball_meets(
    d: int, segment: Segment, x: float, y: float, _low: float, _high: float, _keep: bool
) -> tuple[float, float, float, float]:
    """Where a ray is in the sweep, and the slopes of contact there at the segment's end."""
    low, high, slope_low, slope_high, part_low, part_high = ball_on_ray(d, segment, 0.0, x, y)
    at_low = slope_low / segment[5] if part_low in (END_SPHERE, END_CYLINDER) else 0.0
    at_high = slope_high / segment[5] if part_high in (END_SPHERE, END_CYLINDER) else 0.0
    return low, high, at_low, at_high


sweep_balls = sweep_loop(start_ball, ball_segment, bound_ball, frame_ball, ball_near, ball_meets)
