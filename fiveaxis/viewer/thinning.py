"""Meshes that are too fine to be shown."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, IntArray

MOST_TRIANGLES = 150_000


def thin_mesh(vertices: Array, faces: IntArray, most: int = MOST_TRIANGLES) -> tuple[Array, IntArray]:
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
        cells = cells * 3 // 4
    return thin


def _merge_cells(vertices: Array, faces: IntArray, cells: int) -> tuple[Array, IntArray]:
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    keys = np.round((vertices - low) / size * cells).astype(np.int64)
    _, first, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    joined = merged.reshape(-1)[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    # Triangles that fell onto each other are shown once.
    _, once = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    return vertices[first], kept[np.sort(once)]
