"""Check an NC program, or the table of a motion, from any source against machine, part and path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import find_contacts
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import BoolArray, IntArray
from fiveaxis.job.program_options import ProgramOptions
from fiveaxis.job.traced_program import TracedProgram, load_program, trace_tool
from fiveaxis.machine import Machine
from fiveaxis.motion import AXIS_TOLERANCE, PATH_TOLERANCE, Interpolation, Motion
from fiveaxis.nc import Coordinates, ProgramSettings
from fiveaxis.nc.options import Positions, Wrap
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
from fiveaxis.verification.checks import check_finite, check_tilt
from fiveaxis.verification.feeds import check_feeds, check_feeds_along, check_stated_feeds
from fiveaxis.verification.following import Match, check_following, check_rapids
from fiveaxis.verification.outside import check_outside
from fiveaxis.verification.program import ROUNDED
from fiveaxis.verification.read_back import SAME_TIME, unsaid
from fiveaxis.verification.report import PATH, Result, left_out, make_report
from fiveaxis.verification.technology import check_feed_mode, check_technology
from fiveaxis.verification.turns import check_jumps, programmed_turns

if TYPE_CHECKING:
    import trimesh

# A row this near to a location, as a share of its move, ends there.
SAME_ROW = 1e-3
# mm: gap between cutter and part that counts as touching.
SURFACE_TOLERANCE = 0.05
NOT_CHECKED = (
    "the move to the first row: the program doesn't say where the axes stand before it",
    "acceleration and jerk; durations of rapid moves of axes without a known speed",
)
NO_TOOL = "gouges and collisions: no tool was given, so only the path of its tip is checked"
NO_PATH = "whether the program cuts what it should: no path was given to compare it with"


@dataclass(frozen=True, eq=False)
class Against:
    """What the program of a motion is verified against; with none of it there is nothing to verify.

    Parameters
    ----------
    toolpath : that the program should follow
    tool : the cutter; by default that of `toolpath`
    surroundings : part, stock and fixtures
    constraints : on postures and turns
    gouge_tolerance : mm, how deep the cutter may reach into the part
    program : control and settings of the program that was asked for: its spindle, tool, offsets, coolant
    """

    toolpath: Toolpath | None = None
    tool: Tool | None = None
    surroundings: Surroundings | None = None
    constraints: Constraints = field(default_factory=Constraints)
    gouge_tolerance: float = DEFAULT_TOLERANCES.gouge
    program: ProgramOptions | None = None

    @property
    def is_nothing(self) -> bool:
        """Whether there is nothing to verify against."""
        return self.toolpath is None and self.tool is None and self.surroundings is None

    @property
    def cutter(self) -> Tool | None:
        """The tool, or that of the path."""
        return self.tool or (None if self.toolpath is None else self.toolpath.tool)

    @property
    def zoned_path(self) -> Toolpath | None:
        """The path with the zone of the cutter that touches within the bounds on tilt, lead and lean."""
        return None if self.toolpath is None else self.constraints.zoned(self.toolpath)

    @property
    def tolerances(self) -> Tolerances:
        """The default tolerances, with this gouge tolerance."""
        return DEFAULT_TOLERANCES.with_gouge(self.gouge_tolerance)


NOTHING = Against()


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
    positions: Positions | None = None,
    harmless: Sequence[str] = (),
    gouge_tolerance: float = GOUGE_TOLERANCE,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    settings: ProgramSettings | None = None,
    control: str | Path = "linuxcnc",
) -> Report:
    """Check an NC program, or the table of a motion, against its machine; part and path are optional.

    Between two blocks all axes run linearly in time; moves under TCP are first split into parts in which such
    axes keep the tip on its path. Between two rows of a motion's table the tool's centre moves in a straight
    line. A program that doesn't state the axis values is checked as a path of the tool, with the finding
    ``angles-assumed``.

    Parameters
    ----------
    program : in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : the cutter; by default that of `toolpath`. Without a tool only the tip is followed
    part : mesh of the finished part in mm, or its file; checked for gouges
    toolpath : that the program should follow: its tool's centre keeps to the path within
        `Tolerances.deviation` and passes all of its locations in order
    tilt, lead, lean : degrees, relative to the surface normals of `toolpath`, or else to those of the part
    cone : degrees, about the axes of `toolpath`
    plane : a vector normal to a plane that the tool axis stays in
    hold, max_turn, singular_cone, singular_rate : as for `verify`
    surface_tolerance : mm, gap between cutter and part that counts as touching
    surroundings : part, stock and fixtures that cutter, shank, holder and machine keep clear of, in place of
        `part`
    unit, start, program_zero, rapid_mm_min, block_delete, wrap, positions, harmless : as for `read_program`
    gouge_tolerance : mm, how deep the cutter may reach into the part; anywhere in a program 0.015 mm more is
        allowed, since its blocks are chords of the path within a tolerance of their own
    tolerances : from where on any other difference is a finding
    settings : of the program that was asked for: spindle, tool, offsets and coolant have to be in force in
        every cut
    control : whose words the settings are, as for `compose_program`

    Returns
    -------
    Findings with file and line of the program: ``not-finite``, ``axis-limit``, ``held-axis``, ``tilt``,
    ``gouge``, ``…-collision``, ``off-path``, ``path-missed`` (errors), ``jump`` (an error; a warning where
    the swept cutter was checked for gouges and no bound was given), ``feed-over``, ``singular-turn``,
    ``…-clearance``, ``tip-deviation`` (warnings: a control slows down, and what lies between the blocks of
    somebody else's program is its author's choice), and what was assumed while reading it.

    Raises
    ------
    FiveAxisError
        As `read_program`, `verify` and `find_contacts`; bounds that refer to a path or part that isn't given.
    """
    if (part is not None or surroundings is not None) and tool is None and toolpath is None:
        raise SettingError("a part is checked against a cutter; name the tool (--tool ball:10)")
    reading: dict[str, Any] = {"unit": unit, "start": start, "program_zero": program_zero}
    reading |= {"rapid_mm_min": rapid_mm_min, "block_delete": block_delete, "wrap": wrap}
    reading |= {"positions": positions, "harmless": tuple(harmless)}
    constraints = Constraints.of_degrees(
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
    )
    program_asked = None if settings is None else ProgramOptions(control=control, settings=settings)
    around = surroundings or Surroundings.load(part)
    against = Against(toolpath, tool, around, constraints, program=program_asked)
    check = ProgramCheck(machine, against, tolerances.with_gouge(gouge_tolerance), surface_tolerance)
    return check.report(load_program(program, machine, against.cutter, reading))


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
    against : path, tool, surroundings and constraints
    reading : keywords of `read_program`
    surface_tolerance : mm, gap between cutter and part that counts as touching

    Raises
    ------
    FiveAxisError
        As `verify_program`.
    """
    check = ProgramCheck(machine, against, against.tolerances, surface_tolerance)
    return check.report(load_program(program, machine, against.cutter, reading))


@dataclass(frozen=True, eq=False)
class ProgramCheck:
    """The check of a program whose rows aren't the locations of a path.

    Parameters
    ----------
    machine : on which it runs
    against : path, tool, surroundings and constraints
    tolerances : from where on a difference is a finding
    surface_tolerance : mm, gap between cutter and part that counts as touching
    """

    machine: Machine
    against: Against
    tolerances: Tolerances
    surface_tolerance: float = SURFACE_TOLERANCE

    def report(self, read: TracedProgram) -> Report:
        """Check a program that was read.

        Raises
        ------
        FiveAxisError
            As `verify_program`.
        """
        toolpath, around = self.against.zoned_path, self.against.surroundings or Surroundings()
        if toolpath is not None:
            read = replace(read, path=read.path.in_zone(toolpath.zone))
        context = self._context(read)
        missed: tuple[Finding, ...] = ()
        match, following = None, None
        if toolpath is not None:
            following, missed, match = check_following(context, toolpath, tcp_height=read.tcp_height)
        has_tool = self.against.cutter is not None
        cuts = self._cuts(context, toolpath, match)
        own = OwnRows(
            following=following,
            lean=self._lean(context, toolpath, match, around),
            turns=_check_turns(context, toolpath, match, swept=around.part is not None),
            feeds=self._feeds(context, read, toolpath, match),
            technology=(
                *self._rapids(context, toolpath, match),
                *self._stated_feeds(context, read, toolpath, match),
                *self._technology(read, cuts),
            ),
            tcp_height=read.tcp_height,
            has_tool=has_tool,
        )
        left = [*NOT_CHECKED, *(() if has_tool else (NO_TOOL,)), *((NO_PATH,) if toolpath is None else ())]
        joint = CheckedInterpolation(Interpolation.JOINT, Interpolation.JOINT)
        outside = [] if toolpath is None or match is None else self._outside(context, toolpath, match, read)
        if self.against.program is not None:
            outside = [*outside, unsaid(read.findings)]
        report = examine(Examination(context, around, joint, own=own), left)
        counts = {} if match is None else match.missed
        return report.merge(
            Report.of_findings(missed, PATH, counts), Report.of_findings(read.findings), *outside
        )

    def _context(self, read: TracedProgram) -> CheckContext:
        # The path of a program's pivot over its blocks isn't the path's.
        turning = replace(self.against.constraints.of_turns, turn_rate=None)
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
            time=max(self.tolerances.time, SAME_TIME),
        )
        return make_context(read.motion, self.machine, read.path, applied, allowed)

    def _feeds_of_table(self, context: CheckContext, read: TracedProgram) -> Result:
        """Check the durations in the table of a motion against its own feeds."""
        if read.is_table and self.against.cutter is not None and not context.toolpath.zone.offset:
            return check_feeds(context)
        return left_out("feed-differs", {"feed_off_share": None}, "feed: no path was given")

    def _feeds(
        self, context: CheckContext, read: TracedProgram, toolpath: Toolpath | None, match: Match | None
    ) -> Result:
        if toolpath is None or match is None:
            return self._feeds_of_table(context, read)
        known = np.flatnonzero(match.row >= 0)
        place = match.place[known]
        positions = interpolate(context.positions, place)
        knows = not read.by_control
        return check_feeds_along(context, toolpath, known, place, positions, knows_axes=knows)

    @staticmethod
    def _rapids(context: CheckContext, toolpath: Toolpath | None, match: Match | None) -> tuple[Result, ...]:
        if toolpath is None or match is None:
            return ()
        return (check_rapids(context, toolpath, match),)

    def _outside(
        self, context: CheckContext, toolpath: Toolpath, match: Match, read: TracedProgram
    ) -> list[Report]:
        """Check the moves before the first location of the path and after the last."""
        passed = match.row[match.row >= 0]
        if not len(passed):
            return []
        sides = (np.arange(passed[0] + 1), -1), (np.arange(passed[-1], len(context.positions)), 0)
        found = (
            check_outside(context, toolpath, rows, end=end, tcp_height=read.tcp_height) for rows, end in sides
        )
        return [report for report in found if report is not None]

    def _cuts(self, context: CheckContext, toolpath: Toolpath | None, match: Match | None) -> IntArray:
        """Return the rows of the program that cut: those of the path, or all at feed."""
        rows = np.flatnonzero(context.toolpath.cutting)
        if toolpath is None or match is None or not (match.row >= 0).any():
            return rows
        known = np.flatnonzero(match.row >= 0)
        first, last = match.row[known[0]], match.row[known[-1]]
        number = np.searchsorted(match.place[known], rows - SAME_ROW)
        cutting = toolpath.cutting[known[np.clip(number, 0, len(known) - 1)]]
        return rows[(rows >= first) & (rows <= last) & cutting]

    @staticmethod
    def _stated_feeds(
        context: CheckContext, read: TracedProgram, toolpath: Toolpath | None, match: Match | None
    ) -> tuple[Result, ...]:
        """Compare the feeds that a table or a list of locations states with those of the path."""
        if toolpath is None or match is None or toolpath.feed_is_assumed or read.technology is not None:
            return ()
        return (check_stated_feeds(context, toolpath, match.place),)

    def report_table(self, motion: Motion) -> Report:
        """Check the durations in the table of a motion against its own feeds, with the given cutter."""
        path = trace_tool(motion, self.machine, self.against.cutter, "motion")
        none = np.zeros(len(motion), dtype=bool)
        read = TracedProgram(motion, path, (), none, None, straight=True)
        context = self._context(read)
        return make_report((check_finite(context), self._feeds_of_table(context, read)), path, ())

    def _technology(self, read: TracedProgram, cuts: IntArray) -> tuple[Result, ...]:
        if read.technology is None:
            return ()
        mode: Coordinates = "vector" if read.by_control else "tip" if read.tcp.any() else "axes"
        asked = None if self.against.program is None else self.against.program.asked(self.machine, mode)
        track = read.technology.at(cuts)
        more = check_feed_mode(track, cuts, asked) if read.by_control else ()
        return (*check_technology(track, cuts, asked), *more, _check_switched(read.tcp, cuts))

    def _lean(
        self, context: CheckContext, toolpath: Toolpath | None, match: Match | None, around: Surroundings
    ) -> Result:
        """Check the tool's lean where the directions that it refers to are known."""
        given = self.against.constraints
        if not given.bounds_lean:
            return check_tilt(context)
        rows = np.arange(len(context.positions))
        path, positions = context.toolpath, context.motion.positions
        if toolpath is not None and match is not None:
            known = np.flatnonzero(match.row >= 0)
            if not len(known):
                none = dict.fromkeys(("tilt_min_deg", "tilt_max_deg"))
                return left_out("tilt", none, "lean: the program passes no location of the path")
            path, rows = toolpath.at(known), match.row[known]
            # A program needs no block at every location; between blocks the axes are interpolated.
            positions = interpolate(positions, match.place[known])
        elif given.cone is not None:
            raise SettingError("a cone stands about the axes of a path; give the path (--path)")
        elif any(bound is not None for bound in (given.tilt, given.lead, given.lean)):
            if around.part is None:
                raise SettingError(
                    "tilt refers to surface normals; give the part (--part) or the path (--path)"
                )
            path = find_contacts(path, around.part, tolerance=self.surface_tolerance)
        if len(rows) == 0:
            return check_tilt(context)
        if toolpath is None:
            path = given.zoned(path)
        applied = PathConstraints.of(path, context.machine, given.of_lean)
        if toolpath is None:
            # Off the part a move is a feed move all the same, but without a normal its lean isn't known.
            path = replace(path, kind=context.toolpath.kind[rows])
        motion = context.motion
        columns = ("feed", "time", "kind", "source")
        some = Motion(motion.letters, positions, *(getattr(motion, name)[rows] for name in columns))
        result = check_tilt(make_context(some, context.machine, path, applied, context.tolerances))
        return replace(result, rows=rows[result.rows])


def _check_switched(tcp: BoolArray, cuts: IntArray) -> Result:
    """Check that TCP is neither switched on nor off between the cuts."""
    bad = cuts[tcp[cuts] != tcp[cuts[:1]]] if len(cuts) else cuts
    return Result(
        code="tcp-state",
        severity=Severity.ERROR,
        rows=bad,
        values=np.full(len(bad), np.nan),
        message=lambda _: "TCP is switched between the cuts of the path; switch it before them",
        figures={},
        checked=("TCP isn't switched between the cuts",),
    )


def _check_turns(
    context: CheckContext, toolpath: Toolpath | None, match: Match | None, *, swept: bool
) -> Result:
    """Check how far rotary axes turn in a cut; a given bound applies to whole blocks.

    Turns that the path itself prescribes are allowed beyond the bound; turns of the program alone aren't.
    """
    if context.constraints.max_turn is None:
        return replace(check_jumps(context), severity=Severity.WARNING if swept else Severity.ERROR)
    programmed = np.zeros(len(context.positions))
    if toolpath is not None and match is not None:
        known = np.flatnonzero(match.row >= 0)
        # A row before a location belongs to the move to it.
        following = np.searchsorted(match.row[known], np.arange(len(programmed)))
        turns = np.append(programmed_turns(toolpath)[known], 0.0)
        programmed = turns[following]
    return check_jumps(context, programmed, blocks=True)
