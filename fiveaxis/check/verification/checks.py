"""The checks on axis values and poses; each takes a `CheckContext` and returns a `Result`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from fiveaxis.base import JOB, MACHINE_FILE, Array, Coordinates, Gap, angle_between, risk
from fiveaxis.check.verification.check_context import LEAN_BETWEEN, CheckContext
from fiveaxis.check.verification.model import kinematics_name, tool_poses
from fiveaxis.check.verification.report import Result, left_out
from fiveaxis.model import (
    Band,
    TiltBounds,
    across,
    dimensions,
    divided_rows,
    figure_findings,
    interpolate,
    pivots_unknown,
    turned,
)

# rad: by how much tool axis and surface may turn, together, between two places at which the lean is looked
# at; and into how many parts a move is divided for it at most.
BETWEEN, MOST_BETWEEN = math.radians(2.0), 400


def check_figures(context: CheckContext, coordinates: Coordinates) -> Iterator[Result]:
    """Check that every figure of the machine on which the words of a program depend is stated."""
    for finding in figure_findings(context.machine, coordinates, context.positions):
        yield Result(finding.code, np.zeros(1, dtype=np.int64), finding.message, severity=finding.severity)


def check_finite(context: CheckContext) -> Result:
    """Check that every axis value is finite and every duration finite and not negative."""
    motion = context.motion
    times = motion.time[:, None]
    bad = np.hstack([~np.isfinite(motion.positions), ~(np.isfinite(times) & (times >= 0.0))])
    rows, columns = np.nonzero(bad)
    names = [*context.machine.letters, "the duration"]

    def message(i: int) -> str:
        value = np.hstack([motion.positions[rows[i]], motion.time[rows[i]]])[columns[i]]
        why = "no position of the axes puts the tool there; check the machine, or " if np.isnan(value) else ""
        return f"{names[columns[i]]} is {value:g}; {why}compute the motion again"

    return Result(
        code="not-finite",
        rows=rows,
        message=message,
        checked=("axis values and durations are finite numbers", f"kinematics: {kinematics_name()}"),
    )


def check_limits(context: CheckContext, *, placed: bool = True) -> Result:
    """Check every axis value against its limits.

    Unless it is known where the linear axes are (`placed`), only how far each goes is held to its travel.
    """
    machine, tolerances = context.machine, context.tolerances
    overrun = np.maximum(context.positions - machine.high, machine.low - context.positions)
    rotary = np.array([a.is_rotary for a in machine.axes])
    farthest = np.fmax.reduce(context.positions)
    stroke, travel = farthest - np.fmin.reduce(context.positions), machine.high - machine.low
    if not placed:
        ends = np.full_like(overrun, -np.inf)
        ends[np.argmax(context.positions == farthest, axis=0), range(len(travel))] = stroke - travel
        overrun = np.where(rotary, overrun, ends)
    rows, columns = np.nonzero(overrun > np.where(rotary, tolerances.angle, tolerances.length))
    shown = machine.shown(overrun)
    limited = ", ".join(a.letter for a in machine.axes if not a.limits.unlimited)
    # A rotary axis is endless where the machine says so: by limits without an end.
    endless = {p.figure for p in machine.provenance if p.figure.endswith(" limits")}
    endless = {a.letter for a in machine.axes if a.is_rotary and f"{a.letter} limits" in endless}
    lacking = [a.letter for a in machine.axes if a.limits.unlimited and a.letter not in endless]
    # What nobody has stated at all is a finding of `check_figures`.
    unknown, measured = pivots_unknown(machine, or_assumed=False), {d.key[:6] for d in dimensions(machine)}
    assumed = [c for c in machine.rotaries if c not in unknown and f"axes.{c}" in measured]

    def message(i: int) -> str:
        axis, value = machine.axes[columns[i]], context.positions[rows[i], columns[i]]
        if not (placed or axis.is_rotary):
            way, most = (axis.shown(sizes[columns[i]]) for sizes in (stroke, travel))
            return (
                f"{axis.letter} goes over {way:.6g} {axis.unit}, beyond its travel of {most:g} {axis.unit}, "
                "wherever the zero is; divide the work"
            )
        side, bound = ("above", axis.limits.high) if value > axis.limits.high else ("below", axis.limits.low)
        return (
            f"{axis.letter} = {axis.shown(value):.6g} {axis.unit} is {side} the limit "
            f"{axis.shown(bound):g} {axis.unit} by {shown[rows[i], columns[i]]:.3g} {axis.unit}; "
            "change the tilt range or move the part on the table"
        )

    return Result(
        code="axis-limit",
        rows=rows,
        values=shown[rows, columns],
        message=message,
        figures={
            "limit_overrun_mm": _overrun_figure(shown[:, ~rotary]),
            "limit_overrun_deg": _overrun_figure(shown[:, rotary]),
        },
        checked=(f"axis limits of {limited} at every location" + " (how far linear axes go)" * (not placed),)
        if limited
        else (),
        not_checked=tuple(
            risk(f"{what} of {', '.join(letters)}: {why}", what_to_add, MACHINE_FILE)
            for what, letters, why, what_to_add in (
                ("limits", lacking, "the machine states none", "limits"),
                ("pivots", assumed, "the machine's file assumes them", "line"),
            )
            if letters
        ),
    )


def check_contact(context: CheckContext) -> Result:
    """Check that the axis values put the tool's centre and its contact where the path has them.

    The reached centre is ``tip + b·o``, the reached contact ``centre − a·e − r·n``, with the dimensions of
    the zone that touches (a ball's centre and radius). Where the contact is unknown only the centre counts.
    At an inserted location on a curve the pivot may be anywhere between curve and chord, as the given
    locations have them.
    """
    path, zone = context.toolpath, context.toolpath.zone
    at_centre = np.linalg.norm(context.centre - path.centres(context.axis), axis=1)
    pivot = context.centre - zone.offset * across(path.normal, context.axis)
    touched = pivot - zone.radius * path.normal
    at_contact = np.linalg.norm(touched - path.contact, axis=1)
    error = np.fmax(at_centre, at_contact)
    known = np.isfinite(path.normal).all(axis=1) | (zone.offset == 0.0)
    rows = np.flatnonzero(path.inserted & path.cutting & known & context.course.curved)
    if path.curve is not None and len(rows):
        # Along the move it is where the planned location is, or the chord's point beside that.
        aside = Band(path.pivot[rows], path.curve.chord[rows]).asides(pivot[rows])
        along = np.abs(context.course.along(rows, aside))
        error[rows] = np.fmax(context.course.distances(rows, pivot[rows]), along)
    rows = np.flatnonzero(error > context.tolerances.contact)

    def message(i: int) -> str:
        return (
            f"the axis values miss the path's contact by {error[rows[i]]:.3g} mm (at most "
            f"{context.tolerances.contact:g} mm); solve the linear axes again for this posture"
        )

    return Result(
        code="contact-error",
        rows=rows,
        values=error[rows],
        message=message,
        figures={"contact_error_mm": largest(error)},
        checked=("tool centre and contact reached at every location",),
    )


def check_tilt(context: CheckContext) -> Result:
    """Check the angle between tool axis and reference at every cutting location that has a reference.

    A cutter that touches with only one zone of its profile has a second reference, the surface normal.
    """
    if context.constraints.leaning is None:
        figures = {"tilt_min_deg": None, "tilt_max_deg": None}
        return left_out("tilt", figures, Gap("tilt: no tilt range or cone was given", "tilt", JOB))
    every = context.constraints.leaning.all
    angles = np.array([bounds.angles(context.axis) for bounds in every])
    lows, highs = np.array([[bounds.low, bounds.high] for bounds in every]).T
    overruns = np.nan_to_num(np.maximum(angles - highs[:, None], lows[:, None] - angles), nan=-np.inf)
    overrun, worst = overruns.max(axis=0), overruns.argmax(axis=0)
    passed = context.constraints.passed
    between = np.zeros(len(overrun), dtype=bool) if passed is None else passed
    allowed = np.where(between, context.tolerances.lean_between, context.tolerances.lean)
    rows = np.flatnonzero(overrun > allowed)

    def message(i: int) -> str:
        bounds, value = every[worst[rows[i]]], angles[worst[rows[i]], rows[i]]
        remedy = "put locations closer together" if between[rows[i]] else "optimise again or widen the range"
        side, bound = ("above", bounds.high) if value > bounds.high else ("below", bounds.low)
        return (
            f"tool axis at {math.degrees(value):.6g} deg to the {bounds.name} is {side} the bound "
            f"{math.degrees(bound):g} deg; {remedy}"
        )

    tilt = np.degrees(angles[0])
    whose = f"; normals {context.toolpath.normals_from}"
    blind = [int((context.toolpath.cutting & np.isnan(a)).sum()) for a in angles]
    return Result(
        code="tilt",
        rows=rows,
        values=np.degrees(overrun[rows]),
        message=message,
        figures={"tilt_min_deg": smallest(tilt), "tilt_max_deg": largest(tilt)},
        checked=tuple(
            f"angle between tool axis and {b.name} within {math.degrees(b.low):g}…"
            f"{math.degrees(b.high):g} deg at every location of a cut{' where it is known' * bool(lost)}"
            f"{whose * (b.name == 'normal')}"
            for b, lost in zip(every, blind, strict=True)
        ),
        not_checked=tuple(
            Gap(f"angle between tool axis and {b.name} at {lost} cuts: its direction isn't known there")
            for b, lost in zip(every, blind, strict=True)
            if lost
        ),
    )


def check_tilt_between(context: CheckContext, at: Callable[[Array], Array] | None = None) -> Result:
    """Check the same angle within the moves of a cut, where it may be outside though both ends are inside.

    Between two locations the direction that a bound refers to turns evenly, and all axes run linearly, unless
    `at` computes the tool axes, (m, 3) unit vectors, at fractional rows, (m,).
    """
    bounds = context.constraints.leaning
    if bounds is None:
        return Result("tilt")
    turns = np.zeros(len(context.axis) - 1)
    for direction in (context.axis, *(one.reference for one in bounds.all)):
        turns += np.nan_to_num(angle_between(direction[1:], direction[:-1]))
    parts = np.where(context.cutting[1:], np.ceil(turns / BETWEEN), 1.0)
    row = divided_rows(np.clip(parts, 1.0, MOST_BETWEEN).astype(np.int64))
    row = row[row != np.floor(row)]
    at = at or (lambda row: tool_poses(context.machine, interpolate(context.positions, row))[1])
    axis = at(row)
    allowed = max(context.tolerances.lean, LEAN_BETWEEN)
    rows: list[int] = []
    values: list[float] = []
    facts: list[tuple[float, TiltBounds]] = []
    for one in bounds.all:
        angles = angle_between(axis, turned(one.reference, row))
        overrun = np.nan_to_num(np.maximum(angles - one.high, one.low - angles), nan=-np.inf)
        for move in np.unique(np.floor(row[overrun > allowed]).astype(np.int64)):
            inside = np.flatnonzero(np.floor(row) == move)
            worst = inside[np.argmax(overrun[inside])]
            rows.append(move + 1)
            values.append(math.degrees(overrun[worst]))
            facts.append((math.degrees(angles[worst]), one))

    def message(i: int) -> str:
        value, one = facts[i]
        side, bound = ("above", one.high) if value > math.degrees(one.high) else ("below", one.low)
        return (
            f"within the move to this location the tool axis is at {value:.6g} deg to the {one.name}, {side} "
            f"the bound {math.degrees(bound):g} deg; put locations closer together"
        )

    return Result(
        code="tilt",
        rows=np.array(rows, dtype=np.int64),
        values=np.array(values),
        message=message,
        checked=tuple(
            f"the angle to the {one.name} within moves, too, by at most {math.degrees(allowed):g} deg beyond"
            for one in bounds.all
        ),
    )


def largest(values: Array) -> float | None:
    """Return the largest finite number, None if there is none."""
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else None


def smallest(values: Array) -> float | None:
    """Return the smallest finite number, None if there is none."""
    known = values[np.isfinite(values)]
    return float(known.min()) if known.size else None


def _overrun_figure(overrun: Array) -> float | None:
    """Return the worst overrun, 0 if all stay inside, None if no axis has limits (overrun −∞)."""
    worst = largest(overrun)
    return None if worst is None else max(worst, 0.0)
