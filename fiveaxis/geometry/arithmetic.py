"""Arithmetic that gives the same digits on every processor.

`@`, `np.dot` and `np.linalg` call BLAS and LAPACK, and numpy has vector code of its own for inverse
trigonometric functions, powers and logarithms. Both choose their kernels by processor, and the last digits
differ. A search compares sums of such numbers: by one digit another posture is the cheapest, and the program
another one.
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Sums over one index, by the factors' dimensions: a vector has 1, a matrix or a stack of them 2.
SUMS = {
    (1, 1): "j,j->",
    (1, 2): "j,...jk->...k",
    (2, 1): "...ij,j->...i",
    (2, 2): "...ij,...jk->...ik",
}


def product(*factors: ArrayLike) -> NDArray[np.float64]:
    """Multiply matrices and vectors from the left, like ``a @ b @ …``.

    Parameters
    ----------
    factors : (..., i, j) or (j,), two or more
    """
    return reduce(_product, (np.asarray(factor, dtype=float) for factor in factors))


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum(SUMS[min(a.ndim, 2), min(b.ndim, 2)], a, b))


def every_pair(first: ArrayLike, second: ArrayLike) -> NDArray[np.float64]:
    """Pair all values of two lists, (a,) and (b,); (a, b, 2)."""
    return np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1)


def arctan2(y: ArrayLike, x: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles of points of a plane, rad in [−π, π], from their coordinates, (...)."""
    # Compiled code takes a third of a second to import, which reading a file doesn't need.
    from fiveaxis.geometry.angles import angle

    return np.asarray(angle(y, x))


def arccos(cosine: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles, rad in [0, π], of cosines, (...), in [−1, 1]."""
    c = np.asarray(cosine, dtype=float)
    return arctan2(np.sqrt((1.0 - c) * (1.0 + c)), c)


def arcsin(sine: ArrayLike) -> NDArray[np.float64]:
    """Compute the angles, rad in [−π/2, π/2], of sines, (...), in [−1, 1]."""
    s = np.asarray(sine, dtype=float)
    return arctan2(s, np.sqrt((1.0 - s) * (1.0 + s)))
