"""One job: from a part or a path to the files that a machine and its programmer need."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from fiveaxis.contour import plan_contour
from fiveaxis.energy import Energy, motion_energy
from fiveaxis.errors import JobError
from fiveaxis.machine import Machine, load_machine
from fiveaxis.motion import PATH_TOLERANCE, Motion, fill_in
from fiveaxis.nc import DIALECTS, find_dialect, read_toolpath, write_motion, write_program
from fiveaxis.posture import Solution, optimise
from fiveaxis.report import describe_input, report_document, write_json, write_report
from fiveaxis.settings import StrictModel, read_settings
from fiveaxis.toolpath import Tool, Toolpath, parse_tool
from fiveaxis.verification import Report, Tolerances, verify
from fiveaxis.viewer import write_preview

# Name of the optimised result beside the baselines'.
RESULT = "optimised"
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off")

Progress = Callable[[str, int, int], None]


class PlanTable(StrictModel):
    """How passes are laid on a mesh."""

    stepdown: float = Field(1.0, description="distance of the passes in z, mm")
    spacing: float = Field(0.5, description="largest distance of contact points along a pass, mm")
    overhang: bool = Field(False, description="overhanging walls only")
    direction: Literal["climb", "conventional"] = "climb"
    allow_open: bool = Field(False, description="plan on a mesh that isn't watertight")


class Job(StrictModel):
    """What to optimise, for which machine, within which bounds."""

    input: Path = Field(description="mesh, CSV or APT file")
    machine: str = Field(description="name in the library, or a machine file")
    tool: str = Field(description="ball:10 is a ball end mill of 10 mm diameter")
    tilt: tuple[float, float] | None = Field(None, description="angle to the surface normal, deg")
    cone: float | None = Field(None, description="angle to the programmed tool axis, deg")
    feed: float | None = Field(None, gt=0.0, description="mm/min; overrides the feed of the input")
    unit: Literal["mm", "inch"] | None = Field(None, description="of an input that doesn't say")
    part: Path | None = Field(None, description="mesh of the part, for the gouge check and the preview")
    drives: str | None = Field(None, description="machine whose axis powers are taken instead")
    up_penalty: float = Field(0.0, ge=0.0, description="extra price of moving up against gravity, J/mm")
    max_turn: float = Field(15.0, gt=0.0, description="largest rotary turn in a cutting move, deg")
    control: str = Field("linuxcnc", description="NC dialect")
    plan: PlanTable = PlanTable()


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a job gave: the solution, the verdict on it, and the report's document."""

    job: Job
    solution: Solution
    verdict: Report
    program: ProgramMotion
    document: dict[str, Any]

    @property
    def ok(self) -> bool:
        """Whether neither the solution nor the program's own motion has an error."""
        return self.verdict.ok and self.program.verdict.ok


@dataclass(frozen=True, eq=False)
class ProgramMotion:
    """The motion that an NC program in machine coordinates describes: locations inserted to hold the path.

    Parameters
    ----------
    motion : what the program's blocks say
    inserted : locations that the solution doesn't have
    energy : of the solution's and of each baseline's program, by name
    verdict : of the checks that don't need a normal
    """

    motion: Motion
    inserted: int
    energy: dict[str, Energy]
    verdict: Report

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "blocks": len(self.motion),
            "inserted": self.inserted,
            "path_tolerance_mm": PATH_TOLERANCE,
            "energy": {name: energy.as_dict() for name, energy in self.energy.items()},
            "verification": self.verdict.as_dict(),
        }


def read_job(path: Path) -> Job:
    """Read a job file; relative paths in it are relative to the file.

    Raises
    ------
    JobError
        Missing file, not TOML, unknown key (with the nearest known one), wrong value; with its line.
    """
    job = read_settings(path, Job, JobError)
    places: dict[str, Any] = {"input": path.parent / job.input}
    if job.part is not None:
        places["part"] = path.parent / job.part
    for name in ("machine", "drives"):
        value = getattr(job, name)
        if value is not None and value.endswith(".toml"):
            places[name] = str(path.parent / value)
    return job.model_copy(update=places)


def make_job(base: Job | None, **settings: Any) -> Job:
    """Make a job from settings, over those of a base; settings that are None count as not given.

    Raises
    ------
    JobError
        Something is missing or out of range.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    plan = given.pop("plan", {})
    values = {} if base is None else base.model_dump()
    values["plan"] = values.get("plan", {}) | {name: v for name, v in plan.items() if v is not None}
    # One bound replaces the other: a job's tilt doesn't survive a cone from the command line.
    if "cone" in given:
        values.pop("tilt", None)
    elif "tilt" in given:
        values.pop("cone", None)
    try:
        return Job.model_validate(values | given)
    except ValidationError as fault:
        messages = (f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in fault.errors())
        raise JobError("; ".join(messages)) from None


def load_job_machine(job: Job) -> Machine:
    """Load a job's machine, with the drives of another one where the job asks for it."""
    machine = load_machine(job.machine)
    return machine if job.drives is None else machine.with_drives_of(load_machine(job.drives))


def load_job_toolpath(job: Job, progress: Progress | None = None) -> Toolpath:
    """Plan on the job's mesh, or read its list of cutter locations."""
    tool = parse_tool(job.tool)
    if is_mesh(job.input):
        return plan_mesh(job, tool, progress)
    return read_toolpath(job.input, tool=tool, feed_mm_min=job.feed, unit=job.unit)


def plan_mesh(job: Job, tool: Tool, progress: Progress | None) -> Toolpath:
    """Lay waterline passes on the job's mesh."""
    step = None if progress is None else lambda done, total: progress("plan", done, total)
    return plan_contour(
        job.input,
        tool,
        stepdown=job.plan.stepdown,
        spacing=job.plan.spacing,
        overhang=job.plan.overhang,
        direction=job.plan.direction,
        allow_open=job.plan.allow_open,
        feed_mm_min=1000.0 if job.feed is None else job.feed,
        progress=step,
    )


def is_mesh(path: Path) -> bool:
    """Tell by the suffix whether an input is a mesh."""
    return path.suffix.lower() in MESH_SUFFIXES


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Take a job through planning or reading, optimisation and verification.

    Parameters
    ----------
    job : what to do
    progress : called with a stage's name, steps done and steps in all

    Raises
    ------
    FiveAxisError
        Wrong input, or no admissible posture somewhere (`Infeasible`).
    """
    find_dialect(job.control)  # an unknown control is found out before the work, not after it
    machine = load_job_machine(job)
    toolpath = load_job_toolpath(job, progress)
    part = part_of(job)
    solution = optimise(
        toolpath,
        machine,
        tilt=job.tilt,
        cone=job.cone,
        up_penalty=job.up_penalty,
        max_turn=job.max_turn,
        progress=progress,
    )
    verdict = verify(solution.motion, machine, toolpath, tilt=job.tilt, cone=job.cone, part=part)
    inputs = [describe_input(p) for p in dict.fromkeys((job.input, part or job.input))]
    program = program_motion(solution, part)
    found, driven = verdict.as_dict(), program.as_dict()
    document = report_document(solution, found, inputs=inputs, program=driven)
    return Outcome(job, solution, verdict, program, document)


def program_motion(solution: Solution, part: Path | None) -> ProgramMotion:
    """Work out, and verify, what an NC program in machine coordinates makes of a solution."""
    machine, toolpath = solution.machine, solution.toolpath
    rotary = solution.motion.positions[:, machine.rotary_columns]
    path, motion = fill_in(toolpath, machine, rotary)
    energy = {RESULT: motion_energy(machine, motion)}
    for name, baseline in solution.compared.items():
        angles = baseline.motion.positions[:, machine.rotary_columns]
        energy[name] = motion_energy(machine, fill_in(toolpath, machine, angles)[1])
    # An inserted location lies on a chord of the path, and no deeper than a chord may.
    allowed = Tolerances(gouge=Tolerances().chord_gouge)
    verdict = verify(motion, machine, path, part=part, tolerances=allowed)
    return ProgramMotion(motion, len(motion) - len(toolpath), energy, verdict)


def part_of(job: Job) -> Path | None:
    """Name the part's mesh: the one given, else the one planned on."""
    return job.part or (job.input if is_mesh(job.input) else None)


def write_outcome(outcome: Outcome, folder: Path) -> list[Path]:
    """Write motion, report, preview and NC program into a folder.

    Everything is made in a temporary folder first, so that a failure leaves the old files as they were. A
    motion with errors gets no NC program, and one from an earlier run is taken away.

    Returns
    -------
    The files, in order of writing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".fiveaxis-", dir=folder) as temporary:
        made = _make_files(outcome, Path(temporary))
        for dialect in DIALECTS.values():
            (folder / f"program{dialect.suffix}").unlink(missing_ok=True)
        return [path.replace(folder / path.name) for path in made]


def _make_files(outcome: Outcome, folder: Path) -> list[Path]:
    job, solution = outcome.job, outcome.solution
    made = [
        write_motion(solution.motion, folder / "motion.csv", solution.machine),
        write_json(outcome.document, folder / "report.json"),
        write_report(solution, outcome.document, folder / "report.html"),
        write_preview(solution, folder / "preview.html", part=part_of(job)),
    ]
    if outcome.ok:
        path = folder / f"program{find_dialect(job.control).suffix}"
        machine, header = solution.machine, _header(outcome)
        made.append(
            write_program(outcome.program.motion, path, machine=machine, control=job.control, header=header)
        )
    return made


def _header(outcome: Outcome) -> dict[str, str]:
    """Say in the program where it comes from and what it costs."""
    solution = outcome.solution
    lines = {"tool": str(solution.toolpath.tool)}
    for number, source in enumerate(outcome.document["inputs"], start=1):
        lines[f"source {number}"] = f"{source['name']} sha256 {source['sha256']}"
    for name, energy in outcome.program.energy.items():
        lines[f"energy {name}"] = (
            f"{energy.total:.1f} J travel metric of the feed drives, in blocks like these"
        )
    lines["verification"] = "no errors; shank, holder and machine bodies unchecked"
    return lines
