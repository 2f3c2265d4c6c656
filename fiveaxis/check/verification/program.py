"""The verification of programs: of our own, beside what was planned, and of any that is read."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from fiveaxis.base import JOB, Finding, Gap, Reading, Severity, ToolpathError, risk
from fiveaxis.cam import size_findings
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.verification.between import JOINT_ONLY, CheckedInterpolation
from fiveaxis.check.verification.check_context import CheckContext, PathConstraints, Tolerances, make_context
from fiveaxis.check.verification.checks import check_finite
from fiveaxis.check.verification.following import follow
from fiveaxis.check.verification.program_rows import Against, ProgramRows, check_program_feeds
from fiveaxis.check.verification.read_back import WrittenText, unsaid
from fiveaxis.check.verification.report import Report, make_report
from fiveaxis.check.verification.verdict import JERK, Examination, examine
from fiveaxis.model import SPEED_TOLERANCE, Constraints, Machine, Motion
from fiveaxis.nc import (
    Source,
    TracedProgram,
    load_program,
    load_source,
    set_up_as_stated,
    stated_height,
    trace_table,
)

# What no check covers: in our own programs, where moves were divided, and in any program.
NO_ACCELERATIONS = Gap(
    "acceleration: it doesn't follow from the speeds of moves divided by inserted locations"
)
NOT_CHECKED = (
    risk("the move to the first row: the program doesn't say where the axes stand before it"),
    Gap("acceleration and jerk; durations of rapid moves of axes without a known speed"),
)
UNPLACED = risk(
    "limits of linear axes, gouges and collisions in moves by axis words: the program doesn't say where they "
    "are on the machine",
    "zero (--zero)",
    JOB,
)
NO_TOOL = risk(
    "gouges and collisions: no tool was given, so only the path of its tip is checked", "tool (--tool)", JOB
)
NO_PATH = risk(
    "whether the program cuts what it should: no path was given to compare it with", "path (--path)", JOB
)


def verify_text(
    text: WrittenText, constraints: Constraints, *, surroundings: Surroundings, tolerances: Tolerances
) -> Report:
    """Verify the motion that a program's text describes, at every location of the path and between them.

    Parameters
    ----------
    text : with the planned motion, and the locations that its blocks stand for
    constraints : on postures and turns; between two locations their reference directions turn uniformly
    surroundings : part, stock and fixtures
    tolerances : bounds beyond which a difference is a finding

    Raises
    ------
    SettingError, ToolpathError, MeshError
        As `verify`.
    """
    back, fill, machine = text.back, text.fill, text.back.wording.machine
    exact = not fill.removed
    if fill.given.zone.offset:
        # Between two locations the path of a pivot off the tool's axis isn't known, and so no turn per mm.
        constraints = replace(constraints, turn_rate=None)
    elif constraints.turn_rate is not None:
        # A move that keeps the rate as a whole may turn faster in its part nearest the singular direction. In
        # spans turns are proportional to time, and lengths only as far as their blocks have one speed.
        faster = fill.planes.fastest(fill.row) * (1.0 if exact else 1.0 + SPEED_TOLERANCE)
        constraints = replace(constraints, turn_rate=constraints.turn_rate * faster)
    applied = PathConstraints.of(fill.given, machine, constraints).between(fill.row)
    accelerations = fill.path is fill.given and exact
    allowed = tolerances.of_text(back.step, math.radians(back.turn))
    context = make_context(text.motion(), machine, fill.path, applied, allowed)
    left = (JERK,) if accelerations else (JERK, NO_ACCELERATIONS)
    return examine(Examination(context, surroundings, JOINT_ONLY, accelerations, text=text), left)


def check_program(
    program: str | Path | Source, machine: Machine, against: Against, reading: Reading
) -> Report:
    """Check a program, with block delete off and on where that matters, or the table of a motion.

    Parameters
    ----------
    machine : the program's header may state where the workpiece stands (`set_up_as_stated`), and how high
        over the table (`stated_height`)
    against : path, tool, surroundings and constraints
    reading : how the program is read

    Raises
    ------
    FiveAxisError
        As `fiveaxis.verify_program`.
    """
    source = program if isinstance(program, Source) else load_source(program)
    machine, stands = set_up_as_stated(machine, source)
    around, height = against.surroundings or Surroundings(), stated_height(source)
    if around.above_table is None and height is not None:
        against = replace(against, surroundings=replace(around, above_table=height))

    def check(reading: Reading) -> Report:
        read = load_program(source, machine, against.cutter, reading)
        read = replace(read, motion=replace(read.motion, findings=(*read.motion.findings, *stands)))
        return check_read(read, machine, against.of_program(read.motion))

    report, skips = check(reading), reading.block_delete
    if "skipped-blocks" not in report.counts:
        return report
    try:
        other = check(replace(reading, block_delete=not skips))
    except ToolpathError:
        return report  # what can't be read in the other position is told
    known = {(f.code, f.place.line) for f in report.findings}
    own = [f for f in other.findings if (f.code, f.place.line) not in known and f.code != "skipped-blocks"]
    begin = f"with block delete {'off' if skips else 'on'}: "
    told = (replace(f, message=begin + f.message) for f in own if f.severity is not Severity.NOTE)
    return report.merge(Report.of_findings(told))


def check_read(read: TracedProgram, machine: Machine, against: Against) -> Report:
    """Check a program that was read as `check_program` does."""
    toolpath, around = against.zoned_path, against.surroundings or Surroundings()
    whole, read = read, read.placed()
    # A path that it follows, or leaves, shows where its zero is.
    placed = read.is_placed or toolpath is not None
    if toolpath is not None:
        read = replace(read, path=read.path.in_zone(toolpath.zone))
    context = _context(read, machine, against)
    match = None
    if toolpath is not None:
        match = follow(context, toolpath, tcp_height=read.tcp_height, by_direction=read.by_direction)
    rows = ProgramRows(read, against, match)
    lacking = ((against.cutter, NO_TOOL), (toolpath, NO_PATH))
    left = (*NOT_CHECKED, *(sentence for given, sentence in lacking if given is None))
    if read is not whole or not placed:
        left = (*left, UNPLACED)
    between = CheckedInterpolation.of_height(read.tcp_height)
    report = examine(Examination(context, around, between, rows=rows, placed=placed), left)
    told = Report.of_findings((*read.motion.findings, *_part_size(around, against)))
    return report.merge(told, *(() if against.program is None else (unsaid(read.motion.findings),)))


def check_motion_table(motion: Motion, machine: Machine, against: Against) -> Report:
    """Check the durations in the table of a motion against its own feeds, with the given cutter."""
    read = trace_table(motion, machine, against.cutter, "motion")
    context = _context(read, machine, against)
    results = (check_finite(context), *check_program_feeds(context, ProgramRows(read, against)))
    return make_report(results, read.path, ())


def _part_size(around: Surroundings, against: Against) -> tuple[Finding, ...]:
    """Tell a part whose size doesn't go with the cutter's."""
    if around.part is None or against.cutter is None:
        return ()
    diameter, unit = against.cutter.diameter, against.part_unit
    return size_findings(around.part.extents, unit=unit, diameter=diameter, name="part")


def _context(read: TracedProgram, machine: Machine, against: Against) -> CheckContext:
    # The path of a program's pivot over its blocks isn't the path's.
    turning = replace(against.constraints, tilt=None, cone=None, lead=None, lean=None, plane=None)
    turning = replace(turning, least_cutting_speed=None, turn_rate=None)
    if len(machine.rotaries) != 2:
        turning = replace(turning, singular_cone=None, singular_rate=0.0)
    applied = PathConstraints.of(read.path, machine, turning)
    return make_context(read.motion, machine, read.path, applied, against.tolerances.of_program())
