"""The finished stock beside the part: what is gouged, what is left, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, JobError
from fiveaxis.cam import Mesh, facet_normals, tree_of
from fiveaxis.check.stock.dexels import UNCUT, Stock, Surface
from fiveaxis.check.stock.sources import fill
from fiveaxis.check.stock.sweeping import LARGEST, SHARE

# Length of the mean direction to finished places below which they are all around.
SURROUNDED = 0.4
# mm: what is farther from the part isn't compared with it.
REACH = 2.0


def sweep_tolerance(resolution: float) -> float:
    """Return how far segments may leave the true sweep, mm: a tenth of the resolution, at most 0.01 mm."""
    return min(SHARE * resolution, LARGEST)


@dataclass(frozen=True, eq=False)
class Deviations:
    """Points of the finished stock's surface near the part.

    Parameters
    ----------
    surface : ends of rays, and the middles of stretches of the part that rays have lost as a whole
    distance : (n,), mm from the part's surface: negative inside the part
    foot, normal : (n, 3), mm and unit vectors, nearest point of the part and the normal there
    area : (n,), mm² of the surface that each point stands for
    part_area : mm², of the part
    resolution : mm, distance of rays: between them a crest reads low, and thinner ribs may be missed
    uncertainty : mm, of a distance at a point: by how much segments may leave the true sweep
    left_volume, gouged_volume : mm³ that the stock has beyond the part, and that it lacks of it
    """

    surface: Surface
    distance: Array
    foot: Array
    normal: Array
    area: Array
    part_area: float
    resolution: float
    uncertainty: float
    left_volume: float
    gouged_volume: float

    @property
    def cut(self) -> BoolArray:
        """Which points a block has made, (n,)."""
        return np.asarray(self.surface.cut_by != UNCUT)

    @property
    def deepest(self) -> float:
        """Largest gouge, mm; 0 for none."""
        return max(0.0, -float(self.distance.min(initial=0.0)))

    def ridges(self, tolerance: float, radius: float) -> IntArray:
        """Find the highest points of what is left between finished places, (m,) indices.

        A ridge of height e between two passes of a ball is about √(8·R·e) wide, and has finished places on
        both of its sides; where a cut ends beside uncut stock they are on one. The part is finished within
        the tolerance, mm; the radius, mm, is the cutter's.
        """
        from scipy.spatial import cKDTree

        left = np.flatnonzero(self.cut & (self.distance > tolerance))
        finished = self.foot[self.cut & (np.abs(self.distance) <= tolerance)]
        if not (len(left) and len(finished)):
            return np.empty(0, dtype=np.int64)
        left = left[np.argsort(-self.distance[left], kind="stable")]
        left = left[_one_per_cell(self.foot[left], max(4.0 * self.resolution, 0.1 * radius))]
        finished = finished[_one_per_cell(finished, 2.0 * self.resolution)]
        reach = np.sqrt(2.0 * radius * self.distance[left]) + 4.0 * self.resolution
        near = cKDTree(finished).query_ball_point(self.foot[left], reach)
        balance = np.ones(len(left))
        for i, rows in enumerate(near):
            if rows:
                towards = finished[rows] - self.foot[left[i]]
                towards /= np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
                balance[i] = np.linalg.norm(towards.mean(axis=0), axis=-1)
        return left[balance <= SURROUNDED]

    def share(self, low: float, high: float) -> float:
        """Return the share of the part's area whose stock is between two distances, mm."""
        within = (self.distance >= low) & (self.distance <= high)
        return float(min(1.0, self.area[within].sum() / self.part_area))

    def worst_by_block(self, points: IntArray, values: Array) -> IntArray:
        """Return each block's point with the largest value, (n,), among some points, by descending value."""
        order = points[np.argsort(-values[points], kind="stable")]
        _, first = np.unique(self.surface.cut_by[order], return_index=True)
        return np.asarray(order[np.sort(first)])


def compare(stock: Stock, mesh: Mesh, part: Stock | None = None) -> Deviations:
    """Compare a stock with a closed mesh, mm; `part` is the mesh on the stock's grid, if it is known.

    Distances are exact at the ends of rays; their sign is that of the part's own rays.
    """
    part = fill(stock.emptied(), mesh) if part is None else part
    lost = part.without(stock)
    surface, gone = stock.surface(), _gone(lost)
    inside = part.holds(surface)
    tree, facets = tree_of(mesh), facet_normals(mesh.triangles)
    points = np.concatenate([surface.points, gone.points])
    foot, triangle, distance = tree.nearest(points, REACH)
    inside = np.concatenate([inside, np.ones(len(gone.points), dtype=bool)])
    # Farther outside isn't compared, but deeper inside is a gouge all the same.
    far = inside & (triangle < 0)
    if far.any():
        foot[far], triangle[far], distance[far] = tree.nearest(points[far])
    signed = np.where(inside, -distance, distance)
    near = triangle >= 0
    every = Surface.joined(surface, _named(gone, surface))
    normal = facets[triangle[near]]
    kept = every.at(near)
    across = np.abs(normal[np.arange(len(normal)), kept.direction])
    rays = np.array([stock.ray_area(d) for d in range(3)])[kept.direction]
    gouged = lost.volumes()
    return Deviations(
        surface=kept,
        distance=signed[near],
        foot=foot[near],
        normal=normal,
        # A bundle's ends have the density |n_d| / (its rays' area), and the squares of n_d add up to 1.
        area=np.where(np.arange(len(points))[near] < len(surface.points), across * rays, 0.0),
        part_area=mesh.area,
        resolution=stock.resolution,
        uncertainty=sweep_tolerance(stock.resolution),
        left_volume=float(np.mean(stock.volumes() - (part.volumes() - gouged))),
        gouged_volume=float(np.mean(gouged)),
    )


def _one_per_cell(points: Array, cell: float) -> IntArray:
    """Return the first point in each cube of a size, mm; ascending indices."""
    cubes = np.round(points / cell).astype(np.int64)
    return np.sort(np.unique(cubes, axis=0, return_index=True)[1])


def require_part_inside(stock: Stock, mesh: Mesh, part: Stock) -> None:
    """Raise `JobError` if a part reaches out of a stock, to its resolution, before anything is cut."""
    bounds = mesh.bounds
    out = np.maximum(stock.low - bounds[0], bounds[1] - stock.high)
    found = compare(stock, mesh, part)
    depth = max(float(out.max()), found.deepest)
    if depth > stock.resolution:
        if out.max() > stock.resolution:
            where = (
                f"beyond its {'low' if (stock.low - bounds[0]).max() >= out.max() else 'high'} side along "
            )
            where += "XYZ"[int(out.argmax())]
        else:
            x, y, z = found.foot[found.distance.argmin()]
            where = f"at {x:.4g}, {y:.4g}, {z:.4g}"
        raise JobError(
            f"the stock doesn't contain the part, which reaches {depth:.3g} mm out of it {where}; check that "
            "both have the same zero and unit, or take a larger stock"
        )


def _gone(lost: Stock) -> Surface:
    """Return the middles of stretches that rays have lost, no block named; shorter ones are cut surface."""
    parts = []
    for d, bundle in enumerate(lost.bundles):
        ends = bundle.ends.reshape(len(bundle.ends), -1, 2)
        ray, which = np.nonzero(bundle.held[:, ::2] & (ends[..., 1] - ends[..., 0] > lost.resolution))
        parts.append(lost.on_rays(d, ray, ends[ray, which].mean(axis=1), np.full(len(ray), UNCUT)))
    return Surface.joined(*parts)


def _named(gone: Surface, surface: Surface) -> Surface:
    """Give points that rays have lost the block that cut nearest to them."""
    from scipy.spatial import cKDTree

    cut = surface.cut_by != UNCUT
    if not len(gone.points) or not cut.any():
        return gone
    _, nearest = cKDTree(surface.points[cut]).query(gone.points)
    return Surface(gone.points, gone.direction, gone.ray, surface.cut_by[cut][nearest])
