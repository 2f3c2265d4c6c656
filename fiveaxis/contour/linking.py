"""Passes joined to one path: opened, led in and out, and linked in an order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.contour.ordering import Queue, nearest_start
from fiveaxis.contour.passes import FEWEST_CONTACTS, Pass
from fiveaxis.contour.shortening import Links, shortened
from fiveaxis.contour.ways import Lead, Linker
from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath.passes import PassEnd

# So many contacts of a pass are tried as its start (or end), until one has a way to the clearance plane.
STARTS = 8
# mm: largest distance of locations on a link. The tool leans while it crosses over, and what the axes must do
# for that is seen at the locations only.
LINK_SPACING = 2.0
NOWHERE = np.empty((0, 3))


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


@dataclass(frozen=True, eq=False)
class _Ready:
    """A pass, opened, with the leads of its ends and its number in the queue."""

    cut: Pass
    arrival: Lead
    departure: Lead
    number: int

    def ends(self) -> tuple[PassEnd, PassEnd]:
        """Where the pass begins and where it ends."""
        return _end_of(self.cut, 0, 1), _end_of(self.cut, -1, -2)

    def first(self) -> tuple[Array, Array]:
        """Where a link ends: the ball's centre, (3,) mm, and the normal of the first contact."""
        return _foot(self.ends()[0], self.arrival)

    def last(self) -> tuple[Array, Array]:
        """Where a link begins: the ball's centre, (3,) mm, and the normal of the last contact."""
        return _foot(self.ends()[1], self.departure)


@dataclass(frozen=True, eq=False)
class Linking:
    """Passes opened and led in and out, in their order.

    Parameters
    ----------
    passes : those that have ways to the clearance plane
    left_out : what was taken out, with counts
    linker : finds the ways
    """

    passes: list[_Ready]
    left_out: Counter[str]
    linker: Linker

    @property
    def length(self) -> float:
        """Way of the ball's centre on links between passes, mm."""
        return sum(_way(link_between(a, b, self.linker), a, b) for a, b in pairwise(self.passes))

    def joined(self) -> list[LinkedPass]:
        """Put the links between the passes."""
        linked = []
        before: _Ready | None = None
        for k, this in enumerate(self.passes):
            last = k == len(self.passes) - 1
            retreat = np.vstack([this.departure.arc, this.departure.way]) if last else NOWHERE
            if before is None:
                approach = np.vstack([this.arrival.arc, this.arrival.way])[::-1]
            else:
                approach = link_between(before, this, self.linker)
            linked.append(LinkedPass(approach, this.cut, retreat))
            before = this
        return linked


def open_passes(queue: Queue, linker: Linker, *, lead_in: float = 0.0, lead_out: float = 0.0) -> Linking:
    """Open passes and lead in and out, in the order of a queue.

    A pass without a way from both of its ends to the clearance plane is shortened or left out, and counted.

    Parameters
    ----------
    queue : the passes; used up
    linker : finds the ways
    lead_in, lead_out : mm, radius of the arcs that lead to and from passes; 0 for none
    """
    ready: list[_Ready] = []
    left_out: Counter[str] = Counter()
    here = np.array([*linker.bounds.mean(axis=0)[:2], linker.plane])
    while queue:
        candidate = queue.take(here)
        cut, ways = _open_with_ways(candidate, here, linker)
        if ways is None:
            left_out["passes without a clear link"] += 1
            continue
        left_out["contacts without a clear link"] += max(0, len(candidate) - len(cut))
        found = _Ready(cut, *_leads(cut, ways, linker, (lead_in, lead_out)), queue.taken[-1])
        arcs = (lead_in, found.arrival.arc), (lead_out, found.departure.arc)
        left_out["leads without room for an arc"] += sum(r > 0.0 and not len(arc) for r, arc in arcs)
        ready.append(found)
        here = cut.centres[-1]
    return Linking(ready, +left_out, linker)


def shorten_links(opened: Linking, below: Sequence[Sequence[int]]) -> list[int]:
    """Put the passes in an order with shorter links; gives their numbers.

    Parameters
    ----------
    opened : in the order to begin with
    below : for each number those that must come after it
    """
    ready, linker = opened.passes, opened.linker
    index = {this.number: k for k, this in enumerate(ready)}
    rows = [[index[j] for j in below[this.number] if j in index] for this in ready]
    ends, starts = (
        np.array([e[0] for e in side]) for side in zip(*((r.last(), r.first()) for r in ready), strict=True)
    )
    apart = np.linalg.norm(ends[:, None] - starts[None], axis=2)
    flat = np.linalg.norm(ends[:, None, :2] - starts[None, :, :2], axis=2)
    over = (2.0 * linker.plane - ends[:, None, 2] - starts[None, :, 2]) + flat
    # Over the plane no way is shorter than straight up, across and down.
    links = Links(
        np.where(apart <= linker.farthest, apart, np.maximum(over, apart)),
        lambda a, b: _way(link_between(ready[a], ready[b], linker), ready[a], ready[b]),
    )
    return [ready[k].number for k in shortened(range(len(ready)), links, rows)]


def link_between(before: _Ready, this: _Ready, linker: Linker) -> Array:
    """Centres between the last contact of one pass and the first of the next, (k, 3) mm."""
    leaving, arriving = before.ends()[1], this.ends()[0]
    return lay_link((leaving, before.departure), (arriving, this.arrival), linker)


def lay_link(leaving: tuple[PassEnd, Lead], arriving: tuple[PassEnd, Lead], linker: Linker) -> Array:
    """Lay the centres between the end of one pass and the start of another, with their leads, (k, 3) mm."""
    departure, arrival = leaving[1], arriving[1]
    short = linker.shortcut(_foot(*leaving), _foot(*arriving))
    over = np.vstack([departure.way, arrival.way[::-1]]) if short is None else short
    return np.vstack([departure.arc, over, arrival.arc[::-1]])


def _foot(end: PassEnd, lead: Lead) -> tuple[Array, Array]:
    """Where a link meets a lead: the ball's centre, (3,) mm, and the normal of the contact."""
    return np.vstack([end.pivot[None], lead.arc])[-1], end.normal


def _end_of(cut: Pass, end: int, inner: int) -> PassEnd:
    """Describe an end of an opened pass by its row and the row next to it."""
    centres = cut.centres
    return PassEnd(centres[end], cut.contacts.normals[end], centres[end] - centres[inner])


def _way(link: Array, before: _Ready, this: _Ready) -> float:
    """Length of a link with the moves to and from it, mm."""
    whole = np.vstack([before.cut.centres[-1:], link, this.cut.centres[:1]])
    return float(np.linalg.norm(np.diff(whole, axis=0), axis=1).sum())


def _leads(
    cut: Pass, ways: tuple[Array, Array], linker: Linker, radii: tuple[float, float]
) -> tuple[Lead, Lead]:
    """Put arcs between a pass's ends and their ways, where there is room."""
    leads = [Lead(NOWHERE, way) for way in ways]
    for k, end in enumerate((_end_of(cut, 0, 1), _end_of(cut, -1, -2))):
        if radii[k] > 0.0:
            leads[k] = linker.lead((end.pivot, end.normal), end.outward, radii[k]) or leads[k]
    return leads[0], leads[1]


def _open_with_ways(candidate: Pass, here: Array, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Open a pass where its ends have ways to the clearance plane, near `here` if possible."""
    return _open_closed(candidate, here, linker) if candidate.contacts.closed else _shorten(candidate, linker)


def _open_closed(candidate: Pass, here: Array, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Choose the contact at which a closed pass starts and ends; one way serves both."""
    found = first_escape(candidate, rows_from(candidate, here), linker)
    if found is None:
        return candidate, None
    return candidate.started_at(found[0]), (found[1], found[1])


def _shorten(candidate: Pass, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Cut the ends off an open pass as far as the ball, wedged between walls there, has no way out."""
    rows = candidate.touching()
    arrival, departure = (first_escape(candidate, order, linker) for order in (rows, rows[::-1]))
    if arrival is None or departure is None:
        return candidate, None
    cut = candidate.between(arrival[0], departure[0])
    return cut, None if len(cut.touching()) < FEWEST_CONTACTS else (arrival[1], departure[1])


def rows_from(candidate: Pass, here: Array) -> IntArray:
    """Rows at which a closed pass can start, in its order from the one nearest to a place, (3,) mm."""
    starts = candidate.starts()
    first = int(np.searchsorted(starts, nearest_start(candidate, here)[0]))
    return np.roll(starts, -first)


def free_start(ring: Pass, linker: Linker) -> int:
    """Row of a closed pass from which there is a way to the clearance plane, if one is found."""
    rows = ring.touching()
    found = first_escape(ring, rows, linker)
    return int(rows[0]) if found is None else found[0]


def first_escape(candidate: Pass, rows: IntArray, linker: Linker) -> tuple[int, Array] | None:
    """Find a row with a way to the clearance plane among a few of some rows, the first ones preferred."""
    for k in np.unique(np.linspace(0, len(rows), STARTS, endpoint=False).astype(int)):
        row = int(rows[k])
        way = linker.escape(candidate.centres[row], candidate.contacts.normals[row])
        if way is not None:
            return row, way
    return None
