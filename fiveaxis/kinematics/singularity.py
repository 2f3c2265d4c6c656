"""The singular direction, and how the first rotary axis is held near it.

The singular direction is that of the first rotary axis (C of a C-A table): with the tool along it, that axis
only spins the part under the tool. Near it a small lean takes a large turn: ``1/sin`` of the angle to it.
Within a cone about it the first rotary axis is therefore held at its previous angle.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, angle_between
from fiveaxis.kinematics.windings import ON_LIMIT
from fiveaxis.machine import Machine


def singular_direction(machine: Machine) -> Array:
    """Return the direction of the first rotary axis, (3,) unit vector, workpiece frame.

    The opposite direction is singular too; `singular_angles` measures to the nearer one.
    """
    return np.array(next(j.line.direction for j in machine.chain.joints if j.is_rotary))


def singular_angles(machine: Machine, axis: Array) -> Array:
    """Compute the angle between tool axes and the singular direction.

    Parameters
    ----------
    machine : at least one rotary axis
    axis : (..., 3), unit vectors, workpiece frame

    Returns
    -------
    (...), rad, in [0, π/2]
    """
    direction = np.broadcast_to(singular_direction(machine), np.shape(axis))
    angle = angle_between(direction, np.asarray(axis, dtype=float))
    return np.minimum(angle, np.pi - angle)


def hold_singular(rotary: Array, axis: Array, machine: Machine, cone: float = ON_LIMIT) -> Array:
    """Hold the first rotary angle along a path while the tool axis lies within the singular cone.

    Parameters
    ----------
    rotary : (..., n, 2), rad, chain order, rows in path order
    axis : (n, 3), unit vectors, workpiece frame
    cone : rad, half angle. Holding turns the tool axis by at most twice its angle to the singular direction,
        which is negligible by default

    Returns
    -------
    (..., n, 2), rad; rows before the first one outside the cone are unchanged
    """
    singular = singular_angles(machine, axis) < cone
    if not singular.any():
        return rotary
    kept = np.where(singular, 0, np.arange(len(axis)))
    held = rotary.copy()
    held[..., 0] = rotary[..., np.maximum.accumulate(kept), 0]
    return held
