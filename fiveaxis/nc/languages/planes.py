"""Planes of a program's coordinates: shifts and turns that add up, as controls define them by words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, rotation_matrix
from fiveaxis.nc.languages.block import Block, FrameChange

AXES = "XYZ"


@dataclass(frozen=True, eq=False)
class Plane:
    """Where a program's coordinates lie: ``p_before = rotation @ p_now + origin``.

    Parameters
    ----------
    origin : (3,), in the program's unit
    rotation : (3, 3)
    """

    origin: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))

    @property
    def is_unturned(self) -> bool:
        """Whether nothing is turned."""
        return bool(np.array_equal(self.rotation, np.eye(3)))

    def then(self, other: Plane) -> Plane:
        """Give the plane that `other` is when it is counted in this one."""
        return Plane(self.origin + self.rotation @ other.origin, self.rotation @ other.rotation)

    def change(self, word: str) -> FrameChange:
        """Make it what is in force, whatever was before."""
        x, y, z = (float(v) for v in self.origin)
        return FrameChange("set", (x, y, z), self.rotation, word)


def forget_place(line: int, word: str) -> Block:
    """Make the block before one in which the control turns the tool without following its tip.

    Where the tip is then isn't in the program: coordinates that are the axes' for a moment lose the place.
    """
    return Block(line, tip_control=False, frame=Plane().change(word))


def turn_about(axis: str, angle: float) -> Array:
    """Rotate about X, Y or Z, (3, 3), by an angle in degrees, right-handed; quarters are exact."""
    quarters, rest = divmod(angle, 90.0)
    direction = np.eye(3)[AXES.index(axis)]
    if rest != 0.0:
        return rotation_matrix(direction, np.radians(angle))
    return np.round(rotation_matrix(direction, quarters % 4.0 * np.pi / 2.0))


def turns(axes: str, angles: Sequence[float]) -> Array:
    """Rotate about one axis after the other, each in the coordinates that those before have turned, (3, 3).

    Parameters
    ----------
    axes : letters in order; about axes that stay where they are, the order is the reverse
    angles : deg, one for each letter
    """
    rotation = np.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        rotation = rotation @ turn_about(axis, angle)
    return rotation
