"""Highest speeds along a path within all bounds, compiled.

The unknown is ``x = u̇²``, the squared speed of the station u along the path; its slope is twice ``w = ü``.
Axis a runs at ``q'ₐ u̇`` and accelerates at ``q'ₐ w + q''ₐ x``, which is linear in (w, x), so each interval of
the path needs only two-variable linear programs (TOPP-RA). Here w is constant in an interval, so x is linear,
and so is q', as the path consists of straight lines and parabolas. The acceleration is then linear too, and
bounds that hold at both ends of an interval hold within it.

References
----------
Pham & Pham (2018), A new approach to time-optimal path parameterization based on reachability analysis, IEEE
Transactions on Robotics 34(3), 645-659.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray

# Most steps of Newton's method on a convex, piecewise linear function; it takes two or three.
MOST_STEPS = 50
# Slopes below this share of the change of q' in a corner are 0: A / g would exceed the precision of w.
NO_SLOPE = 1e-9


@compiled
def highest_speeds(
    directions: Array,
    before: IntArray,
    blend: Array,
    bend: Array,
    length: Array,
    ceiling: Array,
    acceleration: Array,
) -> Array:
    """Find the highest squared speeds at the nodes of a path from rest to rest.

    A backward pass finds the highest speeds from which the rest of the path can be run within bounds; all
    lower speeds are possible too. A forward pass accelerates as much as these allow.

    Parameters
    ----------
    directions : (m, k), per mm, q' on the straight sides of the path
    before : (s,), the side on which, or after which, each interval lies
    blend : (s,), share of the change from that side's q' to the next one's at the interval's start, 0 … 1
    bend : (s,), 1/mm, rate of that change; 0 on a straight side
    length : (s,), mm
    ceiling : (s + 1,), (mm/s)², bound at the nodes by feed, axis speeds and stops
    acceleration : (k,), mm/s² and rad/s²; infinite for no bound

    Returns
    -------
    (s + 1,), (mm/s)²
    """
    n = len(length)
    reached = ceiling.copy()
    last = len(directions) - 1
    for i in range(n - 1, -1, -1):
        first, second = directions[before[i]], directions[min(before[i] + 1, last)]
        if bend[i] == 0.0:
            within = reached[i + 1] + 2.0 * _along_side(first, acceleration) * length[i]
            reached[i] = min(reached[i], within)
        else:
            reached[i] = _controllable(
                first, second, blend[i], bend[i], length[i], acceleration, reached[i], reached[i + 1]
            )
    for i in range(n):
        first, second = directions[before[i]], directions[min(before[i] + 1, last)]
        if bend[i] == 0.0:
            most = _along_side(first, acceleration)
        else:
            _, _, most, _ = _range_at(
                reached[i], first, second, blend[i], bend[i], length[i], acceleration, reached[i + 1]
            )
        reached[i + 1] = min(reached[i + 1], max(reached[i] + 2.0 * most * length[i], 0.0))
    return reached


@compiled
def _along_side(direction: Array, acceleration: Array) -> float:
    """Return the highest acceleration along a straight side."""
    most = np.inf
    for a in range(len(direction)):
        if direction[a] != 0.0:
            most = min(most, acceleration[a] / abs(direction[a]))
    return most


@compiled
def _controllable(
    first: Array,
    second: Array,
    blend: float,
    bend: float,
    length: float,
    acceleration: Array,
    ceiling: float,
    following: float,
) -> float:
    """Find the highest x at an interval's start from which some w leads to at most `following` at its end.

    The lower end of the range of w is convex in x, the upper one concave, and at x = 0 the range contains 0.
    Newton's method from the right therefore ends exactly at the highest x at which they meet.
    """
    x = ceiling
    for a in range(len(first)):
        # Where an axis reverses, its acceleration depends on x alone.
        f = bend * (second[a] - first[a])
        start = first[a] + blend * (second[a] - first[a])
        none = NO_SLOPE * abs(second[a] - first[a])
        if f != 0.0 and (abs(start) <= none or abs(start + 3.0 * length * f) <= none):
            x = min(x, acceleration[a] / abs(f))
    for _ in range(MOST_STEPS):
        low, low_slope, high, high_slope = _range_at(
            x, first, second, blend, bend, length, acceleration, following
        )
        # Slopes are equal up to rounding only where the bounds hold anyway.
        if low <= high or not low_slope > high_slope:
            break
        x -= (low - high) / (low_slope - high_slope)
    return max(x, 0.0)


@compiled
def _range_at(
    x: float,
    first: Array,
    second: Array,
    blend: float,
    bend: float,
    length: float,
    acceleration: Array,
    following: float,
) -> tuple[float, float, float, float]:
    """Compute the range of w at squared speed x, and the derivatives of its ends with respect to x.

    At the start an axis accelerates at ``g w + f x`` with ``g = q'``, ``f = q''``. At the end of the interval
    of length h, ``q' + h q''`` and ``x + 2 h w`` replace q' and x, so ``g = q' + 3 h q''``.
    """
    low, low_slope = -x / (2.0 * length), -0.5 / length
    high, high_slope = (following - x) / (2.0 * length), -0.5 / length
    for a in range(len(first)):
        if acceleration[a] == np.inf:
            continue
        f = bend * (second[a] - first[a])
        start = first[a] + blend * (second[a] - first[a])
        none = NO_SLOPE * abs(second[a] - first[a])
        for g in (start, start + 3.0 * length * f):
            if abs(g) <= none:
                continue
            # g w + f x ≤ A and ≥ −A; for g < 0 the two are exchanged.
            bound = acceleration[a] / abs(g)
            slope = -f / g
            if slope * x - bound > low:
                low, low_slope = slope * x - bound, slope
            if slope * x + bound < high:
                high, high_slope = slope * x + bound, slope
    return low, low_slope, high, high_slope
