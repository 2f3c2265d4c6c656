"""Rotations and rigid transforms as 4×4 matrices."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.geometry.arithmetic import product
from fiveaxis.geometry.vectors import Array


def rotation_matrix(direction: ArrayLike, angle: float) -> Array:
    """Return the rotation about a direction through the origin (Rodrigues).

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
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * product(cross, cross)


def translation(offset: ArrayLike) -> Array:
    """Return the (4, 4) transform that moves by an offset, (3,) mm."""
    transform = np.eye(4)
    transform[:3, 3] = offset
    return transform


def line_rotation(direction: ArrayLike, point: ArrayLike, angle: float) -> Array:
    """Return the rotation about a line in space.

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
    transform[:3, 3] = p - product(rotation, p)
    return transform


def inverse_transform(transform: Array) -> Array:
    """Invert rigid transforms, (..., 4, 4) mm, without the rounding of a general inverse."""
    inverse = np.zeros(transform.shape)
    inverse[..., :3, :3] = np.swapaxes(transform[..., :3, :3], -2, -1)
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", inverse[..., :3, :3], transform[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def frame_along(direction: ArrayLike, point: ArrayLike) -> Array:
    """Return a frame at a point with its z along a direction: the smallest rotation from the upright frame.

    Parameters
    ----------
    direction : (3,), unit vector
    point : (3,), mm

    Returns
    -------
    (4, 4), mm
    """
    z = np.asarray(direction, dtype=float)
    across = np.cross([0.0, 0.0, 1.0], z)
    sine = float(np.linalg.norm(across, axis=-1))
    about = across / sine if sine > 0.0 else np.array([1.0, 0.0, 0.0])
    frame = np.eye(4)
    frame[:3, :3] = rotation_matrix(about, math.atan2(sine, z[2]))
    frame[:3, 3] = point
    return frame
