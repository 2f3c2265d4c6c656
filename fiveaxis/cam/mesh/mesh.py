"""Meshes: triangles with what is asked of them everywhere.

trimesh, whose meshes users may give, takes as long to import as all else that a job needs; it is imported for
what is rare.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, product

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.cam.mesh.cad.model import Model

# Grid on which vertices are rounded to be merged, 1/mm; mm², area of a triangle that has none.
PER_MM, NO_AREA = 1e8, 1e-8
# Shears space so that a line in a direction that no surface has on purpose becomes upright.
LINE = np.array([[1.0, 0.0, -0.6738521397], [0.0, 1.0, -0.9469035713], [0.0, 0.0, 1.0]])
# Corners and faces of a cube of edge 1, anticlockwise seen from outside.
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
# Corners are numbered by the bits x y z.
CUBE_FACES = np.array(
    [
        *([1, 3, 0], [4, 1, 0], [0, 3, 2], [2, 4, 0], [1, 7, 3], [5, 1, 4]),
        *([5, 7, 1], [3, 7, 2], [6, 4, 2], [2, 7, 6], [6, 5, 4], [7, 5, 6]),
    ]
)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of a body or of a surface.

    Parameters
    ----------
    vertices : (v, 3), mm
    faces : (f, 3), indices of vertices, anticlockwise seen from outside
    model : the exact surfaces of these triangles, in their order, where they are known
    """

    vertices: Array
    faces: IntArray
    model: Model | None = None

    @classmethod
    def of(cls, given: Mesh | trimesh.Trimesh) -> Mesh:
        """Take a mesh as it is, or a copy of one of trimesh, mm."""
        if isinstance(given, cls):
            return given
        return cls(np.array(given.vertices, dtype=float), np.array(given.faces, dtype=np.int64))

    @classmethod
    def box(cls, size: Array) -> Mesh:
        """Make a box about the origin, (3,) mm."""
        return cls(CUBE * size, CUBE_FACES)

    @classmethod
    def revolved(cls, outline: Array, sectors: int) -> Mesh:
        """Make the closed body of revolution of an outline about the z axis.

        Parameters
        ----------
        outline : (m, 2), mm, distance from the axis and height, from the bottom up; the first is on the axis
        sectors : of a turn
        """
        outline = np.vstack([outline, [[0.0, outline[-1, 1]]]])
        count, angle = len(outline), np.linspace(0.0, 2.0 * np.pi, sectors + 1)[:-1, None]
        rings = [np.cos(angle) * outline[:, 0], np.sin(angle) * outline[:, 0], 0.0 * angle + outline[:, 1]]
        vertices = np.stack(rings, axis=-1).reshape(-1, 3)
        quad = np.array([[0, count, 1], [1, count, count + 1]])
        sector = (quad + np.arange(count - 1)[:, None, None]).reshape(-1, 3)
        # On the axis one of the two triangles has no area.
        sector = sector[triangle_areas(vertices[sector % len(vertices)]) > NO_AREA]
        faces = (sector + count * np.arange(sectors)[:, None, None]).reshape(-1, 3) % len(vertices)
        return cls(vertices, faces).merged()

    def merged(self) -> Mesh:
        """Merge vertices, in the order in which they first occur; those of no triangle are left out."""
        used = np.zeros(len(self.vertices), dtype=bool)
        used[self.faces] = True
        vertices = self.vertices[used]
        rounded = np.round(vertices * PER_MM)
        order = np.lexsort(rounded.T)
        is_new = np.ones(len(order), dtype=bool)
        is_new[1:] = (rounded[order[1:]] != rounded[order[:-1]]).any(axis=1)
        first, number = order[is_new], np.empty_like(order)
        # Values are counted in their own order, vertices in that of their first occurrence.
        number[order] = np.argsort(np.argsort(first))[np.cumsum(is_new) - 1]
        return Mesh(vertices[np.sort(first)], number[np.cumsum(used)[self.faces] - 1], self.model)

    @cached_property
    def triangles(self) -> Array:
        """Corners, (f, 3, 3) mm."""
        return np.asarray(self.vertices[self.faces])

    @cached_property
    def bounds(self) -> Array:
        """Lowest and highest corner of its box, (2, 3) mm."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @property
    def extents(self) -> Array:
        """Size along X, Y and Z, (3,) mm."""
        return np.asarray(self.bounds[1] - self.bounds[0])

    @property
    def area(self) -> float:
        """Area of all triangles, mm²."""
        return float(triangle_areas(self.triangles).sum())

    @cached_property
    def _edges(self) -> tuple[IntArray, IntArray]:
        """Numbers of the edges, (3 f,), sorted, and of the directed edge that each is."""
        begin, end = self.faces.reshape(-1), np.roll(self.faces, -1, axis=1).reshape(-1)
        count = len(self.vertices)
        edge = np.minimum(begin, end) * count + np.maximum(begin, end)
        order = np.argsort(edge, kind="stable")
        return edge[order], (begin * count + end)[order]

    @property
    def open_edges(self) -> int:
        """Number of edges that don't join exactly two triangles."""
        _, uses = np.unique(self._edges[0], return_counts=True)
        return int((uses != 2).sum())

    @cached_property
    def is_watertight(self) -> bool:
        """Whether every edge joins exactly two triangles."""
        edge, _ = self._edges
        pairs = len(edge) > 0 and len(edge) % 2 == 0 and (edge[::2] == edge[1::2]).all()
        return bool(pairs and (edge[1:-1:2] != edge[2::2]).all())

    @property
    def is_winding_consistent(self) -> bool:
        """Whether all neighbours in a watertight mesh face the same side of it."""
        _, directed = self._edges
        return bool((directed[::2] != directed[1::2]).all())

    @property
    def volume(self) -> float:
        """Volume of a watertight mesh, mm³, negative where normals point inwards."""
        # From a vertex of the mesh: far from the origin the terms would be larger than their sum.
        a, b, c = np.moveaxis(self.triangles - self.vertices[0], 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    def turned_outward(self) -> Mesh:
        """Turn the normals of a watertight mesh outwards."""
        turned = self
        if not self.is_winding_consistent:
            import trimesh  # slow to load

            fixed = trimesh.Trimesh(self.vertices, self.faces, process=False)
            with np.errstate(divide="ignore", invalid="ignore"):  # it divides by the volume of each body
                fixed.fix_normals()
            turned = Mesh.of(fixed)
        return Mesh(turned.vertices, turned.faces[:, ::-1]) if turned.volume < 0.0 else turned

    def contains(self, points: Array) -> BoolArray:
        """Tell which points, (n, 3) mm, lie inside a watertight mesh, and not on its surface; (n,).

        From inside, both halves of a line through the point meet the surface an odd number of times. Where
        only one does, the line passes an edge, and the solid angle decides.
        """
        from fiveaxis.cam.mesh import kernels

        corners, places = product(self.triangles, LINE.T), product(points, LINE.T)
        (low_x, low_y), (high_x, high_y) = corners[:, :, :2].min(axis=1).T, corners[:, :, :2].max(axis=1).T
        inside = ((points > self.bounds[0]) & (points < self.bounds[1])).all(axis=1)
        for row in np.flatnonzero(inside):
            x, y, _ = places[row]
            near = corners[(low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)] - places[row]
            a, b, c = near.transpose(1, 2, 0)
            # Twice the areas opposite the corners, seen along the line.
            areas = np.stack([p[0] * q[1] - p[1] * q[0] for p, q in ((b, c), (c, a), (a, b))])
            met = (areas > 0.0).all(axis=0) | (areas < 0.0).all(axis=0)
            heights = (areas * near[:, :, 2].T).sum(axis=0)[met] / areas.sum(axis=0)[met]
            above, below = ((side > 0.0).sum() % 2 == 1 for side in (heights, -heights))
            inside[row] = above if above == below else kernels.encloses(self.triangles, points[row])
        return inside


def triangle_areas(triangles: Array) -> Array:
    """Compute the areas of triangles, (f, 3, 3) mm → (f,) mm²."""
    doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(np.linalg.norm(doubled, axis=1) / 2.0)
