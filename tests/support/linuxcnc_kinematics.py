"""Closed forms of LinuxCNC's kinematics modules, written out from their C sources.

Joints are (n, 3), mm; tilt and spin are the values of the two rotary axes, (n,), rad, in the control's own
sense. The position is that of the program: a tool's length is added to a pivot's, and Z counts from the tip.
"""

import numpy as np

from fiveaxis.base import Array


def five_axis(joints: Array, tilt: Array, spin: Array, length: float) -> Array:
    """Compute the position of `5axiskins`: ``J + L (sin b cos c, sin b sin c, 1 − cos b)``.

    src/emc/kinematics/5axiskins.c, kinematicsForward: the spherical vector of length L, azimuth c and polar
    angle 180° − b, plus L along z.
    """
    hanging = [np.sin(tilt) * np.cos(spin), np.sin(tilt) * np.sin(spin), 1.0 - np.cos(tilt)]
    return joints + length * np.column_stack(hanging)


def max5(joints: Array, tilt: Array, spin: Array, length: float, sense: float = -1.0) -> Array:
    """Compute the position of `maxkins`: ``Rz(c) (X − s L sin b, Y, 0) + (0, 0, Z + L (1 − cos b))``.

    src/emc/kinematics/maxkins.c at commit 015b723, max_forward, with U = V = W = 0; s is 1 with
    conventional-directions and −1 by default. The forward function of earlier versions shifts by the head
    after turning by c, against their own inverse.
    """
    x, y, z = joints.T
    across = x - sense * length * np.sin(tilt)
    turned = [across * np.cos(spin) - y * np.sin(spin), across * np.sin(spin) + y * np.cos(spin)]
    return np.column_stack([*turned, z + length * (1.0 - np.cos(tilt))])


def pointing(tilt: Array, spin: Array) -> Array:
    """Compute the tool axis of a head that tilts by b and spins by c: from the tip to the pivot."""
    return np.column_stack([-np.sin(tilt) * np.cos(spin), -np.sin(tilt) * np.sin(spin), np.cos(tilt)])
