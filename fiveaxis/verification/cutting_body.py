"""The cutting portion of a tool as bodies whose depth in a mesh can be computed exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.mesh import TriangleTree
from fiveaxis.threads import at_once
from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.cutter import Zone

QUARTER = math.pi / 2.0
# Rows per thread at once.
CHUNK = 256
# Points on the axis among which the one deepest inside the cutter is chosen.
HEARTS = 65


@dataclass(frozen=True, eq=False)
class Piece:
    """A convex body of revolution, or a ball.

    Parameters
    ----------
    zones : (m, 7), see `gouge_kernel.inside`
    low, high : mm above the tip, ends of the body; ∓∞ where its own profile closes it
    is_ball : whether it is the whole ball about ``(0, zones[0].height)``
    """

    zones: Array
    low: float
    high: float
    is_ball: bool = False

    def depths(self, tips: Array, axes: Array, tree: TriangleTree, floors: Array) -> Array:
        """Measure how deep the body reaches into triangles at each row, at least `floors`; (n,) mm."""
        from fiveaxis.verification import gouge_kernel

        if self.is_ball:
            centres = tips + self.zones[0, 2] * axes
            radius = float(self.zones[0, 0])
            return gouge_kernel.sunk_balls(centres, radius, tree.triangles, tree.boxes, floors)
        return gouge_kernel.deepest_all(
            tips, axes, self.zones, self.low, self.high, tree.triangles, tree.boxes, floors
        )


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

    pieces: tuple[Piece, ...]
    height: float
    is_stated: bool
    heart: float
    radius: float
    finest: float

    @classmethod
    def of(cls, tool: Tool) -> CuttingBody:
        """Build the body of a tool's cutter; a ball without cutting length is the whole ball."""
        cutter = tool.cutter
        top = float(np.vstack([zone.outline() for zone in cutter.zones])[-1, 1])
        height = max(top, tool.radius) if cutter.length is None else cutter.length
        pieces = _ball_pieces(tool, height) if cutter.is_ball else _pieces(cutter.zones, top, height)
        smooth = len(pieces) == 1 and pieces[0].is_ball
        finest = min(COARSE, math.sqrt(8.0 * tool.radius * SAG)) if smooth else FINEST
        heart = tool.radius if cutter.is_ball else _heart(pieces[0], height)
        return cls(pieces, height, cutter.length is not None, heart, tool.radius, finest)

    def depths(self, tips: Array, axes: Array, tree: TriangleTree, floors: Array) -> Array:
        """Measure how deep the cutter reaches into triangles.

        Depth is the shortest distance from the deepest point of the surface out of the cutter's profile,
        sideways, towards the tip or past its upper end: offset inwards by the depth, the profile would only
        touch. Of several pieces the largest depth counts, so where neck and ball of a lollipop meet it is
        slightly too small.

        Parameters
        ----------
        tips, axes : (n, 3), mm and unit vectors
        tree : of the part
        floors : (n,), mm; returned for smaller depths

        Returns
        -------
        (n,), mm; negative is clearance
        """
        tips, axes = np.ascontiguousarray(tips), np.ascontiguousarray(axes)
        depths = np.array(floors, dtype=float)

        def work(first: int) -> None:
            rows = slice(first, first + CHUNK)
            for piece in self.pieces:
                depths[rows] = piece.depths(tips[rows], axes[rows], tree, depths[rows])

        at_once([partial(work, start) for start in range(0, len(tips), CHUNK)])
        return depths


# mm: finest division of a ball's path; finer if a corner between two poses could be deeper than SAG.
COARSE, SAG = 0.5, 0.002
# mm: the same for other cutters, which may have sharp edges.
FINEST = 0.1


def _ball_pieces(tool: Tool, height: float) -> tuple[Piece, ...]:
    """Build the whole ball and the cylinder above it: as wide as the ball, or a lollipop's neck."""
    ball = Piece(_rows(tool.cutter.zones), 0.0, 2.0 * tool.radius, is_ball=True)
    end, top = tool.cutter.zones[0].outline()[-1]
    return (ball, _above(end, top, height)) if height > top + 1e-9 else (ball,)


def _pieces(zones: tuple[Zone, ...], top: float, height: float) -> tuple[Piece, ...]:
    """Split a profile where it stops being convex; above a profile that narrows there is a cylinder."""
    first, last = zones[0], zones[-1]
    if first.low > 0.0:
        zones = (Zone("tip", 0.0, 0.0, 0.0, 0.0, first.low), *zones)
    end = float(last.outline()[-1, 0])
    if last.high > QUARTER + 1e-9:
        if height > top:
            return Piece(_rows(zones), -math.inf, top), _above(end, top, height)
        return (Piece(_rows([*zones, _lid(end, top, last.high)]), -math.inf, math.inf),)
    rim = Zone("rim", 0.0, end, top, last.high, QUARTER)
    return (Piece(_rows([*zones, rim, _lid(end, height)]), -math.inf, math.inf),)


def _above(radius: float, low: float, high: float) -> Piece:
    """Build the cylinder above a profile."""
    side = Zone("side", 0.0, radius, 0.0, QUARTER, QUARTER)
    return Piece(_rows([side, _lid(radius, high)]), low, math.inf)


def _lid(radius: float, height: float, low: float = QUARTER) -> Zone:
    """Close a profile at its end, so that depth grows gradually for what enters from above."""
    return Zone("lid", 0.0, radius, height, low, math.pi)


def _rows(zones: list[Zone] | tuple[Zone, ...]) -> Array:
    ends = [[f(angle) for angle in (z.low, z.high) for f in (math.sin, math.cos)] for z in zones]
    return np.array([[z.radius, z.offset, z.height, *end] for z, end in zip(zones, ends, strict=True)])


def _heart(piece: Piece, height: float) -> float:
    """Find the point of the axis that is deepest inside a piece, mm above the tip."""
    from fiveaxis.verification import gouge_kernel

    heights = np.linspace(0.0, min(piece.high, height), HEARTS)
    return float(heights[np.argmax([gouge_kernel.inside(0.0, z, piece.zones)[0] for z in heights])])
