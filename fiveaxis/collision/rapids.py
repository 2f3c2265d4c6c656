"""Rapid moves of the cutter that begin in the stock.

What was cut isn't simulated, so a retract begins in the stock. It leaves by where the tool came from, along
its own axis, or soon; a rapid that does neither goes through material that nobody has cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fiveaxis.collision.travel import Travel
from fiveaxis.geometry import Array, BoolArray

# mm: a rapid that begins in the stock has left it after this way.
LONGEST_RETRACT = 10.0
# mm: between places at which it is asked whether it has.
STEP = 0.5
# Places by which the way of a move is measured.
SAMPLES = 65


class Meeting(Protocol):
    """Knows whether two pieces overlap."""

    travel: Travel

    def meets(self, place: Array) -> bool:
        """Tell whether they do at a place of the mover, (4, 4) mm, or one is wholly inside the other."""


@dataclass(frozen=True)
class Stay:
    """What is to be said of a rapid move that begins in the stock.

    Parameters
    ----------
    row : at which the move ends
    share : of the move, up to which it was in the stock
    left : whether it leaves there, and the rest is a move from outside; else it stays too long
    """

    row: int
    share: float
    left: bool


def stays(search: Meeting, inside: BoolArray, counted: BoolArray, withdrawn: BoolArray) -> Iterator[Stay]:
    """Follow rapid moves that begin in the stock until they leave it.

    Moves one after the other count together. Nothing is said of those that withdraw.

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
        share, way, left = _follow(search, row, LONGEST_RETRACT - spent)
        goes_on = row + 1 < len(counted) and bool(counted[row + 1])
        spent, last = spent + way, row
        if left or share < 1.0 or not goes_on:
            yield Stay(row, share, left)


def _follow(search: Meeting, row: int, room: float) -> tuple[float, float, bool]:
    """Follow a move from within the stock, for so many mm.

    Returns
    -------
    share : of the move, where it leaves or where it was followed to
    way : mm, to there
    left : whether it leaves
    """
    travel = search.travel
    shares = np.linspace(0.0, 1.0, SAMPLES)
    places = travel.between(np.full(SAMPLES, row - 1), shares)
    steps = np.linalg.norm(np.diff(travel.corners_at(places), axis=0), axis=2).max(axis=1)
    way = np.append(0.0, np.cumsum(steps))
    end = min(max(room, 0.0), float(way[-1]))
    asked = np.interp(np.linspace(0.0, end, max(int(np.ceil(end / STEP)), 1) + 1), way, shares)[1:]
    if end == way[-1]:
        asked[-1] = 1.0
    for share, place in zip(asked.tolist(), travel.between(np.full(len(asked), row - 1), asked), strict=True):
        if not search.meets(place):
            return share, float(np.interp(share, shares, way)), True
    return float(asked[-1]), end, False
