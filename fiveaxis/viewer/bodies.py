"""The machine's bodies in the scene, which stands still with the workpiece."""

from __future__ import annotations

from typing import Any

import numpy as np

from fiveaxis.contour import load_mesh
from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import link_poses
from fiveaxis.machine import Body, Box, Cylinder, FormShapingCode, Machine, MeshShape
from fiveaxis.viewer.library import UPRIGHT, identify, load_meshcat
from fiveaxis.viewer.thinning import thin_mesh
from fiveaxis.viewer.tool_motion import Poses

BED_COLOUR, TABLE_COLOUR, HEAD_COLOUR = 0x7C828D, 0x5B8FC7, 0xC9A24B
# Part, path and tool stay in sight behind the machine.
OPACITY = 0.3
# A machine's mesh is there for orientation only, and a page carries all of them.
MOST_TRIANGLES = 20_000


def add_bodies(vis: Any, node: str, machine: Machine, positions: Array) -> dict[str, Poses]:
    """Add the bodies of a machine, hidden, one object each.

    Parameters
    ----------
    vis : a meshcat visualizer
    node : path under which a node per link, with its bodies, is made; nothing is if there are no bodies
    machine : its bodies
    positions : (f, k), mm and rad, axis values of the key frames

    Returns
    -------
    How the links with bodies move, by their node; the one that carries the workpiece doesn't and is left out

    Raises
    ------
    MeshError
        A body's mesh can't be read.
    """
    if not machine.bodies:
        return {}
    for i, body in enumerate(machine.bodies):
        name = f"{node}/{body.link}/{i}"
        vis[name].set_object(identify(_shown(body, machine.code), name))
        vis[name].set_transform(_frame(machine, body))
    carried = {body.link for body in machine.bodies}
    _, *others = link_poses(machine, positions).items()
    moving = {f"{node}/{link}": pose for link, pose in others if link in carried}
    for name, pose in moving.items():
        vis[name].set_transform(pose[0])
    vis[node].set_property("visible", False)
    return {name: _split(pose) for name, pose in moving.items()}


def _shown(body: Body, code: FormShapingCode) -> Any:
    shapes = load_meshcat().geometry
    colour = BED_COLOUR
    if body.link in code.letters:
        colour = TABLE_COLOUR if body.link in code.table else HEAD_COLOUR
    # A mesh has no normals of its own here, and cylinders have round ones.
    flat = isinstance(body.shape, MeshShape)
    material = shapes.MeshPhongMaterial(color=colour, opacity=OPACITY, flatShading=flat, depthWrite=False)
    return shapes.Mesh(_geometry(body), material)


def _geometry(body: Body) -> Any:
    shapes, shape = load_meshcat().geometry, body.shape
    if isinstance(shape, Box):
        return shapes.Box(list(shape.size))
    if isinstance(shape, Cylinder):
        return shapes.Cylinder(shape.height, shape.radius)
    mesh = load_mesh(shape.file, allow_open=True)
    vertices = shape.scale * np.asarray(mesh.vertices, dtype=float)
    return shapes.TriangularMeshGeometry(*thin_mesh(vertices, np.asarray(mesh.faces), MOST_TRIANGLES))


def _frame(machine: Machine, body: Body) -> Array:
    """Place a body in the workpiece frame, (4, 4) mm, every axis at 0."""
    frame = machine.machine_frame @ body.shape.frame
    return frame @ UPRIGHT if isinstance(body.shape, Cylinder) else frame


def _split(poses: Array) -> Poses:
    """Split poses, (f, 4, 4) mm, into positions and quaternions."""
    from scipy.spatial.transform import Rotation

    return poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat()


def revolve(outline: Array, sectors: int = 36) -> tuple[Array, IntArray]:
    """Turn an outline about the z axis into a closed body.

    Parameters
    ----------
    outline : (m, 2), mm, distance from the axis and height, from the bottom up
    sectors : of a turn

    Returns
    -------
    vertices : (v, 3), mm
    faces : (f, 3), indices of vertices, anticlockwise seen from outside
    """
    closed = np.vstack([outline, [[0.0, outline[-1, 1]]]])
    turn = np.linspace(0.0, 2.0 * np.pi, sectors, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    sides = closed[:, None, :1] * ring
    heights = np.repeat(closed[:, 1], sectors).reshape(len(closed), sectors, 1)
    vertices = np.concatenate([sides, heights], axis=2).reshape(-1, 3)
    level, sector = np.meshgrid(np.arange(len(closed) - 1), np.arange(sectors), indexing="ij")
    here, after = level * sectors + sector, level * sectors + (sector + 1) % sectors
    lower = np.stack([here, after, after + sectors], axis=-1).reshape(-1, 3)
    upper = np.stack([here, after + sectors, here + sectors], axis=-1).reshape(-1, 3)
    return vertices, np.concatenate([lower, upper])
