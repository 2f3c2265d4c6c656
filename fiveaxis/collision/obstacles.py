"""What the tool must keep clear of, in the workpiece frame, as triangles."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fiveaxis.collision.kernel import meets_all
from fiveaxis.collision.solids import Solid
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.mesh import TriangleTree

# Questions to each thread at once: enough for the work to outweigh the call.
CHUNK = 250


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Triangles, and the solids of the tool that must stay clear of them.

    Parameters
    ----------
    name : part, fixture…
    tree : the triangles, workpiece frame
    solids : each grown by its clearance
    """

    name: str
    tree: TriangleTree
    solids: tuple[Solid, ...]

    @classmethod
    def build(cls, name: str, triangles: Array, solids: Sequence[Solid]) -> Obstacle:
        """Sort triangles, (f, 3, 3) mm, into a tree."""
        tree = TriangleTree.build(np.ascontiguousarray(triangles, dtype=float))
        return cls(name, tree, tuple(s for s in solids if len(s.frusta)))

    def met(self, tip: Array, axis: Array) -> BoolArray:
        """Tell which tools at tips, (m, 3) mm, along unit vectors, (m, 3), reach into it; (m,)."""
        if not self.solids or not len(tip):
            return np.zeros(len(tip), dtype=bool)
        # The thick parts are quickest to meet, and to keep clear.
        frusta = np.ascontiguousarray(np.concatenate([s.frusta for s in reversed(self.solids)]))
        triangles, boxes = self.tree.triangles, self.tree.boxes
        tip, axis = np.ascontiguousarray(tip, dtype=float), np.ascontiguousarray(axis, dtype=float)
        starts = range(0, len(tip), CHUNK)
        if len(starts) == 1:
            return np.asarray(meets_all(tip, axis, frusta, triangles, boxes))
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            parts = pool.map(
                lambda at: meets_all(tip[at : at + CHUNK], axis[at : at + CHUNK], frusta, triangles, boxes),
                starts,
            )
            return np.concatenate(list(parts))
