"""Bodies for coal: convex bodies, exact or as circumscribed polyhedra, and meshes as bounding-box trees."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fiveaxis.errors import MissingDependency
from fiveaxis.geometry import Array, IntArray, product, translation

# Sides of the polygon around a circle, 0.054 % wider at its corners, for shapes that coal hasn't got.
SECTORS = 96
# Largest number of contacts of one query, of which the deepest counts.
MOST_CONTACTS = 256


@dataclass(frozen=True, eq=False)
class Piece:
    """One rigid shape.

    Parameters
    ----------
    geometry : coal's object
    frame : (4, 4), mm, its own frame in the workpiece frame, every axis at 0
    low, high : (3,), mm, its bounding box in its own frame
    inner : (3,), mm, a point of it in its own frame
    triangles : (t, 3, 3), mm, own frame; None unless it is a mesh
    closed : whether its triangles enclose a volume
    """

    geometry: Any
    frame: Array
    low: Array
    high: Array
    inner: Array
    triangles: Array | None = None
    closed: bool = False

    @property
    def corners(self) -> Array:
        """(8, 3), mm, corners of its bounding box in its own frame."""
        return box_corners(self.low, self.high)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, mm."""
        return float(np.linalg.norm(self.high - self.low, axis=-1))

    @property
    def is_mesh(self) -> bool:
        """Whether it is a surface of triangles, open or closed."""
        return self.triangles is not None

    @property
    def memory(self) -> int:
        """Memory of a mesh with its tree, bytes; 0 for other shapes."""
        if self.triangles is None:
            return 0
        return int(load_coal().computeMemoryFootprint(self.geometry)) + self.triangles.nbytes


def box_corners(low: Array, high: Array) -> Array:
    """Return the corners, (8, 3) mm, of the box from its lowest to its highest coordinates, (3,) mm."""
    picks = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
    return np.where(picks == 1, high, low)


def load_coal() -> Any:
    """Import coal.

    Raises
    ------
    MissingDependency
        It isn't installed.
    """
    try:
        import coal
    except ModuleNotFoundError as fault:
        if fault.name != "coal":
            raise
        raise MissingDependency(
            "coal",
            "the check of collisions",
            "install the wheel `pin`, which contains it (Linux, macOS); on Windows use WSL",
        ) from None
    return coal


def box_piece(size: Array, frame: Array) -> Piece:
    """Build a box of size (3,) mm, centred on the origin of its frame."""
    half = np.asarray(size, dtype=float) / 2.0
    return Piece(load_coal().Box(*(2.0 * half)), frame, -half, half, np.zeros(3))


def cylinder_piece(radius: float, height: float, frame: Array) -> Piece:
    """Build a cylinder, mm, along z and centred on the origin of its frame."""
    half = np.array([radius, radius, height / 2.0])
    return Piece(load_coal().Cylinder(radius, height), frame, -half, half, np.zeros(3))


def revolved_pieces(outline: Array, frame: Array) -> list[Piece]:
    """Revolve an outline about the z axis, as one or more convex pieces.

    Cylinders are exact. In other shapes polygons of `SECTORS` sides replace the circles from outside, so the
    pieces contain the revolved outline.

    Parameters
    ----------
    outline : (m, 2), mm: distance from the axis and height, bottom up
    frame : (4, 4), mm, the frame with that z axis, in the workpiece frame
    """
    return [_revolved(run, frame) for run in convex_runs(outline)]


def convex_runs(outline: Array) -> list[Array]:
    """Split an outline, (m, 2) mm, where it turns inwards; parts without height are left out."""
    runs, begin = [], 0
    steps = np.diff(outline, axis=0)
    for i in range(1, len(steps)):
        before, after = steps[i - 1], steps[i]
        if before[0] * after[1] - before[1] * after[0] < -1e-12:
            runs.append(outline[begin : i + 1])
            begin = i
    runs.append(outline[begin:])
    return [run for run in runs if np.ptp(run[:, 1]) > 1e-9 and run[:, 0].max() > 0.0]


def _revolved(run: Array, frame: Array) -> Piece:
    radius, height = run.T
    low, high = float(height.min()), float(height.max())
    if np.ptp(radius) < 1e-12:
        middle = translation((0.0, 0.0, (low + high) / 2.0))
        return cylinder_piece(float(radius[0]), high - low, product(frame, middle))
    turn = np.linspace(0.0, 2.0 * np.pi, SECTORS, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)]) / np.cos(np.pi / SECTORS)
    points = np.concatenate(
        [np.column_stack([r * ring, np.full(SECTORS, h)]) for r, h in run[radius > 1e-9]]
        + [np.array([[0.0, 0.0, low], [0.0, 0.0, high]])]
    )
    return replace(_hull(points.tobytes()), frame=frame)


# One tool is checked along many moves, and its hulls take most of the time of a short move.
@lru_cache(maxsize=32)
def _hull(rows: bytes) -> Piece:
    """Build the convex hull of points, (v, 3) mm, in the workpiece frame; its shape is shared."""
    from scipy.spatial import ConvexHull

    coal = load_coal()
    points = np.frombuffer(rows).reshape(-1, 3)
    hull = ConvexHull(points)
    number = np.full(len(points), -1)
    number[hull.vertices] = np.arange(len(hull.vertices))
    corners, faces = points[hull.vertices], number[hull.simplices]
    middle = corners.mean(axis=0)
    a, b, c = (corners[faces[:, i]] for i in range(3))
    inward = np.sum(np.cross(b - a, c - a) * (a - middle), axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        vertices.append(corner)
    for face in faces.tolist():
        triangles.append(coal.Triangle(*face))
    shape = coal.Convex(vertices, triangles)
    return Piece(shape, np.eye(4), corners.min(axis=0), corners.max(axis=0), middle)


def mesh_piece(vertices: Array, faces: IntArray, frame: Array, *, closed: bool) -> Piece:
    """Build the bounding-box tree of a mesh.

    Parameters
    ----------
    vertices : (v, 3), mm, own frame
    faces : (t, 3), indices of vertices
    frame : (4, 4), mm, own frame in the workpiece frame, every axis at 0
    closed : whether it encloses a volume
    """
    points = np.ascontiguousarray(vertices, dtype=float)
    corners = np.ascontiguousarray(faces, dtype=np.int64)
    # Oriented boxes suffice for queries by distance and take half the memory of OBBRSS.
    tree = load_coal().BVHModelOBB()
    tree.beginModel(len(corners), len(points))
    tree.addVertices(points)
    tree.addTriangles(corners)
    tree.endModel()
    used = points[np.unique(corners)]
    low, high = used.min(axis=0), used.max(axis=0)
    return Piece(tree, frame, low, high, used[0], triangles=points[corners], closed=closed)


class PairQuery:
    """One pair of pieces, queried at many relative poses.

    Parameters
    ----------
    mover, other : the pieces; a pose is that of the mover's own frame in the other's own frame
    """

    def __init__(self, mover: Piece, other: Piece) -> None:
        coal = load_coal()
        # coal holds no reference to the shapes.
        self._pieces = mover, other
        self._compute = coal.ComputeCollision(mover.geometry, other.geometry)
        self._pose, self._origin = coal.Transform3s(), coal.Transform3s()
        self._near, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._deep = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, MOST_CONTACTS)
        self.count = 0

    def nearer(self, pose: Array, margin: float) -> bool:
        """Check whether the pieces overlap or are nearer to each other than a margin.

        Parameters
        ----------
        pose : (4, 4), mm
        margin : mm, 0 or more
        """
        self._near.security_margin = margin
        return self._run(pose, self._near)

    def depth(self, pose: Array) -> float:
        """Measure how far the mover would have to move to leave the triangle that it is deepest in.

        Returns
        -------
        mm, 0 if they don't overlap
        """
        if not self._run(pose, self._deep):
            return 0.0
        return max(-float(contact.penetration_depth) for contact in self._result.getContacts())

    def gap(self, pose: Array, most: float) -> float:
        """Measure the gap between pieces nearer than `most`, mm, to 1 % of that and never too large."""
        low, high = 0.0, most
        while high - low > 0.01 * most:
            middle = (low + high) / 2.0
            low, high = (low, middle) if self.nearer(pose, middle) else (middle, high)
        return low

    def _run(self, pose: Array, request: Any) -> bool:
        self.count += 1
        self._pose.setTransform(pose[:3, :3], pose[:3, 3])
        self._result.clear()
        return bool(self._compute(self._pose, self._origin, request, self._result))
