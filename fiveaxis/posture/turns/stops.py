"""Where an axis may be rewound, what that costs, and where it may change its turn between two locations.

An axis can be rewound only at angles that it reaches on two turns: both ends of exactly one turn, or a band
of angles of a little more. A location is inserted into a move that jumps over them: on the path, with angles
in proportion to the distance, but for the other axis where that would break a bound on the lean.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, product
from fiveaxis.model import (
    ON_LIMIT,
    TURN,
    Limits,
    Machine,
    TiltBounds,
    Toolpath,
    filled,
    interpolate,
    linear_positions,
    tool_axes,
    tool_poses,
    travel_costs,
    turned,
)

# Changes of the other angle to try (rad): smallest first, to both sides.
CHANGES = np.radians(np.concatenate([[0.0], np.ravel([[a, -a] for a in np.arange(1, 101) * 0.05])]))
# J: a rewind that interrupts a cut leaves a mark, so it is taken only where there is no other.
CUT_PRICE = 1e9
# For an axis on the head: angles of a turn to check, and the distances to try, as multiples of the one that
# clears the part at the first angle.
CHECKED = 24
TRIED = np.array([1.5**k for k in range(8)])
# mm, between tool and part while an axis rewinds; a tool that is so near to being clear is clear.
CLEARANCE, ROUNDING = 10.0, 1e-6


@dataclass(frozen=True, eq=False)
class UnwrappedPath:
    """An unwrapped path, (m, 2) rad, chain order, with locations where an axis may change its turn.

    Each location has a row on the original path, 3.25 between locations 3 and 4, and is admitted where the
    bounds on the lean hold, as at all original locations.
    """

    toolpath: Toolpath
    rotary: Array
    row: Array
    admitted: BoolArray

    @property
    def own(self) -> BoolArray:
        """(m,), whether it is one of the path's own locations."""
        return self.row == np.floor(self.row)


def with_turn_changes(
    toolpath: Toolpath, machine: Machine, rotary: Array, columns: list[int], tilt: TiltBounds | None = None
) -> UnwrappedPath:
    """Insert a location into every move in which an axis may change its turn, but at no location.

    The angles, (n, 2) rad, are unwrapped and in chain order; the axes that wind are columns of the machine's
    axes. Between two locations the directions of the bounds on the lean turn evenly.
    """
    row, angles = np.arange(len(rotary), dtype=float), rotary
    for column in columns:
        which = machine.rotary_columns.index(column)
        rows, exact = with_changes(angles[:, which], machine.axes[column].limits)
        angles = interpolate(angles, rows)
        # Interpolation rounds; the angle must be exact.
        angles[:, which] = exact
        row = np.interp(rows, np.arange(len(row)), row)
    admitted = np.ones(len(row), dtype=bool)
    if len(row) == len(toolpath):
        return UnwrappedPath(toolpath, rotary, row, admitted)
    if tilt is not None:
        between = np.flatnonzero(row != np.floor(row))
        bounds = bounds_between(tilt, row[between])
        for column in columns:
            other = 1 - machine.rotary_columns.index(column)
            angles[between] = keep_lean(machine, angles[between], other, bounds)
        admitted[between] = bounds.admits(tool_axes(machine, angles[between]))
    path = filled(toolpath, row, tool_axes(machine, rotary))
    path = replace(path, normal=turned(toolpath.normal, row), axis=turned(toolpath.axis, row))
    return UnwrappedPath(path, angles, row, admitted)


def bounds_between(tilt: TiltBounds, row: Array) -> TiltBounds:
    """Return bounds on the lean at fractional rows, (m,); they bind between two locations where both do."""
    beside = tuple(bounds_between(b, row) for b in tilt.beside)
    return replace(tilt, reference=turned(tilt.reference, row), beside=beside)


def keep_lean(machine: Machine, rotary: Array, other: int, bounds: TiltBounds) -> Array:
    """Change an angle, 0 or 1, of postures, (m, 2) rad, by the least of `CHANGES` that keeps the bounds."""
    tried = np.repeat(rotary[:, None], len(CHANGES), axis=1)
    limits = machine.axes[machine.rotary_columns[other]].limits
    tried[..., other] = np.clip(tried[..., other] + CHANGES, limits.low, limits.high)
    good = bounds.admits(tool_axes(machine, tried))
    # The first that holds; 0, if none does.
    return np.asarray(tried[np.arange(len(rotary)), np.argmax(good, axis=1)])


def find_turn_changes(angles: Array, limits: Limits) -> tuple[Array, Array]:
    """Find where an axis, at (n,) rad unwrapped, passes angles that two turns reach without a location there.

    Return fractional rows, (s,): 3.25 is a quarter from 3 to 4; and the middle of those angles, (s,) rad.
    """
    low, width = limits.low, limits.span - TURN
    # With two turns every angle has two; towards an open end nothing is ever rewound.
    if not -ON_LIMIT <= width < TURN:
        return np.empty(0), np.empty(0)
    width = max(width, 0.0)
    least, most = np.minimum(angles[:-1], angles[1:]), np.maximum(angles[:-1], angles[1:])
    # The bands that lie wholly between the two ends of a move.
    first = np.floor((least + ON_LIMIT - low) / TURN).astype(np.int64) + 1
    last = np.ceil((most - ON_LIMIT - low - width) / TURN).astype(np.int64) - 1
    count = np.maximum(last - first + 1, 0)
    row = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    changes = low + width / 2.0 + TURN * (first[row] + number)
    return row + (changes - angles[row]) / (angles[row + 1] - angles[row]), changes


def with_changes(angles: Array, limits: Limits) -> tuple[Array, Array]:
    """Insert the angles of `find_turn_changes` between those of an axis, (n,) rad; rows and angles, (m,)."""
    new, changes = find_turn_changes(angles, limits)
    rows = np.concatenate([np.arange(len(angles)), new])
    order = np.argsort(rows, kind="stable")
    return rows[order], np.concatenate([angles, changes])[order]


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


def find_stops(
    course: UnwrappedPath, machine: Machine, column: int, time_price: float
) -> tuple[Array, tuple[float, float], Callable[[int, int], Rewind]]:
    """Work out what rewinding the axis of a column costs, with a price of time, J/s.

    Return the price of a stop at each location, (n,) J, infinite where there is no room; that of one turn up
    and down, J; and what makes the record of a rewind, from its location and whole turns.
    """
    cutting, n = course.toolpath.cutting, len(course.row)
    # A rewind at the last location would be useless; one at the first is the choice of the first turn.
    in_cut = np.append(cutting[1:], False) & (cutting | (np.arange(n) == 0))
    retract = np.full(n, np.inf)
    rows = 1 + np.flatnonzero(course.admitted[1:-1])
    away, ends, past = find_retracts(course, machine, column, rows)
    retract[rows] = np.where(past <= ON_LIMIT, away, np.inf)
    distance, energy = np.where(np.isfinite(retract), retract, 0.0), np.zeros(n)
    feed = link_feed(course.toolpath)
    plus, minus = (c[0, machine.linear_columns] for c in travel_costs(machine, np.array([feed])))
    energy[rows] = product(np.abs(ends[1] - ends[0]), plus + minus)
    speed = turn_feed(machine, column, feed)
    plus, minus = (c[0, column] for c in travel_costs(machine, np.array([speed])))
    turning = TURN * np.array([plus, minus])
    times = 360.0 / speed, 2.0 * distance / feed
    price = np.where(np.isfinite(retract), energy + time_price * times[1], np.inf) + CUT_PRICE * in_cut
    up, down = (float(joules + time_price * times[0]) for joules in turning)

    def rewind(row: int, turns: int) -> Rewind:
        return Rewind(
            row=float(course.row[row]),
            axis=machine.axes[column].letter,
            turns=turns,
            retract=float(distance[row]),
            in_cut=bool(in_cut[row]),
            energy=float(energy[row] + abs(turns) * turning[0 if turns > 0 else 1]),
            time=float(times[1][row] + abs(turns) * times[0]),
        )

    return price, (up, down), rewind


def link_feed(toolpath: Toolpath) -> float:
    """Highest feed of links and rapid moves, mm/s; of the cuts if there are none."""
    links = toolpath.feed[~toolpath.cutting]
    return float((links if len(links) else toolpath.feed).max())


def turn_feed(machine: Machine, column: int, feed: float) -> float:
    """Feed of a move of one rotary axis alone, deg/s: its highest speed if known, else the given feed."""
    fastest = machine.axes[column].max_speed
    return feed if fastest is None else float(np.degrees(fastest))


def find_retracts(
    course: UnwrappedPath, machine: Machine, column: int, rows: IntArray
) -> tuple[Array, Array, Array]:
    """Find how far the tool backs off at locations, (m,), and whether the linear axes can follow.

    Return the distance of `_clear_retracts`, (m,) mm; the linear axes before and after, (2, m, linear axes)
    mm, the same if none was found; and by how much they exceed their limits, (m,) mm, there or in between:
    linear axes are linear in the tip.
    """
    axis = tool_axes(machine, course.rotary)
    tip, rotary, axis = course.toolpath.tips(axis)[rows], course.rotary[rows], axis[rows]
    distance = _clear_retracts(course.toolpath, machine, column, (tip, axis), rotary)
    off = np.where(np.isfinite(distance), distance, 0.0)[:, None] * axis
    ends = np.stack([linear_positions(machine, at, rotary) for at in (tip, tip + off)])
    past = np.maximum(machine.limit_excess(ends), 0.0)[..., machine.linear_columns].max(axis=(0, 2))
    return distance, ends[..., machine.linear_columns], past


def _clear_retracts(
    toolpath: Toolpath, machine: Machine, column: int, tool: tuple[Array, Array], rotary: Array
) -> Array:
    """Measure how far tools must back off before an axis may make whole turns, (m,) mm; infinite for never.

    The tool, given by its tips and axes, is a ray as thick as its thickest part, and stays clear of a sphere
    around everything that is cut. If the workpiece sits on the turning axis, so does the centre, and the turn
    leaves the sphere in place. Table, fixture, surroundings and axis limits aren't considered.
    """
    tip, axis = tool
    on_table = machine.chain.joints[0].letter == machine.axes[column].letter
    points = toolpath.pivot[toolpath.cutting]
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    if on_table:
        line = machine.chain.joints[0].line
        along = product(points - line.point, line.direction)
        centre = line.point + np.multiply((along.min() + along.max()) / 2.0, line.direction)
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    widest = max(float(part.outline[:, 0].max()) for part in toolpath.tool.parts())
    reach = radius + toolpath.zone.radius + widest + CLEARANCE
    least = _exit_distance(tip - centre, axis, reach)
    if on_table:
        return least
    found = np.full(len(tip), np.inf)
    for share in TRIED:
        # A tip outside the sphere has no distance to multiply, but the turn may sweep the tool into it.
        distance = share * np.maximum(least, CLEARANCE) if share > TRIED[0] else least
        clear = _turns_clear(machine, tip + distance[:, None] * axis, rotary, column, (centre, reach))
        found = np.where(np.isinf(found) & clear, distance, found)
    return found


def _exit_distance(start: Array, axis: Array, reach: float) -> Array:
    """Measure how far tips, (n, 3) mm from a sphere's centre, go along their axes until the ray is clear."""
    along = np.sum(start * axis, axis=1)
    across = np.sum(start * start, axis=1) - along**2
    half = np.sqrt(np.maximum(reach**2 - across, 0.0))
    return np.maximum(np.where(across < reach**2, half - along, 0.0), 0.0)


def _turns_clear(
    machine: Machine, tip: Array, rotary: Array, column: int, sphere: tuple[Array, float]
) -> BoolArray:
    """Check where the tool stays clear of a sphere while an axis makes one turn and the others stand."""
    standing = linear_positions(machine, tip, rotary)
    clear = np.ones(len(tip), dtype=bool)
    for turn in np.linspace(0.0, TURN, CHECKED, endpoint=False):
        turned = standing.copy()
        turned[:, column] += turn
        swept, axis = tool_poses(machine, turned)
        clear &= _exit_distance(swept - sphere[0], axis, sphere[1]) <= ROUNDING
    return clear
