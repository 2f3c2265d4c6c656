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
