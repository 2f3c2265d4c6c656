"""Load what a job names (machine, path or planned passes, engagement, surroundings), and list its files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from fiveaxis.base import (
    MESH_SUFFIXES,
    STAGES,
    USUAL_CONTROL,
    CadFile,
    JobError,
    Progress,
    SettingError,
    Unit,
    Writing,
    read_document,
    unheard,
)
from fiveaxis.cam import (
    Plan,
    PlanOptions,
    PlanReport,
    find_settled_contacts,
    load_mesh,
    path_quality,
    plan_passes,
    read_solid,
)
from fiveaxis.check import Surroundings, names_file
from fiveaxis.job.description import TOOL_FILE, Job
from fiveaxis.job.reading import require_input
from fiveaxis.lab import Factors
from fiveaxis.model import (
    Machine,
    MeshShape,
    Tool,
    Toolpath,
    find_machine,
    lender_of,
    load_machine,
    parse_tool,
    unknown_figures,
    with_powers,
)
from fiveaxis.nc import (
    OperationText,
    ReadOptions,
    control_for,
    control_of,
    find_dialect,
    find_language,
    kind_of,
    load_source,
    read_path_of,
    read_toolpath,
    stated_height,
)
from fiveaxis.show import InputFile, describe_input


def load_job_machine(job: Job, *, shown: bool = False) -> Machine:
    """Load a job's machine with the job's setup, tool length, load and drives.

    `JobError` without a machine, or, unless programs are only shown on it, without a tool length on which the
    other axes depend.
    """
    if job.machine is None:
        raise JobError("--machine is missing; give a name (`fiveaxis machines`) or a machine file")
    machine = load_machine(job.machine, job.assume)
    machine = _with_tool(machine.with_setup(job.setup.offset, job.setup.rotation), job)
    if not shown and any(figure.name == "tool_length" for figure in unknown_figures(machine)):
        raise JobError(
            f"machine {machine.name!r} doesn't always hold the tool along Z, so the other axes depend on the "
            "tool's length; give tool_length, mm from the spindle's gauge point to the tip (--tool-length)"
        )
    if job.load is not None:
        machine = machine.with_load(job.load, machine.load.centre)
    return with_powers(machine, job.drives)


def take_path(
    toolpath: Toolpath | str | Path,
    machine: Machine,
    tool: Tool | str | None,
    around: Surroundings,
    tolerance: float,
    crease: float,
) -> Toolpath:
    """Return a path, read if it is given by its file; its missing surface normals are those of the part.

    Parameters
    ----------
    machine : that a program was written for
    tool : the cutter, in place of the file's, or its name
    tolerance : mm, gap between cutter and part that counts as touching
    crease : deg, as for `find_contacts`

    Raises
    ------
    SettingError
        Neither a path nor a file; a mesh, on which passes have to be planned first; a tool beside a path,
        which has its own.
    FiveAxisError
        As `read_toolpath` and `find_contacts`.
    """
    if isinstance(toolpath, Toolpath):
        if tool is not None:
            raise SettingError(f"the path has a tool, {toolpath.tool}; leave out tool, or give a file")
        return toolpath
    if not isinstance(toolpath, str | Path):
        kind = type(toolpath).__name__
        raise SettingError(f"toolpath is of type {kind}; give a Toolpath, or the file of one")
    file = Path(toolpath)
    if is_mesh(file):
        raise SettingError("is a mesh; plan passes on it first (plan_contour)", file=file)

    cutter = parse_tool(tool) if isinstance(tool, str) else tool

    def read(settings: Mapping[str, Any]) -> Toolpath:
        return read_toolpath(file, tool=cutter, machine=machine, **settings)

    path = read({})
    require_leanable(path)
    if around.part is None or path.has_normals:
        return path
    return find_settled_contacts(path, around.part, tolerance, read, set(), crease=crease)


def load_factors(job: Job) -> Factors | None:
    """Return a job's prices and its emission of a kWh; None where it gives none."""
    table = job.factors
    return (
        None
        if table is None
        else Factors(table.price, table.currency or Factors.currency, table.co2, table.hour)
    )


def load_job_toolpath(job: Job, progress: Progress = unheard) -> Toolpath:
    """Plan on the job's mesh, or read its cutter locations; `JobError` for settings that it doesn't use."""
    if is_mesh(job.input):
        return plan_mesh(job, progress).toolpath
    require_input(job.input)
    progress(STAGES["read"], 0, 1)
    planning = sorted(job.plan.model_fields_set)
    if planning:
        raise JobError(
            f"{', '.join(planning)} is for planning on a mesh, and the input is none; leave it out",
            file=job.input,
        )
    if job.unit == "m":
        raise JobError("unit = m is for meshes, and the input is none; give mm or inch", file=job.input)
    tool = None if job.tool is None else parse_tool(job.tool)
    toolpath = _read_as(job, tool, {})
    require_leanable(toolpath)
    if revises(job):
        toolpath = operation_text(job, toolpath.tool).path_of(toolpath)
    around = job.surrounding
    if around.part is None or toolpath.has_normals:
        return toolpath
    given = {name for name in ("unit", "positions") if getattr(job.reading, name)}
    return find_settled_contacts(
        toolpath,
        load_mesh(around.part, unit=part_unit(job), allow_open=True, **cad_options(job)),
        around.surface_tolerance,
        lambda settings: _read_as(job, tool, settings),
        given,
        crease=job.meshes.crease,
    )


def revises(job: Job) -> bool:
    """Check whether a job's postures go into the lines of its input, a program, and no other is asked for."""
    settings: Any = job.nc
    own_program = {"control", "coordinates"} & job.model_fields_set or settings.model_fields_set
    if own_program or job.program.machine is not None or job.setup.search is not None or is_mesh(job.input):
        return False
    require_input(job.input)
    source = load_source(job.input)
    if kind_of(source) != "program":
        return False
    # A program of another control than the machine's is written anew.
    written_for = control_of(source, find_language(source))
    control = stated_control(job)
    return control is None or written_for in ("", control)


def stated_control(job: Job) -> str | Path | None:
    """Return the control that a job names, or else its machine; None where neither does."""
    named = Writing.of(job).control
    machine = None if named is not None or job.machine is None else load_machine(job.machine)
    return named if machine is None or not machine.control else control_for(machine)


def operation_text(job: Job, tool: Tool) -> OperationText:
    """Read the operation of a job's program beside its text, as `OperationText.of`."""
    options = ReadOptions.of(job.reading, tool=tool, machine=program_machine(job), feed_mm_min=job.feed)
    return OperationText.of(load_source(job.input), options)


def require_leanable(toolpath: Toolpath) -> None:
    """Raise `JobError` for work of a program or CL file in which the tool axis has to stay."""
    operation = toolpath.operation
    if operation is None or operation.kind == "simultaneous":
        return
    raise JobError(
        f"{operation.kind} work is never leaned ({operation}); only operations that turn the tool while "
        "cutting are optimised. To finish a surface in five axes, plan passes on the part (its mesh as the "
        "input), or give contacts and normals (.csv)",
        file=toolpath.name,
        line=operation.first_line,
    )


def _read_as(job: Job, tool: Tool | None, settings: Mapping[str, Any]) -> Toolpath:
    """Read a job's path, with `settings` in place of the job's."""
    options = ReadOptions.of(
        job.reading,
        tool=tool,
        feed_mm_min=job.feed,
        machine=program_machine(job),
        columns=job.columns,
        path_shape=job.path_shape,
    )
    return read_path_of(load_source(job.input), replace(options, **settings))


def program_machine(job: Job) -> Machine | None:
    """Load the machine that an input program was written for, with the job's tool where that is the job's.

    A program that is revised in its lines runs where the job's setup has the part; any other path is set up
    after it is read.
    """
    if job.program.machine is not None:
        return load_machine(job.program.machine)
    if job.machine is None:
        return None
    machine = _with_tool(load_machine(job.machine, job.assume), job)
    return machine.with_setup(job.setup.offset, job.setup.rotation) if revises(job) else machine


def _with_tool(machine: Machine, job: Job) -> Machine:
    return machine if job.tool_length is None else machine.with_tool_length(job.tool_length)


def plan_mesh(job: Job, progress: Progress = unheard) -> Plan:
    """Plan passes on a job's mesh; `JobError` without a tool or file, or for settings of a path."""
    require_input(job.input)
    progress(STAGES["read"], 0, 1)
    if job.tool is None:
        raise JobError("tool is missing: planning on a mesh needs one; give e.g. ball:10", file=job.input)
    foreign = sorted(job.model_fields_set & {"columns"}) + ["program"] * bool(job.program.model_fields_set)
    if foreign:
        raise JobError(
            f"{', '.join(foreign)} is for lists of locations and programs, and the input is a mesh; leave it "
            "out",
            file=job.input,
        )
    options = replace(_plan_options(job), progress=partial(progress, STAGES["plan"]))
    plan = plan_passes(job.input, parse_tool(job.tool), options)
    return plan if job.path_shape is None else replace(plan, toolpath=plan.toolpath.shaped(job.path_shape))


def _plan_options(job: Job) -> PlanOptions:
    options = PlanOptions.of(job.planning, job.meshes, job.bounds, unit=job.unit)
    return options if job.feed is None else replace(options, feed_mm_min=job.feed)


def measure_plan(job: Job, toolpath: Toolpath) -> PlanReport:
    """Measure the ridges and chords of the passes planned on a job's mesh."""
    return path_quality(toolpath, job.input, _plan_options(job))


def is_mesh(path: Path) -> bool:
    """Check by its suffix whether an input is a mesh."""
    return path.suffix.lower() in MESH_SUFFIXES


def load_surroundings(job: Job) -> Surroundings:
    """Load a job's part, stock and fixtures; `JobError` and `MeshError` for what is missing or refused."""
    fixtures = tuple(table.build() for table in job.fixture)
    file, around = part_of(job), job.surrounding
    unit = part_unit(job) if around.part else job.unit
    part = None if file is None else read_solid(file, unit, **cad_options(job))
    height = around.above_table
    if height is None and not is_mesh(job.input) and job.program.machine is None:
        height = stated_height(load_source(job.input))
    near = replace(around, part=part, part_unit=part_unit(job), above_table=height)
    return Surroundings.of(near, fixtures=fixtures, clearances=job.clearance.build())


def part_of(job: Job) -> Path | None:
    """Return the file of the part's mesh: the given one, else the one that passes are planned on."""
    part = job.surrounding.part
    return Path(str(part)) if part else job.input if is_mesh(job.input) else None


def part_unit(job: Job) -> Unit | None:
    """Return the unit of a job's part and stock: the given one, else that of an input mesh, if any."""
    return job.surrounding.part_unit or (job.unit if is_mesh(job.input) else None)


def cad_options(job: Job) -> dict[str, Any]:
    """Return how a job's CAD files are taken, as keywords of `load_mesh`."""
    return vars(CadFile.of(job.meshes))


def describe_inputs(job: Job) -> list[InputFile]:
    """Describe all files of a job by name, hash and size, each once, with its uses."""
    uses: dict[Path, list[str]] = {}
    for use, path in input_files(job):
        uses.setdefault(path, []).append(use)
    return [{**describe_input(path), "used_as": ", ".join(names)} for path, names in uses.items()]


def input_files(job: Job) -> Iterator[tuple[str, Path]]:
    """Yield use and path of the files that a job names, and of those that these name."""
    if job.file is not None:
        yield "job", job.file
    files: dict[str, Any] = {"input": job.input} | {name: getattr(job, name) for name in ("part", "stock")}
    if files["stock"] is not None and not names_file(files["stock"]):
        del files["stock"]
    files |= {f"fixture.{i}": fixture.file for i, fixture in enumerate(job.fixture)}
    if job.tool is not None and job.tool.lower().endswith(TOOL_FILE):
        files["tool"] = Path(job.tool)
    yield from ((use, path) for use, path in files.items() if path is not None)
    control = str(stated_control(job) or USUAL_CONTROL)
    if control.lower().endswith(TOOL_FILE):
        find_dialect(control)  # refuses tables that are based on each other
        yield from (("control", path) for path in _tables(Path(control)))
    machines = {"machine": job.machine, "program.machine": job.program.machine}
    machines["drives"] = lender_of(job.drives)
    for use, name in machines.items():
        if name is not None:
            yield from ((f"{use}.{inner}", path) for inner, path in _machine_files(name))


def _tables(path: Path) -> Iterator[Path]:
    yield path
    based_on = read_document(path, SettingError)[1].get("based_on", "")
    if str(based_on).lower().endswith(TOOL_FILE):
        yield from _tables(path.parent / based_on)


def _machine_files(name: str) -> Iterator[tuple[str, Path]]:
    yield "file", find_machine(name)
    for number, body in enumerate(load_machine(name).bodies):
        if isinstance(body.shape, MeshShape):
            yield f"body.{number}", Path(body.shape.file)
