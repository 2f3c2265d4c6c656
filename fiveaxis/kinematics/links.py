"""Poses of the machine's links, and the Jacobian of the tool, for given axis values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, product, rotation_matrix
from fiveaxis.kinematics.poses import tool_poses
from fiveaxis.machine import BED, Joint, Machine


def link_poses(machine: Machine, positions: Array) -> dict[str, Array]:
    """Compute each link's displacement from its position at home (every axis 0), in the workpiece frame.

    Links and joints alternate from workpiece to tool, so the j-th link has moved by ``E_1 … E_j``: the link
    that carries the workpiece not at all, the bed by all table joints. In the workpiece frame a body is at
    ``link_poses[body.link] @ machine.machine_frame @ body.shape.frame``.

    Parameters
    ----------
    positions : (n, k), mm and rad, columns in the order of `machine.axes`

    Returns
    -------
    Link -> (n, 4, 4), mm, workpiece frame; from the workpiece to the tool. Links are ``bed`` and the letter
    of the axis that carries the link, the next one towards the bed. The last one times
    `machine.chain.tool_home` is the tool's frame.
    """
    values = np.asarray(positions, dtype=float)
    pose = np.broadcast_to(np.eye(4), (len(values), 4, 4))
    links = (*machine.code.table, BED, *machine.code.head)
    poses = {links[0]: pose}
    for link, joint in zip(links[1:], machine.chain.joints, strict=True):
        pose = product(pose, _motions(joint, values[:, machine.column(joint.letter)]))
        poses[link] = pose
    return poses


def _motions(joint: Joint, values: Array) -> Array:
    """Return a joint's factors ``E(value)``, (n, 4, 4) mm, for (n,) values in mm or rad."""
    direction, point = np.array(joint.line.direction), np.array(joint.line.point)
    motions = np.broadcast_to(np.eye(4), (len(values), 4, 4)).copy()
    if not joint.is_rotary:
        motions[:, :3, 3] = np.outer(values, direction)
        return motions
    # Rodrigues: a quarter turn is K + kk', half a turn 2kk' − I.
    along = np.outer(direction, direction)
    cross = rotation_matrix(direction, np.pi / 2.0) - along
    cosine, sine = np.cos(values)[:, None, None], np.sin(values)[:, None, None]
    motions[:, :3, :3] = along + cosine * (np.eye(3) - along) + sine * cross
    motions[:, :3, 3] = point - product(motions[:, :3, :3], point)
    return motions


@dataclass(frozen=True, eq=False)
class Jacobian:
    """Derivatives of tool tip and tool axis with respect to the axis values.

    Parameters
    ----------
    tip : (n, 3, k), mm per mm or rad, workpiece frame, columns in the order of `machine.axes`
    axis : (n, 3, k), per mm or rad; 0 for linear axes
    """

    tip: Array
    axis: Array


def jacobian(machine: Machine, positions: Array) -> Jacobian:
    """Differentiate the forward kinematics.

    A linear axis moves the tip along its direction; a rotary axis turns tip and tool axis about its line:
    ``∂r/∂q = k × (r − p)``, ``∂o/∂q = k × o``, with k and p in the workpiece frame.

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
        direction = product(pose[:, :3, :3], np.array(joint.line.direction))
        if joint.is_rotary:
            point = product(pose[:, :3, :3], np.array(joint.line.point)) + pose[:, :3, 3]
            by_tip[:, :, column] = np.cross(direction, tip - point)
            by_axis[:, :, column] = np.cross(direction, axis)
        else:
            by_tip[:, :, column] = direction
    return Jacobian(by_tip, by_axis)
