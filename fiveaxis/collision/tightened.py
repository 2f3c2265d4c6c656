"""A mask that learns: postures found to collide are refused, together with those near them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray

TURN = 2.0 * np.pi
# Locations, (m,), and rotary angles, (m, 2) rad → which are admissible, (m,).
MaskFunction = Callable[[IntArray, Array], BoolArray]
# rad: postures this near to one that collides are refused; doubled each time a location comes up again.
RADIUS = np.radians(4.0)


@dataclass(eq=False)
class Tightened:
    """Admits what another mask admits, except postures near those known to collide.

    A map of tool directions covers neither bodies that depend on the axis values, such as a trunnion, nor the
    moves between locations. Verification finds those collisions, and they are refused here.

    Parameters
    ----------
    exact, quick : the other mask, exact and approximate; None admits everything
    spots : by location, postures, (2,) rad, with the radius that is refused around each, rad
    """

    exact: MaskFunction | None = None
    quick: MaskFunction | None = None
    spots: dict[int, list[tuple[Array, float]]] = field(default_factory=dict)

    def refuse(self, rows: IntArray, rotary: Array) -> None:
        """Refuse postures, (m, 2) rad, at locations, (m,), and those near them.

        What is refused at one call has the same radius, however many postures of a location it has.
        """
        last = {row: spots[-1][1] for row, spots in self.spots.items()}
        for row, posture in zip(rows.tolist(), rotary, strict=True):
            radius = 2.0 * last[row] if row in last else RADIUS
            self.spots.setdefault(row, []).append((np.array(posture, dtype=float), radius))

    def __call__(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check exactly; see `fiveaxis.posture.masks.mask.RoughMask`."""
        return self._avoid_spots(rows, rotary, self.exact)

    def rough(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Check approximately; see `fiveaxis.posture.masks.mask.RoughMask`."""
        return self._avoid_spots(rows, rotary, self.quick or self.exact)

    def _avoid_spots(self, rows: IntArray, rotary: Array, mask: MaskFunction | None) -> BoolArray:
        free = np.ones(len(rows), dtype=bool)
        # By rounds, not by posture: a search queries thousands, and few locations have many spots.
        for spots in self._rounds():
            known = np.sort(np.fromiter(spots, dtype=np.int64, count=len(spots)))
            at = np.flatnonzero(np.isin(rows, known))
            which = np.searchsorted(known, rows[at])
            postures = np.array([spots[row][0] for row in known.tolist()])
            radii = np.array([spots[row][1] for row in known.tolist()])
            turn = rotary[at] - postures[which]
            off = np.abs(np.mod(turn + np.pi, TURN) - np.pi).max(axis=1, initial=0.0)
            free[at] &= off > radii[which]
        if mask is not None:
            open_rows = np.flatnonzero(free)
            free[open_rows] = mask(rows[open_rows], rotary[open_rows])
        return free

    def _rounds(self) -> list[dict[int, tuple[Array, float]]]:
        """List the first spot of each location, then the second ones, and so on."""
        most = max((len(known) for known in self.spots.values()), default=0)
        return [{row: known[k] for row, known in self.spots.items() if len(known) > k} for k in range(most)]
