"""Judges postures without the package's kinematics: its own product of exponentials, its own angles.

Only data comes from the package: lines of the axes at home, limits, locations and their bounds.
"""

from __future__ import annotations

import numpy as np
import trimesh
from case import Case

# mm, rad: what rounding may cost.
CLOSE = 1e-6
# mm, between the points of part and fixtures that are looked at.
GRID = 1.0


def tool_frames(case: Case, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tip, (n, 3) mm, and direction, (n, 3), of the tool on the workpiece, from axis values (n, k)."""
    pose = np.tile(np.eye(4), (len(positions), 1, 1))
    for joint in case.machine.chain.joints:
        value = positions[:, case.machine.letters.index(joint.letter)]
        line, step = np.array(joint.line.direction), np.tile(np.eye(4), (len(positions), 1, 1))
        if joint.is_rotary:
            x, y, z = line
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            turn = np.eye(3) + np.sin(value)[:, None, None] * cross
            turn = turn + (1.0 - np.cos(value))[:, None, None] * (cross @ cross)
            point = np.array(joint.line.point)
            step[:, :3, :3], step[:, :3, 3] = turn, point - turn @ point
        else:
            step[:, :3, 3] = value[:, None] * line
        pose = pose @ step
    pose = pose @ case.machine.chain.tool_home
    return pose[:, :3, 3], pose[:, :3, 2]


def touched(case: Case, tip: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Find the locations, (n,), at which points of part and fixtures are inside shank or holder."""
    tool, inside = case.toolpath.tool, np.zeros(len(tip), dtype=bool)
    if case.part is None or tool.holder is None:
        return inside
    meshes = [case.part, *(trimesh.creation.box(f.shape.size) for f in case.fixtures)]
    for mesh, fixture in zip(meshes[1:], case.fixtures, strict=True):
        mesh.apply_translation(fixture.shape.center)
    points = np.vstack([mesh.subdivide_to_size(GRID).vertices for mesh in meshes])
    ends, radii = [tool.radius, tool.holder.stick_out], [0.5 * tool.shank_diameter]
    for section in tool.holder.sections:
        ends.append(ends[-1] + section.length)
        radii.append(0.5 * section.diameter)
    for row, (origin, along) in enumerate(zip(tip, axis, strict=True)):
        height = (points - origin) @ along
        away = np.linalg.norm(points - origin - height[:, None] * along, axis=1)
        part = np.searchsorted(ends, height) - 1
        radius = np.array([0.0, *radii, 0.0])[part + 1]
        inside[row] = (away < radius - CLOSE).any()
    return inside


def violations(case: Case, positions: np.ndarray) -> dict[str, int]:
    """Count the locations at which axis values, (n, k) mm and rad, break what the case asks for."""
    path, tip, axis = case.toolpath, *tool_frames(case, positions)
    centre, radius = path.pivot, path.zone.height
    found = {"off the path": np.linalg.norm(tip + radius * axis - centre, axis=1) > CLOSE}
    lean = np.zeros(len(path), dtype=bool)
    for bound in case.tilt.all:
        angle = np.arccos(np.clip(np.einsum("nk,nk->n", axis, bound.reference), -1.0, 1.0))
        lean |= (angle < bound.low - CLOSE) | (angle > bound.high + CLOSE)
    low, high = case.machine.low, case.machine.high
    rotary = positions[:, case.machine.rotary_columns]
    turned = np.abs(np.diff(rotary, axis=0)).max(axis=1) > case.turns + CLOSE
    found["lean"] = lean
    found["holder"] = touched(case, tip, axis)
    found["limits"] = ((positions < low - CLOSE) | (positions > high + CLOSE)).any(axis=1)
    found["turn"] = turned & path.cutting[1:]
    return {what: int(rows.sum()) for what, rows in found.items() if rows.any()}
