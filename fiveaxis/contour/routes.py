"""Clear routes of the ball's centre through the air: to the clearance plane, and between contacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.geometry import Array, product

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

    Parameters
    ----------
    space : where the ball fits
    bounds : (2, 3), mm, the part's lowest and highest coordinates
    clearance : mm, between the part's top and the ball on the clearance plane
    found : cache of routes: different orders of the passes need the same ones
    """

    space: BallSpace
    bounds: Array
    clearance: float
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
        """Find a route from a contact to the clearance plane.

        It follows the normal, then goes straight up. Under an overhang it first goes horizontally until the
        move up is clear, at the latest beside the part. Directions near the normal's are tried first.

        Parameters
        ----------
        centre : (3,), mm, the ball's centre at the contact
        normal : (3,), unit vector

        Returns
        -------
        (2 or 3, 3), mm, centres after the contact, the last one on the clearance plane; None if no route is
        clear
        """
        return self._once((centre, normal), lambda: self._escape(centre, normal))

    def lead(self, contact: tuple[Array, Array], outward: Array, radius: float) -> Lead | None:
        """Find a quarter circle that leaves the surface tangentially, and a route from its end.

        Parameters
        ----------
        contact : centre, (3,) mm, and normal, (3,) unit vector
        outward : (3,), direction away from the pass, any length
        radius : mm, of the largest arc; half and a quarter of it are tried too

        Returns
        -------
        None if no arc and route are clear, or the pass has no direction there
        """
        centre, normal = contact
        if np.linalg.norm(np.cross(outward, normal), axis=-1) < SHORTEST:
            return None
        for share in LEADS:
            arc = quarter_arc(centre, normal, outward, share * radius)
            if self.space.clear(centre, *arc):
                route = self.escape(arc[-1], normal)
                if route is not None:
                    return Lead(arc, route)
        return None

    def shortcut(self, leaving: tuple[Array, Array], arriving: tuple[Array, Array]) -> Array | None:
        """Find a route close to the surface between two contacts (centre, normal).

        Returns
        -------
        (2, 3), mm, centres above the first and the second contact; None if too far apart or not clear
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
        for lift in self.lifts:
            away = centre + lift * normal
            if self.space.clear(centre, away):
                route = self._up(away) or self._out_and_up(away, normal)
                return None if route is None else np.array([away, *route])
        return None

    def _shortcut(self, start: Array, start_normal: Array, end: Array, end_normal: Array) -> Array | None:
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
    """Sample a quarter circle that is tangential to the surface at its start.

    Parameters
    ----------
    centre : (3,), mm, its start
    normal : (3,), unit normal of the surface there
    outward : (3,), direction of the arc at its start, any length
    radius : mm

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
