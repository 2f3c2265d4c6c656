"""Where a ball fits without gouging the part."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.mesh import TriangleTree

# mm: the ball may sink this deep into the surface, with 1e-6 mm left for rounding.
GOUGE = 0.01 - 1e-6
# mm: the same for straight cutting moves, which are chords of curves.
CHORD_GOUGE = 0.02
# mm: finest step of the checks along links, and step of those along cutting moves.
LINK_STEP, CHORD_STEP = 0.02, 0.1


@dataclass(frozen=True, eq=False)
class BallSpace:
    """The positions at which a ball doesn't gouge the part.

    Parameters
    ----------
    tree : the part's triangles
    radius : mm
    """

    tree: TriangleTree
    radius: float

    def fits(self, centres: Array) -> BoolArray:
        """Check whether the ball sinks by at most `GOUGE` at centres, (n, 3) mm."""
        limit = self.radius - GOUGE
        return self.tree.distances(centres, bound=limit) >= limit

    def chords_fit(self, start: Array, end: Array) -> BoolArray:
        """Check whether the ball sinks by at most `CHORD_GOUGE` in straight moves, (n, 3) mm each.

        Sampled every `CHORD_STEP`, as the moves are short and the surface below them is smooth.
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
        """Compute how far, mm, the ball can move from start towards end; −1 if it gouges at the start."""
        return self.tree.reach(start, end, self.radius - GOUGE, LINK_STEP)

    def clear(self, *centres: Array) -> bool:
        """Check whether the ball can follow a polyline of centres, (3,) mm each."""
        return all(self.reach(a, b) >= float(np.linalg.norm(b - a)) - 1e-12 for a, b in pairwise(centres))
