"""Exact distances from points to the surface of a mesh, and which side of it they are on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from fiveaxis.base import Array, IntArray, extremes
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.cam.mesh.surface import facet_normals

if TYPE_CHECKING:
    from fiveaxis.cam.mesh.cad.model import Model

T = TypeVar("T")
# Triangles in a leaf of the tree.
LEAF = 4
# mm: nearer to the surface than this, the facet's normal replaces the direction from the foot to the point.
AT_SURFACE = 1e-6


def kept_by_mesh(make: Callable[[Mesh], T]) -> Callable[[Mesh], T]:
    """Decorate a function of a mesh so that it runs once per mesh: trees of large meshes take long to build.

    What is returned mustn't refer to the mesh, which would keep it alive.
    """
    made: WeakKeyDictionary[Mesh, T] = WeakKeyDictionary()

    @wraps(make)
    def kept(mesh: Mesh) -> T:
        if mesh not in made:
            made[mesh] = make(mesh)
        return made[mesh]

    return kept


@dataclass(frozen=True, eq=False)
class TriangleTree:
    """Triangles in a perfect binary tree of boxes.

    Parameters
    ----------
    triangles : (leaves * `LEAF`, 3, 3), mm, in the order of the leaves, padded with repetitions
    boxes : (2 * leaves, 2, 3), mm; node 1 is the root, node i has the children 2i and 2i + 1
    order : (leaves * `LEAF`,), index of each of these triangles in the original array
    """

    triangles: Array
    boxes: Array
    order: IntArray

    @classmethod
    def build(cls, triangles: Array) -> TriangleTree:
        """Sort triangles, (f, 3, 3) mm, into a tree by halving each node along its longest extent."""
        leaves = 1
        while leaves * LEAF < len(triangles):
            leaves *= 2
        a, b, c = np.moveaxis(triangles, 1, 0)
        order = _in_leaves((a + b + c) / 3.0, leaves)
        ordered = np.ascontiguousarray(triangles[order])
        return cls(ordered, _boxes(ordered, leaves), order)

    def distances(self, points: Array, bound: float = np.inf) -> Array:
        """Compute the distance to the nearest triangle, at most `bound`: (n, 3) mm → (n,) mm."""
        from fiveaxis.cam.mesh import kernels

        return kernels.nearest_all(np.ascontiguousarray(points), self.triangles, self.boxes, bound)

    def nearest(self, points: Array, bound: float = np.inf) -> tuple[Array, IntArray, Array]:
        """Find the point of the surface nearest to points, (n, 3) mm, that is no farther than a bound, mm.

        Returns
        -------
        foot : (n, 3), mm, on the surface; NaN where no triangle is within `bound`
        triangle : (n,), index in the original array; −1 there. A foot on an edge has one of its triangles
        distance : (n,), mm; infinite there
        """
        from fiveaxis.cam.mesh import kernels

        feet, rows, distances = kernels.feet_all(
            np.ascontiguousarray(points), self.triangles, self.boxes, bound
        )
        return feet, np.where(rows >= 0, self.order[rows], -1), distances

    def reach(self, start: Array, end: Array, limit: float, finest: float) -> float:
        """Compute how far, mm, a point can move from start to end with all triangles `limit` away."""
        from fiveaxis.cam.mesh import kernels

        return kernels.reach(start, end, self.triangles, self.boxes, limit, finest)


def _in_leaves(centres: Array, leaves: int) -> IntArray:
    """Halve nodes down to leaves: rows of centres, (f, 3) mm, some of them twice to fill all leaves."""
    rows = np.sort(np.resize(np.arange(len(centres)), leaves * LEAF))
    places = np.asfortranarray(centres[rows])
    # Ranks, unlike coordinates, are never equal, so that halves are the same on every processor.
    ranks, numbers = np.empty(places.shape, dtype=np.int64), np.arange(len(rows))
    np.put_along_axis(ranks, np.argsort(places, axis=0, kind="stable"), numbers[:, None], axis=0)
    nodes = np.arange(len(rows))[None]
    while len(nodes) < leaves:
        ends = (extremes(one[nodes]) for one in places.T)
        longest = np.argmax([high - low for low, high in ends], axis=0)
        halves = np.argpartition(ranks[nodes, longest[:, None]], nodes.shape[1] // 2, axis=1)
        nodes = np.take_along_axis(nodes, halves, axis=1).reshape(2 * len(nodes), -1)
    return rows[np.sort(nodes, axis=1)].ravel()


def _boxes(triangles: Array, leaves: int) -> Array:
    """Compute the boxes of a tree, (2 * leaves, 2, 3) mm, from its triangles in the order of the leaves."""
    boxes = np.zeros((2 * leaves, 2, 3))
    for k in range(3):
        boxes[leaves:, 0, k], boxes[leaves:, 1, k] = extremes(triangles[..., k].reshape(leaves, -1))
    while leaves > 1:
        one, other = boxes[leaves : 2 * leaves : 2], boxes[leaves + 1 : 2 * leaves : 2]
        leaves //= 2
        np.minimum(one[:, 0], other[:, 0], out=boxes[leaves : 2 * leaves, 0])
        np.maximum(one[:, 1], other[:, 1], out=boxes[leaves : 2 * leaves, 1])
    return boxes


@kept_by_mesh
def tree_of(mesh: Mesh) -> TriangleTree:
    """Sort the triangles of a mesh into a tree."""
    return TriangleTree.build(mesh.triangles)


@dataclass(frozen=True, eq=False)
class SignedSurface:
    """A mesh with the tree and the normals, (f, 3), of its triangles; distances are negative inside.

    It may have a model of its exact surfaces.
    """

    mesh: Mesh
    tree: TriangleTree
    facets: Array
    model: Model | None = None

    @classmethod
    def of(cls, mesh: Mesh, model: Model | None = None) -> SignedSurface:
        """Build the tree of a mesh in mm."""
        return cls(mesh, tree_of(mesh), facet_normals(mesh.triangles), model)

    def nearest_exactly(self, points: Array) -> tuple[Array, Array, Array]:
        """Find the same as `nearest` on the exact surfaces where there is a model of them."""
        normal, foot, signed = self.nearest(points)
        if self.model is None:
            return normal, foot, signed
        exact = self.model.nearest(points)
        offset = points - exact.point
        # At an edge of faces, beside none of them, the mesh knows on which side a point is.
        side = np.where(exact.on_border, np.sign(signed), np.sign(np.sum(offset * exact.normal, axis=1)))
        off = exact.on_border & (exact.distance > AT_SURFACE)
        towards = offset / np.where(off, side * exact.distance, 1.0)[:, None]
        return np.where(off[:, None], towards, exact.normal), exact.point, side * exact.distance

    def nearest(self, points: Array) -> tuple[Array, Array, Array]:
        """Find normals, feet and signed distances, (n, 3) each and (n,) mm, negative inside the mesh."""
        foot, triangle, distance = self.tree.nearest(points)
        offset, facet = points - foot, self.facets[triangle]
        behind = np.flatnonzero(np.einsum("ij,ij->i", offset, facet) < 0.0)
        # A point outside a sharp edge is also behind one of its two facets.
        if self.mesh.is_watertight and len(behind):
            behind = behind[self.mesh.contains(points[behind])]
        signed = distance.copy()
        signed[behind] *= -1.0
        far = distance > AT_SURFACE
        towards = offset / np.where(far, signed, 1.0)[:, None]
        return np.where(far[:, None], towards, facet), foot, signed
