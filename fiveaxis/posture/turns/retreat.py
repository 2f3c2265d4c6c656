"""How far a tool backs off so that an axis may turn all the way round beside the part."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes, tool_poses
from fiveaxis.kinematics.windings import ON_LIMIT, TURN
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath

# Angles of a turn at which a tool that turns on the head is looked at, and how far it tries to back off, as
# shares of the way that clears the part where it stands.
LOOKS = 24
TRIED = 1.5 ** np.arange(8.0)
# mm; a tool that is so near to being clear is clear.
ROUNDING = 1e-6


def retreats(
    toolpath: Toolpath, machine: Machine, rotary: Array, column: int, rows: IntArray, clearance: float
) -> Array:
    """Measure how far the tool must back off along its axis before a rotary axis makes whole turns.

    As `ways_clear`, within the limits of the linear axes.

    Returns
    -------
    (m,), mm; infinite where no way within the limits of the linear axes leads clear
    """
    way = ways_clear(toolpath, machine, rotary, column, rows, clearance)
    low, high = machine.low[machine.linear_columns], machine.high[machine.linear_columns]
    # In between they are within limits too, being linear in the tip.
    ends = way_ends(toolpath, machine, rotary, rows, np.where(np.isfinite(way), way, 0.0))
    inside = (ends >= low - ON_LIMIT) & (ends <= high + ON_LIMIT)
    return np.where(inside.all(axis=(0, 2)), way, np.inf)


def way_ends(toolpath: Toolpath, machine: Machine, rotary: Array, rows: IntArray, way: Array) -> Array:
    """Solve the linear axes at locations and backed off from them, (2, m, linear axes) mm.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    rows : (m,), locations
    way : (m,), mm, along the tool's axis
    """
    axis = tool_axes(machine, rotary)
    tip = toolpath.tips(axis)[rows]
    ends = [linear_positions(machine, tip + w[:, None] * axis[rows], rotary[rows]) for w in (0.0 * way, way)]
    return np.stack(ends)[..., machine.linear_columns]


def ways_clear(
    toolpath: Toolpath, machine: Machine, rotary: Array, column: int, rows: IntArray, clearance: float
) -> Array:
    """Measure how far the tool backs off along its axis until a rotary axis may make whole turns.

    What must stay clear is a sphere about everything that the path cuts; it is centred on the axis that
    turns if the workpiece sits on that one, so the turn leaves it where it is. The tool is a ray as thick as
    its thickest part. Table, fixture and what else stands around aren't known here, nor any limit.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    column : the axis that turns, in the order of the machine's axes
    rows : (m,), locations to look at
    clearance : mm, left between sphere and tool

    Returns
    -------
    (m,), mm; infinite where none was found
    """
    tip = toolpath.tips(tool_axes(machine, rotary))
    on_table = machine.chain.joints[0].letter == machine.axes[column].letter
    centre, radius = _sphere(toolpath.pivot[toolpath.cutting], machine, on_table)
    reach = radius + toolpath.zone.radius + float(toolpath.tool.outline()[:, 0].max()) + clearance
    rotary, tip = rotary[rows], tip[rows]
    axis = tool_axes(machine, rotary)
    least = _way_out(tip - centre, axis, reach)
    if on_table:
        return least
    found = np.full(len(rows), np.inf)
    for share in TRIED:
        # From outside the sphere there is no way out to lengthen, but the turn may sweep the tool into it.
        way = share * np.maximum(least, clearance) if share > TRIED[0] else least
        clear = _turns_clear(machine, tip + way[:, None] * axis, rotary, column, (centre, reach))
        found = np.where(np.isinf(found) & clear, way, found)
    return found


def _sphere(points: Array, machine: Machine, on_table: bool) -> tuple[Array, float]:
    """Put a sphere around points, (n, 3) mm; its centre is on the workpiece's own axis where that turns."""
    if on_table:
        line = machine.chain.joints[0].line
        along = (points - line.point) @ line.direction
        centre = line.point + np.multiply((along.min() + along.max()) / 2.0, line.direction)
    else:
        centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def _way_out(start: Array, axis: Array, reach: float) -> Array:
    """Measure how far tips, (n, 3) mm from a sphere's centre, go along their axes until the ray is clear."""
    along = np.sum(start * axis, axis=1)
    across = np.sum(start * start, axis=1) - along**2
    half = np.sqrt(np.maximum(reach**2 - across, 0.0))
    return np.maximum(np.where(across < reach**2, half - along, 0.0), 0.0)


def _turns_clear(
    machine: Machine, tip: Array, rotary: Array, column: int, sphere: tuple[Array, float]
) -> BoolArray:
    """Tell where the tool stays clear of a sphere while an axis turns once and the others stand."""
    standing = linear_positions(machine, tip, rotary)
    clear = np.ones(len(tip), dtype=bool)
    for turn in np.linspace(0.0, TURN, LOOKS, endpoint=False):
        turned = standing.copy()
        turned[:, column] += turn
        swept, axis = tool_poses(machine, turned)
        clear &= _way_out(swept - sphere[0], axis, sphere[1]) <= ROUNDING
    return clear
