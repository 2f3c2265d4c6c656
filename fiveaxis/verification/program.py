"""The verification of our own programs: the text, against the path that it was made for."""

from __future__ import annotations

import math
from dataclasses import replace

from fiveaxis.collision import Surroundings
from fiveaxis.geometry import IntArray
from fiveaxis.motion import AXIS_TOLERANCE, PATH_TOLERANCE, SPEED_TOLERANCE, Fill
from fiveaxis.toolpath import Constraints
from fiveaxis.verification.between import JOINT_ONLY
from fiveaxis.verification.check_context import PathConstraints, Tolerances, make_context
from fiveaxis.verification.read_back import SAME_TIME, ExpectedText, ReadBack, WrittenText
from fiveaxis.verification.report import Report
from fiveaxis.verification.verdict import Examination, examine

# rad: allowed overrun of tilt bounds between two locations that keep them.
LEAN_BETWEEN = math.radians(0.5)
JERK = "jerk, and acceleration in links"
NO_ACCELERATIONS = "acceleration: it doesn't follow from the speeds of moves divided by inserted locations"
# rad: effect of the rounding of rotary words on the tool's lean.
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
    back : the text with the planned motion
    fill : the locations that its blocks represent
    rows : (m,), the location of the fill at which each planned row ends
    constraints : on postures and turns; between two locations their reference directions turn uniformly
    surroundings : part, stock and fixtures
    tolerances : bounds beyond which a difference is a finding
    expected : properties that the text must have

    Raises
    ------
    SettingError, ToolpathError, MeshError, MissingDependency
        As `verify`.
    """
    machine, driven = back.machine, back.driven(fill)
    applied = PathConstraints.of(fill.given, machine, constraints).between(fill.row)
    exact = not fill.removed
    if fill.given.zone.offset:
        # Between two locations the path of a pivot off the tool's axis isn't known, and so no turn per mm.
        applied = replace(applied, turn_rate=None)
    elif applied.turn_rate is not None:
        # A move that keeps the rate as a whole may turn faster in its part nearest the singular direction. In
        # spans turns are proportional to time, and lengths only as far as their blocks have one speed.
        faster = fill.planes.fastest(fill.row) * (1.0 if exact else 1.0 + SPEED_TOLERANCE)
        applied = replace(applied, turn_rate=applied.turn_rate * faster)
    accelerations = fill.path is fill.given and exact
    context = make_context(driven, machine, fill.path, applied, allowed_between(tolerances, expected))
    left = (JERK,) if accelerations else (JERK, NO_ACCELERATIONS)
    text = WrittenText(back, fill, rows, expected)
    return examine(Examination(context, surroundings, JOINT_ONLY, accelerations, text=text), left)


def allowed_between(tolerances: Tolerances, expected: ExpectedText) -> Tolerances:
    """Return the tolerances for the blocks of a program, whose words are rounded.

    An inserted location lies on a chord of the path, no deeper than a chord may be. Between two of them
    linear axes leave the chord by the tolerance of `fill_in`, and anywhere by that of `thinned`.
    """
    deepest = tolerances.chord_allowance + PATH_TOLERANCE
    return replace(
        tolerances,
        # Removed blocks are restored if the tool would otherwise go deeper at a location than allowed.
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
        # Both ends of a move are rounded.
        step=2.0 * expected.step,
        turn=2.0 * math.radians(expected.turn),
    )
