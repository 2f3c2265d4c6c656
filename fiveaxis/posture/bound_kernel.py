"""Inner loops of the lower bound, compiled.

The least cost of visiting sets in order is found on the edges of cells alone: for one choice of cells the
problem is linear with a totally unimodular matrix and bounds on edges, so an optimum lies on edges.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fiveaxis.geometry import Array, BoolArray, IntArray

# What is enclosed is widened by this to cover rounding, mm and as a share.
ROUNDING = 1e-9


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def least_travel(first: IntArray, last: IntArray, plus: Array, minus: Array) -> float:
    """Find the least cost of a number that visits ranges of places in order.

    Parameters
    ----------
    first, last : (m,), the places from … to that each visit allows
    plus, minus : (m − 1,), J per place upwards and downwards
    """
    cost = np.zeros(last.max() + 1)
    for i in range(len(first)):
        if i:
            _spread(cost, plus[i - 1], minus[i - 1], False)
        cost[: first[i]] = np.inf
        cost[last[i] + 1 :] = np.inf
    return float(cost.min())


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _spread(cost: Array, plus: float, minus: float, wraps: bool) -> None:
    """Let every place be reached from every other, in steps up at `plus` and down at `minus`."""
    n = len(cost)
    # Around a circle the second time sees what came in over the end.
    for _ in range(2 if wraps else 1):
        if wraps:
            cost[0] = min(cost[0], cost[n - 1] + plus)
        for j in range(1, n):
            cost[j] = min(cost[j], cost[j - 1] + plus)
        if wraps:
            cost[n - 1] = min(cost[n - 1], cost[0] + minus)
        for j in range(n - 2, -1, -1):
            cost[j] = min(cost[j], cost[j + 1] + minus)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def visit_cells(
    axis: Array,
    swing: Array,
    matrix: Array,
    shift: Array,
    slope_middle: Array,
    slope_radius: Array,
    half: Array,
    counts: tuple[int, int],
    wraps: tuple[bool, bool],
    pivot: Array,
    normal: Array,
    offset: float,
    reference: Array,
    least_cosine: Array,
    most_cosine: Array,
    limit_low: Array,
    limit_high: Array,
    plus: Array,
    minus: Array,
) -> tuple[float, Array, Array]:
    """Find the cells that may be admissible at each location, and the least rotary travel through them.

    Parameters
    ----------
    axis … slope_radius : of the cells, as in `Cells`
    half : (2,), rad, half the cells' widths
    counts, wraps : of the cells' sides
    pivot, normal : (m, 3), mm and unit vectors, zero where unknown
    offset : mm, of the pivot from the tool axis
    reference : (b, m, 3), unit vectors, NaN where a bound binds nothing
    least_cosine, most_cosine : (b, c), between which the cosine in the middle of the cell has to lie
    limit_low, limit_high : (3,), mm, of the linear axes
    plus, minus : (m − 1, 2), J per cell

    Returns
    -------
    The least rotary travel, J, and the range of each linear axis, (m, 3) mm each, endless where nothing binds
    """
    n1, n2 = counts
    cost = np.zeros((n1 if wraps[0] else n1 + 1, n2 if wraps[1] else n2 + 1))
    low = np.full((len(pivot), 3), np.inf)
    high = np.full((len(pivot), 3), -np.inf)
    value, reach = np.empty(3), np.empty(3)
    for i in range(len(pivot)):
        if i:
            for j in range(cost.shape[1]):
                _spread(cost[:, j], plus[i - 1, 0], minus[i - 1, 0], wraps[0])
            for j in range(cost.shape[0]):
                _spread(cost[j], plus[i - 1, 1], minus[i - 1, 1], wraps[1])
        binding = np.isfinite(reference[:, i, 0])
        if not binding.any():
            low[i], high[i] = -np.inf, np.inf
            continue
        touched = np.zeros(cost.shape, dtype=np.bool_)
        for c in range(len(axis)):
            if not _may_lean(axis[c], reference[:, i], binding, least_cosine[:, c], most_cosine[:, c]):
                continue
            _enclose(
                axis[c], swing[c], matrix[c], shift[c], slope_middle[c], slope_radius[c], half, pivot[i],
                normal[i], offset, value, reach,
            )  # fmt: skip
            if not _may_reach(value, reach, limit_low, limit_high):
                continue
            for a in range(3):
                low[i, a] = min(low[i, a], max(value[a] - reach[a], limit_low[a]))
                high[i, a] = max(high[i, a], min(value[a] + reach[a], limit_high[a]))
            p, q = c // n2, c % n2
            after_p, after_q = (p + 1) % cost.shape[0], (q + 1) % cost.shape[1]
            touched[p, q] = touched[after_p, q] = touched[p, after_q] = touched[after_p, after_q] = True
        _keep(cost, touched)
    return cost.min(), low, high


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _may_lean(axis: Array, reference: Array, binding: BoolArray, least: Array, most: Array) -> bool:
    for b in range(len(reference)):
        if binding[b]:
            cosine = axis[0] * reference[b, 0] + axis[1] * reference[b, 1] + axis[2] * reference[b, 2]
            if cosine < least[b] or cosine > most[b]:
                return False
    return True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _may_reach(value: Array, reach: Array, limit_low: Array, limit_high: Array) -> bool:
    for a in range(3):
        if value[a] + reach[a] < limit_low[a] or value[a] - reach[a] > limit_high[a]:
            return False
    return True


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _enclose(
    axis: Array,
    swing: float,
    matrix: Array,
    shift: Array,
    slope_middle: Array,
    slope_radius: Array,
    half: Array,
    pivot: Array,
    normal: Array,
    offset: float,
    value: Array,
    reach: Array,
) -> None:
    """Enclose the linear axes over a cell: fill in `value` in the middle and `reach` about it, (3,) mm.

    Mean value form: the largest slope by each angle, times half the width. The part of a tip beside the tool
    axis, ``a·e``, comes with `_add_offset`.
    """
    for a in range(3):
        value[a], reach[a] = shift[a], 0.0
        for j in range(3):
            value[a] += matrix[a, j] * pivot[j]
        for k in range(2):
            slope, spread = slope_middle[a, k, 3], slope_radius[a, k, 3]
            for j in range(3):
                slope += slope_middle[a, k, j] * pivot[j]
                spread += slope_radius[a, k, j] * abs(pivot[j])
            reach[a] += half[k] * (abs(slope) + spread)
    if offset != 0.0:
        _add_offset(axis, swing, matrix, slope_middle, slope_radius, half, normal, offset, value, reach)
    for a in range(3):
        reach[a] = reach[a] * (1.0 + ROUNDING) + ROUNDING


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _add_offset(
    axis: Array,
    swing: float,
    matrix: Array,
    slope_middle: Array,
    slope_radius: Array,
    half: Array,
    normal: Array,
    offset: float,
    value: Array,
    reach: Array,
) -> None:
    """Add ``M·a·e``: over a cell e turns by no more than the swing over the sine of the lean."""
    cosine = axis[0] * normal[0] + axis[1] * normal[1] + axis[2] * normal[2]
    length = np.sqrt(max(1.0 - cosine * cosine, 0.0))
    least = np.sin(max(np.arcsin(min(length, 1.0)) - swing, 0.0))
    turned = 2.0 if 2.0 * least <= swing else swing / least
    for a in range(3):
        size = steepest = 0.0
        for j in range(3):
            size += matrix[a, j] ** 2
            if length > 0.0:
                value[a] += matrix[a, j] * offset / length * (normal[j] - cosine * axis[j])
        for k in range(2):
            lever = 0.0
            for j in range(3):
                lever += (abs(slope_middle[a, k, j]) + slope_radius[a, k, j]) ** 2
            steepest += half[k] * np.sqrt(lever)
        reach[a] += abs(offset) * (steepest + turned * (np.sqrt(size) + steepest))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _keep(cost: Array, touched: BoolArray) -> None:
    for p in range(cost.shape[0]):
        for q in range(cost.shape[1]):
            if not touched[p, q]:
                cost[p, q] = np.inf
