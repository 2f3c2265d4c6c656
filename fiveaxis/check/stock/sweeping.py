"""What a cutter sweeps in the moves of a program: segments of its convex bodies.

A move is divided into segments whose figures in `ball_sweep` and `body_sweep` leave the true sweep by no
more than a tolerance. Ends of the axis move on curves, and a segment's are their chords. The axis itself
describes a saddle: four triangles about its middle leave it by a sixteenth of its twist. Other bodies keep to
their poses exactly, but where they turn, rays that they graze may be missed by little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model import Tool, cutter_height, cutter_pieces, revolved_pieces

# Fractional rows, (m,): 3.25 is after a quarter of the move from row 3 to row 4 → tips, (m, 3) mm, and axes,
# (m, 3) unit vectors, in the workpiece frame.
Poses: TypeAlias = Callable[[Array], tuple[Array, Array]]
# Shares of the twist by which triangles and a fan leave a saddle.
TRIANGLES, SADDLE = 1.0 / 4.0, 1.0 / 16.0
# Share of a turning body's sideways movement by which rays that graze it may miss it, measured against fine
# divisions; its depth isn't concave in time by at most turn times travel.
GRAZING = 1.0 / 64.0
# Share of the resolution within which the figures keep to the true sweep, and mm at most.
SHARE, LARGEST = 0.1, 0.01
# Rounds of measuring and dividing.
MOST_ROUNDS = 12


class BallSweep(NamedTuple):
    """Segments of a ball, and of the cylinder above it that is as wide.

    Parameters
    ----------
    kinds, nodes : (m,), (m, 5, 3) mm, see `fiveaxis.check.stock.ball_sweep`
    radius : mm
    block : (m,), ascending
    """

    kinds: IntArray
    nodes: Array
    radius: float
    block: IntArray

    def moved(self, by: Array) -> BallSweep:
        """Move it by a vector, (3,) mm."""
        return self._replace(nodes=np.ascontiguousarray(self.nodes + by))

    def at(self, rows: slice | BoolArray) -> BallSweep:
        """Select segments."""
        return self._replace(kinds=self.kinds[rows], nodes=self.nodes[rows], block=self.block[rows])

    def inflated(self, by: float) -> BallSweep:
        """Inflate the ball by so much, mm; below 0 it shrinks."""
        return self._replace(radius=self.radius + by)


class BodySweep(NamedTuple):
    """Segments of any convex body of revolution.

    Parameters
    ----------
    poses : (m, 4, 3), tip and axis at the start and at the end, mm
    zones : (z, 7), see `fiveaxis.model.toolpath.profile.inside`
    body : (5,), mm, see `fiveaxis.check.stock.body_sweep`
    block : (m,), ascending
    """

    poses: Array
    zones: Array
    body: Array
    block: IntArray

    def moved(self, by: Array) -> BodySweep:
        """Move it by a vector, (3,) mm."""
        poses = self.poses.copy()
        poses[:, ::2] += by
        return self._replace(poses=poses)

    def at(self, rows: slice | BoolArray) -> BodySweep:
        """Select segments."""
        return self._replace(poses=self.poses[rows], block=self.block[rows])

    def inflated(self, by: float) -> BodySweep:
        """Inflate the body by so much, mm; below 0 it shrinks."""
        return self._replace(body=np.append(self.body[:-1], by))


Sweep: TypeAlias = BallSweep | BodySweep


@dataclass(frozen=True, eq=False)
class SweptBody:
    """A convex body about a part of the tool axis.

    Parameters
    ----------
    low, high : mm above the tip, ends of that part
    radius : mm, of the body about it
    zones : (z, 7), see `fiveaxis.model.toolpath.profile.inside`; None if it is all points within the radius
    """

    low: float
    high: float
    radius: float
    zones: Array | None

    def ends(self, pose: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the ends of the part of the axis at tips and axes, (m, 3) mm each."""
        tip, along = pose
        return tip + self.low * along, tip + self.high * along


def cutter_bodies(tool: Tool) -> list[SweptBody]:
    """Return a cutter's convex bodies up to its cutting length; a ball and the cylinder as wide are one."""
    height, found = cutter_height(tool), []
    for piece in cutter_pieces(tool):
        if not piece.is_ball:
            ends = max(piece.low, 0.0), min(piece.high, height)
            found.append(SweptBody(*ends, tool.radius, piece.zones))
            continue
        radius = float((piece.zones[:, 0] + piece.zones[:, 1]).max())
        if tool.cutter.zones[0].outline()[-1, 0] < radius - 1e-9:
            found.append(SweptBody(radius, radius, radius, None))
        else:
            return [SweptBody(radius, max(height - radius, radius), radius, None)]
    return found


def outline_bodies(outline: Array) -> list[SweptBody]:
    """Return the convex bodies of a shank or holder, (2m, 2) mm."""
    pieces = revolved_pieces(outline)
    return [SweptBody(p.low, p.high, float(p.zones[:, 1].max()), p.zones) for p in pieces]


def swept(
    bodies: Iterable[SweptBody], poses: Poses, rows: IntArray, tolerance: float, bounds: Array
) -> tuple[Sweep, ...]:
    """Divide moves into segments of convex bodies, whose blocks are the rows, (m,), at which the moves end.

    Poses are those of the tool at fractional rows; a cylinder as wide as its ball ends in a hemisphere.
    Segments may leave the true sweep by the tolerance, mm; what is beyond the bounds, (2, 3) mm, isn't swept.
    """
    return tuple(_swept_body(body, poses, rows, tolerance, bounds) for body in bodies)


def _swept_body(body: SweptBody, poses: Poses, rows: IntArray, tolerance: float, bounds: Array) -> Sweep:
    block, start, end = _divided(body, poses, rows, tolerance, bounds)
    ends = body.ends(start), body.ends(end)
    near = _touches(ends, body.radius + tolerance, bounds)
    block = block[near]
    if body.zones is not None:
        placed = np.stack([*start, *end], axis=1)[near]
        figures = np.array([body.radius, body.low, body.high, 0.0, 0.0])
        return BodySweep(np.ascontiguousarray(placed), body.zones, figures, block)
    from fiveaxis.check.stock.ball_sweep import FAN, LINE, QUAD

    (low, high), (low_end, high_end) = ends
    middle = (low + high + low_end + high_end) / 4.0
    nodes = np.stack([low, low_end, high_end, high, middle], axis=1)[near]
    if body.high - body.low <= tolerance:
        kinds = np.full(len(nodes), LINE)
    else:
        kinds = np.where(_twist(ends)[near] * TRIANGLES <= tolerance, QUAD, FAN)
    return BallSweep(kinds, np.ascontiguousarray(nodes), body.radius, block)


def _touches(
    ends: tuple[tuple[Array, Array], tuple[Array, Array]], reach: Array | float, bounds: Array
) -> BoolArray:
    """Check which segments come within a reach, mm, of bounds; NaN is none."""
    corners = np.stack([*ends[0], *ends[1]])
    margin = np.reshape(reach, (-1, 1))
    return np.asarray(
        ((corners.min(axis=0) - margin < bounds[1]) & (corners.max(axis=0) + margin > bounds[0])).all(axis=1)
    )


def _twist(ends: tuple[tuple[Array, Array], tuple[Array, Array]]) -> Array:
    """Compute by how much the axis's end leaves the plane of its travel, (m,) mm.

    Where both ends move to opposite sides the axis turns about a point between them, and all of the turn
    counts.
    """
    (low, high), (low_end, high_end) = ends
    below, above = low_end - low, high_end - high
    turn = above - below
    across = np.cross(high + high_end - low - low_end, below + above)
    size = np.linalg.norm(across, axis=1)
    normal = np.abs(np.einsum("ij,ij->i", across, turn)) / np.maximum(size, 1e-12)
    reversing = np.einsum("ij,ij->i", below, above) < 0.0
    return np.where(reversing, np.linalg.norm(turn, axis=1), normal)


def _divided(
    body: SweptBody, poses: Poses, rows: IntArray, tolerance: float, bounds: Array
) -> tuple[IntArray, tuple[Array, Array], tuple[Array, Array]]:
    """Divide moves until the figures of their segments are within a tolerance; block, start and end poses."""
    parts = np.ones(len(rows), dtype=np.int64)
    left = np.arange(len(rows))
    for _ in range(MOST_ROUNDS):
        move = np.repeat(np.arange(len(left)), parts[left])
        start, middle, end = (poses(place) for place in _places(rows[left], parts[left]))
        ends, halfway = (body.ends(start), body.ends(end)), body.ends(middle)
        off = [np.linalg.norm(m - (a + b) / 2.0, axis=1) for m, a, b in zip(halfway, *ends, strict=True)]
        chord = np.maximum(*off)
        turned = np.linalg.norm(end[1] - start[1], axis=1)
        bent = _twist(ends) * SADDLE
        if body.zones is not None:
            bent = np.maximum(_twist(ends), body.radius * turned) * GRAZING
            chord = np.maximum(chord, turned * np.linalg.norm(end[0] - start[0], axis=1))
        # A chord's error falls with the square of the parts, those of twist and turn with their number.
        factor = np.maximum(np.sqrt(chord / tolerance), bent / tolerance)
        near = _touches(ends, body.radius + 2.0 * (chord + bent), bounds)
        most = np.zeros(len(left))
        np.maximum.at(most, move, np.where(near, factor, 0.0))
        coarse = most > 1.0
        if not coarse.any():
            break
        parts[left[coarse]] *= np.ceil(most[coarse] * 1.01).astype(np.int64)
        left = left[coarse]
    first, _, last = _places(rows, parts)
    return np.repeat(rows, parts), poses(first), poses(last)


def _places(rows: IntArray, parts: IntArray) -> tuple[Array, Array, Array]:
    """Return the fractional rows at which parts of moves start, are halfway and end."""
    row = np.repeat(rows - 1, parts).astype(float)
    number = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    size = np.repeat(1.0 / parts, parts)
    return row + number * size, row + (number + 0.5) * size, row + (number + 1) * size
