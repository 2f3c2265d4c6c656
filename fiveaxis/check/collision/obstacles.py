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

from fiveaxis.base import Array, BoolArray, IntArray, at_once, compiled, cross, extremes, innermost
from fiveaxis.cam import STACK, Mesh, TriangleTree, kept_by_mesh, tree_of
from fiveaxis.model import Tool

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
Place = tuple[float, float, float]
# A slab as a tool sees it: its normal along the axis and across it, the offset of its middle, and its half
# thickness, mm.
Seen = tuple[float, float, float, float]
# Triangles and nodes of an obstacle, as of `Obstacle`.
Tree = tuple[Array, Array]
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
    solids : each grown by its clearance
    triangles : (f, 3, 3), mm, workpiece frame, in the order of the leaves of a perfect binary tree
    nodes : (2 * leaves, 11), as in `TriangleTree.boxes`: middle and half sides of a node's box (mm), then the
        slab of its triangles: unit normal, middle and half thickness (mm)
    """

    name: str
    solids: tuple[Solid, ...]
    triangles: Array
    nodes: Array

    @classmethod
    def build(cls, name: str, body: Mesh | Array, solids: Sequence[Solid]) -> Obstacle:
        """Sort the triangles of a body, a mesh or (f, 3, 3) mm, into a tree; those of a mesh once."""
        parts = _with_slabs(TriangleTree.build(body)) if isinstance(body, np.ndarray) else _of_mesh(body)
        return cls(name, tuple(s for s in solids if len(s.frusta)), *parts)

    def hit_by(self, rows: IntArray, tip: Array, axis: Array) -> BoolArray:
        """Find which tools reach into it, (m,); a body that stays doesn't need their locations, (m,).

        Tips and axes, (m, 3) mm and unit vectors, are in the workpiece frame.
        """
        return in_chunks(_meets_all, rows, tip, axis, self.solids, (self.triangles, self.nodes))


def in_chunks(
    test: Callable[..., BoolArray],
    rows: IntArray,
    tip: Array,
    axis: Array,
    solids: Sequence[Solid],
    obstacle: tuple[NDArray[Any], ...],
) -> BoolArray:
    """Test tools at locations, (m,), in threads.

    The test takes some of them, the frusta of all solids, the numbers of the first frustum of each and of
    all, and the obstacle.
    """
    if not solids or not len(tip):
        return np.zeros(len(tip), dtype=bool)
    # Thick parts first: they hit soonest.
    frusta = np.ascontiguousarray(np.concatenate([s.frusta for s in reversed(solids)]))
    begin = np.cumsum([0, *(len(s.frusta) for s in reversed(solids))])
    tip, axis = np.ascontiguousarray(tip, dtype=float), np.ascontiguousarray(axis, dtype=float)

    def tested(at: int) -> BoolArray:
        some = slice(at, at + CHUNK)
        return np.asarray(test(rows[some], tip[some], axis[some], frusta, begin, obstacle))

    return np.concatenate(at_once([partial(tested, start) for start in range(0, len(tip), CHUNK)]))


@kept_by_mesh
def _of_mesh(mesh: Mesh) -> tuple[Array, Array]:
    """Sort the triangles of a mesh, which is in the way of one setup after the other."""
    return _with_slabs(tree_of(mesh))


def _with_slabs(tree: TriangleTree) -> tuple[Array, Array]:
    """Find the triangles, (f, 3, 3) mm, and the nodes, (2 * leaves, 11), of an obstacle's tree.

    Triangles of a smooth surface lie in a slab much thinner than their box. Its normal is their mean one, but
    the slab holds their corners whatever that is.
    """
    triangles, boxes = tree.triangles, tree.boxes
    along = cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    nodes, count = np.zeros((len(boxes), 11)), len(boxes) // 2
    low, high = np.moveaxis(boxes, 1, 0)
    nodes[:, :3], nodes[:, 3:6] = (low + high) / 2.0, (high - low) / 2.0
    points = np.moveaxis(triangles, -1, 0).copy()
    while count:
        each = len(along) // count
        along = np.asarray(sum(along[k::each] for k in range(each)))
        nodes[count : 2 * count, 6:] = _slabs_of(points.reshape(3, count, -1), along)
        count //= 2
    return triangles, nodes


def _slabs_of(points: Array, normals: Array) -> Array:
    """Find the slabs, (m, 5), of points, (3, m, k) mm, along normals, (m, 3) of any length; 0 without one."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0)
    low, high = extremes(np.asarray(sum(points[k] * unit[:, None, k] for k in range(3))))
    return np.column_stack([unit, (low + high) / 2.0, (high - low) / 2.0])


@compiled
def _meets_all(
    _rows: IntArray, tip: Array, axis: Array, frusta: Array, begin: IntArray, tree: Tree
) -> BoolArray:
    """Find which tools with tips, (m, 3) mm, and axes, (m, 3), meet a triangle; (m,).

    Solid by solid, as each rules out other parts of the tree. What one tool meets the next is likely to meet.
    """
    met = np.zeros(len(tip), dtype=np.bool_)
    polygon, cut = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    stack = np.empty(STACK, dtype=np.int64)
    for solid in range(len(begin) - 1):
        own, last = frusta[begin[solid] : begin[solid + 1]], 0
        for i in range(len(tip)):
            if not met[i]:
                place, along = (tip[i, 0], tip[i, 1], tip[i, 2]), (axis[i, 0], axis[i, 1], axis[i, 2])
                stack[0], stack[1] = 1, last
                leaf = _met_leaf(place, along, own, tree, stack, 1 + (last > 0), polygon, cut)
                met[i], last = leaf > 0, leaf or last
    return met


@innermost
def _met_leaf(
    tip: Place, axis: Place, frusta: Array, tree: Tree, stack: IntArray, top: int, polygon: Array, cut: Array
) -> int:
    """Find a leaf of which a triangle is met, below the nodes that wait in the stack; 0 for none."""
    triangles, nodes = tree
    leaves, leaf = len(nodes) // 2, 2 * len(triangles) // len(nodes)
    across, beside = _frame(axis)
    while top > 0:
        top -= 1
        node = stack[top]
        if not near_box(tip, axis, frusta, nodes, node):
            continue
        if not _in_slab(_seen(tip, axis, nodes, node), frusta):
            continue
        if node < leaves:
            stack[top], stack[top + 1] = 2 * node, 2 * node + 1
            top += 2
            continue
        for t in range((node - leaves) * leaf, (node - leaves + 1) * leaf):
            _place(tip, across, beside, axis, triangles[t], polygon)
            for f in range(len(frusta)):
                if _triangle_meets(polygon, frusta[f], cut):
                    return node
    return 0


@innermost
def _place(tip: Place, across: Place, beside: Place, axis: Place, triangle: Array, corners: Array) -> None:
    """Set a triangle's corners, (3, 3) mm, in the tool's frame."""
    for k in range(3):
        x, y, z = triangle[k, 0] - tip[0], triangle[k, 1] - tip[1], triangle[k, 2] - tip[2]
        corners[k, 0] = x * across[0] + y * across[1] + z * across[2]
        corners[k, 1] = x * beside[0] + y * beside[1] + z * beside[2]
        corners[k, 2] = x * axis[0] + y * axis[1] + z * axis[2]


@innermost
def _seen(tip: Place, axis: Place, nodes: Array, row: int) -> Seen:
    """See a node's slab from a tool; one without a normal is everywhere."""
    x, y, z = nodes[row, 6], nodes[row, 7], nodes[row, 8]
    upright = x * axis[0] + y * axis[1] + z * axis[2]
    offset = nodes[row, 9] - (x * tip[0] + y * tip[1] + z * tip[2])
    return upright, np.sqrt(max(1.0 - upright * upright, 0.0)), offset, nodes[row, 10] + APART


@innermost
def _in_slab(seen: Seen, frusta: Array) -> bool:
    """Check whether one of the frusta may reach into a slab: never False where one does."""
    upright, aside, offset, room = seen
    near = False
    for f in range(len(frusta)):
        low, high = upright * frusta[f, 0] - offset, upright * frusta[f, 2] - offset
        wide, wider = aside * frusta[f, 1] + room, aside * frusta[f, 3] + room
        near = near or min(low - wide, high - wider) <= 0.0 <= max(low + wide, high + wider)
    return near


@innermost
def _frame(axis: Place) -> tuple[Place, Place]:
    """Return two unit vectors at right angles to an axis and to each other.

    The check of gouges has a frame, and a clipping of triangles, of its own: search and verification share no
    formula, so that a fault in one shows in the other.
    """
    x, y, z = axis
    if abs(z) < 0.9:
        length = np.sqrt(x * x + y * y)
        a = (-y / length, x / length, 0.0)
    else:
        length = np.sqrt(y * y + z * z)
        a = (0.0, -z / length, y / length)
    b = (y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0])
    return a, b


@innermost
def near_box(tip: Place, axis: Place, frusta: Array, boxes: Array, row: int) -> bool:
    """Check whether a box, by its middle and half sides, may meet a frustum: never False where it does.

    At any one height they are separate if they are so along the direction from the axis to the box's centre.
    """
    x, y, z = boxes[row, 0] - tip[0], boxes[row, 1] - tip[1], boxes[row, 2] - tip[2]
    side_x, side_y, side_z = boxes[row, 3], boxes[row, 4], boxes[row, 5]
    height = x * axis[0] + y * axis[1] + z * axis[2]
    half_height = side_x * abs(axis[0]) + side_y * abs(axis[1]) + side_z * abs(axis[2])
    away = max(x * x + y * y + z * z - height * height, 0.0)
    out = np.sqrt(away)
    away -= side_x * abs(x - height * axis[0])
    away -= side_y * abs(y - height * axis[1]) + side_z * abs(z - height * axis[2])
    # Both sides are multiplied by `out`, which may be 0.
    for f in range(len(frusta)):
        low, high = max(frusta[f, 0], height - half_height), min(frusta[f, 2], height + half_height)
        if low > high or away > max(frusta[f, 1], frusta[f, 3]) * out:
            continue
        slope = (frusta[f, 3] - frusta[f, 1]) / (frusta[f, 2] - frusta[f, 0])
        widest = frusta[f, 1] + slope * ((high if slope > 0.0 else low) - frusta[f, 0])
        if away <= widest * out:
            return True
    return False


@innermost
def _triangle_meets(corners: Array, frustum: Array, cut: Array) -> bool:
    """Check whether a triangle in the tool's frame, (3, 3) mm, reaches into a frustum."""
    z0, r0, z1, r1 = frustum[0], frustum[1], frustum[2], frustum[3]
    lowest = min(corners[0, 2], corners[1, 2], corners[2, 2])
    highest = max(corners[0, 2], corners[1, 2], corners[2, 2])
    if lowest >= z1 or highest <= z0 or _lies_beside(corners, max(r0, r1) + APART):
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


@innermost
def _lies_beside(corners: Array, radius: float) -> bool:
    """Check whether a plane at a radius, along the tool axis, facing a triangle, parts it from the axis."""
    x, y = corners[0, 0] + corners[1, 0] + corners[2, 0], corners[0, 1] + corners[1, 1] + corners[2, 1]
    nearest = x * corners[0, 0] + y * corners[0, 1]
    nearest = min(nearest, x * corners[1, 0] + y * corners[1, 1], x * corners[2, 0] + y * corners[2, 1])
    return nearest >= radius * np.sqrt(x * x + y * y) and nearest > 0.0


@innermost
def _clip_to_slab(corners: Array, z0: float, z1: float, cut: Array) -> int:
    """Clip a triangle to the heights z0 to z1; return the number of the polygon's corners."""
    count = 0
    for k in range(3):
        j = (k + 1) % 3
        za, zb = corners[k, 2], corners[j, 2]
        if z0 <= za <= z1:
            for c in range(3):
                cut[count, c] = corners[k, c]
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


@innermost
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
