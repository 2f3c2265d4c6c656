"""The scene, mm: the workpiece with its path, the machine's links and the tool, and what of them is in view.

The page's script moves the links by the chain (`chain.js`), so a scene has no frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Finding
from fiveaxis.geometry import Array, inverse_transform
from fiveaxis.kinematics import link_poses, tool_poses
from fiveaxis.machine import BED, Body, Machine
from fiveaxis.viewer.bodies import add_bodies, add_marks, add_part, add_surroundings, add_tool, gather
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.moves import Side, shown_points
from fiveaxis.viewer.schematic import schematic_bodies
from fiveaxis.viewer.solids import corners

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.posture.solution import Solution

ROOT = "fiveaxis"
STAGE = f"{ROOT}/stage"
# Radius of a finding's mark, as a share of the path's size.
MARK = 0.018
BACKGROUND = ((0.16, 0.18, 0.22), (0.09, 0.10, 0.12))
CAMERA = (1.75, 1.05, 1.75)  # x, up, -y
# Rows at which the space that the tool and the part need is looked at.
LOOKED_AT = 200
# Without a holder, this many diameters of the tool are in view; a schematic spindle begins there.
TOOL_IN_VIEW = 4.0


@dataclass(frozen=True, eq=False)
class Extent:
    """A box that is in view, mm."""

    low: Array
    high: Array

    @classmethod
    def of(cls, points: Array) -> Extent:
        """Return the box around points, (p, 3)."""
        return cls(points.min(axis=0), points.max(axis=0))

    @property
    def middle(self) -> Array:
        """(3,), mm."""
        return (self.low + self.high) / 2.0

    @property
    def size(self) -> float:
        """The longest side, mm."""
        return max(float((self.high - self.low).max()), 1e-3)


@dataclass(frozen=True, eq=False)
class Scene:
    """Contents and arrangement of a scene.

    Parameters
    ----------
    extents : what is in view: ``part`` in the workpiece frame, ``work`` and ``machine`` in the machine frame
    has_part, has_stock, has_marks : whether they are in the scene
    is_schematic : whether the machine is drawn from its chain alone
    fixtures : their names, in the order of their nodes
    """

    extents: dict[str, Extent]
    has_part: bool
    has_stock: bool
    has_marks: bool
    is_schematic: bool
    fixtures: tuple[str, ...]


def build_scene(
    vis: Any,
    solution: Solution,
    sides: Sequence[Side],
    part: str | Path | trimesh.Trimesh | None = None,
    *,
    surroundings: Surroundings | None = None,
    findings: Sequence[Finding] = (),
) -> Scene:
    """Build the meshcat scene of a solution, every axis at 0.

    Parameters
    ----------
    vis : a meshcat visualizer
    solution : to show
    sides : its motions, the result first
    part : mesh of the part in mm, or its file; None takes that of the surroundings
    surroundings : stock and fixtures
    findings : of verification, on the solution's motion; shown as marks at their locations

    Raises
    ------
    MeshError
        A mesh of the part, a fixture or the machine can't be read.
    """
    machine, path = solution.machine, solution.toolpath
    mesh, around = gather(part, surroundings)
    points = path.pivot if mesh is None else np.vstack([path.pivot, mesh.vertices])
    part_box = Extent.of(points)
    workpiece = f"{STAGE}/workpiece"
    if mesh is not None:
        add_part(vis, workpiece, mesh)
    add_surroundings(vis, workpiece, around)
    own = max(float(np.ptp(path.pivot, axis=0).max()), path.tool.diameter)
    marked = add_marks(vis, workpiece, findings, shown_points(path), MARK * own)
    reach = max(float(outlined.outline[-1, 1]) for outlined in path.tool.parts())
    if path.tool.holder is None:
        reach = max(TOOL_IN_VIEW * path.tool.diameter, min(reach, 2.0 * own))
    bodies = machine.bodies or schematic_bodies(machine, radius=max(0.75 * part_box.size, 40.0), reach=reach)
    add_bodies(vis, f"{STAGE}/links", machine, bodies)
    add_tool(vis, f"{STAGE}/tool", path.tool, machine.tool_length)
    fixed = [corners(fixture.shape) for fixture in around.fixtures]
    extents = _extents(machine, sides, np.vstack([_box_corners(part_box), *fixed]), reach, bodies)
    _set_stage(vis, max(own, part_box.size))
    return Scene(
        extents=extents,
        has_part=mesh is not None,
        has_stock=around.stock is not None,
        has_marks=marked,
        is_schematic=not machine.bodies,
        fixtures=tuple(fixture.name for fixture in around.fixtures),
    )


def _extents(
    machine: Machine, sides: Sequence[Side], points: Array, reach: float, bodies: Sequence[Body]
) -> dict[str, Extent]:
    """Return what is in view in either frame.

    Parameters
    ----------
    points : (p, 3), mm, workpiece frame, of part and fixtures
    reach : mm, of the tool above its tip
    """
    positions = sides[0].motion.positions[sides[0].on_path]
    rows = np.unique(np.linspace(0, len(positions) - 1, LOOKED_AT).astype(np.int64))
    tip, axis = tool_poses(machine, positions[rows])
    tool = np.stack([tip, tip + reach * axis], axis=1)
    beds = link_poses(machine, positions[rows])[BED]
    moved = []
    for ends, bed in zip(tool, beds, strict=True):
        to_machine = machine.setup.frame @ inverse_transform(bed)
        moved.append(np.vstack([points, ends]) @ to_machine[:3, :3].T + to_machine[:3, 3])
    drawn = [corners(body.shape) for body in bodies]
    work = np.vstack(moved)
    return {
        "part": Extent.of(np.vstack([points, tool.reshape(-1, 3)])),
        "work": Extent.of(work),
        "machine": Extent.of(np.vstack([work, *drawn])),
    }


def _box_corners(box: Extent) -> Array:
    choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    return np.asarray(np.where(choice == 0, box.low, box.high))


def _set_stage(vis: Any, size: float) -> None:
    """Aim the camera, replace grid and axes by a triad at the workpiece's zero."""
    for name in ("/Grid", "/Axes"):
        vis[name].set_property("visible", False)
    for key, colour in zip(("top_color", "bottom_color"), BACKGROUND, strict=True):
        vis["/Background"].set_property(key, list(colour))
    vis["/Cameras/default/rotated/<object>"].set_property("position", list(CAMERA))
    triad = load_meshcat().geometry.triad(size / 6.0)
    vis[f"{STAGE}/workpiece/zero"].set_object(identify(triad, "zero"))
