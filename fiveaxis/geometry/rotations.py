"""Rotations and rigid transforms as 4×4 matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.geometry.vectors import Array


def rotation_matrix(direction: ArrayLike, angle: float) -> Array:
    """Rotate about a direction through the origin (Rodrigues).

    Parameters
    ----------
    direction : (3,), unit vector
    angle : rad, right-handed

    Returns
    -------
    (3, 3)
    """
    k = np.asarray(direction, dtype=float)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


def translation(offset: ArrayLike) -> Array:
    """Move by an offset, (3,) mm, as a 4×4 transform."""
    transform = np.eye(4)
    transform[:3, 3] = offset
    return transform


def line_rotation(direction: ArrayLike, point: ArrayLike, angle: float) -> Array:
    """Rotate about a line in space.

    Parameters
    ----------
    direction : (3,), unit vector
    point : (3,), mm, any point of the line
    angle : rad, right-handed

    Returns
    -------
    (4, 4)
    """
    p = np.asarray(point, dtype=float)
    rotation = rotation_matrix(direction, angle)
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = p - rotation @ p
    return transform
