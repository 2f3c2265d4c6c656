"""Ways through the air for the ball's centre: out to the clearance plane, and from contact to contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.geometry import Array

# Shares of the largest lift by which the ball may leave the surface along its normal, best first.
LIFTS = (1.0, 0.5, 0.2, 0.05, 0.01)
# Horizontal directions in which a way out from under an overhang is looked for, and the most places
# along each.
DIRECTIONS, PLACES = 16, 24
# Shares of the wanted radius of a lead's arc, best first.
LEADS = (1.0, 0.5, 0.25)
# mm, a pass's last step along the surface that has a direction.
SHORTEST = 1e-6
# mm, how far the straight moves along such an arc cut its corners, at most.
ARC_DEPTH = 0.01


@dataclass(frozen=True, eq=False)
class Lead:
    """How the ball leaves a contact, or, backwards, how it comes to one.

    Parameters
    ----------
    arc : (k, 3), mm, centres on the lead's arc from the contact outward; empty where there is none
    way : (m, 3), mm, centres from there on, the last one on the clearance plane
    """

    arc: Array
    way: Array


@dataclass(frozen=True, eq=False)
class Linker:
    """Finds ways for the ball's centre that keep it out of the part.

    Parameters
    ----------
    space : where the ball can be
    bounds : (2, 3), mm, the part's lowest and highest coordinates
    clearance : mm, between the ball and the part's top on the clearance plane
    found : (kept by itself) ways that were asked for before: orders are tried with the same ends again
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
        """Lifts off the surface, mm, best first: the clearance, but no more than the ball's diameter."""
        return [share * min(self.clearance, 2.0 * self.space.radius) for share in LIFTS]

    @property
    def farthest(self) -> float:
        """Places no farther apart than this, mm, may be joined close to the surface."""
        return 2.0 * (2.0 * self.space.radius + self.clearance)

    @property
    def span(self) -> float:
        """A horizontal way of this length, mm, leads from anywhere over the part to beside it."""
        across = np.linalg.norm(self.bounds[1, :2] - self.bounds[0, :2])
        return float(across + 2.0 * self.space.radius + self.clearance)

    def escape(self, centre: Array, normal: Array) -> Array | None:
        """Find a way from a contact to the clearance plane.

        Along the normal, then straight up; where something overhangs, first horizontally until the way up
        is free, at the latest beside the part. Directions near the normal's own are tried first.

        Parameters
        ----------
        centre : (3,), mm, the ball's centre at the contact
        normal : (3,), unit vector

        Returns
        -------
        (2 or 3, 3), mm, centres after the contact, the last one on the clearance plane; None if no way that
        was tried is clear
        """
        return self._once((centre, normal), lambda: self._escape(centre, normal))

    def lead(self, contact: tuple[Array, Array], outward: Array, radius: float) -> Lead | None:
        """Find a quarter of an arc that leaves the surface tangentially, with a way on from its end.

        Parameters
        ----------
        contact : centre, (3,) mm, and normal, (3,) unit vector
        outward : (3,), direction from the contact away from the pass, of any length
        radius : mm, of the largest arc; one of a half and of a quarter are tried too

        Returns
        -------
        None if no arc of these is clear, or none has a way to the clearance plane, or the pass has no
        direction there
        """
        centre, normal = contact
        if np.linalg.norm(np.cross(outward, normal)) < SHORTEST:
            return None
        for share in LEADS:
            arc = quarter_arc(centre, normal, outward, share * radius)
            if self.space.clear(centre, *arc):
                way = self.escape(arc[-1], normal)
                if way is not None:
                    return Lead(arc, way)
        return None

    def shortcut(self, leaving: tuple[Array, Array], arriving: tuple[Array, Array]) -> Array | None:
        """Find a way close to the surface between contacts (centre, normal) that are near each other.

        Returns
        -------
        (2, 3), mm, centres off the one contact and before the other; None if too far or not clear
        """
        (start, start_normal), (end, end_normal) = leaving, arriving
        if np.linalg.norm(end - start) > self.farthest:
            return None
        ends = start, start_normal, end, end_normal
        return self._once(ends, lambda: self._shortcut(*ends))

    def _once(self, ends: tuple[Array, ...], search: Callable[[], Array | None]) -> Array | None:
        """Search for a way between ends only if they are new."""
        key = b"".join(end.tobytes() for end in ends)
        if key not in self.found:
            self.found[key] = search()
        return self.found[key]

    def _escape(self, centre: Array, normal: Array) -> Array | None:
        for lift in self.lifts:
            away = centre + lift * normal
            if self.space.clear(centre, away):
                way = self._up(away) or self._out_and_up(away, normal)
                return None if way is None else np.array([away, *way])
        return None

    def _shortcut(self, start: Array, start_normal: Array, end: Array, end_normal: Array) -> Array | None:
        for lift in self.lifts:
            away = start + lift * start_normal
            before = end + lift * end_normal
            if self.space.clear(start, away, before, end):
                return np.array([away, before])
        return None

    def _up(self, place: Array) -> list[Array] | None:
        top = np.array([place[0], place[1], self.plane])
        return [top] if self.space.clear(place, top) else None

    def _out_and_up(self, place: Array, normal: Array) -> list[Array] | None:
        for direction in _compass(normal):
            free = self.space.reach(place, place + self.span * direction)
            # Nearer to each other than the ball is wide, one place is as good as the next.
            places = min(PLACES, int(np.ceil(free / self.space.radius)))
            for way in np.linspace(0.0, free, places + 1)[1:]:
                out = place + way * direction
                up = self._up(out)
                if up is not None:
                    return [out, *up]
        return None


def quarter_arc(centre: Array, normal: Array, outward: Array, radius: float) -> Array:
    """Sample a quarter of a circle that is tangential to the surface at its start.

    Parameters
    ----------
    centre : (3,), mm, where it starts
    normal, outward : (3,), unit normal of the surface there, and direction of the arc's start, any length
    radius : mm

    Returns
    -------
    (k, 3), mm, without the start; ``centre + r sin φ · t + r (1 − cos φ) · n`` up to φ = 90 degrees
    """
    tangent = outward - (outward @ normal) * normal
    tangent = tangent / np.linalg.norm(tangent)
    largest = 2.0 * np.arccos(max(0.0, 1.0 - ARC_DEPTH / radius))
    parts = max(3, int(np.ceil(np.pi / 2.0 / largest)))
    angle = np.linspace(0.0, np.pi / 2.0, parts + 1)[1:, None]
    return centre + radius * (np.sin(angle) * tangent + (1.0 - np.cos(angle)) * normal)


def _compass(normal: Array) -> Array:
    """Horizontal unit vectors all around, those nearest to a normal's first, (k, 3)."""
    heading = np.arctan2(normal[1], normal[0])
    offsets = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    nearest_first = np.argsort(np.abs((offsets + np.pi) % (2.0 * np.pi) - np.pi), kind="stable")
    angles = heading + offsets[nearest_first]
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)], axis=1)
