"""Passes: runs of contacts that the ball can follow without gouging."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fiveaxis.contour.contacts import Contacts
from fiveaxis.contour.distance import BallSpace
from fiveaxis.contour.surface import SHARP_EDGE
from fiveaxis.geometry import Array, IntArray, angle_between

# A wall's normal is at least this far from the vertical; flatter places are not finished by waterlines.
FLATTEST_WALL = np.radians(10.0)
# A wall overhangs where its normal points at least this far below the horizontal.
LEAST_OVERHANG = np.radians(1.0)
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

    def starts(self) -> IntArray:
        """Rows at which the pass can start: only the first one, unless it is closed."""
        if not self.contacts.closed:
            return np.array([0])
        return np.flatnonzero(~self.contacts.rolling)

    def started_at(self, row: int) -> Pass:
        """Return the pass opened at a row; a closed one comes back to it at its end."""
        if not self.contacts.closed:
            return self
        order = (row + np.arange(len(self.centres) + 1)) % len(self.centres)
        return Pass(self.contacts.take(order, closed=False), self.centres[order])


def split_passes(
    contacts: Contacts, space: BallSpace, *, spacing: float, overhang: bool
) -> tuple[list[Pass], Counter[str]]:
    """Keep the contacts on walls that the ball can touch, and split where it can't go on.

    Two neighbours stay in one pass if the normal turns by no more than `SHARP_EDGE`, the straight move
    between them is clear, and, where contacts between them were taken out, the ball's centre moves no
    farther than `spacing`: the facets of a fillet then don't tear a pass apart, but an inner corner does.

    Returns
    -------
    passes : in the order of the curve
    left_out : what was taken out, with counts
    """
    centres = contacts.points + space.radius * contacts.normals
    wall = _is_wall(contacts.normals[:, 2], overhang=overhang) | contacts.rolling
    kept = wall & space.fits(centres)
    left_out = Counter({"contacts where the ball would gouge": int((wall & ~kept & ~contacts.rolling).sum())})
    rows = np.flatnonzero(kept)
    if len(rows) < FEWEST_CONTACTS:
        return [], left_out
    joined = _joined(contacts, centres, rows, space, spacing)
    runs = [rows] if joined.all() else _runs(rows, joined)
    passes = []
    for run in runs:
        trimmed = _trim_rolling(run, contacts.rolling)
        if _is_long(contacts.points[trimmed], contacts.rolling[trimmed], spacing):
            closed = bool(joined.all())
            passes.append(Pass(contacts.take(trimmed, closed=closed), centres[trimmed]))
        else:
            left_out["passes shorter than 3 contacts or the spacing"] += 1
    return passes, left_out


def _is_wall(upward: Array, *, overhang: bool) -> NDArray[np.bool_]:
    highest = -np.sin(LEAST_OVERHANG) if overhang else np.cos(FLATTEST_WALL)
    wall: NDArray[np.bool_] = (upward >= -np.cos(FLATTEST_WALL)) & (upward <= highest)
    return wall


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


def _runs(rows: IntArray, joined: NDArray[np.bool_]) -> list[IntArray]:
    ends = np.flatnonzero(~joined)
    # Start behind the first break, so that a run across the curve's seam stays whole.
    shift = int(ends[0]) + 1
    runs = np.split(np.roll(rows, -shift), ends + 1 - shift)
    return [run for run in runs if len(run)]


def _trim_rolling(run: IntArray, rolling: NDArray[np.bool_]) -> IntArray:
    touching = np.flatnonzero(~rolling[run])
    return run[touching[0] : touching[-1] + 1] if len(touching) else run[:0]


def _is_long(points: Array, rolling: NDArray[np.bool_], spacing: float) -> bool:
    if (~rolling).sum() < FEWEST_CONTACTS:
        return False
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) >= spacing
