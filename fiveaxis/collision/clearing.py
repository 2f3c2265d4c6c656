"""From what stands around the tool to the mask that keeps it clear."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np

from fiveaxis.collision.accessibility import Accessibility
from fiveaxis.collision.obstacles import Obstacle
from fiveaxis.collision.shapes import shape_triangles
from fiveaxis.collision.solids import Solid, tool_solids
from fiveaxis.collision.surroundings import Clearances, Surroundings
from fiveaxis.geometry import Array
from fiveaxis.machine import BED, Cylinder, Machine
from fiveaxis.toolpath import Tool, Toolpath
from fiveaxis.toolpath.tool import CUTTER, SHANK

logger = logging.getLogger(__name__)

# mm: the cutter may reach so deep into the part; it touches it, after all.
GOUGE = 0.01
HEAD = "head"
# mm and 1: how far a cylinder of the head may be off the tool axis and still turn with it.
OFF_AXIS, OFF_DIRECTION = 1e-6, 1e-9


def find_accessible(
    toolpath: Toolpath, machine: Machine, surroundings: Surroundings, *, extra: float = 0.0
) -> Accessibility | None:
    """Make the mask that admits postures in which the tool is clear of all that stands with the workpiece.

    Cutter, shank, holder and cylinders of the head about the tool axis are held against part, fixtures, the
    bodies that move with the workpiece and, without the cutter, the stock. All else, a trunnion or a head of
    another shape, depends on where the axes stand, and only verification looks at it.

    Parameters
    ----------
    toolpath : with its tool, and the part of its profile that touches (`for_tilt`)
    machine : with its bodies
    surroundings : with the clearances
    extra : mm, added to every clearance

    Returns
    -------
    None where there is nothing to keep clear of, or nothing to keep clear: a mere ball doesn't lean

    Raises
    ------
    MeshError
        A fixture's or body's mesh can't be read.
    """
    tool, clearances = toolpath.tool, surroundings.clearances
    head = list(head_solids(machine))
    obstacles = []
    for name, mesh in surroundings.meshes.items():
        solids = [*_beside_the_cut(tool, clearances, extra), *_grown(head, clearances.machine + extra)]
        if name == "part":
            solids.insert(0, _cutter_beside_the_cut(tool))
        obstacles.append(Obstacle.build(name, mesh.triangles, solids))
    around = [(fixture.name, shape_triangles(fixture.shape)) for fixture in surroundings.fixtures]
    around += list(_bodies_of_the_table(machine))
    clear = [
        solid.grown(clearances.by_kind[solid.name] + extra)
        if clearances.by_kind[solid.name] + extra
        else solid
        for solid in tool_solids(tool)
    ]
    for name, triangles in around:
        obstacles.append(Obstacle.build(name, triangles, [*clear, *_grown(head, clearances.machine + extra)]))
    obstacles = [obstacle for obstacle in obstacles if obstacle.solids]
    _tell(toolpath, obstacles)
    return Accessibility(toolpath, machine, obstacles) if obstacles else None


def _tell(toolpath: Toolpath, obstacles: list[Obstacle]) -> None:
    """Log what the postures are kept clear of, and what is held against each."""
    named = ", ".join(obstacle.name for obstacle in obstacles) or "nothing that a leaning tool could touch"
    logger.info("postures of %d locations are kept clear of %s", len(toolpath), named)
    for obstacle in obstacles:
        solids = ", ".join(dict.fromkeys(solid.name for solid in obstacle.solids))
        logger.debug("%s is held against %s", obstacle.name, solids)


def head_solids(machine: Machine) -> Iterator[Solid]:
    """Give the cylinders of the head that stand about the tool axis, as the spindle's nose does."""
    links = (*machine.code.table, BED, *machine.code.head)
    for body in machine.bodies:
        if body.link != links[-1] or not isinstance(body.shape, Cylinder):
            continue
        frame = np.linalg.inv(machine.chain.tool_home) @ machine.machine_frame @ body.shape.frame
        on_axis = np.hypot(frame[0, 3], frame[1, 3]) < OFF_AXIS and abs(frame[2, 2]) > 1.0 - OFF_DIRECTION
        if on_axis:
            low, high = frame[2, 3] + np.array([-0.5, 0.5]) * body.shape.height
            yield Solid(HEAD, np.array([[low, body.shape.radius, high, body.shape.radius]]))


def _grown(solids: list[Solid], margin: float) -> list[Solid]:
    return [solid.grown(margin) if margin else solid for solid in solids]


def _cutter_beside_the_cut(tool: Tool) -> Solid:
    """Give what of the cutter may touch the part but not enter; a ball stays where it is as it leans."""
    cutter = tool.cutter
    solid = tool_solids(tool)[0].grown(-GOUGE)
    if not cutter.is_ball:
        return solid
    if cutter.length is None:
        return Solid(CUTTER, solid.frusta[:0])
    ball = cutter.zones[0].outline()[-1, 1]
    return Solid(CUTTER, solid.frusta[solid.frusta[:, 0] >= ball - GOUGE])


def _beside_the_cut(tool: Tool, clearances: Clearances, extra: float) -> Iterator[Solid]:
    """Give shank and holder with their clearance to what is being cut.

    The shank goes on from the cutter, which touches: its clearance grows from nothing over a length of its
    own radius.
    """
    for solid in tool_solids(tool)[1:]:
        margin = clearances.by_kind[solid.name] + extra
        if solid.name != SHANK:
            yield solid.grown(margin) if margin else solid
            continue
        low, radius, high, _ = solid.frusta[0]
        begun = min(low + radius, high)
        cone = [low, radius, begun, radius + margin * (begun - low) / radius]
        rest = [begun, cone[3], high, cone[3]]
        yield Solid(SHANK, np.array([cone, rest] if high > begun else [cone]))


def _bodies_of_the_table(machine: Machine) -> Iterator[tuple[str, Array]]:
    """Give name and triangles, (f, 3, 3) mm, workpiece frame, of bodies that move with the workpiece."""
    carrier = (*machine.code.table, BED)[0]
    for number, body in enumerate(machine.bodies):
        if body.link == carrier:
            frame = machine.machine_frame
            yield f"{body.link} body {number}", shape_triangles(body.shape) @ frame[:3, :3].T + frame[:3, 3]
