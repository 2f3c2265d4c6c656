"""Why a path is infeasible: locations without a posture, a step that isn't possible, and what would help."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, arccos, perpendicular, product
from fiveaxis.kinematics import tool_axes
from fiveaxis.kinematics.windings import DECIMALS, ON_LIMIT, TURN, nearest_turn, outwards
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines import INSIDE, nearest_held, nearest_to_reference, postures
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import sampled
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
# Postures of a location at which a mask is queried.
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
    found: list[Finding] = []
    for row in rows.tolist():
        advising = len(found) < MOST_ADVISED
        tried = _try(toolpath, machine, tilt, row, advising)
        if tried.admitted.any():
            continue
        nearest, overrun = _nearest_miss(machine, tried)
        remedies = [*_wider_tilt(tilt, tried), *_wider_limits(machine, tried)]
        remedies += [
            f"leaving out {bound.text}"
            for number, bound in enumerate(tilt.beside, start=1)
            if tried.violates_only(number).any()
        ]
        advice = f"{' or '.join(remedies)} would do; or " if remedies and advising else ""
        message = (
            f"no tool axis within {' and '.join(b.text for b in tilt.all)} keeps the axis limits; "
            f"{nearest}; {advice}widen the tilt range or set the part up differently"
        )
        found.append(Finding(Severity.ERROR, "no-posture", message, toolpath.place(row), overrun))
    return found


def _leaning_elsewhere(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> BoolArray:
    """Check which locations are reached with one of a few leans around the reference, (n,)."""
    reached = np.zeros(len(toolpath), dtype=bool)
    angles = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, FEW_RINGS)
    turns = np.linspace(0.0, TURN, FEW_AXES, endpoint=False)
    for angle, turn in itertools.product(angles, turns):
        rows = np.flatnonzero(~reached)
        if not len(rows):
            break
        axis = _leaning(tilt.reference[rows], angle, turn)
        reached[rows] = tilt.admits(axis, rows)
        reached[rows] &= postures(machine, toolpath.at(rows), axis).allowed.any(axis=0)
    return reached


def _leaning(reference: Array, angle: Array | float, turn: Array | float) -> Array:
    """Lean tool axes from directions, (..., 3), by angles, towards a side that turns about them; rad."""
    across = perpendicular(reference)
    aside = np.cos(turn) * across + np.sin(turn) * np.cross(reference, across)
    return np.asarray(np.cos(angle) * reference + np.sin(angle) * aside)


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
        angles = _angles(tilt, least, most) if far else _angles(tilt, math.pi, 0.0)
        turns = np.linspace(0.0, TURN, AXES_PER_RING, endpoint=False)
        axis = _leaning(tilt.reference[row], angles[:, None, None], turns[:, None]).reshape(-1, 3)
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


def _nearest_miss(machine: Machine, tried: _Tried) -> tuple[str, float]:
    """Name the axis that exceeds its limit in the nearest posture within the bounds; also by how much."""
    inside = ~tried.outside.any(axis=0)
    if not inside.any():
        return "the rotary axes can't give one, whatever their limits", math.inf
    overrun, shown = tried.overrun[inside], tried.positions[inside]
    best = int(np.argmin(overrun.max(axis=1)))
    column = int(np.argmax(overrun[best]))
    text = f"the nearest needs {_past_limit(machine, shown[best], column)}"
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


def _past_limit(machine: Machine, shown: Array, column: int) -> str:
    """Say where an axis is beyond its limit, of axis values, (k,) mm and deg."""
    axis, value = machine.axes[column], shown[column]
    low, high = axis.shown(axis.limits.low), axis.shown(axis.limits.high)
    return f"{axis.letter} ({value:.3f} {axis.unit}, limit {low if value < low else high:g} {axis.unit})"


def without_path(problem: Problem, toolpath: Toolpath, found: Array, mask: Mask | None = None) -> Infeasible:
    """Say where no sequence of postures leads on, or what the best one breaks.

    Parameters
    ----------
    found : (m, 2), rad, chain order: as far as a search came, or a whole path that breaks bounds
    mask : within which it was searched; None without one

    Returns
    -------
    With findings of code ``no-posture``: one at the location that can't be reached, or one for each bound
    that is broken at a location
    """
    if len(found) < len(problem):
        finding = _no_step(problem, toolpath, found, mask)
        return Infeasible(f"no sequence of postures leads along the path: {finding.message}", [finding])
    machine = problem.machine
    positions, excess = problem.placed(slice(None), found)
    past = machine.limit_excess(positions)
    facts = [(row, "the tool leans out of its bounds") for row in np.flatnonzero(excess > ALLOWED)]
    for row in np.flatnonzero(np.any(past > ALLOWED, axis=1)):
        where = _past_limit(machine, machine.shown(positions[row]), int(np.argmax(past[row])))
        facts.append((row, f"an axis exceeds its limit, {where}"))
    for move in np.flatnonzero(problem.turn_excess(found) > ALLOWED):
        facts.append((move + 1, _too_far(problem, int(move), found[move + 1] - found[move])))
    findings = [
        Finding(
            Severity.ERROR,
            "no-posture",
            f"in the best sequence of postures found {fact}; allow larger turns (--max-turn), put the "
            "locations closer together, or widen the tilt range",
            toolpath.place(int(row)),
        )
        for row, fact in facts
    ]
    return Infeasible(f"the best sequence of postures breaks a bound {len(findings)} times", findings)


def _no_step(problem: Problem, toolpath: Toolpath, found: Array, mask: Mask | None) -> Finding:
    """Say how far the axes would have to turn from where a search stopped, by the nearest sampled posture."""
    row, machine = len(found), problem.machine
    text, value = f"no posture here can be reached from location {row - 1}", None
    remedy = "widen the tilt range" if mask is None else mask.wording.remedy
    here, columns = sampled(problem, row), machine.rotary_columns
    if row and len(here):
        turns = nearest_turn(here, found[-1], machine.low[columns], machine.high[columns]) - found[-1]
        turn = turns[np.argmin((np.abs(turns) - problem.max_turn[row - 1]).max(axis=1))]
        if problem.strict[row - 1] and (np.abs(turn) > problem.max_turn[row - 1] + ALLOWED).any():
            text, value = _too_far(problem, row - 1, turn), float(np.degrees(np.abs(turn).max()))
    text = f"{text}; allow larger turns (--max-turn), put the locations closer together, or {remedy}"
    return Finding(Severity.ERROR, "no-posture", text, toolpath.place(row), value)


def _too_far(problem: Problem, move: int, turn: Array) -> str:
    """Say which axis turns too far in a move, of its turns, (2,) rad, and which bound would be enough."""
    which = int(np.argmax(np.abs(turn) - problem.max_turn[move]))
    letter = problem.machine.axes[problem.machine.rotary_columns[which]].letter
    degrees, most = np.degrees([abs(turn[which]), problem.max_turn[move, which]])
    enough = math.ceil(degrees)
    return (
        f"from location {move} {letter} has to turn by {degrees:.1f} deg, and {most:g} deg are allowed: "
        f"--max-turn {enough} would do for this move"
    )


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
