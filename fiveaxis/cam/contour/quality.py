"""Quality of a planned path, measured: the ridges that it leaves and the error of its straight moves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import SURFACE_TOLERANCE, Array, BoolArray, IntArray, MeshSource, normalise, product
from fiveaxis.cam.contour.ball_space import CHORD_GOUGE
from fiveaxis.cam.contour.options import PlanOptions
from fiveaxis.cam.mesh.cad.choice import of_faces
from fiveaxis.cam.mesh.cad.model import Model
from fiveaxis.cam.mesh.distance import TriangleTree, tree_of
from fiveaxis.cam.mesh.mesh import Mesh
from fiveaxis.cam.mesh.surface import facet_normals
from fiveaxis.model import Toolpath

if TYPE_CHECKING:
    from fiveaxis.cam.contour.strips import Strips

# Shares of a straight move at which its distance from the surface is measured.
SHARES = (0.25, 0.5, 0.75)
# Cosine of the largest angle between the normals of neighbouring passes, and of the surface between them.
SAME_SIDE = 0.5
# Cosine of the largest angle between the normal on a face's border and the way to a point above the face.
ABOVE = 0.99
# Tips are cut away by another pass if by more than this share of their height; halvings of what is left.
LEAST_CUT, CUT_HALVINGS = 0.01, 8
# Passes closer together than this share of the radius, as where a spiral begins, count as one.
COINCIDING = 0.03
EMPTY = np.zeros(0, dtype=np.int64)
# Halvings of the distance of two passes in the search for the ridge between them.
HALVINGS = 14


@dataclass(frozen=True)
class PlanReport:
    """Figures of a planned path.

    Parameters
    ----------
    scallop_largest, scallop_mean : mm, height above the part of the ridges between neighbouring passes,
        measured at every cutting contact on both sides; the mean is weighted by the length cut. NaN where
        the tool axes aren't known and the cutter is no ball: they depend on them
    chord_largest : mm, largest gap or depth between ball and part between two contacts of a pass
    ridges : number of measured ridges
    edges : number of contacts' sides without a neighbouring pass within the cutter's reach
    cut_length, link_length : mm, travel of the ball's centre in cuts and in links
    part_size : (3,), mm, extents of the part
    """

    scallop_largest: float
    scallop_mean: float
    chord_largest: float
    ridges: int
    edges: int
    cut_length: float
    link_length: float
    part_size: Array


def path_quality(toolpath: Toolpath, part: MeshSource, options: PlanOptions | None = None) -> PlanReport:
    """Measure ridges and chords of a path of contacts.

    In the section normal to the feed at a contact, the outlines of the balls of this pass and its neighbour
    meet at the tip of the ridge. Its height is the tip's distance from the part, which is exact on curved
    surfaces too; on a flat one it is ``R − sqrt(R² − d²/4)`` for passes a distance d apart. The ridge of
    another cutter is where, between the contacts, both passes leave the same height along rays off the part,
    as the cutter leans there (`fiveaxis.cam.contour.strips`). No formula of the
    planner is used. Only the walls to be cut count, and only points that the ball can touch: material left in
    an inner corner isn't a ridge. Of a CAD file, its exact surfaces are measured.

    Parameters
    ----------
    toolpath : with contacts and normals at its cuts and, unless the cutter is a ball, with tool axes
    part : mesh file or mesh, workpiece frame
    options : with which it was planned; they say how the part is read, and select the walls that count

    Raises
    ------
    SettingError
        Faces that there are none of.
    MeshError
        The mesh can't be read.
    """
    options = options or PlanOptions()
    mesh = options.mesh(part)
    measured = _Part.of(mesh, options)
    cuts = _Cuts.of(toolpath, measured)
    known = toolpath.zone.offset == 0.0 or cuts.strips is not None
    heights, rows = _ridges(cuts, measured) if known else (np.zeros(0), EMPTY)
    weight = cuts.weight[rows]
    total = float(weight.sum())
    nothing = 0.0 if known else np.nan
    return PlanReport(
        scallop_largest=float(heights.max()) if len(heights) else nothing,
        scallop_mean=float(product(heights, weight) / total) if total > 0.0 else nothing,
        chord_largest=_chord_error(cuts, measured),
        ridges=len(heights),
        edges=2 * int(cuts.moving.sum()) - len(heights),
        cut_length=float(toolpath.lengths[toolpath.cutting].sum()),
        link_length=float(toolpath.lengths[~toolpath.cutting].sum()),
        part_size=mesh.extents,
    )


@dataclass(frozen=True, eq=False)
class _Part:
    """What is measured: the exact surfaces of a part, or else its mesh.

    Parameters
    ----------
    tree : of the mesh
    facets : (t, 3), its normals
    cut : (t,), triangles of the faces to be cut
    options : which of them count
    model : the exact surfaces, where they are known
    """

    tree: TriangleTree
    facets: Array
    cut: BoolArray
    options: PlanOptions
    model: Model | None

    @classmethod
    def of(cls, mesh: Mesh, options: PlanOptions) -> _Part:
        model, facets = mesh.model, facet_normals(mesh.triangles)
        every = np.ones(len(facets), dtype=bool)
        cut = every if options.faces is None else of_faces(model, options.faces, "mesh")
        return cls(tree_of(mesh), facets, cut, options, model)

    def nearest(self, points: Array) -> tuple[Array, Array, BoolArray]:
        """Find the nearest points and their normals, (n, 3) each, and whether they are to be cut, (n,)."""
        foot, triangle, _ = self.tree.nearest(points)
        normals, cut = self.facets[triangle], self.cut[triangle]
        if self.model is not None:
            exact = self.model.nearest(points)
            foot, normals = exact.point, exact.normal
            cut = np.isin(exact.face, np.unique(self.model.owner[self.cut]))
            # Beyond the border of a face there is none.
            cut &= ~exact.on_border | (np.sum((points - foot) * normals, axis=1) > ABOVE * exact.distance)
        return foot, normals, cut & self.options.is_wall(normals)

    def distances(self, points: Array, bound: float) -> Array:
        """Compute distances, (n,) mm, as far as they decide whether points are within a bound."""
        return (self.model or self.tree).distances(points, bound)


@dataclass(frozen=True, eq=False)
class _Cuts:
    """The cutting rows of a path, and the moves between them.

    Parameters
    ----------
    centres : (n, 3), mm
    points, normals : (n, 3), mm and unit vectors, where the ball comes nearest to the mesh
    heading : (n, 3), unit vectors along the pass, zero where `moving` is false
    moving : (n,), rows with a neighbour in their pass
    starts : (m,), rows from which a cutting move leads to the next row
    weight : (n,), mm, half the length of the moves before and after a row
    radius : mm, of the ball or, of another cutter, its largest
    ball : mm, radius of the ball about the centres
    strips : what the passes of a leaned cutter leave; None for a ball, or without tool axes
    """

    centres: Array
    points: Array
    normals: Array
    heading: Array
    moving: BoolArray
    starts: IntArray
    weight: Array
    radius: float
    ball: float
    strips: Strips | None

    @classmethod
    def of(cls, toolpath: Toolpath, part: _Part) -> _Cuts:
        rows = np.flatnonzero(toolpath.cutting & np.isfinite(toolpath.normal).all(axis=1))
        zone, is_ball = toolpath.zone, toolpath.zone.offset == 0.0
        if not is_ball:
            # The move to the first contact of a pass counts as a cut, and locations may have been inserted.
            rows = rows[part.tree.distances(toolpath.contact[rows]) < SURFACE_TOLERANCE]
        ball = zone.principal_radii(zone.least)[0]
        centres = toolpath.pivot[rows] + (ball - zone.radius) * toolpath.normal[rows]
        points, _, _ = part.nearest(centres if is_ball else toolpath.contact[rows])
        strips = None
        if not is_ball and toolpath.has_axes:
            from fiveaxis.cam.contour.strips import Strips  # numba is slow to load

            strips = Strips.of(toolpath, rows, points)
        joined = np.diff(rows) == 1
        steps = np.where(joined[:, None], np.diff(points, axis=0), 0.0)
        none = np.zeros((1, 3))
        heading = np.vstack([none, steps]) + np.vstack([steps, none])
        length = np.linalg.norm(heading, axis=1)
        gaps = np.linalg.norm(steps, axis=1)
        moving = length > 1e-9
        heading[moving] = normalise(heading[moving])
        return cls(
            centres=centres,
            points=points,
            normals=normalise(centres - points) if is_ball else toolpath.normal[rows],
            heading=np.where(moving[:, None], heading, 0.0),
            moving=moving,
            starts=np.flatnonzero(joined),
            weight=(np.append(gaps, 0.0) + np.append(0.0, gaps)) / 2.0,
            radius=ball if is_ball else toolpath.tool.radius,
            ball=ball,
            strips=strips,
        )

    @cached_property
    def tree(self) -> TriangleTree:
        """The straight moves of the ball's centre between rows of a pass."""
        ends = self.centres[self.starts], self.centres[self.starts + 1]
        return TriangleTree.build(np.stack([*ends, ends[1]], axis=1))


def _ridges(cuts: _Cuts, part: _Part) -> tuple[Array, IntArray]:
    """Measure the ridges next to passes: heights, (k,) mm, and the row at which each was measured."""
    from fiveaxis.cam.contour.crossings import crossings  # numba is slow to load

    if len(cuts.starts) == 0:
        return np.zeros(0), EMPTY
    move, along = crossings(cuts.points, cuts.heading, cuts.normals, cuts.starts, 2.0 * cuts.radius)
    row, side = np.nonzero(move >= 0)
    begin, t = cuts.starts[move[row, side]], along[row, side][:, None]
    here = cuts.centres[row]
    there = (1.0 - t) * cuts.centres[begin] + t * cuts.centres[begin + 1]
    apart = there - here
    distance2 = np.einsum("ij,ij->i", apart, apart)
    up = cuts.normals[row] + (1.0 - t) * cuts.normals[begin] + t * cuts.normals[begin + 1]
    # Where passes nearly coincide, the line between them doesn't define the upward direction.
    share = np.einsum("ij,ij->i", up, apart) / np.maximum(distance2, 1e-12)
    up -= np.where(distance2 > (COINCIDING * cuts.radius) ** 2, share, 0.0)[:, None] * apart
    up = normalise(up)
    if cuts.strips is None:
        depth = np.sqrt(np.maximum(0.0, cuts.radius**2 - distance2 / 4.0))
        tip = (here + there) / 2.0 - depth[:, None] * up
        foot, normals, wall = part.nearest(tip)
        height = _left(cuts, foot, tip)
    else:
        span = cuts.points[row], (1.0 - t) * cuts.points[begin] + t * cuts.points[begin + 1]
        places = row.astype(float), begin + t[:, 0]
        foot, normals, wall, height = _between(cuts.strips, span, places, up, part)
    # Between the passes there may be a floor, an edge or an inner corner instead of their wall.
    wall &= np.einsum("ij,ij->i", normals, up) > SAME_SIDE
    limit = cuts.ball - CHORD_GOUGE
    reached = part.distances(foot + cuts.ball * normals, limit) >= limit
    measured = wall & reached & (distance2 < 4.0 * cuts.radius**2) & np.isfinite(height)
    return height[measured], row[measured]


def _between(
    strips: Strips, span: tuple[Array, Array], places: tuple[Array, Array], up: Array, part: _Part
) -> tuple[Array, Array, BoolArray, Array]:
    """Find the ridges between two passes of a leaned cutter.

    Parameters
    ----------
    span : (k, 3) mm each, contacts on both
    places : (k,), fractional locations on both
    up : (k, 3), unit vectors off the part

    Returns
    -------
    As of `_Part.nearest` below each ridge, and its height above it, mm; infinite where no cutter goes by on
    one side, as at the end of a pass
    """
    low, high = np.zeros(len(up)), np.ones(len(up))
    for _ in range(HALVINGS):
        share = (low + high) / 2.0
        foot, normals, wall = part.nearest(span[0] + share[:, None] * (span[1] - span[0]))
        (own, ends), (other, others) = (strips.heights(foot, up, place) for place in places)
        low, high = np.where(own < other, share, low), np.where(own < other, high, share)
    return foot, normals, wall, np.where(ends | others, np.inf, np.minimum(own, other))


def _left(cuts: _Cuts, foot: Array, tip: Array) -> Array:
    """Find how high ridges are, (n,) mm, of whose tips, (n, 3) mm, other passes may have cut away a part.

    They do where passes cross or end beside each other.
    """
    height = np.linalg.norm(tip - foot, axis=1)
    depth = cuts.radius - cuts.tree.distances(tip, bound=cuts.radius)
    rows = np.flatnonzero(depth > LEAST_CUT * height)
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for _ in range(CUT_HALVINGS):
        share = (low + high) / 2.0
        between = foot[rows] + share[:, None] * (tip[rows] - foot[rows])
        is_cut = cuts.tree.distances(between, bound=cuts.radius) < cuts.radius
        low, high = np.where(is_cut, low, share), np.where(is_cut, share, high)
    height[rows] *= high
    return height


def _chord_error(cuts: _Cuts, part: _Part) -> float:
    """Measure the largest gap or depth of the ball in straight cutting moves, mm."""
    start, end = cuts.centres[cuts.starts], cuts.centres[cuts.starts + 1]
    samples = np.vstack([start + share * (end - start) for share in SHARES])
    gaps = np.linalg.norm(samples - part.nearest(samples)[0], axis=1)
    return float(np.abs(gaps - cuts.ball).max(initial=0.0))
