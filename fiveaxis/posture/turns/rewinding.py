"""Rewinds: where an axis of limited turns goes back, so that a path may wind further than the axis range.

The optimiser first winds axes with a whole turn or more without end. Whole turns move neither the tool nor
any other axis, so those of the path found are a problem of their own, and dynamic programming solves it
exactly. Where an axis can't be rewound, the limits are named that would be enough.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, Infeasible, IntArray, Severity, compiled
from fiveaxis.model import ON_LIMIT, TURN, Limits, Machine, TiltBounds, Toolpath, outwards, tool_axes
from fiveaxis.posture.turns.stops import (
    Rewind,
    UnwrappedPath,
    bounds_between,
    find_retracts,
    find_stops,
    link_feed,
    turn_feed,
    with_turn_changes,
)

# Stands for: no turn is possible.
NO_TURN = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class Rewound:
    """A path with its rewinds as links; its rotary axes, (m, 2) rad, chain order, are within their limits.

    Each location has a row on the path without rewinds, 3.25 between locations 3 and 4, and is `own` if it is
    a location of that path.
    """

    toolpath: Toolpath
    rotary: Array
    row: Array
    own: BoolArray
    rewinds: tuple[Rewind, ...]

    def bounds(self, tilt: TiltBounds) -> TiltBounds:
        """Convert bounds on the lean of the path without rewinds to this one; links are free."""
        return bounds_between(tilt, self.row).only(self.own | self.toolpath.cutting)

    @property
    def energy(self) -> float:
        """Travel metric of all rewinds, J."""
        return sum(r.energy for r in self.rewinds)

    @property
    def time(self) -> float:
        """Duration of all rewinds, s."""
        return sum(r.time for r in self.rewinds)

    def findings(self) -> list[Finding]:
        """Report where every rewind is and what it costs; code ``rewind``."""
        found = []
        for r in self.rewinds:
            severity = Severity.WARNING if r.in_cut else Severity.NOTE
            place = self.toolpath.place(int(np.searchsorted(self.row, r.row)))
            found.append(Finding(severity, "rewind", _describe(r), place, value=360.0 * abs(r.turns)))
        return found


def _describe(rewind: Rewind) -> str:
    where = "within a cut" if rewind.in_cut else "between two cuts"
    off = f"backs off {rewind.retract:.1f} mm along its axis" if rewind.retract else "is clear"
    return (
        f"{rewind.axis} rewinds by {360 * rewind.turns:+d} deg {where}: the tool {off}; this costs "
        f"{rewind.energy:.1f} J and {rewind.time:.1f} s. Table and fixture weren't considered: check it"
    )


def insert_rewinds(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    *,
    tilt: TiltBounds | None = None,
    time_price: float = 0.0,
) -> Rewound:
    """Bring an unwrapped path, (n, 2) rad, chain order, into the axis limits with the cheapest rewinds.

    A rewind takes place where the tool is clear of everything that is cut or can back off along its axis, if
    need be between two locations, and in a cut only if no other is enough. Bounds on the lean hold there. The
    price of time is in J/s. `Infeasible` if the path winds further than an axis can, and can't be rewound.
    """
    columns = winding_columns(machine)
    course = with_turn_changes(toolpath, machine, rotary, columns, tilt)
    arriving, leaving = course.rotary.copy(), course.rotary.copy()
    rewinds: list[tuple[int, Rewind]] = []
    for column in columns:
        which = machine.rotary_columns.index(column)
        price, turn_price, rewind = find_stops(course, machine, column, time_price)
        turns = plan_turns(course.rotary[:, which], machine.axes[column].limits, price, *turn_price)
        if turns is None:
            raise Infeasible(*why_no_rewind(course, machine, column))
        before, after = turns
        arriving[:, which] += TURN * before
        leaving[:, which] += TURN * after
        rows = np.flatnonzero(after - before)
        rewinds += [(int(i), rewind(int(i), int(after[i] - before[i]))) for i in rows]
    return _insert(course, machine, (arriving, leaving), sorted(rewinds, key=lambda r: r[0]))


def _insert(
    course: UnwrappedPath, machine: Machine, rotary: tuple[Array, Array], rewinds: list[tuple[int, Rewind]]
) -> Rewound:
    """Insert rewinds, which are sorted by their rows, into the path: back off, turn each axis, return."""
    arriving, leaving = rotary
    fast, count = link_feed(course.toolpath), np.ones(len(course.row), dtype=np.int64)
    # Angles, distance from the path and feed of all links.
    links: list[tuple[Array, float, float]] = []
    for row, group in groupby(rewinds, key=itemgetter(0)):
        there, now, before = [rewind for _, rewind in group], arriving[row].copy(), len(links)
        off = max(r.retract for r in there)
        if off > 0.0:
            links.append((now.copy(), off, fast))
        for rewind in there:
            column = machine.column(rewind.axis)
            now[machine.rotary_columns.index(column)] += TURN * rewind.turns
            links.append((now.copy(), off, turn_feed(machine, column, fast)))
        if off > 0.0:
            links.append((leaving[row], 0.0, fast))
        count[row] += len(links) - before
    rows = np.repeat(np.arange(len(count)), count)
    is_link = np.diff(rows, prepend=-1) == 0
    # The curve stays what it is without the rewinds.
    path = replace(course.toolpath, inserted_on=course.toolpath.curve).at(rows)
    angles, back, feed = arriving[rows], np.zeros(len(rows)), path.feed.copy()
    if links:
        angles[is_link], back[is_link], feed[is_link] = map(np.array, zip(*links, strict=True))
    linked = _with_links(path, machine, angles, is_link, back, feed)
    own = course.own[rows] & ~is_link
    return Rewound(linked, angles, course.row[rows], own, tuple(r for _, r in rewinds))


def _with_links(
    path: Toolpath, machine: Machine, rotary: Array, link: BoolArray, back: Array, feed: Array
) -> Toolpath:
    """Turn some rows into links, with the tip backed off along the tool's axis by a distance, (n,) mm."""
    axes = tool_axes(machine, rotary)
    unknown = np.full_like(path.normal, np.nan)
    pivot = path.zone.pivot_of_tip(path.tips(axes) + back[:, None] * axes, unknown, axes)
    curve = path.inserted_on
    if curve is not None and path.zone.offset:
        # Beside a link the pivot of such a cutter isn't known.
        curve = replace(curve, bows=np.where(np.append(False, link[:-1])[:, None, None], 0.0, curve.bows))
    return replace(
        path.with_links(link),
        given=~path.inserted & ~link,
        inserted_on=curve,
        pivot=np.where(link[:, None], pivot, path.pivot),
        feed=feed,
    )


def why_no_rewind(course: UnwrappedPath, machine: Machine, column: int) -> tuple[str, tuple[Finding, ...]]:
    """Say that an axis winds too far, and which limits would be enough (checked); also as a finding."""
    axis = machine.axes[column]
    angles = course.rotary[:, machine.rotary_columns.index(column)]
    span, has = np.degrees(np.ptp(angles)), np.degrees(axis.limits.span)
    remedies = [*_linear_remedy(course, machine, column), _own_remedy(angles, machine, column)]
    message = (
        f"{axis.letter} winds through {span:.0f} deg and has {has:.0f} deg, and it can't be rewound on this "
        f"path: where {axis.letter} could be on two turns, the tool can't back off from the part within its "
        f"bounds and the limits of the linear axes; {' or '.join(remedies)} would be enough; or set the part "
        "up lower"
    )
    furthest = int(np.ceil(course.row[int(np.argmax(np.abs(angles - angles[0])))]))
    place = course.toolpath.place(furthest)
    return message, (Finding(Severity.ERROR, "no-rewind", message, place, float(span)),)


def _own_remedy(angles: Array, machine: Machine, column: int) -> str:
    """Name the limits of the axis within which the whole path would fit without a rewind."""
    axis = machine.axes[column]
    low, high = axis.limits.low, axis.limits.high
    # The path begins on the turn that widens the limits least.
    turns = np.arange(math.floor((low - angles.max()) / TURN), math.ceil((high - angles.min()) / TURN) + 1)
    ends = np.minimum(low, angles.min() + TURN * turns), np.maximum(high, angles.max() + TURN * turns)
    best = int(np.argmin(ends[1] - ends[0]))
    least, most = (outwards(axis.shown(float(e[best])), s) for e, s in zip(ends, (-1.0, 1.0), strict=True))
    return f"{axis.letter} from {least} to {most} deg"


def _linear_remedy(course: UnwrappedPath, machine: Machine, column: int) -> Iterator[str]:
    """Name the linear limits for the rewinds that need the least additional travel."""
    inner = 1 + np.flatnonzero(course.admitted[1:-1])
    if not len(inner):
        return
    distance, ends, past = find_retracts(course, machine, column, inner)
    stop = np.full(len(course.row), np.inf)
    stop[inner] = np.where(np.isfinite(distance) & np.isfinite(past), past, np.inf)
    angles = course.rotary[:, machine.rotary_columns.index(column)]
    turns = plan_turns(angles, machine.axes[column].limits, stop)
    if turns is None:
        return
    chosen = np.searchsorted(inner, np.flatnonzero(turns[1] - turns[0]))
    yield " and ".join(_limits_for(machine, ends[:, chosen]))


def _limits_for(machine: Machine, ends: Array) -> Iterator[str]:
    """Name the linear limits that positions, (2, m, linear axes) mm, would need."""
    for number, column in enumerate(machine.linear_columns):
        axis, values = machine.axes[column], ends[..., number]
        if values.max() > axis.limits.high + ON_LIMIT:
            yield f"{axis.letter} to {outwards(float(values.max()), 1.0)} mm"
        if values.min() < axis.limits.low - ON_LIMIT:
            yield f"{axis.letter} to {outwards(float(values.min()), -1.0)} mm"


def winding_columns(machine: Machine) -> list[int]:
    """Find the columns of the rotary axes that have a whole turn or more, but not without end."""
    limits = {column: machine.axes[column].limits for column in machine.rotary_columns}
    return [c for c, own in limits.items() if not own.unlimited and own.span >= TURN - ON_LIMIT]


def endless(machine: Machine) -> Machine:
    """Free the axes that have a whole turn or more of their limits."""
    free = set(winding_columns(machine))
    axes = tuple(replace(a, limits=Limits()) if c in free else a for c, a in enumerate(machine.axes))
    return replace(machine, axes=axes)


def plan_turns(
    angles: Array, limits: Limits, stop: Array, up: float = 0.0, down: float = 0.0
) -> tuple[IntArray, IntArray] | None:
    """Choose the turn of every location so that the rewinds of an axis with limits cost least.

    Its angles, (n,) rad, are unwrapped. To stop at a location for a rewind costs (n,) J, infinite where that
    is impossible, and each turn costs `up` or `down`, J. Return the whole turns to add on the moves to each
    location and from it, (n,) each, which differ where the axis rewinds; None if the path can't be rewound.
    """
    # Towards an open end no path needs more turns than it makes.
    room = np.ceil(np.ptp(angles) / TURN) + 1.0
    first = np.ceil((limits.low - ON_LIMIT - angles) / TURN)
    final = np.floor((limits.high + ON_LIMIT - angles) / TURN)
    least = np.where(np.isfinite(first), first, final - room).astype(np.int64)
    most = np.where(np.isfinite(final), final, first + room).astype(np.int64)
    came, last = _cheapest_turns(least, most, stop.astype(float), float(up), float(down))
    if last == NO_TURN:
        return None
    before, after = np.empty(len(angles), dtype=np.int64), np.empty(len(angles), dtype=np.int64)
    for i in range(len(angles) - 1, -1, -1):
        after[i], last = last, int(came[i, last - least[i]])
        before[i] = last
    return before, after


@compiled
def _cheapest_turns(
    least: IntArray, most: IntArray, stop: Array, up: float, down: float
) -> tuple[IntArray, int]:
    """Find the turn before each turn, counted from the least, and the last; of equals that nearest to 0."""
    n, width = len(least), max(1, np.max(most - least) + 1)
    came = np.zeros((n, width), dtype=np.int64)
    cost, arrived = np.full(width, np.inf), np.full(width, np.inf)
    for i in range(n):
        for w in range(width):
            k = least[i] + w
            arrived[w] = np.inf
            if k > most[i]:
                continue
            if i == 0:
                arrived[w] = 0.0
            elif least[i - 1] <= k <= most[i - 1]:
                arrived[w] = cost[k - least[i - 1]]
        for w in range(width):
            cost[w], came[i, w] = arrived[w], least[i] + w
            if least[i] + w > most[i] or stop[i] == np.inf:
                continue
            for v in range(width):
                turns = w - v
                if turns == 0 or arrived[v] == np.inf:
                    continue
                total = arrived[v] + stop[i] + (turns * up if turns > 0 else -turns * down)
                nearer = abs(least[i] + v) < abs(came[i, w])
                if total < cost[w] or (total == cost[w] and nearer):
                    cost[w], came[i, w] = total, least[i] + v
    last, best = NO_TURN, np.inf
    for w in range(width):
        k = least[n - 1] + w
        if cost[w] < best or (cost[w] == best and cost[w] < np.inf and abs(k) < abs(last)):
            last, best = k, cost[w]
    return came, last
