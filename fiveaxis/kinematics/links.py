"""Where the machine's links are, for given axis values."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, rotation_matrix
from fiveaxis.machine import BED, Joint, Machine


def link_poses(machine: Machine, positions: Array) -> dict[str, Array]:
    """Compute how far each link has moved from where it is with every axis at 0, seen from the workpiece.

    Between workpiece and tool links and joints alternate, so the j-th link has moved by ``E_1 … E_j``: the
    one that carries the workpiece not at all, the bed by all table joints. In the workpiece frame a body is
    at ``link_poses[body.link] @ machine.machine_frame @ body.shape.frame``.

    Parameters
    ----------
    machine : the machine
    positions : (n, k), mm and rad, columns in the order of `machine.axes`

    Returns
    -------
    Link -> (n, 4, 4), mm, workpiece frame; from the workpiece to the tool. Links are ``bed`` and the letter
    of the axis that carries the link, the next one on the way to the bed. The last one times
    `machine.chain.tool_home` is the tool's frame.
    """
    values = np.asarray(positions, dtype=float)
    pose = np.broadcast_to(np.eye(4), (len(values), 4, 4))
    links = (*machine.code.table, BED, *machine.code.head)
    poses = {links[0]: pose}
    for link, joint in zip(links[1:], machine.chain.joints, strict=True):
        pose = pose @ _motions(joint, values[:, machine.column(joint.letter)])
        poses[link] = pose
    return poses


def _motions(joint: Joint, values: Array) -> Array:
    """Give a joint's factors ``E(value)``, (n, 4, 4) mm, for (n,) values in mm or rad."""
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
    motions[:, :3, 3] = point - motions[:, :3, :3] @ point
    return motions
