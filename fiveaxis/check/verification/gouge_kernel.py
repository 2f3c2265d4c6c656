"""Compiled loops: the depth of a convex body of revolution in triangles.

The depth of a point, `fiveaxis.model.toolpath.profile.inside`, is concave in space, as a minimum of concave
functions (−ρ is concave, sin φ ≥ 0). So on a plane it is largest where the plane meets the meridian plane
that contains its normal (by symmetry), and on a triangle there or on an edge. Along a line tangents bound a
concave function from above: the first of them rules out most triangles.

Importing this module loads numba.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from fiveaxis.base import Array, compiled, inner
from fiveaxis.cam import STACK, nearest_triangle
from fiveaxis.model import inside

# A convex body of revolution: its zones, as in `inside`, and the heights of its ends, mm above the tip.
Body: TypeAlias = tuple[Array, float, float]
# mm: accuracy of a depth.
EXACT = 1e-9
# Steps along a line; each shortens the bracket to about half or less.
MOST_STEPS = 80
# mm: a point of a line this near to a corner's edge counts as on it; mm²: no more is a sliver's area.
EDGE = 1e-12


@inner
def along(p: Array, step: Array, t: float, zones: Array) -> tuple[float, float]:
    """`inside` at ``p + t·step``, and its slope in t."""
    x, y, z = p[0] + t * step[0], p[1] + t * step[1], p[2] + t * step[2]
    rho = np.sqrt(x * x + y * y)
    value, slope_rho, slope_z = inside(rho, z, zones)
    # On the axis a concave function of ρ has its peak: there 0 is the slope of a tangent.
    turning = (x * step[0] + y * step[1]) / rho if rho > 0.0 else 0.0
    return value, slope_rho * turning + slope_z * step[2]


@inner
def deepest_on_line(p: Array, step: Array, start: float, end: float, zones: Array, best: float) -> float:
    """Largest `inside` on ``p + t·step``, t from start to end, or `best` if none is larger."""
    low, high = start, end
    f_low, g_low = along(p, step, low, zones)
    f_high, g_high = along(p, step, high, zones)
    best = max(best, f_low, f_high)
    if g_low <= 0.0 or g_high >= 0.0:
        return best
    for _ in range(MOST_STEPS):
        width = high - low
        meet = (f_high - f_low + g_low * low - g_high * high) / (g_low - g_high)
        meet = min(max(meet, low), high)
        if f_low + g_low * (meet - low) <= best + EXACT:
            break
        t = min(max(meet, low + 0.05 * width), high - 0.05 * width)
        f, g = along(p, step, t, zones)
        best = max(best, f)
        if g > 0.0:
            low, f_low, g_low = t, f, g
        elif g < 0.0:
            high, f_high, g_high = t, f, g
        else:
            break
    return best


@inner
def clipped(corners: Array, count: int, height: float, sign: float, out: Array) -> int:
    """Clip a polygon at a height, above (sign 1) or below (sign −1) it; return the number of corners left."""
    kept = 0
    for i in range(count):
        p, q = corners[i], corners[(i + 1) % count]
        above_p, above_q = sign * (p[2] - height), sign * (q[2] - height)
        if above_p >= 0.0:
            out[kept] = p
            kept += 1
        if (above_p > 0.0 and above_q < 0.0) or (above_p < 0.0 and above_q > 0.0):
            out[kept] = p + above_p / (above_p - above_q) * (q - p)
            out[kept, 2] = height
            kept += 1
    return kept


@inner
def deepest_across(corners: Array, count: int, normal: Array, zones: Array, best: float) -> float:
    """Largest `inside` where a polygon meets the meridian plane of its normal, or `best`.

    Its corners, (≥ count, 3) mm, are counterclockwise about the normal.
    """
    off = normal[0] * corners[0, 0] + normal[1] * corners[0, 1] + normal[2] * corners[0, 2]
    level = np.sqrt(normal[0] ** 2 + normal[1] ** 2)
    foot, line = off * normal, np.zeros(3)
    if level > EDGE:
        line[0], line[1], line[2] = -normal[2] * normal[0] / level, -normal[2] * normal[1] / level, level
    start, end = -np.inf, np.inf
    for i in range(count):
        a, b = corners[i], corners[(i + 1) % count]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        cx = normal[1] * ez - normal[2] * ey
        cy = normal[2] * ex - normal[0] * ez
        cz = normal[0] * ey - normal[1] * ex
        here = cx * (foot[0] - a[0]) + cy * (foot[1] - a[1]) + cz * (foot[2] - a[2])
        rise = cx * line[0] + cy * line[1] + cz * line[2]
        if abs(rise) <= EDGE * (abs(ex) + abs(ey) + abs(ez)):
            if here < 0.0:
                return best
        elif rise > 0.0:
            start = max(start, -here / rise)
        else:
            end = min(end, -here / rise)
    if level <= EDGE:
        return max(best, inside(0.0, foot[2], zones)[0])
    return deepest_on_line(foot, line, start, end, zones, best) if start < end < np.inf else best


@inner
def deepest_in_triangle(triangle: Array, body: Body, best: float) -> float:
    """Largest `inside` on the part of a triangle between a body's ends, or `best` if none is larger.

    The triangle, (3, 3) mm, is in the tool's frame: tip at 0, axis along z.
    """
    zones, low, high = body
    bottom = min(triangle[0, 2], triangle[1, 2], triangle[2, 2])
    top = max(triangle[0, 2], triangle[1, 2], triangle[2, 2])
    if bottom > high or top < low:
        return best
    x = (triangle[0, 0] + triangle[1, 0] + triangle[2, 0]) / 3.0
    y = (triangle[0, 1] + triangle[1, 1] + triangle[2, 1]) / 3.0
    z = (triangle[0, 2] + triangle[1, 2] + triangle[2, 2]) / 3.0
    rho = np.sqrt(x * x + y * y)
    value, slope_rho, slope_z = inside(rho, z, zones)
    bound = -np.inf
    for i in range(3):
        turning = ((triangle[i, 0] - x) * x + (triangle[i, 1] - y) * y) / rho if rho > 0.0 else 0.0
        bound = max(bound, value + slope_rho * turning + slope_z * (triangle[i, 2] - z))
    if bound <= best:
        return best
    corners, other, count = np.empty((8, 3)), np.empty((8, 3)), 3
    corners[:3] = triangle
    if top > high:
        count = clipped(corners, count, high, -1.0, other)
        corners, other = other, corners
    if bottom < low:
        count = clipped(corners, count, low, 1.0, other)
        corners, other = other, corners
    if count == 0:
        return best
    u, v = triangle[1] - triangle[0], triangle[2] - triangle[0]
    normal = np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
    area = np.sqrt(np.sum(normal * normal))
    # Of a sliver, whose normal would be rounding, only the edges count.
    if area > EDGE and count >= 3:
        best = deepest_across(corners, count, normal / area, zones, best)
    for i in range(count):
        best = deepest_on_line(corners[i], corners[(i + 1) % count] - corners[i], 0.0, 1.0, zones, best)
    return best


@inner
def frame_of(axis: Array) -> Array:
    """Three unit vectors at right angles, (3, 3) rows, the last one the axis.

    As `clipped`, it isn't that of the search's mask, which verification shares no formula with.
    """
    least = int(np.argmin(np.abs(axis)))
    frame = np.zeros((3, 3))
    frame[0, least] = 1.0
    frame[0] -= axis[least] * axis
    frame[0] /= np.sqrt(np.sum(frame[0] * frame[0]))
    x = frame[0]
    frame[1, 0] = axis[1] * x[2] - axis[2] * x[1]
    frame[1, 1] = axis[2] * x[0] - axis[0] * x[2]
    frame[1, 2] = axis[0] * x[1] - axis[1] * x[0]
    frame[2] = axis
    return frame


@inner
def put_in_frame(triangle: Array, tip: Array, frame: Array, out: Array) -> None:
    """Write the corners of a triangle, (3, 3) mm, in the tool's frame."""
    for i in range(3):
        x, y, z = triangle[i, 0] - tip[0], triangle[i, 1] - tip[1], triangle[i, 2] - tip[2]
        for j in range(3):
            out[i, j] = frame[j, 0] * x + frame[j, 1] * y + frame[j, 2] * z


@inner
def box_bound(tip: Array, axis: Array, box: Array, body: Body) -> float:
    """Bound `inside` over a box from above, mm: no distance changes faster than the point moves."""
    zones, low, high = body
    z = rho2 = half2 = reach = 0.0
    for k in range(3):
        off = 0.5 * (box[0, k] + box[1, k]) - tip[k]
        half = 0.5 * (box[1, k] - box[0, k])
        z += off * axis[k]
        rho2 += off * off
        half2 += half * half
        reach += half * abs(axis[k])
    if z - reach > high or z + reach < low:
        return -np.inf
    rho = np.sqrt(max(rho2 - z * z, 0.0))
    return float(inside(rho, z, zones)[0] + np.sqrt(half2))


@inner
def deepest(tip: Array, axis: Array, body: Body, triangles: Array, boxes: Array, floor: float) -> float:
    """Depth of one body in the triangles of a tree, mm; `floor` if it is no deeper.

    Tip and axis are (3,), mm and a unit vector; triangles and boxes are as in
    `fiveaxis.cam.mesh.kernels.nearest_triangle`.
    """
    leaves = len(boxes) // 2
    width = len(triangles) // leaves
    frame, local = frame_of(axis), np.empty((3, 3))
    best = floor
    waiting, bounds = np.empty(STACK, np.int64), np.empty(STACK)
    waiting[0], bounds[0] = 1, np.inf
    count = 1
    while count > 0:
        count -= 1
        node = waiting[count]
        if bounds[count] <= best:
            continue
        if node >= leaves:
            for k in range((node - leaves) * width, (node - leaves + 1) * width):
                put_in_frame(triangles[k], tip, frame, local)
                best = deepest_in_triangle(local, body, best)
            continue
        one = box_bound(tip, axis, boxes[2 * node], body)
        two = box_bound(tip, axis, boxes[2 * node + 1], body)
        # The child that may be deeper comes first: it rules out most of the other.
        first = 2 * node if one > two else 2 * node + 1
        waiting[count], bounds[count] = 4 * node + 1 - first, min(one, two)
        waiting[count + 1], bounds[count + 1] = first, max(one, two)
        count += 2
    return best


@compiled
def deepest_all(tips: Array, axes: Array, body: Body, triangles: Array, boxes: Array, floors: Array) -> Array:
    """`deepest` for each row of tips and axes, (n, 3), and floors, (n,) → (n,) mm."""
    depths = np.empty(len(tips))
    for i in range(len(tips)):
        depths[i] = deepest(tips[i], axes[i], body, triangles, boxes, floors[i])
    return depths


@compiled
def sunk_balls(centres: Array, radius: float, triangles: Array, boxes: Array, floors: Array) -> Array:
    """Depth of balls in triangles, radius less distance, at least the floor: (n, 3), (n,) → (n,) mm."""
    depths = np.empty(len(centres))
    for i in range(len(centres)):
        depths[i] = radius - nearest_triangle(centres[i], triangles, boxes, radius - floors[i])[1]
    return depths
