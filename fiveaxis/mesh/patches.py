"""Small triangles at points of a surface, where no mesh of it is known."""

from __future__ import annotations

import numpy as np
import trimesh

from fiveaxis.geometry import Array, normalise


def make_patches(points: Array, normals: Array, size: float) -> trimesh.Trimesh:
    """Return a triangle in the tangent plane at each point.

    Parameters
    ----------
    points, normals : (n, 3), mm and unit vectors
    size : mm, of the legs of each triangle
    """
    beside = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = normalise(np.cross(normals, beside))
    corners = np.stack([points, points + size * u, points + size * np.cross(normals, u)], axis=1)
    vertices = corners.reshape(-1, 3)
    return trimesh.Trimesh(vertices, np.arange(len(vertices)).reshape(-1, 3), process=False)
