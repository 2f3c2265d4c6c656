"""The tool's solids, grown by clearances or shrunk by tolerances, and what they must stay clear of.

Obstacles are triangles in the workpiece frame. In the tool's own frame a cylinder or cone is ``ρ ≤ a + b z``
between two heights, ρ being the distance from the tool axis. ``g = ρ − a − b z`` is convex, so over a
triangle clipped to those heights, which is a convex polygon, its minimum lies where the axis pierces the
polygon or on an edge, and there it has a closed form. The answer is exact, not sampled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.mesh import TriangleTree
from fiveaxis.mesh.kernels import STACK
from fiveaxis.threads import at_once
from fiveaxis.toolpath import Tool

# mm: segments of an outline lower than this are steps; the next segment has the same radius there.
LOWEST = 1e-9
# Fractions of a margin at which the space below and above a profile is divided; heights per segment at which
# its chord is compared with the exact profile.
CAP_STEPS = np.array([1.0, 0.75, 0.5, 0.25])
LIFTED = 17
# Tools per thread at once: enough for the work to outweigh the thread.
CHUNK = 2_000
# mm: a frustum and a triangle whose plane is farther away than this rounding are separate.
APART = 1e-6
# A triangle clipped to a slab has no more corners than this.
CORNERS = 8


@dataclass(frozen=True, eq=False)
class Solid:
    """A stack of cylinders and cones about the tool axis.

    Parameters
    ----------
    name : ``cutter``, ``shank`` or ``holder``
    frusta : (m, 4), mm: height above the tip and radius, of the lower and of the upper end
    """

    name: str
    frusta: Array

    @classmethod
    def of_outline(cls, name: str, outline: Array) -> Solid:
        """Build a solid from its outline, bottom up, (m, 2) mm: distance from the axis, height."""
        low, high = outline[:-1], outline[1:]
        frusta = np.column_stack([low[:, 1], low[:, 0], high[:, 1], high[:, 0]])
        return cls(name, frusta[frusta[:, 2] - frusta[:, 0] > LOWEST])

    def grown(self, margin: float) -> Solid:
        """Return the solid with its surface offset outwards by a margin, mm; inwards if it is negative.

        An outward offset covers every point nearer than the margin; its convex edges are sharp, not rounded.
        An inward offset also raises the lower end of the lowest segment and drops segments that vanish.
        """
        if margin == 0.0:
            return self
        return Solid(
            self.name, _widened(self.frusta, margin) if margin > 0.0 else _shrunk(self.frusta, -margin)
        )


def _widened(frusta: Array, margin: float) -> Array:
    """Offset the surface of a stack, (m, 4) mm, outwards."""
    if not len(frusta):
        return frusta
    z0, r0, z1, r1 = frusta.T
    slope = (r1 - r0) / (z1 - z0)
    joined = (np.abs(z1[:-1] - z0[1:]) <= LOWEST) & (np.abs(r1[:-1] - r0[1:]) <= LOWEST)
    # Where a profile steps or bends inwards, the two sides are offset separately.
    ends = np.flatnonzero(~(joined & (slope[1:] <= slope[:-1] + LOWEST))) + 1
    return np.concatenate([_merged(_convex_widened(run, margin)) for run in np.split(frusta, ends)])


def _convex_widened(frusta: Array, margin: float) -> Array:
    """Offset the surface of a convex stack, (m, 4) mm, outwards.

    The offset body lies inside every offset line of the profile and inside the largest radius plus the
    margin. That bound is concave, so its chords, the new segments, are raised to lie outside it.
    """
    z0, r0, z1, r1 = frusta.T
    slope = (r1 - r0) / (z1 - z0)
    wider = margin * np.hypot(1.0, slope)
    widest = max(r0.max(), r1.max()) + margin
    caps = z0[0] - margin * CAP_STEPS, z1[-1] + margin * CAP_STEPS
    knots = np.unique(np.concatenate([caps[0], z0, z1, caps[1]]))
    low, high = knots[:-1, None], knots[1:, None]
    height = low + (high - low) * np.linspace(0.0, 1.0, LIFTED)
    lines = (r0 + wider)[:, None, None] + slope[:, None, None] * (height - z0[:, None, None])
    bound = np.minimum(lines.min(axis=0), widest)
    chord = bound[:, :1] + (bound[:, -1:] - bound[:, :1]) * np.linspace(0.0, 1.0, LIFTED)
    lift = (bound - chord).max(axis=1)
    return _trim_negative(np.column_stack([low[:, 0], bound[:, 0] + lift, high[:, 0], bound[:, -1] + lift]))


def _merged(frusta: Array) -> Array:
    """Merge neighbours that lie on one line, (m, 4) mm: fewer segments are quicker to test."""
    kept = [frusta[0]]
    for z0, r0, z1, r1 in frusta[1:]:
        low, radius, high, end = kept[-1]
        ahead = end + (end - radius) / (high - low) * (z1 - high)
        if abs(z0 - high) <= LOWEST and abs(r0 - end) <= LOWEST and abs(r1 - ahead) <= LOWEST:
            kept[-1] = np.array([low, radius, z1, r1])
        else:
            kept.append(np.array([z0, r0, z1, r1]))
    return np.array(kept)


def _shrunk(frusta: Array, margin: float) -> Array:
    """Offset the surface of a stack, (m, 4) mm, inwards; its upper end stays."""
    z0, r0, z1, r1 = frusta.T
    if not len(frusta):
        return frusta
    slope = (r1 - r0) / (z1 - z0)
    narrower = margin * np.hypot(1.0, slope)
    low = z0.copy()
    low[0] += margin
    lower, upper = r0 + slope * (low - z0) - narrower, r1 - narrower
    # Where two segments join, the narrower one sets the radius.
    joint = np.minimum(upper[:-1], (r0 - narrower)[1:])
    joined = np.abs(z1[:-1] - z0[1:]) <= LOWEST
    upper[:-1], lower[1:] = (np.where(joined, joint, own) for own in (upper[:-1], lower[1:]))
    return _trim_negative(np.column_stack([low, lower, z1, upper]))


def _trim_negative(frusta: Array) -> Array:
    """Trim segments, (m, 4) mm, to radii of 0 and more."""
    z0, r0, z1, r1 = frusta.T
    kept = (np.maximum(r0, r1) > 0.0) & (z1 - z0 > LOWEST)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = z0 - r0 * (z1 - z0) / (r1 - r0)
    low, high = np.where(r0 < 0.0, crossing, z0), np.where(r1 < 0.0, crossing, z1)
    return np.column_stack([low, np.maximum(r0, 0.0), high, np.maximum(r1, 0.0)])[kept]


def tool_solids(tool: Tool) -> tuple[Solid, ...]:
    """Build solids of the parts of a tool that are known (`Tool.parts`), from the tip upwards."""
    return tuple(Solid.of_outline(part.name, part.outline) for part in tool.parts())


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Triangles, and the solids of the tool that must stay clear of them.

    Parameters
    ----------
    name : part, fixture…
    tree : the triangles, workpiece frame
    solids : each grown by its clearance
    """

    name: str
    tree: TriangleTree
    solids: tuple[Solid, ...]

    @classmethod
    def build(cls, name: str, triangles: Array, solids: Sequence[Solid]) -> Obstacle:
        """Sort triangles, (f, 3, 3) mm, into a tree."""
        tree = TriangleTree.build(np.ascontiguousarray(triangles, dtype=float))
        return cls(name, tree, tuple(s for s in solids if len(s.frusta)))

    def hit_by(self, rows: IntArray, tip: Array, axis: Array) -> BoolArray:
        """Find which tools reach into it at locations, (m,), which don't matter to a body that stays; (m,).

        Parameters
        ----------
        tip, axis : (m, 3), mm and unit vectors, workpiece frame
        """
        return in_chunks(meets_all, rows, tip, axis, self.solids, self.tree.triangles, self.tree.boxes)


def in_chunks(
    test: Callable[..., BoolArray],
    rows: IntArray,
    tip: Array,
    axis: Array,
    solids: Sequence[Solid],
    *obstacle: NDArray[Any],
) -> BoolArray:
    """Test tools at locations, (m,), in threads: `test` takes some of them, the solids' frusta, and more."""
    if not solids or not len(tip):
        return np.zeros(len(tip), dtype=bool)
    # Thick parts first: they hit soonest.
    frusta = np.ascontiguousarray(np.concatenate([s.frusta for s in reversed(solids)]))
    tip, axis = np.ascontiguousarray(tip, dtype=float), np.ascontiguousarray(axis, dtype=float)

    def tested(at: int) -> BoolArray:
        some = slice(at, at + CHUNK)
        return np.asarray(test(rows[some], tip[some], axis[some], frusta, *obstacle))

    return np.concatenate(at_once([partial(tested, start) for start in range(0, len(tip), CHUNK)]))


@compiled
def meets_all(
    _rows: IntArray, tip: Array, axis: Array, frusta: Array, triangles: Array, boxes: Array
) -> BoolArray:
    """Find which tools with tips, (m, 3) mm, and axes, (m, 3), meet a triangle; (m,)."""
    met = np.zeros(len(tip), dtype=np.bool_)
    polygon, cut = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    stack = np.empty(STACK, dtype=np.int64)
    for i in range(len(tip)):
        met[i] = _meets(tip[i], axis[i], frusta, triangles, boxes, stack, polygon, cut)
    return met


@compiled
def _meets(
    tip: Array,
    axis: Array,
    frusta: Array,
    triangles: Array,
    boxes: Array,
    stack: IntArray,
    polygon: Array,
    cut: Array,
) -> bool:
    leaves = len(boxes) // 2
    leaf = len(triangles) // leaves
    across, beside = _frame(axis)
    top = 1
    stack[0] = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if not near_box(tip, axis, frusta, boxes[node]):
            continue
        if node < leaves:
            stack[top] = 2 * node
            stack[top + 1] = 2 * node + 1
            top += 2
            continue
        first = (node - leaves) * leaf
        for t in range(first, first + leaf):
            for k in range(3):
                dx = triangles[t, k, 0] - tip[0]
                dy = triangles[t, k, 1] - tip[1]
                dz = triangles[t, k, 2] - tip[2]
                polygon[k, 0] = dx * across[0] + dy * across[1] + dz * across[2]
                polygon[k, 1] = dx * beside[0] + dy * beside[1] + dz * beside[2]
                polygon[k, 2] = dx * axis[0] + dy * axis[1] + dz * axis[2]
            upright, aside, offset, room = _plane(polygon)
            for f in range(len(frusta)):
                # Most frusta lie on one side of the triangle's plane, which is seen at once.
                ends = upright * frusta[f, 0] - offset, upright * frusta[f, 2] - offset
                wide = aside * frusta[f, 1] + room, aside * frusta[f, 3] + room
                if min(ends[0] - wide[0], ends[1] - wide[1]) > 0.0:
                    continue
                if max(ends[0] + wide[0], ends[1] + wide[1]) < 0.0:
                    continue
                if _triangle_meets(polygon, frusta[f], cut):
                    return True
    return False


@compiled
def _plane(corners: Array) -> tuple[float, float, float, float]:
    """Return a triangle's plane: its normal along the axis and across it, its offset, and `APART` as long.

    The normal isn't of unit length; that of a triangle without area separates nothing.
    """
    ax, ay, az = corners[0, 0], corners[0, 1], corners[0, 2]
    bx, by, bz = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    cx, cy, cz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    x, y, z = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    across = x * x + y * y
    return z, np.sqrt(across), x * ax + y * ay + z * az, APART * np.sqrt(across + z * z)


@compiled
def _frame(axis: Array) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return two unit vectors at right angles to an axis and to each other."""
    x, y, z = axis[0], axis[1], axis[2]
    if abs(z) < 0.9:
        length = np.sqrt(x * x + y * y)
        a = (-y / length, x / length, 0.0)
    else:
        length = np.sqrt(y * y + z * z)
        a = (0.0, -z / length, y / length)
    b = (y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0])
    return a, b


@compiled
def near_box(tip: Array, axis: Array, frusta: Array, box: Array) -> bool:
    """Check whether a box may meet a frustum: never False where it does.

    At any one height they are separate if they are so along the direction from the axis to the box's centre.
    """
    height, half_height, square = 0.0, 0.0, 0.0
    for k in range(3):
        middle = (box[0, k] + box[1, k]) / 2.0 - tip[k]
        height += middle * axis[k]
        half_height += (box[1, k] - box[0, k]) / 2.0 * abs(axis[k])
        square += middle * middle
    out = np.sqrt(max(square - height * height, 0.0))
    away = out * out
    for k in range(3):
        middle = (box[0, k] + box[1, k]) / 2.0 - tip[k]
        away -= (box[1, k] - box[0, k]) / 2.0 * abs(middle - height * axis[k])
    # Both sides are multiplied by `out`, which may be 0.
    for f in range(len(frusta)):
        low, high = max(frusta[f, 0], height - half_height), min(frusta[f, 2], height + half_height)
        if low > high:
            continue
        slope = (frusta[f, 3] - frusta[f, 1]) / (frusta[f, 2] - frusta[f, 0])
        widest = frusta[f, 1] + slope * ((high if slope > 0.0 else low) - frusta[f, 0])
        if away <= widest * out:
            return True
    return False


@compiled
def _triangle_meets(corners: Array, frustum: Array, cut: Array) -> bool:
    """Check whether a triangle in the tool's frame, (3, 3) mm, reaches into a frustum."""
    z0, r0, z1, r1 = frustum[0], frustum[1], frustum[2], frustum[3]
    lowest = min(corners[0, 2], corners[1, 2], corners[2, 2])
    highest = max(corners[0, 2], corners[1, 2], corners[2, 2])
    if lowest >= z1 or highest <= z0:
        return False
    slope = (r1 - r0) / (z1 - z0)
    count = _clip_to_slab(corners, z0, z1, cut)
    if count == 0:
        return False
    # Seen along the axis, it pierces the polygon if all edges turn about it with one sign.
    left, right = False, False
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        ax, ay, az = cut[k, 0], cut[k, 1], cut[k, 2]
        dx, dy, dz = cut[j, 0] - ax, cut[j, 1] - ay, cut[j, 2] - az
        if _least_on_edge(ax, ay, az, dx, dy, dz, slope) < r0 - slope * z0:
            return True
        turn = ax * dy - ay * dx
        left = left or turn > 0.0
        right = right or turn < 0.0
    return left != right


@compiled
def _clip_to_slab(corners: Array, z0: float, z1: float, cut: Array) -> int:
    """Clip a triangle to the heights z0 to z1; return the number of the polygon's corners."""
    count = 0
    for k in range(3):
        j = (k + 1) % 3
        za, zb = corners[k, 2], corners[j, 2]
        if z0 <= za <= z1:
            cut[count] = corners[k]
            count += 1
        # Crossings in the order in which the edge meets the two planes.
        first, second = (z0, z1) if zb > za else (z1, z0)
        for level in (first, second):
            if (za < level < zb) or (zb < level < za):
                share = (level - za) / (zb - za)
                for c in range(2):
                    cut[count, c] = corners[k, c] + share * (corners[j, c] - corners[k, c])
                cut[count, 2] = level
                count += 1
    return count


@compiled
def _least_on_edge(ax: float, ay: float, az: float, dx: float, dy: float, dz: float, slope: float) -> float:
    """Minimum of ``ρ − slope z`` along the edge from a to a + d."""
    along = dx * dx + dy * dy
    beta = slope * dz
    start = np.sqrt(ax * ax + ay * ay) - slope * az
    ex, ey = ax + dx, ay + dy
    least = min(start, np.sqrt(ex * ex + ey * ey) - slope * (az + dz))
    if along <= beta * beta or along == 0.0:
        return least
    middle = -(ax * dx + ay * dy) / along
    cx, cy = ax + middle * dx, ay + middle * dy
    # ρ² = along (s − middle)² + c²: its derivative equals beta here.
    offset = beta * np.sqrt((cx * cx + cy * cy) / (along * (along - beta * beta)))
    share = middle + offset
    if 0.0 < share < 1.0:
        px, py = ax + share * dx, ay + share * dy
        least = min(least, np.sqrt(px * px + py * py) - slope * (az + share * dz))
    return least
