"""Setup of the workpiece on the table, and the load."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from fiveaxis.base import Array, MachineError, product, rotation_matrix
from fiveaxis.model.machine.chain import UNIT_DIRECTION, Triple, as_triple


@dataclass(frozen=True)
class Setup:
    """Workpiece frame in the machine frame, every axis at 0: work offset and part rotation.

    Parameters
    ----------
    offset : (3,), mm, workpiece zero in the machine frame
    rotation_deg : (3,), deg, about the machine's X, then its Y, then its Z (fixed axes)
    stated : whether somebody said where the workpiece stands; else it may be placed

    Raises
    ------
    MachineError
        A number isn't finite.
    """

    offset: Triple = (0.0, 0.0, 0.0)
    rotation_deg: Triple = (0.0, 0.0, 0.0)
    stated: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        if not np.isfinite([*self.offset, *self.rotation_deg]).all():
            raise MachineError(f"setup {self}: write three finite lengths in mm and three angles in deg")

    @classmethod
    def at(cls, offset: ArrayLike, rotation_deg: ArrayLike = (0.0, 0.0, 0.0)) -> Setup:
        """Make a setup from two lists or arrays of three numbers.

        `MachineError` if there aren't three finite ones in each.
        """
        numbers = [np.asarray(v, dtype=float) for v in (offset, rotation_deg)]
        if any(v.shape != (3,) for v in numbers):
            raise MachineError(
                f"setup of offset {offset!r}, rotation {rotation_deg!r}: write three numbers each, mm and deg"
            )
        return cls(as_triple(numbers[0]), as_triple(numbers[1]), stated=True)

    @property
    def frame(self) -> Array:
        """(4, 4), mm, the workpiece frame in the machine frame."""
        frame = np.eye(4)
        for letter, angle in zip("XYZ", np.radians(self.rotation_deg), strict=True):
            frame[:3, :3] = product(rotation_matrix(UNIT_DIRECTION[letter], float(angle)), frame[:3, :3])
        frame[:3, 3] = self.offset
        return frame

    def __str__(self) -> str:
        x, y, z = self.offset
        a, b, c = self.rotation_deg
        return f"offset ({x:g}, {y:g}, {z:g}) mm, rotation ({a:g}, {b:g}, {c:g}) deg"


@dataclass(frozen=True)
class Load:
    """Load of the table: workpiece, vice, fixture.

    Parameters
    ----------
    mass : kg
    centre : (3,), mm, centre of mass, machine frame with every axis at 0: a work offset doesn't move it

    Raises
    ------
    MachineError
        The mass is negative, or a number isn't finite.
    """

    mass: float = 0.0
    centre: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass >= 0.0):
            raise MachineError(f"the load's mass is {self.mass:g} kg; it must be 0 or more")
        if not np.isfinite(self.centre).all():
            raise MachineError(f"the load's centre is {self.centre}; write three finite lengths in mm")
