"""From tool axes to rotary angles: choice of branches and turns, and the postures nearest to a reference.

In compiled loops rows are copied element by element: for ``a[:] = b`` numba would spend seconds on compiling
the broadcasting error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, NoBaseline, compiled, normalise, perpendicular, product
from fiveaxis.model import (
    INSIDE,
    ON_LIMIT,
    TURN,
    Fill,
    Machine,
    TiltBounds,
    Toolpath,
    fit_turns,
    follow,
    hold_singular,
    into_limits,
    linear_positions,
    rotary_angles,
    tool_axes,
    travel_costs,
    within_limits,
)
from fiveaxis.posture.strategy.rotary_bounds import free_angles

# Steps of the tilt range.
TILT_STEPS = 61
# The same with several bounds (rad), which may not meet at their ends.
DRAWN_IN = np.radians(0.02)
# Locations per batch.
CHUNK = 64


@dataclass(frozen=True, eq=False)
class Postures:
    """Axis values that give tool axes, (2, n, k) mm and rad, on both branches.

    Angles are shifted into the limits by whole turns if possible; a branch is allowed, (2, n), where it
    exists and keeps every limit.
    """

    positions: Array
    allowed: BoolArray


def postures(machine: Machine, toolpath: Toolpath, axis: Array) -> Postures:
    """Solve both branches for tool axes, (..., n, 3) unit vectors, NaN for none, and check the limits."""
    rotary = hold_singular(rotary_angles(machine, axis), axis, machine)
    rotary = into_limits(machine, rotary)
    positions = linear_positions(machine, toolpath.tips(axis)[None], rotary)
    return Postures(positions, within_limits(machine, positions))


def require_blocks(fill: Fill) -> Fill:
    """Return the filled path of a baseline if a program can follow it; `NoBaseline` if axes would jump."""
    jumps = fill.jumps
    if len(jumps):
        why = "the linear axes' directions come to lie in one plane"
        if fill.given.zone.offset:
            bottom = f"the flat bottom of {fill.given.tool.cutter}"
            why = f"the tool axis passes through the surface normal, where the contact jumps across {bottom}"
        raise NoBaseline(
            f"no blocks can follow it: {why}, in {len(jumps)} of {len(fill.given) - 1} moves, first from "
            f"location {jumps[0]} to {jumps[0] + 1}"
        )
    return fill


def cheapest_sequence(machine: Machine, found: Postures, costs: tuple[Array, Array]) -> Array | None:
    """Choose the branch of every location so that the travel metric is minimal; (n, 2) rad, chain order.

    Each rotary axis takes the shorter turn unless its limits forbid that; turns accumulate. None where some
    location has no allowed branch.
    """
    if not found.allowed.any(axis=0).all():
        return None
    columns = machine.rotary_columns
    low, high = machine.low[columns], machine.high[columns]
    # An axis with several turns may start on any of them: it is unwrapped first, then shifted as a whole.
    winding = high - low >= TURN
    taken = found.positions, found.allowed, np.array(columns)
    ends = np.where(winding, -np.inf, low), np.where(winding, np.inf, high)
    unwrapped = cheapest_branches(*taken, *ends, ON_LIMIT, *costs)
    fitted = [fit_turns(angles, *limits) for angles, *limits in zip(unwrapped.T, low, high, strict=True)]
    if all(angles is not None for angles in fitted):
        return np.stack([angles for angles in fitted if angles is not None], axis=1)
    return cheapest_branches(*taken, low, high, ON_LIMIT, *costs)


def spread_over_links(toolpath: Toolpath, rows: IntArray, rotary: Array) -> Array:
    """Interpolate angles, (n, 2) rad, over the path's length from those of rows, (m,); held beyond them."""
    length = np.cumsum(toolpath.lengths)
    spread = np.stack([np.interp(length, length[rows], rotary[:, k]) for k in range(2)], axis=1)
    # Where the pivot stands still, as in an inside corner, several locations are at the same length.
    spread[rows] = rotary
    return spread


def follow_axes(toolpath: Toolpath, machine: Machine, axis: Array) -> Array:
    """Compute the rotary angles of tool axes, (n, 3) unit vectors, on the cheapest branches; (n, 2) rad.

    In NaN rows (links) they are interpolated. `NoBaseline` names a location that neither branch reaches.
    """
    costs = travel_costs(machine, toolpath.feed, toolpath.rapid)
    ((rotary, unreached),) = follow_each(toolpath, machine, axis[None], costs)
    if rotary is None:
        raise NoBaseline(
            f"{len(unreached)} locations have a tool axis outside the axis limits, first location "
            f"{unreached[0]}"
        )
    return rotary


def follow_each(
    toolpath: Toolpath, machine: Machine, axes: Array, costs: tuple[Array, Array]
) -> Iterator[tuple[Array | None, IntArray]]:
    """Yield the rotary angles of each of several lists of tool axes, or None, and its rows beyond the limits.

    Lists are (p, n, 3) unit vectors with the same links, NaN rows; the costs are `travel_costs` of the path.
    """
    known = np.isfinite(axes[0]).all(axis=1)
    rows = np.flatnonzero(known)
    whole = known.all()
    found = postures(machine, toolpath if whole else toolpath.at(rows), axes[:, rows])
    plus, minus = (cost[rows] for cost in costs)
    for each in range(len(axes)):
        # In the one layout that the loop is compiled for.
        own = Postures(found.positions[:, each].copy(), found.allowed[:, each].copy())
        rotary = cheapest_sequence(machine, own, (plus, minus))
        if rotary is not None and not whole:
            rotary = spread_over_links(toolpath, rows, rotary)
        yield rotary, rows[~own.allowed.any(axis=0)]


@compiled
def cheapest_branches(
    positions: Array,
    allowed: BoolArray,
    columns: IntArray,
    low: Array,
    high: Array,
    slack: float,
    plus: Array,
    minus: Array,
) -> Array:
    """Choose branches and turns by dynamic programming; (n, 2) rad, chain order.

    Positions and what is allowed are as in `Postures`; columns, (2,), are of the rotary axes. Prices, plus
    and minus, (n, k) J/mm and J/rad, are of the move into each location. The shorter turn is taken within
    limits, low and high, (2,) rad, which it may exceed by the slack, rad.
    """
    n, k = positions.shape[1], positions.shape[2]
    turn = 2.0 * np.pi
    came = np.empty((n, 2), dtype=np.int64)
    trail = np.empty((n, 2, 2))
    cost, reached = np.empty(2), np.empty(2)
    here, there, moved = np.empty((2, k)), np.empty(k), np.empty((2, k))
    for b in range(2):
        cost[b] = 0.0 if allowed[b, 0] else np.inf
        for a in range(k):
            here[b, a] = positions[b, 0, a]
        for r in range(2):
            trail[0, b, r] = positions[b, 0, columns[r]]
    for i in range(1, n):
        for b in range(2):
            reached[b], came[i, b] = np.inf, 0
            for d in range(2):
                if not allowed[b, i] or cost[d] == np.inf:
                    continue
                for a in range(k):
                    there[a] = positions[b, i, a]
                for r in range(2):
                    angle, before = there[columns[r]], here[d, columns[r]]
                    least = np.ceil((low[r] - slack - angle) / turn)
                    most = np.floor((high[r] + slack - angle) / turn)
                    if least <= most:
                        nearest = min(max(np.rint((before - angle) / turn), least), most)
                        there[columns[r]] = angle + turn * nearest
                total = cost[d]
                for a in range(k):
                    step = there[a] - here[d, a]
                    total += plus[i, a] * step if step > 0.0 else -minus[i, a] * step
                if total < reached[b]:
                    reached[b], came[i, b] = total, d
                    for a in range(k):
                        moved[b, a] = there[a]
                    for r in range(2):
                        trail[i, b, r] = there[columns[r]]
        for b in range(2):
            cost[b] = reached[b]
            for a in range(k):
                here[b, a] = moved[b, a]
    rotary = np.empty((n, 2))
    branch = 0 if cost[0] <= cost[1] else 1
    for i in range(n - 1, -1, -1):
        rotary[i, 0], rotary[i, 1] = trail[i, branch, 0], trail[i, branch, 1]
        branch = came[i, branch]
    return rotary


def nearest_to_reference(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find the least upward lean that is reached, (n, 3), NaN at free locations, and where none is, (n,)."""
    # At right angles to the reference, where it rises most steeply.
    up = machine.chain.tool_home[:3, 2]
    across = up - tilt.reference * product(tilt.reference, up)[:, None]
    flat = np.linalg.norm(across, axis=1) < 1e-9
    across[flat] = perpendicular(tilt.reference[flat])
    upwards, axis = normalise(across), np.full_like(tilt.reference, np.nan)
    open_rows: BoolArray = np.array(np.isfinite(tilt.reference).all(axis=1))
    for angle in np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, TILT_STEPS):
        leaning = np.cos(angle) * tilt.reference + np.sin(angle) * upwards
        if tilt.beside:
            leaning = tilt.draw_in(leaning, DRAWN_IN)
        wanted = np.where(open_rows[:, None], leaning, np.nan)
        reached = open_rows & postures(machine, toolpath, wanted).allowed.any(axis=0)
        if tilt.beside:
            reached &= tilt.admits(leaning)
        axis[reached] = leaning[reached]
        open_rows &= ~reached
        if not open_rows.any():
            break
    return axis, open_rows


def nearest_held(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find the postures nearest to the reference for held axes, (n, 2) rad, and where there is none, (n,)."""
    angles = free_angles(machine)
    axis = tool_axes(machine, angles)
    rows = np.flatnonzero(np.isfinite(tilt.reference).all(axis=1)).astype(np.int64)
    rotary, open_rows = np.zeros((len(toolpath), 2)), np.zeros(len(toolpath), dtype=bool)
    open_rows[rows] = True
    for begin in range(0, len(rows), CHUNK):
        part = rows[begin : begin + CHUNK]
        # Nearest first: only the first admissible ones have to be placed on the machine.
        order = np.argsort(-product(tilt.reference[part], axis.T), axis=1, kind="stable")
        admitted = np.take_along_axis(tilt.admits(np.tile(axis, (len(part), 1, 1)), part), order, axis=1)
        for row, ranked, inside in zip(part, order, admitted, strict=True):
            tried = angles[ranked[inside]]
            if not len(tried):
                continue
            held = follow(toolpath.at(np.full(len(tried), row)), machine, tried).positions
            reached = np.flatnonzero(within_limits(machine, held))
            if len(reached):
                rotary[row], open_rows[row] = tried[reached[0]], False
    found = rows[~open_rows[rows]]
    return spread_over_links(toolpath, found, rotary[found]) if len(found) else rotary, open_rows
