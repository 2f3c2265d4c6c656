"""What a job asks for: a file or options in, `Job` out."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, PrivateAttr, ValidationError, ValidationInfo, field_validator, model_validator

from fiveaxis.codes import require_codes
from fiveaxis.collision import ClearanceTable, FixtureTable
from fiveaxis.contour.mesh import SUFFIXES as MESH_SUFFIXES
from fiveaxis.contour.options import Direction, Order, Strategy
from fiveaxis.errors import FiveAxisError, InputError, JobError, SettingError
from fiveaxis.machine import load_machine
from fiveaxis.machine.chain import Triple
from fiveaxis.machine.files import READERS as MACHINE_READERS
from fiveaxis.nc import ProgramSettings, find_dialect
from fiveaxis.nc.formats import READERS
from fiveaxis.settings import (
    StrictModel,
    explain,
    line_of,
    read_document,
    read_settings,
    validate_settings,
)
from fiveaxis.toolpath import parse_tool, require_range

TOOL_FILE = ".toml"
# Table that makes many jobs of one file (`fiveaxis.batch`).
SWEEP = "sweep"
# How several lists of a sweep are combined, and how many jobs one file may make: a list too long by mistake
# shouldn't keep a computer busy for a year.
COMBINE, COMBINE_WAYS = "combine", ("product", "zip")
LARGEST_SWEEP = 10_000

# What of a setup the optimiser may choose.
SEARCHED = ("x", "y", "z", "angle")

# Settings that bound the tool's lean, and the turns of the rotary axes.
LEANING = ("tilt", "cone", "lead", "lean", "plane")
BOUNDS = (*LEANING, "hold", "max_turn", "turn_rate", "singular_cone", "singular_rate")


class PlanTable(StrictModel):
    """How passes are laid on a mesh."""

    strategy: Strategy = Field("waterline", description="horizontal sections, or upright parallel ones")
    stepdown: float | None = Field(None, gt=0.0, description="distance of waterlines in z, mm; else 1")
    stepover: float | None = Field(None, gt=0.0, description="distance of a raster's sections, mm; else 1")
    scallop: float | None = Field(None, gt=0.0, description="highest ridge between passes, mm")
    raster_angle: float | None = Field(None, description="direction of a raster, from x towards y, deg")
    spacing: float = Field(0.5, gt=0.0, description="largest distance of contact points along a pass, mm")
    overhang: bool = Field(False, description="overhanging walls only")
    spiral: bool = Field(False, description="join closed waterlines to spirals")
    direction: Direction = Field("climb", description="how the cutter runs along its passes")
    order: Order = Field("levels", description="section by section, or as links are short")
    lead_in: float = Field(0.0, ge=0.0, description="radius of the arcs that lead to passes, mm")
    lead_out: float = Field(0.0, ge=0.0, description="radius of the arcs that lead from passes, mm")
    min_length: float = Field(0.0, ge=0.0, description="shortest pass that is cut, mm")
    allow_open: bool = Field(False, description="plan on a mesh that isn't watertight")


class ProgramTable(StrictModel):
    """How an NC program is read that is the job's input."""

    machine: str | None = Field(
        None, min_length=1, description="that it was written for, by name or file; else the job's"
    )
    positions: Literal["table", "machine"] = Field(
        "table", description="whether tip positions turn with the table or stay with the machine"
    )
    start: dict[str, float] = Field({}, description="where axes stand before it, by letter, mm and deg")
    zero: dict[str, float] | None = Field(
        None, description="its zero (G54) in machine coordinates, by letter, mm and deg"
    )
    rapid: float | None = Field(None, gt=0.0, description="mm/min, of axes whose speed isn't known")
    block_delete: bool = Field(False, description="skip blocks that begin with /")
    wrap: Literal["unwound", "shorter", "signed"] | None = Field(
        None, description="how rotary words of axes with more than a turn count; by default as they stand"
    )


class SetupSearch(StrictModel):
    """Where the optimiser may set the workpiece up; what has no range stays as given."""

    x: tuple[float, float] | None = Field(None, description="range of the workpiece zero's X, mm")
    y: tuple[float, float] | None = Field(None, description="range of its Y, mm")
    z: tuple[float, float] | None = Field(None, description="range of its Z, mm")
    angle: tuple[float, float] | None = Field(
        None, description="range of the rotation about the machine's Z through the workpiece zero, deg"
    )
    tries: int = Field(40, ge=2, le=2000, description="how many setups are looked at, on some of the path")

    @model_validator(mode="after")
    def _has_a_range(self) -> SetupSearch:
        ranges = {name: ends for name in SEARCHED if (ends := getattr(self, name)) is not None}
        if not ranges:
            raise ValueError(f"setup.search has no range; give {', '.join(SEARCHED)}, or some of them")
        for name, (low, high) in ranges.items():
            if not low < high:
                raise ValueError(
                    f"setup.search.{name} = [{low:g}, {high:g}]: the first must be the lower one"
                )
        return self


class SetupTable(StrictModel):
    """Where the workpiece stands on the table, with every axis at 0."""

    offset: Triple = Field((0.0, 0.0, 0.0), description="workpiece zero in the machine frame, mm")
    rotation: Triple = Field((0.0, 0.0, 0.0), description="about the machine's X, then Y, then Z, deg")
    search: SetupSearch | None = Field(
        None, description="where the optimiser may set it up instead, with postures chosen anew"
    )


class FixtureFile(StrictModel):
    """Fixtures and clearances in a file of their own."""

    fixture: tuple[FixtureTable, ...] = ()
    clearance: ClearanceTable | None = None


class ProcessTable(StrictModel):
    """The cut, the same all along the path: for the energy of the whole job."""

    spindle_rpm: float = Field(gt=0.0, description="speed of the spindle, rev/min")
    teeth: int = Field(ge=1, description="of the cutter")
    helix: float = Field(0.0, gt=-90.0, lt=90.0, description="angle of its teeth, deg")
    depth: float = Field(ge=0.0, description="along the surface normal, mm")
    width: float = Field(ge=0.0, description="distance of the passes, mm")
    tangential: float = Field(gt=0.0, description="cutting coefficient K_tc, N/mm2")
    tangential_edge: float = Field(0.0, ge=0.0, description="edge coefficient K_te, N/mm")
    basis: Literal["measured", "fitted", "assumed"] = Field(description="of the coefficients")
    source: str = Field(min_length=1, description="where the coefficients come from, or why assumed")


class FactorsTable(StrictModel):
    """What a kWh costs and emits."""

    price: float | None = Field(None, ge=0.0, description="of 1 kWh, in the currency")
    currency: str = Field("EUR", description="of the price")
    co2: float | None = Field(None, ge=0.0, description="emission of the electricity, kg of CO2 per kWh")
    source: str = Field(min_length=1, description="where price and factor come from")


class Job(StrictModel):
    """What to optimise, for which machine, within which bounds."""

    input: Path = Field(description="mesh, list of points, APT file or NC program")
    machine: str | None = Field(None, min_length=1, description="name in the library, or a machine file")
    tool: str | None = Field(
        None, description="ball:10, bull:16:4, a tool file…; by default what the input says"
    )
    tilt: tuple[float, float] | None = Field(None, description="angle to the surface normal, deg")
    cone: float | None = Field(None, gt=0.0, le=180.0, description="angle to the programmed tool axis, deg")
    lead: tuple[float, float] | None = Field(None, description="tipped forwards into the feed, deg")
    lean: tuple[float, float] | None = Field(None, description="tipped to the left of the feed, deg")
    plane: Triple | None = Field(None, description="at right angles to a plane that holds the tool axis")
    hold: dict[str, float] = Field({}, description="rotary axes that stay at an angle, by letter, deg")
    feed: float | None = Field(None, gt=0.0, description="mm/min; overrides the feed of the input")
    unit: Literal["mm", "inch"] | None = Field(None, description="of an input that doesn't say")
    columns: tuple[str, ...] | None = Field(None, description="of a list of points without header")
    part: Path | None = Field(
        None, description="mesh of the part: for normals that the input lacks, the gouge check, the preview"
    )
    stock: Path | None = Field(None, description="mesh of what the part is cut from, for collisions")
    fixture: tuple[FixtureTable, ...] = Field((), description="clamps and vices, in the workpiece frame")
    clearance: ClearanceTable = ClearanceTable()
    keep_clear: bool = Field(
        True, description="choose postures that keep cutter, shank and holder clear; else only verify"
    )
    surface_tolerance: float = Field(
        0.05, gt=0.0, description="gap between cutter and part that counts as touching, mm"
    )
    drives: str | None = Field(None, min_length=1, description="machine whose axis powers are taken instead")
    up_penalty: float = Field(0.0, ge=0.0, description="extra price of moving up against gravity, J/mm")
    max_turn: float = Field(15.0, gt=0.0, description="largest rotary turn in a cutting move, deg")
    turn_rate: float | None = Field(None, gt=0.0, description="largest rotary turn along a cut, deg/mm")
    smoothing: float = Field(0.0, ge=0.0, description="price of bends, J/rad2")
    time_price: float | None = Field(
        None, ge=0.0, description="W, of time lost to slow axes; by default the machine's base power"
    )
    singular_cone: float | None = Field(
        None, gt=0.0, lt=90.0, description="about the first rotary axis, in which it is held, half angle, deg"
    )
    singular_rate: float = Field(0.0, ge=0.0, description="largest turn of that axis in the cone, deg/mm")
    effort: Literal["quick", "normal", "thorough"] = Field(
        "normal", description="how much is searched before the best is taken"
    )
    front: int | None = Field(
        None, ge=2, le=50, description="solutions between the cheapest path and the steadiest one"
    )
    free_start: bool = Field(
        False, description="let closed passes begin where it is cheapest; where links are planned, these too"
    )
    free_direction: bool = Field(
        False, description="with free_start: let them be followed backwards, climb or conventional"
    )
    control: str = Field("linuxcnc", description="NC dialect: a name, or a table of one's own (.toml)")
    coordinates: Literal["axes", "tip", "vector"] | None = Field(
        None, description="of the NC program; by default axes, where the control has them"
    )
    nc: ProgramSettings = Field(ProgramSettings(), description="tool, spindle, coolant… of the NC program")
    winding: Literal["unwound", "modulo", "rezero"] = Field(
        "unwound", description="how the program counts endless rotary axes"
    )
    thin: bool = Field(
        True, description="leave out blocks that the NC program's path doesn't need; else keep them all"
    )
    override: tuple[str, ...] = Field(
        (), description="codes of errors with which the program is written all the same"
    )
    tool_length: float | None = Field(
        None, ge=0.0, description="from the spindle's gauge point to the tip, mm"
    )
    setup: SetupTable = SetupTable()
    load: float | None = Field(None, ge=0.0, description="mass of workpiece, vice and fixture, kg")
    process: ProcessTable | None = None
    factors: FactorsTable | None = None
    plan: PlanTable = PlanTable()
    program: ProgramTable = ProgramTable()
    _override_by: str = PrivateAttr("whoever called this run (--override)")
    _file: Path | None = PrivateAttr(None)

    @property
    def file(self) -> Path | None:
        """The file that says it; None for a job that was put together by a call."""
        return self._file

    @property
    def override_by(self) -> str:
        """Who accepts errors by name: the job file, or the call that stands in for it."""
        return self._override_by

    @property
    def bounds(self) -> dict[str, Any]:
        """What bounds postures and turns, as `optimise` and `verify` take it."""
        return {name: getattr(self, name) for name in BOUNDS}

    @field_validator("tilt")
    @classmethod
    def _in_order(cls, tilt: tuple[float, float] | None) -> tuple[float, float] | None:
        if tilt is not None:
            try:
                require_range(*tilt)
            except SettingError as fault:
                raise ValueError(fault.message) from None
        return tilt

    @field_validator("override")
    @classmethod
    def _codes(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        try:
            return require_codes(names)
        except SettingError as fault:
            raise ValueError(fault.message) from None

    @field_validator("tool", "control")
    @classmethod
    def _known(cls, name: str | None, info: ValidationInfo) -> str | None:
        if name is None or name.lower().endswith(TOOL_FILE):
            return name  # a file is read when its folder is known
        try:
            parse_tool(name) if info.field_name == "tool" else find_dialect(name)
        except FiveAxisError as fault:
            raise ValueError(str(fault)) from None
        return name


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
    text, data = read_document(path, JobError)
    if SWEEP in data:
        line = line_of(text, [SWEEP])
        raise JobError(
            "is a sweep, many jobs in one file; run it with `fiveaxis batch`", file=path, line=line
        )
    return build_job(data, text, path, **settings)


def build_job(data: dict[str, Any], text: str, path: Path, **settings: Any) -> Job:
    """Build a job from what its file says, as `read_job` does.

    Parameters
    ----------
    data, text : what the file says, and its text, in which lines are looked for
    path : the file; relative paths are relative to it
    settings : as for `make_job`, in place of the file's own

    Raises
    ------
    JobError
        As `read_job`.
    """
    job = validate_settings(data, text, path, Job, JobError)
    places: dict[str, Any] = {"input": path.parent / job.input}
    for name in ("part", "stock"):
        if getattr(job, name) is not None:
            places[name] = path.parent / getattr(job, name)
    places["fixture"] = tuple(fixture.beside(path.parent) for fixture in job.fixture)
    if job.tool is not None and job.tool.lower().endswith(TOOL_FILE):
        places["tool"] = str(path.parent / job.tool)
    if job.control.lower().endswith(TOOL_FILE):
        places["control"] = str(path.parent / job.control)
    for name in ("machine", "drives"):
        value = getattr(job, name)
        if value is not None and Path(value).suffix.lower() in MACHINE_READERS:
            places[name] = str(path.parent / value)
    written_for = job.program.machine
    if written_for is not None and Path(written_for).suffix.lower() in MACHINE_READERS:
        beside = {"machine": str(path.parent / written_for)}
        places["program"] = job.program.model_copy(update=beside)
    own = job.model_copy(update=places)
    own._file = path
    own._override_by = f"the job file {path.name} (override)"
    _check_names(own, path, replaced=[name for name, value in settings.items() if value is not None])
    return make_job(own, **settings)


def read_fixtures(path: Path) -> dict[str, Any]:
    """Read fixtures and clearances from a file of their own, as settings for `make_job`.

    Raises
    ------
    JobError
        As `read_job`.
    """
    found = read_settings(path, FixtureFile, JobError)
    fixtures = tuple(fixture.beside(path.parent) for fixture in found.fixture)
    return {"fixture": fixtures or None, "clearance": found.clearance}


def _check_names(job: Job, file: Path, replaced: Collection[str]) -> None:
    """Look for what a job file names, so that a wrong name is reported on its line."""
    checks: dict[str, Callable[[Any], object]] = {
        "input": require_input,
        "part": require_file,
        "stock": require_file,
        "machine": load_machine,
        "drives": load_machine,
        "tool": parse_tool,
    }
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
    # What nobody set stays unset: `load_job_toolpath` refuses settings that would go unused.
    values = {} if base is None else base.model_dump(exclude_unset=True)
    for name in ("plan", "program", "setup", "nc"):
        table = {key: value for key, value in given.pop(name, {}).items() if value is not None}
        if table:
            values[name] = values.get(name, {}) | table
    # One bound replaces the other: a job's tilt doesn't survive a cone from the command line.
    if "cone" in given:
        values.pop("tilt", None)
    elif "tilt" in given:
        values.pop("cone", None)
    try:
        made = Job.model_validate(values | given)
    except ValidationError as fault:
        raise JobError(explain(fault, Job)) from None
    if base is not None:
        made._file = base.file
        if "override" not in given:
            made._override_by = base.override_by
    return made


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
