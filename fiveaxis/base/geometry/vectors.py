"""Vectors, rotations and rigid transforms, with the same digits on every processor.

`@`, `np.dot` and `np.linalg` call BLAS and LAPACK, and numpy has vector code of its own for inverse
trigonometric functions, powers and logarithms. Both choose their kernels by processor, and the last digits
differ. A search compares sums of such numbers: by one digit another posture is the cheapest, and the program
another one.
"""

from __future__ import annotations

import math
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Sums over one index, by the factors' dimensions: a vector has 1, a matrix or a stack of them 2.
SUMS = {(1, 1): "j,j->", (1, 2): "j,...jk->...k", (2, 1): "...ij,j->...i", (2, 2): "...ij,...jk->...ik"}
# Rows are short of which there are more than this many times as many as each has values.
SHORT = 16
Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def product(*factors: ArrayLike) -> NDArray[np.float64]:
    """Multiply matrices and vectors from the left, like ``a @ b @ …``.

    Parameters
    ----------
    factors : (..., i, j) or (j,), two or more
    """
    return reduce(_product, (np.asarray(factor, dtype=float) for factor in factors))


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum(SUMS[min(a.ndim, 2), min(b.ndim, 2)], a, b))


def cross(a: Array, b: Array) -> Array:
    """Compute vector products, (..., 3): for a few rows in a fifth of `np.cross`'s time."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=out[..., i])
    return out


def extremes(rows: Array) -> tuple[Array, Array]:
    """Find the lowest and the highest value of each row, (m, k), (m,) each; numpy is slow at short rows."""
    if len(rows) > SHORT * rows.shape[1]:
        columns = np.ascontiguousarray(rows.T)
        return columns.min(axis=0), columns.max(axis=0)
    return rows.min(axis=1), rows.max(axis=1)


def every_pair(first: ArrayLike, second: ArrayLike) -> NDArray[np.float64]:
    """Pair all values of two lists, (a,) and (b,); (a, b, 2)."""
    return np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1)


def arctan2(y: ArrayLike, x: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles of points of a plane, rad in [−π, π], from their coordinates, (...)."""
    # Compiled code takes a third of a second to import, which reading a file doesn't need.
    from fiveaxis.base.geometry.angles import angles

    one, other = (np.array(c, dtype=float) for c in np.broadcast_arrays(y, x))
    return angles(one.reshape(-1), other.reshape(-1)).reshape(one.shape)


def arccos(cosine: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles, rad in [0, π], of cosines, (...), in [−1, 1]."""
    c = np.asarray(cosine, dtype=float)
    return arctan2(np.sqrt((1.0 - c) * (1.0 + c)), c)


def arcsin(sine: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles, rad in [−π/2, π/2], of sines, (...), in [−1, 1]."""
    s = np.asarray(sine, dtype=float)
    return arctan2(s, np.sqrt((1.0 - s) * (1.0 + s)))


def normalise(vectors: Array) -> Array:
    """Scale rows, (..., 3), none of them zero (readers check that, as they know the line), to unit length."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def angle_between(a: Array, b: Array) -> Array:
    """Compute the angle between rows of unit vectors in one frame, (..., 3); (...), rad in [0, π].

    Uses ``atan2(|a×b|, a·b)``: the arc cosine loses half its digits near 0 and 180°.
    """
    return arctan2(np.linalg.norm(cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def perpendicular(vectors: Array) -> Array:
    """Return a unit vector perpendicular to each unit vector, (..., 3)."""
    smallest = np.argmin(np.abs(vectors), axis=-1)
    return normalise(cross(vectors, np.eye(3)[smallest]))


def rotation_matrix(direction: ArrayLike, angle: float) -> Array:
    """Return the rotation, (3, 3), about a unit vector by an angle, rad, right-handed (Rodrigues)."""
    k = np.asarray(direction, dtype=float)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * product(cross, cross)


def translation(offset: ArrayLike) -> Array:
    """Return the (4, 4) transform that moves by an offset, (3,) mm."""
    transform = np.eye(4)
    transform[:3, 3] = offset
    return transform


def inverse_transform(transform: Array) -> Array:
    """Invert rigid transforms, (..., 4, 4) mm, without the rounding of a general inverse."""
    inverse = np.zeros(transform.shape)
    inverse[..., :3, :3] = np.swapaxes(transform[..., :3, :3], -2, -1)
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", inverse[..., :3, :3], transform[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def frame_along(direction: ArrayLike, point: ArrayLike) -> Array:
    """Return a frame, (4, 4) mm, at a point with its z along a unit vector, (3,) each.

    It is the smallest rotation from the upright frame.
    """
    z = np.asarray(direction, dtype=float)
    across = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(across, axis=-1))
    about = across / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
    frame = np.eye(4)
    frame[:3, :3] = rotation_matrix(about, math.atan2(sine, z[2]))
    frame[:3, 3] = point
    return frame
