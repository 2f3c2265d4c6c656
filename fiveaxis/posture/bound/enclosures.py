"""Where a location's postures may be: cells of the rotary angles, and the linear axes' ranges in each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray
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
    cell : (m,), indices of the cells that may hold an admissible posture, ascending
    low, high : (m, 3), mm, ranges of the linear axes there, within their limits
    """

    cell: IntArray
    low: Array
    high: Array


class _Window(NamedTuple):
    """What all locations have in common.

    Parameters
    ----------
    least, most : (b, c), cosines in the middle of cells for which postures in them may keep each bound
    low, high : (3,), mm, limits of the linear axes
    half : (2,), rad, half the width of a cell
    offset : mm, of the pivot beside the tool axis
    """

    least: Array
    most: Array
    low: Array
    high: Array
    half: Array
    offset: float


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
    window = _Window(
        least=np.stack([np.cos(np.minimum(b.high + cells.swing, np.pi)) - ROUNDING for b in tilt.all]),
        most=np.stack([np.cos(np.maximum(b.low - cells.swing, 0.0)) + ROUNDING for b in tilt.all]),
        low=np.maximum(machine.low[linear], -HUGE) - ROUNDING,
        high=np.minimum(machine.high[linear], HUGE) + ROUNDING,
        half=np.array([0.5 * side.step for side in cells.sides]),
        offset=float(toolpath.zone.offset),
    )
    shape = (cells.axis, cells.swing, cells.matrix, cells.shift, cells.slope_middle, cells.slope_radius)
    references = np.stack([b.reference for b in tilt.all], axis=1)
    normals = np.nan_to_num(toolpath.normal)
    return [
        Enclosed(*_enclose(*shape, window, pivot, normal, reference))
        for pivot, normal, reference in zip(toolpath.pivot, normals, references, strict=True)
    ]


@compiled
def _enclose(
    axis: Array,
    swing: Array,
    matrix: Array,
    shift: Array,
    slope_middle: Array,
    slope_radius: Array,
    window: _Window,
    pivot: Array,
    normal: Array,
    reference: Array,
) -> tuple[IntArray, Array, Array]:
    """Enclose the admissible postures of a location; see `Cells` and `Enclosed`."""
    kept, near = 0, _admitted(axis, window, reference)
    low, high = np.empty((len(near), 3)), np.empty((len(near), 3))
    for c in near:
        inside = True
        for k in range(3):
            middle, reach = _linear_range(
                matrix[c, k], shift[c, k], slope_middle[c, k], slope_radius[c, k], pivot, window.half
            )
            if window.offset != 0.0:
                beside, spreading = _offset_range(
                    axis[c], swing[c], matrix[c, k], slope_middle[c, k], slope_radius[c, k], normal, window
                )
                middle, reach = middle + beside, reach + spreading
            reach = reach * (1.0 + ROUNDING) + ROUNDING
            least, most = middle - reach, middle + reach
            # NaN, where linear directions may lie in one plane, excludes nothing.
            least = -HUGE if np.isnan(least) else least
            most = HUGE if np.isnan(most) else most
            if most < window.low[k] or least > window.high[k]:
                inside = False
                break
            low[kept, k], high[kept, k] = max(least, window.low[k]), min(most, window.high[k])
        if inside:
            near[kept] = c
            kept += 1
    return near[:kept].copy(), low[:kept].copy(), high[:kept].copy()


@compiled
def _admitted(axis: Array, window: _Window, reference: Array) -> IntArray:
    """Find the cells that may keep the bounds on the lean; a reference of NaN binds nothing."""
    found, count = np.empty(len(axis), np.int64), 0
    for c in range(len(axis)):
        may = True
        for b in range(len(reference)):
            cosine = (
                axis[c, 0] * reference[b, 0] + axis[c, 1] * reference[b, 1] + axis[c, 2] * reference[b, 2]
            )
            if cosine < window.least[b, c] or cosine > window.most[b, c]:
                may = False
                break
        if may:
            found[count] = c
            count += 1
    return found[:count]


@compiled
def _linear_range(
    row: Array, shift: float, slope_middle: Array, slope_radius: Array, pivot: Array, half: Array
) -> tuple[float, float]:
    """Enclose a linear axis over a cell: the middle and the radius about it, mm.

    Mean value form: the largest slope by each angle, times half the width.
    """
    middle, reach = shift, 0.0
    for j in range(3):
        middle += row[j] * pivot[j]
    for a in range(2):
        slope, radius = slope_middle[a, 3], slope_radius[a, 3]
        for j in range(3):
            slope += slope_middle[a, j] * pivot[j]
            radius += slope_radius[a, j] * abs(pivot[j])
        reach += half[a] * (abs(slope) + radius)
    return middle, reach


@compiled
def _offset_range(
    axis: Array,
    swing: float,
    row: Array,
    slope_middle: Array,
    slope_radius: Array,
    normal: Array,
    window: _Window,
) -> tuple[float, float]:
    """Enclose an axis' share of an offset a beside the tool axis, ``M·a·e``: middle and radius, mm.

    Over a cell e turns by at most the swing over the sine of the lean.
    """
    cosine, along, own, size = 0.0, 0.0, 0.0, 0.0
    for j in range(3):
        cosine += axis[j] * normal[j]
        along += row[j] * normal[j]
        own += row[j] * axis[j]
        size += row[j] ** 2
    length = np.sqrt(max(1.0 - cosine**2, 0.0))
    least = np.sin(max(math.asin(min(length, 1.0)) - swing, 0.0))
    turned = 2.0 if 2.0 * least <= swing else swing / least
    steepest = 0.0
    for a in range(2):
        lever = 0.0
        for j in range(3):
            lever += (abs(slope_middle[a, j]) + slope_radius[a, j]) ** 2
        steepest += window.half[a] * np.sqrt(lever)
    middle = window.offset / length * (along - cosine * own) if length > 0.0 else 0.0
    return middle, abs(window.offset) * (steepest + turned * (np.sqrt(size) + steepest))
