"""The cutting portion of a tool as bodies whose depth in a mesh can be computed exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from fiveaxis.base import Array, at_once
from fiveaxis.cam import Model, TriangleTree
from fiveaxis.model import ConvexPiece, Tool, cutter_height, cutter_pieces

# Rows per thread at once.
CHUNK = 256
# Points on the axis among which the one deepest inside the cutter is chosen.
HEARTS = 65
# mm: finest division of a ball's path; finer if a corner between two poses could be deeper than SAG.
COARSE, SAG = 0.5, 0.002
# mm: the same for other cutters, which may have sharp edges.
FINEST = 0.1


@dataclass(frozen=True, eq=False)
class CuttingBody:
    """The cutting portion of a tool.

    Parameters
    ----------
    pieces : convex bodies; the cutter is their union
    height : mm above the tip, of its upper end
    is_stated : whether the tool states it; else it is the profile's end, at least the cutter's radius
    heart : mm above the tip, of the point on the axis that is deepest inside
    radius : mm, the largest
    finest : mm, movement of the cutter below which moves aren't divided
    """

    pieces: tuple[ConvexPiece, ...]
    height: float
    is_stated: bool
    heart: float
    radius: float
    finest: float

    @classmethod
    def of(cls, tool: Tool) -> CuttingBody:
        """Build the body of a tool's cutter; a ball without cutting length is the whole ball."""
        cutter = tool.cutter
        height, pieces = cutter_height(tool), cutter_pieces(tool)
        smooth = len(pieces) == 1 and pieces[0].is_ball
        finest = min(COARSE, math.sqrt(8.0 * tool.radius * SAG)) if smooth else FINEST
        heart = tool.radius if cutter.is_ball else _heart(pieces[0], height)
        return cls(pieces, height, cutter.length is not None, heart, tool.radius, finest)

    def depths(self, tips: Array, axes: Array, part: TriangleTree | Model, floors: Array) -> Array:
        """Measure how deep the cutter reaches into triangles or, to 0.1 µm, the exact surfaces of a model.

        Depth, (n,) mm, is the shortest distance from the deepest point of the surface out of the cutter's
        profile, sideways, towards the tip or past its upper end: offset inwards by the depth, the profile
        would only touch. Negative is clearance; for depths below the floors, (n,) mm, these are returned. Of
        several pieces the largest depth counts, so where neck and ball of a lollipop meet it is slightly too
        small. Tips and axes are (n, 3), mm and unit vectors.
        """
        measure: Callable[..., Array] = piece_depths
        if not isinstance(part, TriangleTree):
            measure = exact_piece_depths
        tips, axes = np.ascontiguousarray(tips), np.ascontiguousarray(axes)
        depths = np.array(floors, dtype=float)

        def work(first: int) -> None:
            rows = slice(first, first + CHUNK)
            for piece in self.pieces:
                depths[rows] = measure(piece, tips[rows], axes[rows], part, depths[rows])

        at_once([partial(work, start) for start in range(0, len(tips), CHUNK)])
        return depths


def piece_depths(piece: ConvexPiece, tips: Array, axes: Array, tree: TriangleTree, floors: Array) -> Array:
    """Measure how deep a body reaches into triangles at each row, at least `floors`; (n,) mm."""
    from fiveaxis.check.verification import gouge_kernel

    if piece.is_ball:
        centres = tips + piece.zones[0, 2] * axes
        radius = float(piece.zones[0, 0])
        return gouge_kernel.sunk_balls(centres, radius, tree.triangles, tree.boxes, floors)
    body = piece.zones, piece.low, piece.high
    return gouge_kernel.deepest_all(tips, axes, body, tree.triangles, tree.boxes, floors)


def exact_piece_depths(piece: ConvexPiece, tips: Array, axes: Array, model: Model, floors: Array) -> Array:
    """Measure how deep a body reaches into exact surfaces at each row, at least `floors`; (n,) mm."""
    from fiveaxis.check.verification import exact_depth

    if piece.is_ball:
        radius, height = piece.zones[0, [0, 2]]
        return np.maximum(radius - model.nearest(tips + height * axes).distance, floors)
    body, surfaces = (piece.zones, piece.low, piece.high), model.surfaces
    return exact_depth.deepest_all(tips, axes, body, model.shell.mesh, surfaces, model.deviation, floors)


def _heart(piece: ConvexPiece, height: float) -> float:
    """Find the point of the axis that is deepest inside a piece, mm above the tip."""
    from fiveaxis.model import inside

    heights = np.linspace(0.0, min(piece.high, height), HEARTS)
    return float(heights[np.argmax([inside(0.0, z, piece.zones)[0] for z in heights])])
