"""Which places of the surface a strategy cuts, told by their normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray

# A wall's normal is at least this far from the normal of the section planes; along flatter places the
# passes would lie far apart. Faces that look straight down, by as much, lie on the table.
FLATTEST_WALL = np.radians(10.0)
# A wall overhangs where its normal points at least this far below the horizontal.
LEAST_OVERHANG = np.radians(1.0)


@dataclass(frozen=True, eq=False)
class Walls:
    """Selects walls.

    Parameters
    ----------
    plane : (3,), unit normal of the section planes, workpiece frame
    overhang : only walls whose normals point downward
    """

    plane: Array
    overhang: bool = False

    def keep(self, normals: Array) -> BoolArray:
        """Tell for normals, (n, 3) unit vectors in the workpiece frame, whether they are a wall's, (n,)."""
        across = normals @ self.plane
        flattest = np.cos(FLATTEST_WALL)
        wall: BoolArray = (np.abs(across) <= flattest) & (normals[:, 2] >= -flattest)
        return wall & (normals[:, 2] <= -np.sin(LEAST_OVERHANG)) if self.overhang else wall
