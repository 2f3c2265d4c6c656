"""coal's answers to the questions of `fiveaxis.collision.pieces.PairQuery`, about the same shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from fiveaxis.geometry import Array, IntArray

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
