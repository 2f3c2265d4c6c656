"""The scene: part, paths coloured by energy, tools; all in the workpiece frame, mm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.contour import load_mesh
from fiveaxis.geometry import Array
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.viewer.bodies import add_bodies, revolve
from fiveaxis.viewer.colours import colour_top, energy_density, move_colours
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.thinning import thin_mesh
from fiveaxis.viewer.tool_motion import KeyFrames, Poses, choose_frames, make_animation, tool_frames

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.posture.solution import Solution

PREFERRED_BASELINES = ("as-programmed", "normal")
ROOT = "fiveaxis"
# The scene is shown at this size, whatever the part's: lights and clipping of the viewer are made for it.
SHOWN_SIZE = 2.4
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
SHANK_LENGTH = 4.0  # diameters
# Paths of contacts are lifted by this share of the tool's radius, or the part would hide half of every line.
LIFT = 0.04
PART_COLOUR, TOOL_COLOUR, BEFORE_COLOUR = 0xB8BEC8, 0xAEB6C2, 0xE07A5F
BACKGROUND = ((0.16, 0.18, 0.22), (0.09, 0.10, 0.12))


@dataclass(frozen=True)
class Legend:
    """What the scene's colours and objects mean.

    Parameters
    ----------
    top : J/mm of the last colour
    pace : machine seconds in one second of the show
    before : name of the baseline that is shown, None where there is none
    has_part, has_machine : whether the part and the machine's bodies are in the scene
    """

    top: float
    pace: float
    before: str | None
    has_part: bool
    has_machine: bool


def build_scene(vis: Any, solution: Solution, part: str | Path | trimesh.Trimesh | None = None) -> Legend:
    """Put a solution into a meshcat scene.

    Parameters
    ----------
    vis : a meshcat visualizer
    solution : what to show; its baseline and the machine's bodies stand beside it, hidden at first
    part : mesh of the part in mm, or its file

    Returns
    -------
    What colours and objects mean.

    Raises
    ------
    MeshError
        The part or a mesh of the machine can't be read.
    """
    mesh = load_mesh(part, allow_open=True) if isinstance(part, str | Path) else part
    motions = {"after": solution.motion}
    before = next((name for name in PREFERRED_BASELINES if name in solution.compared), None)
    if before is not None:
        motions["before"] = solution.compared[before].motion
    _set_stage(vis, solution, mesh)
    if mesh is not None:
        _add_part(vis, mesh)
    top = _add_paths(vis, solution, motions)
    frames = choose_frames(solution.motion)
    moving = _add_tools(vis, solution, motions, frames)
    moving |= add_bodies(vis, f"{ROOT}/machine", solution.machine, solution.motion.positions[frames.rows])
    vis.set_animation(make_animation(vis, frames, moving), play=True, repetitions=1000)
    if before is not None:
        vis[f"{ROOT}/before"].set_property("visible", False)
    return Legend(top, frames.pace, before, mesh is not None, bool(solution.machine.bodies))


def _set_stage(vis: Any, solution: Solution, mesh: trimesh.Trimesh | None) -> None:
    """Scale the scene to the viewer, aim the camera, replace grid and axes."""
    points = solution.toolpath.pivot if mesh is None else np.vstack([solution.toolpath.pivot, mesh.vertices])
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(float((high - low).max()), solution.toolpath.tool.diameter)
    scale = SHOWN_SIZE / size
    to_view = np.diag([scale, scale, scale, 1.0])
    to_view[:3, 3] = -scale * (low + high) / 2.0
    vis[ROOT].set_transform(to_view)
    for name in ("/Grid", "/Axes"):
        vis[name].set_property("visible", False)
    for key, colour in zip(("top_color", "bottom_color"), BACKGROUND, strict=True):
        vis["/Background"].set_property(key, list(colour))
    vis["/Cameras/default/rotated/<object>"].set_property("position", list(CAMERA))
    triad = load_meshcat().geometry.triad(size / 6.0)
    vis[f"{ROOT}/zero"].set_object(identify(triad, "zero"))


def _add_part(vis: Any, mesh: trimesh.Trimesh) -> None:
    shapes = load_meshcat().geometry
    vertices, faces = thin_mesh(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces))
    material = shapes.MeshPhongMaterial(color=PART_COLOUR, opacity=0.55, flatShading=True, depthWrite=False)
    body = shapes.Mesh(shapes.TriangularMeshGeometry(vertices, faces), material)
    vis[f"{ROOT}/part"].set_object(identify(body, "part"))


def _add_paths(vis: Any, solution: Solution, motions: dict[str, Motion]) -> float:
    """Add one line object per motion, coloured on one scale; return the scale's top, J/mm."""
    shapes = load_meshcat().geometry
    path = solution.toolpath
    densities = {name: energy_density(solution.machine, m, path) for name, m in motions.items()}
    top = colour_top(*densities.values())
    points = shown_points(path)
    ends = np.stack([points[:-1], points[1:]], axis=1).reshape(-1, 3)
    for name, density in densities.items():
        colours = np.repeat(move_colours(density, path, top)[1:], 2, axis=0)
        lines = shapes.PointsGeometry(_columns(ends), color=_columns(colours))
        way = shapes.LineSegments(lines, shapes.LineBasicMaterial(vertexColors=True))
        vis[f"{ROOT}/{name}/path"].set_object(identify(way, f"{name}/path"))
    return top


def shown_points(path: Toolpath) -> Array:
    """Give the line to draw, (n, 3) mm: contacts, a little lifted, or ball centres if one is unknown."""
    lifted: Array = path.contact + LIFT * path.tool.radius * path.normal
    if not np.isfinite(lifted[path.cutting]).all():
        return path.pivot
    return np.where(np.isfinite(lifted).all(axis=1, keepdims=True), lifted, path.pivot)


def _add_tools(
    vis: Any, solution: Solution, motions: dict[str, Motion], frames: KeyFrames
) -> dict[str, Poses]:
    """Add one tool per motion; return how each moves, by its node."""
    tool = solution.toolpath.tool
    colours = {"after": TOOL_COLOUR, "before": BEFORE_COLOUR}
    tools = {}
    for name, motion in motions.items():
        _add_tool(vis, f"{name}/tool", tool, colours[name])
        poses = tool_frames(solution.machine, motion, frames.rows)
        vis[f"{ROOT}/{name}/tool"].set_transform(_first_pose(*poses))
        tools[f"{ROOT}/{name}/tool"] = poses
    return tools


def _add_tool(vis: Any, name: str, tool: Tool, colour: int) -> None:
    """Add cutter, shank and holder as one body of revolution, its tip at 0 and its axis along +z."""
    shapes = load_meshcat().geometry
    outline = tool.outline()
    if tool.holder is None:
        shank = (tool.shank_diameter or 2.0 * float(outline[-1, 0])) / 2.0
        top = outline[-1, 1] + SHANK_LENGTH * tool.diameter
        outline = np.vstack([outline, [[shank, outline[-1, 1]], [shank, top]]])
    body = shapes.TriangularMeshGeometry(*revolve(outline))
    material = shapes.MeshPhongMaterial(color=colour, flatShading=False)
    vis[f"{ROOT}/{name}/body"].set_object(identify(shapes.Mesh(body, material), f"{name}/body"))


def _first_pose(centre: Array, quaternion: Array) -> Array:
    x, y, z, w = quaternion[0]
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = centre[0]
    return pose


def _columns(rows: Array) -> Any:
    """Turn rows into the (3, n) single-precision columns that meshcat packs."""
    return np.asarray(rows, dtype=np.float32).T
