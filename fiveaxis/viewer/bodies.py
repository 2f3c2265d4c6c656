"""Solid objects of the scene: part, stock, fixtures, the machine's bodies, tools, and marks of findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Body, Machine
from fiveaxis.mesh import load_mesh
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.tool import CUTTER, HOLDER, SHANK
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.solids import is_flat, make_geometry, mesh_geometry, pose_of, revolve, scatter_marks

if TYPE_CHECKING:
    import trimesh

PART_COLOUR, STOCK_COLOUR, FIXTURE_COLOUR = 0xB8BEC8, 0x8FB89A, 0xA77BCA
BED_COLOUR, TABLE_COLOUR, HEAD_COLOUR = 0x7C828D, 0x5B8FC7, 0xC9A24B
CUTTER_COLOUR = 0xE8C468
SHANK_COLOUR, HOLDER_COLOUR = 0xAEB6C2, 0x6F7C91
MARK_COLOURS = {Severity.ERROR: 0xFF4D5E, Severity.WARNING: 0xFFB224, Severity.NOTE: 0x6CB8FF}
# Part, path and tool stay visible behind the machine.
MACHINE_OPACITY = 0.3
# Most triangles of part and stock, and of each fixture and machine body, which serve orientation only.
MOST_PART_TRIANGLES, MOST_TRIANGLES = 150_000, 20_000
# Diameters: length of the shank drawn if the tool has no holder.
SHANK_LENGTH = 4.0


def gather(
    part: str | Path | trimesh.Trimesh | None, surroundings: Surroundings | None
) -> tuple[trimesh.Trimesh | None, Surroundings]:
    """Return the part to show, and the surroundings without it.

    Parameters
    ----------
    part : mesh in mm, or its file; takes precedence over that of the surroundings
    surroundings : of the job

    Raises
    ------
    MeshError
        The part can't be read.
    """
    around = surroundings or Surroundings()
    shown = around.part if part is None else part
    mesh = load_mesh(shown, allow_open=True) if isinstance(shown, str | Path) else shown
    return mesh, replace(around, part=None)


def add_part(vis: Any, root: str, mesh: trimesh.Trimesh) -> None:
    """Add the finished part, half transparent."""
    geometry = mesh_geometry(mesh.vertices, mesh.faces, MOST_PART_TRIANGLES)
    look = {"color": PART_COLOUR, "opacity": 0.55, "flatShading": True, "depthWrite": False}
    _add(vis, f"{root}/part", "part", geometry, **look)


def add_surroundings(vis: Any, root: str, around: Surroundings) -> None:
    """Add stock, hidden at first, and fixtures.

    Raises
    ------
    MeshError
        A fixture's mesh can't be read.
    """
    if around.stock is not None:
        geometry = mesh_geometry(around.stock.vertices, around.stock.faces, MOST_PART_TRIANGLES)
        look = {"color": STOCK_COLOUR, "opacity": 0.25, "flatShading": True, "depthWrite": False}
        _add(vis, f"{root}/stock", "stock", geometry, **look).set_property("visible", False)
    # Numbered, as a name may contain any characters.
    for i, fixture in enumerate(around.fixtures):
        name = f"fixtures/{i}"
        geometry = make_geometry(fixture.shape, MOST_TRIANGLES)
        look = {"color": FIXTURE_COLOUR, "flatShading": is_flat(fixture.shape)}
        _add(vis, f"{root}/{name}", name, geometry, **look).set_transform(pose_of(fixture.shape))


def add_bodies(vis: Any, node: str, machine: Machine, bodies: Sequence[Body]) -> None:
    """Add the bodies of a machine, one object each, below a node per link; every axis at 0.

    Raises
    ------
    MeshError
        A body's mesh can't be read.
    """
    for i, body in enumerate(bodies):
        name = f"{node}/{body.link}/{i}"
        geometry = make_geometry(body.shape, MOST_TRIANGLES)
        look = {"color": _body_colour(body, machine), "opacity": MACHINE_OPACITY}
        look |= {"flatShading": is_flat(body.shape), "depthWrite": False}
        _add(vis, name, name, geometry, **look).set_transform(machine.machine_frame @ pose_of(body.shape))


def add_tool(vis: Any, node: str, tool: Tool, length: float = 0.0) -> None:
    """Add a tool, each part a body of revolution about z, with its tip at zero.

    Parameters
    ----------
    length : mm, from the spindle's gauge point to the tip; 0 where it isn't known
    """
    shapes = load_meshcat().geometry
    for part, outline in tool_outlines(tool, length).items():
        name = f"{node}/{part}"
        colour = {CUTTER: CUTTER_COLOUR, HOLDER: HOLDER_COLOUR}.get(part, SHANK_COLOUR)
        geometry = shapes.TriangularMeshGeometry(*revolve(outline))
        _add(vis, name, name, geometry, color=colour, flatShading=False)


def tool_outlines(tool: Tool, length: float = 0.0) -> dict[str, Array]:
    """Return the outlines of a tool's parts, closed at the bottom, as collision checks use them.

    Returns
    -------
    By name of the part, (m, 2), mm, as `Tool.parts`; a tool without a holder gets a shank of `SHANK_LENGTH`,
    as a cutter alone is hard to see
    """
    outlines = {part.name: part.outline for part in tool.parts()}
    if tool.holder is None:
        thick, top = tool.cutter.outline()[-1].tolist()
        thick = thick if tool.shank_diameter is None else tool.shank_diameter / 2.0
        end = max(length, top) if length else top + SHANK_LENGTH * tool.diameter
        outlines[SHANK] = np.array([[thick, top], [thick, end]])
    return {name: np.vstack([[0.0, rows[0, 1]], rows]) for name, rows in outlines.items()}


def add_marks(vis: Any, root: str, findings: Sequence[Finding], points: Array, radius: float) -> bool:
    """Add the findings' marks, one object per severity, visible through everything.

    Parameters
    ----------
    vis : a meshcat visualizer
    root : node above the marks
    findings : of the result; those without a location get no mark
    points : (n, 3), mm, where the result's locations are drawn
    radius : mm, of a mark

    Returns
    -------
    Whether there is any mark
    """
    shapes = load_meshcat().geometry
    marked = False
    for severity, colour in MARK_COLOURS.items():
        found = (f.place.location for f in findings if f.severity is severity)
        rows = sorted({row for row in found if row is not None and 0 <= row < len(points)})
        if rows:
            name, marked = f"marks/{severity}", True
            body = shapes.TriangularMeshGeometry(*scatter_marks(points[rows], radius))
            # Transparent objects are drawn last; without a depth test nothing hides them.
            material = shapes.MeshBasicMaterial(color=colour, transparent=True, depthTest=False)
            vis[f"{root}/{name}"].set_object(identify(shapes.Mesh(body, material), name))
    return marked


def _add(vis: Any, path: str, name: str, geometry: Any, **look: Any) -> Any:
    """Add a lit object, identified by a name, at a path, and return its node."""
    shapes = load_meshcat().geometry
    node = vis[path]
    node.set_object(identify(shapes.Mesh(geometry, shapes.MeshPhongMaterial(**look)), name))
    return node


def _body_colour(body: Body, machine: Machine) -> int:
    if body.link not in machine.code.letters:
        return BED_COLOUR
    return TABLE_COLOUR if body.link in machine.code.table else HEAD_COLOUR
