"""An operation of a program with other postures, in its own lines: revised, read back, verified, priced."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, Coordinates, Finding, IntArray, JobError, Reading, Severity
from fiveaxis.check import Against, Gate, check_read
from fiveaxis.job.description import Job
from fiveaxis.job.loading import operation_text, stated_control
from fiveaxis.job.program import MadeProgram
from fiveaxis.job.solution import Solution
from fiveaxis.lab import Pricing, ProgramEnergy, price_program
from fiveaxis.model import (
    Energy,
    Fill,
    Filling,
    Interpolation,
    Machine,
    Phase,
    ProgramMotion,
    Toolpath,
    follow,
    own_slack,
    require_stated,
    tool_poses,
)
from fiveaxis.nc import (
    DIALECTS,
    RAPID,
    OperationText,
    Placement,
    Reviser,
    Revision,
    Source,
    TracedProgram,
    WordWriter,
    load_program,
    require_program,
)
from fiveaxis.posture import AS_PROGRAMMED, Baseline

# Rounding of a location's number.
SAME_ROW = 1e-9


@dataclass(frozen=True, eq=False)
class RevisedOperation:
    """An operation of a job's program that is revised in its own lines.

    Parameters
    ----------
    text : its rows beside the program's text
    path : its cuts, whose postures are revised
    machine : as it is set up
    wording : the control, and whether its words are the tip's or the axes'
    reading : how the program is read
    job : whose operation it is
    """

    text: OperationText
    path: Toolpath
    machine: Machine
    wording: WordWriter
    reading: Reading
    job: Job

    @classmethod
    def of(cls, job: Job, toolpath: Toolpath, machine: Machine) -> RevisedOperation:
        """Find the cuts of a job's operation, as the job reads them, in its program's text.

        Raises as `OperationText.of`; `JobError` for words of no control that is written.
        """
        text = operation_text(job, toolpath.tool)
        operation = text.operation
        # Words of axes alone don't tell an ISO control.
        control = operation.control or stated_control(job)
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
        if (rotary := _stated_angles(toolpath)) is not None:
            tcp = wording.interpolation is Interpolation.TCP
            toolpath = replace(toolpath, slack=own_slack(toolpath, machine, rotary, tcp=tcp))
        reading = timed_reading(job, machine)
        if reading.rapid != job.reading.rapid:
            unknown = ", ".join(axis.letter for axis in machine.axes if axis.max_speed is None)
            message = (
                f"machine {machine.name!r} states no highest speed of {unknown}: rapid moves are timed at "
                f"{RAPID:g} mm/min (deg/min) in both texts; give the rapid speed (--rapid), or max_speed in "
                "the machine file"
            )
            found = Finding(Severity.NOTE, "rapid-speed-unknown", message, toolpath.place(0))
            toolpath = replace(toolpath, findings=(*toolpath.findings, found))
        return cls(text, toolpath, machine, wording, reading, job)

    @property
    def own(self) -> Array | None:
        """The program's rotary angles, (n, 2) rad; None where it states directions of the tool instead."""
        return _stated_angles(self.path)

    @cached_property
    def as_it_was(self) -> ProgramEnergy:
        """What the operation's text costs: approach, cuts, links and retract."""
        return self.price()

    def price(self, revision: Revision | None = None) -> ProgramEnergy:
        """Price the operation's text, or a revised one, as `program_energy` does its file."""
        source = self.text.source if revision is None else revision.revised
        return price_program(source, self.machine, Pricing.of(self.reading))

    def write(self, solution: Solution) -> tuple[Fill, Revision]:
        """Write a solution's postures into the operation: locations that its blocks stand for, and lines.

        Raises as `Reviser`.
        """
        filling = Filling.of(solution.constraints, self.wording.interpolation)
        fill = filling.fill(solution.toolpath, solution.machine, solution.motion)
        at = _rows(solution, fill.row)
        if not np.array_equal(at[at == np.floor(at)], np.arange(len(self.path))):
            raise self.text.source.error(
                f"operation {self.text.operation.number} can't be revised in place: its result has "
                "rewinds, or other locations; write it anew for its control (--control)",
                self.text.operation.first_line,
            )
        # A location of the program keeps its line.
        fill = filling.thin(fill, at == np.floor(at))
        # Where the axes are to be at each location that gets a line.
        blocks, machine = fill.blocks, solution.machine
        rotary = self._wound(machine, blocks.positions[:, machine.rotary_columns])
        tip, _ = tool_poses(machine, blocks.positions)
        placed = Placement(_rows(solution, fill.row[fill.kept]), tip, rotary, blocks.time)
        return fill, Reviser(self.text, self.path, placed).revision()

    def make(self, solution: Solution) -> tuple[MadeProgram, Revision]:
        """Write a solution's postures into the operation, and verify and price the text.

        Raises as `Reviser` and `OperationText.require_same_around`.
        """
        fill, revision = self.write(solution)
        self.text.require_same_around(revision)
        text = self.text.program(revision, self.wording)
        read, gate = self.verify(revision.revised, solution)
        planned = ProgramMotion(
            fill.blocks, np.full(len(fill.blocks), Phase.PATH, dtype=np.int64), self.wording.interpolation, 0
        )
        priced = self.price(revision)
        made = MadeProgram.of(
            *(text, planned, read.motion, self.wording),
            gate=gate,
            blocks=priced.motion,
            energy=_from_path(priced, int(revision.row_lines[0])),
            ends=np.arange(len(read.motion)),
            fill=fill,
            spent=np.interp(
                np.arange(len(fill.given)), fill.row[fill.kept], _spent(priced, revision.row_lines)
            ),
        )
        return replace(made, run_time=replace(made.run_time, times=priced.motion.time)), revision

    def faults(self, solution: Solution) -> tuple[str, ...]:
        """Return the codes of errors that the operation has as it was, within the bounds of a solution.

        Its feeds are right: the path has them from its text.
        """
        kept = self.verify(self.text.source, solution)[1].kept
        return tuple(code for code in kept if code != "feed-differs")

    def verify(self, source: Source, solution: Solution) -> tuple[TracedProgram, Gate]:
        """Read the operation's text, as it was or revised, and verify it as a solution's."""
        read = load_program(source, self.machine, self.path.tool, self.reading)
        against = Against(
            toolpath=self.path,
            surroundings=solution.surroundings,
            constraints=solution.constraints,
            tolerances=solution.tolerances,
            surface_tolerance=self.job.surrounding.surface_tolerance,
        )
        return read, Gate.of(check_read(read, self.machine, against), self.job.override)

    def _wound(self, machine: Machine, rotary: Array) -> Array:
        """Turn axes without limits by whole turns, so that they begin nearest to where they were."""
        if self.path.rotary is None or not np.isfinite(self.path.rotary[0]).all():
            return rotary
        whole = 2.0 * np.pi * np.round((self.path.rotary[0] - rotary[0]) / (2.0 * np.pi))
        endless = [machine.axes[c].limits.unlimited for c in machine.rotary_columns]
        return np.asarray(rotary + np.where(endless, whole, 0.0))

    def compared(self, solution: Solution) -> Solution:
        """Compare a solution with the operation as it was, by the price of their texts.

        Where the program states directions of the tool, and no angles, baselines stand in for it.
        """
        path, rotary = self.path, self.own
        if rotary is not None:
            energy = _from_path(self.as_it_was, int(path.source[0]))
            original = Baseline(follow(path, self.machine, rotary), energy, path)
            compared, spent = {AS_PROGRAMMED: original}, {AS_PROGRAMMED: _spent(self.as_it_was, path.source)}
            return replace(solution, compared=compared, missing={}, spent=spent)
        compared, missing = {}, dict(solution.missing)
        missing[AS_PROGRAMMED] = "the program states directions of the tool, and no angles"
        for name, one in solution.compared.items():
            if one.toolpath is not None:
                missing[name] = "it has rewinds, for which the operation has no lines"
                continue
            motion = replace(one.motion, location=solution.motion.location)
            _fill, revision = self.write(replace(solution, motion=motion))
            compared[name] = replace(one, energy=self.price(revision).energy)
        return replace(solution, compared=compared, missing=missing)


def _from_path(priced: ProgramEnergy, line: int) -> Energy:
    """Count the times of starts and reversals from the end of a line, the first of the path."""
    energy, motion = priced.energy, priced.motion
    begin = float(motion.time[: int(np.flatnonzero(motion.source == line)[-1]) + 1].sum())
    events = energy.steadiness
    return replace(energy, steadiness=replace(events, time=events.time - begin))


def _spent(priced: ProgramEnergy, lines: IntArray) -> Array:
    """Add up a text's energy to the end of some of its lines, (n,) J; the last one has the retract's, too."""
    so_far, source = np.cumsum(priced.by_block.sum(axis=1)), priced.motion.source
    last = {int(line): row for row, line in enumerate(source)}
    found = np.array([so_far[last[line]] for line in lines.tolist()])
    found[-1] = so_far[-1]
    return found


def timed_reading(job: Job, machine: Machine) -> Reading:
    """Return how a job's program is read to be priced: rapid moves of unknown speed at `RAPID`."""
    unknown = job.reading.rapid is None and any(axis.max_speed is None for axis in machine.axes)
    return replace(job.reading, rapid=RAPID) if unknown else job.reading


def _stated_angles(path: Toolpath) -> Array | None:
    """Return a program's rotary angles, (n, 2) rad; None where it doesn't state those of all its cuts."""
    stated = path.rotary is not None and bool(np.isfinite(path.rotary).all())
    return path.rotary if stated else None


def _rows(solution: Solution, row: Array) -> Array:
    """Return rows of a solution's path as rows of the given one, whose locations are whole numbers."""
    own = solution.motion.location
    found = row if own is None else np.interp(row, np.arange(len(own)), own)
    near = np.rint(found)
    return np.where(np.abs(found - near) <= SAME_ROW, near, found)
