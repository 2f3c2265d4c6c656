"""What TrajOpt's problems are made of, for `stretch.py`: values of the angles, squared or not negative."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from tesseract_robotics import trajopt_ifopt

Jacobian = tuple[np.ndarray, np.ndarray, np.ndarray]


class Terms(trajopt_ifopt.ConstraintSet):
    """Values of the rotary angles, and their derivatives; as a constraint none is negative.

    Parameters
    ----------
    name : unique in a problem
    nodes : the angles
    count : of values
    values : of angles (n, 2), to (count,)
    jacobian : of angles, to entries, rows and columns
    held : angles at the ends that aren't variables, (0 or 1, 2) each
    """

    def __init__(
        self, name: str, nodes: object, count: int, values: Callable, jacobian: Callable, held: list
    ) -> None:
        super().__init__(name, count)
        self.nodes, self.count, self.values, self.jacobian = nodes, count, values, jacobian
        self.held = held

    @property
    def rotary(self) -> np.ndarray:
        return np.vstack([self.held[0], self.nodes.getValues().reshape(-1, 2), self.held[1]])

    def getValues(self) -> np.ndarray:  # noqa: N802
        return self.values(self.rotary)

    def getBounds(self) -> list:  # noqa: N802
        low, high = (0.0, 0.0) if self.getName() == "travel" else (0.0, 1e20)
        return [trajopt_ifopt.Bounds(low, high)] * self.count

    def getJacobian(self) -> sparse.csr_matrix:  # noqa: N802
        entries, rows, columns = (part.ravel() for part in self.jacobian(self.rotary))
        columns, free = columns - 2 * len(self.held[0]), self.nodes.getRows()
        own = (columns >= 0) & (columns < free)
        return sparse.csr_matrix((entries[own], (rows[own], columns[own])), shape=(self.count, free))

    def getCoefficients(self) -> np.ndarray:  # noqa: N802
        return np.ones(self.count)

    def getNonZeros(self) -> int:  # noqa: N802
        return 4 * self.count

    def update(self) -> int:
        return self.count

    def isDynamic(self) -> bool:  # noqa: N802
        return False

    def isScalar(self) -> bool:  # noqa: N802
        return False
