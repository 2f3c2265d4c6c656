"""Why a path is infeasible: locations without a posture, a step that isn't possible, and what would help."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, Infeasible, Severity, arccos, perpendicular, product
from fiveaxis.model import (
    DECIMALS,
    INSIDE,
    ON_LIMIT,
    TURN,
    Machine,
    TiltBounds,
    Toolpath,
    follow,
    nearest_turn,
    outwards,
    tool_axes,
)
from fiveaxis.posture.baselines.branches import nearest_held, nearest_to_reference, postures
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.search.successors import sampled
from fiveaxis.posture.strategy.rotary_bounds import free_angles, is_holding

# Rings of tool axes over the tilt range, around the reference, that are tried at a location.
RINGS, AXES_PER_RING = 13, 120
# The same for a quick first attempt at all locations at once, which reaches most of them.
FEW_RINGS, FEW_AXES = 7, 12
# Rings beyond the tilt range, densest near it (rad).
BEYOND = np.radians(np.concatenate([np.arange(0.25, 15.0, 0.25), np.arange(15.0, 180.0, 1.0)]))
# Distances inside several bounds to which axes are drawn (rad), and the stride of those axes.
INSETS, DRAWN_STRIDE = np.radians([0.5, 0.02]), 29
# Most locations for which a remedy is sought, and postures of one at which a mask is queried.
MOST_ADVISED, SAMPLES = 100, 400


def unreachable(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> list[Finding]:
    """List the locations where no posture keeps the bounds on the tool's lean and the axis limits.

    Where neither the upward lean of the ``normal`` baseline nor a few others are admissible, all tool axes
    are sampled; a set narrower than the samples' spacing may be missed. Each finding, code ``no-posture``,
    has the axis and limit of the nearest posture, and each single bound or limit whose change would admit a
    posture (verified on one).
    """
    first = nearest_held if is_holding(machine) else nearest_to_reference
    rows = np.flatnonzero(first(toolpath, machine, tilt)[1])
    if len(rows) and not is_holding(machine):
        rows = rows[~_leaning_elsewhere(toolpath.at(rows), machine, tilt.at(rows))]
    found: list[Finding] = []
    for row in rows.tolist():
        tried = _Tried.at(toolpath, machine, tilt, row, far=len(found) < MOST_ADVISED)
        if (tried.excess > 0.0).any(axis=1).all():
            nearest, overrun = tried.nearest()
            remedies = [*tried.remedies()] if len(found) < MOST_ADVISED else []
            advice = f"{' or '.join(remedies)} would do; or " if remedies else ""
            message = (
                f"no tool axis within {' and '.join(b.text for b in tilt.all)} keeps the axis limits; "
                f"{nearest}; {advice}widen the tilt range or set the part up differently"
            )
            found.append(_no_posture(toolpath, row, message, overrun))
    return found


def _no_posture(toolpath: Toolpath, row: int, text: str, value: float | None = None) -> Finding:
    return Finding(Severity.ERROR, "no-posture", text, toolpath.place(row), value)


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
    """Postures of one location, and what each of them violates of the limits and the b bounds on the lean.

    Angles to the bounds' references, (m, b), are in deg; axis values, (m, k), and the excess beyond each
    bound and each axis's limits, (m, b + k), in mm and deg.
    """

    machine: Machine
    bounds: tuple[TiltBounds, ...]
    angles: Array
    positions: Array
    excess: Array

    @classmethod
    def at(cls, toolpath: Toolpath, machine: Machine, tilt: TiltBounds, row: int, *, far: bool) -> _Tried:
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
                axis = np.concatenate([axis, *_drawn(some, tilt.at(np.full(len(some), row)), far=far)])
            found = postures(machine, toolpath.at(np.full(len(axis), row)), axis)
            axis = np.tile(axis, (len(found.positions), 1))
            positions = found.positions.reshape(-1, found.positions.shape[-1])
        known = np.isfinite(positions).all(axis=1)
        axis, positions = axis[known], positions[known]
        bounds = tuple(replace(bound.at(np.array([row])), beside=()) for bound in tilt.all)
        lean = np.stack([arccos(np.clip(product(axis, b.reference[0]), -1.0, 1.0)) for b in bounds], axis=1)
        outside = np.stack([~bound.admits(axis[None])[0] for bound in bounds], axis=1)
        low, high = np.array([(bound.low, bound.high) for bound in bounds]).T
        leaning = np.where(outside, np.maximum(np.maximum(low - lean, lean - high), ON_LIMIT), 0.0)
        past = machine.limit_excess(positions)
        overrun = machine.shown(np.where(past > ON_LIMIT, past, 0.0))
        excess = np.hstack([np.degrees(leaning), overrun])
        return cls(machine, bounds, np.degrees(lean), machine.shown(positions), excess)

    def nearest(self) -> tuple[str, float]:
        """Name the axis that exceeds its limit in the nearest posture within the bounds, and by how much."""
        inside = np.flatnonzero(~(self.excess[:, : len(self.bounds)] > 0.0).any(axis=1))
        if not len(inside):
            return "the rotary axes can't give one, whatever their limits", math.inf
        overrun = self.excess[inside, len(self.bounds) :]
        best = int(np.argmin(overrun.max(axis=1)))
        column = int(np.argmax(overrun[best]))
        where = _past_limit(self.machine, self.positions[inside[best]], column)
        return f"the nearest needs {where}", float(overrun[best, column])

    def remedies(self) -> Iterator[str]:
        """Name the least change of tilt, a rotary axis, a linear axis and other bounds; each is enough."""
        count, violated = len(self.bounds), self.excess > 0.0
        alone = np.where(violated & (violated.sum(axis=1) == 1)[:, None], self.excess, np.inf)
        rotary, linear = self.machine.rotary_columns, self.machine.linear_columns
        axes = [[count + column for column in columns] for columns in (rotary, linear)]
        for columns in ([0], *axes, *([number] for number in range(1, count))):
            if not np.isfinite(alone[:, columns]).any():
                continue
            best, which = np.unravel_index(int(np.argmin(alone[:, columns])), (len(alone), len(columns)))
            column = columns[which]
            if column >= count:
                axis, value = self.machine.axes[column - count], self.positions[best, column - count]
                side = 1.0 if value > axis.shown(axis.limits.high) else -1.0
                held, wider = f"held at {value:.{DECIMALS}f} deg", f"to {outwards(value, side)} {axis.unit}"
                yield f"{axis.letter} {held if axis.limits.is_fixed else wider}"
            elif column:
                yield f"leaving out {self.bounds[column].text}"
            else:
                name = "cone" if self.bounds[0].name == "programmed axis" else "tilt"
                angle = self.angles[best, 0]
                side = 1.0 if angle > np.degrees(self.bounds[0].high) else -1.0
                yield f"{name} {'up' if side > 0.0 else 'down'} to {outwards(angle, side)} deg"


def _angles(tilt: TiltBounds, least: float, most: float) -> Array:
    """Sample the tilt range, and the angles outside it between two limits, rad."""
    inside = np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, RINGS)
    above, below = tilt.high + BEYOND, tilt.low - BEYOND
    above, below = above[above < most], below[below > least]
    return np.concatenate([inside, above, below, [a for a in (least, most) if least < most]])


def _drawn(axis: Array, bounds: TiltBounds, *, far: bool) -> Iterator[Array]:
    """Draw sampled axes into all bounds, if `far` also into all but one: narrow sets fall between samples."""
    fewer = [[b for b in bounds.all if b is not left] for left in bounds.all] if far else []
    for kept in (bounds.all, *fewer):
        first, *others = (replace(b, beside=()) for b in kept)
        for inset in INSETS:
            yield replace(first, beside=tuple(others)).draw_in(axis, inset)


def _past_limit(machine: Machine, shown: Array, column: int) -> str:
    """Say where an axis is beyond its limit, of axis values, (k,) mm and deg."""
    axis, value = machine.axes[column], shown[column]
    low, high = axis.shown(axis.limits.low), axis.shown(axis.limits.high)
    return f"{axis.letter} ({value:.3f} {axis.unit}, limit {low if value < low else high:g} {axis.unit})"


def without_path(problem: Problem, toolpath: Toolpath, found: Array, mask: Mask | None = None) -> Infeasible:
    """Say where no sequence of postures, (m, 2) rad, leads on, or what a whole one breaks."""
    if len(found) < len(problem):
        finding = _no_step(problem, toolpath, found, mask)
        return Infeasible(f"no sequence of postures leads along the path: {finding.message}", [finding])
    machine = problem.machine
    positions, excess = problem.placed(slice(None), found)
    past = machine.limit_excess(positions)
    facts = [(row, "the tool leans out of its bounds") for row in np.flatnonzero(excess > ALLOWED).tolist()]
    for row in np.flatnonzero(np.any(past > ALLOWED, axis=1)).tolist():
        where = _past_limit(machine, machine.shown(positions[row]), int(np.argmax(past[row])))
        facts.append((row, f"an axis exceeds its limit, {where}"))
    for move in np.flatnonzero(problem.turn_excess(found) > ALLOWED).tolist():
        facts.append((move + 1, _too_far(problem, move, found[move + 1] - found[move])))
    remedy = "allow larger turns (--max-turn), put the locations closer together, or widen the tilt range"
    best = "in the best sequence of postures found"
    findings = [_no_posture(toolpath, row, f"{best} {fact}; {remedy}") for row, fact in facts]
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
    return _no_posture(toolpath, row, text, value)


def _too_far(problem: Problem, move: int, turn: Array) -> str:
    """Say which axis turns too far in a move, of its turns, (2,) rad, and which bound would be enough."""
    which = int(np.argmax(np.abs(turn) - problem.max_turn[move]))
    letter = problem.machine.axes[problem.machine.rotary_columns[which]].letter
    degrees, most = np.degrees([abs(turn[which]), problem.max_turn[move, which]])
    return (
        f"from location {move} {letter} has to turn by {degrees:.1f} deg, and {most:g} deg are allowed: "
        f"--max-turn {math.ceil(degrees)} would do for this move"
    )


def refusal(
    problem: Problem, toolpath: Toolpath, rotary: Array, refused: BoolArray, mask: Mask
) -> Infeasible:
    """Say of each refused location, (n,), of a path, (n, 2) rad, whether the mask admits a posture there."""
    findings = []
    for row in np.flatnonzero(refused).tolist():
        # Samples may miss a narrow tilt range; the path has a posture in it.
        states = np.vstack([rotary[row], sampled(problem, row)])
        states = states[np.unique(np.linspace(0, len(states) - 1, SAMPLES).astype(np.int64))]
        text = f"{mask.wording.none} ({len(states)})"
        if mask.admits(np.full(len(states), row), states).any():
            text = f"{mask.wording.some}, but none was found within reach of its neighbours"
        remedy = f"widen the tilt range, allow larger turns (--max-turn) or {mask.wording.remedy}"
        findings.append(_no_posture(toolpath, row, f"{text}; {remedy}"))
    share = f"{len(findings)} of {len(problem)} locations"
    return Infeasible(f"{share} have no posture in sequence {mask.wording.admitted}", findings)
