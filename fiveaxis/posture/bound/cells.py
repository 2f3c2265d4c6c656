"""Cells of the plane of both rotary angles, and where a location's postures may be in them.

Every linear axis is ``M(ρ)·tip + c(ρ)``, and the tip is the pivot less a vector along the tool. M and c
depend on the machine alone, so they are enclosed once for all locations.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fiveaxis.base import Array, Enclosure, IntArray, Interval, compiled
from fiveaxis.model import (
    TURN,
    Cosines,
    Machine,
    TiltBounds,
    Toolpath,
    Zone,
    add,
    cosines_of,
    cross,
    dot,
    linear_directions,
    scale,
    tool_axis,
    tool_tip,
)

# mm, stands for "no bound" in arithmetic: far beyond any machine.
HUGE = 1e9
# Cells that are cut at once, so that they stay in the processor's cache.
BLOCK = 16_384
# To cover rounding: share of a cell that it may add to an axis's width; enclosures are widened by mm and as a
# share, and cosines.
SLACK, ROUNDING = 1e-9, 1e-7


class Side(NamedTuple):
    """The cells of one rotary axis, a step wide from `low` on, rad; they wrap for more than a turn."""

    low: float
    step: float
    parts: int
    wraps: bool


class AngleCells(NamedTuple):
    """Cells of both rotary angles; arrays run over all of them, the second angle fastest.

    Parameters
    ----------
    sides : of the two rotary axes, chain order
    axis, swing : (c, 3), unit vectors, the tool axis in the middle of the cell; (c,), rad, its largest angle
        to that in the cell
    matrix, shift : (c, 3, 3), M, and (c, 3), mm, c in the middle, in the order of `machine.linear_columns`
    slope_middle, slope_radius : (c, 3, 2, 4), 1/rad (first three) and mm/rad (last): range of the derivatives
        of M and c by each angle over the cell
    """

    sides: tuple[Side, Side]
    axis: Array
    swing: Array
    matrix: Array
    shift: Array
    slope_middle: Array
    slope_radius: Array


def cut_cells(machine: Machine, zone: Zone, step: float, multiple: int = 1) -> AngleCells:
    """Cut the plane of the rotary angles of a five-axis machine into cells of at most a width, rad.

    An axis of more than a turn is cut into whole parts of a turn, every axis into a multiple of `multiple`
    parts; the zone has the height of the pivot.
    """
    sides = _side(machine, 0, step, multiple), _side(machine, 1, step, multiple)
    rows = np.array_split(np.arange(sides[0].parts), -(-sides[0].parts * sides[1].parts // BLOCK))
    blocks = [_cut(machine, zone, sides, block) for block in rows]
    return AngleCells(sides, *(np.concatenate(parts) for parts in zip(*blocks, strict=True)))


def _cut(machine: Machine, zone: Zone, sides: tuple[Side, Side], rows: IntArray) -> tuple[Array, ...]:
    """Enclose the machine's equations in the cells of some rows of the first angle; see `AngleCells`."""
    grid = np.meshgrid(rows, np.arange(sides[1].parts), indexing="ij")
    angles, ranged = {}, {}
    for i, (letter, side) in enumerate(zip(machine.rotaries, sides, strict=True)):
        angles[letter] = angle = np.asarray(side.low + side.step * (grid[i].ravel() + 0.5), dtype=float)
        box = Interval(angle - 0.5 * side.step, angle + 0.5 * side.step)
        ranged[letter] = Enclosure.cosine_and_sine(box, i, 2)
    middle, count = cosines_of(angles, np), grid[0].size
    axis = np.stack(np.broadcast_arrays(*tool_axis(machine.chain, middle)), axis=-1)
    values = np.array([[np.broadcast_to(v, count) for v in row] for row in _affine(machine, zone, middle)])
    # Where the linear directions may lie in one plane, enclosures are infinite and their products NaN.
    with np.errstate(invalid="ignore", over="ignore"):
        slopes = np.array([[_slopes(v, count) for v in row] for row in _affine(machine, zone, ranged)])
    arrays = values[:, :3].transpose(2, 0, 1), values[:, 3].T, *slopes.transpose(2, 4, 0, 3, 1)
    return axis, _swing(machine, axis, sides), *(np.ascontiguousarray(array) for array in arrays)


def _side(machine: Machine, rotary: int, step: float, multiple: int) -> Side:
    limits = machine.axes[machine.rotary_columns[rotary]].limits
    wraps = limits.span > TURN
    low, width = (0.0, TURN) if wraps else (limits.low, limits.span)
    count = multiple * max(1, math.ceil(width / step / multiple - SLACK))
    return Side(low, width / count, count, wraps)


def _affine(machine: Machine, zone: Zone, cosines: Cosines) -> list[list[Any]]:
    """Compute M and c side by side, a row for each linear axis, by Cramer's rule.

    The axis values solve ``Σ s_l D_l = tip − r_0``, ``tip = pivot − b·o``: M is the inverse of the directions
    D, and ``c = −M (r_0 + b·o)``.
    """
    chain = machine.chain
    (a, u), (b, v), (c, w) = linear_directions(chain, cosines).items()
    across = {a: cross(v, w), b: cross(w, u), c: cross(u, v)}
    volume = dot(u, across[a])
    away = add(tool_tip(chain, cosines, {}), scale(float(zone.height), tool_axis(chain, cosines)))
    rows = []
    for column in machine.linear_columns:
        x, y, z = (component / volume for component in across[machine.letters[column]])
        rows.append([x, y, z, -dot((x, y, z), away)])
    return rows


def _slopes(entry: Enclosure | float, count: int) -> Array:
    """Compute middle and radius of an entry's slopes by each angle, (2, 2, c); 0 for a constant."""
    slopes = entry.slopes if isinstance(entry, Enclosure) else Interval.of(0.0)
    middle = np.nan_to_num(slopes.middle, posinf=0.0, neginf=0.0)
    radius = np.nan_to_num(slopes.radius, nan=HUGE, posinf=HUGE, neginf=HUGE)
    return np.stack([np.broadcast_to(part, (2, count)) for part in (middle, radius)])


def _swing(machine: Machine, axis: Array, sides: tuple[Side, Side]) -> Array:
    """Bound the angle of the tool axis from its direction in the middle of a cell, (c,) rad.

    It moves by the turn times the sine of its angle to an axis; the second one changes that for the first.
    """
    first, second = (np.array(j.line.direction) for j in machine.chain.joints if j.is_rotary)
    half = [0.5 * side.step for side in sides]
    own = half[1] * float(np.linalg.norm(np.cross(second, machine.chain.tool_home[:3, 2]), axis=-1))
    outer = np.linalg.norm(np.cross(first, axis), axis=1)
    return np.minimum(own + half[0] * np.minimum(outer + own, 1.0), np.pi)


# The cells, (m,), ascending, that may hold an admissible posture of a location, and the ranges of the linear
# axes there, within their limits: low and high, (m, 3) mm.
Enclosed = tuple[IntArray, Array, Array]


class Window(NamedTuple):
    """What all locations have in common.

    Parameters
    ----------
    least, most : (b, c), cosines in the middle of cells for which postures in them may keep each bound
    low, high : (3,), mm, limits of the linear axes
    half, offset : (2,), rad, half the width of a cell; mm, of the pivot beside the tool axis
    """

    least: Array
    most: Array
    low: Array
    high: Array
    half: Array
    offset: float

    @classmethod
    def of(cls, cells: AngleCells, tilt: TiltBounds, machine: Machine, offset: float) -> Window:
        """Widen the bounds on the lean by the swing of each cell, and the machine's limits by rounding."""
        linear = machine.linear_columns
        return cls(
            least=np.stack([np.cos(np.minimum(b.high + cells.swing, np.pi)) - ROUNDING for b in tilt.all]),
            most=np.stack([np.cos(np.maximum(b.low - cells.swing, 0.0)) + ROUNDING for b in tilt.all]),
            low=np.maximum(machine.low[linear], -HUGE) - ROUNDING,
            high=np.minimum(machine.high[linear], HUGE) + ROUNDING,
            half=np.array([0.5 * side.step for side in cells.sides]),
            offset=float(offset),
        )


def enclose(cells: AngleCells, window: Window, toolpath: Toolpath, tilt: TiltBounds) -> list[Enclosed]:
    """Enclose the admissible postures of some locations, of each in its own cells."""
    references = np.stack([b.reference for b in tilt.all], axis=1)
    rows = zip(toolpath.pivot, np.nan_to_num(toolpath.normal), references, strict=True)
    return [_enclose(cells, window, *row) for row in rows]


@compiled
def _enclose(cells: AngleCells, window: Window, pivot: Array, normal: Array, reference: Array) -> Enclosed:
    """Enclose the admissible postures of a location."""
    # By name: numba counts references to an array that it takes out of a record.
    _, axis, swing, matrix, shift, slope_middle, slope_radius = cells
    kept, near = 0, _admitted(axis, window, reference)
    low, high = np.empty((len(near), 3)), np.empty((len(near), 3))
    for c in near:
        for k in range(3):
            row, slope, spread = matrix[c, k], slope_middle[c, k], slope_radius[c, k]
            middle, reach = _linear_range(row, shift[c, k], slope, spread, pivot, window.half)
            if window.offset != 0.0:
                beside, spreading = _offset_range(axis[c], swing[c], row, slope, spread, normal, window)
                middle, reach = middle + beside, reach + spreading
            reach = reach * (1.0 + ROUNDING) + ROUNDING
            least, most = middle - reach, middle + reach
            # NaN, where linear directions may lie in one plane, excludes nothing.
            least = -HUGE if np.isnan(least) else least
            most = HUGE if np.isnan(most) else most
            if most < window.low[k] or least > window.high[k]:
                break
            low[kept, k], high[kept, k] = max(least, window.low[k]), min(most, window.high[k])
        else:
            near[kept] = c
            kept += 1
    return near[:kept].copy(), low[:kept].copy(), high[:kept].copy()


@compiled
def _admitted(axis: Array, window: Window, reference: Array) -> IntArray:
    """Find the cells that may keep the bounds on the lean; a reference of NaN binds nothing."""
    found, count = np.empty(len(axis), np.int64), 0
    for c in range(len(axis)):
        x, y, z = axis[c, 0], axis[c, 1], axis[c, 2]
        for b in range(len(reference)):
            cosine = x * reference[b, 0] + y * reference[b, 1] + z * reference[b, 2]
            if cosine < window.least[b, c] or cosine > window.most[b, c]:
                break
        else:
            found[count] = c
            count += 1
    return found[:count]


@compiled
def _linear_range(
    row: Array, shift: float, slope_middle: Array, slope_radius: Array, pivot: Array, half: Array
) -> tuple[float, float]:
    """Enclose a linear axis over a cell by the mean value form: the middle and the radius about it, mm."""
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
    window: Window,
) -> tuple[float, float]:
    """Enclose an axis's share ``M·a·e`` of an offset a beside the tool axis: middle and radius, mm."""
    cosine, along, own, size = 0.0, 0.0, 0.0, 0.0
    for j in range(3):
        cosine += axis[j] * normal[j]
        along += row[j] * normal[j]
        own += row[j] * axis[j]
        size += row[j] ** 2
    length = np.sqrt(max(1.0 - cosine**2, 0.0))
    least = np.sin(max(math.asin(min(length, 1.0)) - swing, 0.0))
    # Over a cell e turns by at most the swing over the sine of the lean.
    turned = 2.0 if 2.0 * least <= swing else swing / least
    steepest = 0.0
    for a in range(2):
        lever = 0.0
        for j in range(3):
            lever += (abs(slope_middle[a, j]) + slope_radius[a, j]) ** 2
        steepest += window.half[a] * np.sqrt(lever)
    middle = window.offset / length * (along - cosine * own) if length > 0.0 else 0.0
    return middle, abs(window.offset) * (steepest + turned * (np.sqrt(size) + steepest))
