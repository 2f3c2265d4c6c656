"""Passes: runs of contacts that the ball can follow without gouging."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fiveaxis.contour.ball_space import BallSpace
from fiveaxis.contour.contacts import Contacts
from fiveaxis.contour.walls import Walls
from fiveaxis.geometry import Array, IntArray, angle_between
from fiveaxis.mesh.surface import SHARP_EDGE

FEWEST_CONTACTS = 3


@dataclass(frozen=True, eq=False)
class Pass:
    """Contacts that are followed in one go, with the ball's centre at each.

    Parameters
    ----------
    contacts : rows; a closed pass returns to its first one
    centres : (n, 3), mm
    """

    contacts: Contacts
    centres: Array

    def __len__(self) -> int:
        return len(self.centres)

    def starts(self) -> IntArray:
        """Rows at which the pass can start: only the first one, unless it is closed."""
        return self.touching() if self.contacts.closed else np.array([0])

    def touching(self) -> IntArray:
        """Rows on which the ball touches a wall and doesn't just roll about an edge."""
        return np.flatnonzero(~self.contacts.rolling)

    def between(self, first: int, last: int) -> Pass:
        """Return the open pass from one row to another, both included."""
        rows = np.arange(first, last + 1)
        return Pass(self.contacts.take(rows, closed=False), self.centres[rows])

    def reversed(self) -> Pass:
        """Return the pass followed the other way."""
        rows = np.arange(len(self))[::-1]
        return Pass(self.contacts.take(rows, closed=self.contacts.closed), self.centres[rows])

    def started_at(self, row: int) -> Pass:
        """Return the pass opened at a row; a closed one comes back to it at its end."""
        if not self.contacts.closed:
            return self
        order = (row + np.arange(len(self) + 1)) % len(self)
        return Pass(self.contacts.take(order, closed=False), self.centres[order])


def split_passes(
    contacts: Contacts, space: BallSpace, walls: Walls, *, spacing: float, min_length: float = 0.0
) -> tuple[list[Pass], Counter[str]]:
    """Keep the contacts on walls that the ball can touch, and split where it can't go on.

    Two neighbours stay in one pass if the normal turns by no more than `SHARP_EDGE`, the straight move
    between them is clear, and, where contacts between them were taken out, the ball's centre moves no
    farther than `spacing`: the facets of a fillet then don't tear a pass apart, but an inner corner does.

    Parameters
    ----------
    contacts : along one section curve
    space : where the ball can be
    walls : which contacts are wanted
    spacing, min_length : mm, of contacts and of the shortest pass that is kept

    Returns
    -------
    passes : in the order of the curve
    left_out : what was taken out, with counts
    """
    centres = contacts.points + space.radius * contacts.normals
    wall = walls.keep(contacts.normals) | contacts.rolling
    kept = wall & space.fits(centres)
    left_out = Counter({"contacts where the ball would gouge": int((wall & ~kept & ~contacts.rolling).sum())})
    rows = np.flatnonzero(kept)
    if len(rows) < FEWEST_CONTACTS:
        return [], left_out
    joined = _joined(contacts, centres, rows, space, spacing)
    closed = bool(joined.all())
    # A closed pass keeps all of its rolling rows, also those beside the curve's seam.
    runs = [rows] if closed else _runs(rows, joined, contacts.rolling)
    passes = []
    for run in runs:
        length = _length(contacts.points[run], closed=closed)
        if (~contacts.rolling[run]).sum() < FEWEST_CONTACTS or length < spacing:
            left_out["passes shorter than 3 contacts or the spacing"] += 1
        elif length < min_length:
            left_out["passes shorter than the minimum length"] += 1
        else:
            passes.append(Pass(contacts.take(run, closed=closed), centres[run]))
    return passes, left_out


def _joined(
    contacts: Contacts, centres: Array, rows: IntArray, space: BallSpace, spacing: float
) -> NDArray[np.bool_]:
    """(k,), whether each kept row goes on to the next one, the last to the first."""
    after = np.roll(rows, -1)
    adjacent = (after - rows) % len(contacts) == 1
    moved = np.linalg.norm(centres[after] - centres[rows], axis=1)
    gentle = angle_between(contacts.normals[rows], contacts.normals[after]) <= SHARP_EDGE
    joined: NDArray[np.bool_] = gentle & (adjacent | (moved <= spacing))
    joined[-1] &= contacts.closed
    joined[joined] = space.chords_fit(centres[rows[joined]], centres[after[joined]])
    return joined


def _runs(rows: IntArray, joined: NDArray[np.bool_], rolling: NDArray[np.bool_]) -> list[IntArray]:
    """Split rows where they aren't joined; no run starts or ends by rolling about an edge."""
    ends = np.flatnonzero(~joined)
    # Start behind the first break, so that a run across the curve's seam stays whole.
    shift = int(ends[0]) + 1
    runs = np.split(np.roll(rows, -shift), ends + 1 - shift)
    touching = [(run, np.flatnonzero(~rolling[run])) for run in runs]
    return [run[cut[0] : cut[-1] + 1] for run, cut in touching if len(cut)]


def _length(points: Array, *, closed: bool) -> float:
    steps = np.diff(points, axis=0, append=points[:1] if closed else points[-1:])
    return float(np.linalg.norm(steps, axis=1).sum())
