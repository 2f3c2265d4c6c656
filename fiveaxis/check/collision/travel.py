"""The motion of one piece relative to another, with a bound on its path between two samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, IntArray, inverse_transform, product
from fiveaxis.check.collision.pieces import Piece
from fiveaxis.model import Machine

# Axis values, (n, k) mm and rad → link → its displacement from home, (n, 4, 4) mm, workpiece frame.
Poses = Callable[[Array], Mapping[str, Array]]


@dataclass(frozen=True, eq=False)
class Stretch:
    """Consecutive locations, (n, k) mm and rad, and moves between them with all axes linear in time.

    `poses` computes those of the links for axis values.
    """

    machine: Machine
    poses: Poses
    positions: Array

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def links(self) -> Mapping[str, Array]:
        """Link → (n, 4, 4), mm, at the locations."""
        return self.poses(self.positions)

    @cached_property
    def middles(self) -> Mapping[str, Array]:
        """Link → (n − 1, 4, 4), mm, halfway through the moves."""
        return self.poses((self.positions[:-1] + self.positions[1:]) / 2.0)

    def between(self, moves: IntArray, shares: Array) -> Mapping[str, Array]:
        """Compute the poses of the links at shares, (m,) 0…1, of the moves that begin at locations, (m,)."""
        before, after = self.positions[moves], self.positions[moves + 1]
        return self.poses(before + shares[:, None] * (after - before))


class Travel:
    """One piece, on the link that carries it, as seen from another along a stretch."""

    def __init__(
        self, stretch: Stretch, mover: Piece, other: Piece, mover_link: str, other_link: str
    ) -> None:
        self.stretch, self.mover, self.other = stretch, mover, other
        self._links = mover_link, other_link
        self._base = inverse_transform(other.frame)
        self.poses = self._relative(stretch.links)
        self.corners = self.corners_at(self.poses)

    def along(self, stretch: Stretch) -> Travel:
        """Return the travel of the same pieces along another stretch."""
        return Travel(stretch, self.mover, self.other, *self._links)

    def between(self, moves: IntArray, shares: Array) -> Array:
        """Compute the mover's poses in the other's frame: moves, (m,), and shares, (m,) → (m, 4, 4) mm."""
        return self._relative(self.stretch.between(moves, shares))

    def middles(self, moves: IntArray) -> Array:
        """Compute the mover's poses in the other's frame halfway through moves: (m,) → (m, 4, 4) mm."""
        if not len(moves):
            return np.empty((0, 4, 4))
        return self._relative({link: self.stretch.middles[link][moves] for link in self._links})

    def corners_at(self, poses: Array) -> Array:
        """Compute the corners of the mover's box in the other's frame: (m, 4, 4) → (m, 8, 3) mm."""
        # Sums of columns take a fifth of the time of a product of matrices so small.
        columns = np.moveaxis(poses[:, None, :3], -1, 0)
        x, y, z = self.mover.corners.T[..., None]
        return np.asarray(columns[0] * x + columns[1] * y + columns[2] * z + columns[3])

    def _relative(self, links: Mapping[str, Array]) -> Array:
        mover, other = (links[link] for link in self._links)
        return product(self._base, inverse_transform(other), mover, self.mover.frame)

    @cached_property
    def bends(self) -> Array:
        """Bound on the second derivative of any point's position by the share of a move, (n − 1,) mm.

        A point's position is a product of one factor per joint between the links. Its second derivative by
        two joint values is 0 if the joint nearer to the other piece is linear. If it is rotary, it is the
        cross product of that joint's direction with the derivative by the second value, and so no longer than
        that derivative: 1 for a linear joint, the point's distance to the axis for a rotary one. The distance
        is measured at the start of the move and grows by at most what the joints beyond the axis move it.
        """
        machine, links = self.stretch.machine, self.stretch.links
        names = machine.code.links
        begin, end = (names.index(link) for link in self._links)
        # Numbers of the joints between the two links, the one that carries the mover first.
        joints = range(begin, end, -1) if begin > end else range(begin + 1, end + 1)
        steps = np.abs(np.diff(self.stretch.positions, axis=0))
        centre = product(self.mover.frame, np.append((self.mover.low + self.mover.high) / 2.0, 1.0))[:, None]
        bend, moved = np.zeros(len(steps)), np.zeros(len(steps))
        for number in joints:
            joint = machine.chain.joints[number - 1]
            step = steps[:, machine.column(joint.letter)]
            if not joint.is_rotary:
                moved = moved + step
                continue
            there = product(links[self._links[0]], centre)
            seen = product(inverse_transform(links[names[number]]), there)[:-1, :3, 0]
            arm = np.cross(seen - np.array(joint.line.point), np.array(joint.line.direction))
            distance = np.linalg.norm(arm, axis=1) + self.mover.size / 2.0 + moved
            bend = bend + step * (step * distance + 2.0 * moved)
            moved = moved + step * distance
        return bend
