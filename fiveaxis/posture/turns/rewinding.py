"""Rewinds: where an axis of limited turns goes back, so that a path may wind further than the axis range."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.turns.no_rewind import why_no_rewind
from fiveaxis.posture.turns.stops import Stops, find_stops, link_feed, turn_feed
from fiveaxis.posture.turns.turn_changes import UnwrappedPath, bounds_between, with_turn_changes
from fiveaxis.posture.turns.winding import plan_turns, winding_columns
from fiveaxis.toolpath import MoveKind, TiltBounds, Toolpath

# mm, between tool and part while an axis rewinds.
CLEARANCE = 10.0


@dataclass(frozen=True)
class Rewind:
    """A stop at which an axis turns by whole turns.

    Parameters
    ----------
    row : of the stop on the path without rewinds; 3.25 lies between locations 3 and 4
    axis : letter
    turns : whole turns, signed
    retract : mm, that the tool backs off along its axis before, and returns after
    in_cut : whether it interrupts a cut
    energy, time : J of the travel metric, and s
    """

    row: float
    axis: str
    turns: int
    retract: float
    in_cut: bool
    energy: float
    time: float


@dataclass(frozen=True, eq=False)
class Rewound:
    """A path with its rewinds as links.

    Parameters
    ----------
    toolpath : its own locations and those of the rewinds
    rotary : (m, 2), rad, chain order, within the limits of the axes that wind
    row : (m,), row of each location on the path without rewinds; 3.25 lies between locations 3 and 4
    own : (m,), whether it is a location of the path without rewinds
    rewinds : in path order
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
        first_rows = np.searchsorted(self.row, [r.row for r in self.rewinds])
        return [
            Finding(
                Severity.WARNING if r.in_cut else Severity.NOTE,
                "rewind",
                _describe(r),
                self.toolpath.place(int(row)),
                value=360.0 * abs(r.turns),
            )
            for r, row in zip(self.rewinds, first_rows, strict=True)
        ]


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
    clearance: float = CLEARANCE,
    time_price: float = 0.0,
) -> Rewound:
    """Bring an unwrapped path into the axis limits with the cheapest rewinds.

    A rewind takes place where the tool is clear of everything that is cut, or can back off along its own axis
    (`clear_retracts`). It interrupts a cut only if no rewind between cuts is enough. If two turns are
    possible only between two locations, as with exactly one turn, it takes place there (`with_turn_changes`).

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, unwrapped
    tilt : bounds on the lean at the path's locations; they also hold at stops between two
    clearance : mm, between tool and part during a rewind
    time_price : J/s

    Raises
    ------
    Infeasible
        The path winds further than an axis can, and no rewind is possible.
    """
    columns = winding_columns(machine)
    course = with_turn_changes(toolpath, machine, rotary, columns, tilt)
    arriving, leaving = course.rotary.copy(), course.rotary.copy()
    rewinds: list[tuple[int, Rewind]] = []
    for column in columns:
        which = machine.rotary_columns.index(column)
        stops = find_stops(course, machine, column, clearance, time_price)
        turns = plan_turns(
            course.rotary[:, which], machine.axes[column].limits, stops.price, *stops.turn_price
        )
        if turns is None:
            raise Infeasible(*why_no_rewind(course, machine, column, clearance))
        before, after = turns
        arriving[:, which] += TURN * before
        leaving[:, which] += TURN * after
        rows = np.flatnonzero(after - before)
        rewinds += [(int(i), _rewind(stops, course, int(i), int(after[i] - before[i]))) for i in rows]
    return _insert(course, machine, (arriving, leaving), sorted(rewinds, key=lambda r: r[0]))


def _rewind(stops: Stops, course: UnwrappedPath, row: int, turns: int) -> Rewind:
    """Make the record of the rewind at a row of an unwrapped path."""
    one = stops.turn_energy[0] if turns > 0 else stops.turn_energy[1]
    return Rewind(
        row=float(course.row[row]),
        axis=stops.axis,
        turns=turns,
        retract=float(stops.retract[row]),
        in_cut=bool(stops.in_cut[row]),
        energy=float(stops.energy[row] + abs(turns) * one),
        time=float(stops.times[1][row] + abs(turns) * stops.times[0]),
    )


def _insert(
    course: UnwrappedPath, machine: Machine, rotary: tuple[Array, Array], rewinds: list[tuple[int, Rewind]]
) -> Rewound:
    """Insert rewinds into the path: back off, turn each axis, return."""
    arriving, leaving = rotary
    stops: dict[int, list[Rewind]] = {}
    for row, rewind in rewinds:
        stops.setdefault(row, []).append(rewind)
    count = np.ones(len(course.row), dtype=np.int64)
    for row, there in stops.items():
        count[row] += len(there) + 2 * (max(r.retract for r in there) > 0.0)
    rows = np.repeat(np.arange(len(count)), count)
    # The curve stays what it is without the rewinds.
    path = replace(course.toolpath, inserted_on=course.toolpath.curve).at(rows)
    angles = leaving[rows].copy()
    arrives = np.cumsum(count) - count
    is_link = np.diff(rows, prepend=-1) == 0
    angles[~is_link] = arriving[rows[~is_link]]
    feed, back = path.feed.copy(), np.zeros(len(rows))
    fast = link_feed(course.toolpath)
    for row, there in stops.items():
        at, off = int(arrives[row]) + 1, max(r.retract for r in there)
        now = arriving[row].copy()
        if off > 0.0:
            angles[at], back[at], feed[at] = now, off, fast
            feed[at + len(there) + 1] = fast
            at += 1
        for rewind in there:
            column = machine.column(rewind.axis)
            now[machine.rotary_columns.index(column)] += TURN * rewind.turns
            angles[at], back[at], feed[at] = now, off, turn_feed(machine, column, fast)
            at += 1
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
    air = np.where(link[:, None], np.nan, 0.0)
    curve = path.inserted_on
    if curve is not None and path.zone.offset:
        # Beside a link the pivot of such a cutter isn't known.
        curve = replace(curve, bows=np.where(np.append(False, link[:-1])[:, None, None], 0.0, curve.bows))
    return replace(
        path,
        given=~path.inserted & ~link,
        inserted_on=curve,
        pivot=np.where(link[:, None], pivot, path.pivot),
        contact=path.contact + air,
        normal=path.normal + air,
        kind=np.where(link, MoveKind.LINK, path.kind),
        feed=feed,
    )
