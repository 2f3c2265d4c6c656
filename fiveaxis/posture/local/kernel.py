"""Steps of the interior-point method, compiled.

Rows and parts are those of `rows`. A part's *compliance* ``1/Σ`` is how far it yields to the multiplier of
its row; a fixed part has none. A row's parts, their duals and its multiplier follow from the step of the
unknowns in closed form, and the remaining system couples only the locations of a window: a banded matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled, inner, innermost

# Compliance of an equation: its stiffness leaves the other terms their digits.
YIELD = 1e-10
# Products of distances to bounds stay above this and below its inverse, far from overflow.
SMALL = 1e-200
# Weight of the error of a priced row: an error there only changes the cost, while one in a row with bounds
# alone breaks them.
PRICED = 1e-3
# J/rad²: shift of the diagonal of a matrix without negative curvature, off what rounding leaves of 0; its
# growth where that isn't enough, and its limit.
FIRST_SHIFT, GROWTH, MOST_SHIFT = 0.1, 100.0, 1e14
# Least distance of a value from its bound, relative if the bound is above 1: a smaller one would be rounded
# away, and is divided by.
LEAST_ROOM = 1e-13
# Duals stay within this factor of their value on the central path.
DUAL_RANGE = 1e10


class Point(NamedTuple):
    """A point of a problem with r rows, p parts and d unknowns per location.

    Parameters
    ----------
    first, square, begin : of the rows (`rows.TermRows`)
    pair : (r,), the first of the two parts of a row, rise and fall, that have no largest value; −1 for none
    parts : (4, p), sign, price, low, high
    state : (3, p), values of the parts and duals of both bounds, updated in place
    value, multiplier, gradient : (r,), (r,) and (r, span d), of the rows, updated in place
    """

    first: IntArray
    square: Array
    begin: IntArray
    pair: IntArray
    parts: Array
    state: Array
    value: Array
    multiplier: Array
    gradient: Array
    d: int


@compiled
def row_values(quantity: IntArray, coefficient: Array, quantities: Array, values: Array) -> None:
    """Evaluate ``C q``; values, (r,), are filled in from quantities, (n m,)."""
    for j in range(len(quantity)):
        total = 0.0
        for z in range(quantity.shape[1]):
            if quantity[j, z] >= 0:
                total += coefficient[j, z] * quantities[quantity[j, z]]
        values[j] = total


@compiled
def row_weights(quantity: IntArray, coefficient: Array, force: Array, weights: Array) -> None:
    """Evaluate ``Cᵀ force``, (n m,): the weights of the quantities' second derivatives."""
    weights[:] = 0.0
    for j in range(len(quantity)):
        for z in range(quantity.shape[1]):
            if quantity[j, z] >= 0:
                weights[quantity[j, z]] += coefficient[j, z] * force[j]


@compiled
def differentiate(
    quantity: IntArray, coefficient: Array, quantities: Array, slope: Array, point: Point
) -> None:
    """Evaluate rows and their derivatives by the unknowns of their windows at a point.

    Quantities are (n, m); their slopes, (n, m, d), are by the unknowns of their location. The rows' own are
    those of `rows.TermRows`.
    """
    first, value, gradient = point.first, point.value, point.gradient
    m, d = slope.shape[1], slope.shape[2]
    for j in range(len(quantity)):
        value[j] = 0.0
        for e in range(gradient.shape[1]):
            gradient[j, e] = 0.0
        for z in range(quantity.shape[1]):
            if quantity[j, z] < 0:
                continue
            # A window has few locations: to count on is quicker than to divide.
            i = first[j]
            while quantity[j, z] >= (i + 1) * m:
                i += 1
            a = quantity[j, z] - i * m
            value[j] += coefficient[j, z] * quantities[i, a]
            for e in range(d):
                gradient[j, (i - first[j]) * d + e] += coefficient[j, z] * slope[i, a, e]


@innermost
def assemble(mu: float, point: Point, soft: Array, answer: Array, band: Array, right: Array) -> None:
    """Eliminate parts and rows, and add the rows to the condensed system.

    Parameters
    ----------
    soft : (2, p), compliance and pull ``μ/(v − l) − μ/(h − v) − w`` of each part; 0 if it is fixed
    answer : (2, r), compliance of each row, and its new multiplier for unchanged unknowns
    band : (n d, span d), lower half by row, the diagonal first
    right : (n d,), gradient of the condensed problem
    """
    square, begin, parts, state = point.square, point.begin, point.parts, point.state
    value, gradient = point.value, point.gradient
    for j in range(len(value)):
        yields, ahead = 0.0, value[j]
        for p in range(begin[j], begin[j + 1]):
            low, high, v = parts[2, p], parts[3, p], state[0, p]
            soft[0, p] = soft[1, p] = 0.0
            if low != high:
                stiff, pull = 0.0, -parts[1, p]
                if low > -np.inf:
                    room = 1.0 / (v - low)
                    stiff += state[1, p] * room
                    pull += mu * room
                if high < np.inf:
                    room = 1.0 / (high - v)
                    stiff += state[2, p] * room
                    pull -= mu * room
                soft[0, p], soft[1, p] = 1.0 / stiff, pull
            yields += soft[0, p]
            ahead -= parts[0, p] * (v + soft[1, p] * soft[0, p])
        if yields == 0.0:
            answer[0, j], answer[1, j] = YIELD, point.multiplier[j] + ahead / YIELD
        else:
            answer[0, j], answer[1, j] = yields, ahead / yields
        stiff, push = 2.0 * square[j], 2.0 * square[j] * value[j]
        if begin[j] < begin[j + 1]:
            stiff += 1.0 / answer[0, j]
            push += answer[1, j]
        base = point.first[j] * point.d
        for e in range(gradient.shape[1]):
            g = gradient[j, e]
            if g == 0.0:
                continue
            right[base + e] += g * push
            g *= stiff
            for f in range(e + 1):
                band[base + e, e - f] += g * gradient[j, f]


@innermost
def recover(
    mu: float, point: Point, soft: Array, answer: Array, dx: Array, change: Array, new: Array
) -> float:
    """Compute the steps of parts and duals, (3, p), and of multipliers, (r,), from that of the unknowns.

    Returns the derivative of the barrier objective along the step.
    """
    begin, parts, state, gradient = point.begin, point.parts, point.state, point.gradient
    square, value, gain = point.square, point.value, 0.0
    for j in range(len(begin) - 1):
        along, base = 0.0, point.first[j] * point.d
        for e in range(gradient.shape[1]):
            if gradient[j, e] != 0.0:
                along += gradient[j, e] * dx[base + e]
        gain += 2.0 * square[j] * value[j] * along
        if begin[j] == begin[j + 1]:
            continue
        force = answer[1, j] + along / answer[0, j]
        new[j] = force - point.multiplier[j]
        # The part with the largest compliance takes the rest, as its own equation would lose its digits.
        rest, softest, most = value[j] + along, -1, 0.0
        for p in range(begin[j], begin[j + 1]):
            change[0, p] = soft[0, p] * (soft[1, p] + parts[0, p] * force)
            rest -= parts[0, p] * (state[0, p] + change[0, p])
            if soft[0, p] > most:
                softest, most = p, soft[0, p]
        if softest >= 0:
            change[0, softest] += parts[0, softest] * rest
    for p in range(parts.shape[1]):
        low, high, v, dv = parts[2, p], parts[3, p], state[0, p], change[0, p]
        change[1, p] = change[2, p] = 0.0
        if low == high:
            continue
        gain += parts[1, p] * dv
        if low > -np.inf:
            room = 1.0 / (v - low)
            gain -= mu * room * dv
            change[1, p] = (mu - state[1, p] * dv) * room - state[1, p]
        if high < np.inf:
            room = 1.0 / (high - v)
            gain += mu * room * dv
            change[2, p] = (mu + state[2, p] * dv) * room - state[2, p]
    return gain


@innermost
def lift(v: Array, change: Array, alpha: float, fraction: float, p: int) -> float:
    """Return by how much more rise and fall, parts p and p + 1, increase: each keeps a share of its value."""
    if p < 0:
        return 0.0
    rise, fall = fraction * v[p] + alpha * change[0, p], fraction * v[p + 1] + alpha * change[0, p + 1]
    return max(0.0, -min(rise, fall))


@compiled
def take(
    mu: float, alpha: float, fraction: float, point: Point, x: Array, dx: Array, change: Array, new: Array
) -> None:
    """Take a step: its share `alpha` of unknowns, values and multipliers, and all of the duals.

    Values stay at least `LEAST_ROOM` off bounds, duals keep a share ``1 − fraction`` of their value, and stay
    within `DUAL_RANGE` of the central path.
    """
    begin, pair, parts, state = point.begin, point.pair, point.parts, point.state
    multiplier, v = point.multiplier, point.state[0]
    for i in range(len(dx)):
        x[i] += alpha * dx[i]
    for j in range(len(new)):
        multiplier[j] += alpha * new[j]
        up = lift(v, change, alpha, fraction, pair[j])
        for p in range(begin[j], begin[j + 1]):
            low, high = parts[2, p], parts[3, p]
            if low == high:
                continue
            at = v[p] + alpha * change[0, p] + (up if 0 <= pair[j] <= p else 0.0)
            most = (high - low) / 4.0
            if low > -np.inf:
                at = max(at, low + min(LEAST_ROOM * max(1.0, abs(low)), most))
            if high < np.inf:
                at = min(at, high - min(LEAST_ROOM * max(1.0, abs(high)), most))
            v[p] = at
            if low > -np.inf:
                wanted = mu / (at - low)
                moved = max(state[1, p] + change[1, p], (1.0 - fraction) * state[1, p])
                state[1, p] = min(max(moved, wanted / DUAL_RANGE), wanted * DUAL_RANGE)
            if high < np.inf:
                wanted = mu / (high - at)
                moved = max(state[2, p] + change[2, p], (1.0 - fraction) * state[2, p])
                state[2, p] = min(max(moved, wanted / DUAL_RANGE), wanted * DUAL_RANGE)


@inner
def solve_band(band: Array, right: Array, free: BoolArray, shift: float, dx: Array) -> bool:
    """Solve ``(H + shift) dx = −right`` by ``L D Lᵀ`` without pivoting; False unless it is positive definite.

    The band, (N, b), is the lower half by row, the diagonal first. Rows and columns of unknowns that aren't
    free are 0. The step dx, (N,), is filled in.
    """
    count, width = band.shape
    low, pivot = np.empty((count, width)), np.empty(count)
    for i in range(count):
        if not free[i]:
            pivot[i], dx[i] = 1.0, 0.0
            for e in range(width):
                low[i, e] = 0.0
            continue
        nearest = max(0, i - width + 1)
        diagonal, u = band[i, 0] + shift, -right[i]
        # low[i, i - j] holds L_ij D_j until row i is done.
        for j in range(nearest, i):
            entry = band[i, i - j]
            for k in range(max(nearest, j - width + 1), j):
                entry -= low[i, i - k] * low[j, j - k]
            low[i, i - j] = entry
        for j in range(nearest, i):
            scaled = low[i, i - j] / pivot[j]
            diagonal -= scaled * low[i, i - j]
            u -= scaled * dx[j]
            low[i, i - j] = scaled
        if not diagonal > 0.0:
            return False
        pivot[i], dx[i] = diagonal, u
    for i in range(count - 1, -1, -1):
        dx[i] /= pivot[i]
        for j in range(i + 1, min(count, i + width)):
            dx[i] -= low[j, j - i] * dx[j]
    return True


@innermost
def longest_step(fraction: float, point: Point, change: Array) -> float:
    """Find the longest step up to 1 of values that uses at most a share of their room.

    A rise and a fall without largest value don't shorten it (`lift`), or one axis that turns back would stop
    all.
    """
    begin, pair, parts, v = point.begin, point.pair, point.parts, point.state[0]
    longest = 1.0
    for j in range(len(pair)):
        end = begin[j + 1] if pair[j] < 0 else pair[j]
        for p in range(begin[j], end):
            low, high, dv = parts[2, p], parts[3, p], change[0, p]
            if low == high:
                continue
            if dv < 0.0 and -longest * dv > fraction * (v[p] - low):
                longest = -fraction * (v[p] - low) / dv
            if dv > 0.0 and longest * dv > fraction * (high - v[p]):
                longest = fraction * (high - v[p]) / dv
    return longest


@compiled
def measure(
    mu: float, point: Point, change: Array, alpha: float, fraction: float, value: Array
) -> tuple[float, float]:
    """Compute the sum of the errors of the equations, and the barrier objective (J), after a step."""
    square, begin, pair, parts, v = point.square, point.begin, point.pair, point.parts, point.state[0]
    off, cost, product = 0.0, 0.0, 1.0
    for j in range(len(square)):
        cost += square[j] * value[j] * value[j]
        if begin[j] == begin[j + 1]:
            continue
        rest, up = value[j], lift(v, change, alpha, fraction, pair[j])
        for p in range(begin[j], begin[j + 1]):
            low, high = parts[2, p], parts[3, p]
            at = v[p] + alpha * change[0, p] + (up if 0 <= pair[j] <= p else 0.0)
            rest -= parts[0, p] * at
            if low == high:
                continue
            cost += parts[1, p] * at
            # One logarithm for many factors: it takes longer than all the rest.
            if low > -np.inf:
                product *= at - low
            if high < np.inf:
                product *= high - at
            if not SMALL < product < 1.0 / SMALL:
                cost -= mu * math.log(product)
                product = 1.0
        off += abs(rest)
    return off, cost - mu * math.log(product)


@innermost
def mirror(curvature: Array, d: int, band: Array) -> None:
    """Change the sign of each location's negative curvature, (n, d, d), in a band that has its own.

    The step then leads away from a saddle, as far as curvature says, and no other location's is shorter for
    it (Dauphin et al. 2014, "saddle-free Newton"). A wait has no curvature.
    """
    for i in range(len(curvature)):
        a, b, c = curvature[i, 0, 0], curvature[i, 1, 0], curvature[i, 1, 1]
        middle, radius = (a + c) / 2.0, math.hypot((a - c) / 2.0, b)
        if middle + radius <= 0.0:
            a, b, c = -2.0 * a, -2.0 * b, -2.0 * c
        elif middle < radius:
            # Twice the part along the eigenvector of the negative eigenvalue.
            share = (radius - middle) / radius
            a, b, c = share * (middle + radius - a), -share * b, share * (middle + radius - c)
        else:
            continue
        band[d * i, 0] += a
        band[d * i + 1, 1] += b
        band[d * i + 1, 0] += c


@compiled
def direct(
    mu: float,
    fraction: float,
    curvature: Array,
    free: BoolArray,
    point: Point,
    dx: Array,
    change: Array,
    new: Array,
) -> tuple[bool, float, float]:
    """Find the step from a point by the condensed system, without negative curvature if it else may ascend.

    Return whether there is one, the longest step, and the derivative of the barrier objective along it.

    Parameters
    ----------
    fraction : of its room that a value may use
    curvature : (n, d, d), second derivatives of the weighted quantities of each location
    free : (n d,), see `solve_band`
    dx, change, new : (n d,), (3, p) and (r,), steps of unknowns, of parts with duals, and of multipliers;
        filled in
    """
    d, count, width = point.d, len(dx), point.gradient.shape[1]
    band, right = np.empty((count, width)), np.empty(count)
    for i in range(count):
        right[i] = 0.0
        for e in range(width):
            band[i, e] = 0.0
    for i in range(len(curvature)):
        for e in range(d):
            for f in range(e + 1):
                band[i * d + e, e - f] = curvature[i, e, f]
    soft, answer = np.empty((2, point.parts.shape[1])), np.empty((2, len(new)))
    assemble(mu, point, soft, answer, band, right)
    found = solve_band(band, right, free, 0.0, dx)
    shift = FIRST_SHIFT
    if not found:
        mirror(curvature, d, band)
    while not found and shift < MOST_SHIFT:
        found = solve_band(band, right, free, shift, dx)
        shift *= GROWTH
    for i in range(count):
        found = found and math.isfinite(dx[i])
    if not found:
        return False, 0.0, 0.0
    gain = recover(mu, point, soft, answer, dx, change, new)
    return True, longest_step(fraction, point, change), gain


@compiled
def errors(mu: float, point: Point, pull: Array) -> tuple[float, float, float, float]:
    """Measure the distance of a point from the optimum for a barrier parameter.

    Returns the largest error of the Lagrangian's gradient by unknowns and parts, of the equations and of
    complementarity, and the mean size of multipliers and duals; `pull`, (n d,), is that gradient by the
    unknowns.
    """
    square, begin, parts, state = point.square, point.begin, point.parts, point.state
    multiplier, value, gradient = point.multiplier, point.value, point.gradient
    dual, primal, apart, size, count = 0.0, 0.0, 0.0, 0.0, 0
    pull[:] = 0.0
    for j in range(len(square)):
        force = multiplier[j] + 2.0 * square[j] * value[j]
        for e in range(gradient.shape[1]):
            if gradient[j, e] != 0.0:
                pull[point.first[j] * point.d + e] += force * gradient[j, e]
        if begin[j] == begin[j + 1]:
            continue
        rest, weight = value[j], 1.0
        size += abs(multiplier[j])
        count += 1
        for p in range(begin[j], begin[j + 1]):
            low, high, v, zl, zh = parts[2, p], parts[3, p], state[0, p], state[1, p], state[2, p]
            rest -= parts[0, p] * v
            if low == high:
                continue
            if parts[1, p] > 0.0:
                weight = PRICED
            dual = max(dual, abs(parts[1, p] - zl + zh - parts[0, p] * multiplier[j]))
            if low > -np.inf:
                apart = max(apart, abs(zl * (v - low) - mu))
            if high < np.inf:
                apart = max(apart, abs(zh * (high - v) - mu))
            size += zl + zh
            count += 2
        primal = max(primal, weight * abs(rest))
    for i in range(len(pull)):
        dual = max(dual, abs(pull[i]))
    return dual, primal, apart, size / max(count, 1)
