"""Gravity's load on the axes: forces on linear axes, torques on tilting tables, by posture."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import link_poses
from fiveaxis.machine import BED, Machine

STANDARD_GRAVITY = 9.80665  # m/s²


def gravity_forces(machine: Machine, positions: Array) -> Array:
    """Compute the load that each axis holds against gravity: the derivative of the potential energy.

    A linear axis lifts its moved mass and, on the table, the load: ``m g d·up``. A rotary axis turns its
    mass about its line: ``m g (k × (c − p))·up``, which changes with its angle and with those of the axes
    between it and the bed; likewise the load of a table. Axis values are tool relative to workpiece, so a
    table moves in the opposite direction.

    Parameters
    ----------
    machine : with masses; an axis without `moved_mass` weighs nothing, a rotary one without `mass_centre`
        is balanced
    positions : (n, k), mm and rad, columns in the order of `machine.axes`

    Returns
    -------
    (n, k), J/mm and J/rad: positive where the axis works against gravity while its value grows
    """
    values = np.asarray(positions, dtype=float)
    poses = link_poses(machine, values)
    # Poses of the links in the bed's frame, in which gravity is constant.
    from_bed = np.linalg.inv(poses[BED])
    links = (*machine.code.table, BED, *machine.code.head)
    to_machine = machine.machine_frame  # the machine frame at home, in the workpiece frame
    up = to_machine[:3, :3] @ np.array(machine.vertical)
    load = to_machine @ np.array([*machine.load.centre, 1.0])
    forces = np.zeros_like(values)
    for index, joint in enumerate(machine.chain.joints):
        column = machine.column(joint.letter)
        axis = machine.axes[column]
        on_table = joint.letter in machine.code.table
        # The joint's line moves with the link before it, its mass with the link that it carries.
        line_pose = from_bed @ poses[links[index]]
        link_pose = from_bed @ poses[joint.letter]
        direction = line_pose[:, :3, :3] @ np.array(joint.line.direction)
        own = axis.moved_mass or 0.0
        if not joint.is_rotary:
            forces[:, column] = (own + (machine.load.mass if on_table else 0.0)) * (direction @ up)
        else:
            point = line_pose @ np.array([*joint.line.point, 1.0])
            if axis.mass_centre is not None:
                centre = to_machine @ np.array([*axis.mass_centre, 1.0])
                forces[:, column] += own * (_velocity(direction, point, link_pose @ centre) @ up)
            if on_table:
                forces[:, column] += machine.load.mass * (_velocity(direction, point, from_bed @ load) @ up)
        forces[:, column] *= (-1.0 if on_table else 1.0) * STANDARD_GRAVITY / 1000.0
    return forces


def _velocity(direction: Array, point: Array, centre: Array) -> Array:
    """Compute the velocity, (n, 3) mm/rad, of a centre that turns about a line; points are (n, 4)."""
    return np.cross(direction, (centre - point)[:, :3])


def moved_weights(machine: Machine) -> Array:
    """Compute the weight that each axis moves, (k,) N: its own mass and, on the table, the load.

    References
    ----------
    Edem & Balogun (2018), Eq. (1): W, the moved weight of axis, workpiece and vice.
    """
    masses = [
        (a.moved_mass or 0.0) + (machine.load.mass if a.letter in machine.code.table else 0.0)
        for a in machine.axes
    ]
    return np.array(masses) * STANDARD_GRAVITY
