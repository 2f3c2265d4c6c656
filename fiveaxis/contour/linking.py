"""Links: ways through the air from pass to pass."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.contour.distance import BallSpace
from fiveaxis.contour.passes import FEWEST_CONTACTS, Pass
from fiveaxis.geometry import Array, IntArray

# Shares of the largest lift by which the ball may leave the surface along its normal, best first.
LIFTS = (1.0, 0.5, 0.2, 0.05, 0.01)
# Horizontal directions in which a way out from under an overhang is looked for, and the most places
# along each.
DIRECTIONS, PLACES = 16, 24
# So many contacts of a pass are tried as its start (or end), until one has a way to the clearance plane.
STARTS = 8


@dataclass(frozen=True, eq=False)
class Linker:
    """Finds ways for the ball's centre that keep it out of the part.

    Parameters
    ----------
    space : where the ball can be
    bounds : (2, 3), mm, the part's lowest and highest coordinates
    clearance : mm, between the ball and the part's top on the clearance plane
    """

    space: BallSpace
    bounds: Array
    clearance: float

    @property
    def plane(self) -> float:
        """Height of the ball's centre on the clearance plane, mm."""
        return float(self.bounds[1, 2] + self.space.radius + self.clearance)

    @property
    def lifts(self) -> list[float]:
        """Lifts off the surface, mm, best first: the clearance, but no more than the ball's diameter."""
        return [share * min(self.clearance, 2.0 * self.space.radius) for share in LIFTS]

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
        for lift in self.lifts:
            away = centre + lift * normal
            if self.space.clear(centre, away):
                way = self._up(away) or self._out_and_up(away, normal)
                return None if way is None else np.array([away, *way])
        return None

    def shortcut(self, leaving: tuple[Array, Array], arriving: tuple[Array, Array]) -> Array | None:
        """Find a way close to the surface between contacts (centre, normal) that are near each other.

        Returns
        -------
        (2, 3), mm, centres off the one contact and before the other; None if too far or not clear
        """
        (start, start_normal), (end, end_normal) = leaving, arriving
        if np.linalg.norm(end - start) > 2.0 * (2.0 * self.space.radius + self.clearance):
            return None
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


@dataclass(frozen=True, eq=False)
class LinkedPass:
    """A pass with the way that leads to it.

    Parameters
    ----------
    approach : (k, 3), mm, ball centres before the first contact
    cut : the pass, opened
    retreat : (m, 3), mm, ball centres after the last contact; empty unless it is the last pass
    """

    approach: Array
    cut: Pass
    retreat: Array


def link_passes(levels: Iterable[Sequence[Pass]], linker: Linker) -> tuple[list[LinkedPass], Counter[str]]:
    """Order the passes of each level and join them by links.

    Within a level the pass that starts nearest to where the last one ended comes next. A pass without a way
    from both of its ends to the clearance plane is shortened or left out, and counted.

    Parameters
    ----------
    levels : passes by level, in the order in which the levels are cut
    linker : finds the ways
    """
    linked: list[LinkedPass] = []
    left_out: Counter[str] = Counter()
    here = np.array([*linker.bounds.mean(axis=0)[:2], linker.plane])
    retreat = np.empty((0, 3))
    for level in levels:
        remaining = list(level)
        while remaining:
            chosen = min(range(len(remaining)), key=lambda k: _nearest_start(remaining[k], here)[1])
            candidate = remaining.pop(chosen)
            cut, ways = _open_with_ways(candidate, here, linker)
            if ways is None:
                left_out["passes without a clear link"] += 1
                continue
            left_out["contacts without a clear link"] += max(0, len(candidate) - len(cut))
            approach = _approach(linked, cut, retreat, ways[0], linker)
            linked.append(LinkedPass(approach, cut, np.empty((0, 3))))
            retreat, here = ways[1], cut.centres[-1]
    if linked:
        linked[-1] = LinkedPass(linked[-1].approach, linked[-1].cut, retreat)
    return linked, +left_out


def _approach(linked: list[LinkedPass], cut: Pass, retreat: Array, arrival: Array, linker: Linker) -> Array:
    if linked:
        before = linked[-1].cut
        short = linker.shortcut(
            (before.centres[-1], before.contacts.normals[-1]), (cut.centres[0], cut.contacts.normals[0])
        )
        if short is not None:
            return short
    return np.vstack([retreat, arrival[::-1]])


def _nearest_start(candidate: Pass, here: Array) -> tuple[int, float]:
    starts = candidate.starts()
    away = np.linalg.norm(candidate.centres[starts] - here, axis=1)
    k = int(np.argmin(away))
    return int(starts[k]), float(away[k])


def _open_with_ways(candidate: Pass, here: Array, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Open a pass where its ends have ways to the clearance plane, near `here` if possible."""
    return _open_closed(candidate, here, linker) if candidate.contacts.closed else _shorten(candidate, linker)


def _open_closed(candidate: Pass, here: Array, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Choose the contact at which a closed pass starts and ends; one way serves both."""
    starts = candidate.starts()
    first = int(np.searchsorted(starts, _nearest_start(candidate, here)[0]))
    found = _first_escape(candidate, np.roll(starts, -first), linker)
    if found is None:
        return candidate, None
    return candidate.started_at(found[0]), (found[1], found[1])


def _shorten(candidate: Pass, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Cut the ends off an open pass as far as the ball, wedged between walls there, has no way out."""
    rows = candidate.touching()
    arrival, departure = (_first_escape(candidate, order, linker) for order in (rows, rows[::-1]))
    if arrival is None or departure is None:
        return candidate, None
    cut = candidate.between(arrival[0], departure[0])
    return cut, None if len(cut.touching()) < FEWEST_CONTACTS else (arrival[1], departure[1])


def _first_escape(candidate: Pass, rows: IntArray, linker: Linker) -> tuple[int, Array] | None:
    """Find a row with a way to the clearance plane among a few of some rows, the first ones preferred."""
    for k in np.unique(np.linspace(0, len(rows), STARTS, endpoint=False).astype(int)):
        row = int(rows[k])
        way = linker.escape(candidate.centres[row], candidate.contacts.normals[row])
        if way is not None:
            return row, way
    return None


def _compass(normal: Array) -> Array:
    """Horizontal unit vectors all around, those nearest to a normal's first, (k, 3)."""
    heading = np.arctan2(normal[1], normal[0])
    offsets = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    nearest_first = np.argsort(np.abs((offsets + np.pi) % (2.0 * np.pi) - np.pi), kind="stable")
    angles = heading + offsets[nearest_first]
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)], axis=1)
