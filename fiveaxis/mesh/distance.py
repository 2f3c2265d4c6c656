"""The exact distance from points to the surface of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.mesh.kept import kept_by_mesh

if TYPE_CHECKING:
    import trimesh

# Triangles in a leaf of the tree.
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
        from fiveaxis.mesh import kernels

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
        from fiveaxis.mesh import kernels

        feet, rows, distances = kernels.feet_all(
            np.ascontiguousarray(points), self.triangles, self.boxes, bound
        )
        return feet, np.where(rows >= 0, self.order[rows], -1), distances

    def reach(self, start: Array, end: Array, limit: float, finest: float) -> float:
        """How far, mm, a point gets from start to end at least `limit` away from all triangles."""
        from fiveaxis.mesh import kernels

        return kernels.reach(start, end, self.triangles, self.boxes, limit, finest)


@kept_by_mesh
def tree_of(mesh: trimesh.Trimesh) -> TriangleTree:
    """Sort the triangles of a mesh into a tree."""
    return TriangleTree.build(np.asarray(mesh.triangles, dtype=float))


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
