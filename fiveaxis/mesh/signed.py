"""The distance to the surface of a mesh, negative inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.mesh.distance import TriangleTree, tree_of
from fiveaxis.mesh.surface import facet_normals

if TYPE_CHECKING:
    import trimesh

# mm: of the surface nearer than this to a point, the facet's own normal says more than the way to it.
AT_SURFACE = 1e-6


@dataclass(frozen=True, eq=False)
class SignedSurface:
    """A mesh with the tree of its triangles, and their normals.

    Parameters
    ----------
    mesh : mm
    tree : its triangles
    facets : (f, 3), unit vectors
    """

    mesh: trimesh.Trimesh
    tree: TriangleTree
    facets: Array

    @classmethod
    def of(cls, mesh: trimesh.Trimesh) -> SignedSurface:
        """Sort the triangles of a mesh into a tree."""
        triangles = np.asarray(mesh.triangles, dtype=float)
        return cls(mesh, tree_of(mesh), facet_normals(triangles))

    def nearest(self, points: Array) -> tuple[Array, Array, Array]:
        """Find normals, feet and signed distances, (n, 3) each and (n,) mm, negative inside the part."""
        foot, triangle, distance = self.tree.nearest(points)
        way, facet = points - foot, self.facets[triangle]
        behind = np.flatnonzero(np.einsum("ij,ij->i", way, facet) < 0.0)
        # Outside a sharp edge one of its two facets also has the point behind it.
        if self.mesh.is_watertight and len(behind):
            behind = behind[np.asarray(self.mesh.contains(points[behind]))]
        signed = distance.copy()
        signed[behind] *= -1.0
        far = distance > AT_SURFACE
        towards = way / np.where(far, signed, 1.0)[:, None]
        return np.where(far[:, None], towards, facet), foot, signed
