"""What a job names, loaded: machine, path or planned passes, engagement, and what stands around."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from fiveaxis.collision import Surroundings
from fiveaxis.contour import (
    Plan,
    PlanOptions,
    PlanReport,
    find_contacts,
    path_quality,
    plan_passes,
)
from fiveaxis.energy import Cut, CuttingCoefficients, EndMill, Factors, Process
from fiveaxis.errors import JobError, SettingError, ToolError
from fiveaxis.job.description import Job
from fiveaxis.job.reading import require_input
from fiveaxis.machine import Machine, load_machine
from fiveaxis.mesh import SUFFIXES as MESH_SUFFIXES
from fiveaxis.nc import read_toolpath
from fiveaxis.toolpath import Tool, Toolpath, parse_tool
from fiveaxis.toolpath.passes import Passes

Progress = Callable[[str, int, int], None]


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
            source=table.source,
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
