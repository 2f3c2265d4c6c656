"""The scene: part, paths coloured by energy, tools; all in the workpiece frame, mm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.contour import load_mesh
from fiveaxis.geometry import Array, IntArray
from fiveaxis.motion import Motion
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.viewer.colours import colour_top, energy_density, move_colours
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.tool_motion import ball_poses, choose_frames, make_animation

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
MOST_TRIANGLES = 150_000
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
    has_part : whether the part is in the scene
    """

    top: float
    pace: float
    before: str | None
    has_part: bool


def build_scene(vis: Any, solution: Solution, part: str | Path | trimesh.Trimesh | None = None) -> Legend:
    """Put a solution into a meshcat scene.

    Parameters
    ----------
    vis : a meshcat visualizer
    solution : what to show; its baseline stands beside it, hidden at first
    part : mesh of the part in mm, or its file

    Returns
    -------
    What colours and objects mean.

    Raises
    ------
    MeshError
        The part can't be read.
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
    pace = _add_tools(vis, solution, motions)
    if before is not None:
        vis[f"{ROOT}/before"].set_property("visible", False)
    return Legend(top, pace, before, mesh is not None)


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


def thin_mesh(vertices: Array, faces: IntArray, most: int = MOST_TRIANGLES) -> tuple[Array, IntArray]:
    """Merge neighbouring vertices of a mesh that is too fine to be shown, until few triangles are left.

    Parameters
    ----------
    vertices, faces : (v, 3) mm and (f, 3)
    most : number of triangles to stay below

    Returns
    -------
    vertices, faces : the same where the mesh is small enough; else on a grid as fine as `most` allows
    """
    cells = 1024
    thin = vertices, faces
    while len(thin[1]) > most:
        thin = _merge_cells(vertices, faces, cells)
        cells = cells * 3 // 4
    return thin


def _merge_cells(vertices: Array, faces: IntArray, cells: int) -> tuple[Array, IntArray]:
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    keys = np.round((vertices - low) / size * cells).astype(np.int64)
    _, first, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    joined = merged.reshape(-1)[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    # Triangles that fell onto each other are shown once.
    _, once = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    return vertices[first], kept[np.sort(once)]


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


def _add_tools(vis: Any, solution: Solution, motions: dict[str, Motion]) -> float:
    """Add one moving tool per motion; return the pace of the show."""
    frames = choose_frames(solution.motion)
    tool = solution.toolpath.tool
    colours = {"after": TOOL_COLOUR, "before": BEFORE_COLOUR}
    tools = {}
    for name, motion in motions.items():
        _add_tool(vis, f"{name}/tool", tool, colours[name])
        poses = ball_poses(solution.machine, motion, tool.radius, frames.rows)
        vis[f"{ROOT}/{name}/tool"].set_transform(_first_pose(*poses))
        tools[f"{ROOT}/{name}/tool"] = poses
    vis.set_animation(make_animation(vis, frames, tools), play=True, repetitions=1000)
    return frames.pace


def _add_tool(vis: Any, name: str, tool: Tool, colour: int) -> None:
    """Add ball and shank about the ball's centre, the shank along +z."""
    shapes = load_meshcat().geometry
    length = SHANK_LENGTH * tool.diameter
    parts = {"ball": shapes.Sphere(tool.radius), "shank": shapes.Cylinder(length, tool.radius)}
    for part, geometry in parts.items():
        material = shapes.MeshPhongMaterial(color=colour)
        vis[f"{ROOT}/{name}/{part}"].set_object(identify(shapes.Mesh(geometry, material), f"{name}/{part}"))
    # A cylinder stands along y about its middle.
    upright = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, length / 2.0], [0, 0, 0, 1]], dtype=float)
    vis[f"{ROOT}/{name}/shank"].set_transform(upright)


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
