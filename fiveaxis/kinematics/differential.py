"""How the tool moves with each axis, and how well the axes share that work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics.links import link_poses
from fiveaxis.kinematics.poses import tool_poses
from fiveaxis.machine import Machine


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Derivatives of tool tip and tool axis by the axis values.

    Parameters
    ----------
    tip : (n, 3, k), mm per mm or rad, workpiece frame, columns in the order of `machine.axes`
    axis : (n, 3, k), per mm or rad; 0 for linear axes
    """

    tip: Array
    axis: Array


def jacobian(machine: Machine, positions: Array) -> Jacobian:
    """Differentiate the forward kinematics.

    A linear axis moves the tip along its direction; a rotary one turns tip and tool axis about its line:
    ``∂r/∂q = k × (r − p)``, ``∂o/∂q = k × o``, with k and p as the workpiece sees them.

    Parameters
    ----------
    positions : (n, k), mm and rad, columns in the order of `machine.axes`
    """
    values = np.asarray(positions, dtype=float)
    tip, axis = tool_poses(machine, values)
    by_tip, by_axis = np.zeros((2, len(values), 3, values.shape[1]))
    # The link before a joint carries the joint's line.
    for pose, joint in zip(link_poses(machine, values).values(), machine.chain.joints, strict=False):
        column = machine.column(joint.letter)
        direction = pose[:, :3, :3] @ np.array(joint.line.direction)
        if joint.is_rotary:
            point = pose[:, :3, :3] @ np.array(joint.line.point) + pose[:, :3, 3]
            by_tip[:, :, column] = np.cross(direction, tip - point)
            by_axis[:, :, column] = np.cross(direction, axis)
        else:
            by_tip[:, :, column] = direction
    return Jacobian(by_tip, by_axis)


def orientation_condition(machine: Machine, positions: Array) -> Array:
    """Measure how unevenly the rotary axes lean the tool.

    The ratio of the largest to the smallest lean, over all directions, that the rotary axes make by moving
    1 rad together: 1 where both lean it as well, without bound at the singular direction. For a C-A table
    it is ``1/|sin A|``.

    Parameters
    ----------
    positions : (n, k), mm and rad

    Returns
    -------
    (n,), infinite where one direction is lost
    """
    leans = jacobian(machine, positions).axis[:, :, machine.rotary_columns]
    values = _singular_values(leans)
    if values.shape[1] < 2:
        return np.full(len(values), np.inf)
    return _ratio(values[:, 0], values[:, 1])


def positioning_condition(machine: Machine, positions: Array) -> Array:
    """Measure how unevenly the linear axes move the tip: 1 where they stand at right angles.

    It changes with the posture only where a rotary axis stands between linear ones; there they may fall
    into one plane.

    Parameters
    ----------
    positions : (n, k), mm and rad

    Returns
    -------
    (n,), infinite where the directions lie in one plane
    """
    ways = jacobian(machine, positions).tip[:, :, machine.linear_columns]
    values = _singular_values(ways)
    return _ratio(values[:, 0], values[:, -1])


def _singular_values(matrices: Array) -> Array:
    return np.asarray(np.linalg.svd(matrices, compute_uv=False), dtype=float)


def _ratio(largest: Array, smallest: Array) -> Array:
    # Below rounding the smallest singular value is 0, whatever digits it has.
    lost = smallest <= np.finfo(float).eps * 4.0 * largest
    return np.divide(largest, smallest, out=np.full_like(largest, np.inf), where=~lost)
