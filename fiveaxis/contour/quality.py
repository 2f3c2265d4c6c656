"""How good a planned path is: the ridges that it leaves and the error of its straight moves, measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.contour.ball_space import CHORD_GOUGE
from fiveaxis.contour.options import PlanOptions, Strategy
from fiveaxis.contour.walls import Walls
from fiveaxis.errors import ToolError
from fiveaxis.geometry import Array, BoolArray, IntArray, normalise
from fiveaxis.mesh import TriangleTree, facet_normals, take_mesh
from fiveaxis.toolpath import Toolpath

if TYPE_CHECKING:
    import trimesh

# Places along a straight move at which its distance from the surface is measured.
SHARES = (0.25, 0.5, 0.75)
# Cosine of the largest angle between the normals of neighbouring passes, and of the surface between them.
SAME_SIDE = 0.5
# Passes nearer to each other than this share of the radius, as where a spiral begins, are one.
COINCIDING = 0.03


@dataclass(frozen=True)
class PlanReport:
    """What a planned path leaves on the surface.

    Parameters
    ----------
    scallop_largest, scallop_mean : mm, height above the part of the ridges between neighbouring passes,
        measured at every cutting contact to either side; the mean is weighted by the length cut
    chord_largest : mm, how far the ball is from just touching the part between two contacts of a pass, at
        most, in or off it
    ridges : number of measured ridges
    edges : sides of contacts without a pass beside them on the wall, within the ball's reach
    cut_length, link_length : mm, way of the ball's centre on cuts, and on links
    """

    scallop_largest: float
    scallop_mean: float
    chord_largest: float
    ridges: int
    edges: int
    cut_length: float
    link_length: float


def path_quality(
    toolpath: Toolpath,
    part: str | Path | trimesh.Trimesh,
    *,
    strategy: Strategy = "waterline",
    raster_angle: float | None = None,
    overhang: bool = False,
    allow_open: bool = False,
) -> PlanReport:
    """Measure ridges and chords of a path of contacts.

    The section across the feed at a contact shows the balls of this pass and of the one beside it. Where
    their outlines meet, the ridge has its tip; its height is the distance of the tip to the part: that is
    exact on curved surfaces too, and on a flat one it is the ``R − sqrt(R² − d²/4)`` of passes at a distance
    d. No formula of the planner is used. Only walls that were to be cut count, and only places that the ball
    can touch: what an inner corner keeps is no ridge.

    Parameters
    ----------
    toolpath : cuts with contacts and normals, of a ball
    part : mesh file, or mesh, mm, workpiece frame
    strategy, raster_angle, overhang : as they were given to `plan_contour`: what stays standing on faces that
        these leave out is no ridge
    allow_open : go on with a mesh that isn't watertight

    Raises
    ------
    ToolError
        A cutter that isn't a ball.
    SettingError
        An unknown strategy, or an angle without a raster.
    MeshError
        A mesh that can't be read.
    """
    if not toolpath.tool.cutter.is_ball:
        raise ToolError(f"tool {toolpath.tool}: ridges are measured for balls only; give for example ball:10")
    mesh = take_mesh(part, allow_open=allow_open)
    triangles = np.array(mesh.triangles, dtype=float)
    options = PlanOptions(strategy, raster_angle=raster_angle, overhang=overhang)
    cuts = _Cuts.of(toolpath)
    heights, rows = _ridges(cuts, triangles, Walls(options.frame[2], overhang))
    weight = cuts.way[rows]
    total = float(weight.sum())
    length = toolpath.lengths
    return PlanReport(
        scallop_largest=float(heights.max(initial=0.0)),
        scallop_mean=float(heights @ weight / total) if total > 0.0 else 0.0,
        chord_largest=_chord_error(cuts, triangles),
        ridges=len(heights),
        edges=2 * int(cuts.moving.sum()) - len(heights),
        cut_length=float(length[toolpath.cutting].sum()),
        link_length=float(length[~toolpath.cutting].sum()),
    )


@dataclass(frozen=True, eq=False)
class _Cuts:
    """The cutting rows of a path, and the moves between them.

    Parameters
    ----------
    centres, points, normals : (n, 3), mm and unit vectors
    heading : (n, 3), unit vectors along the pass, zero where `moving` is false
    moving : (n,), rows that have a neighbour on their own pass
    starts : (m,), rows from which a cutting move leads to the next row
    way : (n,), mm, half of the moves before and after a row
    radius : mm
    """

    centres: Array
    points: Array
    normals: Array
    heading: Array
    moving: BoolArray
    starts: IntArray
    way: Array
    radius: float

    @classmethod
    def of(cls, toolpath: Toolpath) -> _Cuts:
        rows = np.flatnonzero(toolpath.cutting & np.isfinite(toolpath.normal).all(axis=1))
        points = toolpath.contact[rows]
        joined = np.diff(rows) == 1
        steps = np.where(joined[:, None], np.diff(points, axis=0), 0.0)
        none = np.zeros((1, 3))
        heading = np.vstack([none, steps]) + np.vstack([steps, none])
        length = np.linalg.norm(heading, axis=1)
        gaps = np.linalg.norm(steps, axis=1)
        moving = length > 1e-9
        heading[moving] = normalise(heading[moving])
        return cls(
            centres=toolpath.pivot[rows],
            points=points,
            normals=toolpath.normal[rows],
            heading=np.where(moving[:, None], heading, 0.0),
            moving=moving,
            starts=np.flatnonzero(joined),
            way=(np.append(gaps, 0.0) + np.append(0.0, gaps)) / 2.0,
            radius=toolpath.tool.radius,
        )


def _ridges(cuts: _Cuts, triangles: Array, walls: Walls) -> tuple[Array, IntArray]:
    """Measure the ridges beside the passes: heights, (k,) mm, and the row at which each was measured."""
    from fiveaxis.contour.crossings import crossings

    if len(cuts.starts) == 0:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    move, along = crossings(cuts.points, cuts.heading, cuts.normals, cuts.starts, 2.0 * cuts.radius)
    row, side = np.nonzero(move >= 0)
    begin, t = cuts.starts[move[row, side]], along[row, side][:, None]
    here = cuts.centres[row]
    there = (1.0 - t) * cuts.centres[begin] + t * cuts.centres[begin + 1]
    apart = there - here
    distance2 = np.einsum("ij,ij->i", apart, apart)
    up = cuts.normals[row] + (1.0 - t) * cuts.normals[begin] + t * cuts.normals[begin + 1]
    # Where passes all but coincide, the line between them says nothing about where up is.
    share = np.einsum("ij,ij->i", up, apart) / np.maximum(distance2, 1e-12)
    up -= np.where(distance2 > (COINCIDING * cuts.radius) ** 2, share, 0.0)[:, None] * apart
    depth = np.sqrt(np.maximum(0.0, cuts.radius**2 - distance2 / 4.0))
    tip = (here + there) / 2.0 - depth[:, None] * normalise(up)
    tree = TriangleTree.build(triangles)
    foot, triangle, height = tree.nearest(tip)
    # Between the passes there may be something else than their wall: a floor, an edge, an inner corner.
    facet = facet_normals(triangles)[triangle]
    wall = walls.keep(facet) & (np.einsum("ij,ij->i", facet, normalise(up)) > SAME_SIDE)
    limit = cuts.radius - CHORD_GOUGE
    reached = tree.distances(foot + cuts.radius * facet, bound=limit) >= limit
    measured = wall & reached & (distance2 < 4.0 * cuts.radius**2)
    return height[measured], row[measured]


def _chord_error(cuts: _Cuts, triangles: Array) -> float:
    """Largest deviation of the ball from just touching on straight cutting moves, mm."""
    start, end = cuts.centres[cuts.starts], cuts.centres[cuts.starts + 1]
    samples = np.vstack([start + share * (end - start) for share in SHARES])
    gaps = TriangleTree.build(triangles).distances(samples)
    return float(np.abs(gaps - cuts.radius).max(initial=0.0))
