"""Why a path is infeasible: locations without a posture, moves that turn too far, and what would help."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray, arccos, every_pair, perpendicular, product
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import DECIMALS, ON_LIMIT, outwards
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import INSIDE, nearest_held, nearest_to_reference, postures
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import sampled, spin_angles
from fiveaxis.posture.strategy.holding import free_angles, is_holding
from fiveaxis.toolpath import TiltBounds, Toolpath

# Rings of tool axes over the tilt range, around the reference, that are tried at a location.
RINGS, AXES_PER_RING = 13, 120
# The same for a quick first attempt at all locations at once, which reaches most of them.
FEW_RINGS, FEW_AXES = 7, 12
# Rings beyond the tilt range, densest near it (rad).
BEYOND = np.radians(np.concatenate([np.arange(0.25, 15.0, 0.25), np.arange(15.0, 180.0, 1.0)]))
# Distances inside several bounds to which axes are drawn (rad), and the stride of those axes.
INSETS, DRAWN_STRIDE = np.radians([0.5, 0.02]), 29
# Most locations for which a remedy is sought.
MOST_ADVISED = 100
# Turns: grid of both rotary angles (rad): a share of the bound, between these limits.
SHARE, FINEST, COARSEST = 1.0 / 3.0, np.radians(3.0), np.radians(5.0)
# Longer paths aren't analysed: each pair of locations costs the square of its postures.
MOST_LOCATIONS = 3000
# Postures tried at a location before it is reported to have none that the mask admits.
SAMPLES = 400


def unreachable(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> list[Finding]:
    """List the locations where no posture keeps the bounds on the tool's lean and the axis limits.

    Most locations pass with the first posture tried, the upward lean of the ``normal`` baseline, or with one
    of a few other directions of lean. For the rest all tool axes are sampled, so a set narrower than the
    samples' spacing may be missed.

    Returns
    -------
    One finding per location, code ``no-posture``, with the axis and limit of the nearest posture, and with
    each single bound or limit whose change would admit a posture (verified on a posture that it admits).
    """
    if is_holding(machine):
        rows = np.flatnonzero(nearest_held(toolpath, machine, tilt)[1])
    else:
        rows = np.flatnonzero(nearest_to_reference(toolpath, machine, tilt)[1])
        rows = rows[~_leaning_elsewhere(toolpath.at(rows), machine, tilt.at(rows))] if len(rows) else rows
    return list(_blocked(toolpath, machine, tilt, rows))


def _leaning_elsewhere(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> BoolArray:
    """Check which locations are reached with one of a few leans around the reference, (n,)."""
    reached = np.zeros(len(toolpath), dtype=bool)
    angles = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, FEW_RINGS)
    across = perpendicular(tilt.reference)
    beside = np.cross(tilt.reference, across)
    turns = np.linspace(0.0, 2.0 * np.pi, FEW_AXES, endpoint=False)
    for angle, turn in itertools.product(angles, turns):
        rows = np.flatnonzero(~reached)
        if not len(rows):
            break
        aside = np.cos(turn) * across[rows] + np.sin(turn) * beside[rows]
        axis = np.cos(angle) * tilt.reference[rows] + np.sin(angle) * aside
        reached[rows] = tilt.admits(axis, rows)
        reached[rows] &= postures(machine, toolpath.at(rows), axis).allowed.any(axis=0)
    return reached


def _blocked(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, rows: IntArray) -> Iterator[Finding]:
    advised = 0
    for row in rows:
        advising = advised < MOST_ADVISED
        tried = _try(toolpath, machine, tilt, int(row), advising)
        if tried.admitted.any():
            continue
        advised += 1
        nearest, overrun = _nearest_miss(machine, tried)
        omitted = [b.text for k, b in enumerate(tilt.beside, start=1) if tried.violates_only(k).any()]
        remedies = [*_wider_tilt(tilt, tried), *_wider_limits(machine, tried)]
        remedies += [f"leaving out {text}" for text in omitted]
        advice = f"{' or '.join(remedies)} would do; or " if remedies and advising else ""
        yield Finding(
            Severity.ERROR,
            "no-posture",
            f"no tool axis within {' and '.join(b.text for b in tilt.all)} keeps the axis limits; "
            f"{nearest}; {advice}widen the tilt range or set the part up differently",
            toolpath.place(int(row)),
            overrun,
        )


@dataclass(frozen=True, eq=False)
class _Tried:
    """Postures of one location, and what each of them violates.

    Parameters
    ----------
    angle : (m,), rad, to the first bound's reference
    outside : (b, m), whether a bound on the lean is violated
    positions : (m, k), mm and deg
    overrun : (m, k), mm and deg, past the limits
    """

    angle: Array
    outside: BoolArray
    positions: Array
    overrun: Array

    @property
    def admitted(self) -> BoolArray:
        """(m,), postures that violate nothing."""
        return ~self.outside.any(axis=0) & self.reached

    @property
    def reached(self) -> BoolArray:
        """(m,), postures inside all axis limits."""
        return np.all(self.overrun <= 0.0, axis=1)

    def violates_only(self, bound: int) -> BoolArray:
        """(m,), postures inside the limits that violate this bound and no other."""
        return self.outside[bound] & (self.outside.sum(axis=0) == 1) & self.reached


def _try(toolpath: Toolpath, machine: Machine, tilt: TiltBounds, row: int, far: bool) -> _Tried:
    """Try tool axes of the tilt range, if `far` also beyond it, or all angles that held axes leave."""
    if is_holding(machine):
        rotary = free_angles(machine)
        axis = tool_axes(machine, rotary)
        positions = follow(toolpath.at(np.full(len(rotary), row)), machine, rotary).positions
    else:
        zone, by_normal = toolpath.zone, tilt.name == "normal"
        # A wider range doesn't help where the cutter doesn't touch.
        least, most = (zone.least, zone.high) if by_normal else (0.0, math.pi)
        axis = ring_axes(
            tilt.reference[row], _angles(tilt, least, most) if far else _angles(tilt, math.pi, 0.0)
        )
        if tilt.beside:
            some = axis[::DRAWN_STRIDE]
            axis = np.concatenate([axis, *_drawn(some, tilt.at(np.full(len(some), row)))])
        found = postures(machine, toolpath.at(np.full(len(axis), row)), axis)
        axis = np.tile(axis, (len(found.positions), 1))
        positions = found.positions.reshape(-1, found.positions.shape[-1])
    known = np.isfinite(positions).all(axis=1)
    axis, positions = axis[known], positions[known]
    past = machine.limit_excess(positions)
    alone = [replace(bound.at(np.array([row])), beside=()) for bound in tilt.all]
    outside = [~bound.admits(axis[None])[0] for bound in alone]
    return _Tried(
        arccos(np.clip(product(axis, tilt.reference[row]), -1.0, 1.0)),
        np.array(outside),
        machine.shown(positions),
        machine.shown(np.where(past > ON_LIMIT, past, 0.0)),
    )


def _angles(tilt: TiltBounds, least: float, most: float) -> Array:
    """Sample the tilt range, and the angles outside it between two limits, rad."""
    inside = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, RINGS)
    above, below = tilt.high + BEYOND, tilt.low - BEYOND
    above, below = above[above < most], below[below > least]
    return np.concatenate([inside, above, below, [a for a in (least, most) if least < most]])


def _drawn(axis: Array, bounds: TiltBounds) -> Iterator[Array]:
    """Draw sampled axes into all bounds, and into all but one, as narrow sets fall between samples."""
    for kept in (bounds.all, *([b for b in bounds.all if b is not left] for left in bounds.all)):
        first, *others = (replace(b, beside=()) for b in kept)
        for inset in INSETS:
            yield replace(first, beside=tuple(others)).draw_in(axis, inset)


def ring_axes(reference: Array, angles: Array) -> Array:
    """Sample tool axes, (r · axes, 3), at angles, (r,) rad, around a reference direction, (3,)."""
    across = perpendicular(reference)
    third = np.cross(reference, across)
    angle = angles[:, None, None]
    turn = np.linspace(0.0, 2.0 * np.pi, AXES_PER_RING, endpoint=False)[None, :, None]
    around = np.cos(turn) * across + np.sin(turn) * third
    return (np.cos(angle) * reference + np.sin(angle) * around).reshape(-1, 3)


def _nearest_miss(machine: Machine, tried: _Tried) -> tuple[str, float]:
    """Name the axis that exceeds its limit in the nearest posture within the bounds; also by how much."""
    inside = ~tried.outside.any(axis=0)
    if not inside.any():
        return "the rotary axes can't give one, whatever their limits", math.inf
    overrun, shown = tried.overrun[inside], tried.positions[inside]
    best = int(np.argmin(overrun.max(axis=1)))
    column = int(np.argmax(overrun[best]))
    axis, value = machine.axes[column], shown[best, column]
    limits = [axis.shown(end) for end in (axis.limits.low, axis.limits.high)]
    limit = limits[0] if value < limits[0] else limits[1]
    text = f"the nearest needs {axis.letter} ({value:.3f} {axis.unit}, limit {limit:g} {axis.unit})"
    return text, float(overrun[best, column])


def _wider_tilt(tilt: TiltBounds, tried: _Tried) -> Iterator[str]:
    """Name the angle to which the first bound would have to extend, all else being kept."""
    name = "cone" if tilt.name == "programmed axis" else "tilt"
    angle = np.degrees(tried.angle[tried.violates_only(0)])
    low, high = np.degrees([tilt.low, tilt.high])
    above, below = angle[angle > high], angle[angle < low]
    ends = []
    if len(above):
        ends.append((above.min() - high, f"{name} up to {outwards(above.min(), 1.0)} deg"))
    if len(below):
        ends.append((low - below.max(), f"{name} down to {outwards(below.max(), -1.0)} deg"))
    if ends:
        yield min(ends)[1]


def _wider_limits(machine: Machine, tried: _Tried) -> Iterator[str]:
    """Name how far a rotary and a linear axis would have to go, all else being kept."""
    single = ~tried.outside.any(axis=0) & ((tried.overrun > 0.0).sum(axis=1) == 1)
    for columns in (machine.rotary_columns, machine.linear_columns):
        overrun = np.where(single[:, None] & (tried.overrun > 0.0), tried.overrun, np.inf)[:, columns]
        if not np.isfinite(overrun).any():
            continue
        best, at = np.unravel_index(int(np.argmin(overrun)), overrun.shape)
        axis, value = machine.axes[columns[at]], tried.positions[best, columns[at]]
        if axis.limits.is_fixed:
            yield f"{axis.letter} held at {value:.{DECIMALS}f} deg"
            continue
        side = 1.0 if value > axis.shown(axis.limits.high) else -1.0
        yield f"{axis.letter} to {outwards(value, side)} {axis.unit}"


# Admissible postures of a location, (m, 2) rad, the least cost to reach each, and from which, (m,).
_Layer = tuple[Array, Array, IntArray]


def long_turns(problem: Problem, toolpath: Toolpath) -> list[Finding]:
    """List the cutting moves on which a rotary axis has to turn farther than allowed, at their ends.

    They are those of the path through a grid of admissible postures with the smallest sum of squares of turns
    beyond their bounds. The grid is coarse: angles are accurate to a few degrees. There is no finding if it
    is too coarse, or has a path within the bounds.
    """
    bounds = problem.max_turn[problem.strict]
    smallest = float(bounds.min(initial=np.inf))
    step = SHARE * smallest
    if not FINEST <= step < np.inf or len(problem) > MOST_LOCATIONS:
        return []
    # In links axes turn as far as they like.
    bound = np.flatnonzero(problem.bound_rows)
    layers = _layers(problem, bound, min(step, COARSEST))
    if layers is None:
        return []
    path = np.full((len(problem), 2), np.nan)
    path[bound] = _traced(layers)
    turns = _turns(problem, path[:-1, None], path[1:, None])[:, 0]
    past = (turns - problem.max_turn).max(axis=1)
    rows = np.flatnonzero(problem.strict & (past > ALLOWED))
    needed = math.ceil(max((float(np.degrees(turns[row].max())) for row in rows), default=0.0))
    return [_finding(problem, toolpath, int(row), np.degrees(turns[row]), needed) for row in rows]


def _finding(problem: Problem, toolpath: Toolpath, row: int, turns: Array, needed: int) -> Finding:
    column = problem.machine.rotary_columns[int(np.argmax(turns))]
    letter = problem.machine.axes[column].letter
    most = np.degrees(problem.max_turn[row].min())
    return Finding(
        Severity.ERROR,
        "no-posture",
        f"no posture here is within {most:g} deg of an admissible one at location {row}: {letter} has to "
        f"turn by about {turns.max():.0f} deg in between; allow turns of {needed} deg (--max-turn {needed}) "
        "or put the locations closer together",
        toolpath.place(row + 1),
        float(turns.max()),
    )


def _layers(problem: Problem, rows: IntArray, step: float) -> list[_Layer] | None:
    """Find the postures of locations, (m,), with the least cost to reach each; None if one has none."""
    grids = [spin_angles(problem, axis, step) for axis in (0, 1)]
    every = every_pair(*grids).reshape(-1, 2)
    layers: list[_Layer] = []
    bound = problem.bound_rows
    for row in rows.tolist():
        positions, excess = problem.placed(np.array([row]), every[None])
        rotary = every[(excess[0] <= ALLOWED) & (problem.limit_excess(positions[0]) <= ALLOWED)]
        if not len(rotary):
            return None
        if not layers:
            layers.append((rotary, np.zeros(len(rotary)), np.zeros(len(rotary), dtype=np.int64)))
            continue
        before, cost, _ = layers[-1]
        if not (bound[row - 1] and problem.strict[row - 1]):
            cheapest = np.full(len(rotary), np.argmin(cost))
            layers.append((rotary, cost[cheapest], cheapest))
            continue
        past = (_turns(problem, before[None], rotary[:, None]) - problem.max_turn[row - 1]).max(axis=-1)
        total = cost + np.maximum(past, 0.0) ** 2
        # Of equals the one with the smallest turn.
        came = np.argmin(total + 1e-9 * np.maximum(past + np.pi, 0.0), axis=1)
        layers.append((rotary, total[np.arange(len(rotary)), came], came))
    return layers


def _turns(problem: Problem, here: Array, there: Array) -> Array:
    """Compute turns between angles, (..., 2) rad, the shorter ones for axes with at least a full turn."""
    turns = np.abs(there - here)
    columns = problem.machine.rotary_columns
    wraps = problem.machine.high[columns] - problem.machine.low[columns] >= 2.0 * np.pi
    around = np.mod(turns, 2.0 * np.pi)
    return np.where(wraps, np.minimum(around, 2.0 * np.pi - around), turns)


def _traced(layers: list[_Layer]) -> Array:
    """Trace the cheapest path back, (n, 2) rad."""
    path = np.empty((len(layers), 2))
    state = int(np.argmin(layers[-1][1]))
    for row in range(len(layers) - 1, -1, -1):
        rotary, _, came = layers[row]
        path[row], state = rotary[state], int(came[state])
    return path


def without_path(problem: Problem, found: Array | None, toolpath: Toolpath) -> Infeasible:
    """Say where no sequence of postures was found; the best path, (n, 2) rad, breaks bounds."""
    turning = long_turns(problem, toolpath)
    if turning:
        share = f"{len(turning)} of {len(toolpath) - 1} moves"
        return Infeasible(
            f"no sequence of postures along the path: {share} exceed the largest turn (--max-turn) in the "
            "best one found",
            turning,
        )
    if found is None:
        return Infeasible(
            "every location has an admissible posture, but the search found no sequence of them along "
            "the path; allow larger turns between locations (--max-turn), put the locations closer "
            "together, or widen the tilt range",
            (),
        )
    positions, excess = problem.placed(slice(None), found)
    broken = {
        "the tilt range": excess > ALLOWED,
        "an axis limit": problem.limit_excess(positions) > ALLOWED,
        "the largest rotary step": np.concatenate([[0.0], problem.turn_excess(found)]) > ALLOWED,
    }
    findings = [
        Finding(
            Severity.ERROR,
            "no-posture",
            f"no posture was found that keeps {what} and can be reached from its neighbours; allow larger "
            "turns (--max-turn), put the locations closer together, or widen the tilt range",
            toolpath.place(int(row)),
        )
        for what, rows in broken.items()
        for row in np.flatnonzero(rows)
    ]
    return Infeasible(f"{len(findings)} locations have no admissible posture in sequence", findings)


def refusal(
    problem: Problem, toolpath: Toolpath, rotary: Array, refused: BoolArray, mask: Mask
) -> Infeasible:
    """Say of each refused location, (n,), whether the mask admits a posture there.

    Parameters
    ----------
    rotary : (n, 2), rad, the path's postures, of which the mask refuses some
    """
    findings = []
    for row in np.flatnonzero(refused):
        # Samples may miss a narrow tilt range; the path has a posture in it.
        states = np.vstack([rotary[row], sampled(problem, int(row))])
        states = states[np.unique(np.linspace(0, len(states) - 1, SAMPLES).astype(np.int64))]
        text = f"{mask.wording.none} ({len(states)})"
        if mask.admits(np.full(len(states), row), states).any():
            text = f"{mask.wording.some}, but none was found within reach of its neighbours"
        remedy = f"widen the tilt range, allow larger turns (--max-turn) or {mask.wording.remedy}"
        place = toolpath.place(int(row))
        findings.append(Finding(Severity.ERROR, "no-posture", f"{text}; {remedy}", place))
    share = f"{len(findings)} of {len(problem)} locations"
    return Infeasible(f"{share} have no posture in sequence {mask.wording.admitted}", findings)
