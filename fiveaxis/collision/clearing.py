"""The collision mask of the optimiser, built from the bodies around the tool."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np

from fiveaxis.collision.accessibility import Accessibility
from fiveaxis.collision.obstacles import Obstacle
from fiveaxis.collision.solids import Solid, tool_solids
from fiveaxis.collision.surroundings import Clearances, Surroundings
from fiveaxis.geometry import Array, inverse_transform, product
from fiveaxis.machine import Box, Cylinder, Machine, MeshShape
from fiveaxis.mesh import load_mesh
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.toolpath.tool import CUTTER, SHANK

logger = logging.getLogger(__name__)

# mm: allowed depth of the cutter in the part, which it touches.
GOUGE = 0.01
HEAD = "head"
# mm and 1: a cylinder of the head this near to the tool axis, and this parallel to it, turns with the tool.
OFF_AXIS, OFF_DIRECTION = 1e-6, 1e-9
# Sides of the prism around a cylinder; its edges lie up to 0.12 % of the radius outside.
SIDES = 64


def find_accessible(
    toolpath: Toolpath, machine: Machine, surroundings: Surroundings, *, extra: float = 0.0
) -> Accessibility | None:
    """Build the mask that admits postures in which the tool is clear of everything on the workpiece side.

    Cutter, shank, holder and the head's cylinders about the tool axis are tested against part, fixtures, the
    bodies that move with the workpiece and, except the cutter, the stock. Other bodies, such as a trunnion,
    depend on the axis values; only verification tests them.

    Parameters
    ----------
    toolpath : with its tool, in the zone of the cutter that touches (`Constraints.zoned`)
    machine : with its bodies
    surroundings : with the clearances
    extra : mm, added to every clearance

    Returns
    -------
    None if there are no obstacles, or nothing that could touch them: a bare ball covers the same space at
    any lean

    Raises
    ------
    MeshError
        A fixture's or body's mesh can't be read.
    """
    tool, clearances = toolpath.tool, surroundings.clearances
    head = [solid.grown(clearances.machine + extra) for solid in head_solids(machine)]
    obstacles = []
    for name, mesh in surroundings.meshes.items():
        solids = [*_solids_above_cut(tool, clearances, extra), *head]
        if name == "part":
            solids.insert(0, _cutter_in_cut(tool))
        obstacles.append(Obstacle.build(name, mesh.triangles, solids))
    around = [(fixture.name, shape_triangles(fixture.shape)) for fixture in surroundings.fixtures]
    solids = [solid.grown(clearances.by_kind[solid.name] + extra) for solid in tool_solids(tool)]
    for name, triangles in (*around, *_table_bodies(machine)):
        obstacles.append(Obstacle.build(name, triangles, [*solids, *head]))
    obstacles = [obstacle for obstacle in obstacles if obstacle.solids]
    _log_obstacles(toolpath, obstacles)
    return Accessibility(toolpath, machine, obstacles) if obstacles else None


def _log_obstacles(toolpath: Toolpath, obstacles: list[Obstacle]) -> None:
    names = ", ".join(obstacle.name for obstacle in obstacles) or "nothing that a leaning tool could touch"
    logger.info("postures of %d locations are kept clear of %s", len(toolpath), names)
    for obstacle in obstacles:
        solids = ", ".join(dict.fromkeys(solid.name for solid in obstacle.solids))
        logger.debug("%s is tested against %s", obstacle.name, solids)


def head_solids(machine: Machine) -> Iterator[Solid]:
    """Yield the head's cylinders about the tool axis, such as the spindle nose."""
    for body in machine.bodies:
        if body.link != machine.code.links[-1] or not isinstance(body.shape, Cylinder):
            continue
        frame = product(inverse_transform(machine.chain.tool_home), machine.machine_frame, body.shape.frame)
        on_axis = np.hypot(frame[0, 3], frame[1, 3]) < OFF_AXIS and abs(frame[2, 2]) > 1.0 - OFF_DIRECTION
        if on_axis:
            low, high = frame[2, 3] + np.array([-0.5, 0.5]) * body.shape.height
            yield Solid(HEAD, np.array([[low, body.shape.radius, high, body.shape.radius]]))


def _cutter_in_cut(tool: Tool) -> Solid:
    """Build the portion of the cutter that a lean could push into the part; a ball turns in place."""
    cutter = tool.cutter
    solid = tool_solids(tool)[0].grown(-GOUGE)
    if not cutter.is_ball:
        return solid
    if cutter.length is None:
        return Solid(CUTTER, solid.frusta[:0])
    ball = cutter.zones[0].outline()[-1, 1]
    return Solid(CUTTER, solid.frusta[solid.frusta[:, 0] >= ball - GOUGE])


def _solids_above_cut(tool: Tool, clearances: Clearances, extra: float) -> Iterator[Solid]:
    """Yield shank and holder, grown by their clearance to part and stock.

    The shank starts at the cutter, which touches: its clearance grows from 0 over a length of its own radius.
    """
    for solid in tool_solids(tool)[1:]:
        margin = clearances.by_kind[solid.name] + extra
        if solid.name != SHANK:
            yield solid.grown(margin)
            continue
        low, radius, high, _ = solid.frusta[0]
        top = min(low + radius, high)
        cone = [low, radius, top, radius + margin * (top - low) / radius]
        rest = [top, cone[3], high, cone[3]]
        yield Solid(SHANK, np.array([cone, rest] if high > top else [cone]))


def _table_bodies(machine: Machine) -> Iterator[tuple[str, Array]]:
    """Yield name and triangles, (f, 3, 3) mm, workpiece frame, of bodies that move with the workpiece."""
    for number, body in enumerate(machine.bodies):
        if body.link == machine.code.links[0]:
            frame = machine.machine_frame
            yield (
                f"{body.link} body {number}",
                product(shape_triangles(body.shape), frame[:3, :3].T) + frame[:3, 3],
            )


def shape_triangles(shape: Box | Cylinder | MeshShape) -> Array:
    """Triangulate a shape, (f, 3, 3) mm, in the frame that it is placed in; a cylinder's prism contains it.

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
    return np.asarray(product(triangles, frame[:3, :3].T) + frame[:3, 3])
