"""The quantities of locations and their derivatives, by the machine's chain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture.local.rows import Rows
from fiveaxis.posture.location_model import ANGLES


class Model(Protocol):
    """Quantities, (n, m), as a function of unknowns, (n, d)."""

    def values(self, x: Array) -> Array:
        """Compute the quantities."""
        ...

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Compute the quantities and their derivatives; those by unknowns that don't move are 0.

        Parameters
        ----------
        weights : (n, m)

        Returns
        -------
        The quantities; their slopes, (n, m, d); and the second derivatives of their weighted sum by the
        unknowns of each location, (n, d, d)
        """
        ...


@dataclass(frozen=True, eq=False)
class ChainModel:
    """The quantities by the machine's chain: those of the locations' model, and each step's wait."""

    rows: Rows

    def values(self, x: Array) -> Array:
        """Compute the quantities."""
        return self._with_wait(self.rows.model.quantities(x[:, :ANGLES]), x)

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Compute the quantities and their derivatives, as `Model` says."""
        rows, (n, d), m = self.rows, x.shape, weights.shape[1]
        quantities, slopes, bent = rows.model.derivatives(x[:, :ANGLES], weights[:, : m - 1])
        slope, curvature = np.zeros((n, m, d)), np.zeros((n, d, d))
        slope[:, : m - 1, :ANGLES] = slopes
        slope[:, m - 1, ANGLES:] = 1.0
        curvature[:, 0, 0], curvature[:, 1, 0], curvature[:, 1, 1] = bent.T
        if not rows.free.all():
            slope *= rows.free[:, None, :]
            curvature *= rows.free[:, :, None] & rows.free[:, None, :]
        return self._with_wait(quantities, x), slope, curvature

    def _with_wait(self, quantities: Array, x: Array) -> Array:
        both = np.zeros((len(x), quantities.shape[1] + 1))
        both[:, :-1] = quantities
        if x.shape[1] > ANGLES:
            both[:, -1] = x[:, ANGLES]
        return both
