"""Walls: the parts of the surface that a strategy cuts, selected by their normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray, product

# Least angle between a wall's normal and that of the section planes; on flatter faces the passes would be too
# far apart. Faces within the same angle of straight down lie on the table.
FLATTEST_WALL = np.radians(10.0)
# An overhanging wall's normal points at least this far below the horizontal.
LEAST_OVERHANG = np.radians(1.0)


@dataclass(frozen=True, eq=False)
class Walls:
    """Selects walls by their normals.

    Parameters
    ----------
    plane : (3,), unit normal of the section planes, workpiece frame
    overhang : only walls whose normals point downward
    """

    plane: Array
    overhang: bool = False

    def keep(self, normals: Array) -> BoolArray:
        """Check which normals, (n, 3) unit vectors in the workpiece frame, belong to walls, (n,)."""
        across = product(normals, self.plane)
        flattest = np.cos(FLATTEST_WALL)
        wall: BoolArray = (np.abs(across) <= flattest) & (normals[:, 2] >= -flattest)
        return wall & (normals[:, 2] <= -np.sin(LEAST_OVERHANG)) if self.overhang else wall
