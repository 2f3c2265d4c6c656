"""The verdict on a program of ours: what its text says, against the path that it was made for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.motion import AXIS_TOLERANCE, FASTEST, PATH_TOLERANCE, SPEED_TOLERANCE, Fill, Interpolation
from fiveaxis.toolpath import Constraints
from fiveaxis.verification.between import CheckedInterpolation
from fiveaxis.verification.check_context import Tolerances, make_context
from fiveaxis.verification.path_constraints import PathConstraints
from fiveaxis.verification.read_back import SAME_TIME, ExpectedText, ReadBack, check_text
from fiveaxis.verification.report import Report, Result
from fiveaxis.verification.verdict import Examination, examine

# rad: angles between two locations that keep their bounds may break them by this, as both ends turn.
LEAN_BETWEEN = math.radians(0.5)
JERK = "jerk, and acceleration in links"
NO_ACCELERATIONS = "acceleration: inserted locations cut moves into parts whose speeds don't tell it"
# rad: what rounding of rotary words may do to the tool's lean.
ROUNDED = math.radians(0.01)


def verify_text(
    back: ReadBack,
    fill: Fill,
    rows: IntArray,
    constraints: Constraints,
    *,
    surroundings: Surroundings,
    tolerances: Tolerances,
    expected: ExpectedText,
) -> Report:
    """Verify the motion that a program's text describes, at every location of the path and between them.

    Parameters
    ----------
    back : the text beside what was planned
    fill : the locations that its blocks stand for
    rows : (m,), the location of the fill that each planned row ends at
    constraints : on postures and turns; between two locations what they refer to turns evenly from the one
        to the other
    surroundings : part, stock and fixtures
    tolerances : from where on a difference is a finding
    expected : what the text must be like

    Raises
    ------
    SettingError, ToolpathError, MeshError, MissingDependency
        As `verify`.
    """
    machine, driven = back.machine, back.driven(fill)
    applied = PathConstraints.of(fill.given, machine, constraints).between(fill.row)
    exact = not fill.removed
    if fill.given.zone.offset:
        # Between two locations the path of a pivot beside the tool's axis isn't known, nor is a turn per mm.
        applied = replace(applied, turn_rate=None)
    elif applied.turn_rate is not None:
        # A move that keeps the rate as a whole may turn faster in the part of it that is nearest the singular
        # direction. In spans turns go with time, and lengths only as nearly as their blocks have one speed.
        faster = fill.planes.fastest(fill.row) * (1.0 if exact else 1.0 + SPEED_TOLERANCE)
        applied = replace(applied, turn_rate=applied.turn_rate * faster)
    more = (
        *check_text(back, rows, expected),
        _check_planes(fill, driven.positions[:, machine.rotary_columns]),
    )
    accelerations = fill.path is fill.given and exact
    context = make_context(driven, machine, fill.path, applied, allowed_between(tolerances, expected))
    # Rows stand so close that a straight tip and linear axes are the same move between them.
    interpolation = CheckedInterpolation(Interpolation.JOINT, Interpolation.JOINT)
    left = (JERK,) if accelerations else (JERK, NO_ACCELERATIONS)
    within = back.within(fill)
    return examine(
        Examination(context, surroundings, interpolation, accelerations, more=more, within=within), left
    )


def allowed_between(tolerances: Tolerances, expected: ExpectedText) -> Tolerances:
    """Give the tolerances for the blocks of a program, whose words are rounded.

    An inserted location lies on a chord of the path, and no deeper than a chord may; between two of them axes
    that run linearly leave the chord by what `fill_in` lets them, and so they do all along where `thinned`
    lets them.
    """
    deepest = tolerances.chord_allowance + PATH_TOLERANCE
    return replace(
        tolerances,
        # Where removed blocks let the tool go deeper at a location than it may, they are put back.
        location_allowance=2.0 * expected.step,
        row_allowance=deepest,
        chord_allowance=deepest,
        lean=max(tolerances.lean, ROUNDED + AXIS_TOLERANCE),
        lean_between=max(tolerances.lean, LEAN_BETWEEN),
        contact=max(tolerances.contact, PATH_TOLERANCE),
        deviation=PATH_TOLERANCE,
        length=max(tolerances.length, expected.step),
        angle=max(tolerances.angle, math.radians(expected.turn)),
        time=max(tolerances.time, SAME_TIME),
        # A move's both ends are rounded.
        step=2.0 * expected.step,
        turn=2.0 * math.radians(expected.turn),
    )


def _check_planes(fill: Fill, rotary: Array) -> Result:
    """Check that the tool axis stays in the plane of its directions at both ends of each cut."""
    off = fill.off_plane(rotary)
    moves = np.flatnonzero(fill.planes.left)
    degrees, most = np.degrees(off[moves]), math.degrees(AXIS_TOLERANCE)
    return Result(
        code="axis-off-plane",
        severity=Severity.WARNING,
        rows=np.searchsorted(fill.row, moves + 1.0),
        values=degrees,
        message=lambda i: (
            "within the cut the tool axis leaves the plane of its directions at both ends by "
            f"{degrees[i]:.3g} deg (at most {most:g} deg): in it a rotary axis would turn more than "
            f"{FASTEST:g} times as fast, or leave its bounds; put locations closer together"
        ),
        figures={"axis_off_plane_deg": math.degrees(off.max(initial=0.0))},
        checked=(f"tool axis within {most:g} deg of the plane of its directions at both ends of each cut",),
    )
