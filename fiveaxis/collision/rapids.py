"""Rapid moves of the cutter that begin in the stock.

The removal of stock isn't simulated, so a retract begins in the stock. It is taken as clear if it goes back
along the tool's axis or leaves the stock soon; any other rapid move there runs through uncut material.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fiveaxis.collision.travel import Travel
from fiveaxis.geometry import Array, BoolArray

# mm: a rapid move that begins in the stock has to leave it within this length.
LONGEST_RETRACT = 10.0
# mm: between the poses at which that is checked.
STEP = 0.5
# Poses by which the length of a move is measured.
SAMPLES = 65


class OverlapSearch(Protocol):
    """The travel of one piece past another, with a check for overlap."""

    travel: Travel

    def overlaps(self, pose: Array) -> bool:
        """Check whether the pieces overlap, or one is inside the other, at a pose of the mover, (4, 4) mm."""


@dataclass(frozen=True)
class Stay:
    """A rapid move that begins in the stock.

    Parameters
    ----------
    row : where the move ends
    share : of the move, up to which it is in the stock
    left : whether it leaves there, and the rest counts as a move from outside; else it stays too long
    """

    row: int
    share: float
    left: bool


def stays(
    search: OverlapSearch, inside: BoolArray, counted: BoolArray, withdrawn: BoolArray
) -> Iterator[Stay]:
    """Follow rapid moves that begin in the stock until they leave it.

    The lengths of consecutive moves add up. Moves back along the tool's axis are skipped.

    Parameters
    ----------
    inside : (n,), rows whose move is counted and begins in the stock
    counted : (n,), rows whose move is rapid
    withdrawn : (n,), rows whose move goes back along the tool's axis
    """
    spent, last = 0.0, -1
    for row in np.flatnonzero(inside & ~withdrawn).tolist():
        if not inside[last + 1 : row].all() or last < 0:
            spent = 0.0
        share, length, left = _follow(search, row, LONGEST_RETRACT - spent)
        goes_on = row + 1 < len(counted) and bool(counted[row + 1])
        spent, last = spent + length, row
        if left or share < 1.0 or not goes_on:
            yield Stay(row, share, left)


def _follow(search: OverlapSearch, row: int, limit: float) -> tuple[float, float, bool]:
    """Follow a move that begins in the stock, over at most `limit` mm.

    Returns
    -------
    share : of the move, where it leaves or where it was followed to
    length : mm, to there
    left : whether it leaves
    """
    travel = search.travel
    shares = np.linspace(0.0, 1.0, SAMPLES)
    poses = travel.between(np.full(SAMPLES, row - 1), shares)
    steps = np.linalg.norm(np.diff(travel.corners_at(poses), axis=0), axis=2).max(axis=1)
    length = np.append(0.0, np.cumsum(steps))
    end = min(max(limit, 0.0), float(length[-1]))
    tested = np.interp(np.linspace(0.0, end, max(int(np.ceil(end / STEP)), 1) + 1), length, shares)[1:]
    if end == length[-1]:
        tested[-1] = 1.0
    poses = travel.between(np.full(len(tested), row - 1), tested)
    for share, pose in zip(tested.tolist(), poses, strict=True):
        if not search.overlaps(pose):
            return share, float(np.interp(share, shares, length)), True
    return float(tested[-1]), end, False
