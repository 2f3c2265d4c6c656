"""coal's answers to the questions of `check.collision.pieces.PairQuery`; shapes of both, and poses."""

from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from fiveaxis.base import Array, IntArray
from fiveaxis.check.collision.pieces import box_piece, cylinder_piece, hull_piece, mesh_piece, revolved_pieces

HERE = np.eye(4)

# Largest number of contacts of one query, of which the deepest counts.
MOST_CONTACTS = 4096


def load_coal() -> Any:
    """Import coal, or skip the test: its wheels are for Linux and macOS."""
    return pytest.importorskip("coal")


def coal_box(size: Array) -> Any:
    return load_coal().Box(*np.asarray(size, dtype=float))


def coal_cylinder(radius: float, height: float) -> Any:
    return load_coal().Cylinder(radius, height)


def coal_hull(points: Array) -> Any:
    coal, hull = load_coal(), ConvexHull(points)
    number = np.full(len(points), -1)
    number[hull.vertices] = np.arange(len(hull.vertices))
    corners, faces = points[hull.vertices], number[hull.simplices]
    a, b, c = (corners[faces[:, i]] for i in range(3))
    inward = np.sum(np.cross(b - a, c - a) * (a - corners.mean(axis=0)), axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        vertices.append(corner)
    for face in faces.tolist():
        triangles.append(coal.Triangle(*face))
    return coal.Convex(vertices, triangles)


def coal_mesh(vertices: Array, faces: IntArray) -> Any:
    tree = load_coal().BVHModelOBB()
    tree.beginModel(len(faces), len(vertices))
    tree.addVertices(np.ascontiguousarray(vertices, dtype=float))
    tree.addTriangles(np.ascontiguousarray(faces, dtype=np.int64))
    tree.endModel()
    return tree


class CoalQuery:
    """Two of coal's shapes, queried at poses of the mover in the other's frame."""

    def __init__(self, mover: Any, other: Any) -> None:
        coal = load_coal()
        # coal holds no reference to the shapes.
        self._shapes = mover, other
        self._compute = coal.ComputeCollision(mover, other)
        self._pose, self._origin = coal.Transform3s(), coal.Transform3s()
        self._near, self._result = coal.CollisionRequest(), coal.CollisionResult()
        self._deep = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, MOST_CONTACTS)

    def nearer(self, pose: Array, margin: float) -> bool:
        self._near.security_margin = margin
        return self._run(pose, self._near)

    def depth(self, pose: Array) -> float:
        if not self._run(pose, self._deep):
            return 0.0
        return max(-float(contact.penetration_depth) for contact in self._result.getContacts())

    def gap(self, pose: Array, most: float, exact: float = 1e-7) -> float:
        """Bisect the gap, mm, to `exact`; `most` if it is larger."""
        if not self.nearer(pose, most):
            return most
        low, high = 0.0, most
        while high - low > exact:
            middle = (low + high) / 2.0
            low, high = (low, middle) if self.nearer(pose, middle) else (middle, high)
        return high

    def _run(self, pose: Array, request: Any) -> bool:
        self._pose.setTransform(pose[:3, :3], pose[:3, 3])
        self._result.clear()
        return bool(self._compute(self._pose, self._origin, request, self._result))


CONE, STEPPED = np.array([[4.0, 0.0], [10.0, 25.0]]), np.array([[3.0, 0.0], [9.0, 10.0], [9.0, 20.0]])


def ring(outline: Array) -> Array:
    """Corners of the polyhedron about a body of revolution."""
    turn = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
    around = np.column_stack([np.cos(turn), np.sin(turn)]) / np.cos(np.pi / 96)
    return np.concatenate([np.column_stack([r * around, np.full(96, h)]) for r, h in outline])


def rough() -> trimesh.Trimesh:
    """A block with uneven faces, and so with edges and corners of all kinds."""
    mesh = trimesh.creation.box(extents=(24.0, 40.0, 16.0)).subdivide().subdivide().subdivide()
    mesh.vertices += np.random.default_rng(0).normal(size=mesh.vertices.shape) * 0.3
    return mesh


def of_box(size):
    return coal_box(size), box_piece(np.array(size), HERE)


def of_cylinder(radius, height):
    return coal_cylinder(radius, height), cylinder_piece(radius, height, HERE)


def of_hull(points):
    return coal_hull(points), hull_piece(points, HERE)


def of_mesh(mesh):
    return coal_mesh(mesh.vertices, mesh.faces), mesh_piece(mesh.vertices, mesh.faces, HERE, closed=True)


SHAPES = {
    "box": lambda: of_box((20.0, 30.0, 40.0)),
    "plate": lambda: of_box((30.0, 8.0, 1.0)),
    "cylinder": lambda: of_cylinder(5.0, 40.0),
    "disc": lambda: of_cylinder(20.0, 3.0),
    "hull": lambda: of_hull(ring(CONE)),
    "stepped": lambda: of_hull(ring(STEPPED)),
    "mesh": lambda: of_mesh(rough()),
    "ball": lambda: of_mesh(trimesh.creation.icosphere(subdivisions=4, radius=25.0)),
    "cone": lambda: (coal_hull(ring(CONE)), revolved_pieces(CONE, HERE)[0]),
}
PAIRS = [
    "box-box",
    "cylinder-box",
    "disc-cylinder",
    "hull-box",
    "hull-cylinder",
    "hull-stepped",
    "plate-disc",
]
PAIRS += ["cylinder-mesh", "disc-ball", "hull-mesh", "box-mesh", "box-ball", "mesh-mesh", "mesh-ball"]


def touching_pose(query: CoalQuery, rng: np.random.Generator, reach: float) -> tuple[Array, Array] | None:
    """A pose on a random line at which the pieces begin to touch, and the line; None if they don't."""
    pose, line = np.eye(4), rng.normal(size=3)
    pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    line /= np.linalg.norm(line)
    aside = rng.normal(size=3) * 0.15 * reach
    aside -= (aside @ line) * line

    def at(place: float) -> Array:
        pose[:3, 3] = aside + place * line
        return pose

    places = np.linspace(1.2 * reach, 0.0, 40)
    first = next((i for i, place in enumerate(places) if query.nearer(at(place), 0.0)), 0)
    if not first:
        return None
    low, high = places[first], places[first - 1]
    while high - low > 1e-6:
        middle = (low + high) / 2.0
        low, high = (middle, high) if query.nearer(at(middle), 0.0) else (low, middle)
    return at(low).copy(), line


def poses_of(query: CoalQuery, reach: float, count: int) -> list[Array]:
    """Poses far, near, a hair's breadth apart or into it, and deep, in turns."""
    rng, poses = np.random.default_rng(7), []
    while len(poses) < count:
        if (found := touching_pose(query, rng, reach)) is not None:
            away = (rng.uniform(5, 30), rng.uniform(0, 2), rng.uniform(-0.01, 0.01), -rng.uniform(0.1, 3))
            pose, line = found
            pose[:3, 3] += away[len(poses) % 4] * line
            poses.append(pose)
    return poses
