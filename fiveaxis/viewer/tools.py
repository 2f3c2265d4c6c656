"""Tools in the scene: cutter, shank and holder, each a body of revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.tool import CUTTER, HOLDER, SHANK
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.sides import Side
from fiveaxis.viewer.solids import revolve
from fiveaxis.viewer.tool_motion import KeyFrames, Poses, tool_frames

# What is drawn above the cutting edges where nobody has said what holds the tool, diameters.
SHANK_LENGTH = 4.0
CUTTER_COLOURS = {"after": 0xE8C468, "before": 0xE07A5F}
SHANK_COLOUR, HOLDER_COLOUR = 0xAEB6C2, 0x6F7C91


def add_tools(
    vis: Any, root: str, machine: Machine, tool: Tool, sides: Sequence[Side]
) -> dict[str, tuple[KeyFrames, Poses]]:
    """Add one tool per side, where it begins.

    Returns
    -------
    How each moves, by its node
    """
    moving = {}
    for side in sides:
        node = f"{side.node}/tool"
        for name, outline in tool_outlines(tool).items():
            colour = {CUTTER: CUTTER_COLOURS[side.node], HOLDER: HOLDER_COLOUR}.get(name, SHANK_COLOUR)
            _add_turned(vis, root, f"{node}/{name}", outline, colour)
        poses = tool_frames(machine, side.motion, side.frames.rows)
        vis[f"{root}/{node}"].set_transform(first_pose(*poses))
        moving[f"{root}/{node}"] = side.frames, poses
    return moving


def tool_outlines(tool: Tool) -> dict[str, Array]:
    """Give the outlines of a tool's parts, closed at the bottom: what is seen is what collides.

    Returns
    -------
    By name of the part, (m, 2), mm, as `Tool.parts`. Without a holder there is a shank all the same, as
    long as `SHANK_LENGTH` says: a cutter alone is hard to see.
    """
    outlines = {part.name: part.outline for part in tool.parts()}
    if tool.holder is None:
        thick, top = tool.cutter.outline()[-1].tolist()
        thick = thick if tool.shank_diameter is None else tool.shank_diameter / 2.0
        outlines[SHANK] = np.array([[thick, top], [thick, top + SHANK_LENGTH * tool.diameter]])
    return {name: np.vstack([[0.0, rows[0, 1]], rows]) for name, rows in outlines.items()}


def _add_turned(vis: Any, root: str, name: str, outline: Array, colour: int) -> None:
    shapes = load_meshcat().geometry
    body = shapes.TriangularMeshGeometry(*revolve(outline))
    material = shapes.MeshPhongMaterial(color=colour, flatShading=False)
    vis[f"{root}/{name}"].set_object(identify(shapes.Mesh(body, material), name))


def first_pose(centre: Array, quaternion: Array) -> Array:
    """Make the pose, (4, 4) mm, of the first key frame."""
    from scipy.spatial.transform import Rotation

    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(quaternion[0]).as_matrix()
    pose[:3, 3] = centre[0]
    return pose
