"""Programs and motion tables, verified: what runs on a machine, wherever it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import find_contacts
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.job.against import Against
from fiveaxis.job.checked_program import CheckedProgram, load_program
from fiveaxis.machine import Machine
from fiveaxis.motion import AXIS_TOLERANCE, PATH_TOLERANCE, Interpolation, Motion
from fiveaxis.nc.options import Wrap
from fiveaxis.toolpath import Constraints, Tool, Toolpath, interpolate
from fiveaxis.verification import (
    CheckedInterpolation,
    Examination,
    OwnRows,
    PathConstraints,
    Report,
    Tolerances,
    examine,
)
from fiveaxis.verification.check_context import (
    DEFAULT_TOLERANCES,
    GOUGE_TOLERANCE,
    CheckContext,
    make_context,
)
from fiveaxis.verification.checks import check_tilt
from fiveaxis.verification.following import Match, check_following
from fiveaxis.verification.program import ROUNDED
from fiveaxis.verification.report import PATH, Result
from fiveaxis.verification.turns import check_jumps, programmed_turns

if TYPE_CHECKING:
    import trimesh

# mm: gap between cutter and part that counts as touching.
SURFACE_TOLERANCE = 0.05
NOT_CHECKED = (
    "the way to the first row: where the axes stand before it isn't in the program",
    "acceleration and jerk; durations of rapid moves of axes without a known speed",
)
NO_TOOL = "gouges and collisions: no tool was given, so the way of its tip is checked and nothing beside it"
NO_PATH = "whether the program cuts what it should: no path to compare it with was given"


def verify_program(
    program: str | Path,
    machine: Machine,
    *,
    tool: Tool | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    toolpath: Toolpath | None = None,
    tilt: tuple[float, float] | None = None,
    cone: float | None = None,
    lead: tuple[float, float] | None = None,
    lean: tuple[float, float] | None = None,
    plane: tuple[float, float, float] | None = None,
    hold: Mapping[str, float] | None = None,
    max_turn: float | None = None,
    singular_cone: float | None = 5.0,
    singular_rate: float = 5.0,
    surface_tolerance: float = SURFACE_TOLERANCE,
    surroundings: Surroundings | None = None,
    unit: Literal["mm", "inch"] | None = None,
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
    gouge_tolerance: float = GOUGE_TOLERANCE,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> Report:
    """Check an NC program, or the table of a motion, against its machine; part and path are optional.

    Between two blocks all axes run linearly in time; moves under tool centre point control are first cut into
    the parts in which such axes keep the tip on its way. Between two rows of a motion's table the tool's
    centre goes straight. A program that doesn't say where the axes are is checked as a path of the tool,
    with the finding ``angles-assumed``.

    Parameters
    ----------
    program : in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : the cutter; that of `toolpath` by default. Without one only the tip is followed
    part : mesh of the finished part in mm, or its file: then gouges are looked for
    toolpath : that the program should follow: its tool's centre keeps to the path within
        `Tolerances.deviation` and comes by all of its locations in order
    tilt, lead, lean : degrees, about surface normals: those of `toolpath`, else they are found on the part
    cone : degrees, about the axes of `toolpath`
    plane : a vector at right angles to a plane that the tool axis stays in
    hold, max_turn, singular_cone, singular_rate : as for `verify`
    surface_tolerance : mm, gap between cutter and part that counts as touching
    surroundings : part, stock and fixtures that cutter, shank, holder and machine keep away from, in place of
        `part`
    unit, start, program_zero, rapid_mm_min, block_delete, wrap : as for `read_program`
    gouge_tolerance : mm, how deep the cutter may reach into the part; in all of a program 0.015 mm more is
        allowed, as its blocks are chords of the path, and keep to it within a tolerance of their own
    tolerances : from where on any other difference is a finding

    Returns
    -------
    Findings with file and line of the program: ``not-finite``, ``axis-limit``, ``held-axis``, ``tilt``,
    ``gouge``, ``…-collision``, ``off-path``, ``path-missed`` (errors), ``jump`` (an error, and a warning
    where the sweep was checked for gouges and nobody named a bound), ``feed-over``, ``singular-turn``,
    ``…-clearance``, ``tip-deviation`` (warnings: a control slows down, and what lies between a foreign
    program's blocks is its author's choice), and what reading it assumed.

    Raises
    ------
    FiveAxisError
        As `read_program`, `verify` and `find_contacts`; bounds that refer to what isn't given.
    """
    if (part is not None or surroundings is not None) and tool is None and toolpath is None:
        raise SettingError("a part is checked against a cutter; name the tool (--tool ball:10)")
    reading: dict[str, Any] = {"unit": unit, "start": start, "program_zero": program_zero}
    reading |= {"rapid_mm_min": rapid_mm_min, "block_delete": block_delete, "wrap": wrap}
    check = ProgramCheck(
        machine=machine,
        toolpath=toolpath,
        tool=tool or (None if toolpath is None else toolpath.tool),
        around=surroundings or Surroundings.load(part),
        constraints=Constraints.of_degrees(
            tilt=tilt,
            cone=cone,
            lead=lead,
            lean=lean,
            plane=plane,
            hold=hold,
            max_turn=max_turn,
            singular_cone=singular_cone,
            # The rate has a default, and means nothing without the cone.
            singular_rate=0.0 if singular_cone is None else singular_rate,
        ),
        tolerances=tolerances.with_gouge(gouge_tolerance),
        surface_tolerance=surface_tolerance,
    )
    return check.report(load_program(program, machine, check.tool, reading))


def check_program(
    program: str | Path,
    machine: Machine,
    against: Against,
    reading: Mapping[str, Any],
    surface_tolerance: float = SURFACE_TOLERANCE,
) -> Report:
    """Check a program or the table of a motion as `verify_program` does, with records made before.

    Parameters
    ----------
    against : path, tool, what stands around, constraints
    reading : keywords of `read_program`
    surface_tolerance : mm, gap between cutter and part that counts as touching

    Raises
    ------
    FiveAxisError
        As `verify_program`.
    """
    check = ProgramCheck.of(machine, against, surface_tolerance)
    return check.report(load_program(program, machine, check.tool, reading))


@dataclass(frozen=True, eq=False)
class ProgramCheck:
    """What a program of rows of its own is held against.

    Parameters
    ----------
    machine : on which it runs
    toolpath : that it should follow
    tool : None for its tip alone
    around : part, stock and fixtures
    constraints : on postures and turns
    tolerances : from where on a difference is a finding
    surface_tolerance : mm, gap between cutter and part that counts as touching
    """

    machine: Machine
    toolpath: Toolpath | None
    tool: Tool | None
    around: Surroundings
    constraints: Constraints
    tolerances: Tolerances = DEFAULT_TOLERANCES
    surface_tolerance: float = SURFACE_TOLERANCE

    @classmethod
    def of(
        cls, machine: Machine, against: Against, surface_tolerance: float = SURFACE_TOLERANCE
    ) -> ProgramCheck:
        """Take what a program is held against."""
        return cls(
            machine=machine,
            toolpath=against.toolpath,
            tool=against.cutter,
            around=against.surroundings or Surroundings(),
            constraints=against.constraints,
            tolerances=against.tolerances,
            surface_tolerance=surface_tolerance,
        )

    def report(self, read: CheckedProgram) -> Report:
        """Check a program that was read.

        Raises
        ------
        FiveAxisError
            As `verify_program`.
        """
        toolpath = None if self.toolpath is None else self.constraints.zoned(self.toolpath)
        if toolpath is not None:
            read = replace(read, path=read.path.in_zone(toolpath.zone))
        context = self._context(read)
        missed: tuple[Finding, ...] = ()
        match, following = None, None
        if toolpath is not None:
            following, missed, match = check_following(context, toolpath, tcp_height=read.tcp_height)
        own = OwnRows(
            following=following,
            lean=self._lean(context, toolpath, match),
            turns=_check_turns(context, toolpath, match, swept=self.around.part is not None),
            tcp_height=read.tcp_height,
            has_tool=self.tool is not None,
        )
        left = [
            *NOT_CHECKED,
            *((NO_TOOL,) if self.tool is None else ()),
            *((NO_PATH,) if toolpath is None else ()),
        ]
        joint = CheckedInterpolation(Interpolation.JOINT, Interpolation.JOINT)
        report = examine(Examination(context, self.around, joint, own=own), left)
        counts = {} if match is None else match.missed
        return report.merge(Report.of_findings(missed, PATH, counts), Report.of_findings(read.findings))

    def _context(self, read: CheckedProgram) -> CheckContext:
        # The path of a program's pivot over its blocks isn't the path's.
        turning = replace(self.constraints.of_turns, turn_rate=None)
        if len(self.machine.rotaries) != 2:
            turning = replace(turning, singular_cone=None, singular_rate=0.0)
        applied = PathConstraints.of(read.path, self.machine, turning)
        # Its rows aren't the locations: some lie on chords, some have no block, and words are rounded.
        more = self.tolerances.chord_allowance + PATH_TOLERANCE
        allowed = replace(
            self.tolerances,
            row_allowance=more,
            chord_allowance=more,
            lean=max(self.tolerances.lean, ROUNDED + AXIS_TOLERANCE),
        )
        return make_context(read.motion, self.machine, read.path, applied, allowed)

    def _lean(self, context: CheckContext, toolpath: Toolpath | None, match: Match | None) -> Result:
        """Check the tool's lean where directions that it refers to are known."""
        given = self.constraints
        if not given.bounds_lean:
            return check_tilt(context)
        rows = np.arange(len(context.positions))
        path, positions = context.toolpath, context.motion.positions
        if toolpath is not None and match is not None:
            known = np.flatnonzero(match.row >= 0)
            path, rows = toolpath.at(known), match.row[known]
            # A program needs no block at every location: the axes are on their way between two there.
            positions = interpolate(positions, match.place[known])
        elif given.cone is not None:
            raise SettingError("a cone stands about the axes of a path; give the path (--path)")
        elif any(bound is not None for bound in (given.tilt, given.lead, given.lean)):
            if self.around.part is None:
                raise SettingError(
                    "tilt refers to surface normals; give the part (--part) or the path (--path)"
                )
            path = find_contacts(path, self.around.part, tolerance=self.surface_tolerance)
        if len(rows) == 0:
            return check_tilt(context)
        if toolpath is None:
            path = given.zoned(path)
        applied = PathConstraints.of(path, context.machine, given.of_lean)
        if toolpath is None:
            # What lies off the part is a feed move all the same, and nobody knows its lean.
            path = replace(path, kind=context.toolpath.kind[rows])
        motion = context.motion
        columns = ("feed", "time", "kind", "source")
        some = Motion(motion.letters, positions, *(getattr(motion, name)[rows] for name in columns))
        result = check_tilt(make_context(some, context.machine, path, applied, context.tolerances))
        return replace(result, rows=rows[result.rows])


def _check_turns(
    context: CheckContext, toolpath: Toolpath | None, match: Match | None, *, swept: bool
) -> Result:
    """Check how far rotary axes turn in a cut; a bound that somebody names holds for whole blocks.

    What the program itself turns the tool by is no excuse there: only what a path turns it by is.
    """
    if context.constraints.max_turn is None:
        return _as_severe(check_jumps(context), Severity.WARNING if swept else Severity.ERROR)
    programmed = np.zeros(len(context.positions))
    if toolpath is not None and match is not None:
        known = np.flatnonzero(match.row >= 0)
        # A row before a location is on the way to it.
        following = np.searchsorted(match.row[known], np.arange(len(programmed)))
        turns = np.append(programmed_turns(toolpath)[known], 0.0)
        programmed = turns[following]
    return check_jumps(context, programmed, blocks=True)


def _as_severe(result: Result, severity: Severity) -> Result:
    return replace(result, severity=severity)
