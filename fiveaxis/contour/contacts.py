"""Contact points along a section: places on the wall with the normal that the ball touches with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import Array, angle_between
from fiveaxis.mesh.sections import Loop
from fiveaxis.mesh.surface import SHARP_EDGE, Surface

# How deep, in mm, a ball set on a flat facet with the neighbourhood's smoothed normal may sink into it.
LEAN_DEPTH = 0.005
# How far, in mm, the straight move of the ball's centre between two rows may cut off a convex arc.
CHORD_DEPTH = 0.01
# Steps are halved at most so often.
REFINEMENTS = 8


@dataclass(frozen=True, eq=False)
class Contacts:
    """Rows along one section curve.

    Parameters
    ----------
    points : (n, 3), mm
    normals : (n, 3), unit vectors out of the material
    rolling : (n,), rows on which the ball only rolls about a sharp convex edge, between the walls that
        meet there; their normal is the direction from the edge to the ball's centre
    closed : whether the last row is followed by the first
    """

    points: Array
    normals: Array
    rolling: NDArray[np.bool_]
    closed: bool

    def __len__(self) -> int:
        return len(self.points)

    def take(self, rows: NDArray[np.int64], *, closed: bool) -> Contacts:
        """Pick rows in a given order."""
        return Contacts(self.points[rows], self.normals[rows], self.rolling[rows], closed)


def sample_loop(loop: Loop, surface: Surface, *, radius: float, spacing: float) -> Contacts | None:
    """Place contacts along a section curve.

    Neighbouring contacts are at most `spacing` apart, and nearer where the curve is convex and the straight
    move of the ball's centre would cut off more than `CHORD_DEPTH` of its arc. About an edge, with the
    ball's radius R, a step may turn by ``2 acos(1 − depth / R)``.

    Parameters
    ----------
    loop : section curve, material to its right
    radius, spacing : mm

    Returns
    -------
    Contacts, or None where the curve has no triangle with an area
    """
    facets = surface.facet_normals[loop.faces]
    solid = np.linalg.norm(facets, axis=1) > 0.5
    if not solid.any():
        return None
    facets = facets[solid]
    lean = np.arccos(max(0.0, 1.0 - LEAN_DEPTH / radius))
    normals = lean_normals(np.repeat(facets, 2, axis=0), loop.normals[solid].reshape(-1, 3), lean)
    points = loop.points[solid].reshape(-1, 3)
    sharp = angle_between(facets, np.roll(facets, -1, axis=0)) > SHARP_EDGE
    if loop.closed:
        points, normals = np.vstack([points, points[:1]]), np.vstack([normals, normals[:1]])
    return _resample(points, normals, sharp, closed=loop.closed, radius=radius, spacing=spacing)


def lean_normals(facets: Array, smooth: Array, limit: float) -> Array:
    """Turn facet normals towards the smoothed ones, by no more than a limit.

    A ball of radius R set on a facet with a normal that leans by θ sinks ``R (1 − cos θ)`` into it.

    Parameters
    ----------
    facets : (n, 3), unit vectors
    smooth : (n, 3), any length
    limit : rad

    Returns
    -------
    (n, 3), unit vectors
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
    # Nearly equal or opposite: the sine rule breaks down, and a straight blend is as good as any.
    blend = sine < 1e-6
    safe = np.where(blend, 1.0, sine)
    from_a = np.where(blend, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    to_b = np.where(blend, share, np.sin(share * angle) / safe)
    mixed = from_a[:, None] * a + to_b[:, None] * b
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where(length > 1e-6, mixed / np.maximum(length, 1e-12), a)


@dataclass(frozen=True, eq=False)
class _Curve:
    """A section curve with its normals, to be asked for any place between its nodes.

    Nodes are the start and end of each segment, stations count steps from the curve's start, jump marks the
    stretches between nodes in which the normal turns about a sharp edge.
    """

    points: Array
    normals: Array
    stations: Array
    jump: NDArray[np.bool_]

    def at(self, wanted: Array, *, closed: bool) -> Contacts:
        """Give the contacts at stations, (n,) ascending."""
        stretch = np.searchsorted(self.stations, wanted, side="right") - 1
        stretch = np.clip(stretch, 0, len(self.jump) - 1)
        length = np.maximum(self.stations[stretch + 1] - self.stations[stretch], 1e-12)
        share = np.clip((wanted - self.stations[stretch]) / length, 0.0, 1.0)
        start, end = self.points[stretch], self.points[stretch + 1]
        return Contacts(
            points=start + share[:, None] * (end - start),
            normals=turn_between(self.normals[stretch], self.normals[stretch + 1], share),
            rolling=self.jump[stretch] & (share > 0.0) & (share < 1.0),
            closed=closed,
        )


def _resample(
    points: Array, normals: Array, sharp: NDArray[np.bool_], *, closed: bool, radius: float, spacing: float
) -> Contacts:
    """Walk along nodes (start and end of each segment) in equal steps of way and turning, then refine."""
    way = np.linalg.norm(np.diff(points, axis=0), axis=1)
    stretch = np.arange(len(way))
    # Odd stretches join the end of a segment to the start of the next: the place stays, the normal jumps.
    jump = (stretch % 2 == 1) & sharp[stretch // 2]
    largest_turn = 2.0 * np.arccos(max(0.0, 1.0 - CHORD_DEPTH / radius))
    # Steps in each stretch: with the larger of both needs, neither way nor turn exceeds its limit.
    needs = np.maximum(way / spacing, _convex_turn(points, normals) / largest_turn)
    curve = _Curve(points, normals, np.concatenate([[0.0], np.cumsum(needs)]), jump)
    total = curve.stations[-1]
    count = max(3, int(np.ceil(total - 1e-9)))
    stations = _refine(curve, np.linspace(0.0, total, count + 1), radius)
    return curve.at(stations[:-1] if closed else stations, closed=closed)


def _refine(curve: _Curve, stations: Array, radius: float) -> Array:
    """Halve the steps on which the straight move of the ball's centre cuts too deep about a convex curve."""
    for _ in range(REFINEMENTS):
        middles = (stations[:-1] + stations[1:]) / 2.0
        rows, between = curve.at(stations, closed=False), curve.at(middles, closed=False)
        centres = rows.points + radius * rows.normals
        sag = between.points + radius * between.normals - (centres[:-1] + centres[1:]) / 2.0
        # Rounding: a step that was chosen to be just right is right.
        deep = np.einsum("ij,ij->i", sag, between.normals) > 1.01 * CHORD_DEPTH
        if not deep.any():
            break
        stations = np.sort(np.concatenate([stations, middles[deep]]))
    return stations


def _convex_turn(points: Array, normals: Array) -> Array:
    """Angle by which the normal turns in each stretch where the curve is convex, 0 where it is concave."""
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1, keepdims=True)
    heading = np.divide(steps, length, out=np.zeros_like(steps), where=length > 0.0)
    # Between segments there is no way; the headings before and after say how the curve runs.
    along = heading + np.roll(heading, 1, axis=0) + np.roll(heading, -1, axis=0)
    along[0::2] = heading[0::2]
    opening = np.einsum("ij,ij->i", np.diff(normals, axis=0), along)
    return np.where(opening > 0.0, angle_between(normals[:-1], normals[1:]), 0.0)
