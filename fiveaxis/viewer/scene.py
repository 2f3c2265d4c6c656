"""The scene in the workpiece frame, mm: part, paths coloured by power, tools, machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Finding
from fiveaxis.geometry import Array
from fiveaxis.kinematics import tool_poses
from fiveaxis.viewer.bodies import (
    add_bodies,
    add_marks,
    add_part,
    add_surroundings,
    add_tools,
    body_nodes,
    gather,
    move_links,
)
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.lines import add_paths, shown_points
from fiveaxis.viewer.solids import corners
from fiveaxis.viewer.tool_motion import KeyFrames, Poses, Side, choose_sides, make_animation

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.posture.solution import Solution

ROOT = "fiveaxis"
# Largest size of the view with fixtures and tools, as a multiple of the part's at the same scale.
AROUND = 1.4
# Radius of a finding's mark, as a share of the path's size.
MARK = 0.018
BACKGROUND = ((0.16, 0.18, 0.22), (0.09, 0.10, 0.12))
# Size of the scene in the view, for which the viewer's lights and clipping are made.
SHOWN_SIZE = 2.4
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
# Direction across the view from left to right, workpiece frame.
RIGHT = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
# Side by side: distance of the two in sizes of the scene, and scale of each.
GAP, SMALLER = 1.35, 0.62
# Offset of the scene, alone, to the right of the middle, in its sizes: the legend is on the left.
ASIDE = 0.28
# Factor of the viewing distance with the machine. With its whole working space in view the part would be too
# small.
STEP_BACK = 4.0


@dataclass(frozen=True, eq=False)
class Layout:
    """A box of the workpiece frame that is in view.

    Parameters
    ----------
    low, high : (3,), mm, its corners
    size : mm, of what fills the view, as a rule its longest side
    """

    low: Array
    high: Array
    size: float

    def with_machine(self) -> Layout:
        """Step back, so that table and spindle are visible around the part."""
        return replace(self, size=STEP_BACK * self.size)

    def together(self) -> Array:
        """Return the transform, (4, 4), that scales the scene to the view, beside the legend."""
        aside = ASIDE * self.size * RIGHT
        return self._scaled(SHOWN_SIZE / self.size, (self.low + self.high) / 2.0 - aside)

    def apart(self) -> Array:
        """Return the transform, (4, 4), that shows the result and a baseline moved by `shift`."""
        middle = (self.low + self.high + self.shift()[:3, 3]) / 2.0
        return self._scaled(SMALLER * SHOWN_SIZE / self.size, middle)

    def shift(self) -> Array:
        """Return the transform, (4, 4) mm, that moves a baseline to the left of the result."""
        moved = np.eye(4)
        moved[:3, 3] = -GAP * self.size * RIGHT
        return moved

    @staticmethod
    def _scaled(scale: float, middle: Array) -> Array:
        scaled = np.diag([scale, scale, scale, 1.0])
        scaled[:3, 3] = -scale * middle
        return scaled


@dataclass(frozen=True, eq=False)
class Scene:
    """Contents and arrangement of a scene.

    Parameters
    ----------
    top : W, at the end of the colour scale
    sides : the result, and the baseline if there is one
    layout : in the view
    has_part, has_stock, has_machine, has_marks : whether they are in the scene
    fixtures : their names, in the order of their nodes
    copies : nodes, below the root, that are shown a second time beside the baseline → nodes of the copies
    """

    top: float
    sides: tuple[Side, ...]
    layout: Layout
    has_part: bool
    has_stock: bool
    has_machine: bool
    has_marks: bool
    fixtures: tuple[str, ...]
    copies: dict[str, str]


def build_scene(
    vis: Any,
    solution: Solution,
    part: str | Path | trimesh.Trimesh | None = None,
    *,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> Scene:
    """Build the meshcat scene of a solution, with its baseline and the machine hidden at first.

    Parameters
    ----------
    vis : a meshcat visualizer
    solution : to show
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures
    findings : of verification, on the solution's motion; shown as marks at their locations

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    """
    mesh, around = gather(part, surroundings)
    sides = choose_sides(solution)
    layout = _set_stage(vis, solution, mesh, _around_part(solution, around, sides))
    if mesh is not None:
        add_part(vis, ROOT, mesh)
    add_surroundings(vis, ROOT, around)
    top = add_paths(vis, ROOT, solution.machine, sides)
    marked = add_marks(vis, ROOT, findings, shown_points(solution.toolpath), MARK * _path_size(solution))
    _set_moving(vis, solution, sides)
    shared = ["part"] * (mesh is not None) + ["stock"] * (around.stock is not None)
    shared += [f"fixtures/{i}" for i in range(len(around.fixtures))]
    copies = {node: f"before/{node}" for node in (*shared, *body_nodes("machine", solution.machine))}
    return Scene(
        top=top,
        sides=sides,
        layout=layout,
        has_part=mesh is not None,
        has_stock=around.stock is not None,
        has_machine=bool(solution.machine.bodies),
        has_marks=marked,
        fixtures=tuple(fixture.name for fixture in around.fixtures),
        copies=copies if len(sides) > 1 else {},
    )


def _set_moving(vis: Any, solution: Solution, sides: Sequence[Side]) -> None:
    """Add tools and machine with their animation, and hide those of the baseline."""
    machine = solution.machine
    moving: dict[str, tuple[KeyFrames, Poses]] = add_tools(vis, ROOT, machine, solution.toolpath.tool, sides)
    for side in sides:
        positions = side.motion.positions[side.frames.rows]
        # The baseline's bodies are copies of the result's and differ only in motion.
        if side is sides[0]:
            links = add_bodies(vis, f"{ROOT}/machine", machine, positions)
        else:
            links = move_links(vis, f"{ROOT}/{side.node}/machine", machine, positions)
        moving |= {name: (side.frames, poses) for name, poses in links.items()}
    vis.set_animation(make_animation(vis, moving), play=True, repetitions=1000)
    for side in sides[1:]:
        vis[f"{ROOT}/{side.node}"].set_property("visible", False)


def _path_size(solution: Solution) -> float:
    """Return the longest side of the path's bounding box, mm, but at least the tool's diameter."""
    sides = np.ptp(solution.toolpath.pivot, axis=0)
    return max(float(sides.max()), solution.toolpath.tool.diameter)


def _around_part(solution: Solution, around: Surroundings, sides: Sequence[Side]) -> Array:
    """Return the points, (p, 3) mm, of fixtures and tools at the start, which the first view includes.

    Raises
    ------
    MeshError
        A fixture's mesh can't be read.
    """
    # An assumed shank may leave the view.
    height = max(float(part.outline[-1, 1]) for part in solution.toolpath.tool.parts())
    points = [corners(fixture.shape) for fixture in around.fixtures]
    for side in sides:
        tip, axis = tool_poses(solution.machine, side.motion.positions[side.frames.rows[:1]])
        points += [tip, tip + height * axis]
    return np.vstack(points)


def _set_stage(vis: Any, solution: Solution, mesh: trimesh.Trimesh | None, others: Array) -> Layout:
    """Scale the scene to the viewer, aim the camera, replace grid and axes.

    Parameters
    ----------
    others : (p, 3), mm, points in view besides part and path
    """
    points = solution.toolpath.pivot if mesh is None else np.vstack([solution.toolpath.pivot, mesh.vertices])
    own = max(float(np.ptp(points, axis=0).max()), solution.toolpath.tool.diameter)
    points = np.vstack([points, others])
    low, high = points.min(axis=0), points.max(axis=0)
    # Other points may come closer to the edges of the view than the part.
    layout = Layout(low, high, max(own, float((high - low).max()) / AROUND))
    vis[ROOT].set_transform(layout.together())
    for name in ("/Grid", "/Axes"):
        vis[name].set_property("visible", False)
    for key, colour in zip(("top_color", "bottom_color"), BACKGROUND, strict=True):
        vis["/Background"].set_property(key, list(colour))
    vis["/Cameras/default/rotated/<object>"].set_property("position", list(CAMERA))
    triad = load_meshcat().geometry.triad(layout.size / 6.0)
    vis[f"{ROOT}/zero"].set_object(identify(triad, "zero"))
    return layout
