"""The part's surface: triangles with normals that are smoothed, but not across sharp edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import CREASE, Array, BoolArray, IntArray, angle_between, normalise, product
from fiveaxis.cam.mesh.mesh import Mesh, triangle_areas

if TYPE_CHECKING:
    import trimesh

# Facets at a larger angle meet at an edge of the part; smaller angles come from the tessellation.
SHARP_EDGE = np.radians(CREASE)
# Barycentric coordinate below which a point lies on the edge opposite a corner.
ON_EDGE = 1e-6
# Triangles whose normals and angles are computed at a time.
PART = 100_000


@dataclass(frozen=True, eq=False, kw_only=True)
class Surface(Mesh):
    """A mesh with facet normals and one smoothed normal at each corner of its triangles.

    Parameters
    ----------
    facet_normals : (f, 3), unit vectors, zero for triangles without area
    corner_normals : (f, 3, 3), unit vectors by face and corner
    crease : rad; normals are smoothed over facets that meet at a smaller angle
    """

    facet_normals: Array
    corner_normals: Array
    crease: float = SHARP_EDGE

    @classmethod
    def from_mesh(cls, given: Mesh | trimesh.Trimesh, *, crease: float = SHARP_EDGE) -> Surface:
        """Smooth the normals of a mesh over facets that meet at less than an angle, rad."""
        mesh = Mesh.of(given)
        facets = _by_parts(facet_normals, mesh.vertices, mesh.faces)
        corners = corner_normals(mesh.vertices, mesh.faces, facets, crease)
        return cls(
            mesh.vertices,
            mesh.faces,
            mesh.model,
            facet_normals=facets,
            corner_normals=corners,
            crease=crease,
        )

    def turned(self, frame: Array) -> Surface:
        """Express the triangles in another frame, whose axes are the rows of a (3, 3)."""
        return replace(
            self,
            vertices=product(self.vertices, frame.T),
            facet_normals=product(self.facet_normals, frame.T),
            corner_normals=product(self.corner_normals, frame.T),
            model=None,
        )

    def part(self, kept: BoolArray) -> Surface:
        """Return the surface of some triangles, (f,), only; their normals stay."""
        used, faces = np.unique(self.faces[kept], return_inverse=True)
        return replace(
            self,
            vertices=self.vertices[used],
            faces=faces.reshape(-1, 3),
            facet_normals=self.facet_normals[kept],
            corner_normals=self.corner_normals[kept],
            model=None if self.model is None else self.model.part(kept),
        )

    def onto(self, points: Array, faces: IntArray) -> tuple[Array, Array]:
        """Return points and unit normals of the surface at points of triangles, (n, 3) mm and (n,).

        With a model they are the nearest points of the triangles' own faces; otherwise the given points with
        the smoothed normals there.
        """
        if self.model is None:
            return points, self.normals_at(points, faces)
        foot = self.model.onto(points, faces)
        return foot.point, foot.normal

    @property
    def normals_from(self) -> str:
        """Which normals these are, in words."""
        if self.model is not None:
            return f"of the model's surfaces ({PurePath(self.model.name).name})"
        return f"of the mesh, smoothed across facets that meet at less than {np.degrees(self.crease):g} deg"

    def normals_at(self, points: Array, faces: IntArray) -> Array:
        """Interpolate the smoothed normals at points of triangles, (n, 3) mm and (n,); (n, 3) unit vectors.

        Triangles without area have the normal 0.
        """
        return units(np.einsum("ik,ikj->ij", self._weights(points, faces), self.corner_normals[faces]))

    def on_crease(self, points: Array, faces: IntArray) -> BoolArray:
        """Check which points of triangles, (n, 3) mm and (n,), lie on sharp edges or their ends."""
        beyond = self._weights(points, faces) < ON_EDGE
        on_edge = (beyond & self.sharp[faces]).any(axis=1)
        ends = np.zeros(len(self.vertices), dtype=bool)
        for k in range(3):
            ends[self.faces[self.sharp[:, k]][:, [k - 2, k - 1]]] = True
        at_end = (beyond.sum(axis=1) == 2) & (ends[self.faces[faces]] & ~beyond).any(axis=1)
        return np.asarray(on_edge | at_end)

    def _weights(self, points: Array, faces: IntArray) -> Array:
        return barycentric(points, self.vertices[self.faces[faces]])

    @cached_property
    def sharp(self) -> BoolArray:
        """(f, 3), edges opposite each corner of a triangle at which no other one meets it smoothly."""
        start, end = (np.roll(self.faces, shift, axis=1).reshape(-1) for shift in (-1, -2))
        edge = np.minimum(start, end) * len(self.vertices) + np.maximum(start, end)
        order = np.argsort(edge, kind="stable")
        normals = self.facet_normals[order // 3]
        flat = np.einsum("ij,ij->i", normals[1:], normals[:-1]) > np.cos(self.crease)
        joined = flat & (edge[order][1:] == edge[order][:-1])
        smooth = np.zeros(len(order), dtype=bool)
        smooth[order] = np.append(joined, False) | np.append(False, joined)
        return np.asarray(~smooth.reshape(-1, 3))

    @cached_property
    def heights(self) -> tuple[Array, Array]:
        """(f,), mm: lowest and highest z of the triangles."""
        a, b, c = (self.vertices[self.faces[:, k], 2] for k in range(3))
        return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def units(vectors: Array, least: float = 0.0) -> Array:
    """Scale vectors, (..., 3), to length 1; those no longer than the least become 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > least))


def barycentric(points: Array, triangles: Array) -> Array:
    """Compute the barycentric coordinates of points in triangles, (n, 3) mm and (n, 3, 3) mm; (n, 3)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    # Twice the areas opposite the corners, as vectors along the triangle's normal.
    whole = np.cross(b - a, c - a)
    size = np.maximum(np.einsum("ij,ij->i", whole, whole), 1e-300)
    parts = [np.cross(q - p, points - p) for p, q in ((b, c), (c, a), (a, b))]
    return np.stack([np.einsum("ij,ij->i", part, whole) / size for part in parts], axis=1)


def facet_normals(triangles: Array) -> Array:
    """Compute the unit normals of triangles, (f, 3, 3) mm → (f, 3); zero for triangles without area."""
    doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(doubled, axis=1, keepdims=True)
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1, keepdims=True)
    # The normal of a triangle 1e5 times longer than high is made of rounding errors.
    flat = length <= 1e-5 * longest**2
    return np.where(flat, 0.0, doubled / np.where(flat, 1.0, length))


def make_patches(points: Array, normals: Array, size: float) -> Mesh:
    """Return a triangle with legs of a size, mm, in the tangent plane at each point, (n, 3) mm."""
    beside = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = normalise(np.cross(normals, beside))
    corners = np.stack([points, points + size * u, points + size * np.cross(normals, u)], axis=1)
    vertices = corners.reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3))


def corner_normals(vertices: Array, faces: IntArray, facets: Array, crease: float = SHARP_EDGE) -> Array:
    """Smooth the normals at the corners of triangles; (f, 3, 3), unit vectors by face and corner.

    The normal of face f at vertex v is a weighted mean of the normals of the faces around v that are within
    the crease angle, rad, of the normal of f, so a crease keeps both its normals. A face of area A whose
    corner at v has the angle α weighs ``α max(1, A / (4 H))³``, where H is the harmonic mean of the areas
    there, weighted by the angles. Among faces alike that is their angle. A face much larger than the others
    is flat and meets a rounding, whose normals at their common edge are its own: without the second factor it
    would seem to bulge by half the angle to the rounding's first facet.
    """
    from fiveaxis.cam.mesh import kernels  # numba is slow to load

    corners = faces.reshape(-1)
    order = np.argsort(corners, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=len(vertices)))])
    angles = _by_parts(corner_angles, vertices, faces).reshape(-1)
    areas = _by_parts(triangle_areas, vertices, faces)
    total = kernels.sums_near(order, first, angles, facets, areas, float(np.cos(crease)))
    # Triangles without area have no corner angles, so their corner normals stay zero.
    return units(total).reshape(-1, 3, 3)


def corner_angles(triangles: Array) -> Array:
    """Compute the angles at the corners of triangles, (f, 3, 3) mm → (f, 3) rad."""
    onward = np.roll(triangles, -1, axis=1) - triangles
    back = np.roll(triangles, 1, axis=1) - triangles
    return angle_between(onward, back)


def _by_parts(function: Callable[[Array], Array], vertices: Array, faces: IntArray) -> Array:
    """Apply a function of triangles to a part of them at a time: their differences take much memory."""
    parts = range(0, max(len(faces), 1), PART)
    return np.concatenate([function(vertices[faces[begin : begin + PART]]) for begin in parts])
