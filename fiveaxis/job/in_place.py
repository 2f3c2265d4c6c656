"""An operation of a program with other postures, in its own lines: revised, read back, verified, priced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.errors import JobError, ToolpathError
from fiveaxis.geometry import Array
from fiveaxis.job.description import Job
from fiveaxis.job.loading import operation_text
from fiveaxis.job.program import MadeProgram
from fiveaxis.job.program_costs import price_program, word_rounding
from fiveaxis.job.release import Gate
from fiveaxis.job.solution import Solution
from fiveaxis.kinematics import tool_poses
from fiveaxis.machine import Machine
from fiveaxis.machine.unknown import require_stated
from fiveaxis.motion import (
    Coordinates,
    Fill,
    Filling,
    Interpolation,
    ProgramMotion,
    block_times,
    follow,
    predicted_time,
)
from fiveaxis.motion.program_motion import Phase
from fiveaxis.nc import DIALECTS, Program, require_program
from fiveaxis.nc.formats import suffix_of
from fiveaxis.nc.operation_text import OperationText
from fiveaxis.nc.revision import Placement, Revision
from fiveaxis.nc.source import with_lines
from fiveaxis.nc.traced_program import load_program
from fiveaxis.nc.writing.start_and_end import NO_ROW
from fiveaxis.nc.writing.word_writer import WordWriter
from fiveaxis.posture.solution import AS_PROGRAMMED, Baseline, blocks_energy
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import Against, ReadBack, check_read

# Rounding of a location's number.
SAME_ROW = 1e-9


@dataclass(frozen=True, eq=False)
class RevisedOperation:
    """An operation of a job's program that is revised in its own lines.

    Parameters
    ----------
    text : its rows beside the program's text
    path : its cuts, whose postures are revised
    wording : the control, and whether its words are the tip's or the axes'
    reading : how the program is read
    """

    text: OperationText
    path: Toolpath
    wording: WordWriter
    reading: Mapping[str, Any]

    @classmethod
    def of(cls, job: Job, toolpath: Toolpath, machine: Machine) -> RevisedOperation:
        """Find the cuts of a job's operation in its program's text.

        Parameters
        ----------
        toolpath : cuts of the operation, as the job reads them
        machine : the job's, as it is set up

        Raises
        ------
        FiveAxisError
            As `OperationText.of`.
        """
        text = operation_text(job, toolpath.tool)
        operation = text.operation
        # Words of axes alone don't tell an ISO control.
        control = operation.control or job.stated_control
        if control is None:
            raise JobError(
                "the program's words don't tell its control; state it in the machine's file (control), or "
                f"name the control of a new program (--control): {', '.join(DIALECTS)}",
                file=job.input,
                line=operation.first_line,
            )
        if operation.control and control not in DIALECTS:
            raise JobError(
                f"the program is one of {control!r}, whose words aren't revised; name the control of a new "
                f"program (--control): {', '.join(DIALECTS)}",
                file=job.input,
            )
        coordinates: Coordinates = "vector" if text.by_direction else "tip" if operation.tcp else "axes"
        wording = require_program(machine, control, coordinates)
        require_stated(machine, coordinates)
        return cls(text, toolpath, wording, job.reading)

    def make(self, solution: Solution, job: Job) -> tuple[MadeProgram, Revision]:
        """Write a solution's postures into the operation, and verify and price the text.

        Raises
        ------
        FiveAxisError
            As `OperationText.revise` and `OperationText.require_same_around`.
        """
        machine = solution.machine
        filling = Filling.of(solution.constraints, self.wording.interpolation)
        fill = filling.fill(solution.toolpath, machine, solution.motion)
        at = _rows(solution, fill.row)
        if not np.array_equal(at[at == np.floor(at)], np.arange(len(self.path))):
            raise self.text.source.error(
                f"operation {self.text.operation.number} can't be revised in place: its result has "
                "rewinds, or other locations; write it anew for its control (--control)",
                self.text.operation.first_line,
            )
        # A location of the program keeps its line.
        fill = filling.thin(fill, at == np.floor(at))
        placement = self._placement(solution, fill)
        revision = self.text.revise(self.path, placement)
        self.text.require_same_around(revision)
        text = self._program(revision)
        source = revision.revised
        read = load_program(source, machine, self.path.tool, self.reading)
        against = Against(
            toolpath=self.path, surroundings=solution.surroundings, constraints=solution.constraints
        )
        gap = job.surrounding["surface_tolerance"]
        report = check_read(read, machine, against, gap, solution.tolerances)
        gate = Gate.of(report, job.writing["override"])
        planned = ProgramMotion(
            fill.blocks, np.full(len(fill.blocks), Phase.PATH, dtype=np.int64), self.wording.interpolation, 0
        )
        owner = np.full(len(read.motion), NO_ROW, dtype=np.int64)
        for row, line in enumerate(revision.row_lines.tolist()):
            owner[read.motion.source == line] = row
        none = np.zeros(0, dtype=np.int64)
        back = ReadBack(planned, self.wording, job.nc, read, owner, none, False)
        texts = [source.lines[line - 1] for line in revision.row_lines.tolist()]
        try:
            energy = price_program(source, machine, self.reading).energy if machine.has_powers else None
        except ToolpathError:  # a rapid move whose speed nobody states
            energy = None
        made = MadeProgram(
            machine,
            text,
            planned,
            gate,
            predicted_time(read.motion, machine, self.wording.dialect, self.wording.coordinates),
            back.blocks,
            word_rounding(back.motion, texts),
            energy,
            back.end[back.block_rows],
            fill,
        )
        return made, revision

    def _placement(self, solution: Solution, fill: Fill) -> Placement:
        """Return where the axes are to be at each location that gets a line."""
        motion, kept = fill.blocks, fill.kept
        row = _rows(solution, fill.row[kept])
        machine = solution.machine
        rotary = motion.positions[:, machine.rotary_columns]
        tip, _ = tool_poses(machine, motion.positions)
        return Placement(row, tip, self._wound(machine, rotary), motion.time)

    def _wound(self, machine: Machine, rotary: Array) -> Array:
        """Turn axes without limits by whole turns, so that they begin nearest to where they were."""
        if self.path.rotary is None or not np.isfinite(self.path.rotary[0]).all():
            return rotary
        whole = 2.0 * np.pi * np.round((self.path.rotary[0] - rotary[0]) / (2.0 * np.pi))
        endless = [machine.axes[c].limits.unlimited for c in machine.rotary_columns]
        return np.asarray(rotary + np.where(endless, whole, 0.0))

    def _program(self, revision: Revision) -> Program:
        source = revision.revised
        rows = np.full(len(source.lines), NO_ROW, dtype=np.int64)
        rows[revision.row_lines - 1] = np.arange(len(revision.row_lines))
        return Program(
            control=self.wording.dialect.name,
            suffix=suffix_of(source.name) or self.wording.dialect.suffix,
            lines=tuple(source.lines),
            rows=tuple(rows.tolist()),
            dropped=0,
            coordinates=self.wording.coordinates,
            revises=f"operation {self.text.operation.number} of {Path(source.name).name}, lines "
            f"{revision.first}-{revision.last}",
            data=with_lines(self.text.source, revision.replaced),
        )

    def beside_original(self, solution: Solution, rounding: float) -> Solution:
        """Compare a solution with the program as it was, first of all.

        Parameters
        ----------
        rounding : mm, of the program's words
        """
        rotary = self.path.rotary
        if rotary is None or not np.isfinite(rotary).all():
            why = "the program states directions of the tool, and no angles"
            return replace(solution, missing={**solution.missing, AS_PROGRAMMED: why})
        machine, path = solution.machine, self.path
        motion = follow(path, machine, rotary)
        if self.wording.interpolation is Interpolation.TCP:
            motion = replace(motion, time=block_times(path, machine, motion.positions, by_tip=True))
        energy = blocks_energy(solution.machine, motion, solution.clock, rounding)
        original = Baseline(motion, energy, self.path)
        return replace(solution, compared={AS_PROGRAMMED: original, **solution.compared})


def _rows(solution: Solution, row: Array) -> Array:
    """Return rows of a solution's path as rows of the given one, whose locations are whole numbers."""
    own = solution.motion.location
    found = row if own is None else np.interp(row, np.arange(len(own)), own)
    near = np.rint(found)
    return np.where(np.abs(found - near) <= SAME_ROW, near, found)
