"""Coordinate planes of a program: shifts and rotations as controls combine them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fiveaxis.geometry import Array, product, rotation_matrix
from fiveaxis.nc.languages.block import Block, FrameChange

AXES = "XYZ"


@dataclass(frozen=True, eq=False)
class Plane:
    """Frame of a program's coordinates: ``p_before = rotation @ p_now + origin``.

    Parameters
    ----------
    origin : (3,), program unit
    rotation : (3, 3)
    """

    origin: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))

    @cached_property
    def is_unturned(self) -> bool:
        """Whether the rotation is the identity."""
        return bool(np.array_equal(self.rotation, np.eye(3)))

    def then(self, other: Plane) -> Plane:
        """Return the plane `other`, given relative to this one."""
        return Plane(
            self.origin + product(self.rotation, other.origin), product(self.rotation, other.rotation)
        )

    def change(self, word: str) -> FrameChange:
        """Return the change that replaces the frame in force by this plane."""
        x, y, z = (float(v) for v in self.origin)
        return FrameChange("set", (x, y, z), self.rotation, word)


def forget_position(line: int, word: str) -> Block:
    """Return the block to insert before the control turns the tool without holding its tip.

    The program doesn't say where the tip ends up: a switch to axis coordinates discards its position.
    """
    return Block(line, tip_control=False, frame=Plane().change(word))


def turn_about(axis: str, angle: float) -> Array:
    """Return the right-handed rotation, (3, 3), about X, Y or Z by degrees; quarter turns are exact."""
    quarters, rest = divmod(angle, 90.0)
    direction = np.eye(3)[AXES.index(axis)]
    if rest != 0.0:
        return rotation_matrix(direction, np.radians(angle))
    return np.round(rotation_matrix(direction, quarters % 4.0 * np.pi / 2.0))


def turns(axes: str, angles: Sequence[float]) -> Array:
    """Return the product of rotations, (3, 3), each about an axis of the frame rotated so far.

    Parameters
    ----------
    axes : letters in order; reverse the order for rotations about fixed axes
    angles : deg, one per letter
    """
    rotation = np.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        rotation = product(rotation, turn_about(axis, angle))
    return rotation
