"""Passes joined to one path: opened, led in and out, and linked in an order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.cam.contour.ball_space import Lead, Linker, PassEnd
from fiveaxis.cam.contour.ordering import Links, Queue, nearest_start, shortened
from fiveaxis.cam.contour.passes import FEWEST_CONTACTS, NO_LINK, WEDGED, LeftOut, Pass

# Contacts of a pass tried as its start (or end) until one has a route to the clearance plane.
STARTS = 8
# mm: largest distance of locations on a link. The tool tilts during the link, and the axis motion that this
# takes is checked at locations only.
LINK_SPACING = 2.0
EMPTY = np.empty((0, 3))


@dataclass(frozen=True, eq=False)
class LinkedPass:
    """A pass with the link that leads to it.

    Parameters
    ----------
    approach : (k, 3), mm, ball centres before the first contact
    cut : the opened pass
    retract : (m, 3), mm, ball centres after the last contact; empty except for the last pass
    """

    approach: Array
    cut: Pass
    retract: Array


@dataclass(frozen=True, eq=False)
class _LedPass:
    """An opened pass with the leads of its ends and its number in the queue."""

    cut: Pass
    arrival: Lead
    departure: Lead
    number: int


@dataclass(frozen=True, eq=False)
class Linking:
    """Opened passes with their leads, in order.

    Parameters
    ----------
    passes : those with routes to the clearance plane
    left_out : what was left out
    linker : finds the routes
    """

    passes: list[_LedPass]
    left_out: LeftOut
    linker: Linker

    @property
    def length(self) -> float:
        """Length of all links between passes, mm, of the ball's centre."""
        return sum(_link_length(a, b, self.linker) for a, b in pairwise(self.passes))

    def joined(self) -> list[LinkedPass]:
        """Return the passes with the links between them."""
        if not self.passes:
            return []
        approaches = [self.passes[0].arrival.centres[::-1]]
        approaches += [_link_between(a, b, self.linker) for a, b in pairwise(self.passes)]
        retracts = [EMPTY] * (len(self.passes) - 1) + [self.passes[-1].departure.centres]
        cuts = [led.cut for led in self.passes]
        return [LinkedPass(*parts) for parts in zip(approaches, cuts, retracts, strict=True)]


def open_passes(queue: Queue, linker: Linker, *, lead_in: float = 0.0, lead_out: float = 0.0) -> Linking:
    """Open the passes of a queue and add their leads, in its order; the queue is empty afterwards.

    A pass whose ends have no route to the clearance plane is shortened or left out, and counted. The arcs
    before and after passes have the radii `lead_in`, `lead_out`, mm; 0 for none.
    """
    led: list[_LedPass] = []
    left_out = LeftOut()
    here = np.array([*linker.bounds.mean(axis=0)[:2], linker.plane])
    while queue:
        candidate = queue.take(here)
        closed = candidate.closed
        cut, routes = _open_closed(candidate, here, linker) if closed else _shorten(candidate, linker)
        if routes is None:
            left_out += LeftOut.of_pass(NO_LINK, candidate)
            continue
        left_out += _shortened(candidate, cut)
        found = _LedPass(cut, *_leads(cut, routes, linker, (lead_in, lead_out)), queue.taken[-1])
        arcs = (lead_in, found.arrival.arc), (lead_out, found.departure.arc)
        bare = sum(r > 0.0 and not len(arc) for r, arc in arcs)
        left_out += LeftOut(Counter({"leads without room for an arc": bare}))
        led.append(found)
        here = cut.centres[-1]
    return Linking(led, left_out, linker)


def _shortened(candidate: Pass, cut: Pass) -> LeftOut:
    """Return the contacts at the ends of an open pass that were cut off."""
    if len(cut) >= len(candidate):
        return LeftOut()
    first = int(np.argmax((candidate.centres == cut.centres[0]).all(axis=1)))
    rows = np.arange(len(candidate))
    return LeftOut.of(WEDGED, candidate, (rows < first) | (rows >= first + len(cut)))


def shorten_links(opened: Linking, below: Sequence[Sequence[int]]) -> list[int]:
    """Find an order of the passes, by number, with shorter links than those in which they were opened.

    `below` has for each number those that must come after it.
    """
    led, linker = opened.passes, opened.linker
    index = {this.number: k for k, this in enumerate(led)}
    rows = [[index[j] for j in below[this.number] if j in index] for this in led]
    ends = np.array([_foot(p.cut.ends()[1], p.departure)[0] for p in led])
    starts = np.array([_foot(p.cut.ends()[0], p.arrival)[0] for p in led])
    apart = np.linalg.norm(ends[:, None] - starts[None], axis=2)
    flat = np.linalg.norm(ends[:, None, :2] - starts[None, :, :2], axis=2)
    # No link over the clearance plane is shorter than straight up, across and down.
    over = (2.0 * linker.plane - ends[:, None, 2] - starts[None, :, 2]) + flat
    links = Links(
        np.where(apart <= linker.farthest, apart, np.maximum(over, apart)),
        lambda a, b: _link_length(led[a], led[b], linker),
    )
    return [led[k].number for k in shortened(range(len(led)), links, rows)]


def _link_between(before: _LedPass, after: _LedPass, linker: Linker) -> Array:
    """Return the centres between the end of one pass and the start of another, (k, 3) mm."""
    departure, arrival = before.departure, after.arrival
    short = linker.shortcut(_foot(before.cut.ends()[1], departure), _foot(after.cut.ends()[0], arrival))
    over = np.vstack([departure.route, arrival.route[::-1]]) if short is None else short
    return np.vstack([departure.arc, over, arrival.arc[::-1]])


def _link_length(before: _LedPass, after: _LedPass, linker: Linker) -> float:
    """Return the length of a link, mm, from the last contact of a pass to the first of the next."""
    link = _link_between(before, after, linker)
    whole = np.vstack([before.cut.centres[-1:], link, after.cut.centres[:1]])
    return float(np.linalg.norm(np.diff(whole, axis=0), axis=1).sum())


def _foot(end: PassEnd, lead: Lead) -> tuple[Array, Array]:
    """Return where the link meets the lead: the ball's centre, (3,) mm, and the contact's normal."""
    return np.vstack([end.pivot[None], lead.arc])[-1], end.normal


def _leads(
    cut: Pass, routes: tuple[Array, Array], linker: Linker, radii: tuple[float, float]
) -> tuple[Lead, Lead]:
    """Put arcs between a pass's ends and their routes, where there is room."""
    leads = [Lead(EMPTY, route) for route in routes]
    for k, end in enumerate(cut.ends()):
        if radii[k] > 0.0:
            leads[k] = linker.lead(end, radii[k]) or leads[k]
    return leads[0], leads[1]


def _open_closed(candidate: Pass, here: Array, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Choose the contact at which a closed pass starts and ends; one route serves both."""
    starts = candidate.starts()
    first = int(np.searchsorted(starts, nearest_start(candidate, here)[0]))
    found = _first_escape(candidate, np.roll(starts, -first), linker)
    if found is None:
        return candidate, None
    return candidate.started_at(found[0]), (found[1], found[1])


def _shorten(candidate: Pass, linker: Linker) -> tuple[Pass, tuple[Array, Array] | None]:
    """Cut off the ends of an open pass where the ball is wedged between walls and has no route out."""
    rows = candidate.touching()
    arrival, departure = (_first_escape(candidate, order, linker) for order in (rows, rows[::-1]))
    if arrival is None or departure is None:
        return candidate, None
    cut = candidate.between(arrival[0], departure[0])
    return cut, None if len(cut.touching()) < FEWEST_CONTACTS else (arrival[1], departure[1])


def free_start(ring: Pass, linker: Linker) -> int:
    """Find a row of a closed pass with a route to the clearance plane; its first row if none is found."""
    rows = ring.touching()
    found = _first_escape(ring, rows, linker)
    return int(rows[0]) if found is None else found[0]


def _first_escape(candidate: Pass, rows: IntArray, linker: Linker) -> tuple[int, Array] | None:
    """Find a row with a route to the clearance plane among some of the rows, the first ones preferred."""
    for k in np.unique(np.linspace(0, len(rows), STARTS, endpoint=False).astype(int)):
        row = int(rows[k])
        route = linker.escape(candidate.centres[row], candidate.smooth[row])
        if route is not None:
            return row, route
    return None
