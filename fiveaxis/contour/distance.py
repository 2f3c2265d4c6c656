"""The exact distance from points to the part's surface, and the room it leaves to a ball."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, IntArray

# The ball may reach this deep into the surface, mm; a millionth less, so that rounding doesn't decide.
GOUGE = 0.01 - 1e-6
# Straight moves between contacts are chords of curves: they may reach this deep, mm.
CHORD_GOUGE = 0.02
# Step of the checks along a move where it runs beside a wall, mm.
LINK_STEP, CHORD_STEP = 0.02, 0.1
LEAF = 4


@dataclass(frozen=True, eq=False)
class TriangleTree:
    """Triangles in a perfect binary tree of boxes.

    Parameters
    ----------
    triangles : (leaves * `LEAF`, 3, 3), mm, in the order of the leaves; filled up with repetitions
    boxes : (2 * leaves, 2, 3), mm; node 1 is the root, node i has the children 2i and 2i + 1
    order : (leaves * `LEAF`,), place of each of these triangles in the array that the tree was built from
    """

    triangles: Array
    boxes: Array
    order: IntArray

    @classmethod
    def build(cls, triangles: Array) -> TriangleTree:
        """Sort triangles, (f, 3, 3) mm, into a tree: each node's longest extent is halved."""
        leaves = 1
        while leaves * LEAF < len(triangles):
            leaves *= 2
        order = np.resize(np.arange(len(triangles)), leaves * LEAF)
        order.sort()
        centres = triangles.mean(axis=1)
        parts = 1
        while parts < leaves:
            order = _sort_by_longest(order.reshape(parts, -1), centres).reshape(-1)
            parts *= 2
        ordered = triangles[order]
        return cls(np.ascontiguousarray(ordered), _boxes(ordered, leaves), order)

    def distances(self, points: Array, bound: float = np.inf) -> Array:
        """Distance of points to the nearest triangle, at most `bound`: (n, 3) mm → (n,) mm."""
        from fiveaxis.contour import kernels

        return kernels.nearest_all(np.ascontiguousarray(points), self.triangles, self.boxes, bound)

    def nearest(self, points: Array, bound: float = np.inf) -> tuple[Array, IntArray, Array]:
        """Find the nearest point of the surface.

        Parameters
        ----------
        points : (n, 3), mm
        bound : mm, only what is nearer than this is found

        Returns
        -------
        foot : (n, 3), mm, on the surface; NaN where nothing is within `bound`
        triangle : (n,), its place in the array that the tree was built from (a mesh's own face); −1 there.
            A foot on an edge belongs to several: one of them is given.
        distance : (n,), mm; infinite there
        """
        from fiveaxis.contour import kernels

        feet, rows, distances = kernels.feet_all(
            np.ascontiguousarray(points), self.triangles, self.boxes, bound
        )
        return feet, np.where(rows >= 0, self.order[rows], -1), distances

    def reach(self, start: Array, end: Array, limit: float, finest: float) -> float:
        """How far, mm, a point gets from start to end at least `limit` away from all triangles."""
        from fiveaxis.contour import kernels

        return kernels.reach(start, end, self.triangles, self.boxes, limit, finest)


def _sort_by_longest(nodes: IntArray, centres: Array) -> IntArray:
    rows = centres[nodes]
    axis = np.ptp(rows, axis=1).argmax(axis=1)
    along = np.take_along_axis(rows, axis[:, None, None], axis=2)[:, :, 0]
    return np.take_along_axis(nodes, np.argsort(along, axis=1, kind="stable"), axis=1)


def _boxes(ordered: Array, leaves: int) -> Array:
    boxes = np.zeros((2 * leaves, 2, 3))
    corners = ordered.reshape(leaves, -1, 3)
    boxes[leaves:, 0], boxes[leaves:, 1] = corners.min(axis=1), corners.max(axis=1)
    parts = leaves // 2
    while parts >= 1:
        children = boxes[2 * parts : 4 * parts].reshape(parts, 2, 2, 3)
        boxes[parts : 2 * parts, 0] = children[:, :, 0].min(axis=1)
        boxes[parts : 2 * parts, 1] = children[:, :, 1].max(axis=1)
        parts //= 2
    return boxes


@dataclass(frozen=True, eq=False)
class BallSpace:
    """Where the centre of a ball of one radius can be.

    Parameters
    ----------
    tree : the part's triangles
    radius : mm
    """

    tree: TriangleTree
    radius: float

    def fits(self, centres: Array) -> NDArray[np.bool_]:
        """Tell for ball centres, (n, 3) mm, whether the ball stays out of the surface but for `GOUGE`."""
        limit = self.radius - GOUGE
        return self.tree.distances(centres, bound=limit) >= limit

    def chords_fit(self, start: Array, end: Array) -> NDArray[np.bool_]:
        """Tell for straight cutting moves, (n, 3) mm each, whether the ball stays out but for `CHORD_GOUGE`.

        Sampled every `CHORD_STEP`: the moves are short, and the surface under them is smooth.
        """
        limit = self.radius - CHORD_GOUGE
        length = np.linalg.norm(end - start, axis=1)
        parts = max(2, int(np.ceil(length.max(initial=0.0) / CHORD_STEP)))
        inner = np.arange(1, parts)[:, None, None] / parts
        samples = start + inner * (end - start)
        gaps = self.tree.distances(samples.reshape(-1, 3), bound=limit)
        lowest: Array = gaps.reshape(parts - 1, -1).min(axis=0)
        return lowest >= limit

    def reach(self, start: Array, end: Array) -> float:
        """How far, mm, the ball can go from start towards end; −1 if it can't even be at the start."""
        return self.tree.reach(start, end, self.radius - GOUGE, LINK_STEP)

    def clear(self, *way: Array) -> bool:
        """Tell whether the ball can follow a polyline of centres, (3,) mm each."""
        return all(self.reach(a, b) >= float(np.linalg.norm(b - a)) - 1e-12 for a, b in pairwise(way))
