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

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fiveaxis.base import Array, compiled, inner, innermost
from fiveaxis.check.stock.rays import TINY
from fiveaxis.check.stock.sweep_loop import sweep_loop
from fiveaxis.model import inside

if TYPE_CHECKING:
    from fiveaxis.check.stock.sweeping import BodySweep

# A body between two poses: its pose at both, (4, 3), its zones, and its figures, (5,); see `BodySweep`.
Moved: TypeAlias = tuple[Array, Array, Array]
# That, a point of a ray, and its time.
Segment: TypeAlias = tuple[Moved, Array, Array]

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
def depth_at(d: int, x: Array, t: float, moved: Moved) -> tuple[float, float, float]:
    """Depth of a point in the body at a share of its segment, and its slopes along axis d and in time."""
    pose, zones, body = moved
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
def deepest_time(d: int, x: Array, t: float, moved: Moved) -> tuple[float, float, float]:
    """Largest depth of a point over the segment, its slope along axis d and its time, from a first guess."""
    value, slope, rate = depth_at(d, x, t, moved)
    best, best_slope, best_t = value, slope, t
    if (rate >= 0.0 and t >= 1.0) or (rate <= 0.0 and t <= 0.0) or rate == 0.0:
        return best, best_slope, best_t
    other = 1.0 if rate > 0.0 else 0.0
    f, s, g = depth_at(d, x, other, moved)
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
        f, s, g = depth_at(d, x, m, moved)
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
    d: int, x: Array, begin: float, end: float, t: float, wider: float, moved: Moved
) -> tuple[float, float, float]:
    """Find the first point of a sweep on a ray from one place towards another.

    Return its place, mm, NaN if there is none, the size of the depth's slope there, and the time. Begin and
    end, mm, are along axis d; the point x of the ray, (3,) mm, is overwritten; t is a first guess of the
    time; the body is inflated by `wider`, mm.
    """
    sign, along = 1.0 if end > begin else -1.0, moved[2][ALONG]
    s, outside, f_outside, rise = begin, np.nan, 0.0, 0.0
    for _ in range(MOST_TANGENTS):
        x[d] = s
        f, slope, t = deepest_time(d, x, t, moved)
        f += wider
        if f > TINY and not np.isnan(outside):
            return enters_between(d, x, outside, s, t, wider, moved)
        if f >= -TINY:
            return s + sign * max(-f, 0.0) / max(sign * slope, LEAST_SLOPE), abs(slope), t
        if sign * slope <= FLAT:
            # Past the greatest depth on the ray, as far as tangents say.
            if np.isnan(outside) or along <= 0.0:
                break
            meet = outside + sign * (f - f_outside + slope * (outside - s)) / (rise - sign * slope)
            if f_outside + rise * sign * (meet - outside) < -along:
                break
            return greatest_between(d, x, outside, s, t, wider, moved)
        if s == end:
            break
        outside, f_outside, rise = s, f, sign * slope
        s -= f / slope
        s = end if sign * s > sign * end else s
    return np.nan, 0.0, t


@compiled
def enters_between(
    d: int, x: Array, outside: float, inner: float, t: float, wider: float, moved: Moved
) -> tuple[float, float, float]:
    """Find where a ray enters a sweep between a place outside and one inside, as `first_point`."""
    x[d] = inner
    _, slope, t = deepest_time(d, x, t, moved)
    for _ in range(MOST_HALVINGS):
        if abs(inner - outside) < TINY:
            break
        x[d] = 0.5 * (outside + inner)
        f, slope_there, time_there = deepest_time(d, x, t, moved)
        if f + wider < 0.0:
            outside = x[d]
        else:
            inner, slope, t = x[d], slope_there, time_there
    return inner, abs(slope), t


@compiled
def greatest_between(
    d: int, x: Array, rising: float, falling: float, t: float, wider: float, moved: Moved
) -> tuple[float, float, float]:
    """Look for a place of a ray inside the sweep between two outside, towards which the depth rises."""
    outside, sign = rising, 1.0 if falling > rising else -1.0
    for _ in range(MOST_LOOKS):
        x[d] = 0.5 * (rising + falling)
        f, slope, t = deepest_time(d, x, t, moved)
        if f + wider > 0.0:
            return enters_between(d, x, outside, x[d], t, wider, moved)
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


@inner
def start_body(sweep: BodySweep) -> tuple[Array, Array, Array]:
    """Make room for a segment's body (strips run at once), a point of a ray, and its time there.

    Consecutive rays meet the body at about the same time.
    """
    return sweep.body.copy(), np.zeros(3), np.zeros(1)


@inner
def body_segment(sweep: BodySweep, g: int, room: tuple[Array, Array, Array]) -> Segment:
    """Return a segment."""
    body, at, time = room
    return (sweep.poses[g], sweep.zones, body), at, time


@innermost
def bound_body(segment: Segment, low: Array, high: Array) -> None:
    """Bound a segment."""
    pose, _, body = segment[0]
    radius = body[RADIUS] + max(body[WIDER], 0.0)
    for k in range(3):
        a, b = pose[0, k] + body[LOW] * pose[1, k], pose[0, k] + body[HIGH] * pose[1, k]
        c, e = pose[2, k] + body[LOW] * pose[3, k], pose[2, k] + body[HIGH] * pose[3, k]
        low[k], high[k] = min(a, b, c, e) - radius, max(a, b, c, e) + radius


@inner
def frame_body(_d: int, segment: Segment) -> None:
    """Set by how much the depth may rise above tangents."""
    pose, _, body = segment[0]
    reach = body[RADIUS] + max(body[WIDER], 0.0) + body[HIGH] - body[LOW]
    body[ALONG] = np.sqrt(np.sum((pose[3] - pose[1]) ** 2)) * reach / 4.0


@innermost
def body_near(d: int, segment: Segment, x: float, y: float, wider: float, low: float, high: float) -> bool:
    """Whether a ray comes within a wider body between two places; its time is the first guess."""
    moved, at, time = segment
    at[(d + 1) % 3], at[(d + 2) % 3] = x, y
    place, _, time[0] = first_point(d, at, low, high, 0.5, moved[2][WIDER] + wider, moved)
    return place < high


@innermost
def body_meets(
    d: int, segment: Segment, x: float, y: float, low: float, high: float, keep: bool
) -> tuple[float, float, float, float]:
    """Where a ray is in the sweep, beside material, and slopes of contact at the segment's end."""
    moved, at, time = segment
    at[(d + 1) % 3], at[(d + 2) % 3] = x, y
    pose, wider = moved[0], moved[2][WIDER]
    enters, slope_in, t_in = first_point(d, at, low, high, time[0], wider, moved)
    time[0] = t_in
    if not enters < high:
        return np.inf, -np.inf, 0.0, 0.0
    leaves, slope_out, t_out = first_point(d, at, high, low, t_in, wider, moved)
    time[0] = t_out
    if not leaves > enters:
        return np.inf, -np.inf, 0.0, 0.0
    if not keep:
        enters, leaves = enters - 2.0 * TINY * (enters == low), leaves + 2.0 * TINY * (leaves == high)
    at_in = slope_in if t_in > AT_END and beside(d, at, enters, pose) else 0.0
    at_out = slope_out if t_out > AT_END and beside(d, at, leaves, pose) else 0.0
    return enters, leaves, at_in, at_out


sweep_bodies = sweep_loop(start_body, body_segment, bound_body, frame_body, body_near, body_meets)
