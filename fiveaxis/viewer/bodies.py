"""The machine's bodies in the scene, which stands still with the workpiece."""

from __future__ import annotations

from typing import Any

from fiveaxis.geometry import Array
from fiveaxis.kinematics import link_poses
from fiveaxis.machine import Body, FormShapingCode, Machine
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.solids import is_flat, make_geometry, place
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
    for name, body in zip(body_nodes(node, machine), machine.bodies, strict=True):
        vis[name].set_object(identify(_shown(body, machine.code), name))
        vis[name].set_transform(machine.machine_frame @ place(body.shape))
    return move_links(vis, node, machine, positions)


def move_links(vis: Any, node: str, machine: Machine, positions: Array) -> dict[str, Poses]:
    """Make the nodes of a machine's links, hidden and without bodies; as `add_bodies` otherwise."""
    if not machine.bodies:
        return {}
    carried = {body.link for body in machine.bodies}
    _, *others = link_poses(machine, positions).items()
    moving = {f"{node}/{link}": pose for link, pose in others if link in carried}
    for name, pose in moving.items():
        vis[name].set_transform(pose[0])
    vis[node].set_property("visible", False)
    return {name: _split(pose) for name, pose in moving.items()}


def body_nodes(node: str, machine: Machine) -> list[str]:
    """Name the node of every body below that of the machine, in the machine's order."""
    return [f"{node}/{body.link}/{i}" for i, body in enumerate(machine.bodies)]


def _shown(body: Body, code: FormShapingCode) -> Any:
    shapes = load_meshcat().geometry
    colour = BED_COLOUR
    if body.link in code.letters:
        colour = TABLE_COLOUR if body.link in code.table else HEAD_COLOUR
    material = shapes.MeshPhongMaterial(
        color=colour, opacity=OPACITY, flatShading=is_flat(body.shape), depthWrite=False
    )
    return shapes.Mesh(make_geometry(body.shape, MOST_TRIANGLES), material)


def _split(poses: Array) -> Poses:
    """Split poses, (f, 4, 4) mm, into positions and quaternions."""
    from scipy.spatial.transform import Rotation

    return poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat()
