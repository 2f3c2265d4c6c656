"""From a job to its outcome: optimise, make the program, verify it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import on_part
from fiveaxis.energy import Budget, Energy, job_budget
from fiveaxis.errors import Infeasible, JobError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array
from fiveaxis.job.clearing import Cleared, solve_clear
from fiveaxis.job.description import Job
from fiveaxis.job.in_place import RevisedOperation
from fiveaxis.job.kept import keep_stated
from fiveaxis.job.loading import (
    describe_inputs,
    is_mesh,
    load_factors,
    load_job_machine,
    load_job_toolpath,
    load_surroundings,
    measure_plan,
    part_unit,
    require_writable,
    revises,
)
from fiveaxis.job.process import make_process
from fiveaxis.job.program import MadeProgram
from fiveaxis.job.program_choice import Chosen, Comparison, choose
from fiveaxis.job.program_options import Header
from fiveaxis.job.release import Gate
from fiveaxis.job.solution import Solution, add_findings
from fiveaxis.kinematics import tool_axes
from fiveaxis.machine import Machine, describe_powers
from fiveaxis.mesh import mesh_size, size_findings
from fiveaxis.motion import Clock, Filling, Interpolation
from fiveaxis.nc.own_header import tool_comments
from fiveaxis.nc.revision import Revision
from fiveaxis.nc.writing.word_writer import WordWriter
from fiveaxis.posture import RESULT, Front, Optimum, Options, find_front, optimise_postures
from fiveaxis.posture.solution import Baseline, blocks_energy
from fiveaxis.posture.strategy.front import undominated
from fiveaxis.progress import UNKEPT, Checkpoint, Progress, unheard
from fiveaxis.report import InputFile, ReportDocument
from fiveaxis.report.facts import FrontProgram, FrontPrograms, Overriding, SetupSearched
from fiveaxis.toolpath import Constraints, Toolpath
from fiveaxis.toolpath.bounds import require_touching
from fiveaxis.toolpath.edge import EdgeUse, admitted
from fiveaxis.verification import Report

# Codes of the planner's findings on what no pass reaches.
LEFT_OUT = {
    "contacts-left-out": "the contacts on its walls",
    "faces-left-out": "the faces that were chosen",
}
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
    front : the solutions between the cheapest path and the steadiest, where the job asks for them
    cleared : what kept the solution clear of collisions
    of_front : the outcome of each solution of the front, in its order, this one among them
    front_programs : what the report says of a front
    setup_search : what the report says of the search for the setup
    revision : the lines of the input program that were written anew; None for a program of its own
    chosen : of all that was found for an operation that is revised; None for a program of its own
    scallop : mm, the highest ridge that was asked for and as the cutter leans; None where none was asked for,
        or the lean has no influence on it
    """

    job: Job
    solution: Solution
    program: MadeProgram
    budget: Budget
    inputs: Sequence[InputFile]
    front: Front | None = None
    cleared: Cleared | None = None
    of_front: tuple[Outcome, ...] = ()
    front_programs: FrontPrograms | None = None
    setup_search: SetupSearched | None = None
    revision: Revision | None = None
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
            front=self.front_programs,
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
    def original(self) -> Energy | None:
        """What an operation that was revised in place cost before; None for a program of its own."""
        return None if self.chosen is None else self.chosen.comparison.before

    @property
    def part_size(self) -> Array | None:
        """(3,), mm, extents of the part; None without one."""
        part = self.solution.surroundings.part
        return None if part is None else mesh_size(part)

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
    job: Job,
    progress: Progress = unheard,
    loaded: Toolpath | None = None,
    *,
    moved: bool = False,
    start: Array | None = None,
    checkpoint: Checkpoint = UNKEPT,
) -> Outcome:
    """Take a job through planning or reading, optimisation and verification.

    Parameters
    ----------
    job : what to do
    progress : called with what is being done, steps done and steps in all
    loaded : the path, if `load_job_toolpath` was called before
    moved : whether the job's setup was searched for, and isn't the given one
    start : (n, 2), rad, chain order, postures that are refined in place of a search
    checkpoint : takes what long steps find

    Raises
    ------
    FiveAxisError
        Wrong input, or no admissible posture somewhere (`Infeasible`).
    """
    # What can't be written or read is found before the work, not after it.
    require_writable(job)
    machine = load_job_machine(job)
    toolpath = load_job_toolpath(job, progress) if loaded is None else loaded
    operation = RevisedOperation.of(job, toolpath, machine) if revises(job) else None
    if operation is None:
        job, toolpath = keep_stated(job, toolpath)
        wording = job.program_options.wording(machine)
    else:
        toolpath, wording = operation.path, operation.wording
    progress("reading part and stock", 0, 1)
    fastest = float(toolpath.feed.max())
    process = None if job.process is None else make_process(job.process, toolpath.tool, fastest)
    factors = load_factors(job)
    around = load_surroundings(job)
    constraints = job.constraints
    toolpath = on_part(constraints.zoned(_with_part_size(job, toolpath, around)), around.part)
    require_reached(toolpath, job.override)
    if job.edge_use:
        require_touching(toolpath, "where on its edge it cuts (edge_use)")
    # A program's input files don't name the programs that it calls.
    checkpoint.about(toolpath.pivot, toolpath.normal, toolpath.axis, toolpath.feed, toolpath.kind)
    options = search_options(job, wording, progress, start, checkpoint)
    gouge = job.surrounding.gouge_tolerance
    chosen = front = None
    if operation is None or job.front is not None:
        cleared, front = solve(job, constraints, toolpath, machine, options, around)
    else:
        chosen = choose(
            job,
            operation,
            options,
            lambda changed: solve(job, constraints, toolpath, machine, changed, around)[0],
            lambda found: Solution.of(found.solution, constraints, around, gouge),
        )
        cleared = chosen.cleared
    inputs = describe_inputs(job)

    def finish(postures: Optimum) -> Outcome:
        solution, scallop = _with_ridges(job, Solution.of(postures, constraints, around, gouge))
        revision, taken = None, chosen
        if operation is None:
            writing = job.program_options.named(job.input.stem)
            program = solution.make(replace(writing, header=program_header(solution, inputs, moved=moved)))
        elif chosen is not None:
            program, revision = chosen.program, chosen.revision
        else:
            program, revision = operation.make(solution, job)
        # What is priced is the text: its words are rounded, and redundant blocks may have stayed in it.
        blocks, rounding = program.blocks, program.rounding
        if operation is not None and program.energy is not None:
            solution = replace(operation.compared(solution), energy=program.energy)
            if taken is None and revision is not None:  # one of a front
                was = Comparison(operation.as_it_was.energy, program.energy, options.objective)
                taken = Chosen(cleared, program, revision, was, ())
            if program.spent is not None:
                solution = replace(solution, spent={**solution.spent, RESULT: program.spent})
        else:
            filling = Filling.of(constraints, program.motion.interpolation)
            solution = replace(
                solution,
                energy=blocks_energy(machine, blocks, solution.clock, rounding),
                compared=_rounded_alike(solution, filling, rounding),
            )
        timed = blocks if operation is not None else solution.clock.timed(blocks, machine)
        budget = job_budget(machine, timed, process, factors, engaged=program.engaged)
        return Outcome(
            job,
            solution,
            program,
            budget,
            inputs,
            cleared=cleared,
            revision=revision,
            chosen=taken,
            scallop=scallop,
        )

    solutions = (cleared.solution,) if front is None else front.solutions
    outcomes = []
    for number, one in enumerate(solutions, start=1):
        progress("writing and verifying the program", number - 1, len(solutions))
        outcomes.append(finish(one))
    return outcomes[0] if front is None else _picked(job, front, outcomes)


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
    points = tuple(delivered[k] for k in kept)
    dominated = front.dominated + len(outcomes) - len(members)
    solutions = [front.solutions[able[k]] for k in kept]
    programs = tuple(
        FrontProgram(point, number, point.energy.total, point.energy.time, made.gate.is_open)
        for number, (point, made) in enumerate(zip(points, members, strict=True), start=1)
    )
    picked = min(job.pick or 1, len(members))
    return replace(
        members[picked - 1],
        front=Front(points, dominated, solutions[0], tuple(solutions[1:])),
        of_front=members,
        front_programs=FrontPrograms(programs, dominated, picked),
    )


def _edge_use(solution: Optimum, rpm: float | None) -> EdgeUse:
    """Find where on the cutter's edge a solution and its baselines cut."""
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

    Returns
    -------
    The solution, with a finding where they are too high, and the height asked for and the largest one, mm
    """
    path, asked = solution.toolpath, job.planning.scallop
    if asked is None or not path.zone.offset or not is_mesh(job.input):
        return solution, None
    axis = tool_axes(solution.machine, solution.motion.positions[:, solution.machine.rotary_columns])
    ridges = measure_plan(job, replace(path, axis=axis))
    if not ridges.scallop_largest > MOST_SCALLOP * asked:
        return solution, (asked, ridges.scallop_largest)
    message = (
        f"as {path.tool} leans, ridges between passes are up to {ridges.scallop_largest:.3g} mm high and "
        f"{ridges.scallop_mean:.3g} mm in the mean (scallop {asked:g} mm was asked for); narrow lead and "
        "lean, or ask for less; on sharp edges cutters that aren't balls leave more"
    )
    found = Finding(Severity.WARNING, "scallop-over", message, Place(file=path.name), ridges.scallop_largest)
    return add_findings(solution, found), (asked, ridges.scallop_largest)


def _with_part_size(job: Job, toolpath: Toolpath, around: Surroundings) -> Toolpath:
    """Add the finding on a part of implausible size to a path that was read: the planner adds its own."""
    file = job.surrounding.part
    if around.part is None or file is None:
        return toolpath
    size, diameter = mesh_size(around.part), toolpath.tool.diameter
    found = size_findings(size, unit=part_unit(job) or "mm", diameter=diameter, name=str(file))
    return replace(toolpath, findings=(*toolpath.findings, *found))


def require_reached(toolpath: Toolpath, override: Sequence[str]) -> None:
    """Raise `Infeasible` if passes reach less than half of the contacts or faces, and that isn't accepted."""
    for code, what in LEFT_OUT.items():
        lost = [f for f in toolpath.findings if f.severity is Severity.ERROR and f.code == code]
        if lost and code not in override:
            raise Infeasible(
                f"{toolpath.name}: no pass reaches most of {what}; take a smaller cutter, or accept {code} "
                "by name (override)",
                lost,
            )


def program_header(solution: Optimum, inputs: Sequence[InputFile], *, moved: bool = False) -> Header:
    """Return the comments of a job's program, which name its inputs.

    Parameters
    ----------
    inputs : files that the run read, of `describe_inputs`
    moved : whether the setup isn't the given one
    """
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


def search_options(
    job: Job,
    wording: WordWriter,
    progress: Progress,
    start: Array | None,
    checkpoint: Checkpoint,
) -> Options:
    """Return what a job minimises, and how."""
    return Options.of(
        job.search,
        interpolation=wording.interpolation,
        clock=Clock(wording.dialect, wording.coordinates),
        start=start,
        progress=progress,
        checkpoint=checkpoint,
    )


def solve(
    job: Job,
    constraints: Constraints,
    toolpath: Toolpath,
    machine: Machine,
    options: Options,
    around: Surroundings | None = None,
) -> tuple[Cleared, Front | None]:
    """Optimise a job's path, clear of obstacles; with the front of solutions if the job asks for one."""
    if job.front is not None and options.smoothing:
        raise JobError("smoothing is varied along a front; leave out one of them", file=job.input)
    if job.pick is not None and job.pick > (job.front or 0):
        raise JobError(
            f"pick = {job.pick} is none of the {job.front} solutions of the front"
            if job.front
            else f"pick = {job.pick} chooses from a front; give front too",
            file=job.input,
        )
    if job.feed_share is not None and (job.front is None or revises(job)):
        raise JobError(
            "feed_share belongs to a front, and to a program of its own; give front, and for a program "
            "that is revised in place also control",
            file=job.input,
        )
    fronts: list[Front] = []

    def find(path: Toolpath, machine: Machine, constraints: Constraints, chosen: Options) -> Optimum:
        if job.front is None:
            return optimise_postures(path, machine, constraints, chosen)
        fronts.append(find_front(path, machine, constraints, job.front, chosen, feed_share=job.feed_share))
        return fronts[-1].pick(job.pick or 1)

    cleared = solve_clear(
        toolpath, machine, constraints, options, around if job.surrounding.keep_clear else None, find
    )
    # Several paths may have been searched; take the front of the chosen one.
    motion = cleared.solution.motion
    front = next((f for f in fronts if any(s.motion is motion for s in f.solutions)), None)
    return cleared, front
