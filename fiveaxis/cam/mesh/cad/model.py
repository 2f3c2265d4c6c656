"""The exact surfaces of a part's faces, beside the mesh that is made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, at_once, normalise
from fiveaxis.cam.mesh.cad.records import Face, Foot, Shell, Surfaces, Triangles, Trims
from fiveaxis.cam.mesh.distance import TriangleTree
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.cam.mesh.surface import barycentric, facet_normals

# mm: vertices of a mesh may be moved so far by merging them.
MERGED = 1e-6
# Rows of a task of a thread.
ROWS = 5_000
# Share of the way to the middle of its face by which a pole is left to find its normal.
OFF_POLE = 1e-5
# Distance of a face's edges' ends, as a share of the face's parameters, below which they are one.
WELDED = 1e-7


@dataclass(frozen=True, eq=False)
class Model:
    """Faces with exact surfaces, and the triangles of their mesh.

    Faces are counted from 0 here, those of the bodies that were taken; `Face.number` is what users see.

    Parameters
    ----------
    name : of the file
    faces : in the order of the file
    surfaces : of the faces
    corners, corners_uv : (t, 3, 3), mm, and (t, 3, 2): the triangles, anticlockwise seen from outside
    owner : (t,), face of each triangle
    trims : their borders
    shared : (k, 2), faces that share an edge
    meeting : pairs of bodies, by number, that touch or reach into each other
    """

    name: str
    faces: tuple[Face, ...]
    surfaces: Surfaces
    corners: Array
    corners_uv: Array
    owner: IntArray
    trims: Trims
    shared: IntArray
    meeting: tuple[tuple[int, int], ...] = ()

    @classmethod
    def of(
        cls,
        name: str,
        arrays: Mapping[str, Any],
        faces: tuple[Face, ...],
        meeting: tuple[tuple[int, int], ...] = (),
    ) -> Model:
        """Make a model of the arrays that `fiveaxis.cam.mesh.cad.reader` writes."""
        surfaces = Surfaces(*(np.ascontiguousarray(arrays[field]) for field in Surfaces._fields))
        box = np.array([face.box for face in faces])
        own, border = arrays["border"][:, 0].astype(np.int64), arrays["border"][:, 1:]
        order = np.argsort(own, kind="stable")
        own, border = own[order], _welded(own[order], border[order], box)
        ends = [_evaluate(surfaces, own, border[:, k : k + 2])[:, 0] for k in (0, 2)]
        corners = arrays["points"][arrays["triangles"]]
        # At a pole, two corners of a triangle are one.
        whole = (np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=2) > MERGED).all(axis=1)
        return cls(
            name=name,
            faces=faces,
            surfaces=surfaces,
            corners=corners[whole],
            corners_uv=arrays["uv"][arrays["triangles"]][whole],
            owner=arrays["owner"][whole],
            trims=Trims(box, np.hstack([border, *ends]), np.searchsorted(own, np.arange(len(faces) + 1))),
            shared=arrays["shared"],
            meeting=meeting,
        )

    def __deepcopy__(self, memo: dict[int, Any]) -> Model:
        """Return itself: nothing of it changes, and copies of a mesh copy its metadata."""
        return self

    @cached_property
    def bodies(self) -> dict[int, str]:
        """Names of its bodies, by number."""
        return {face.body: face.body_name for face in self.faces}

    @cached_property
    def sign(self) -> Array:
        """(f,), 1, or −1 where Su × Sv points into the material."""
        return np.where([face.reversed for face in self.faces], -1.0, 1.0)

    @cached_property
    def tree(self) -> TriangleTree:
        """Its triangles in a tree."""
        return TriangleTree.build(self.corners)

    @cached_property
    def shell(self) -> Shell:
        """Its faces for compiled loops, the triangles in the order of the tree."""
        order = self.tree.order
        mesh = Triangles(self.tree.triangles, self.corners_uv[order], self.owner[order], self.tree.boxes)
        return Shell(mesh, self.trims, self.surfaces)

    @cached_property
    def deviation(self) -> float:
        """Largest distance, mm, found between mesh and surfaces: at corners and middles of the triangles.

        It may exceed the tolerance that was asked for: Open Cascade keeps that on most surfaces only.
        """
        facets = facet_normals(self.corners)
        at_corners = self.evaluate(np.repeat(self.owner, 3), self.corners_uv.reshape(-1, 2))[:, 0]
        largest = float(np.linalg.norm(at_corners - self.corners.reshape(-1, 3), axis=1).max())
        for middle in ([0, 1, 2], [0, 1], [1, 2], [2, 0]):
            exact = self.evaluate(self.owner, self.corners_uv[:, middle].mean(axis=1))[:, 0]
            largest = max(largest, float(self.tree.distances(exact).max()))
            # Off the facet's plane: more than the distance at poles, whose parameters don't run evenly.
            flat = self.corners[:, middle].mean(axis=1)
            far = np.flatnonzero(np.abs(np.sum((exact - flat) * facets, axis=1)) > largest)
            feet, *_ = self._feet(flat[far], self.owner[far], 2.0 * largest)
            largest = max(largest, float(np.linalg.norm(feet[:, :3] - flat[far], axis=1).max(initial=0.0)))
        return largest

    @cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """Of each face, the other faces that it shares edges with."""
        both = np.vstack([self.shared, self.shared[:, ::-1]])
        both = np.unique(both[both[:, 0] != both[:, 1]], axis=0)
        ends = np.searchsorted(both[:, 0], np.arange(len(self.faces) + 1))
        return tuple(tuple(both[a:b, 1].tolist()) for a, b in pairwise(ends))

    def mesh(self) -> Mesh:
        """Return the triangles as a mesh in mm that knows this model; its vertices aren't merged."""
        return Mesh(self.corners.reshape(-1, 3), np.arange(3 * len(self.corners)).reshape(-1, 3), self)

    def evaluate(self, face: int | IntArray, uv: Array) -> Array:
        """Evaluate S, Su, Sv, Suu, Suv, Svv at parameters, (n, 2), of a face or (n,) faces; (n, 6, 3) mm."""
        return _evaluate(self.surfaces, _all(face, len(uv)), uv)

    def normals(self, face: int | IntArray, uv: Array) -> Array:
        """Compute the unit normals out of the material, (n, 3), at parameters, (n, 2)."""
        faces = _all(face, len(uv))
        values = self._beside_poles(faces, uv)
        return self.sign[faces, None] * normalise(np.cross(values[:, 1], values[:, 2]))

    def curvatures(self, face: int | IntArray, uv: Array) -> Array:
        """Compute the principal curvatures, (n, 2) 1/mm, the smaller first, at parameters, (n, 2).

        They are positive where the surface bends towards its outward normal: a cutter outside finds a hollow
        (concave) there, whose radius its own mustn't exceed.
        """
        faces = _all(face, len(uv))
        values = self._beside_poles(faces, uv)
        normal = self.sign[faces, None] * normalise(np.cross(values[:, 1], values[:, 2]))
        e, f, g = (np.sum(values[:, a] * values[:, b], axis=1) for a, b in ((1, 1), (1, 2), (2, 2)))
        l, m, n = (np.sum(values[:, k] * normal, axis=1) for k in (3, 4, 5))  # noqa: E741
        area = e * g - f * f
        mean, gauss = (e * n - 2.0 * f * m + g * l) / (2.0 * area), (l * n - m * m) / area
        root = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return np.stack([mean - root, mean + root], axis=1)

    def nearest(self, points: Array, faces: IntArray | None = None) -> Foot:
        """Find the points of the surfaces nearest to points, (n, 3) mm; `faces`, (n,), restricts each to one.

        A foot inside its face is exact to rounding; one on a border follows the chords of the border in the
        face's parameters, whose depth is a 64th of the mesh's.
        """
        points = np.ascontiguousarray(points, float)
        wanted = _all(-1 if faces is None else faces, len(points))
        return self._foot(points, *self._feet(points, wanted, 2.0 * self.deviation))

    def onto(self, points: Array, triangles: IntArray) -> Foot:
        """Move points of triangles, (n, 3) mm and (n,), onto the surface of each triangle's own face."""
        from fiveaxis.cam.mesh.cad import nearest

        shares = barycentric(points, self.corners[triangles])
        uv = np.sum(shares[:, :, None] * self.corners_uv[triangles], axis=1)
        points, faces, shell = np.ascontiguousarray(points, float), self.owner[triangles], self.shell
        feet = _in_parts(
            lambda rows: nearest.onto_all(points[rows], faces[rows], uv[rows], shell), len(points)
        )
        return self._foot(points, *feet)

    def distances(self, points: Array, bound: float) -> Array:
        """Compute the distance to the surfaces where it decides whether points, (n, 3) mm, are in a bound.

        Elsewhere it is that to the mesh, or any beyond the bound; (n,) mm.
        """
        from fiveaxis.cam.mesh.cad import nearest

        points, rest = np.ascontiguousarray(points, float), (bound, self.deviation, self.shell)
        (gaps,) = _in_parts(lambda rows: (nearest.gaps_all(points[rows], *rest),), len(points))
        return gaps

    def reach(self, start: Array, end: Array, limit: float, finest: float) -> float:
        """Compute how far, mm, a point can move from start to end with all surfaces `limit` away."""
        from fiveaxis.cam.mesh.cad import nearest

        return nearest.reach(start, end, limit, finest, self.deviation, self.shell)

    def part(self, kept: BoolArray) -> Model:
        """Return the model with some of its triangles, (t,), only; its faces keep their numbers."""
        return replace(
            self, corners=self.corners[kept], corners_uv=self.corners_uv[kept], owner=self.owner[kept]
        )

    def intervals(self, face: int, along: Literal["u", "v"], value: float) -> Array:
        """Find where a line of a face lies inside its border: (k, 2), ends of each piece, ascending.

        `along` is the parameter that runs on the line, `value` that of the other one.
        """
        border = self.trims.border[self.trims.first[face] : self.trims.first[face + 1]]
        run, stay = (0, 1) if along == "u" else (1, 0)
        a, b = border[:, stay], border[:, 2 + stay]
        cut = (a > value) != (b > value)
        share = (value - a[cut]) / (b[cut] - a[cut])
        ends = np.sort(border[cut, run] + share * (border[cut, 2 + run] - border[cut, run]))
        return ends[: len(ends) // 2 * 2].reshape(-1, 2)

    def _feet(self, points: Array, faces: IntArray, slack: float) -> tuple[Any, ...]:
        """Run `nearest.nearest_all` in threads."""
        from fiveaxis.cam.mesh.cad import nearest

        shell = self.shell
        return _in_parts(
            lambda rows: nearest.nearest_all(points[rows], faces[rows], slack, shell), len(points)
        )

    def _foot(self, points: Array, feet: Array, faces: IntArray, on_border: BoolArray) -> Foot:
        point, uv = feet[:, :3].copy(), feet[:, 3:].copy()
        distance = np.linalg.norm(points - point, axis=1)
        return Foot(point, self.normals(faces, uv), faces, uv, distance, on_border)

    def _beside_poles(self, faces: IntArray, uv: Array) -> Array:
        """Evaluate as `evaluate` does, at poles a little way towards the middle of the face."""
        values = self.evaluate(faces, uv)
        size = np.linalg.norm(np.cross(values[:, 1], values[:, 2]), axis=1)
        poles = np.flatnonzero(size <= 1e-9 * np.sum(values[:, 1:3] ** 2, axis=(1, 2)))
        if len(poles):
            middle = self.trims.box[faces[poles]].reshape(-1, 2, 2).mean(axis=2)
            inwards = uv[poles] + OFF_POLE * (middle - uv[poles])
            values[poles] = self.evaluate(faces[poles], inwards)
        return values


def _all(face: int | IntArray, count: int) -> IntArray:
    return np.ascontiguousarray(np.broadcast_to(np.asarray(face, np.int64), (count,)))


def _evaluate(surfaces: Surfaces, faces: IntArray, uv: Array) -> Array:
    from fiveaxis.cam.mesh.cad import kernels

    uv = np.ascontiguousarray(uv, float)
    (values,) = _in_parts(lambda rows: (kernels.evaluate_all(faces[rows], uv[rows], surfaces),), len(uv))
    return values


def _in_parts(work: Callable[[slice], tuple[Any, ...]], count: int) -> tuple[Any, ...]:
    """Run compiled work on parts of rows in threads, and join its arrays."""
    parts = [slice(begin, begin + ROWS) for begin in range(0, max(count, 1), ROWS)]
    done = at_once([partial(work, part) for part in parts])
    return done[0] if len(done) == 1 else tuple(np.concatenate(arrays) for arrays in zip(*done, strict=True))


def _welded(own: IntArray, border: Array, box: Array) -> Array:
    """Give ends of a face's edges that meet the same bits, or the even-odd rule fails at their height.

    The border, (s, 4), has u0, v0, u1, v1 of the segments of faces `own`, (s,), with boxes, (f, 4).
    """
    from scipy.spatial import cKDTree

    faces, ends = np.tile(own, 2), np.vstack([border[:, :2], border[:, 2:]])
    low, high = box[faces][:, [0, 2]], box[faces][:, [1, 3]]
    scaled = (ends - low) / np.maximum(high - low, 1e-300)
    pairs = cKDTree(np.column_stack([3.0 * faces, scaled])).query_pairs(WELDED, output_type="ndarray")
    first = np.arange(len(ends))
    np.minimum.at(first, pairs.max(axis=1), pairs.min(axis=1))
    return ends[first].reshape(2, -1, 2).transpose(1, 0, 2).reshape(-1, 4)
