"""The room that the part leaves to a ball."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array
from fiveaxis.mesh import TriangleTree

# The ball may reach this deep into the surface, mm; a millionth less, so that rounding doesn't decide.
GOUGE = 0.01 - 1e-6
# Straight moves between contacts are chords of curves: they may reach this deep, mm.
CHORD_GOUGE = 0.02
# Step of the checks along a move where it runs beside a wall, mm.
LINK_STEP, CHORD_STEP = 0.02, 0.1


@dataclass(frozen=True, eq=False)
class BallSpace:
    """Where the centre of a ball of one radius can be.

    Parameters
    ----------
    tree : the part's triangles
    radius : mm
    """

    tree: TriangleTree
    radius: float

    def fits(self, centres: Array) -> NDArray[np.bool_]:
        """Tell for ball centres, (n, 3) mm, whether the ball stays out of the surface but for `GOUGE`."""
        limit = self.radius - GOUGE
        return self.tree.distances(centres, bound=limit) >= limit

    def chords_fit(self, start: Array, end: Array) -> NDArray[np.bool_]:
        """Tell for straight cutting moves, (n, 3) mm each, whether the ball stays out but for `CHORD_GOUGE`.

        Sampled every `CHORD_STEP`: the moves are short, and the surface under them is smooth.
        """
        limit = self.radius - CHORD_GOUGE
        length = np.linalg.norm(end - start, axis=1)
        parts = max(2, int(np.ceil(length.max(initial=0.0) / CHORD_STEP)))
        inner = np.arange(1, parts)[:, None, None] / parts
        samples = start + inner * (end - start)
        gaps = self.tree.distances(samples.reshape(-1, 3), bound=limit)
        lowest: Array = gaps.reshape(parts - 1, -1).min(axis=0)
        return lowest >= limit

    def reach(self, start: Array, end: Array) -> float:
        """How far, mm, the ball can go from start towards end; −1 if it can't even be at the start."""
        return self.tree.reach(start, end, self.radius - GOUGE, LINK_STEP)

    def clear(self, *way: Array) -> bool:
        """Tell whether the ball can follow a polyline of centres, (3,) mm each."""
        return all(self.reach(a, b) >= float(np.linalg.norm(b - a)) - 1e-12 for a, b in pairwise(way))
