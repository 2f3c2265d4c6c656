"""Where a location's postures may be: cells of the rotary angles, and the linear axes' ranges in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.machine import Machine
from fiveaxis.posture.bound.cells import HUGE, Cells
from fiveaxis.toolpath import TiltBounds, Toolpath

# Enclosures are widened by this to cover rounding: mm and as a share, and cosines.
ROUNDING = 1e-7


@dataclass(frozen=True, eq=False)
class Enclosed:
    """Where the postures of one location may be.

    Parameters
    ----------
    may : (c,), cells that may hold an admissible posture
    low, high : (c, 3), mm, ranges of the linear axes there, within their limits
    """

    may: BoolArray
    low: Array
    high: Array


def enclose(cells: Cells, toolpath: Toolpath, tilt: TiltBounds, machine: Machine) -> list[Enclosed]:
    """Enclose the admissible postures of some locations.

    Parameters
    ----------
    cells : of the machine and the path's zone
    toolpath, tilt : of the locations
    machine : its limits

    Returns
    -------
    The cells of each location; none where no posture is admissible
    """
    linear = machine.linear_columns
    low = np.maximum(machine.low[linear], -HUGE) - ROUNDING
    high = np.minimum(machine.high[linear], HUGE) + ROUNDING
    may = _keep_lean(cells, tilt.all)
    # Cells that break the bounds at all of these locations needn't be enclosed.
    near = np.flatnonzero(may.any(axis=1))
    value, reach = _linear_ranges(cells.at(near), toolpath)
    # NaN, where linear directions may lie in one plane, excludes nothing.
    least = np.nan_to_num(value - reach, nan=-HUGE, neginf=-HUGE, posinf=HUGE)
    most = np.nan_to_num(value + reach, nan=HUGE, neginf=-HUGE, posinf=HUGE)
    found = []
    for k in range(len(toolpath)):
        own = may[:, k].copy()
        own[near] &= ~((most[:, :, k] < low) | (least[:, :, k] > high)).any(axis=1)
        ranges = np.zeros((2, len(own), 3))
        ranges[0, near] = np.maximum(least[:, :, k], low)
        ranges[1, near] = np.minimum(most[:, :, k], high)
        found.append(Enclosed(own, ranges[0], ranges[1]))
    return found


def _keep_lean(cells: Cells, bounds: Sequence[TiltBounds]) -> BoolArray:
    """Check which cells may keep the bounds on the lean, (c, m)."""
    may = np.ones((len(cells.axis), len(bounds[0].reference)), dtype=bool)
    for bound in bounds:
        # Cosines in the middle of cells for which postures in them may keep the bound.
        least = np.cos(np.minimum(bound.high + cells.swing, np.pi)) - ROUNDING
        most = np.cos(np.maximum(bound.low - cells.swing, 0.0)) + ROUNDING
        cosine = cells.axis @ bound.reference.T
        # NaN, where nothing binds, is admissible.
        may &= ~((cosine < least[:, None]) | (cosine > most[:, None]))
    return may


def _linear_ranges(cells: Cells, toolpath: Toolpath) -> tuple[Array, Array]:
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
