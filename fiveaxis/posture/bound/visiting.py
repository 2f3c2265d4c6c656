"""The least cost of visiting sets in order: the core of the lower bound.

For sets of cells it is found on the edges of cells alone: for one choice of cells the problem is linear with
a totally unimodular matrix and bounds on edges, so an optimum lies on edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.bound.cells import Cells
from fiveaxis.toolpath import TiltBounds, Toolpath

# Enclosures are widened by this to cover rounding, in mm and as a share.
ROUNDING = 1e-9
# Locations processed at once: their cells stay in the processor's cache.
CHUNK = 8


def least_travel(first: IntArray, last: IntArray, plus: Array, minus: Array) -> float:
    """Find the least cost of an integer that visits ranges in order, from `first` to `last`, (m,) each.

    Moves between visits, (m − 1,), cost `plus` and `minus` J per step up and down.
    """
    cost = np.zeros(last.max() + 1)
    for i in range(len(first)):
        if i:
            cost = spread(cost, plus[i - 1], minus[i - 1], wraps=False)
        cost[: first[i]] = np.inf
        cost[last[i] + 1 :] = np.inf
    return float(cost.min())


def spread(cost: Array, plus: float, minus: float, *, wraps: bool) -> Array:
    """Compute the least cost of reaching every index of the first dimension from any other.

    Parameters
    ----------
    cost : (n, …), J, infinite where forbidden
    plus, minus : J per step up and down
    wraps : whether the last index is next to the first

    Returns
    -------
    (n, …), ``min over i of cost_i + plus·(j − i)⁺ + minus·(i − j)⁺``
    """
    index = np.arange(len(cost), dtype=float).reshape(-1, *[1] * (cost.ndim - 1))
    up, down = plus * index, minus * index
    upwards = np.minimum.accumulate(cost - up) + up
    downwards = np.minimum.accumulate((cost + down)[::-1])[::-1] - down
    least = np.minimum(upwards, downwards)
    if wraps:
        # Across the end, upwards from the last index and downwards from the first.
        np.minimum(least, upwards[-1] + plus + up, out=least)
        np.minimum(least, downwards[0] + minus + down[::-1], out=least)
    return least


def visit_cells(
    cells: Cells,
    toolpath: Toolpath,
    bounds: Sequence[TiltBounds],
    cosines: tuple[Array, Array],
    limits: tuple[Array, Array],
    plus: Array,
    minus: Array,
) -> tuple[float, Array, Array]:
    """Find the cells that may be admissible at each location, and the least rotary travel through them.

    Parameters
    ----------
    toolpath, bounds : of m locations
    cosines : (b, c) each, smallest and largest admissible cosine in the middle of a cell
    limits : (3,) mm each, of the linear axes
    plus, minus : (m − 1, 2), J per cell

    Returns
    -------
    The least rotary travel, J, and the ends of each linear axis's range, (m, 3) mm each, infinite where
    nothing binds
    """
    shape = tuple(side.parts if side.wraps else side.parts + 1 for side in cells.sides)
    low, high = np.full((len(toolpath), 3), -np.inf), np.full((len(toolpath), 3), np.inf)
    cost = np.zeros(shape)
    for rows in np.array_split(np.arange(len(toolpath)), -(-len(toolpath) // CHUNK)):
        here = [bound.at(rows) for bound in bounds]
        may = _keep_lean(cells, here, cosines)
        # Cells that break the bounds at all of these locations needn't be enclosed.
        near = np.flatnonzero(may.any(axis=1))
        value, reach = _enclose(cells.at(near), toolpath.at(rows))
        # NaN, where linear directions may lie in one plane, excludes nothing.
        beyond = (value + reach < limits[0][:, None]) | (value - reach > limits[1][:, None])
        may[near] &= ~beyond.any(axis=1)
        inside = may[near][:, None]
        binds = np.any([np.isfinite(b.reference[:, 0]) for b in here], axis=0)
        least = np.where(inside, np.maximum(value - reach, limits[0][:, None]), np.inf)
        most = np.where(inside, np.minimum(value + reach, limits[1][:, None]), -np.inf)
        low[rows[binds]] = least.min(axis=0, initial=np.inf)[:, binds].T
        high[rows[binds]] = most.max(axis=0, initial=-np.inf)[:, binds].T
        edges = list(_edges(may, cells, shape))
        for k, i in enumerate(rows):
            if i:
                cost = spread(cost, plus[i - 1, 0], minus[i - 1, 0], wraps=cells.sides[0].wraps)
                cost = spread(cost.T, plus[i - 1, 1], minus[i - 1, 1], wraps=cells.sides[1].wraps).T
            if binds[k]:
                cost = np.where(edges[k], cost, np.inf)
    return float(cost.min()), low, high


def _edges(may: BoolArray, cells: Cells, shape: tuple[int, ...]) -> Iterator[BoolArray]:
    """Mark for each location the corners of its cells, (c, m) to (p, q) each."""
    first, second = cells.sides
    for own in may.T.reshape(-1, first.parts, second.parts):
        touched = np.zeros(shape, dtype=bool)
        touched[: first.parts, : second.parts] = own
        # A cell's far edge is the near edge of the next one, around a circle too.
        touched |= np.roll(touched, 1, axis=0)
        touched |= np.roll(touched, 1, axis=1)
        yield touched


def _keep_lean(cells: Cells, bounds: Sequence[TiltBounds], cosines: tuple[Array, Array]) -> BoolArray:
    """Check which cells may keep the bounds on the lean, (c, m)."""
    may = np.ones((len(cells.axis), len(bounds[0].reference)), dtype=bool)
    for bound, least, most in zip(bounds, *cosines, strict=True):
        cosine = cells.axis @ bound.reference.T
        # NaN, where nothing binds, is admissible.
        may &= ~((cosine < least[:, None]) | (cosine > most[:, None]))
    return may


def _enclose(cells: Cells, toolpath: Toolpath) -> tuple[Array, Array]:
    """Enclose the linear axes over every cell: the middle and the radius about it, (c, 3, m) mm each.

    Mean value form: the largest slope by each angle, times half the width.
    """
    half = np.array([0.5 * side.step for side in cells.sides])
    point = np.vstack([toolpath.pivot.T, np.ones(len(toolpath))])
    value = _product(cells.matrix, toolpath.pivot.T) + cells.shift[:, :, None]
    slope = np.abs(_product(cells.slope_middle, point)) + _product(cells.slope_radius, np.abs(point))
    reach = half[0] * slope[:, :, 0] + half[1] * slope[:, :, 1]
    if toolpath.zone.offset != 0.0:
        beside, spreading = _enclose_offset(cells, half, np.nan_to_num(toolpath.normal), toolpath.zone.offset)
        value, reach = value + beside, reach + spreading
    return value, reach * (1.0 + ROUNDING) + ROUNDING


def _product(left: Array, right: Array) -> Array:
    """Multiply (…, j) by (j, m) as one matrix: many small products would take several times as long."""
    return (left.reshape(-1, left.shape[-1]) @ right).reshape(*left.shape[:-1], right.shape[-1])


def _enclose_offset(cells: Cells, half: Array, normal: Array, offset: float) -> tuple[Array, Array]:
    """Enclose ``M·a·e``, the share of an offset a beside the tool axis: middle and radius, (c, 3, m) mm each.

    Over a cell e turns by at most the swing over the sine of the lean.
    """
    cosine = cells.axis @ normal.T
    length = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    swing = cells.swing[:, None]
    least = np.sin(np.maximum(np.arcsin(np.minimum(length, 1.0)) - swing, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(2.0 * least <= swing, 2.0, swing / least)
        scale = np.where(length > 0.0, offset / length, 0.0)
    own = np.einsum("caj,cj->ca", cells.matrix, cells.axis)
    middle = scale[:, None] * (_product(cells.matrix, normal.T) - cosine[:, None] * own[:, :, None])
    lever = np.linalg.norm(np.abs(cells.slope_middle[..., :3]) + cells.slope_radius[..., :3], axis=-1)
    steepest = (lever @ half)[:, :, None]
    size = np.linalg.norm(cells.matrix, axis=-1)[:, :, None]
    return middle, abs(offset) * (steepest + turned[:, None] * (size + steepest))
