"""What the checks look at: the motion with its path, and the tool poses."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import GOUGE_TOLERANCE, Array, BoolArray, SettingError, ToolpathError
from fiveaxis.check.verification.course import Course
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.model import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    Constraints,
    Interpolation,
    Machine,
    Motion,
    TiltBounds,
    Toolpath,
    turned,
)

# mm: allowed distance of a curve from its chords, in a path and in the mesh of its part.
CHORD_ERROR = 0.01
# rad: effect of the rounding of rotary words on the tool's lean.
ROUNDED = math.radians(0.01)
# rad: allowed overrun of tilt bounds between two locations that keep them.
LEAN_BETWEEN = math.radians(0.5)
# Allowed relative difference of a block's duration from the planned one, from the decimals of F.
SAME_TIME = 0.01
# Interpolations in reports.
WORDING = {
    Interpolation.JOINT: "all axes linear in time",
    Interpolation.TCP: "the tool centre point straight",
}


@dataclass(frozen=True)
class Tolerances:
    """Bounds beyond which a difference is a finding; smaller differences are rounding.

    Parameters
    ----------
    length : mm, overrun of a linear axis's limits
    angle : rad, overrun of a rotary axis's limits, and of bounds on its angle and its turns
    lean : rad, overrun of the tilt bounds at a location
    lean_between : rad, the same between two locations
    contact : mm, distance of the reached ball centre, or contact, from that of the path
    jump : rad, the largest turn of a rotary axis in one cutting block if no constraint gives one
    least_turn : rad, allowed turn of a rotary axis in any cutting block, however short
    deviation : mm, of the ball centre from the chord in a block that moves all axes linearly
    time : relative, of a block's duration against the axes' highest speeds
    acceleration : relative, of a change of speed against the axes' highest accelerations
    step, turn : mm and rad, by which the rounding of words changes the moves of axes
    gouge : mm, the gouge tolerance: allowed depth of the cutter in the part at a location
    location_allowance : mm, added at locations of the path, for rounding
    row_allowance : mm, added at rows that lie on chords of the path between locations
    chord_allowance : mm, added within a move, which is the chord of a curve

    Raises
    ------
    SettingError
        A gouge tolerance that isn't a finite number above 0.
    """

    length: float = 1e-6
    angle: float = math.radians(1e-6)
    lean: float = math.radians(1e-6)
    lean_between: float = math.radians(1e-6)
    contact: float = 1e-6
    jump: float = math.radians(45.0)
    least_turn: float = math.radians(0.01)
    deviation: float = 0.01
    time: float = 1e-6
    acceleration: float = 1e-3
    step: float = 0.0
    turn: float = 0.0
    gouge: float = GOUGE_TOLERANCE
    location_allowance: float = 0.0
    row_allowance: float = 0.0
    chord_allowance: float = CHORD_ERROR

    def __post_init__(self) -> None:
        if not (math.isfinite(self.gouge) and self.gouge > 0.0):
            raise SettingError(f"gouge_tolerance is {self.gouge:g} mm; it must be a finite number above 0 mm")

    @property
    def location_gouge(self) -> float:
        """Allowed depth of the cutter in the part at a location, mm."""
        return self.gouge + self.location_allowance

    @property
    def row_gouge(self) -> float:
        """Allowed depth at a row, mm."""
        return self.gouge + self.row_allowance

    @property
    def chord_gouge(self) -> float:
        """Allowed depth within a move, mm: by default `CHORD_ERROR` more than at a location."""
        return self.gouge + self.chord_allowance

    def with_gouge(self, depth: float) -> Tolerances:
        """Return these tolerances with another gouge tolerance, mm; the allowances stay.

        `SettingError` for a depth that isn't finite and above 0, or if a gouge tolerance was set before.
        """
        if depth != self.gouge and self.gouge != GOUGE_TOLERANCE:
            raise SettingError(
                f"gouge_tolerance is {depth:g} mm and tolerances.gouge {self.gouge:g} mm; give one of them"
            )
        return replace(self, gouge=depth)

    def of_blocks(self) -> Tolerances:
        """Return the tolerances for the moves of a program, which may leave a chord of the path a little."""
        deepest = self.chord_allowance + PATH_TOLERANCE
        return replace(self, row_allowance=deepest, chord_allowance=deepest)

    def of_program(self) -> Tolerances:
        """Return the tolerances for any program: rows may lie on chords, and words are rounded."""
        return replace(
            self.of_blocks(), lean=max(self.lean, ROUNDED + AXIS_TOLERANCE), time=max(self.time, SAME_TIME)
        )

    def of_text(self, step: float, turn: float) -> Tolerances:
        """Return the tolerances for a program of our own, in which every location of the path has its place.

        An inserted location lies on a chord of the path, no deeper than a chord may be. Between two of them
        linear axes leave the chord by the tolerance of `fill_in`, and anywhere by that of `thinned`. The last
        decimal of linear and of rotary words is a step, mm, and a turn, rad.
        """
        return replace(
            self.of_program(),
            # Removed blocks are restored if the tool would otherwise go deeper at a location than allowed.
            location_allowance=2.0 * step,
            lean_between=max(self.lean, LEAN_BETWEEN),
            contact=max(self.contact, PATH_TOLERANCE),
            deviation=PATH_TOLERANCE,
            length=max(self.length, step),
            angle=max(self.angle, turn),
            # Both ends of a move are rounded.
            step=2.0 * step,
            turn=2.0 * turn,
        )


DEFAULT_TOLERANCES = Tolerances()


@dataclass(frozen=True, eq=False)
class PathConstraints:
    """Bounds on postures and turns, applied to a path; None or empty is no bound.

    Parameters
    ----------
    given : on rotary axes
    leaning : on the angles between the tool axis and directions
    cutting : (n,), whether the move to a location cuts: only there the lean between locations is bounded;
        None if all do
    inserted : (n,), locations inserted between the given ones; None if there are none
    passed : (n,), inserted locations whose posture wasn't optimised but follows from the axes' motion; None
        if there are none
    """

    given: Constraints = field(default_factory=Constraints)
    leaning: TiltBounds | None = None
    cutting: BoolArray | None = None
    inserted: BoolArray | None = None
    passed: BoolArray | None = None

    @classmethod
    def of(cls, toolpath: Toolpath, machine: Machine, constraints: Constraints) -> PathConstraints:
        """Apply constraints to a path in their zone (`Constraints.zoned`).

        Raises
        ------
        SettingError
            A held axis that the machine hasn't got; a plane without another bound on the lean.
        ToolpathError
            A path without the direction that a bound refers to.
        """
        foreign = sorted(set(constraints.hold) - set(machine.rotaries))
        if foreign:
            raise SettingError(
                f"{', '.join(foreign)} can't be held: the rotary axes of {machine.name} are "
                f"{', '.join(machine.rotaries)}; write for example C=30"
            )
        return cls(
            given=constraints,
            leaning=constraints.lean_bounds(toolpath) if constraints.bounds_lean else None,
            cutting=toolpath.cutting,
            inserted=toolpath.inserted if toolpath.inserted.any() else None,
        )

    def between(self, row: Array) -> PathConstraints:
        """Return the bounds for a path with inserted locations, by their fractional rows of this path, (m,).

        The direction that a bound refers to (a normal, a programmed axis) turns uniformly from one location
        to the next: the row 3.25 lies between 3 and 4. Within a link or a rapid move there is no bound.
        """
        passed: BoolArray = row != np.floor(row)
        inserted = passed
        if self.inserted is not None:
            inserted = inserted | self.inserted[np.floor(row).astype(np.int64)]
        cutting = None if self.cutting is None else self.cutting[np.ceil(row).astype(np.int64)]
        spread = replace(self, cutting=cutting, inserted=inserted, passed=passed)
        if self.leaning is None:
            return spread
        every = [replace(b, reference=turned(b.reference, row), beside=()) for b in self.leaning.all]
        leaning = replace(every[0], beside=tuple(every[1:]))
        if cutting is not None:
            leaning = leaning.only(cutting | (row == np.floor(row)))
        return replace(spread, leaning=leaning)


@dataclass(frozen=True, eq=False)
class CheckContext:
    """A motion to be checked.

    Parameters
    ----------
    motion, machine, toolpath : the motion, and what it is checked against
    positions : (n, k), mm and rad; rows with a value that isn't finite are NaN throughout
    tip, axis : (n, 3), mm and unit vectors, workpiece frame: the tool poses by `tool_poses`
    constraints : bounds on postures and turns
    tolerances : bounds beyond which a difference is a finding
    """

    motion: Motion
    machine: Machine
    toolpath: Toolpath
    positions: Array
    tip: Array
    axis: Array
    constraints: PathConstraints
    tolerances: Tolerances

    @property
    def centre(self) -> Array:
        """The tool's centre (`Toolpath.centres`) by the axis values, (n, 3) mm, workpiece frame."""
        return self.tip + self.toolpath.zone.height * self.axis

    @cached_property
    def course(self) -> Course:
        """Where the path lets the pivot be between its given locations."""
        return Course.of(self.toolpath)

    @property
    def steps(self) -> Array:
        """Size of each axis's move to the row, (n, k) mm and rad; 0 at the first row, NaN if unknown."""
        return np.abs(np.diff(self.positions, axis=0, prepend=self.positions[:1]))

    @property
    def cutting(self) -> BoolArray:
        """Whether the move that ends at the row cuts, (n,); the first row has no move."""
        cuts: BoolArray = self.toolpath.cutting & (np.arange(len(self.toolpath)) > 0)
        return cuts


def make_context(
    motion: Motion, machine: Machine, toolpath: Toolpath, constraints: PathConstraints, tolerances: Tolerances
) -> CheckContext:
    """Combine a motion with its path and compute its tool poses.

    The kinds of moves are taken from the path, never from the motion: a motion can't exempt a cut by calling
    it a link.

    Raises
    ------
    SettingError
        Axes of another machine, or arrays of the motion that don't match each other.
    ToolpathError
        Another number of locations than the path.
    """
    _require_fit(motion, machine, toolpath)
    finite = np.isfinite(motion.positions).all(axis=1, keepdims=True)
    positions = np.where(finite, motion.positions, np.nan)
    tip, axis = tool_poses(machine, positions)
    return CheckContext(motion, machine, toolpath, positions, tip, axis, constraints, tolerances)


def _require_fit(motion: Motion, machine: Machine, toolpath: Toolpath) -> None:
    if motion.letters != machine.letters:
        raise SettingError(
            f"the motion has the axes {', '.join(motion.letters)}, machine {machine.name!r} has "
            f"{', '.join(machine.letters)}; verify it with the machine it was made for"
        )
    shape = (len(motion), len(machine.axes))
    if motion.positions.shape != shape or motion.time.shape != shape[:1]:
        raise SettingError(
            f"the motion's axis values have shape {motion.positions.shape} and its times "
            f"{motion.time.shape}; {shape} and {shape[:1]} are needed"
        )
    if len(motion) != len(toolpath):
        raise ToolpathError(
            f"has {len(toolpath)} locations, the motion has {len(motion)}; verify a motion with its own path",
            file=toolpath.name,
        )
