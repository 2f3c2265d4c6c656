"""A job resolved: what it names is loaded and checked, once; every later stage takes the record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from fiveaxis.base import STAGES, USUAL_CONTROL, Infeasible, JobError, Progress, Severity, Writing, unheard
from fiveaxis.cam import on_part, size_findings
from fiveaxis.check import Surroundings, build_scene
from fiveaxis.job.description import Job, SetupTable
from fiveaxis.job.in_place import RevisedOperation
from fiveaxis.job.loading import (
    load_factors,
    load_job_machine,
    load_job_toolpath,
    load_surroundings,
    part_unit,
    revises,
    stated_control,
)
from fiveaxis.job.placement import place, with_ranges, with_usual_cone
from fiveaxis.job.reading import make_job, require_input
from fiveaxis.job.solution import Solution
from fiveaxis.lab import Factors, Process, make_process
from fiveaxis.model import Clock, Constraints, Machine, Toolpath, require_stated, require_touching
from fiveaxis.nc import DIALECTS, WordWriter, find_dialect, stated_settings
from fiveaxis.posture import Optimum, Options

# Codes of the planner's findings on what no pass reaches.
LEFT_OUT = {
    "contacts-left-out": "the contacts on its walls",
    "faces-left-out": "the faces that were chosen",
}


@dataclass(frozen=True, eq=False)
class Task:
    """What is optimised, within what, and how: no later stage opens a file or makes one of these again.

    Parameters
    ----------
    machine : as it is set up, with the part where it stands
    toolpath : with its zone, as `on_part` takes it; its findings tell what was assumed
    constraints : on postures and turns
    around : part, stock and fixtures
    options : what is minimised, on which clock
    keep_clear : whether postures are kept clear of what stands around
    gouge_tolerance : mm, how deep the cutter may reach into the part
    """

    machine: Machine
    toolpath: Toolpath
    constraints: Constraints
    around: Surroundings
    options: Options
    keep_clear: bool
    gouge_tolerance: float

    @property
    def obstacles(self) -> Surroundings | None:
        """What the tool is kept clear of; None where it needn't be."""
        return self.around if self.keep_clear else None

    def finished(self, postures: Optimum) -> Solution:
        """Add to postures what they were chosen within."""
        return Solution.of(postures, self.constraints, self.around, self.gouge_tolerance)


@dataclass(frozen=True, eq=False)
class JobTask(Task):
    """The task of a job, which becomes a verified program.

    Parameters
    ----------
    job : with the control, settings, bounds and setup that hold, whoever stated them
    wording : the control, and what its words are
    stated : the setup as the job gives it, without a search
    operation : the lines that are revised; None for a program of its own
    process, factors : the cut, and what energy costs; None where the job doesn't say
    """

    job: Job
    wording: WordWriter
    stated: SetupTable
    operation: RevisedOperation | None = None
    process: Process | None = None
    factors: Factors | None = None

    @property
    def moved(self) -> bool:
        """Whether the part stands elsewhere than the job says."""
        return self.job.setup != self.stated

    def at(self, setup: SetupTable) -> JobTask:
        """Return the task with the part in another place."""
        machine = self.machine.with_setup(setup.offset, setup.rotation)
        job = self.job.model_copy(update={"setup": setup})
        return replace(self, job=job, machine=machine, wording=job.program_options.wording(machine))


def resolve(job: Job, progress: Progress = unheard) -> JobTask:
    """Load what a job names, and check all of it, before the work begins and before anything is written.

    Passes are planned, the part is placed where the job doesn't say where it stands, and what the input
    states of its control, tool and spindle holds where the job says nothing.

    Raises
    ------
    FiveAxisError
        Wrong input, with file, line and what to do; a program that can't be written for the machine.
    Infeasible
        Passes reach too little of the part.
    """
    require_input(job.input)
    _require_front(job)
    in_place, machine = revises(job), load_job_machine(job)
    control = None if in_place else stated_control(job)
    job = job if control is None else job.model_copy(update={"control": control})
    wording = None if in_place else _writable(job, machine)
    toolpath = load_job_toolpath(job, progress)
    if not in_place:
        kept, toolpath = _keep_stated(job, toolpath)
        wording = wording if kept is job else _writable(kept, machine)
        job = kept
    job, toolpath = with_usual_cone(job, toolpath)
    stated = job.setup.model_copy(update={"search": None})
    progress(STAGES["part"], 0, 1)
    around = load_surroundings(job)
    progress(STAGES["place"], 0, 1)
    job, findings = place(
        job, machine, toolpath, around if job.surrounding.keep_clear else None, in_place=in_place
    )
    if job.setup.offset != stated.offset or job.setup.rotation != stated.rotation:
        machine = machine.with_setup(job.setup.offset, job.setup.rotation)
        wording = None
    job = with_ranges(job, machine)
    toolpath = replace(toolpath, findings=(*toolpath.findings, *findings))
    operation = RevisedOperation.of(job, toolpath, machine) if in_place else None
    if operation is not None:
        toolpath, wording = operation.path, operation.wording
    wording = wording or job.program_options.wording(machine)
    fastest = float(toolpath.feed.max())
    process = None if job.process is None else make_process(job.process, toolpath.tool, fastest)
    constraints = job.constraints
    toolpath = on_part(constraints.zoned(_with_part_size(job, toolpath, around)), around.part)
    require_reached(toolpath, job.override)
    build_scene(machine, toolpath.tool, around)  # opens the meshes of bodies and fixtures
    if job.edge_use:
        require_touching(toolpath, "where on its edge it cuts (edge_use)")
    return JobTask(
        machine=machine,
        toolpath=toolpath,
        constraints=constraints,
        around=around,
        options=Options.of(
            job.search,
            interpolation=wording.interpolation,
            clock=Clock(wording.dialect, wording.coordinates),
        ),
        keep_clear=job.surrounding.keep_clear,
        gouge_tolerance=job.surrounding.gouge_tolerance,
        job=job,
        wording=wording,
        stated=stated,
        operation=operation,
        process=process,
        factors=load_factors(job),
    )


def _writable(job: Job, machine: Machine) -> WordWriter:
    """Check that a job's program can be written for its machine, whose figures its words depend on."""
    wording = job.program_options.wording(machine)
    require_stated(machine, wording.coordinates)
    return wording


def _keep_stated(job: Job, toolpath: Toolpath) -> tuple[Job, Toolpath]:
    """Keep control, coordinates and settings of a job's input where neither job nor machine gives any.

    The path gets a finding on what can't be kept; `JobError` for a control that isn't written.
    """
    operation = toolpath.operation
    if operation is None:
        return job, toolpath
    given: dict[str, Any] = {}
    stated = Writing.of(job).control
    if stated is None and operation.control:
        if operation.control not in DIALECTS:
            raise JobError(
                f"the program is one of {operation.control!r}, which isn't written; name one (--control)",
                file=toolpath.name,
            )
        given["control"] = operation.control
    dialect = find_dialect(given.get("control", stated or USUAL_CONTROL))
    coordinates = "tip" if operation.tcp else "axes"
    is_program = operation.language != "APT"
    if is_program and "coordinates" not in job.model_fields_set and coordinates in dialect.modes:
        given["coordinates"] = coordinates
    given["nc"], lost = stated_settings(operation, dialect, job.nc, toolpath.name)
    return make_job(job, **given), replace(toolpath, findings=(*toolpath.findings, *lost))


def _require_front(job: Job) -> None:
    """Raise `JobError` for options of a front that don't go together."""
    if job.front is not None and job.search.smoothing:
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


def _with_part_size(job: Job, toolpath: Toolpath, around: Surroundings) -> Toolpath:
    """Add the finding on a part of implausible size to a path that was read: the planner adds its own."""
    file = job.surrounding.part
    if around.part is None or file is None:
        return toolpath
    size, diameter = around.part.extents, toolpath.tool.diameter
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
