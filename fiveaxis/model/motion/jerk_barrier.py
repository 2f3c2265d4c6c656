"""The quickest run along a path within speeds, accelerations and jerks: a barrier method in compiled loops.

The unknown is ``x = ṙ²``, the squared rate of the path's parameter r, as a cubic B-spline over intervals of
length 1. With the derivatives of the axis values q with respect to r,

    q̇ = q' √x,    q̈ = q'' x + q' x' / 2,    q⃛ = √x (q''' x + 3/2 q'' x' + 1/2 q' x'').

The time ``∫ dr / √x`` is least within ``x < c``, ``|q̈| < A`` and ``|q⃛| / √x < J / √x`` at the ends and
the middle of each interval. The last isn't convex: the curvature of ``1 / √x`` is left out of the Hessian,
which so stays positive definite. It is banded, as an interval has four coefficients.

References
----------
Verscheure et al. (2009) for the time as a function of ṙ²; Boyd & Vandenberghe (2004), 11.3, for the method.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, IntArray, compiled, inner

# Of Newton's method: most steps; most shortenings of one, and by what; least decrease, of the slope's.
MOST_STEPS, MOST_SHORTENINGS, SHORTENING, DECREASE = 60, 60, 0.6, 1e-4


def spline_basis(t: Array) -> Array:
    """Return the pieces of a uniform cubic B-spline at shares t of an interval, (p,), and two derivatives.

    They are (3, p, 4).
    """
    u = 1.0 - t
    t2, u2 = t * t, u * u
    values = [u2 * u, 3.0 * t2 * t - 6.0 * t2 + 4.0, 3.0 * u2 * u - 6.0 * u2 + 4.0, t2 * t]
    slopes = [-u2, 3.0 * t2 - 4.0 * t, 4.0 * u - 3.0 * u2, t2]
    bends = [u, 3.0 * t - 2.0, 3.0 * u - 2.0, t]
    stacked = np.stack([np.stack(values) / 6.0, np.stack(slopes) / 2.0, np.stack(bends)])
    return np.ascontiguousarray(stacked.transpose(0, 2, 1))


# Shares of an interval at which there are limits; the last of them only at the end of the path.
SHARES = np.array([0.0, 0.5, 1.0])
BASIS = spline_basis(SHARES)


class PointLimits(NamedTuple):
    """Limits at points of the path, as many in each interval.

    Parameters
    ----------
    interval, share : (m,), of each point; indices of `SHARES`
    ceiling : (m,), of x
    a1, a2 : (m, k), q' / 2 and q'' as shares of A
    e1, e2, e3 : (m, k), q' / 2, 3/2 q'' and q''' as shares of J
    """

    interval: IntArray
    share: IntArray
    ceiling: Array
    a1: Array
    a2: Array
    e1: Array
    e2: Array
    e3: Array


@inner
def _rates(c: Array, at: PointLimits, m: int) -> tuple[float, float, float]:
    """Return x and two derivatives at a point."""
    i, o = at.interval[m], at.share[m]
    x, dx, ddx = 0.0, 0.0, 0.0
    for a in range(4):
        x += BASIS[0, o, a] * c[i + a]
        dx += BASIS[1, o, a] * c[i + a]
        ddx += BASIS[2, o, a] * c[i + a]
    return x, dx, ddx


@compiled
def merit(c: Array, at: PointLimits, mu: float) -> float:
    """Return the time plus the barrier of weight mu, or infinity beyond a limit; arguments as `centre`."""
    time, barrier = 0.0, 0.0
    for m in range(len(at.ceiling)):
        x, dx, ddx = _rates(c, at, m)
        if not (x > 0.0 and x < at.ceiling[m]):
            return np.inf
        y2 = 1.0 / x
        time += 0.5 * math.sqrt(y2)
        product = 1.0 - x / at.ceiling[m]
        for j in range(at.a1.shape[1]):
            push = at.a2[m, j] * x + at.a1[m, j] * dx
            jerk = at.e3[m, j] * x + at.e2[m, j] * dx + at.e1[m, j] * ddx
            room, slack = 1.0 - push * push, y2 - jerk * jerk
            if not (room > 0.0 and slack > 0.0):
                return np.inf
            product *= room * slack
            if product < 1e-150 or product > 1e150:
                barrier -= math.log(product)
                product = 1.0
        barrier -= math.log(product)
    return time + mu * barrier


@compiled
def _newton_step(c: Array, at: PointLimits, mu: float) -> tuple[Array, float]:
    """Return Newton's step and its decrement; arguments as `centre`."""
    size = len(c)
    p, band = np.zeros(size), np.zeros((size, 4))
    for m in range(len(at.ceiling)):
        i, o = at.interval[m], at.share[m]
        x, dx, ddx = _rates(c, at, m)
        y = 1.0 / math.sqrt(x)
        y3 = y * y * y
        z, s = -0.5 * y3, 1.0 / (at.ceiling[m] - x)
        # Gradient and Hessian in x, x', x'' first: 3 and 6 numbers, then in the four coefficients.
        gx, gs, gt = 0.5 * z + mu * s, 0.0, 0.0
        xx, xs, xt, ss, st, tt = 0.375 * y3 * y * y + mu * s * s, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(at.a1.shape[1]):
            p0, p1 = at.a2[m, j], at.a1[m, j]
            v = p0 * x + p1 * dx
            r = 1.0 / (1.0 - v * v)
            t, u = 2.0 * mu * v * r, 2.0 * mu * (1.0 + v * v) * r * r
            gx += t * p0
            gs += t * p1
            xx += u * p0 * p0
            xs += u * p0 * p1
            ss += u * p1 * p1
            p0, p1, p2 = at.e3[m, j], at.e2[m, j], at.e1[m, j]
            v = p0 * x + p1 * dx + p2 * ddx
            r = 1.0 / (y * y - v * v)
            r1, r2 = (y + v) * r, (y - v) * r
            u1, u2 = mu * r1 * r1, mu * r2 * r2
            d0, d1 = z - p0, z + p0
            t, u, w = mu * (r1 - r2), u1 + u2, u2 * d1 - u1 * d0
            gx -= mu * (r1 * d0 + r2 * d1)
            gs += t * p1
            gt += t * p2
            xx += u1 * d0 * d0 + u2 * d1 * d1
            xs += w * p1
            xt += w * p2
            ss += u * p1 * p1
            st += u * p1 * p2
            tt += u * p2 * p2
        for a in range(4):
            b0, b1, b2 = BASIS[0, o, a], BASIS[1, o, a], BASIS[2, o, a]
            p[i + a] -= gx * b0 + gs * b1 + gt * b2
            h0, h1, h2 = xx * b0 + xs * b1 + xt * b2, xs * b0 + ss * b1 + st * b2, xt * b0 + st * b1 + tt * b2
            for b in range(a, 4):
                band[i + a, b - a] += h0 * BASIS[0, o, b] + h1 * BASIS[1, o, b] + h2 * BASIS[2, o, b]
    decrement = 0.0
    for i in range(size):  # LDLᵀ
        for a in range(1, min(4, size - i)):
            factor = band[i, a] / band[i, 0]
            for b in range(a, min(4, size - i)):
                band[i + a, b - a] -= factor * band[i, b]
            p[i + a] -= factor * p[i]
        decrement += p[i] * p[i] / band[i, 0]
    for i in range(size - 1, -1, -1):
        for a in range(1, min(4, size - i)):
            p[i] -= band[i, a] * p[i + a]
        p[i] /= band[i, 0]
    return p, decrement


@compiled
def centre(c: Array, at: PointLimits, mu: float, allowed: float) -> Array:
    """Minimise the time plus a barrier of weight mu: coefficients of x, (n + 3,), strictly within all limits.

    They are near enough at a Newton decrement of `allowed`.
    """
    best = merit(c, at, mu)
    for _ in range(MOST_STEPS):
        p, decrement = _newton_step(c, at, mu)
        share = 1.0
        found = np.inf
        for _ in range(MOST_SHORTENINGS):
            tried = c + share * p
            found = merit(tried, at, mu)
            if found <= best - DECREASE * share * decrement:
                break
            share *= SHORTENING
        if not found < best:
            break
        c, best = tried, found
        if decrement < allowed:
            break
    return c


@compiled
def largest_shares(c: Array, at: PointLimits) -> Array:
    """Find the largest shares of the limits in each interval, (n, 3): of speed, acceleration and jerk."""
    shares = np.zeros((len(c) - 3, 3))
    for m in range(len(at.ceiling)):
        i = at.interval[m]
        x, dx, ddx = _rates(c, at, m)
        x = max(x, 0.0)
        shares[i, 0] = max(shares[i, 0], math.sqrt(x / at.ceiling[m]))
        for j in range(at.a1.shape[1]):
            shares[i, 1] = max(shares[i, 1], abs(at.a2[m, j] * x + at.a1[m, j] * dx))
            jerk = at.e3[m, j] * x + at.e2[m, j] * dx + at.e1[m, j] * ddx
            shares[i, 2] = max(shares[i, 2], math.sqrt(x) * abs(jerk))
    return shares
