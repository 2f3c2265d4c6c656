"""The check of a program whose rows aren't the locations of a path, and what it is checked against."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import find_contacts
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import BoolArray, IntArray
from fiveaxis.job.program_options import ProgramOptions
from fiveaxis.job.traced_program import TracedProgram, trace_tool
from fiveaxis.machine import Machine
from fiveaxis.mesh import Unit, mesh_size, size_findings
from fiveaxis.motion import AXIS_TOLERANCE, PATH_TOLERANCE, Coordinates, Interpolation, Motion
from fiveaxis.options import CREASE, SURFACE_TOLERANCE
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

# A row this near to a location, as a share of its move, ends there.
SAME_ROW = 1e-3
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
    crease : deg; facets of the part that meet at a smaller angle are one smooth surface
    part_unit : of the part's file, for the finding on its size
    """

    toolpath: Toolpath | None = None
    tool: Tool | None = None
    surroundings: Surroundings | None = None
    constraints: Constraints = field(default_factory=Constraints)
    gouge_tolerance: float = DEFAULT_TOLERANCES.gouge
    program: ProgramOptions | None = None
    crease: float = CREASE
    part_unit: Unit = "mm"

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
        match, following = None, None  # without a path
        if toolpath is not None:
            following, missed, match = check_following(context, toolpath, tcp_height=read.tcp_height)
        has_tool = self.against.cutter is not None
        cuts = _cuts(context, match)
        own = OwnRows(
            following=following,
            lean=self._lean(context, match, around),
            turns=_check_turns(context, match, swept=around.part is not None),
            feeds=self._feeds(context, read, match),
            technology=(
                *(() if match is None else (check_rapids(context, match),)),
                *_stated_feeds(context, read, match),
                *self._technology(read, cuts),
            ),
            tcp_height=read.tcp_height,
            has_tool=has_tool,
        )
        left = [*NOT_CHECKED, *(() if has_tool else (NO_TOOL,)), *((NO_PATH,) if match is None else ())]
        joint = CheckedInterpolation(Interpolation.JOINT, Interpolation.JOINT)
        outside = [] if match is None else _outside(context, match, read.tcp_height)
        if self.against.program is not None:
            outside = [*outside, unsaid(read.findings)]
        report = examine(Examination(context, around, joint, own=own), left)
        counts = {} if match is None else match.missed
        read_findings = (*read.findings, *self._part_size(around))
        return report.merge(
            Report.of_findings(missed, PATH, counts), Report.of_findings(read_findings), *outside
        )

    def _part_size(self, around: Surroundings) -> tuple[Finding, ...]:
        cutter = self.against.cutter
        if around.part is None or cutter is None:
            return ()
        size, unit = mesh_size(around.part), self.against.part_unit
        return size_findings(size, unit=unit, diameter=cutter.diameter, name="part")

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

    def _feeds(self, context: CheckContext, read: TracedProgram, match: Match | None) -> Result:
        if match is None:
            return self._feeds_of_table(context, read)
        known = match.passed
        place = match.place[known]
        positions = interpolate(context.positions, place)
        knows = not read.by_control
        return check_feeds_along(context, match.path, known, place, positions, knows_axes=knows)

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

    def _lean(self, context: CheckContext, match: Match | None, around: Surroundings) -> Result:
        """Check the tool's lean where the directions that it refers to are known."""
        given = self.against.constraints
        if not given.bounds_lean:
            return check_tilt(context)
        rows = np.arange(len(context.positions))
        path, positions = context.toolpath, context.motion.positions
        if match is not None:
            known = match.passed
            if not len(known):
                none = dict.fromkeys(("tilt_min_deg", "tilt_max_deg"))
                return left_out("tilt", none, "lean: the program passes no location of the path")
            path, rows = match.path.at(known), match.row[known]
            # A program needs no block at every location; between blocks the axes are interpolated.
            positions = interpolate(positions, match.place[known])
        elif given.cone is not None:
            raise SettingError("a cone stands about the axes of a path; give the path (--path)")
        elif any(bound is not None for bound in (given.tilt, given.lead, given.lean)):
            if around.part is None:
                raise SettingError(
                    "tilt refers to surface normals; give the part (--part) or the path (--path)"
                )
            crease = self.against.crease
            path = find_contacts(path, around.part, tolerance=self.surface_tolerance, crease=crease)
        if len(rows) == 0:
            return check_tilt(context)
        if match is None:
            path = given.zoned(path)
        applied = PathConstraints.of(path, context.machine, given.of_lean)
        if match is None:
            # Off the part a move is a feed move all the same, but without a normal its lean isn't known.
            path = replace(path, kind=context.toolpath.kind[rows])
        motion = context.motion
        columns = ("feed", "time", "kind", "source")
        some = Motion(motion.letters, positions, *(getattr(motion, name)[rows] for name in columns))
        result = check_tilt(make_context(some, context.machine, path, applied, context.tolerances))
        return replace(result, rows=rows[result.rows])


def _outside(context: CheckContext, match: Match, tcp_height: float | None) -> list[Report]:
    """Check the moves before the first location of the path and after the last."""
    passed = match.row[match.passed]
    if not len(passed):
        return []
    sides = (np.arange(passed[0] + 1), -1), (np.arange(passed[-1], len(context.positions)), 0)
    found = (check_outside(context, match.path, rows, end=end, tcp_height=tcp_height) for rows, end in sides)
    return [report for report in found if report is not None]


def _cuts(context: CheckContext, match: Match | None) -> IntArray:
    """Return the rows of the program that cut: those of the path, or all at feed."""
    rows = np.flatnonzero(context.toolpath.cutting)
    if match is None or not len(known := match.passed):
        return rows
    first, last = match.row[known[0]], match.row[known[-1]]
    number = np.searchsorted(match.place[known], rows - SAME_ROW)
    cutting = match.path.cutting[known[np.clip(number, 0, len(known) - 1)]]
    return rows[(rows >= first) & (rows <= last) & cutting]


def _stated_feeds(context: CheckContext, read: TracedProgram, match: Match | None) -> tuple[Result, ...]:
    """Compare the feeds that a table or a list of locations states with those of the path."""
    if match is None or match.path.feed_is_assumed or read.technology is not None:
        return ()
    return (check_stated_feeds(context, match.path, match.place),)


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


def _check_turns(context: CheckContext, match: Match | None, *, swept: bool) -> Result:
    """Check how far rotary axes turn in a cut; a given bound applies to whole blocks.

    Turns that the path itself prescribes are allowed beyond the bound; turns of the program alone aren't.
    """
    if context.constraints.max_turn is None:
        return replace(check_jumps(context), severity=Severity.WARNING if swept else Severity.ERROR)
    programmed = np.zeros(len(context.positions))
    if match is not None:
        known = match.passed
        # A row before a location belongs to the move to it.
        following = np.searchsorted(match.row[known], np.arange(len(programmed)))
        turns = np.append(programmed_turns(match.path)[known], 0.0)
        programmed = turns[following]
    return check_jumps(context, programmed, blocks=True)
