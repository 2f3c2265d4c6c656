"""One job: from a part or a path to the files that a machine and its programmer need."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, ValidationError, ValidationInfo, field_validator

from fiveaxis.contour import load_mesh, plan_contour
from fiveaxis.contour.mesh import SUFFIXES as MESH_SUFFIXES
from fiveaxis.energy import Energy, motion_energy
from fiveaxis.errors import FiveAxisError, InputError, JobError, SettingError
from fiveaxis.machine import Machine, load_machine
from fiveaxis.machine.files import READERS as MACHINE_READERS
from fiveaxis.motion import PATH_TOLERANCE, Motion, fill_in
from fiveaxis.nc import DIALECTS, find_dialect, read_toolpath, write_motion, write_program
from fiveaxis.nc.formats import READERS
from fiveaxis.posture import Solution, optimise
from fiveaxis.report import describe_input, report_document, write_json, write_report
from fiveaxis.settings import StrictModel, explain, line_of, read_settings
from fiveaxis.toolpath import Tool, Toolpath, parse_tool, require_range
from fiveaxis.verification import Report, Tolerances, verify
from fiveaxis.viewer import write_preview

if TYPE_CHECKING:
    import trimesh

# Name of the optimised result beside the baselines'.
RESULT = "optimised"

Progress = Callable[[str, int, int], None]


class PlanTable(StrictModel):
    """How passes are laid on a mesh."""

    stepdown: float = Field(1.0, gt=0.0, description="distance of the passes in z, mm")
    spacing: float = Field(0.5, gt=0.0, description="largest distance of contact points along a pass, mm")
    overhang: bool = Field(False, description="overhanging walls only")
    direction: Literal["climb", "conventional"] = "climb"
    allow_open: bool = Field(False, description="plan on a mesh that isn't watertight")


class Job(StrictModel):
    """What to optimise, for which machine, within which bounds."""

    input: Path = Field(description="mesh, CSV or APT file")
    machine: str | None = Field(None, min_length=1, description="name in the library, or a machine file")
    tool: str = Field(description="ball:10 is a ball end mill of 10 mm diameter")
    tilt: tuple[float, float] | None = Field(None, description="angle to the surface normal, deg")
    cone: float | None = Field(None, gt=0.0, le=180.0, description="angle to the programmed tool axis, deg")
    feed: float | None = Field(None, gt=0.0, description="mm/min; overrides the feed of the input")
    unit: Literal["mm", "inch"] | None = Field(None, description="of an input that doesn't say")
    part: Path | None = Field(None, description="mesh of the part, for the gouge check and the preview")
    drives: str | None = Field(None, min_length=1, description="machine whose axis powers are taken instead")
    up_penalty: float = Field(0.0, ge=0.0, description="extra price of moving up against gravity, J/mm")
    max_turn: float = Field(15.0, gt=0.0, description="largest rotary turn in a cutting move, deg")
    control: str = Field("linuxcnc", description="NC dialect")
    plan: PlanTable = PlanTable()

    @field_validator("tilt")
    @classmethod
    def _in_order(cls, tilt: tuple[float, float] | None) -> tuple[float, float] | None:
        if tilt is not None:
            try:
                require_range(*tilt)
            except SettingError as fault:
                raise ValueError(fault.message) from None
        return tilt

    @field_validator("tool", "control")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        try:
            parse_tool(name) if info.field_name == "tool" else find_dialect(name)
        except FiveAxisError as fault:
            raise ValueError(str(fault)) from None
        return name


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
        return self.verdict.ok and self.program.ok


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

    @property
    def ok(self) -> bool:
        """Whether the program may be written: no error, and the ball on its path all along.

        A control does what the blocks say, so what is a warning for the solution's locations, the way between
        them, is an error for a program.
        """
        return self.verdict.ok and "tip-deviation" not in self.verdict.counts

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "blocks": len(self.motion),
            "inserted": self.inserted,
            "path_tolerance_mm": PATH_TOLERANCE,
            "energy": {name: energy.as_dict() for name, energy in self.energy.items()},
            "verification": self.verdict.as_dict() | {"ok": self.ok},
        }


def read_job(path: Path, **settings: Any) -> Job:
    """Read a job file; relative paths in it are relative to the file.

    Parameters
    ----------
    path : a TOML file
    settings : as for `make_job`, in place of the file's own

    Raises
    ------
    JobError
        Missing file, not TOML, unknown key (with the nearest known one), wrong value, a name that stands for
        nothing; with its line.
    """
    job = read_settings(path, Job, JobError)
    places: dict[str, Any] = {"input": path.parent / job.input}
    if job.part is not None:
        places["part"] = path.parent / job.part
    for name in ("machine", "drives"):
        value = getattr(job, name)
        if value is not None and Path(value).suffix.lower() in MACHINE_READERS:
            places[name] = str(path.parent / value)
    own = job.model_copy(update=places)
    _check_names(own, path, replaced=[name for name, value in settings.items() if value is not None])
    return make_job(own, **settings)


def _check_names(job: Job, file: Path, replaced: Collection[str]) -> None:
    """Look for what a job file names, so that a wrong name is reported on its line."""
    checks = {"input": require_input, "part": require_file, "machine": load_machine, "drives": load_machine}
    for key, check in checks.items():
        value = getattr(job, key)
        if value is None or key in replaced:
            continue
        try:
            check(value)
        except InputError as fault:
            if fault.line is not None:  # inside the file that is named
                raise
            line = line_of(file.read_text(encoding="utf-8"), [key])
            raise JobError(f"{key}: {fault}", file=file, line=line) from None


def make_job(base: Job | None = None, **settings: Any) -> Job:
    """Make a job from settings, over those of a base; settings that are None count as not given.

    Raises
    ------
    JobError
        Something is missing or out of range.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    plan = given.pop("plan", {})
    # What nobody set stays unset: `load_job_toolpath` refuses settings that would go unused.
    values = {} if base is None else base.model_dump(exclude_unset=True)
    laid = values.get("plan", {}) | {name: v for name, v in plan.items() if v is not None}
    # One bound replaces the other: a job's tilt doesn't survive a cone from the command line.
    if "cone" in given:
        values.pop("tilt", None)
    elif "tilt" in given:
        values.pop("cone", None)
    try:
        return Job.model_validate(values | given | ({"plan": laid} if laid else {}))
    except ValidationError as fault:
        raise JobError(explain(fault, Job)) from None


def load_job_machine(job: Job) -> Machine:
    """Load a job's machine, with the drives of another one where the job asks for it."""
    if job.machine is None:
        raise JobError("--machine is missing; write a name (`fiveaxis machines`), a .toml or an .ini file")
    machine = load_machine(job.machine)
    return machine if job.drives is None else machine.with_drives_of(load_machine(job.drives))


def load_job_toolpath(job: Job, progress: Progress | None = None) -> Toolpath:
    """Plan on the job's mesh, or read its list of cutter locations.

    Raises
    ------
    JobError
        No such file, an unknown suffix, or a setting that the input has no use for.
    """
    require_input(job.input)
    tool = parse_tool(job.tool)
    if is_mesh(job.input):
        if job.unit is not None:
            raise JobError("unit is for lists of locations; a mesh is in mm (unit)", file=job.input)
        return plan_mesh(job, tool, progress)
    laid = sorted(job.plan.model_fields_set)
    if laid:
        raise JobError(f"{', '.join(laid)} would plan passes on a mesh, and this is none", file=job.input)
    return read_toolpath(job.input, tool=tool, feed_mm_min=job.feed, unit=job.unit)


def require_input(path: Path) -> None:
    """Refuse, with a `JobError`, a folder, a file of an unknown kind, and a missing file."""
    kind = path.with_suffix("") if path.suffix.lower() == ".gz" else path
    if not path.is_dir() and kind.suffix.lower() not in (*MESH_SUFFIXES, *READERS):
        raise JobError(
            f"unknown suffix {kind.suffix!r}; a mesh ({' '.join(MESH_SUFFIXES)}), a list of locations "
            f"({' '.join(READERS)}, also with .gz) or a job (.toml) is needed",
            file=path,
        )
    require_file(path)


def require_file(path: Path) -> None:
    """Refuse, with a `JobError`, what isn't a file."""
    if not path.exists():
        raise JobError("no such file", file=path)
    if path.is_dir():
        raise JobError("is a folder; name a file", file=path)


def plan_mesh(job: Job, tool: Tool, progress: Progress | None) -> Toolpath:
    """Lay waterline passes on a job's mesh."""
    step = None if progress is None else lambda done, total: progress("plan", done, total)
    feed = 1000.0 if job.feed is None else job.feed
    return plan_contour(job.input, tool, **job.plan.model_dump(), feed_mm_min=feed, progress=step)


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
    machine = load_job_machine(job)
    toolpath = load_job_toolpath(job, progress)
    # A part that can't be read is found out before the work, not after it.
    mesh = part_of(job)
    part = None if mesh is None else load_mesh(mesh, allow_open=True)
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
    inputs = [describe_input(p) for p in dict.fromkeys((job.input, mesh or job.input))]
    program = program_motion(solution, part)
    found, driven = verdict.as_dict(), program.as_dict()
    document = report_document(solution, found, inputs=inputs, program=driven)
    return Outcome(job, solution, verdict, program, document)


def program_motion(solution: Solution, part: trimesh.Trimesh | None) -> ProgramMotion:
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

    Everything is made in a temporary folder first, so that a failure leaves the old files as they were, and
    no new folder. A motion with errors gets no NC program, and one from an earlier run is taken away.

    Returns
    -------
    The files, in order of writing.

    Raises
    ------
    SettingError
        The folder can't be made or written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".fiveaxis-", dir=require_folder(folder)) as temporary:
            return _move_in(_make_files(outcome, Path(temporary)), folder)
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None


def require_folder(folder: Path) -> Path:
    """Refuse a folder for results that can't be made or written, before any work is done for it.

    Returns
    -------
    The folder, or the nearest one above it that exists.

    Raises
    ------
    SettingError
        A file in its place, no permission.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise SettingError("is a file; name a folder for the results", file=there)
    try:
        with tempfile.TemporaryDirectory(prefix=".fiveaxis-", dir=there):
            return there
    except OSError as fault:
        raise SettingError(f"can't be written: {fault.strerror or fault}", file=folder) from None


def _move_in(made: Sequence[Path], folder: Path) -> list[Path]:
    """Put finished files into a folder, in place of those of an earlier run."""
    targets = [folder / path.name for path in made]
    programs = [folder / f"program{dialect.suffix}" for dialect in DIALECTS.values()]
    taken = next((path for path in (*targets, *programs) if path.is_dir()), None)
    if taken is not None:
        raise SettingError("is a folder, and a file of that name is to be written", file=taken)
    folder.mkdir(parents=True, exist_ok=True)
    for path in programs:
        path.unlink(missing_ok=True)
    return [path.replace(target) for path, target in zip(made, targets, strict=True)]


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
        joules = f"{energy.total:.1f} J"
        lines[f"energy {name}"] = f"{joules} travel metric of the feed drives, in blocks like these"
    lines["verification"] = "no errors; shank, holder and machine bodies unchecked"
    return lines
