"""From a job to its outcome: optimise, make the program, verify it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fiveaxis.base import STAGES, UNKEPT, Array, Checkpoint, Finding, Place, Progress, Severity, unheard
from fiveaxis.check import Gate, Report
from fiveaxis.job.clearing import Cleared, solve_clear
from fiveaxis.job.description import Job
from fiveaxis.job.loading import describe_inputs, is_mesh, measure_plan
from fiveaxis.job.program import MadeProgram
from fiveaxis.job.program_choice import Chosen, Comparison, choose
from fiveaxis.job.solution import Solution, add_findings
from fiveaxis.job.task import JobTask
from fiveaxis.lab import Budget, job_budget
from fiveaxis.model import (
    Constraints,
    EdgeUse,
    Energy,
    Filling,
    Interpolation,
    Machine,
    Toolpath,
    admitted,
    blocks_energy,
    describe_powers,
    tool_axes,
)
from fiveaxis.nc import Header, Revision, tool_comments
from fiveaxis.posture import (
    RESULT,
    Baseline,
    Front,
    Optimum,
    Options,
    find_front,
    optimise_postures,
    undominated,
)
from fiveaxis.show import FrontProgram, FrontPrograms, InputFile, Overriding, ReportDocument, SetupSearched

# Share of the scallop asked for above which ridges are a finding.
MOST_SCALLOP = 1.05


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a job gave.

    Parameters
    ----------
    job : what was to be done
    solution : the result with its baselines; its path carries the findings of planning and optimising
    program : its NC program, verified
    budget : energy of the whole job
    inputs : the files that the run read, of `describe_inputs`
    cleared : what kept the solution clear of collisions
    front, members : of a job that asks for a front, whose pick this is: what the report says of the programs
        from the cheapest to the steadiest, or the fastest, and the outcome of each, in its order
    setup_search : what the report says of the search for the setup
    chosen : of all that was found for an operation that is revised; None for a program of its own
    scallop : mm, the highest ridge that was asked for and as the cutter leans; None where none was asked for,
        or the lean has no influence on it
    """

    job: Job
    solution: Solution
    program: MadeProgram
    budget: Budget
    inputs: Sequence[InputFile]
    cleared: Cleared | None = None
    front: FrontPrograms | None = None
    members: tuple[Outcome, ...] = ()
    setup_search: SetupSearched | None = None
    chosen: Chosen | None = None
    scallop: tuple[float, float] | None = None

    @cached_property
    def report(self) -> ReportDocument:
        """The facts that the page, the terminal and ``report.json`` tell."""
        gate, program = self.gate, self.program
        changes = self.solution.energy.steadiness.changes
        accepted = {code: gate.report.counts[code] for code in gate.accepted}
        return ReportDocument(
            solution=self.solution,
            verdict=gate.report,
            inputs=self.inputs,
            program=program.figures,
            budget=self.budget,
            lines={c: program.line_of(at.block) if gate.is_open else None for c, at in changes.items()},
            kept_back=gate.kept,
            overriding=Overriding(accepted, self.job.override_by, gate.unused) if self.job.override else None,
            part_size=None if self.part_size is None else tuple(self.part_size.round(6).tolist()),
            scallop=self.scallop,
            setup_search=self.setup_search,
            front=self.front,
            edge_use=_edge_use(self.solution, self.job.bounds.spindle_speed) if self.job.edge_use else None,
            trades=() if self.chosen is None else self.chosen.comparison.trades,
            replaced_for=() if self.chosen is None else self.chosen.comparison.faults,
            # Where an approach by axes comes from is no position of the program.
            reached=program.motion.motion.positions[
                int(program.motion.interpolation is Interpolation.JOINT) :
            ],
        )

    @cached_property
    def document(self) -> dict[str, Any]:
        """The report as plain data, as in ``report.json``."""
        return self.report.as_dict()

    @property
    def revision(self) -> Revision | None:
        """The lines of the input program that were written anew; None for a program of its own."""
        return None if self.chosen is None else self.chosen.revision

    @property
    def original(self) -> Energy | None:
        """What an operation that was revised in place cost before; None for a program of its own."""
        return None if self.chosen is None else self.chosen.comparison.before

    @property
    def part_size(self) -> Array | None:
        """(3,), mm, extents of the part; None without one."""
        part = self.solution.surroundings.part
        return None if part is None else part.extents

    @property
    def gate(self) -> Gate:
        """Which errors keep the program back, and which of them the job accepts by name."""
        return self.program.gate

    @property
    def verdict(self) -> Report:
        """What verification found in the program's text."""
        return self.gate.report

    @property
    def ok(self) -> bool:
        """Whether the program has no error."""
        return self.program.ok


def run_stages(
    task: JobTask,
    progress: Progress = unheard,
    *,
    start: Array | None = None,
    checkpoint: Checkpoint = UNKEPT,
) -> Outcome:
    """Take a resolved job through optimisation and verification.

    Parameters
    ----------
    start : (n, 2), rad, chain order, postures that are refined in place of a search

    Raises
    ------
    Infeasible
        No admissible posture somewhere.
    AlreadyBetter
        Nothing is better than the operation that would be revised.
    """
    job, operation, path = task.job, task.operation, task.toolpath
    # A program's input files don't name the programs that it calls.
    checkpoint.about(path.pivot, path.normal, path.axis, path.feed, path.kind)
    options = replace(task.options, start=start, progress=progress, checkpoint=checkpoint)
    chosen = front = None
    if operation is None or job.front is not None:
        cleared, front = solve(task, options)
    else:
        chosen = choose(task, operation, options, lambda changed: solve(task, changed)[0])
        cleared = chosen.cleared
    inputs = describe_inputs(job)
    solutions = (cleared.solution,) if front is None else front.solutions
    outcomes = []
    for number, one in enumerate(solutions, start=1):
        progress(STAGES["verify"], number - 1, len(solutions))
        outcomes.append(_finished(task, one, cleared, chosen, inputs))
    return outcomes[0] if front is None else _picked(job, front, outcomes)


def _finished(
    task: JobTask, postures: Optimum, cleared: Cleared, chosen: Chosen | None, inputs: Sequence[InputFile]
) -> Outcome:
    """Make the program of postures, or take the one of a revised operation; price it by its text."""
    job, machine, operation = task.job, task.machine, task.operation
    solution, scallop = _with_ridges(job, task.finished(postures))
    if operation is None:
        header = program_header(solution, inputs, moved=task.moved)
        program = solution.make(replace(job.program_options.named(job.input.stem), header=header))
    elif chosen is not None:
        program = chosen.program
    else:
        program, revision = operation.make(solution)
        if program.energy is not None:
            was = Comparison(operation.as_it_was.energy, program.energy, task.options.objective)
            chosen = Chosen(cleared, program, revision, was, ())
    # What is priced is the text: its words are rounded, and redundant blocks may have stayed in it.
    blocks, rounding = program.blocks, program.rounding
    if operation is not None and program.energy is not None:
        solution = replace(operation.compared(solution), energy=program.energy)
        if program.spent is not None:
            solution = replace(solution, spent={**solution.spent, RESULT: program.spent})
    else:
        filling = Filling.of(task.constraints, program.motion.interpolation)
        solution = replace(
            solution,
            energy=blocks_energy(machine, blocks, solution.clock, rounding),
            compared=_rounded_alike(solution, filling, rounding),
        )
    timed = blocks if operation is not None else solution.clock.timed(blocks, machine)
    budget = job_budget(machine, timed, task.process, task.factors, engaged=program.engaged)
    return Outcome(
        job,
        solution,
        program,
        budget,
        inputs,
        cleared=cleared,
        chosen=chosen,
        scallop=scallop,
    )


def _picked(job: Job, front: Front, outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcome that a job picks of a front: of the programs that no other one dominates as made.

    Words are rounded and blocks removed, so two programs may be in another order than their solutions were.
    A program that is kept back stands beside none that isn't.
    """
    able = [k for k, made in enumerate(outcomes) if made.gate.is_open] or list(range(len(outcomes)))
    delivered = [replace(front.points[k], energy=outcomes[k].solution.energy) for k in able]
    objective = job.search.objective
    kept = undominated([point.figures(point.energy, objective) for point in delivered])
    members = tuple(outcomes[able[k]] for k in kept)
    programs = tuple(
        FrontProgram(delivered[k], number, made.gate.is_open)
        for number, (k, made) in enumerate(zip(kept, members, strict=True), start=1)
    )
    picked = min(job.pick or 1, len(members))
    dominated = front.dominated + len(outcomes) - len(members)
    return replace(members[picked - 1], front=FrontPrograms(programs, dominated, picked), members=members)


def _edge_use(solution: Optimum, rpm: float | None) -> EdgeUse:
    motions = {RESULT: (solution.toolpath, solution.motion)}
    motions |= {
        name: (one.toolpath or solution.toolpath, one.motion) for name, one in solution.compared.items()
    }
    columns = solution.machine.rotary_columns
    programs = {
        name: (path, tool_axes(solution.machine, motion.positions[:, columns]))
        for name, (path, motion) in motions.items()
    }
    spindle = None if rpm is None else 2.0 * math.pi * rpm / 60.0
    return EdgeUse.of(programs, spindle, admitted(solution.toolpath, solution.tilt))


def _rounded_alike(solution: Optimum, filling: Filling, rounding: float) -> dict[str, Baseline]:
    """Count the baselines' starts as the text's: moves within the rounding of its words, mm, are none."""
    machine, path = solution.machine, solution.toolpath

    def energy(one: Baseline) -> Energy:
        blocks = filling.blocks(one.toolpath or path, machine, one.motion)
        return blocks_energy(machine, blocks, solution.clock, rounding)

    return {name: replace(one, energy=energy(one)) for name, one in solution.compared.items()}


def _with_ridges(job: Job, solution: Solution) -> tuple[Solution, tuple[float, float] | None]:
    """Measure the ridges that a leaned cutter leaves between planned passes, if their height was asked for.

    A finding says where they are too high; the heights asked for and found are in mm.
    """
    path, scallop = solution.toolpath, job.planning.scallop
    if scallop is None or not path.zone.offset or not is_mesh(job.input):
        return solution, None
    axis = tool_axes(solution.machine, solution.motion.positions[:, solution.machine.rotary_columns])
    ridges = measure_plan(job, replace(path, axis=axis))
    if not ridges.scallop_largest > MOST_SCALLOP * scallop:
        return solution, (scallop, ridges.scallop_largest)
    message = (
        f"as {path.tool} leans, ridges between passes are up to {ridges.scallop_largest:.3g} mm high and "
        f"{ridges.scallop_mean:.3g} mm in the mean (scallop {scallop:g} mm was asked for); narrow lead and "
        "lean, or ask for less; on sharp edges cutters that aren't balls leave more"
    )
    found = Finding(Severity.WARNING, "scallop-over", message, Place(file=path.name), ridges.scallop_largest)
    return add_findings(solution, found), (scallop, ridges.scallop_largest)


def program_header(solution: Optimum, inputs: Sequence[InputFile], *, moved: bool = False) -> Header:
    """Return the comments of a job's program, which name its inputs, and a setup that isn't the given one."""
    feeds = np.unique(solution.toolpath.feed[solution.toolpath.cutting])
    header = tool_comments(solution.toolpath.tool, feeds[0] if len(feeds) == 1 else None)
    powers = describe_powers(solution.machine)
    if powers:
        header["powers"] = powers
    if moved:
        header["workpiece"] = f"set up elsewhere than given: {solution.machine.setup}"
    for number, source in enumerate(inputs, start=1):
        header[f"source {number}"] = f"{source['name']} sha256 {source['sha256'][:16]}"
    return header


def solve(task: JobTask, options: Options) -> tuple[Cleared, Front | None]:
    """Optimise a job's path, clear of obstacles; with the front of solutions if the job asks for one."""
    job, fronts = task.job, list[Front]()

    def find(path: Toolpath, machine: Machine, constraints: Constraints, chosen: Options) -> Optimum:
        if job.front is None:
            return optimise_postures(path, machine, constraints, chosen)
        fronts.append(find_front(path, machine, constraints, job.front, chosen, feed_share=job.feed_share))
        return fronts[-1].pick(job.pick or 1)

    cleared = solve_clear(replace(task, options=options), find)
    # Several paths may have been searched; take the front of the chosen one.
    motion = cleared.solution.motion
    front = next((f for f in fronts if any(s.motion is motion for s in f.solutions)), None)
    return cleared, front
