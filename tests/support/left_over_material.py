"""What a ball leaves of the faces of a model, by brute force: no formula of planner or quality is used."""

from collections.abc import Sequence

import numpy as np

from fiveaxis.cam import Model, TriangleTree
from fiveaxis.model import Toolpath

# Halvings of the height of what is left.
HALVINGS = 25


# mm: a ball that would sink deeper into the part has no room.
ROOM = 0.01


def left_over(path: Toolpath, model: Model, faces: Sequence[int], count: int = 4000) -> np.ndarray:
    """Find how high material is left above random points of faces at which the ball has room, (n,) mm.

    A place above a point is cut if the straight moves of the ball's centre come nearer to it than the radius.
    """
    cut = np.flatnonzero(path.cutting[1:] & path.cutting[:-1])
    moves = np.stack([path.pivot[cut], path.pivot[cut + 1], path.pivot[cut + 1]], axis=1)
    tree, rng = TriangleTree.build(moves), np.random.default_rng(0)
    rows = np.flatnonzero(np.isin(model.owner, faces))
    corners = model.corners[rows]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rows = rng.choice(rows, count, p=area / area.sum())
    uv = np.einsum("ij,ijk->ik", rng.dirichlet((1.0, 1.0, 1.0), count), model.corners_uv[rows])
    points, normals = model.evaluate(model.owner[rows], uv)[:, 0], model.normals(model.owner[rows], uv)
    radius = path.tool.radius
    has_room = model.nearest(points + radius * normals).distance >= radius - ROOM
    points, normals = points[has_room], normals[has_room]
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        is_cut = tree.distances(points + middle[:, None] * normals) < radius
        low, high = np.where(is_cut, low, middle), np.where(is_cut, middle, high)
    return high
