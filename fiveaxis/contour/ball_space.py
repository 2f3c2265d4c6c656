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
# Contacts at most at which room for a ball is measured, and rounds of shrinking it.
MEASURED, ROUNDS = 1000, 30


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

    def rooms(self, points: Array, normals: Array) -> Array:
        """Find the radius of the largest ball that touches the surface at points without gouging elsewhere.

        From the given ball on, the ball is shrunk until it passes through the nearest point of the surface: a
        ball that touches p along the normal n passes through q if its radius is
        ``|q − p|² / (2 n·(q − p))``.

        Parameters
        ----------
        points, normals : (n, 3), mm and unit vectors; of more than `MEASURED` some are taken

        Returns
        -------
        (m,), mm, at most `radius`

        References
        ----------
        Ma, Bae, Choi (2012), 3D medial axis point approximation using nearest neighbors and the normal field.
        """
        some = np.unique(np.linspace(0, len(points) - 1, min(len(points), MEASURED)).astype(int))
        points, normals = points[some], normals[some]
        radius = np.full(len(points), self.radius)
        for _ in range(ROUNDS):
            centres = points + radius[:, None] * normals
            foot, _, distance = self.tree.nearest(centres)
            apart = foot - points
            ahead = np.einsum("ij,ij->i", normals, apart)
            sunk = (distance < radius - GOUGE) & (ahead > 0.0)
            if not sunk.any():
                break
            through = np.einsum("ij,ij->i", apart, apart) / (2.0 * np.where(sunk, ahead, 1.0))
            radius = np.where(sunk, np.minimum(through, radius), radius)
        return radius

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
        return all(self.reach(a, b) >= np.linalg.norm(b - a, axis=-1) - 1e-12 for a, b in pairwise(centres))
