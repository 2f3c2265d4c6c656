"""From a job to its outcome: load, plan, optimise, verify."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import (
    Plan,
    PlanOptions,
    PlanReport,
    find_contacts,
    path_quality,
    plan_passes,
)
from fiveaxis.contour.mesh import SUFFIXES as MESH_SUFFIXES
from fiveaxis.energy import (
    Budget,
    Cut,
    CuttingCoefficients,
    EndMill,
    Factors,
    Process,
    job_budget,
)
from fiveaxis.errors import JobError, SettingError, ToolError
from fiveaxis.geometry import Array
from fiveaxis.job.clearing import Cleared, keep_clear, without_starts
from fiveaxis.job.description import Job
from fiveaxis.job.inputs import describe_inputs
from fiveaxis.job.program import MadeProgram, ProgramOptions, make_program
from fiveaxis.job.reading import require_input
from fiveaxis.job.release import Gate
from fiveaxis.machine import Machine, load_machine
from fiveaxis.nc import Clock, read_toolpath, require_program
from fiveaxis.posture import Front, Solution, find_front
from fiveaxis.posture import optimise as optimise_postures
from fiveaxis.posture.masks.mask import MaskFunction
from fiveaxis.posture.solution import blocks_energy
from fiveaxis.report import report_document
from fiveaxis.toolpath import Tool, Toolpath, parse_tool
from fiveaxis.toolpath.passes import Passes
from fiveaxis.verification import DEFAULT_TOLERANCES, Report

Progress = Callable[[str, int, int], None]

# Settings of a job that `optimise` takes under the same name, beside its bounds.
SOLVING = (
    "objective",
    "up_penalty",
    "smoothing",
    "time_price",
    "effort",
    "solver",
    "free_start",
    "free_direction",
)


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
        assert self.program.gate is not None
        return self.program.gate

    @property
    def verdict(self) -> Report:
        """What verification found in the program's text."""
        return self.gate.report

    @property
    def ok(self) -> bool:
        """Whether the program has no error."""
        return self.program.ok


def load_job_machine(job: Job) -> Machine:
    """Load a job's machine as the job uses it: setup, tool length, drives of another machine if it says so.

    Raises
    ------
    JobError
        No machine; one that doesn't hold the tool along Z, and no tool length.
    """
    if job.machine is None:
        raise JobError("--machine is missing; write a name (`fiveaxis machines`), a .toml or an .ini file")
    machine = load_machine(job.machine)
    if job.tool_length is None and not machine.length_is_along_z:
        raise JobError(
            f"machine {machine.name!r} doesn't always hold the tool along Z, so the other axes depend on the "
            "tool's length: give tool_length, mm from the spindle's gauge point to the tip (--tool-length)"
        )
    machine = machine.with_setup(job.setup.offset, job.setup.rotation)
    machine = machine.with_tool_length(job.tool_length or 0.0)
    if job.load is not None:
        machine = machine.with_load(job.load, machine.load.centre)
    return machine if job.drives is None else machine.with_drives_of(load_machine(job.drives))


def load_process(job: Job, tool: Tool) -> Process | None:
    """Make the engagement of a job's cut with the path's tool; None where it doesn't say.

    Raises
    ------
    JobError
        An engagement that can't be.
    """
    table = job.process
    if table is None:
        return None
    edge = table.tangential_edge
    shape: Literal["ball", "flat"] = "ball" if tool.cutter.shape == "ball" else "flat"
    if tool.cutter.shape != shape:
        raise JobError(f"process: cutting forces are known for ball and flat ends, and the tool is {tool}")
    try:
        return Process(
            mill=EndMill(shape, tool.diameter, table.teeth, math.radians(table.helix)),
            depth=table.depth,
            width=table.width,
            spindle=table.spindle_rpm * 2.0 * math.pi / 60.0,
            coefficients=CuttingCoefficients(table.tangential, tangential_edge=edge),
            basis=table.basis,
            said=table.source,
        )
    except (SettingError, ToolError) as fault:
        raise JobError(f"process: {fault.message}") from None


def require_cut(process: Process, feed: float) -> None:
    """Refuse, before any work, an engagement that can't be at the path's highest feed, mm/s.

    Raises
    ------
    JobError
        What the cut says against it.
    """
    try:
        Cut(process.mill, process.depth, process.width, feed, process.spindle)
    except (SettingError, ToolError) as fault:
        raise JobError(f"process: {fault.message}") from None


def load_factors(job: Job) -> Factors | None:
    """Give a job's price and emission of a kWh; None where it doesn't say."""
    table = job.factors
    return None if table is None else Factors(table.price, table.currency, table.co2)


def load_job_toolpath(job: Job, progress: Progress | None = None) -> Toolpath:
    """Plan on the job's mesh, or read its list of cutter locations.

    Raises
    ------
    JobError
        No such file, an unknown suffix, or a setting that the input has no use for.
    """
    return load_job_passes(job, progress)[0]


def load_job_passes(job: Job, progress: Progress | None = None) -> tuple[Toolpath, Passes | None]:
    """Load a job's path as `load_job_toolpath` does, with its passes where it is planned."""
    require_input(job.input)
    tool = None if job.tool is None else parse_tool(job.tool)
    if is_mesh(job.input):
        plan = plan_mesh(job, tool, progress)
        return plan.toolpath, plan.passes
    return read_path(job, tool), None


def read_path(job: Job, tool: Tool | None) -> Toolpath:
    """Read a job's list of cutter locations.

    Raises
    ------
    JobError
        A setting that only a mesh has a use for.
    """
    laid = sorted(job.plan.model_fields_set)
    if laid:
        raise JobError(f"{', '.join(laid)} would plan passes on a mesh, and this is none", file=job.input)
    toolpath = read_toolpath(
        job.input,
        tool=tool,
        feed_mm_min=job.feed,
        unit=job.unit,
        machine=program_machine(job),
        positions=job.program.positions,
        start=job.program.start,
        program_zero=job.program.zero,
        rapid_mm_min=job.program.rapid,
        block_delete=job.program.block_delete,
        wrap=job.program.wrap,
        columns=job.columns,
    )
    if job.part is None or toolpath.has_normals:
        return toolpath
    return find_contacts(toolpath, job.part, tolerance=job.surface_tolerance)


def program_machine(job: Job) -> Machine | None:
    """Load the machine that an input program was written for: bare, as its words know no setup of the job."""
    name = job.program.machine or job.machine
    return None if name is None else load_machine(name)


def plan_mesh(job: Job, tool: Tool | None, progress: Progress | None) -> Plan:
    """Lay passes on a job's mesh.

    Raises
    ------
    JobError
        No tool, or a setting that a mesh has no use for.
    """
    if tool is None:
        raise JobError("tool is missing: passes on a mesh need one; give for example ball:10", file=job.input)
    foreign = sorted(job.model_fields_set & {"unit", "columns"}) + ["program"] * bool(
        job.program.model_fields_set
    )
    if foreign:
        raise JobError(
            f"{', '.join(foreign)} is for lists of locations and programs; a mesh is in mm", file=job.input
        )
    step = None if progress is None else lambda done, total: progress("plan", done, total)
    feed = 1000.0 if job.feed is None else job.feed
    options = PlanOptions(**job.plan.model_dump(exclude={"allow_open"}), feed_mm_min=feed)
    return plan_passes(job.input, tool, options, allow_open=job.plan.allow_open, progress=step)


def measure_plan(job: Job, toolpath: Toolpath) -> PlanReport:
    """Measure the ridges and chords of the passes planned on a job's mesh."""
    plan = job.plan
    return path_quality(
        toolpath,
        job.input,
        strategy=plan.strategy,
        raster_angle=plan.raster_angle,
        overhang=plan.overhang,
        allow_open=plan.allow_open,
    )


def is_mesh(path: Path) -> bool:
    """Tell by the suffix whether an input is a mesh."""
    return path.suffix.lower() in MESH_SUFFIXES


def run_job(
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
    return picked_of(outcomes, next(k for k, one in enumerate(solutions) if one.motion is solution.motion))


def picked_of(outcomes: Sequence[Outcome], picked: int) -> Outcome:
    """Give one outcome of a front, and tell in its document what the others are."""
    front = outcomes[picked].front
    assert front is not None
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
    options = {name: getattr(job, name) for name in SOLVING} | job.bounds | {"progress": progress}
    wording = require_program(machine, job.control, job.coordinates, job.winding, job.nc)
    options["interpolation"] = wording.interpolation
    options["clock"] = Clock(wording.dialect, wording.coordinates)
    if job.free_start and passes is not None:
        options["free_start"] = passes
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
        asked = (options if free else without_starts(options)) | {"mask": mask}
        asked["start"] = None if free else start
        if job.front is None:
            return optimise_postures(path, machine, **asked)
        swept = {name: value for name, value in asked.items() if name != "smoothing"}
        fronts.append(find_front(path, machine, job.front, **swept))
        return fronts[-1].pick(job.pick or 1)

    cleared = None
    if around is None or not job.keep_clear:
        solution = once(toolpath, None, job.free_start)
    else:
        cleared = keep_clear(once, toolpath, machine, around, options)
        solution = cleared.solution
    # Paths were searched again; the front is that of the one which was taken.
    front = next((f for f in fronts if any(s.motion is solution.motion for s in f.solutions)), None)
    return solution, front, cleared


def load_surroundings(job: Job) -> Surroundings:
    """Load what stands around a job's tool: part, stock and fixtures.

    Raises
    ------
    JobError
        A fixture whose file is missing.
    MeshError
        A mesh that can't be read, or is refused.
    """
    fixtures = tuple(table.build(Path()) for table in job.fixture)
    return Surroundings.load(part_of(job), job.stock, fixtures, job.clearance.build())


def part_of(job: Job) -> Path | None:
    """Name the part's mesh: the one given, else the one planned on."""
    return job.part or (job.input if is_mesh(job.input) else None)
