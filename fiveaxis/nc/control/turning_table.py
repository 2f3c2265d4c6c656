"""Tip positions in a frame that stays with the machine, carried to the workpiece on its turning table."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import link_poses
from fiveaxis.machine import BED, Machine


def carry_to_work(machine: Machine, points: Array, rotary: Array) -> Array:
    """Say where on the workpiece points are that keep their place in the machine while the table turns.

    Parameters
    ----------
    machine : whose table turns
    points : (n, 3), mm, in the workpiece frame as it lies with every axis at 0
    rotary : (n, k), axis values, rad; those of linear axes don't count

    Returns
    -------
    (n, 3), mm, workpiece frame
    """
    values = rotary.copy()
    values[:, machine.linear_columns] = 0.0
    # The bed has moved by E_1 … E_j seen from the workpiece, and a point of the machine moves with it.
    poses = link_poses(machine, values)[BED]
    return np.asarray(np.einsum("nij,nj->ni", poses[:, :3, :3], points) + poses[:, :3, 3])


def turns_table(machine: Machine) -> bool:
    """Whether a rotary axis lies between workpiece and bed."""
    return any(letter in "ABC" for letter in machine.code.table)
