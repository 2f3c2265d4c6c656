"""Rewinds: where an axis of limited turns goes back, so that a path may wind further than its range."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.energy import travel_costs
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Machine
from fiveaxis.posture.retreat import retreats
from fiveaxis.posture.winding import plan_turns, winding_columns
from fiveaxis.toolpath import MoveKind, TiltBounds, Toolpath

# mm, between tool and part while an axis rewinds.
CLEARANCE = 10.0
# J: a rewind that interrupts a cut leaves a mark, so it is taken only where there is no other.
CUT_PRICE = 1e9


@dataclass(frozen=True)
class Rewind:
    """A stop at which an axis turns back by whole turns.

    Parameters
    ----------
    row : of the path without rewinds: the stop is after this location
    axis : letter
    turns : whole turns, signed
    retract : mm, that the tool backs off along its axis first and comes back afterwards
    in_cut : whether a cut goes on afterwards where it stopped
    energy, time : J of the travel metric, and s
    """

    row: int
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
    toolpath : the locations, and those of the rewinds
    rotary : (m, 2), rad, chain order, inside the limits of the axes that wind
    rows : (m,), row of the path without rewinds that each location is, or stands at
    rewinds : in path order
    """

    toolpath: Toolpath
    rotary: Array
    rows: IntArray
    rewinds: tuple[Rewind, ...]

    def bounds(self, tilt: TiltBounds) -> TiltBounds:
        """Give the bounds on the lean, made for the path without rewinds, for this one; links are free."""
        link = np.diff(self.rows, prepend=-1) == 0
        free = np.where(link[:, None], np.nan, 0.0)
        here = [replace(b, reference=b.reference[self.rows] + free, beside=()) for b in tilt.all]
        return replace(here[0], beside=tuple(here[1:]))

    @property
    def energy(self) -> float:
        """Travel metric of all rewinds, J."""
        return sum(r.energy for r in self.rewinds)

    @property
    def time(self) -> float:
        """Duration of all rewinds, s."""
        return sum(r.time for r in self.rewinds)

    def findings(self) -> list[Finding]:
        """Say of every rewind where it is and what it costs; code ``rewind``."""
        first_rows = np.searchsorted(self.rows, [r.row for r in self.rewinds])
        return [
            Finding(
                Severity.WARNING if r.in_cut else Severity.NOTE,
                "rewind",
                _message(r),
                self.toolpath.place(int(row)),
                value=360.0 * abs(r.turns),
            )
            for r, row in zip(self.rewinds, first_rows, strict=True)
        ]


def _message(rewind: Rewind) -> str:
    where = "the cut stops here" if rewind.in_cut else "between two cuts"
    off = (
        f"the tool backs off {rewind.retract:.1f} mm along its axis"
        if rewind.retract
        else "the tool is clear"
    )
    return (
        f"{rewind.axis} turns back by {360 * rewind.turns:+d} deg, {where}: {off}; it costs "
        f"{rewind.energy:.1f} J and {rewind.time:.1f} s. Table and fixture aren't known here: look at this"
    )


def rewound(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    *,
    clearance: float = CLEARANCE,
    time_price: float = 0.0,
) -> Rewound:
    """Put a path that winds without end into the limits, with as cheap rewinds as there are.

    A rewind stands where the tool is already clear of what the path cuts, or where it can back off along
    its own axis (`retreats`). One that interrupts a cut is taken only where none between cuts will do.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, wound
    clearance : mm, between tool and part while an axis rewinds
    time_price : J/s

    Raises
    ------
    Infeasible
        The path winds further than an axis can, and there is no place to rewind.
    """
    arriving, leaving = rotary.copy(), rotary.copy()
    rewinds: list[Rewind] = []
    for column in winding_columns(machine):
        which = machine.rotary_columns.index(column)
        limits = machine.axes[column].limits
        stops = _stops(toolpath, machine, rotary, column, clearance, time_price)
        turns = plan_turns(rotary[:, which], (limits.low, limits.high), stops.price, stops.up, stops.down)
        if turns is None:
            raise Infeasible(*_no_stop(toolpath, machine, rotary, column))
        before, after = turns
        arriving[:, which] += TURN * before
        leaving[:, which] += TURN * after
        rewinds += [stops.rewind(int(i), int(after[i] - before[i])) for i in np.flatnonzero(after - before)]
    return _inserted(toolpath, machine, (arriving, leaving), sorted(rewinds, key=lambda r: r.row))


@dataclass(frozen=True, eq=False)
class _Stops:
    """What rewinding one axis costs at each location.

    Parameters
    ----------
    axis : letter
    retract : (n,), mm; infinite where there is no room
    energy : (n,), J, of backing off and coming back
    up, down : (n,), J, of each turn, with its time's price
    turn_energy : (2,), J, of one turn forwards and back, without it
    times : s, of one turn and (n,) of backing off and coming back
    in_cut : (n,)
    price : (n,), J, what `plan_turns` counts
    """

    axis: str
    retract: Array
    energy: Array
    up: Array
    down: Array
    turn_energy: Array
    times: tuple[float, Array]
    in_cut: Array
    price: Array

    def rewind(self, row: int, turns: int) -> Rewind:
        """Describe the rewind at a row."""
        one = self.turn_energy[0] if turns > 0 else self.turn_energy[1]
        return Rewind(
            row=row,
            axis=self.axis,
            turns=turns,
            retract=float(self.retract[row]),
            in_cut=bool(self.in_cut[row]),
            energy=float(self.energy[row] + abs(turns) * one),
            time=float(self.times[1][row] + abs(turns) * self.times[0]),
        )


def _stops(
    toolpath: Toolpath, machine: Machine, rotary: Array, column: int, clearance: float, time_price: float
) -> _Stops:
    n = len(toolpath)
    cutting = toolpath.cutting
    # A rewind at the last location would serve nothing; one at the first is a matter of where to begin.
    in_cut = np.append(cutting[1:], False) & (cutting | (np.arange(n) == 0))
    retract = np.full(n, np.inf)
    rows = np.arange(1, n - 1)
    retract[rows] = retreats(toolpath, machine, rotary, column, rows, clearance)
    way = np.where(np.isfinite(retract), retract, 0.0)
    axes = tool_axes(machine, rotary)
    tip = toolpath.tips(axes)
    feed = link_feed(toolpath)
    move = linear_positions(machine, tip + way[:, None] * axes, rotary) - linear_positions(
        machine, tip, rotary
    )
    plus, minus = (c[0] for c in travel_costs(machine, np.array([feed])))
    energy = np.abs(move) @ (plus + minus)
    speed = turn_feed(machine, column, feed)
    plus, minus = (c[0, column] for c in travel_costs(machine, np.array([speed])))
    turning = TURN * np.array([plus, minus])
    times = 360.0 / speed, 2.0 * way / feed
    price = np.where(np.isfinite(retract), energy + time_price * times[1], np.inf) + CUT_PRICE * in_cut
    up, down = (np.full(n, joules + time_price * times[0]) for joules in turning)
    letter = machine.axes[column].letter
    return _Stops(letter, way, energy, up, down, turning, times, in_cut, price)


def link_feed(toolpath: Toolpath) -> float:
    """Highest feed of links and rapid moves, mm/s; of the cuts where there are none."""
    links = toolpath.feed[~toolpath.cutting]
    return float((links if len(links) else toolpath.feed).max())


def turn_feed(machine: Machine, column: int, feed: float) -> float:
    """Feed of a move in which one rotary axis turns alone: deg/s, its highest speed if that is known."""
    fastest = machine.axes[column].max_speed
    return feed if fastest is None else float(np.degrees(fastest))


def _inserted(
    toolpath: Toolpath, machine: Machine, rotary: tuple[Array, Array], rewinds: list[Rewind]
) -> Rewound:
    """Put the rewinds into the path: back off, turn each axis, come back."""
    arriving, leaving = rotary
    n = len(toolpath)
    stops: dict[int, list[Rewind]] = {}
    for rewind in rewinds:
        stops.setdefault(rewind.row, []).append(rewind)
    added = np.zeros(n, dtype=np.int64)
    for row, there in stops.items():
        added[row] = len(there) + 2 * (max(r.retract for r in there) > 0.0)
    rows = np.repeat(np.arange(n), 1 + added)
    path, angles = toolpath.at(rows), leaving[rows].copy()
    own = np.cumsum(1 + added) - 1 - added
    angles[own] = arriving
    feed, back = path.feed.copy(), np.zeros(len(rows))
    fast = link_feed(toolpath)
    for row, there in stops.items():
        at, off = int(own[row]) + 1, max(r.retract for r in there)
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
    return Rewound(_with_links(path, machine, angles, own, back, feed), angles, rows, tuple(rewinds))


def _with_links(
    path: Toolpath, machine: Machine, rotary: Array, own: IntArray, back: Array, feed: Array
) -> Toolpath:
    """Make the rows that aren't the path's own links, so far off along the tool's axis; the tip counts."""
    link = np.ones(len(path), dtype=bool)
    link[own] = False
    axes = tool_axes(machine, rotary)
    unknown = np.full_like(path.normal, np.nan)
    pivot = path.zone.pivot_of_tip(path.tips(axes) + back[:, None] * axes, unknown, axes)
    air = np.where(link[:, None], np.nan, 0.0)
    return replace(
        path,
        pivot=np.where(link[:, None], pivot, path.pivot),
        contact=path.contact + air,
        normal=path.normal + air,
        kind=np.where(link, MoveKind.LINK, path.kind),
        feed=feed,
    )


def _no_stop(
    toolpath: Toolpath, machine: Machine, rotary: Array, column: int
) -> tuple[str, tuple[Finding, ...]]:
    axis = machine.axes[column]
    angles = np.degrees(rotary[:, machine.rotary_columns.index(column)])
    span, has = float(np.ptp(angles)), np.degrees(axis.limits.high - axis.limits.low)
    message = (
        f"{axis.letter} winds through {span:.0f} deg and has {has:.0f} deg, and there is no place to turn it "
        "back: nowhere can the tool back off from the part within the limits of the linear axes while two "
        "turns are open to it; put the locations closer together or set the part up lower"
    )
    furthest = int(np.argmax(np.abs(angles - angles[0])))
    return message, (Finding(Severity.ERROR, "no-rewind", message, toolpath.place(furthest), span),)
