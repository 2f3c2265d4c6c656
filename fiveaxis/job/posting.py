"""Write a motion, or a program of another control, for a control; verified like the program of a solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.base import Finding, Reading, ToolpathError, Writing, keywords_of
from fiveaxis.check import (
    NOTHING,
    Against,
    Gate,
    ReadBack,
    Report,
    check_motion_table,
    check_read,
    check_text,
    make_report,
    require_report,
)
from fiveaxis.job.program import MadeProgram, Verdict, compose_verified, make_program
from fiveaxis.model import (
    Constraints,
    Interpolation,
    Machine,
    Motion,
    ProgramMotion,
    located,
    require_stated,
    respaced,
)
from fiveaxis.nc import (
    Program,
    ProgramOptions,
    ProgramSettings,
    ReadMotion,
    control_for,
    find_dialect,
    load_program,
    load_source,
    load_text,
    require_motion,
    set_up_as_stated,
    stated_settings,
    trace_tool,
    with_feeds_of,
    with_stated,
)
from fiveaxis.show import describe_input


@dataclass(frozen=True, eq=False)
class Posted:
    """A program that was made of a motion or of another program.

    Parameters
    ----------
    motion : that was read
    made : the new program, and what verification found in its text
    path : its file; None where none was written
    told : on a setup that the program's header states, and on what it states that isn't kept
    """

    motion: ReadMotion
    made: MadeProgram
    path: Path | None
    told: tuple[Finding, ...] = ()

    @property
    def program(self) -> Program:
        """The program's text."""
        return self.made.text

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was assumed or left out while reading and writing."""
        return (*self.motion.findings, *self.told, *self.made.findings)


@dataclass(frozen=True, kw_only=True, eq=False)
class Posting(Reading, Writing):
    """All that `post_program` takes as keywords: how a program is read, and how the new one is written."""

    output: str | Path | None = None
    against: Against = NOTHING
    settings: ProgramSettings | None = None
    unverified: bool = False


@keywords_of(Posting)
def post_program(
    source: str | Path,
    machine: Machine,
    given: Posting,
) -> Posted:
    """Read a motion and write it for a control, as a solution becomes a program.

    A list of cutter locations, or a program with tool directions, keeps its postures; the tip moves straight
    between them, and the new program is verified against that path where `against` has no other.

    Parameters
    ----------
    source : a program in any language that `read_program` knows, a list of cutter locations, or a table as
        `write_motion` writes it
    machine : on which it runs
    output : the new program's file; by default none is written
    against : path, tool, part and constraints that the new program's text is verified against. Where a
        motion's table has a row for each location of the path, blocks are inserted and removed as for a
        solution
    settings : of the new program: tool, spindle, coolant, work offset and so on
    unverified : whether a program may be written that there is nothing to verify against; its header says so

    Raises
    ------
    Unverified
        The text has an error that isn't accepted; or nothing to verify it against was given.
    FiveAxisError
        As `read_motion`, `read_program` and `compose_program`; a move between cuts whose way isn't known; a
        file that can't be written.
    """
    source = Path(source)
    described = describe_input(source)
    text = load_source(source)
    machine, told = set_up_as_stated(machine, text)
    against, output = given.against, given.output
    read = load_program(text, machine, against.cutter, given)
    motion = _of_known_ways(read.motion)
    against = against if against.is_nothing else against.of_program(motion)
    header = {"source": f"{described['name']} sha256 {described['sha256'][:16]}"}
    settings = given.settings or ProgramSettings()
    if (operation := motion.operation) is not None:
        if operation.kind == "drilling":
            raise ToolpathError(
                f"drilling ({operation}) isn't posted: pecks and dwells of its cycles aren't in the motion; "
                "post it from the CAM system",
                file=source,
                line=operation.first_line,
            )
        dialect = find_dialect(control_for(machine, given.control))
        stated, lost = stated_settings(operation, dialect, settings, motion.name)
        settings, told = with_stated(settings, stated), (*told, *lost)
    options = ProgramOptions.of(given, settings=settings, header=header).on(machine)
    options = options.named(source.stem) if output is None else options.for_file(output)
    if read.by_control and against.toolpath is None:
        against = replace(against, toolpath=read.path)
    rows: Motion = motion
    if read.straight:
        rows = motion.at(np.arange(len(motion)))
    try:
        made = make_of_motion(rows, machine, options, against)
    except ToolpathError as fault:  # its line is one of the source
        if fault.file is not None:
            raise
        raise ToolpathError(fault.message, file=source, line=fault.line) from None
    path = None if output is None else made.write(output, unverified=given.unverified)
    return Posted(motion, made, path, told)


def _of_known_ways(motion: ReadMotion) -> ReadMotion:
    """Leave out the rows from which the approach, and to which the retract, goes where nobody knows.

    `ToolpathError` if that is a move between the cuts.
    """
    lost, cuts = np.flatnonzero(motion.from_unknown), np.flatnonzero(motion.cutting)
    if not len(lost) or not len(cuts):
        return motion
    begin = int(max(lost[lost < cuts[0]], default=0))
    end = int(min(lost[lost > cuts[-1]], default=len(motion)))
    within = lost[((lost > begin) & (lost < end)) | ((lost == 0) & motion.cutting[0])]
    if len(within):
        raise ToolpathError(
            f"{len(within)} moves between cuts, the first here, start at positions that the program doesn't "
            "give, so where the tool would pass isn't known, and no program is written; set zero (--zero) or "
            "start (--start)",
            file=motion.name,
            line=int(motion.source[within[0]]),
        )
    return motion.part(slice(begin, end))


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionWriting(ProgramOptions):
    """All that `write_program` takes as keywords."""

    against: Against = NOTHING
    report: Report | None = None
    unverified: bool = False


@keywords_of(MotionWriting)
def write_program(
    motion: Motion,
    path: str | Path,
    machine: Machine,
    given: MotionWriting,
) -> Path:
    """Write a motion as an NC program; the file appears whole or not at all.

    The program's text is read back and verified before it is written. A solution brings what it is verified
    against: `Solution.write`.

    Parameters
    ----------
    motion : the motion
    path : the program's file
    machine : whose axes the motion has
    against : path, tool, part and constraints that the program's text is verified against
    settings : tool, spindle, coolant, work offset and so on
    header : name and value of further comments
    report : of `verify`, on the motion; its errors count beside those of the text
    unverified : whether a motion that there is nothing to verify against may be written; the header says so

    Returns
    -------
    `path`

    Raises
    ------
    Unverified
        The text has an error that isn't accepted; or nothing to verify it against was given.
    SettingError
        A report about another motion; a file that can't be written.
    FiveAxisError
        As `compose_program`.
    """
    options = ProgramOptions.of(given).on(machine).for_file(path)
    made = make_of_motion(motion, machine, options, given.against)
    if given.report is not None:
        require_report(given.report, motion, machine)
        Gate.of(given.report, options.override).require_open()
    return made.write(path, unverified=given.unverified)


def make_of_motion(
    motion: Motion, machine: Machine, options: ProgramOptions, against: Against = NOTHING
) -> MadeProgram:
    """Make the program of a motion, verified as far as there is something to verify it against.

    A motion with a row for each location of a path becomes a program as a solution does. Between the rows of
    any other table the tool's centre moves in a straight line (the tip, without a tool); between the blocks
    of a program that was read all axes run linearly.

    Raises
    ------
    MachineError
        A figure isn't stated on which the words of the program depend.
    FiveAxisError
        As `make_program`; a path that the motion doesn't follow.
    """
    require_motion(motion, machine)
    if isinstance(motion, ReadMotion):
        return _make_of_program(motion, machine, options, against)
    require_stated(machine, options.wording(machine).coordinates, motion.positions)
    path = against.zoned_path
    path = path if path is None else located(path, motion)
    if path is not None and len(path) == len(motion):
        along = replace(motion, kind=path.kind, feed=path.feed)
        return make_program(
            along,
            machine,
            path,
            against.constraints,
            options,
            around=against.surroundings,
            tolerances=against.tolerances,
        )
    by_tip = options.wording(machine).interpolation is Interpolation.TCP
    traced = trace_tool(motion, machine, against.cutter, "motion")
    own = with_feeds_of(motion, traced, machine, by_tip=by_tip)
    return make_program(
        motion,
        machine,
        own,
        Constraints(),
        options,
        around=against.surroundings,
        tolerances=against.tolerances,
        verdict=None if against.is_nothing else _verdict_of(against, machine, motion),
        unverified=against.is_nothing,
    )


def _make_of_program(
    motion: ReadMotion, machine: Machine, options: ProgramOptions, against: Against
) -> MadeProgram:
    """Make a program of the motion of another one; it ends where that one ends."""
    wording = options.wording(machine)
    by_tip = wording.coordinates != "axes"
    # Positions of axes become others of the same axes; a tip becomes them, or they a tip, by the pivots.
    if bool(motion.tcp.any()) is not by_tip:
        require_stated(machine, "axes", motion.positions)
    blocks = respaced(motion, machine) if wording.interpolation is Interpolation.TCP else motion
    planned = ProgramMotion.around(
        blocks, machine, wording.interpolation, lead_out=np.zeros(len(motion.letters))
    )
    if against.is_nothing:
        return compose_verified(planned, wording, options, None)
    check = _verdict_of(replace(against, program=options), machine)

    def verdict(back: ReadBack, draft: Program) -> Sequence[Report]:
        path = trace_tool(back.motion, machine, against.cutter, "program")
        return make_report(check_text(back, back.end), path, ()), *check(back, draft)

    return compose_verified(planned, wording, options, verdict)


def _verdict_of(against: Against, machine: Machine, table: Motion | None = None) -> Verdict:
    """Return the function that checks a text as `verify_program` does a file, and the table it is from."""

    def verdict(back: ReadBack, draft: Program) -> Sequence[Report]:
        read = load_text(draft, machine, {}, back.planned.motion.positions[:1], against.cutter)
        # The report it is merged with is about the same motion, in other rows.
        found = replace(check_read(read, machine, against), about=None)
        return (found,) if table is None else (found, check_motion_table(table, machine, against))

    return verdict
