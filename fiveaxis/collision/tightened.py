"""A mask that learns: postures that turned out to collide on the way are refused, with those near them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray

TURN = 2.0 * np.pi
Ask = Callable[[IntArray, Array], BoolArray]
# rad: how near to a posture that collides others are refused; twice as far each time a location comes again.
RADIUS = np.radians(4.0)


@dataclass(eq=False)
class Tightened:
    """Admits what another mask admits, but for postures near some that are known to collide.

    What depends on where the axes stand, such as a trunnion, and what happens between locations, no map of
    directions can know; verification finds it, and what it finds is refused here.

    Parameters
    ----------
    exact, quick : tell for locations (m,) and rotary angles (m, 2), rad, which are admissible; None: all
    spots : by location, postures (2,), rad, and how near to them is refused, rad
    """

    exact: Ask | None = None
    quick: Ask | None = None
    spots: dict[int, list[tuple[Array, float]]] = field(default_factory=dict)

    def refuse(self, rows: IntArray, rotary: Array) -> None:
        """Refuse postures, (m, 2) rad, of locations, (m,), and what lies near."""
        for row, posture in zip(rows.tolist(), rotary, strict=True):
            known = self.spots.setdefault(row, [])
            radius = RADIUS * 2.0 ** len(known)
            known.append((np.array(posture, dtype=float), radius))

    def __call__(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell exactly; see `fiveaxis.posture.masks.mask.RoughMask`."""
        return self._beside_spots(rows, rotary, self.exact)

    def rough(self, rows: IntArray, rotary: Array) -> BoolArray:
        """Tell about; see `fiveaxis.posture.masks.mask.RoughMask`."""
        return self._beside_spots(rows, rotary, self.quick or self.exact)

    def _beside_spots(self, rows: IntArray, rotary: Array, ask: Ask | None) -> BoolArray:
        free = np.ones(len(rows), dtype=bool)
        # By rounds, not by postures: a search asks about thousands, and few locations have many spots.
        for spots in self._rounds():
            known = np.sort(np.fromiter(spots, dtype=np.int64, count=len(spots)))
            at = np.flatnonzero(np.isin(rows, known))
            which = np.searchsorted(known, rows[at])
            postures = np.array([spots[row][0] for row in known.tolist()])
            radii = np.array([spots[row][1] for row in known.tolist()])
            off = np.abs(_shorter(rotary[at] - postures[which])).max(axis=1, initial=0.0)
            free[at] &= off > radii[which]
        if ask is not None:
            open_rows = np.flatnonzero(free)
            free[open_rows] = ask(rows[open_rows], rotary[open_rows])
        return free

    def _rounds(self) -> list[dict[int, tuple[Array, float]]]:
        """Give the first spot of every location that has one, then the second ones, and so on."""
        most = max((len(known) for known in self.spots.values()), default=0)
        return [{row: known[k] for row, known in self.spots.items() if len(known) > k} for k in range(most)]


def _shorter(turn: Array) -> Array:
    """Take differences of angles to less than half a turn."""
    return np.asarray(np.mod(turn + np.pi, TURN) - np.pi)
