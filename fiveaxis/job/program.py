"""From postures to a program: planned, written, read back, verified, and released or kept back."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.errors import FiveAxisError, MissingDependency, ToolpathError, Unverified
from fiveaxis.files import write_atomically
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import IntArray
from fiveaxis.job.planned_program import PlannedProgram, may_thin, plan_program
from fiveaxis.job.program_options import ProgramOptions
from fiveaxis.job.release import Gate, not_verified
from fiveaxis.job.traced_program import load_text
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    Fill,
    Motion,
    PredictedTime,
    ProgramMotion,
    predicted_time,
)
from fiveaxis.nc import NOT_VERIFIED, Program, ProgramSettings, compose_program, require_motion
from fiveaxis.nc.kinds import require_program_suffix
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.words import control_values
from fiveaxis.nc.writing.framing import AskedTechnology, Frame
from fiveaxis.nc.writing.wording import Wording
from fiveaxis.report.facts import ProgramFigures
from fiveaxis.toolpath import Constraints, Toolpath
from fiveaxis.verification import (
    DEFAULT_TOLERANCES,
    ExpectedText,
    ReadBack,
    Report,
    Tolerances,
    verify_text,
)

logger = logging.getLogger(__name__)

# mm: a motion whose tool passes a location of a path at a larger distance belongs to another path.
BELONGS = 0.05
# Verifies a text beside the motion that it was written for; its reports are merged to one.
Verdict = Callable[[ReadBack, Program], Sequence[Report]]
# Findings of the writer where the control's F can't express a block's duration. As the inverse of the time it
# can, even where the control won't run that slowly.
COARSE = {"feed-floor": ("per_minute",), "feed-rounded": ("per_minute", "inverse_time")}


@dataclass(frozen=True, eq=False)
class MadeProgram:
    """A program that was planned, written, read back and, if there is something to verify against, verified.

    Parameters
    ----------
    machine : on which it runs
    text : its blocks, with the verdict in the header
    motion : its moves
    gate : the report on the text, and which errors keep the program back
    run_time : how long the control takes for it, from the first move whose start the text states
    fill : the locations that the path's blocks stand for; None for a motion without a path
    held_back : codes of the errors because of which redundant blocks stay; empty where they are removed
    """

    machine: Machine
    text: Program
    motion: ProgramMotion
    gate: Gate
    run_time: PredictedTime
    fill: Fill | None = None
    held_back: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<MadeProgram: {self.text!r} on {self.machine.name}, {self.report!r}>"

    @property
    def report(self) -> Report:
        """What verification found in the program's text."""
        return self.gate.report

    @property
    def ok(self) -> bool:
        """Whether the text was verified, and has no error."""
        return self.gate.verified and self.report.ok

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was assumed while writing, if no report lists it, and accepted codes that didn't occur."""
        return (*(() if self.gate.verified else self.text.findings), *self.gate.unused)

    def line_of(self, block: int) -> int | None:
        """Return the line of the text, from 1, that moves to a row of `ProgramMotion.blocks`, if one does."""
        row = self.motion.first + block
        return self.text.rows.index(row) + 1 if row in self.text.rows else None

    @property
    def figures(self) -> ProgramFigures | None:
        """The figures for a report; None for a motion without a path."""
        if (fill := self.fill) is None:
            return None
        return ProgramFigures(
            control=self.text.control,
            coordinates=self.text.coordinates,
            language=self.text.language,
            preparation=self.text.preparation,
            blocks=len(self.motion.blocks),
            lines=len(self.text.lines),
            blocks_before=fill.given.count_given,
            inserted=len(fill.path) - fill.given.count_given,
            removed=fill.removed,
            axis_held_in_plane=int(fill.planes.kept.sum()),
            axis_left_plane=int(fill.planes.left.sum()),
            redundant_kept_for=self.held_back,
            interpolation=str(self.motion.interpolation),
            run_time=self.run_time,
            path_tolerance_mm=PATH_TOLERANCE,
            axis_tolerance_deg=round(math.degrees(AXIS_TOLERANCE), 9),
        )

    def write(self, path: str | Path, *, unverified: bool = False) -> Path:
        """Write the file, whole or not at all.

        Parameters
        ----------
        unverified : whether an unverified program may be written; its header says so

        Raises
        ------
        Unverified
            The report has an error that isn't accepted, or there is no report.
        SettingError
            The file can't be written, or it has the suffix of no program.
        """
        require_program_suffix(path, self.text.suffix)
        self.gate.require_open(unverified=unverified)
        return write_atomically(path, self.text.text)


def make_program(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    constraints: Constraints,
    options: ProgramOptions,
    *,
    around: Surroundings | None = None,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    verdict: Verdict | None = None,
    unverified: bool = False,
) -> MadeProgram:
    """Make the program of a motion along a path, and verify its text.

    Redundant blocks are removed if the text without them has no errors.

    Parameters
    ----------
    motion, toolpath : n locations and the axes there
    constraints : on postures and turns, in cuts also between locations
    around : part, stock and fixtures
    tolerances : from where on a difference is a finding
    verdict : further checks of the text
    unverified : whether nothing is verified, since the path is only the motion's own

    Raises
    ------
    FiveAxisError
        As `compose_program`; a path that isn't the motion's, or a text that can't be read back.
    """
    wording = options.wording(machine)
    require_motion(motion, machine)
    require_path(motion, machine, toolpath)
    around = around or Surroundings()
    # Errors of planning keep the program back too.
    before = Report.of_findings(f for f in toolpath.findings if f.severity is Severity.ERROR)
    whole = plan_program(motion, toolpath, constraints, around, wording, options.settings, tolerances)

    def attempt(planned: PlannedProgram) -> MadeProgram:
        def judge(back: ReadBack, draft: Program) -> Sequence[Report]:
            expected = expected_text(draft, wording, options.settings)
            found = verify_text(
                back,
                planned.fill,
                planned.path_rows,
                constraints,
                surroundings=around,
                tolerances=tolerances,
                expected=expected,
            )
            written = Report.of_findings(planned.located(draft.findings))
            return (
                found,
                planned.leads.report,
                written,
                before,
                *(() if verdict is None else verdict(back, draft)),
            )

        made = compose_verified(planned.motion, wording, options, None if unverified else judge)
        return replace(made, fill=planned.fill)

    if not (options.writing["thin"] and may_thin(wording)):
        return attempt(whole)
    few = whole.without_redundant(constraints, wording)
    made = attempt(few)
    errors = {f.code for f in made.report.findings if f.severity is Severity.ERROR} - set(before.counts)
    if (made.gate.verified and not errors) or unverified or not few.fill.removed:
        return made
    return replace(attempt(whole), held_back=tuple(made.report.counts))


def require_path(motion: Motion, machine: Machine, toolpath: Toolpath) -> None:
    """Raise unless a motion follows a path.

    Raises
    ------
    ToolpathError
        Another number of locations, or a tool that misses them.
    """
    if len(motion) != len(toolpath):
        raise ToolpathError(
            f"the path has {len(toolpath)} locations and the motion {len(motion)}, so it belongs to another "
            "path; give the path that it was made for",
            file=toolpath.name,
        )
    tip, axis = tool_poses(machine, motion.positions)
    reached = toolpath.zone.pivot_of_tip(tip, toolpath.normal, axis)
    off = np.nan_to_num(np.linalg.norm(reached - toolpath.pivot, axis=1))
    row = int(np.argmax(off))
    if off[row] > BELONGS:
        raise ToolpathError(
            f"the motion has the tool {off[row]:.4g} mm from location {toolpath.numbered[row]} of this path "
            f"(at most {BELONGS:g} mm): it belongs to another path, tool, machine or work offset; give those "
            "that it was made for",
            file=toolpath.name,
            line=toolpath.place(row).line,
        )


def compose_verified(
    motion: ProgramMotion,
    wording: Wording,
    options: ProgramOptions,
    verdict: Verdict | None,
) -> MadeProgram:
    """Write a program's motion, read the text back, verify it, and put the verdict into its header.

    Parameters
    ----------
    verdict : verifies the text; None where there is nothing to verify it against

    Raises
    ------
    FiveAxisError
        As `compose_program` and `read_back`.
    """
    machine = wording.machine

    def compose(notes: Sequence[tuple[str, str]]) -> Program:
        return compose_program(
            motion,
            machine=machine,
            control=options.writing["control"],
            coordinates=options.writing["coordinates"],
            header=options.header,
            winding=options.writing["winding"],
            settings=options.settings,
            verdict=notes,
            # A verdict lists all positions beyond an axis's travel; without one the first is an error.
            beyond=verdict is not None,
        )

    def run_time(back: ReadBack) -> PredictedTime:
        return predicted_time(back.read, machine, wording.dialect, wording.coordinates)

    draft = compose(NOT_VERIFIED)
    back = read_back(draft, motion, wording, options.settings)
    if verdict is None:
        return MadeProgram(machine, draft, motion, Gate.unverified(), run_time(back))
    try:
        found, *more = verdict(back, draft)
    except MissingDependency as fault:
        found, more = not_verified(fault), []
    gate = Gate.of(found.merge(*more, back.unsaid()), options.writing["override"])
    text = compose(gate.notes)
    # The header is comments only; make sure that the rest reads the same.
    again = read_back(text, motion, wording, options.settings)
    if not (
        np.array_equal(again.read.positions, back.read.positions)
        and np.array_equal(again.read.time, back.read.time)
    ):
        raise Unverified("the program reads differently with its header than without; please report this", [])
    logger.info("%s: %d rows, %d lines", text.control, len(motion), len(text.lines))
    return MadeProgram(machine, text, motion, gate, run_time(back))


def read_back(text: Program, planned: ProgramMotion, wording: Wording, settings: ProgramSettings) -> ReadBack:
    """Read a program's text back, beside the motion and the settings that it was written for.

    Raises
    ------
    Unverified
        The text can't be read back, so it can't be verified.
    """
    machine = wording.machine
    begin = planned.motion.positions[:1]
    try:
        read = load_text(text, machine, _start(begin, wording), begin)
    except FiveAxisError as fault:
        raise Unverified(
            f"the text of the program can't be read back, so it can't be verified and isn't written: {fault}",
            [],
        ) from None
    owner = _owners(text, read.motion.source, planned)
    return ReadBack(
        machine,
        planned,
        read.motion,
        read.tcp,
        read.technology,
        owner,
        _unplanned(text, read.motion.source, owner, wording, settings),
        by_angle=not read.by_control,
        assumed=read.findings,
    )


def _owners(text: Program, lines: IntArray, planned: ProgramMotion) -> IntArray:
    """Find the planned row that each row of the text belongs to, (n,)."""
    rows = np.array(text.rows)
    if (rows >= 0).any():
        return np.asarray(rows[lines - 1])
    # A list of locations has one row per location.
    if len(lines) != len(planned) - planned.first:
        raise Unverified(
            f"the list that was written has {len(lines)} locations, and {len(planned) - planned.first} were "
            "planned; please report this",
            [],
        )
    return np.arange(len(lines)) + planned.first


def _unplanned(
    text: Program, lines: IntArray, owner: IntArray, wording: Wording, settings: ProgramSettings
) -> IntArray:
    """Find the rows of moves that are neither planned nor part of the program's end, (u,)."""
    ending = tuple(Frame(wording, settings, "unwound").end())
    silent = np.flatnonzero(owner < 0)
    silent = silent[silent > np.argmax(owner >= 0)]
    strange = [not text.lines[line - 1].endswith(ending) for line in lines[silent].tolist()]
    return np.asarray(silent[np.array(strange, dtype=bool)])


def _start(begin: np.ndarray, wording: Wording) -> dict[str, float]:
    """Return where Z stands before the approach, in the control's sign and unit."""
    machine = wording.machine
    if wording.coordinates != "axes" or "Z" not in machine.letters:
        return {}
    column = machine.column("Z")
    return {"Z": float(control_values(machine, begin)[0, column])}


def expected_text(text: Program, wording: Wording, settings: ProgramSettings) -> ExpectedText:
    """Return what is expected of a text beside its positions: decimals, spindle, tool, offsets, coolant."""
    number, unit = wording.dialect.number, MILLIMETRES[wording.unit]
    return ExpectedText(
        step=10.0 ** -(number.linear + (wording.unit == "inch")) * unit,
        turn=10.0**-number.rotary,
        coarse=any(wording.mode.feed in COARSE.get(finding.code, ()) for finding in text.findings),
        asked=AskedTechnology.of(wording, settings),
        is_list=wording.dialect.language != "blocks",
    )
