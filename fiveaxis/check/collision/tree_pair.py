"""Compiled loops: two pieces, each a tree of boxes around convex bodies; that of a convex piece is one leaf.

Verification has this tree to itself: the mask of the posture search, which it holds to account, uses
`fiveaxis.cam.TriangleTree` and closed forms of its own (`fiveaxis.check.collision.obstacles`).

Importing this module loads numba.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, IntArray, compiled, innermost
from fiveaxis.check.collision.convex_pair import MOST_CORNERS, MOST_FACES, TOUCHING, gap_bounds, overlap

# Bodies and boxes of a `Piece`, and those of another.
Pair = tuple[Array, Array, Array, Array]
# Deep enough for any two trees: one pair of nodes waits at each of at most 62 levels of both.
STACK = 128


@innermost
def box_bounds(a: Array, b: Array, pose: Array) -> tuple[float, float]:
    """Bound the gap between what two boxes hold from below, and its overlap from above, mm.

    A movement that parts the boxes parts what they hold. Each box has its lowest and highest coordinates,
    (2, 3) mm, in its own frame; `pose` is b's frame in a's.
    """
    gap_a, gap_b, over = 0.0, 0.0, np.inf
    for i in range(3):
        # Along axis i of a, and of b: distance of the centres, and half of both widths.
        off_a, off_b = pose[i, 3] - 0.5 * (a[0, i] + a[1, i]), 0.5 * (b[0, i] + b[1, i])
        reach_a, reach_b = 0.5 * (a[1, i] - a[0, i]), 0.5 * (b[1, i] - b[0, i])
        for j in range(3):
            off_a += 0.5 * pose[i, j] * (b[0, j] + b[1, j])
            reach_a += 0.5 * abs(pose[i, j]) * (b[1, j] - b[0, j])
            off_b += pose[j, i] * (pose[j, 3] - 0.5 * (a[0, j] + a[1, j]))
            reach_b += 0.5 * abs(pose[j, i]) * (a[1, j] - a[0, j])
        apart_a, apart_b = abs(off_a) - reach_a, abs(off_b) - reach_b
        over = min(over, -apart_a, -apart_b)
        gap_a += max(apart_a, 0.0) ** 2
        gap_b += max(apart_b, 0.0) ** 2
    return float(np.sqrt(max(gap_a, gap_b))), over


@innermost
def push_children(
    boxes_a: Array, boxes_b: Array, pose: Array, sign: float, waiting: IntArray, bounds: Array, count: int
) -> int:
    """Replace the pair of nodes after the last one waiting by two of them, the more promising one last.

    Return the number of pairs, (s, 2), that wait afterwards. Their bounds, (s,) mm, are those of the gap with
    the sign 1, and with −1 those of the overlap, which have that sign.
    """
    i, j = waiting[count, 0], waiting[count, 1]
    leaves_a, leaves_b = len(boxes_a) // 2, len(boxes_b) // 2
    size_a = size_b = 0.0
    for k in range(3):
        size_a += (boxes_a[i, 1, k] - boxes_a[i, 0, k]) ** 2
        size_b += (boxes_b[j, 1, k] - boxes_b[j, 0, k]) ** 2
    split_a = j >= leaves_b or (i < leaves_a and size_a > size_b)
    for child in range(2):
        one, two = (2 * i + child, j) if split_a else (i, 2 * j + child)
        gap, over = box_bounds(boxes_a[one], boxes_b[two], pose)
        waiting[count + child, 0], waiting[count + child, 1] = one, two
        bounds[count + child] = gap if sign > 0.0 else -over
    if bounds[count] < bounds[count + 1]:
        for k in range(2):
            waiting[count, k], waiting[count + 1, k] = waiting[count + 1, k], waiting[count, k]
        bounds[count], bounds[count + 1] = bounds[count + 1], bounds[count]
    return count + 2


@compiled
def gaps_between(pair: Pair, poses: Array, most: Array, exact: bool) -> Array:
    """Bound the gaps between two pieces from below, (m,) mm, to `convex_pair.EXACT`; ∞ if over `most`, (m,).

    Unless they have to be exact, any number up to `most` will do where a gap isn't larger. The poses,
    (m, 4, 4) mm, are of the second piece's frame in the first one's.
    """
    gaps = np.empty(len(poses))
    space = np.empty((STACK, 2), np.int64), np.empty(STACK), np.zeros((8, 3))
    for i in range(len(poses)):
        gaps[i] = _gap(pair, poses[i], most[i], exact, space)
    return gaps


@innermost
def _gap(pair: Pair, pose: Array, best: float, exact: bool, space: tuple[IntArray, Array, Array]) -> float:
    (bodies_a, boxes_a, bodies_b, boxes_b), (waiting, bounds, simplex) = pair, space
    leaves_a, leaves_b = len(boxes_a) // 2, len(boxes_b) // 2
    width_a, width_b = len(bodies_a) // leaves_a, len(bodies_b) // leaves_b
    waiting[0, 0], waiting[0, 1], bounds[0] = 1, 1, 0.0
    count, found = 1, np.inf
    while count > 0:
        count -= 1
        i, j = waiting[count, 0], waiting[count, 1]
        if bounds[count] > best:
            continue
        if i < leaves_a or j < leaves_b:
            count = push_children(boxes_a, boxes_b, pose, 1.0, waiting, bounds, count)
            continue
        for k in range((i - leaves_a) * width_a, (i - leaves_a + 1) * width_a):
            for m in range((j - leaves_b) * width_b, (j - leaves_b + 1) * width_b):
                near = 0.0 if exact else best
                lower, upper = gap_bounds(bodies_a[k], bodies_b[m], pose, near, best, simplex)
                if lower <= best:
                    found, best = min(found, lower), min(best, upper)
                    if not exact or upper < TOUCHING:
                        return found
    return found


@compiled
def depth_between(bodies_a: Array, boxes_a: Array, bodies_b: Array, boxes_b: Array, pose: Array) -> float:
    """Measure the depth of two pieces in each other, mm: the largest `overlap` of two bodies, or 0."""
    leaves_a, leaves_b = len(boxes_a) // 2, len(boxes_b) // 2
    width_a, width_b = len(bodies_a) // leaves_a, len(bodies_b) // leaves_b
    waiting, bounds = np.empty((STACK, 2), np.int64), np.empty(STACK)
    waiting[0, 0], waiting[0, 1], bounds[0] = 1, 1, -np.inf
    count, deepest, simplex = 1, 0.0, np.zeros((8, 3))
    corners, planes = np.empty((MOST_CORNERS, 3)), np.empty((MOST_FACES, 4))
    faces, edges = np.empty((MOST_FACES, 3), np.int64), np.empty((3 * MOST_FACES, 2), np.int64)
    while count > 0:
        count -= 1
        i, j = waiting[count, 0], waiting[count, 1]
        if -bounds[count] <= deepest:
            continue
        if i < leaves_a or j < leaves_b:
            count = push_children(boxes_a, boxes_b, pose, -1.0, waiting, bounds, count)
            continue
        for k in range((i - leaves_a) * width_a, (i - leaves_a + 1) * width_a):
            for m in range((j - leaves_b) * width_b, (j - leaves_b + 1) * width_b):
                if gap_bounds(bodies_a[k], bodies_b[m], pose, 0.0, 0.0, simplex)[0] <= 0.0:
                    hull = (corners, planes, faces, edges)
                    deepest = max(deepest, overlap(bodies_a[k], bodies_b[m], pose, deepest, hull))
    return deepest
