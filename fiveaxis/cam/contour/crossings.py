"""Compiled search for the passes next to a contact.

Importing this module loads numba, so `quality` does it only when ridges are measured.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, IntArray, compiled
from fiveaxis.cam.mesh.distance import TriangleTree
from fiveaxis.cam.mesh.kernels import STACK, box_gap, push_children

# A crossing nearer to the contact than this share of the farthest distance lies on the contact's own pass.
OWN = 1e-3
# Passes of one wall don't end level with each other. A pass whose extension by this many moves holds the
# nearest crossing is the contact's neighbour, so no pass farther away is.
BEYOND = 3.0
# Share of a move by which a crossing may miss its ends, by rounding.
SLACK = 1e-6


def crossings(
    points: Array, heading: Array, normals: Array, starts: IntArray, farthest: float
) -> tuple[IntArray, Array]:
    """Find the nearest cutting moves on either side of each contact that cross the plane normal to the feed.

    Contacts are (n, 3) mm, headings and normals unit vectors; rows with a zero heading are skipped. From the
    rows `starts`, (m,), a move leads to the next row.

    Returns
    -------
    move : (n, 2), indices into `starts` of the nearest crossings to the left and right; −1 for none, or one
        beyond the end of a pass
    share : (n, 2), position on the move, 0…1
    """
    ends = points[starts], points[starts + 1]
    over = np.zeros((len(starts), 2))
    over[1:, 0] = over[:-1, 1] = np.where(np.diff(starts) > 1, BEYOND, SLACK)
    over[0, 0] = over[-1, 1] = BEYOND
    tree = TriangleTree.build(np.stack([*ends, ends[1]], axis=1))
    return _crossings(
        points, heading, normals, starts, tree.triangles, tree.boxes, tree.order, over, farthest
    )


@compiled
def _crossings(
    points: Array,
    heading: Array,
    normals: Array,
    starts: IntArray,
    segments: Array,
    boxes: Array,
    order: IntArray,
    over: Array,
    farthest: float,
) -> tuple[IntArray, Array]:
    found = np.full((len(points), 2), -1, np.int64)
    shares = np.zeros((len(points), 2))
    for i in range(len(points)):
        if np.any(heading[i] != 0.0):
            _cross(i, points, heading, normals, starts, segments, boxes, order, over, farthest, found, shares)
    return found, shares


@compiled
def _cross(
    i: int,
    points: Array,
    heading: Array,
    normals: Array,
    starts: IntArray,
    segments: Array,
    boxes: Array,
    order: IntArray,
    over: Array,
    farthest: float,
    found: IntArray,
    shares: Array,
) -> None:
    """Search the tree of segments for the nearest crossings on both sides of one contact."""
    leaves = len(boxes) // 2
    width = len(segments) // leaves
    p, h, n = points[i], heading[i], normals[i]
    b = np.array([n[1] * h[2] - n[2] * h[1], n[2] * h[0] - n[0] * h[2], n[0] * h[1] - n[1] * h[0]])
    best = np.array([farthest * farthest, farthest * farthest])
    waiting = np.empty(STACK, np.int64)
    waiting[0] = 1
    count = 1
    while count > 0:
        count -= 1
        node = waiting[count]
        if box_gap(p, boxes[node]) >= max(best[0], best[1]):
            continue
        if node < leaves:
            count = push_children(p, boxes, node, waiting, count)
            continue
        for k in range((node - leaves) * width, (node - leaves + 1) * width):
            row = starts[order[k]]
            if row == i or row + 1 == i or np.sum(normals[row] * n) < 0.5:
                continue
            start, end = np.sum((segments[k, 0] - p) * h), np.sum((segments[k, 1] - p) * h)
            if start == end:
                continue
            t = start / (start - end)
            if t < -over[order[k], 0] or t > 1.0 + over[order[k], 1]:
                continue
            apart = segments[k, 0] + t * (segments[k, 1] - segments[k, 0]) - p
            across, above = np.sum(apart * b), np.sum(apart * n)
            if abs(across) < max(abs(above), OWN * farthest):
                continue
            side = 0 if across > 0.0 else 1
            gap = np.sum(apart * apart)
            if gap < best[side]:
                best[side] = gap
                found[i, side] = order[k] if -SLACK <= t <= 1.0 + SLACK else -1
                shares[i, side] = min(max(t, 0.0), 1.0)
