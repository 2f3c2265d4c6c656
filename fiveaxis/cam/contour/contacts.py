"""Contacts along a section: points of the wall with the normals at which the ball touches them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between
from fiveaxis.cam.contour.sections import Loop
from fiveaxis.cam.mesh.surface import Surface, units

# mm: how deep a ball may sink into a flat facet on which it is placed along the smoothed normal.
LEAN_DEPTH = 0.005
# mm: how far a straight move of the ball's centre may cut off a convex arc.
CHORD_DEPTH = 0.01
# Most halvings of a step.
REFINEMENTS = 8
COLUMNS = ("points", "normals", "smooth", "rolling")


@dataclass(frozen=True, eq=False)
class Contacts:
    """Rows along one section curve.

    Parameters
    ----------
    points : (n, 3), mm
    normals : (n, 3), unit vectors from the point to the ball's centre: those of the facets, turned towards
        `smooth` as far as the ball then sinks by at most `LEAN_DEPTH`
    smooth : (n, 3), unit vectors, normals of the surface, smoothed across facets: tilt refers to them; of
        cutters that aren't balls the same as `normals`
    rolling : (n,), rows at which the ball rolls about a sharp convex edge, between the walls that meet there;
        the normal points from the edge to the ball's centre
    closed : whether the first row follows the last
    """

    points: Array
    normals: Array
    smooth: Array
    rolling: BoolArray
    closed: bool

    def __len__(self) -> int:
        return len(self.points)

    def take(self, rows: IntArray, *, closed: bool) -> Self:
        """Pick rows in a given order."""
        columns = {name: getattr(self, name)[rows] for name in COLUMNS}
        return replace(self, **columns, closed=closed)

    def reversed(self) -> Self:
        """Return the rows in the other order."""
        return self.take(np.arange(len(self))[::-1], closed=self.closed)

    def joined(self, *others: Contacts) -> Self:
        """Return the rows of several curves, one after the other."""
        columns = {name: np.concatenate([getattr(c, name) for c in (self, *others)]) for name in COLUMNS}
        return replace(self, **columns, closed=False)

    def blended(self, other: Contacts, share: Array, rolling: BoolArray) -> Self:
        """Blend with other contacts row by row; `share`, (n,), is that of the other ones."""
        return replace(
            self,
            points=self.points + share[:, None] * (other.points - self.points),
            normals=turn_between(self.normals, other.normals, share),
            smooth=turn_between(self.smooth, other.smooth, share),
            rolling=rolling,
        )


@dataclass(frozen=True)
class Sampling:
    """How contacts are placed along curves.

    Parameters
    ----------
    radius : mm, of the ball
    spacing : mm, most between neighbours
    roundest : mm, largest radius of curvature of the cutter where it touches; None for a ball
    hollow, sideways : mm, how far straight moves of the ball's centre may be off a concave curve, and off the
        curve to its sides
    """

    radius: float
    spacing: float
    roundest: float | None = None
    hollow: float = np.inf
    sideways: float = np.inf

    def placed(self, facets: Array, smooth: Array) -> tuple[Array, Array]:
        """Return the normals along which a cutter is placed on facets, and those that its lean refers to.

        A ball turns about its centre, so its lean may refer to the smoothed surface. Another cutter, turned
        about its contact, would sink into the facet. Facets are (n, 3) unit vectors, smoothed normals have
        any length.
        """
        normals = lean_normals(facets, smooth, lean_limit(self.roundest or self.radius))
        return normals, lean_normals(facets, smooth, np.pi) if self.roundest is None else normals


def sample_loop(loop: Loop, surface: Surface, sampling: Sampling) -> Contacts | None:
    """Place contacts along a section curve, material to its right; None if no triangle of it has an area.

    Neighbours are closer together on convex curves, where the straight move of the ball's centre would cut
    off more than `CHORD_DEPTH` of its arc. About an edge, a step of a ball of radius R may turn by
    ``2 acos(1 − depth / R)``. Contacts lie on the surface's exact faces where it has a model.
    """
    facets = surface.facet_normals[loop.faces]
    solid = np.linalg.norm(facets, axis=1) > 0.5
    if not solid.any():
        return None
    facets, faces, points = facets[solid], loop.faces[solid], loop.points[solid].reshape(-1, 3)
    if surface.model is not None:
        points, normals = surface.onto(points, np.repeat(faces, 2))

        def onto(segment: IntArray, share: Array) -> tuple[Array, Array]:
            start, end = points[2 * segment], points[2 * segment + 1]
            return surface.onto(start + share[:, None] * (end - start), faces[segment])

        return follow(points, normals, onto, sampling, closed=loop.closed, crease=surface.crease)
    normals, smooth = sampling.placed(np.repeat(facets, 2, axis=0), loop.normals[solid].reshape(-1, 3))
    sharp = angle_between(facets, np.roll(facets, -1, axis=0)) > surface.crease
    curve = _Curve.through(points, normals, smooth, sharp, sampling, closed=loop.closed)
    return curve.at(_stations(curve, sampling, closed=loop.closed), closed=loop.closed)


def follow(
    points: Array,
    normals: Array,
    onto: Callable[[IntArray, Array], tuple[Array, Array]],
    sampling: Sampling,
    *,
    closed: bool,
    crease: float,
) -> Contacts:
    """Place contacts along a curve on exact surfaces, as `sample_loop` does.

    Parameters
    ----------
    points, normals : (2m, 3), mm and unit vectors: start and end of each segment
    onto : finds exact points and normals of segments, (n,), at shares of their length, (n,)
    closed : whether the last segment's end is the first one's start
    crease : rad; about sharper edges between segments the ball rolls
    """
    sharp = angle_between(normals[1::2], np.roll(normals[::2], -1, axis=0)) > crease
    curve = _Curve.through(points, normals, normals, sharp, sampling, closed=closed)
    stations = _stations(curve, sampling, closed=closed)
    contacts, (interval, share) = curve.at(stations, closed=closed), curve.place(stations)
    points, normals = contacts.points.copy(), contacts.normals.copy()
    # Those at an edge, between the normals of two segments, stay.
    rows = np.flatnonzero(interval % 2 == 0)
    points[rows], normals[rows] = onto(interval[rows] // 2, share[rows])
    return replace(contacts, points=points, normals=normals, smooth=normals)


def lean_limit(radius: float) -> float:
    """Return by what angle, rad, a ball's normal may be off a facet's: it then sinks by `LEAN_DEPTH`."""
    return math.acos(max(0.0, 1.0 - LEAN_DEPTH / radius))


def lean_normals(facets: Array, smooth: Array, limit: float | Array) -> Array:
    """Turn facet normals, (n, 3), towards the smoothed ones, of any length, by at most a limit, rad or (n,).

    A ball of radius R placed along a normal that is off the facet's by θ sinks ``R (1 − cos θ)`` into it.
    """
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    towards = np.where(length > 0.0, smooth / np.where(length > 0.0, length, 1.0), facets)
    angle = angle_between(facets, towards)
    share = np.minimum(1.0, limit / np.maximum(angle, 1e-12))
    return turn_between(facets, towards, share)


def turn_between(a: Array, b: Array, share: Array) -> Array:
    """Turn unit vectors a towards b by a share of the angle between them, (n, 3), (n, 3), (n,) → (n, 3)."""
    angle = angle_between(a, b)
    sine = np.sin(angle)
    # The sine rule breaks down for nearly equal or opposite vectors; a linear blend is as good.
    blend = sine < 1e-6
    safe = np.where(blend, 1.0, sine)
    from_a = np.where(blend, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    to_b = np.where(blend, share, np.sin(share * angle) / safe)
    mixed = from_a[:, None] * a + to_b[:, None] * b
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where(length > 1e-6, mixed / np.maximum(length, 1e-12), a)


@dataclass(frozen=True, eq=False)
class _Curve:
    """A section curve with its normals, interpolated between its nodes.

    Nodes are the start and end of each segment. Stations count steps from the curve's start. `jump` marks the
    intervals between nodes in which the normal turns about a sharp edge.
    """

    nodes: Contacts
    stations: Array
    jump: BoolArray

    @classmethod
    def through(
        cls,
        points: Array,
        normals: Array,
        smooth: Array,
        sharp: BoolArray,
        sampling: Sampling,
        *,
        closed: bool,
    ) -> _Curve:
        """Make the curve of nodes; `sharp`, (m,), marks segments that meet the next one at a sharp edge."""
        if closed:
            points, normals, smooth = (np.vstack([nodes, nodes[:1]]) for nodes in (points, normals, smooth))
        nodes = Contacts(points, normals, smooth, np.zeros(len(points), dtype=bool), closed=False)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        k = np.arange(len(lengths))
        # Odd intervals join the end of a segment to the start of the next: same point, another normal.
        jump = (k % 2 == 1) & sharp[k // 2]
        largest_turn = 2.0 * math.acos(max(0.0, 1.0 - CHORD_DEPTH / (sampling.roundest or sampling.radius)))
        # Steps in each interval, so that neither length nor turn exceeds its limit.
        needs = np.maximum(lengths / sampling.spacing, _convex_turn(points, normals) / largest_turn)
        return cls(nodes, np.concatenate([[0.0], np.cumsum(needs)]), jump)

    def place(self, wanted: Array) -> tuple[IntArray, Array]:
        """Find the intervals between nodes, (n,), and the shares of them, (n,), at stations.

        Even intervals are segments.
        """
        k = np.searchsorted(self.stations, wanted, side="right") - 1
        k = np.clip(k, 0, len(self.jump) - 1)
        length = np.maximum(self.stations[k + 1] - self.stations[k], 1e-12)
        return k, np.clip((wanted - self.stations[k]) / length, 0.0, 1.0)

    def at(self, wanted: Array, *, closed: bool) -> Contacts:
        """Return the contacts at stations, (n,) ascending."""
        k, share = self.place(wanted)
        rolling = self.jump[k] & (share > 0.0) & (share < 1.0)
        before, after = (self.nodes.take(rows, closed=closed) for rows in (k, k + 1))
        return before.blended(after, share, rolling)


def _stations(curve: _Curve, sampling: Sampling, *, closed: bool) -> Array:
    """Return stations along a curve in equal steps of length and turning, refined.

    Steps are halved in which the straight move of the ball's centre cuts off too much of a convex arc, or is
    too far off the curve otherwise.
    """
    total = curve.stations[-1]
    stations = np.linspace(0.0, total, max(3, int(np.ceil(total - 1e-9))) + 1)
    for _ in range(REFINEMENTS):
        middles = (stations[:-1] + stations[1:]) / 2.0
        rows, between = curve.at(stations, closed=False), curve.at(middles, closed=False)
        centres = rows.points + sampling.radius * rows.normals
        sag = between.points + sampling.radius * between.normals - (centres[:-1] + centres[1:]) / 2.0
        depth = np.einsum("ij,ij->i", sag, between.normals)
        aside = np.linalg.norm(sag - depth[:, None] * between.normals, axis=1)
        # 1 % for rounding, as steps are chosen to just meet the limit.
        deep = (depth > 1.01 * CHORD_DEPTH) | (-depth > sampling.hollow) | (aside > sampling.sideways)
        if not deep.any():
            break
        stations = np.sort(np.concatenate([stations, middles[deep]]))
    return stations[:-1] if closed else stations


def _convex_turn(points: Array, normals: Array) -> Array:
    """Compute by what angle the normal turns in each interval where the curve is convex; else 0."""
    heading = units(np.diff(points, axis=0))
    # Intervals between segments have no length; the headings before and after replace theirs.
    along = heading + np.roll(heading, 1, axis=0) + np.roll(heading, -1, axis=0)
    along[0::2] = heading[0::2]
    opening = np.einsum("ij,ij->i", np.diff(normals, axis=0), along)
    return np.where(opening > 0.0, angle_between(normals[:-1], normals[1:]), 0.0)
