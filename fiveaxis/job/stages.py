"""From a job to its outcome: optimise, make the program, verify it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.energy import Budget, job_budget
from fiveaxis.errors import JobError
from fiveaxis.geometry import Array
from fiveaxis.job.clearing import Cleared, keep_clear
from fiveaxis.job.description import Job
from fiveaxis.job.inputs import describe_inputs
from fiveaxis.job.loading import (
    Progress,
    load_factors,
    load_job_machine,
    load_job_passes,
    load_process,
    load_surroundings,
    require_cut,
)
from fiveaxis.job.program import MadeProgram, ProgramOptions, make_program
from fiveaxis.job.release import Gate
from fiveaxis.machine import Machine
from fiveaxis.nc import Clock, require_program
from fiveaxis.posture import Front, Options, Solution, find_front
from fiveaxis.posture import optimise as optimise_postures
from fiveaxis.posture.masks.mask import MaskFunction
from fiveaxis.posture.solution import blocks_energy
from fiveaxis.report import report_document
from fiveaxis.toolpath import Toolpath
from fiveaxis.toolpath.passes import Passes
from fiveaxis.verification import DEFAULT_TOLERANCES, Report

# Settings of a job that the optimiser takes under the same name, besides constraints.
SOLVING = tuple(each.name for each in fields(Options) if each.name in Job.model_fields)

# Name of the optimised result beside the baselines'.
RESULT = "optimised"


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a job gave.

    Parameters
    ----------
    job : what was asked
    solution : the result with its baselines
    program : its NC program, verified
    budget, document : energy of the whole job, and the report's figures
    front : where one was asked for
    cleared : what kept the solution clear of collisions
    of_front : the outcome of each solution of the front, in its order, this one among them
    """

    job: Job
    solution: Solution
    program: MadeProgram
    budget: Budget
    document: dict[str, Any]
    front: Front | None = None
    cleared: Cleared | None = None
    of_front: tuple[Outcome, ...] = ()

    @property
    def gate(self) -> Gate:
        """What keeps the program back, and which of it the job accepts by name."""
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
    progress: Progress | None = None,
    loaded: tuple[Toolpath, Passes | None] | None = None,
    *,
    moved: bool = False,
    start: Array | None = None,
) -> Outcome:
    """Take a job through planning or reading, optimisation and verification.

    Parameters
    ----------
    job : what to do
    progress : called with a stage's name, steps done and steps in all
    loaded : path and passes, where `load_job_passes` has given them already
    moved : whether the job's setup isn't the one that was given, but one that was searched for
    start : (n, 2), rad, chain order, postures that are refined in place of a search; not where passes may
        begin elsewhere

    Raises
    ------
    FiveAxisError
        Wrong input, or no admissible posture somewhere (`Infeasible`).
    """
    machine = load_job_machine(job)
    # A program that the control can't write is found out before the work, not after it.
    require_program(machine, job.control, job.coordinates, job.winding, job.nc)
    toolpath, passes = loaded or load_job_passes(job, progress)
    process, factors = load_process(job, toolpath.tool), load_factors(job)
    if process is not None:
        require_cut(process, float(toolpath.feed.max()))
    # A part that can't be read is found out before the work, not after it.
    around = load_surroundings(job)
    tell = progress or _tell_nobody
    solution, front, cleared = solve(job, toolpath, machine, progress, passes, around, start)
    inputs = describe_inputs(job)

    def finished(solution: Solution) -> Outcome:
        # The solution's own path knows which part of the cutter touches.
        program = make_program(
            solution.motion,
            machine,
            solution.toolpath,
            job.constraints,
            program_options(job, solution, inputs, moved=moved),
            around=around,
            tolerances=DEFAULT_TOLERANCES.with_gouge(job.gouge_tolerance),
        )
        # One number, that of the text: redundant blocks may have stayed in it.
        spent = blocks_energy(machine, program.motion.blocks, solution.clock)
        solution = replace(solution, energy=spent)
        budget = job_budget(machine, program.motion.blocks, process, factors)
        document = report_document(
            solution,
            program.gate.report.as_dict(),
            inputs=inputs,
            program=program.as_dict(),
            budget=budget.as_dict(),
        )
        document |= _release(job, program.gate)
        return Outcome(job, solution, program, budget, document, front, cleared)

    solutions = (solution,) if front is None else front.solutions
    outcomes = []
    for number, one in enumerate(solutions):
        tell("verify", number, len(solutions))
        outcomes.append(finished(one))
    tell("verify", len(solutions), len(solutions))
    if front is None:
        return outcomes[0]
    picked = next(k for k, one in enumerate(solutions) if one.motion is solution.motion)
    return picked_of(outcomes, picked, front)


def picked_of(outcomes: Sequence[Outcome], picked: int, front: Front) -> Outcome:
    """Give one outcome of a front, and tell in its document what the others are."""
    told = front.as_dict()
    for number, (point, outcome) in enumerate(zip(told["points"], outcomes, strict=True), start=1):
        delivered = outcome.solution.energy
        point |= {"number": number, "energy_J": delivered.total, "program_time_s": delivered.time}
        point |= {"released": outcome.gate.is_open}
    document = outcomes[picked].document | {"front": told | {"picked": picked + 1}}
    return replace(outcomes[picked], document=document, of_front=tuple(outcomes))


def program_options(
    job: Job, solution: Solution, inputs: Sequence[Mapping[str, Any]], *, moved: bool = False
) -> ProgramOptions:
    """Say how a job's program is written, and where it comes from.

    Parameters
    ----------
    inputs : files that the run read, of `describe_inputs`
    moved : whether the workpiece is set up elsewhere than the job says
    """
    header = {"tool": str(solution.toolpath.tool)}
    feeds = np.unique(solution.toolpath.feed[solution.toolpath.cutting])
    if len(feeds) == 1:
        header["feed"] = f"{60.0 * feeds[0]:.7g} mm/min along the path"
    if moved:
        header["workpiece"] = f"set up elsewhere than given: {solution.machine.setup}"
    for number, source in enumerate(inputs, start=1):
        header[f"source {number}"] = f"{source['name']} sha256 {source['sha256'][:16]}"
    return ProgramOptions(
        control=job.control,
        coordinates=job.coordinates,
        winding=job.winding,
        settings=job.nc,
        thin=job.thin,
        override=job.override,
        header=header,
    ).named(job.input.stem)


def _release(job: Job, gate: Gate) -> dict[str, Any]:
    """Say what keeps the program back, and who accepts which errors."""
    if not job.override:
        return {"kept_back": gate.kept}
    return {
        "kept_back": gate.kept,
        "overridden": {code: gate.report.counts[code] for code in gate.accepted},
        "overridden_by": job.override_by,
        "override_unused": [finding.as_dict() for finding in gate.unused],
    }


def _tell_nobody(stage: str, done: int, total: int) -> None:
    """Stand in for a progress that wasn't given."""


def solve(
    job: Job,
    toolpath: Toolpath,
    machine: Machine,
    progress: Progress | None,
    passes: Passes | None = None,
    around: Surroundings | None = None,
    start: Array | None = None,
) -> tuple[Solution, Front | None, Cleared | None]:
    """Optimise a job's path, clear of what stands around; with the front of solutions that it asks for.

    `passes` are those of a planned path: with a free start the links between them are laid anew.
    """
    wording = require_program(machine, job.control, job.coordinates, job.winding, job.nc)
    options = Options(
        **{name: getattr(job, name) for name in SOLVING},
        interpolation=wording.interpolation,
        clock=Clock(wording.dialect, wording.coordinates),
        start=start,
        progress=progress,
    )
    if job.free_start and passes is not None:
        options = replace(options, free_start=passes)
    if job.front is not None and job.smoothing:
        raise JobError("smoothing is what a front sweeps; leave one of them out", file=job.input)
    if job.pick is not None and job.pick > (job.front or 0):
        raise JobError(
            f"pick = {job.pick} is none of the {job.front} solutions of the front"
            if job.front
            else f"pick = {job.pick} chooses from a front; give front, too",
            file=job.input,
        )
    fronts: list[Front] = []

    def once(path: Toolpath, mask: MaskFunction | None, free: bool) -> Solution:
        chosen = replace(options, start=None) if free else options.without_free_start()
        chosen = replace(chosen, mask=mask)
        if job.front is None:
            return optimise_postures(path, machine, job.constraints, chosen)
        fronts.append(find_front(path, machine, job.constraints, job.front, chosen))
        return fronts[-1].pick(job.pick or 1)

    cleared = None
    if around is None or not job.keep_clear:
        solution = once(toolpath, None, job.free_start)
    else:
        cleared = keep_clear(once, toolpath, machine, around, job.constraints, free_start=job.free_start)
        solution = cleared.solution
    # Paths were searched again; the front is that of the one which was taken.
    front = next((f for f in fronts if any(s.motion is solution.motion for s in f.solutions)), None)
    return solution, front, cleared
