"""Shapes as geometries of the page: boxes, cylinders, thinned meshes, marks."""

from __future__ import annotations

from typing import Any

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.cam import load_mesh
from fiveaxis.check import box_corners
from fiveaxis.model import Box, Cylinder, MeshShape, Shape
from fiveaxis.show.viewer.recorder import box, cylinder, triangles

# Turns the page's cylinder, which lies along y about its middle, along z.
UPRIGHT = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)
# Corners and faces of an octahedron of radius 1, anticlockwise seen from outside.
CORNERS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], dtype=np.int64
)


def make_geometry(shape: Shape, most_triangles: int) -> dict[str, Any]:
    """Make a shape's geometry in its own frame; a mesh is thinned."""
    if isinstance(shape, Box):
        return box(shape.size)
    if isinstance(shape, Cylinder):
        return cylinder(shape.radius, shape.height)
    mesh = load_mesh(shape.file, allow_open=True)
    return mesh_geometry(shape.scale * mesh.vertices, mesh.faces, most_triangles)


def mesh_geometry(vertices: Array, faces: IntArray, most_triangles: int) -> dict[str, Any]:
    """Make a mesh's geometry, thinned if it is too fine to be shown: (v, 3) mm, (f, 3)."""
    return triangles(*thin_mesh(vertices, faces, most_triangles))


def pose_of(shape: Shape) -> Array:
    """Return the pose of a shape's geometry, (4, 4) mm; the page's cylinder lies along y."""
    return shape.frame @ UPRIGHT if isinstance(shape, Cylinder) else shape.frame


def corners(shape: Shape) -> Array:
    """Return the corners, (8, 3) mm, of a shape's bounding box along its axes; `MeshError` as `load_mesh`."""
    if isinstance(shape, MeshShape):
        vertices = shape.scale * load_mesh(shape.file, allow_open=True).vertices
        low, high = vertices.min(axis=0), vertices.max(axis=0)
    else:
        sides = shape.size if isinstance(shape, Box) else (2 * shape.radius, 2 * shape.radius, shape.height)
        high = np.asarray(sides, dtype=float) / 2.0
        low = -high
    return box_corners(low, high) @ shape.frame[:3, :3].T + shape.frame[:3, 3]


def is_flat(shape: Shape) -> bool:
    """Check whether faces are lit flat: a mesh has no normals here, while a cylinder has smooth ones."""
    return isinstance(shape, MeshShape)


def scatter_marks(points: Array, radius: float) -> tuple[Array, IntArray]:
    """Make one mesh, (6 m, 3) mm and (8 m, 3), with an octahedron at every point, (m, 3) mm."""
    vertices = (points[:, None] + radius * CORNERS).reshape(-1, 3)
    first = len(CORNERS) * np.arange(len(points))
    return vertices, (first[:, None, None] + FACES).reshape(-1, 3)


def thin_mesh(vertices: Array, faces: IntArray, most: int) -> tuple[Array, IntArray]:
    """Merge neighbouring vertices of a mesh until it has at most `most` triangles.

    Returns
    -------
    vertices, faces : (v, 3) mm and (f, 3); unchanged if few enough, else on a grid as fine as `most` allows
    """
    cells = 1024
    thin = vertices, faces
    while len(thin[1]) > most:
        thin = _merge_cells(vertices, faces, cells)
        # The number of triangles grows with the square of the cells, which nearly gives the right grid.
        cells = int(cells * min(0.95, np.sqrt(most / max(len(thin[1]), 1))))
    return thin


def _merge_cells(vertices: Array, faces: IntArray, cells: int) -> tuple[Array, IntArray]:
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    x, y, z = np.round((vertices - low) / size * cells).astype(np.int64).T
    # One number per cell, as unique rows take a hundred times as long.
    _, first, merged = np.unique(
        (x * (cells + 1) + y) * (cells + 1) + z, return_index=True, return_inverse=True
    )
    joined = merged[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    a, b, c = np.sort(kept, axis=1).T
    _, pair = np.unique(a * len(first) + b, return_inverse=True)
    return vertices[first], kept[np.sort(np.unique(pair * len(first) + c, return_index=True)[1])]
