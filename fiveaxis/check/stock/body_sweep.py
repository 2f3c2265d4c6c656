"""Compiled loops: any convex body of revolution, swept from one pose to another.

The depth of a point in the body at a time of the segment is `fiveaxis.model.toolpath.profile.inside`.
Without a turn it is concave in place and time together: tangents of its maximum over time lead from outside
to the first point of the sweep on a ray, and never past it. A turn adds terms that aren't concave: a tangent
that overshot is followed by a bracketed search, and where tangents say that a ray misses the body by little,
the place where it is deepest is looked for. Segments are divided until what remains is within a tolerance
(`fiveaxis.check.stock.sweeping`).

Importing this module loads numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.check.stock.rays import HALF_DIAGONAL, TILE, TINY, Counts, Ends, Rays, cut, fit_tile, overlap
from fiveaxis.model import inside

if TYPE_CHECKING:
    from fiveaxis.check.stock.sweeping import BodySweep

# mm: accuracy of the largest depth over a segment; tangents flatter than this lead nowhere.
DEPTH, FLAT = 2e-5, 1e-9
# Steps along a ray, along a segment's time, and of a bracketed search.
MOST_TANGENTS, MOST_TIMES, MOST_HALVINGS, MOST_LOOKS = 40, 30, 30, 14
# A slope below which a last step along the ray would be longer than its rounding is worth.
LEAST_SLOPE = 0.01
# Share of a segment behind which an end belongs to its last pose.
AT_END = 0.999
# mm above the tip, in which a surface belongs to the bottom; sweeps are as exact as half of it.
BOTTOM = 0.02
# A body's figures, (5,) mm: largest radius, heights of its lower and upper end above the tip, by how much its
# depth may rise above tangents along a ray where it turns, and by how much it is inflated for a query.
RADIUS, LOW, HIGH, ALONG, WIDER = 0, 1, 2, 3, 4


@compiled
def depth_at(
    d: int, x: Array, t: float, pose: Array, zones: Array, body: Array
) -> tuple[float, float, float]:
    """Depth of a point in the body at a share of its segment, and its slopes along axis d and in time."""
    o0 = pose[1, 0] + t * (pose[3, 0] - pose[1, 0])
    o1 = pose[1, 1] + t * (pose[3, 1] - pose[1, 1])
    o2 = pose[1, 2] + t * (pose[3, 2] - pose[1, 2])
    scale = 1.0 / np.sqrt(o0 * o0 + o1 * o1 + o2 * o2)
    o0, o1, o2 = o0 * scale, o1 * scale, o2 * scale
    m0, m1, m2 = pose[2, 0] - pose[0, 0], pose[2, 1] - pose[0, 1], pose[2, 2] - pose[0, 2]
    w0, w1, w2 = x[0] - pose[0, 0] - t * m0, x[1] - pose[0, 1] - t * m1, x[2] - pose[0, 2] - t * m2
    z = w0 * o0 + w1 * o1 + w2 * o2
    rho = np.sqrt(max(w0 * w0 + w1 * w1 + w2 * w2 - z * z, 0.0))
    value, slope_rho, slope_z = inside(rho, z, zones)
    if body[HIGH] - z < value:
        value, slope_rho, slope_z = body[HIGH] - z, 0.0, -1.0
    if z - body[LOW] < value:
        value, slope_rho, slope_z = z - body[LOW], 0.0, 1.0
    e0 = (pose[3, 0] - pose[1, 0]) * scale
    e1 = (pose[3, 1] - pose[1, 1]) * scale
    e2 = (pose[3, 2] - pose[1, 2]) * scale
    radial = e0 * o0 + e1 * o1 + e2 * o2  # the axis keeps its length
    z_t = -(m0 * o0 + m1 * o1 + m2 * o2) + w0 * e0 + w1 * e1 + w2 * e2 - z * radial
    od, wd = (o0, w0) if d == 0 else ((o1, w1) if d == 1 else (o2, w2))
    if rho > 1e-12:
        rho_t = (-(w0 * m0 + w1 * m1 + w2 * m2) - z * z_t) / rho
        return value, slope_rho * (wd - z * od) / rho + slope_z * od, slope_rho * rho_t + slope_z * z_t
    return value, slope_z * od, slope_z * z_t


@compiled
def deepest_time(
    d: int, x: Array, t: float, pose: Array, zones: Array, body: Array
) -> tuple[float, float, float]:
    """Largest depth of a point over the segment, its slope along axis d and its time, from a first guess."""
    value, slope, rate = depth_at(d, x, t, pose, zones, body)
    best, best_slope, best_t = value, slope, t
    if (rate >= 0.0 and t >= 1.0) or (rate <= 0.0 and t <= 0.0) or rate == 0.0:
        return best, best_slope, best_t
    other = 1.0 if rate > 0.0 else 0.0
    f, s, g = depth_at(d, x, other, pose, zones, body)
    if f > best:
        best, best_slope, best_t = f, s, other
    if rate * g >= 0.0:
        return best, best_slope, best_t
    # Two tangents in time bound a concave depth: where they meet is the next time.
    begin, f_begin, s_begin, g_begin, end, f_end, s_end, g_end = t, value, slope, rate, other, f, s, g
    if other < t:
        begin, f_begin, s_begin, g_begin, end, f_end, s_end, g_end = other, f, s, g, t, value, slope, rate
    for _ in range(MOST_TIMES):
        meet = (f_end - f_begin + g_begin * begin - g_end * end) / (g_begin - g_end)
        width = end - begin
        if f_begin + g_begin * (meet - begin) <= best + DEPTH:
            break
        m = min(max(meet, begin + 0.05 * width), end - 0.05 * width)
        f, s, g = depth_at(d, x, m, pose, zones, body)
        if f > best:
            best, best_t = f, m
        if g > 0.0:
            begin, f_begin, s_begin, g_begin = m, f, s, g
        elif g < 0.0:
            end, f_end, s_end, g_end = m, f, s, g
        else:
            return best, s, best_t
    # At a kink in time, where the end of the body meets its side, the greatest depth changes along the ray as
    # both do together while their rates cancel; the slope of one of them alone may have the wrong sign.
    return best, (s_end * g_begin - s_begin * g_end) / (g_begin - g_end), best_t


@compiled
def first_point(
    d: int, x: Array, begin: float, end: float, t: float, wider: float, pose: Array, zones: Array, body: Array
) -> tuple[float, float, float]:
    """Find the first point of a sweep on a ray from one place towards another.

    Parameters
    ----------
    x : (3,), mm, a point of the ray, which is overwritten
    begin, end : mm, along axis d
    t : a first guess of the time
    wider : mm, by which the body is inflated

    Returns
    -------
    Place, mm; NaN if there is none. Size of the depth's slope, and the time, there
    """
    sign = 1.0 if end > begin else -1.0
    s, outside, f_outside, rise = begin, np.nan, 0.0, 0.0
    for _ in range(MOST_TANGENTS):
        x[d] = s
        f, slope, t = deepest_time(d, x, t, pose, zones, body)
        f += wider
        if f > TINY and not np.isnan(outside):
            return enters_between(d, x, outside, s, t, wider, pose, zones, body)
        if f >= -TINY:
            return s + sign * max(-f, 0.0) / max(sign * slope, LEAST_SLOPE), abs(slope), t
        if sign * slope <= FLAT:
            # Past the greatest depth on the ray, as far as tangents say.
            if np.isnan(outside) or body[ALONG] <= 0.0:
                break
            meet = outside + sign * (f - f_outside + slope * (outside - s)) / (rise - sign * slope)
            if f_outside + rise * sign * (meet - outside) < -body[ALONG]:
                break
            return greatest_between(d, x, outside, s, t, wider, pose, zones, body)
        if s == end:
            break
        outside, f_outside, rise = s, f, sign * slope
        s -= f / slope
        s = end if sign * s > sign * end else s
    return np.nan, 0.0, t


@compiled
def enters_between(
    d: int,
    x: Array,
    outside: float,
    inner: float,
    t: float,
    wider: float,
    pose: Array,
    zones: Array,
    body: Array,
) -> tuple[float, float, float]:
    """Find where a ray enters a sweep between a place outside and one inside, as `first_point`."""
    x[d] = inner
    _, slope, t = deepest_time(d, x, t, pose, zones, body)
    for _ in range(MOST_HALVINGS):
        if abs(inner - outside) < TINY:
            break
        x[d] = 0.5 * (outside + inner)
        f, slope_there, time_there = deepest_time(d, x, t, pose, zones, body)
        if f + wider < 0.0:
            outside = x[d]
        else:
            inner, slope, t = x[d], slope_there, time_there
    return inner, abs(slope), t


@compiled
def greatest_between(
    d: int,
    x: Array,
    rising: float,
    falling: float,
    t: float,
    wider: float,
    pose: Array,
    zones: Array,
    body: Array,
) -> tuple[float, float, float]:
    """Look for a place of a ray inside the sweep between two outside, towards which the depth rises."""
    outside, sign = rising, 1.0 if falling > rising else -1.0
    for _ in range(MOST_LOOKS):
        x[d] = 0.5 * (rising + falling)
        f, slope, t = deepest_time(d, x, t, pose, zones, body)
        if f + wider > 0.0:
            return enters_between(d, x, outside, x[d], t, wider, pose, zones, body)
        if sign * slope > 0.0:
            rising = x[d]
        else:
            falling = x[d]
    return np.nan, 0.0, t


@compiled
def beside(d: int, x: Array, place: float, pose: Array) -> bool:
    """Whether a place of a ray is above a cutter's flat bottom, which makes no chips, at its last pose."""
    x[d] = place
    height = 0.0
    for k in range(3):
        height += (x[k] - pose[2, k]) * pose[3, k]
    return height > BOTTOM


@compiled
def sweep_bodies(
    rays: Rays,
    sweep: BodySweep,
    tile_rows: tuple[int, int],
    begin: int,
    first: int,
    figures: Array,
    keep: bool,
) -> int:
    """Remove a swept convex body from the rays of some rows of tiles; parameters as of `sweep_balls`.

    Parameters
    ----------
    sweep : with tips in mm from the grid's low corner; `ALONG` of its body is set here for each segment
    """
    d, h, n, ends, cut_by, count, tiles = rays
    poses, zones, body, block = sweep
    u, v = (d + 1) % 3, (d + 2) % 3
    nu, nv, area = n[u], n[v], h[u] * h[v]
    body = body.copy()  # strips run at once
    radius, low, high = body[RADIUS] + max(body[WIDER], 0.0), body[LOW], body[HIGH]
    wider = body[WIDER] + TILE * HALF_DIAGONAL * max(h[u], h[v])
    x, corners, top = np.zeros(3), np.empty((4, 3)), n[d] * h[d]
    for g in range(begin, len(block)):
        pose = poses[g]
        body[ALONG] = np.sqrt(np.sum((pose[3] - pose[1]) ** 2)) * (radius + high - low) / 4.0
        for k in range(3):
            corners[0, k], corners[1, k] = pose[0, k] + low * pose[1, k], pose[0, k] + high * pose[1, k]
            corners[2, k], corners[3, k] = pose[2, k] + low * pose[3, k], pose[2, k] + high * pose[3, k]
        d_low, d_high = np.min(corners[:, d]) - radius, np.max(corners[:, d]) + radius
        if d_high <= 0.0 or d_low >= top:
            continue
        i0 = max(tile_rows[0] * TILE, int(np.ceil((np.min(corners[:, u]) - radius) / h[u] - 0.5)))
        i1 = min(nu - 1, tile_rows[1] * TILE - 1)
        i1 = min(i1, int(np.floor((np.max(corners[:, u]) + radius) / h[u] - 0.5)))
        j0 = max(0, int(np.ceil((np.min(corners[:, v]) - radius) / h[v] - 0.5)))
        j1 = min(nv - 1, int(np.floor((np.max(corners[:, v]) + radius) / h[v] - 0.5)))
        last = g + 1 == len(block) or block[g + 1] != block[g]
        for a in range(i0 // TILE, i1 // TILE + 1):
            for b in range(j0 // TILE, j1 // TILE + 1):
                if tiles[a, b, 0] >= d_high or tiles[a, b, 1] <= d_low:
                    continue
                x[u], x[v] = (a + 0.5) * TILE * h[u], (b + 0.5) * TILE * h[v]
                start, stop = max(d_low, float(tiles[a, b, 0])), min(d_high, float(tiles[a, b, 1]))
                place, _, time = first_point(d, x, start, stop, 0.5, wider, pose, zones, body)
                if not place < stop:
                    continue
                changed = False
                for i in range(max(i0, a * TILE), min(i1, a * TILE + TILE - 1) + 1):
                    for j in range(max(j0, b * TILE), min(j1, b * TILE + TILE - 1) + 1):
                        ray = i * nv + j
                        m = count[ray]
                        if m == 0 or ends[ray, 0] >= d_high or ends[ray, 2 * m - 1] <= d_low:
                            continue
                        x[u], x[v] = (i + 0.5) * h[u], (j + 0.5) * h[v]
                        # Only the part of the body beside material matters.
                        start, stop = (
                            max(d_low, float(ends[ray, 0])),
                            min(d_high, float(ends[ray, 2 * m - 1])),
                        )
                        enters, slope_in, t_in = first_point(
                            d, x, start, stop, time, body[WIDER], pose, zones, body
                        )
                        time = t_in
                        if not enters < stop:
                            continue
                        leaves, slope_out, t_out = first_point(
                            d, x, stop, start, time, body[WIDER], pose, zones, body
                        )
                        time = t_out
                        if not leaves > enters:
                            continue
                        if keep:
                            figures[block[g], 0] += overlap(ends, count, ray, enters, leaves) * area
                            continue
                        enters -= 2.0 * TINY * (enters == start)
                        leaves += 2.0 * TINY * (leaves == stop)
                        removed, made = cut(ends, cut_by, count, ray, enters, leaves, first + block[g])
                        if removed < 0.0:
                            return g
                        if removed > 0.0:
                            changed = True
                            figures[block[g], 0] += removed * area
                            if last and made & 1 and t_in > AT_END and beside(d, x, enters, pose):
                                figures[block[g], 1] += slope_in * area
                            if last and made & 2 and t_out > AT_END and beside(d, x, leaves, pose):
                                figures[block[g], 1] += slope_out * area
                if changed:
                    fit_tile(tiles, a, b, ends, count, nu, nv)
    return len(block)


@compiled
def fill_body(
    d: int, h: Array, n: IntArray, ends: Ends, count: Counts, pose: Array, zones: Array, body: Array
) -> None:
    """Give the rays of an empty bundle the material of one convex body; pose and zones as above."""
    u, v = (d + 1) % 3, (d + 2) % 3
    x, top = np.zeros(3), n[d] * h[d]
    for i in range(n[u]):
        for j in range(n[v]):
            x[u], x[v] = (i + 0.5) * h[u], (j + 0.5) * h[v]
            low, _, _ = first_point(d, x, 0.0, top, 1.0, 0.0, pose, zones, body)
            high, _, _ = first_point(d, x, top, 0.0, 1.0, 0.0, pose, zones, body)
            if high - low > TINY:
                ray = i * n[v] + j
                ends[ray, 0], ends[ray, 1], count[ray] = low, high, 1
