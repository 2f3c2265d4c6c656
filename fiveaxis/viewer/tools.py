"""Tools in the scene: cutter, shank and holder, each a body of revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Tool
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
            colour = {"cutter": CUTTER_COLOURS[side.node], "holder": HOLDER_COLOUR}.get(name, SHANK_COLOUR)
            _add_turned(vis, root, f"{node}/{name}", outline, colour)
        poses = tool_frames(machine, side.motion, side.frames.rows)
        vis[f"{root}/{node}"].set_transform(first_pose(*poses))
        moving[f"{root}/{node}"] = side.frames, poses
    return moving


def tool_outlines(tool: Tool) -> dict[str, Array]:
    """Cut a tool's outline into what cuts, what is clamped and what clamps it.

    Returns
    -------
    ``cutter``, ``shank`` where there is a length of it, ``holder`` where one is known: (m, 2), mm, as
    `Tool.outline`. Without a holder the shank is as long as `SHANK_LENGTH` says.
    """
    cutter = tool.cutter.outline()
    top = float(cutter[-1, 1])
    shank = (tool.shank_diameter or 2.0 * float(cutter[-1, 0])) / 2.0
    end = top + SHANK_LENGTH * tool.diameter if tool.holder is None else tool.holder.stick_out
    parts = {"cutter": cutter}
    if end > top:
        parts["shank"] = np.array([[0.0, top], [shank, top], [shank, end]])
    if tool.holder is not None:
        whole = tool.outline()
        # Beside the cutter's rows stand two of the shank; all others are the holder's.
        parts["holder"] = np.vstack([[[0.0, end]], whole[len(cutter) + 2 :]])
    return parts


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
