"""The parts of an interior-point step, compiled.

A location has rows: the linear axes, the rotary axes, the cosines of the bounds. Rows 0 to 4 are the axes;
a step from a location to the next moves them by ``s − t`` with ``s, t ≥ 0`` at ``W⁺s + W⁻t``. Everything but
the angles can be eliminated step by step and row by row, and what is left couples neighbours only: 2 × 2
blocks on three diagonals.
"""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.posture.waves import compiled

AXES = 5


@compiled
def evaluate(waves: Array, x: Array, value: Array, slope: Array, bow: Array) -> None:
    """Evaluate every row, its gradient and its second derivatives.

    Parameters
    ----------
    waves : (n, r, 9), of the rows; those of the rotary axes, 3 and 4, aren't read
    x : (n, 2), rad
    value, slope, bow : (n, r), (n, r, 2), (n, r, 3), filled in; second derivatives by 11, 12, 22
    """
    for i in range(len(x)):
        c1, s1, c2, s2 = math.cos(x[i, 0]), math.sin(x[i, 0]), math.cos(x[i, 1]), math.sin(x[i, 1])
        for r in range(waves.shape[1]):
            if r == 3 or r == 4:
                value[i, r] = x[i, r - 3]
                slope[i, r, r - 3] = 1.0
                continue
            k = waves[i, r]
            still = k[0] + k[1] * c2 + k[2] * s2
            cosine = k[3] + k[4] * c2 + k[5] * s2
            sine = k[6] + k[7] * c2 + k[8] * s2
            wave = cosine * c1 + sine * s1
            value[i, r] = still + wave
            slope[i, r, 0] = sine * c1 - cosine * s1
            by_second = (k[2] + k[5] * c1 + k[8] * s1, k[1] + k[4] * c1 + k[7] * s1)
            slope[i, r, 1] = by_second[0] * c2 - by_second[1] * s2
            bow[i, r, 0] = -wave
            bow[i, r, 1] = (k[8] * c1 - k[5] * s1) * c2 - (k[7] * c1 - k[4] * s1) * s2
            bow[i, r, 2] = -by_second[0] * s2 - by_second[1] * c2


@compiled
def condense_rows(
    mu: float,
    value: Array,
    slope: Array,
    bow: Array,
    low: Array,
    high: Array,
    y: Array,
    zl: Array,
    zh: Array,
    nu: Array,
    diagonal: Array,
    right: Array,
) -> None:
    """Add the bounds of every location to the condensed system.

    Parameters
    ----------
    low, high : (n, r), bounds; infinite where there is none
    y, zl, zh, nu : (n, r), slack, its duals, multiplier of ``row = y``
    diagonal, right : (n, 3) and (n, 2), added to
    """
    for i in range(len(value)):
        for r in range(value.shape[1]):
            if low[i, r] == -np.inf and high[i, r] == np.inf:
                continue
            stiff, push = 0.0, 0.0
            if low[i, r] > -np.inf:
                gap = y[i, r] - low[i, r]
                stiff += zl[i, r] / gap
                push -= mu / gap
            if high[i, r] < np.inf:
                gap = high[i, r] - y[i, r]
                stiff += zh[i, r] / gap
                push += mu / gap
            push += stiff * (value[i, r] - y[i, r])
            g0, g1 = slope[i, r, 0], slope[i, r, 1]
            right[i, 0] += g0 * push
            right[i, 1] += g1 * push
            diagonal[i, 0] += nu[i, r] * bow[i, r, 0] + stiff * g0 * g0
            diagonal[i, 1] += nu[i, r] * bow[i, r, 1] + stiff * g0 * g1
            diagonal[i, 2] += nu[i, r] * bow[i, r, 2] + stiff * g1 * g1


@compiled
def stiffness(mu: float, weight: float, most: float, part: float, z: float, v: float) -> tuple[float, float]:
    """Give ``Σ`` and the pull ``μ/s − μ/(M − s) − w`` of one part, s or t, of a step."""
    stiff, pull = z / part, mu / part - weight
    if most < np.inf:
        stiff += v / (most - part)
        pull -= mu / (most - part)
    return stiff, pull


@compiled
def condense_steps(
    mu: float,
    value: Array,
    slope: Array,
    bow: Array,
    plus: Array,
    minus: Array,
    most: Array,
    bend: Array,
    s: Array,
    t: Array,
    zs: Array,
    zt: Array,
    vs: Array,
    vt: Array,
    lam: Array,
    diagonal: Array,
    beside: Array,
    right: Array,
) -> None:
    """Add the travel of every step to the condensed system.

    Parameters
    ----------
    plus, minus, most : (n − 1, 5), J/mm and J/rad; largest step
    bend : (n − 1,), J/rad²
    s, t, zs, zt, vs, vt, lam : (n − 1, 5), parts of the step, duals of 0 and of the largest step, multiplier
    diagonal, beside, right : (n, 3), (n − 1, 2, 2) and (n, 2), added to
    """
    for j in range(len(plus)):
        for a in range(AXES):
            stiff_s, pull_s = stiffness(mu, plus[j, a], most[j, a], s[j, a], zs[j, a], vs[j, a])
            stiff_t, pull_t = stiffness(mu, minus[j, a], most[j, a], t[j, a], zt[j, a], vt[j, a])
            share, apart = stiff_t / (stiff_s + stiff_t), value[j + 1, a] - value[j, a]
            stiff = share * stiff_s
            push = stiff * (apart - s[j, a] + t[j, a]) - share * pull_s + (1.0 - share) * pull_t
            if a >= 3:
                stiff += 2.0 * bend[j]
                push += 2.0 * bend[j] * apart
            for e in range(2):
                right[j, e] -= slope[j, a, e] * push
                right[j + 1, e] += slope[j + 1, a, e] * push
                for f in range(2):
                    beside[j, e, f] -= stiff * slope[j, a, e] * slope[j + 1, a, f]
            for i, sign in ((j, -1.0), (j + 1, 1.0)):
                g0, g1 = slope[i, a, 0], slope[i, a, 1]
                diagonal[i, 0] += sign * lam[j, a] * bow[i, a, 0] + stiff * g0 * g0
                diagonal[i, 1] += sign * lam[j, a] * bow[i, a, 1] + stiff * g0 * g1
                diagonal[i, 2] += sign * lam[j, a] * bow[i, a, 2] + stiff * g1 * g1


@compiled
def solve_blocks(
    diagonal: Array, beside: Array, right: Array, held: BoolArray, shift: float, dx: Array
) -> bool:
    """Solve ``(H + shift) dx = −right`` for 2 × 2 blocks on three diagonals.

    Parameters
    ----------
    diagonal : (n, 3), by 11, 12, 22; beside : (n − 1, 2, 2), row of i, column of i + 1
    held : (n,), locations that don't move
    dx : (n, 2), filled in

    Returns
    -------
    Whether the matrix is positive definite.
    """
    n = len(diagonal)
    inverse, carried = np.empty((n, 3)), np.zeros((n, 2))
    for i in range(n):
        a, b, c = diagonal[i, 0] + shift, diagonal[i, 1], diagonal[i, 2] + shift
        u, w = -right[i, 0], -right[i, 1]
        if i > 0 and not held[i - 1]:
            p, q, r = inverse[i - 1]
            m = beside[i - 1]
            # Column by column of inverse · m.
            k00, k01 = p * m[0, 0] + q * m[1, 0], p * m[0, 1] + q * m[1, 1]
            k10, k11 = q * m[0, 0] + r * m[1, 0], q * m[0, 1] + r * m[1, 1]
            a -= m[0, 0] * k00 + m[1, 0] * k10
            b -= m[0, 0] * k01 + m[1, 0] * k11
            c -= m[0, 1] * k01 + m[1, 1] * k11
            u -= k00 * carried[i - 1, 0] + k10 * carried[i - 1, 1]
            w -= k01 * carried[i - 1, 0] + k11 * carried[i - 1, 1]
        if held[i]:
            inverse[i], carried[i] = 0.0, 0.0
            continue
        determinant = a * c - b * b
        if not (a > 0.0 and c > 0.0 and determinant > 0.0):
            return False
        inverse[i, 0], inverse[i, 1], inverse[i, 2] = c / determinant, -b / determinant, a / determinant
        carried[i, 0], carried[i, 1] = u, w
    for i in range(n - 1, -1, -1):
        u, w = carried[i]
        if i < n - 1 and not held[i]:
            m = beside[i]
            u -= m[0, 0] * dx[i + 1, 0] + m[0, 1] * dx[i + 1, 1]
            w -= m[1, 0] * dx[i + 1, 0] + m[1, 1] * dx[i + 1, 1]
        p, q, r = inverse[i]
        dx[i, 0], dx[i, 1] = p * u + q * w, q * u + r * w
    return True


@compiled
def recover_rows(
    mu: float,
    value: Array,
    slope: Array,
    low: Array,
    high: Array,
    y: Array,
    zl: Array,
    zh: Array,
    nu: Array,
    dx: Array,
    dy: Array,
    dzl: Array,
    dzh: Array,
    dnu: Array,
) -> None:
    """Work out the steps of slacks, duals and multipliers of the bounds from that of the angles."""
    for i in range(len(value)):
        for r in range(value.shape[1]):
            if low[i, r] == -np.inf and high[i, r] == np.inf:
                continue
            ahead = slope[i, r, 0] * dx[i, 0] + slope[i, r, 1] * dx[i, 1]
            dy[i, r] = ahead + value[i, r] - y[i, r]
            new = 0.0
            if low[i, r] > -np.inf:
                gap = y[i, r] - low[i, r]
                dzl[i, r] = mu / gap - zl[i, r] - zl[i, r] / gap * dy[i, r]
                new -= zl[i, r] + dzl[i, r]
            if high[i, r] < np.inf:
                gap = high[i, r] - y[i, r]
                dzh[i, r] = mu / gap - zh[i, r] + zh[i, r] / gap * dy[i, r]
                new += zh[i, r] + dzh[i, r]
            dnu[i, r] = new - nu[i, r]


@compiled
def recover_steps(
    mu: float,
    value: Array,
    slope: Array,
    plus: Array,
    minus: Array,
    most: Array,
    s: Array,
    t: Array,
    zs: Array,
    zt: Array,
    vs: Array,
    vt: Array,
    lam: Array,
    dx: Array,
    ds: Array,
    dt: Array,
    dzs: Array,
    dzt: Array,
    dvs: Array,
    dvt: Array,
    dlam: Array,
) -> None:
    """Work out the steps of a move's parts, duals and multipliers from that of the angles."""
    for j in range(len(plus)):
        for a in range(AXES):
            stiff_s, pull_s = stiffness(mu, plus[j, a], most[j, a], s[j, a], zs[j, a], vs[j, a])
            stiff_t, pull_t = stiffness(mu, minus[j, a], most[j, a], t[j, a], zt[j, a], vt[j, a])
            apart = value[j + 1, a] - value[j, a] - s[j, a] + t[j, a]
            for e in range(2):
                apart += slope[j + 1, a, e] * dx[j + 1, e] - slope[j, a, e] * dx[j, e]
            share = stiff_t / (stiff_s + stiff_t)
            new = share * stiff_s * apart - share * pull_s + (1.0 - share) * pull_t
            dlam[j, a] = new - lam[j, a]
            # The stiffer part first: the other one's own equation would lose all digits.
            if stiff_s > stiff_t:
                ds[j, a] = (new + pull_s) / stiff_s
                dt[j, a] = ds[j, a] - apart
            else:
                dt[j, a] = (pull_t - new) / stiff_t
                ds[j, a] = dt[j, a] + apart
            dzs[j, a] = mu / s[j, a] - zs[j, a] - zs[j, a] / s[j, a] * ds[j, a]
            dzt[j, a] = mu / t[j, a] - zt[j, a] - zt[j, a] / t[j, a] * dt[j, a]
            if most[j, a] < np.inf:
                gap = most[j, a] - s[j, a]
                dvs[j, a] = mu / gap - vs[j, a] + vs[j, a] / gap * ds[j, a]
                gap = most[j, a] - t[j, a]
                dvt[j, a] = mu / gap - vt[j, a] + vt[j, a] / gap * dt[j, a]


@compiled
def longest(fraction: float, room: Array, change: Array) -> float:
    """Give the largest step up to 1 that leaves each of some positive numbers a share of itself."""
    alpha = 1.0
    for i in range(room.shape[0]):
        for a in range(room.shape[1]):
            if change[i, a] < 0.0 and -alpha * change[i, a] > fraction * room[i, a]:
                alpha = -fraction * room[i, a] / change[i, a]
    return alpha


@compiled
def barrier_terms(mu: float, room: Array) -> float:
    """Add up ``−μ log`` of positive numbers; infinite ones stand for no bound."""
    total = 0.0
    for i in range(room.shape[0]):
        for a in range(room.shape[1]):
            if room[i, a] < np.inf:
                total -= mu * math.log(room[i, a])
    return total


@compiled
def judge(
    mu: float,
    value: Array,
    low: Array,
    high: Array,
    plus: Array,
    minus: Array,
    most: Array,
    bend: Array,
    y: Array,
    s: Array,
    t: Array,
) -> tuple[float, float]:
    """Measure by how much the equations are off, added up, and the barrier problem's objective, J."""
    off, cost = 0.0, 0.0
    for i in range(len(value)):
        for r in range(value.shape[1]):
            if low[i, r] > -np.inf or high[i, r] < np.inf:
                off += abs(value[i, r] - y[i, r])
    for j in range(len(plus)):
        for a in range(AXES):
            apart = value[j + 1, a] - value[j, a]
            off += abs(apart - s[j, a] + t[j, a])
            cost += plus[j, a] * s[j, a] + minus[j, a] * t[j, a]
            if a >= 3:
                cost += bend[j] * apart * apart
    cost += barrier_terms(mu, s) + barrier_terms(mu, t)
    cost += barrier_terms(mu, most - s) + barrier_terms(mu, most - t)
    return off, cost + barrier_terms(mu, y - low) + barrier_terms(mu, high - y)


@compiled
def errors(
    mu: float,
    value: Array,
    slope: Array,
    low: Array,
    high: Array,
    y: Array,
    zl: Array,
    zh: Array,
    nu: Array,
    held: BoolArray,
    pull: Array,
) -> tuple[float, float, float, float, int]:
    """Measure how far the bounds' part is from the optimum for a barrier parameter.

    Parameters
    ----------
    pull : (n, 2), added to: the gradient of the Lagrangian in the angles

    Returns
    -------
    Largest error of slacks' gradient, of the equations and of complementarity; sum and count of multipliers.
    """
    dual, primal, apart, size, count = 0.0, 0.0, 0.0, 0.0, 0
    for i in range(len(value)):
        for r in range(value.shape[1]):
            if low[i, r] == -np.inf and high[i, r] == np.inf:
                continue
            dual = max(dual, abs(zh[i, r] - zl[i, r] - nu[i, r]))
            primal = max(primal, abs(value[i, r] - y[i, r]))
            if low[i, r] > -np.inf:
                apart = max(apart, abs(zl[i, r] * (y[i, r] - low[i, r]) - mu))
            if high[i, r] < np.inf:
                apart = max(apart, abs(zh[i, r] * (high[i, r] - y[i, r]) - mu))
            size += zl[i, r] + zh[i, r] + abs(nu[i, r])
            count += 3
            if not held[i]:
                pull[i, 0] += nu[i, r] * slope[i, r, 0]
                pull[i, 1] += nu[i, r] * slope[i, r, 1]
    return dual, primal, apart, size, count


@compiled
def step_errors(
    mu: float,
    value: Array,
    slope: Array,
    plus: Array,
    minus: Array,
    most: Array,
    bend: Array,
    s: Array,
    t: Array,
    zs: Array,
    zt: Array,
    vs: Array,
    vt: Array,
    lam: Array,
    held: BoolArray,
    pull: Array,
) -> tuple[float, float, float, float, int]:
    """Measure the same for the steps' part."""
    dual, primal, gap, size = 0.0, 0.0, 0.0, 0.0
    for j in range(len(plus)):
        for a in range(AXES):
            apart, push = value[j + 1, a] - value[j, a], lam[j, a]
            primal = max(primal, abs(apart - s[j, a] + t[j, a]))
            dual = max(dual, abs(plus[j, a] - push - zs[j, a] + vs[j, a]))
            dual = max(dual, abs(minus[j, a] + push - zt[j, a] + vt[j, a]))
            gap = max(gap, abs(zs[j, a] * s[j, a] - mu), abs(zt[j, a] * t[j, a] - mu))
            if most[j, a] < np.inf:
                gap = max(gap, abs(vs[j, a] * (most[j, a] - s[j, a]) - mu))
                gap = max(gap, abs(vt[j, a] * (most[j, a] - t[j, a]) - mu))
            size += abs(push) + zs[j, a] + zt[j, a] + vs[j, a] + vt[j, a]
            if a >= 3:
                push += 2.0 * bend[j] * apart
            for e in range(2):
                if not held[j]:
                    pull[j, e] -= push * slope[j, a, e]
                if not held[j + 1]:
                    pull[j + 1, e] += push * slope[j + 1, a, e]
    return dual, primal, gap, size, 7 * AXES * len(plus)
