"""Shapes of bodies as triangles."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Box, Cylinder, MeshShape
from fiveaxis.mesh import load_mesh

# Sides of a cylinder; its corners lie outside of it by up to 0.12 % of the radius, so that nothing is missed.
SIDES = 64


def shape_triangles(shape: Box | Cylinder | MeshShape) -> Array:
    """Cover a shape with triangles, (f, 3, 3) mm, in the frame that it is placed in.

    Raises
    ------
    MeshError
        Its mesh can't be read.
    """
    import trimesh

    if isinstance(shape, MeshShape):
        triangles = shape.scale * load_mesh(shape.file, allow_open=True).triangles
    elif isinstance(shape, Box):
        triangles = trimesh.creation.box(extents=shape.size).triangles
    else:
        outside = shape.radius / np.cos(np.pi / SIDES)
        triangles = trimesh.creation.cylinder(outside, shape.height, sections=SIDES).triangles
    frame = shape.frame
    return np.asarray(triangles @ frame[:3, :3].T + frame[:3, 3])
