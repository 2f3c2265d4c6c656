"""From postures to a program: planned, written, read back, verified, and released or kept back."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import Array, Finding, IntArray, Severity, ToolpathError, Unverified, write_atomically
from fiveaxis.check import (
    DEFAULT_TOLERANCES,
    Gate,
    ReadBack,
    Report,
    Surroundings,
    Tolerances,
    WrittenText,
    unsaid,
    verify_text,
)
from fiveaxis.job.planned_program import PlannedProgram, may_thin, plan_program
from fiveaxis.lab import Engaged, price_program, word_rounding
from fiveaxis.model import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    Constraints,
    Energy,
    Fill,
    Machine,
    Motion,
    PredictedTime,
    ProgramMotion,
    Toolpath,
    predicted_time,
    require_along,
)
from fiveaxis.nc import (
    NOT_VERIFIED,
    Program,
    ProgramOptions,
    Source,
    WordWriter,
    compose_program,
    require_motion,
    require_program_suffix,
)
from fiveaxis.show import ProgramFigures

logger = logging.getLogger(__name__)

# Verifies a text beside the motion that it was written for; its reports are merged to one.
Verdict = Callable[[ReadBack, Program], Sequence[Report]]


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
    blocks : those of the path as the text states them, one a row; of an operation that was revised in place
        all of its moves, with the control's times
    rounding : mm, travel of a linear axis in a block that the rounding of the words may cause
    energy : of the text, approach and retract included, as `program_energy` gives it; None where its words
        don't say it (tool directions, a list, a rapid move of unknown speed, a drive without power)
    ends : (b,), row of the verified motion at which each of `blocks` ends; None where nothing was verified
    fill : the locations that the path's blocks stand for; None for a motion without a path
    spent : (n,), J, energy so far at each location of the path; None where `blocks` say it
    held_back : codes of the errors because of which redundant blocks stay; empty where they are removed
    """

    machine: Machine
    text: Program
    motion: ProgramMotion
    gate: Gate
    run_time: PredictedTime
    blocks: Motion
    rounding: float
    energy: Energy | None = None
    ends: IntArray | None = None
    fill: Fill | None = None
    spent: Array | None = None
    held_back: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, text: Program, planned: ProgramMotion, read: Motion, wording: WordWriter, **known: Any
    ) -> MadeProgram:
        """Make the record of a text that was planned, and read: how long it takes, and its rounding."""
        lines = [line for line, row in zip(text.lines, text.rows, strict=True) if row >= 0]
        taken = predicted_time(read, wording.machine, wording.dialect, wording.coordinates)
        rounding = word_rounding(read, lines)
        return cls(wording.machine, text, planned, run_time=taken, rounding=rounding, **known)

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
    def engaged(self) -> Engaged | None:
        """What each of `blocks` takes away of the stock; None if none was cut."""
        if self.report.cut is None or self.ends is None:
            return None
        removal = self.report.cut.removal
        return Engaged.of_rows(removal.volume.mean(axis=0), removal.contact, self.ends)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was assumed while writing, if no report lists it, and accepted codes that didn't occur."""
        return (*(() if self.gate.verified else self.text.findings), *self.gate.unused)

    def line_of(self, block: int) -> int | None:
        """Return the line of the text, from 1, that moves to a row of `blocks`, if one does."""
        if self.text.revises:
            return int(self.blocks.source[block])
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
            energy=self.energy,
            path_tolerance_mm=PATH_TOLERANCE,
            axis_tolerance_deg=round(math.degrees(AXIS_TOLERANCE), 9),
            revises=self.text.revises,
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
        return write_atomically(path, self.text.text if self.text.data is None else self.text.data)


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
    """Make the program of a motion along a path, (n,) both, and verify its text by a further verdict, too.

    Redundant blocks are removed if the text without them has no errors. `unverified`: nothing is verified,
    since the path is only the motion's own.

    Raises
    ------
    FiveAxisError
        As `compose_program`; a path that isn't the motion's, or a text that can't be read back.
    """
    wording = options.wording(machine)
    require_motion(motion, machine)
    require_along(motion, machine, toolpath)
    around = around or Surroundings()
    # Errors of planning keep the program back too.
    before = Report.of_findings(f for f in toolpath.findings if f.severity is Severity.ERROR)
    whole = plan_program(motion, toolpath, constraints, around, wording, options.settings, tolerances)

    def attempt(planned: PlannedProgram) -> MadeProgram:
        def judge(back: ReadBack, draft: Program) -> Sequence[Report]:
            text = WrittenText(back, planned.fill)
            found = verify_text(text, constraints, surroundings=around, tolerances=tolerances)
            written = Report.of_findings(planned.located(draft.findings))
            return (
                found,
                planned.leads.report,
                written,
                before,
                *(() if verdict is None else verdict(back, draft)),
            )

        made = compose_verified(planned.motion, wording, options, None if unverified else judge)
        # Verified are the locations that the planned rows stand for.
        ends = None if made.ends is None else planned.fill.rows_in(made.motion)[made.ends]
        return replace(made, fill=planned.fill, ends=ends)

    if not (options.thin and may_thin(wording)):
        return attempt(whole)
    few = whole.without_redundant(constraints, wording)
    made = attempt(few)
    errors = {f.code for f in made.report.findings if f.severity is Severity.ERROR} - set(before.counts)
    if (made.gate.verified and not errors) or unverified or not few.fill.removed:
        return made
    return replace(attempt(whole), held_back=tuple(made.report.counts))


def compose_verified(
    motion: ProgramMotion, wording: WordWriter, options: ProgramOptions, verdict: Verdict | None
) -> MadeProgram:
    """Write a program's motion, read the text back, verify it, and put the verdict into its header.

    Without a verdict there is nothing to verify it against. Raises as `compose_program` and `ReadBack.of`.
    """
    machine = wording.machine

    def compose(notes: Sequence[tuple[str, str]]) -> Program:
        return compose_program(
            motion,
            machine=machine,
            control=options.control,
            coordinates=options.coordinates,
            header=options.header,
            winding=options.winding,
            settings=options.settings,
            verdict=notes,
            # A verdict lists all positions beyond an axis's travel; without one the first is an error.
            beyond=verdict is not None,
        )

    draft = compose(NOT_VERIFIED)
    back = ReadBack.of(draft, motion, wording, options.settings)
    made = MadeProgram.of(
        *(draft, motion, back.motion, wording),
        gate=Gate.unverified(),
        blocks=back.blocks,
        energy=_text_energy(back, draft),
    )
    note = (
        ""
        if made.energy is None
        else f"{made.energy.total:.0f} J of the feed drives in {made.energy.time:.1f} s"
    )
    priced = (("energy", f"{note}, by the words as written"),) if note else ()
    if verdict is None:
        return replace(made, text=compose((*priced, *NOT_VERIFIED)))
    found, *more = verdict(back, draft)
    gate = Gate.of(found.merge(*more, unsaid(back.read.motion.findings)), options.override)
    text = compose((*priced, *gate.notes))
    # The header is comments only; make sure that the rest reads the same.
    again = ReadBack.of(text, motion, wording, options.settings).motion
    if not (
        np.array_equal(again.positions, back.motion.positions)
        and np.array_equal(again.time, back.motion.time)
    ):
        raise Unverified("the program reads differently with its header than without; please report this", [])
    logger.info("%s: %d rows, %d lines", text.control, len(motion), len(text.lines))
    return replace(made, text=text, gate=gate, ends=back.block_rows)


def _text_energy(back: ReadBack, text: Program) -> Energy | None:
    """Price a text as `program_energy` does its file; None where its words don't say what it costs."""
    machine = back.wording.machine
    if back.is_list or back.read.by_control or not machine.has_powers:
        return None
    try:
        return price_program(Source(f"program{text.suffix}", list(text.lines)), machine).energy
    except ToolpathError:  # a rapid move whose speed nobody states
        return None
