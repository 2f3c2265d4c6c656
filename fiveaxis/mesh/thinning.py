"""Coarser meshes, to be looked at."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, IntArray


def thin_mesh(vertices: Array, faces: IntArray, most: int) -> tuple[Array, IntArray]:
    """Merge neighbouring vertices of a mesh that is too fine to be shown, until few triangles are left.

    Parameters
    ----------
    vertices, faces : (v, 3) mm and (f, 3)
    most : number of triangles to stay below

    Returns
    -------
    vertices, faces : the same where the mesh is small enough; else on a grid as fine as `most` allows
    """
    cells = 1024
    thin = vertices, faces
    while len(thin[1]) > most:
        thin = _merge_cells(vertices, faces, cells)
        # Triangles go by the square of cells: that nearly finds the grid, and smaller steps do the rest.
        cells = int(cells * min(0.95, np.sqrt(most / max(len(thin[1]), 1))))
    return thin


def _merge_cells(vertices: Array, faces: IntArray, cells: int) -> tuple[Array, IntArray]:
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    x, y, z = np.round((vertices - low) / size * cells).astype(np.int64).T
    # One number per cell: rows are sorted a hundred times slower.
    _, first, merged = np.unique(
        (x * (cells + 1) + y) * (cells + 1) + z, return_index=True, return_inverse=True
    )
    joined = merged[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    return vertices[first], kept[_first_of_each(kept)]


def _first_of_each(faces: IntArray) -> IntArray:
    """Give the rows of triangles, (f, 3), that aren't the same three corners as an earlier one."""
    least, middle, most = np.sort(faces, axis=1).T
    order = np.lexsort((most, middle, least))
    same = (np.diff(least[order]) == 0) & (np.diff(middle[order]) == 0) & (np.diff(most[order]) == 0)
    # lexsort keeps the order of equal rows, so the first of each run is the earliest.
    return np.sort(order[np.append(True, ~same)[: len(order)]])
