"""Directions in cells: the sphere folded from an octahedron onto a square, cut into equal squares.

Neighbouring directions fall into the same or neighbouring cells and no cell is much larger than another,
which no grid of longitude and latitude has.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, IntArray, normalise


def cells_of(directions: Array, count: int) -> IntArray:
    """Find the cell of each direction, (m, 3) of any length above 0; `count` cells to a side, (m,)."""
    x, y, z = (directions / np.abs(directions).sum(axis=1, keepdims=True)).T
    # The lower half is folded outwards over the square's corners.
    folded = 1.0 - np.abs(np.stack([y, x]))
    u, v = np.where(z < 0.0, np.copysign(folded, np.stack([x, y])), np.stack([x, y]))
    column, row = (np.clip(((c + 1.0) / 2.0 * count).astype(np.int64), 0, count - 1) for c in (u, v))
    return np.asarray(row * count + column)


def cell_centres(cells: IntArray, count: int) -> Array:
    """Give the direction in the middle of each cell, (m, 3) unit vectors; the inverse of `cells_of`."""
    row, column = np.divmod(cells, count)
    u, v = (2.0 * (column + 0.5) / count - 1.0, 2.0 * (row + 0.5) / count - 1.0)
    z = 1.0 - np.abs(u) - np.abs(v)
    folded = np.maximum(-z, 0.0)
    return normalise(
        np.column_stack([u - np.copysign(folded, u), v - np.copysign(folded, v), z]),
    )
