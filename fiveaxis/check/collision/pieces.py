"""Rigid shapes for the check of collisions: trees of boxes around convex bodies, and queries of two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, extremes

# Triangles in a leaf of a mesh's tree.
LEAF = 2


@dataclass(frozen=True, eq=False)
class Piece:
    """One rigid shape.

    Parameters
    ----------
    bodies : (leaves * width, m, 4), mm, own frame: convex bodies (`fiveaxis.check.collision.convex_pair`) in
        the order of the leaves; the triangles of a mesh are padded with repetitions
    boxes : (2 * leaves, 2, 3), mm, own frame; node 1 is the root, node i has the children 2i and 2i + 1
    frame : (4, 4), mm, its own frame in the workpiece frame, every axis at 0
    inner : (3,), mm, a point of it in its own frame
    triangles : (t, 3, 3), mm, own frame; None unless it is a mesh
    closed : whether its triangles enclose a volume
    """

    bodies: Array
    boxes: Array
    frame: Array
    inner: Array
    triangles: Array | None = None
    closed: bool = False

    @property
    def low(self) -> Array:
        """(3,), mm, lowest coordinates in its own frame."""
        return self.boxes[1, 0]

    @property
    def high(self) -> Array:
        """(3,), mm, highest coordinates in its own frame."""
        return self.boxes[1, 1]

    @property
    def corners(self) -> Array:
        """(8, 3), mm, corners of its bounding box in its own frame."""
        return box_corners(self.low, self.high)

    @property
    def circles(self) -> Array:
        """(c, 4), mm, centre and radius of circles normal to z, whose hull is it, or the box of a mesh."""
        if self.is_mesh:
            return np.column_stack([self.corners, np.zeros(8)])
        return self.bodies.reshape(-1, 4)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, mm."""
        return float(np.linalg.norm(self.high - self.low, axis=-1))

    @property
    def is_mesh(self) -> bool:
        """Whether it is a surface of triangles, open or closed."""
        return self.triangles is not None

    @property
    def memory(self) -> int:
        """Memory of a mesh with its tree, bytes; 0 for other shapes."""
        return 0 if self.triangles is None else self.bodies.nbytes + self.boxes.nbytes + self.triangles.nbytes


def box_corners(low: Array, high: Array) -> Array:
    """Return the corners, (8, 3) mm, of the box from its lowest to its highest coordinates, (3,) mm."""
    picks = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
    return np.where(picks == 1, high, low)


def hull_piece(points: Array, frame: Array) -> Piece:
    """Build the convex hull of points, (v, 3) mm in its own frame; it is convex, so their mean is inside."""
    return _convex(np.column_stack([points, np.zeros(len(points))]), frame)


def box_piece(size: Array, frame: Array) -> Piece:
    """Build a box of size (3,) mm, centred on the origin of its frame."""
    half = np.asarray(size, dtype=float) / 2.0
    return hull_piece(box_corners(-half, half), frame)


def cylinder_piece(radius: float, height: float, frame: Array) -> Piece:
    """Build a cylinder, mm, along z and centred on the origin of its frame."""
    return _revolved(np.array([[radius, -height / 2.0], [radius, height / 2.0]]), frame)


def revolved_pieces(outline: Array, frame: Array) -> list[Piece]:
    """Revolve an outline about the z axis of a frame, as one or more convex pieces.

    The outline, (m, 2) mm, is distance from the axis and height, bottom up; the frame, (4, 4) mm, is in the
    workpiece frame.
    """
    return [_revolved(run, frame) for run in convex_runs(outline)]


def convex_runs(outline: Array) -> list[Array]:
    """Split an outline, (m, 2) mm, where it turns inwards; parts without height are left out."""
    runs, begin = [], 0
    steps = np.diff(outline, axis=0)
    for i in range(1, len(steps)):
        before, after = steps[i - 1], steps[i]
        if before[0] * after[1] - before[1] * after[0] < -1e-12:
            runs.append(outline[begin : i + 1])
            begin = i
    runs.append(outline[begin:])
    return [run for run in runs if np.ptp(run[:, 1]) > 1e-9 and run[:, 0].max() > 0.0]


def _revolved(run: Array, frame: Array) -> Piece:
    """Revolve a convex outline: the hull of a circle for each of its points."""
    radius, height = np.asarray(run, dtype=float).T
    return _convex(np.column_stack([np.zeros((len(run), 2)), height, radius]), frame)


def extended_piece(piece: Piece, offsets: Array) -> Piece:
    """Build the hull of a piece, or of the box around a mesh, at offsets, (m, 3) mm in its own frame."""
    moved = np.column_stack([offsets, np.zeros(len(offsets))])
    return _convex((piece.circles + moved[:, None]).reshape(-1, 4), piece.frame)


def _convex(circles: Array, frame: Array) -> Piece:
    """Build the hull of circles, (m, 4) mm: centre and radius, 0 for a point."""
    centre = circles[:, :3]
    wide = circles[:, 3:] * np.array([1.0, 1.0, 0.0])
    box = np.array([(centre - wide).min(axis=0), (centre + wide).max(axis=0)])
    return Piece(circles[None].copy(), np.stack([box, box]), frame, centre.mean(axis=0))


def mesh_piece(vertices: Array, faces: IntArray, frame: Array, *, closed: bool) -> Piece:
    """Build the tree of a mesh, (v, 3) mm in its own frame and (t, 3); `closed` if it encloses a volume.

    Its frame, (4, 4) mm, is in the workpiece frame, every axis at 0.
    """
    triangles = np.ascontiguousarray(vertices, dtype=float)[faces]
    a, b, c = np.moveaxis(triangles, 1, 0)
    order = _leaf_order((a + b + c) / 3.0)
    bodies = np.zeros((len(order), 3, 4))
    bodies[:, :, :3] = triangles[order]
    return Piece(bodies, _boxes(bodies), frame, triangles[0, 0], triangles, closed)


def _leaf_order(middles: Array) -> IntArray:
    """Sort points, (t, 3) mm, into leaves by halving each node along its longest extent: (leaves * `LEAF`,).

    Some are repeated so that all leaves are full.
    """
    leaves = 1
    while leaves * LEAF < len(middles):
        leaves *= 2
    order = np.sort(np.resize(np.arange(len(middles)), leaves * LEAF))
    # Ranks, unlike coordinates, are never equal, so that halves are the same on every processor.
    nodes, places, ranks = 1, np.asfortranarray(middles), np.empty(middles.shape, dtype=np.int64)
    for rank, place in zip(ranks.T, places.T, strict=True):
        rank[np.argsort(place, kind="stable")] = np.arange(len(middles))
    while nodes < leaves:
        rows = order.reshape(nodes, -1)
        ends = (extremes(one[rows]) for one in places.T)
        along = np.argmax([high - low for low, high in ends], axis=0)
        halves = np.argpartition(ranks[rows, along[:, None]], rows.shape[1] // 2, axis=1)
        order = np.take_along_axis(rows, halves, axis=1).ravel()
        nodes *= 2
    return np.sort(order.reshape(leaves, LEAF), axis=1).ravel()


def _boxes(ordered: Array) -> Array:
    """Compute the boxes of a tree's nodes, (2 * leaves, 2, 3) mm, of triangles in the leaves' order."""
    leaves = len(ordered) // LEAF
    boxes = np.zeros((2 * leaves, 2, 3))
    for k in range(3):
        boxes[leaves:, 0, k], boxes[leaves:, 1, k] = extremes(ordered[..., k].reshape(leaves, -1))
    while leaves > 1:
        pairs = boxes[leaves : 2 * leaves].reshape(-1, 2, 2, 3)
        leaves //= 2
        boxes[leaves : 2 * leaves, 0] = np.minimum(pairs[:, 0, 0], pairs[:, 1, 0])
        boxes[leaves : 2 * leaves, 1] = np.maximum(pairs[:, 0, 1], pairs[:, 1, 1])
    return boxes


class PairQuery:
    """One pair of pieces, queried at many relative poses, (4, 4) mm: the mover's own frame in the other's."""

    def __init__(self, mover: Piece, other: Piece) -> None:
        from fiveaxis.check.collision.tree_pair import depth_between, gaps_between

        self._trees = other.bodies, other.boxes, mover.bodies, mover.boxes
        self._gaps, self._depth = gaps_between, depth_between
        self.count = 0

    def near(self, poses: Array, margins: Array) -> BoolArray:
        """Check in which poses, (m, 4, 4), the pieces overlap or are nearer than margins, (m,) mm, ≥ 0."""
        self.count += len(poses)
        return np.asarray(self._gaps(self._trees, np.ascontiguousarray(poses), margins, False) <= margins)

    def nearer(self, pose: Array, margin: float) -> bool:
        """Check whether the pieces overlap or are nearer to each other than a margin, mm, 0 or more."""
        return bool(self.near(pose[None], np.array([margin]))[0])

    def depth(self, pose: Array) -> float:
        """Measure how far, mm, the mover has to move to leave the triangle that it is deepest in, or 0."""
        self.count += 1
        return float(self._depth(*self._trees, np.ascontiguousarray(pose)))

    def gap(self, pose: Array, most: float) -> float:
        """Measure the gap between the pieces, mm, at most `most` and never too large."""
        self.count += 1
        gaps = self._gaps(self._trees, np.ascontiguousarray(pose[None]), np.array([most]), True)
        return float(min(gaps[0], most))
