"""Rows of vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry.arithmetic import arctan2

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def normalise(vectors: Array) -> Array:
    """Scale rows to unit length.

    Parameters
    ----------
    vectors : (..., 3), any unit, no zero rows (readers check that, as they know the line)

    Returns
    -------
    (..., 3), unit vectors
    """
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def angle_between(a: Array, b: Array) -> Array:
    """Compute the angle between rows of unit vectors.

    Uses ``atan2(|a×b|, a·b)``: the arc cosine loses half its digits near 0 and 180°.

    Parameters
    ----------
    a, b : (..., 3), unit vectors in one frame

    Returns
    -------
    (...), rad, in [0, π]
    """
    return arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def perpendicular(vectors: Array) -> Array:
    """Return a unit vector perpendicular to each unit vector.

    Parameters
    ----------
    vectors : (..., 3), unit vectors

    Returns
    -------
    (..., 3), unit vectors
    """
    smallest = np.argmin(np.abs(vectors), axis=-1)
    return normalise(np.cross(vectors, np.eye(3)[smallest]))
