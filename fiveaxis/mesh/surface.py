"""The part's surface: triangles with normals that are smoothed, but not across sharp edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import Array, IntArray, angle_between

if TYPE_CHECKING:
    import trimesh

# Facets at a larger angle meet at an edge of the part; smaller angles come from the tessellation.
SHARP_EDGE = np.radians(30.0)
# Triangles whose normals and angles are computed at a time.
PART = 100_000


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with facet normals and one smoothed normal at each of their corners.

    Parameters
    ----------
    vertices : (v, 3), mm, workpiece frame
    faces : (f, 3), indices of vertices, anticlockwise seen from outside
    facet_normals : (f, 3), unit vectors, zero for triangles without area
    corner_normals : (f, 3, 3), unit vectors by face and corner
    """

    vertices: Array
    faces: IntArray
    facet_normals: Array
    corner_normals: Array

    @classmethod
    def from_mesh(cls, mesh: trimesh.Trimesh) -> Surface:
        """Smooth the normals of a mesh."""
        vertices = np.array(mesh.vertices, dtype=float)
        faces = np.array(mesh.faces, dtype=np.int64)
        facets = _by_parts(facet_normals, vertices, faces)
        return cls(vertices, faces, facets, corner_normals(vertices, faces, facets))

    def turned(self, frame: Array) -> Surface:
        """Express the surface in another frame, whose axes are the rows of a (3, 3)."""
        return Surface(
            self.vertices @ frame.T, self.faces, self.facet_normals @ frame.T, self.corner_normals @ frame.T
        )

    @property
    def triangles(self) -> Array:
        """(f, 3, 3), mm: corners of the triangles."""
        return self.vertices[self.faces]

    @cached_property
    def heights(self) -> tuple[Array, Array]:
        """(f,), mm: lowest and highest z of the triangles."""
        a, b, c = (self.vertices[self.faces[:, k], 2] for k in range(3))
        return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)

    @property
    def bounds(self) -> Array:
        """(2, 3), mm: lowest and highest coordinates."""
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def facet_normals(triangles: Array) -> Array:
    """Compute the unit normals of triangles, (f, 3, 3) mm → (f, 3); zero for triangles without area."""
    doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(doubled, axis=1, keepdims=True)
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1, keepdims=True)
    # The normal of a triangle 1e5 times longer than high is made of rounding errors.
    flat = length <= 1e-5 * longest**2
    return np.where(flat, 0.0, doubled / np.where(flat, 1.0, length))


def corner_normals(vertices: Array, faces: IntArray, facets: Array) -> Array:
    """Smooth the normals at the corners of triangles.

    The normal of face f at vertex v is the mean, weighted by the corner angles, of the normals of the faces
    around v that are within `SHARP_EDGE` of the normal of f, so a crease keeps both its normals.

    Parameters
    ----------
    vertices : (v, 3), mm
    faces : (f, 3), indices of vertices
    facets : (f, 3), unit vectors or zero

    Returns
    -------
    (f, 3, 3), unit vectors by face and corner
    """
    from fiveaxis.mesh import kernels  # numba is slow to load

    corners = faces.reshape(-1)
    order = np.argsort(corners, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=len(vertices)))])
    angles = _by_parts(corner_angles, vertices, faces).reshape(-1)
    total = kernels.sums_near(order, first, angles, facets, float(np.cos(SHARP_EDGE)))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    # Triangles without area have no corner angles, so their corner normals stay zero.
    smooth: Array = np.divide(total, length, out=np.zeros_like(total), where=length > 0.0)
    return smooth.reshape(-1, 3, 3)


def corner_angles(triangles: Array) -> Array:
    """Compute the angles at the corners of triangles, (f, 3, 3) mm → (f, 3) rad."""
    onward = np.roll(triangles, -1, axis=1) - triangles
    back = np.roll(triangles, 1, axis=1) - triangles
    return angle_between(onward, back)


def _by_parts(function: Callable[[Array], Array], vertices: Array, faces: IntArray) -> Array:
    """Apply a function of triangles to a part of them at a time: their differences take much memory."""
    parts = range(0, max(len(faces), 1), PART)
    return np.concatenate([function(vertices[faces[begin : begin + PART]]) for begin in parts])
