"""Where a ball fits without gouging the part, and its clear routes: out of it, and between contacts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, product
from fiveaxis.cam.mesh.cad.model import Model
from fiveaxis.cam.mesh.distance import TriangleTree

# mm: the ball may sink this deep into the surface, with 1e-6 mm left for rounding.
GOUGE = 0.01 - 1e-6
# mm: the same for straight cutting moves, which are chords of curves.
CHORD_GOUGE = 0.02
# mm: finest step of the checks along links, and step of those along cutting moves.
LINK_STEP, CHORD_STEP = 0.02, 0.1
# Contacts at most at which room for a ball is measured, and rounds of shrinking it.
MEASURED, ROUNDS = 1000, 30
# Lifts off the surface along its normal, as shares of the largest one, best first.
LIFTS = (1.0, 0.5, 0.2, 0.05, 0.01)
# Horizontal directions searched for a route out from under an overhang, and most points tried along each.
DIRECTIONS, TRIALS = 16, 24
# Radii of a lead's arc, as shares of the wanted one, best first.
LEADS = (1.0, 0.5, 0.25)
# mm: a shorter last step of a pass along the surface has no direction.
SHORTEST = 1e-6
# mm: largest chord error of the straight moves along an arc.
ARC_DEPTH = 0.01


@dataclass(frozen=True, eq=False)
class PassEnd:
    """Start or end of a pass.

    Parameters
    ----------
    pivot : (3,), mm, workpiece frame
    normal : (3,), unit vector out of the material
    outward : (3,), mm, from the neighbouring location of the pass to this one
    """

    pivot: Array
    normal: Array
    outward: Array


@dataclass(frozen=True, eq=False)
class BallSpace:
    """The positions at which a ball doesn't gouge the part.

    Parameters
    ----------
    tree : the part's triangles
    radius : mm
    model : the part's exact surfaces, which decide where the mesh is too near to the limit to do so
    """

    tree: TriangleTree
    radius: float
    model: Model | None = None

    @property
    def part(self) -> TriangleTree | Model:
        """What distances are measured to."""
        return self.model or self.tree

    def fits(self, centres: Array) -> BoolArray:
        """Check whether the ball sinks by at most `GOUGE` at centres, (n, 3) mm."""
        limit = self.radius - GOUGE
        return self.part.distances(centres, bound=limit) >= limit

    def rooms(self, points: Array, normals: Array) -> Array:
        """Find the radius of the largest ball that touches the surface at points without gouging elsewhere.

        From the given ball on, the ball is shrunk until it passes through the nearest point of the surface: a
        ball that touches p along the normal n passes through q if its radius is
        ``|q − p|² / (2 n·(q − p))``. Points and normals are (n, 3) mm and unit vectors; of more than
        `MEASURED` some are taken. The result is (m,) mm.

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
        gaps = self.part.distances(samples.reshape(-1, 3), bound=limit)
        lowest: Array = gaps.reshape(parts - 1, -1).min(axis=0)
        return lowest >= limit

    def reach(self, start: Array, end: Array) -> float:
        """Compute how far, mm, the ball can move from start towards end; −1 if it gouges at the start."""
        return self.part.reach(start, end, self.radius - GOUGE, LINK_STEP)

    def clear(self, *centres: Array) -> bool:
        """Check whether the ball can follow a polyline of centres, (3,) mm each."""
        return all(self.reach(a, b) >= np.linalg.norm(b - a, axis=-1) - 1e-12 for a, b in pairwise(centres))


@dataclass(frozen=True, eq=False)
class Lead:
    """How the ball leaves a contact or, in reverse, approaches one.

    Parameters
    ----------
    arc : (k, 3), mm, centres on the arc from the contact outward; may be empty
    route : (m, 3), mm, centres from there to the clearance plane
    """

    arc: Array
    route: Array

    @property
    def centres(self) -> Array:
        """(k + m, 3), mm, arc and route."""
        return np.vstack([self.arc, self.route])


@dataclass(frozen=True, eq=False)
class Linker:
    """Finds routes of the ball's centre that keep the ball out of the part.

    They begin and end at contacts, given by the centre of the ball that touches there.

    Parameters
    ----------
    space : where the ball fits
    bounds : (2, 3), mm, the part's lowest and highest coordinates
    clearance : mm, between the part's top and the ball on the clearance plane
    step : mm, along the normal from the centre of the ball that touches to that of the linked one: larger
        than 0 for cutters that aren't balls, which are linked as the ball that holds their profile
    found : cache of routes: different orders of the passes need the same ones
    """

    space: BallSpace
    bounds: Array
    clearance: float
    step: float = 0.0
    found: dict[bytes, Array | None] = field(default_factory=dict)

    @property
    def plane(self) -> float:
        """Height of the ball's centre on the clearance plane, mm."""
        return float(self.bounds[1, 2] + self.space.radius + self.clearance)

    @property
    def lifts(self) -> list[float]:
        """Lifts off the surface, mm, best first; the largest is the clearance or the ball's diameter."""
        return [share * min(self.clearance, 2.0 * self.space.radius) for share in LIFTS]

    @property
    def farthest(self) -> float:
        """Largest distance, mm, of contacts that are linked close to the surface."""
        return 2.0 * (2.0 * self.space.radius + self.clearance)

    @property
    def exit_length(self) -> float:
        """Length of a horizontal move, mm, that ends beside the part wherever it begins."""
        across = np.linalg.norm(self.bounds[1, :2] - self.bounds[0, :2], axis=-1)
        return float(across + 2.0 * self.space.radius + self.clearance)

    def escape(self, centre: Array, normal: Array) -> Array | None:
        """Find a route from the ball's centre at a contact, (3,) mm, to the clearance plane.

        It follows the normal, then goes straight up. Under an overhang it first goes horizontally until the
        move up is clear, at the latest beside the part. Directions near the normal's are tried first.

        Returns
        -------
        (2 or 3, 3), mm, centres after the contact, the last one on the clearance plane; None if no route is
        clear
        """
        return self._once((centre, normal), lambda: self._escape(centre, normal))

    def lead(self, end: PassEnd, radius: float) -> Lead | None:
        """Find a quarter circle that leaves the surface tangentially, and a route from its end.

        Its radius, mm, is the given one, half or a quarter of it. None if no arc and route are clear, or the
        pass has no direction there.
        """
        centre, normal = end.pivot, end.normal
        if np.linalg.norm(np.cross(end.outward, normal), axis=-1) < SHORTEST:
            return None
        for share in LEADS:
            arc = quarter_arc(centre, normal, end.outward, share * radius)
            if self.space.clear(centre, *arc):
                route = self.escape(arc[-1], normal)
                if route is not None:
                    return Lead(arc, route)
        return None

    def shortcut(self, leaving: tuple[Array, Array], arriving: tuple[Array, Array]) -> Array | None:
        """Find a route close to the surface between two contacts (centre, normal).

        Its centres are (2, 3) mm, above the first and the second contact; None if too far apart or not clear.
        """
        (start, start_normal), (end, end_normal) = leaving, arriving
        if np.linalg.norm(end - start, axis=-1) > self.farthest:
            return None
        ends = start, start_normal, end, end_normal
        return self._once(ends, lambda: self._shortcut(*ends))

    def _once(self, ends: tuple[Array, ...], search: Callable[[], Array | None]) -> Array | None:
        """Look up the route for these ends, or search for it."""
        key = b"".join(end.tobytes() for end in ends)
        if key not in self.found:
            self.found[key] = search()
        return self.found[key]

    def _escape(self, centre: Array, normal: Array) -> Array | None:
        away = next(self._lifted(centre, normal), None)
        route = None if away is None else self._up(away) or self._out_and_up(away, normal)
        return None if route is None else np.array([away, *route])

    def _lifted(self, centre: Array, normal: Array) -> Iterator[Array]:
        """Yield points off a contact, (3,) mm, where the ball has room, best first."""
        start = centre + self.step * normal
        for lift in self.lifts:
            away = start + lift * normal
            if self.space.clear(start, away):
                yield away
        if self.step:
            # Beside an inner corner the linked ball has room only farther from both of its faces.
            slanted = normal + np.array([0.0, 0.0, 1.0])
            for lift in self.lifts:
                away = centre + (self.space.radius + lift) * slanted
                if self.space.fits(away[None])[0]:
                    yield away

    def _shortcut(self, start: Array, start_normal: Array, end: Array, end_normal: Array) -> Array | None:
        start, end = start + self.step * start_normal, end + self.step * end_normal
        for lift in self.lifts:
            away = start + lift * start_normal
            before = end + lift * end_normal
            if self.space.clear(start, away, before, end):
                return np.array([away, before])
        return None

    def _up(self, centre: Array) -> list[Array] | None:
        top = np.array([centre[0], centre[1], self.plane])
        return [top] if self.space.clear(centre, top) else None

    def _out_and_up(self, centre: Array, normal: Array) -> list[Array] | None:
        for direction in _compass(normal):
            free = self.space.reach(centre, centre + self.exit_length * direction)
            # Points closer together than the ball's radius would hardly differ.
            trials = min(TRIALS, int(np.ceil(free / self.space.radius)))
            for length in np.linspace(0.0, free, trials + 1)[1:]:
                out = centre + length * direction
                up = self._up(out)
                if up is not None:
                    return [out, *up]
        return None


def quarter_arc(centre: Array, normal: Array, outward: Array, radius: float) -> Array:
    """Sample a quarter circle that is tangential to the surface at its start, (3,) mm, and goes outward.

    Returns
    -------
    (k, 3), mm, without the start; ``centre + r sin φ · t + r (1 − cos φ) · n`` up to φ = 90 degrees
    """
    tangent = outward - product(outward, normal) * normal
    tangent = tangent / np.linalg.norm(tangent, axis=-1)
    largest = 2.0 * math.acos(max(0.0, 1.0 - ARC_DEPTH / radius))
    parts = max(3, int(np.ceil(np.pi / 2.0 / largest)))
    angle = np.linspace(0.0, np.pi / 2.0, parts + 1)[1:, None]
    return centre + radius * (np.sin(angle) * tangent + (1.0 - np.cos(angle)) * normal)


def _compass(normal: Array) -> Array:
    """Return horizontal unit vectors all around, (k, 3), those nearest to the normal first."""
    heading = math.atan2(normal[1], normal[0])
    offsets = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    nearest_first = np.argsort(np.abs((offsets + np.pi) % (2.0 * np.pi) - np.pi), kind="stable")
    angles = heading + offsets[nearest_first]
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)], axis=1)
