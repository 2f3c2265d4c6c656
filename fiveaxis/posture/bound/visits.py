"""Locations that a path visits, and the least that it costs to go from one to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine
from fiveaxis.toolpath import TiltBounds, Toolpath


@dataclass(frozen=True, eq=False)
class Visits:
    """Locations that a path has to visit, in order; both rotary axes come before the linear ones.

    Parameters
    ----------
    machine : two rotary and three linear axes
    toolpath, tilt : of m locations
    plus, minus : (m − 1, 5), J/rad and J/mm, least price of travel between a visit and the next
    turn : (m − 1,), rad, most that each rotary axis turns between them; infinite where unbounded
    row : (m,), index of each visit in the given path
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    plus: Array
    minus: Array
    turn: Array
    row: IntArray

    @classmethod
    def of(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        tilt: TiltBounds,
        prices: tuple[Array, Array],
        turns: Array | None,
    ) -> Visits:
        """Take the locations of a path at which a direction binds the tool axis, without inserted ones.

        Parameters
        ----------
        toolpath, machine, tilt : n locations
        prices : (n − 1, k) each, J/mm and J/rad, while axis values grow and fall
        turns : (n − 1,), rad, most of each rotary axis in a move; None if nothing bounds them
        """
        columns = [*machine.rotary_columns, *machine.linear_columns]
        plus, minus = (price[:, columns] for price in prices)
        binds = np.any([np.isfinite(bound.reference[:, 0]) for bound in tilt.all], axis=0)
        turn = np.full(len(plus), np.inf) if turns is None else turns
        whole = cls(machine, toolpath, tilt, plus, minus, turn, np.arange(len(toolpath)))
        return whole.at(np.flatnonzero(binds & ~toolpath.inserted))

    def at(self, rows: IntArray) -> Visits:
        """Return some of the visits, given by their indices in ascending order."""
        between = slice(rows[0], rows[-1]) if len(rows) else slice(0)
        plus, minus, turn = self.plus[between], self.minus[between], self.turn[between]
        if len(rows) > 1:
            begin = rows[:-1] - rows[0]
            plus, minus = np.minimum.reduceat(plus, begin), np.minimum.reduceat(minus, begin)
            turn = np.add.reduceat(turn, begin)
        some = self.toolpath.at(rows), self.tilt.at(rows)
        return Visits(self.machine, *some, plus, minus, turn, self.row[rows])

    def every(self, stride: int) -> Visits:
        """Return each `stride`-th visit, and the last."""
        count = len(self.turn) + 1
        return self.at(np.unique(np.append(np.arange(0, count, stride), count - 1)))
