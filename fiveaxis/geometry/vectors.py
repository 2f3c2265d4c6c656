"""Rows of vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def normalise(vectors: Array) -> Array:
    """Scale rows to unit length.

    Parameters
    ----------
    vectors : (..., 3), any unit, no row of length zero (readers check that where the line is known)

    Returns
    -------
    (..., 3), unit vectors
    """
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def angle_between(a: Array, b: Array) -> Array:
    """Measure the angle between rows of unit vectors.

    Uses ``atan2(|a×b|, a·b)``: the arc cosine loses half of its digits near 0 and 180°.

    Parameters
    ----------
    a, b : (..., 3), unit vectors in one frame

    Returns
    -------
    (...), rad, in [0, π]
    """
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def perpendicular(vectors: Array) -> Array:
    """Give for each unit vector some unit vector at right angles to it.

    Parameters
    ----------
    vectors : (..., 3), unit vectors

    Returns
    -------
    (..., 3), unit vectors
    """
    smallest = np.argmin(np.abs(vectors), axis=-1)
    return normalise(np.cross(vectors, np.eye(3)[smallest]))
