"""The settings of a job file."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator

from fiveaxis.base import (
    HIGHEST_FEED,
    Bounds,
    Costs,
    FiveAxisError,
    Meshes,
    OnMachine,
    Placing,
    Planning,
    Reading,
    ReadProgram,
    Search,
    StrictModel,
    Surrounding,
    Unit,
    Writing,
    require_codes,
    table_of,
)
from fiveaxis.check import ClearanceTable, FixtureTable
from fiveaxis.lab import ProcessTable
from fiveaxis.model import Constraints, parse_tool, require_range, tools_by_number
from fiveaxis.nc import ProgramOptions, ProgramSettings, find_dialect

TOOL_FILE = ".toml"
# Table that makes many jobs of one file (`fiveaxis.job.batch`), and its key for how several lists are
# combined.
SWEEP, COMBINE = "sweep", "combine"
COMBINATIONS = ("product", "zip")
# Most jobs of one file: a list too long by mistake shouldn't keep a computer busy for a year.
LARGEST_SWEEP = 10_000

# What the optimiser may choose of a setup.
SEARCHED = ("x", "y", "z", "angle")


class _WrittenFor(StrictModel):
    machine: str | None = Field(
        None,
        min_length=1,
        description="machine that it was written for, by name or file; by default the job's",
        examples=["hayashi-640123"],
    )


# What a program may be worse in than the one that it replaces, if that is allowed.
Trade = Literal["slower", "rougher"]


class SetupSearch(StrictModel):
    """Ranges within which the optimiser may set up the workpiece; without a range a value stays as given."""

    auto: bool = Field(
        False, description="search all four about the place that is given or chosen, where no range is given"
    )
    x: tuple[float, float] | None = Field(
        None, description="range of the workpiece zero's X, mm", examples=[(-50, 50)]
    )
    y: tuple[float, float] | None = Field(None, description="range of its Y, mm", examples=[(-50, 50)])
    z: tuple[float, float] | None = Field(None, description="range of its Z, mm", examples=[(0, 50)])
    angle: tuple[float, float] | None = Field(
        None,
        description="range of the rotation about the machine's Z through the workpiece zero, deg",
        examples=[(-180, 180)],
    )
    tries: int = Field(40, ge=2, le=2000, description="how many setups are tried, on some of the locations")

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """The ranges by name, lowest and highest, mm and deg."""
        return {name: ends for name in SEARCHED if (ends := getattr(self, name)) is not None}

    @model_validator(mode="after")
    def _has_a_range(self) -> SetupSearch:
        if not self.ranges and not self.auto:
            raise ValueError(f"setup.search has no range; give {', '.join(SEARCHED)}, some of them, or auto")
        for name, (low, high) in self.ranges.items():
            if not low < high:
                raise ValueError(
                    f"setup.search.{name} = [{low:g}, {high:g}]: the first must be the lower one"
                )
        return self


class _Searched(StrictModel):
    search: SetupSearch | None = Field(
        None, description="ranges within which the optimiser may choose the setup together with the postures"
    )


class FixtureFile(StrictModel):
    """Fixtures and clearances in a separate file."""

    fixture: tuple[FixtureTable, ...] = ()
    clearance: ClearanceTable | None = None


class _Sourced(StrictModel):
    source: str = Field(
        min_length=1,
        description="where prices and emission come from",
        examples=["where price and factor come from"],
    )


class _Input(StrictModel):
    input: Path = Field(description="mesh, list of points, APT file or NC program")
    tool: str | None = Field(
        None,
        description="ball:10, bull:16:4, a tool file…; of a program with several 3=ball:6,5=bull:16:4, by "
        "their numbers; by default the input's tool",
    )


# Tables with the options of groups; mypy sees classes with both.
if TYPE_CHECKING:
    PlanTable = StrictModel
    ProgramTable = _WrittenFor

    class SetupTable(_Searched, Placing): ...  # noqa: D101

    class FactorsTable(_Sourced, Costs): ...  # noqa: D101

    class _Bounded(_Input, OnMachine, Bounds, Surrounding, Meshes, Search, Writing): ...

else:
    PlanTable, ProgramTable = table_of(Planning, StrictModel), table_of(ReadProgram, _WrittenFor)
    SetupTable, FactorsTable = table_of(Placing, _Searched), table_of(Costs, _Sourced)
    groups = (OnMachine, Bounds, Surrounding, Meshes, Search, Writing)
    _Bounded = reduce(lambda base, group: table_of(group, base), groups, _Input)


class Job(_Bounded):
    """What to optimise, for which machine, within which bounds."""

    feed: float | None = Field(
        None, gt=0.0, le=HIGHEST_FEED, description="mm/min; replaces the input's feed", examples=[1000]
    )
    unit: Unit | None = Field(
        None,
        description="unit of lengths of an input that doesn't state it; m for meshes only",
        examples=["mm"],
    )
    columns: tuple[str, ...] | None = Field(
        None,
        description="columns of a list of points without a header line",
        examples=[["x", "y", "z", "nx", "ny", "nz"]],
    )
    fixture: tuple[FixtureTable, ...] = Field((), description="clamps and vices, in the workpiece frame")
    clearance: ClearanceTable = ClearanceTable()
    path_shape: Literal["smooth", "chord"] | None = Field(
        None,
        description="what lies between locations: a smooth curve if they tell one, or the chord; by default "
        "smooth for planned paths and points with normals, programs and CL files as they state it",
        examples=["chord"],
    )
    front: int | None = Field(
        None,
        ge=2,
        le=50,
        description="number of solutions from the cheapest program to the fastest one, or to the steadiest "
        "where no accelerations are known",
        examples=[5],
    )
    feed_share: float | None = Field(
        None,
        gt=0.0,
        lt=1.0,
        description="with front: least share of the feed, where slower cuts save energy",
        examples=[0.7],
    )
    pick: int | None = Field(
        None,
        ge=1,
        le=50,
        description="with front: number of the solution to deliver; 1 is the cheapest",
        examples=[2],
    )
    allow: tuple[Trade, ...] = Field(
        (),
        description="for a program that is revised in its own lines: what a cheaper one may be worse in, "
        "slower (by more than 1 %) or rougher (more than 10 % more starts and reversals of axes)",
    )
    edge_use: bool = Field(
        False, description="report where on the cutter's edge the path cuts, by contact angle"
    )
    nc: ProgramSettings = Field(ProgramSettings(), description="tool, spindle, coolant… of the NC program")
    setup: SetupTable = SetupTable()
    process: ProcessTable | None = None
    factors: FactorsTable | None = None
    plan: PlanTable = PlanTable()
    program: ProgramTable = ProgramTable()
    _override_by: str = PrivateAttr("whoever called this run (--override)")
    _file: Path | None = PrivateAttr(None)

    @property
    def file(self) -> Path | None:
        """The job file; None for a job made by a call."""
        return self._file

    @property
    def override_by(self) -> str:
        """Who accepts errors by name: the job file, or the caller."""
        return self._override_by

    def with_origin(self, file: Path | None, override_by: str) -> Job:
        """Return the same job with its file and who accepts errors by name."""
        job = self.model_copy()
        job._file, job._override_by = file, override_by
        return job

    @property
    def bounds(self) -> Bounds:
        """The bounds on postures and turns as given, in degrees; the spindle's speed as the job states it."""
        bounds = Bounds.of(self)
        if bounds.spindle_speed is not None:
            return bounds
        process = None if self.process is None else self.process.spindle_rpm
        return replace(bounds, spindle_speed=self.nc.spindle_rpm or process)

    @property
    def search(self) -> Search:
        """What is minimised, and how it is searched."""
        return Search.of(self)

    @property
    def surrounding(self) -> Surrounding:
        """Part and stock, by their files, and how near the tool comes to what stands around it."""
        return Surrounding.of(self)

    @property
    def meshes(self) -> Meshes:
        """How meshes are taken."""
        return Meshes.of(self)

    @property
    def reading(self) -> Reading:
        """How an input that is a program is read, and the unit of any input."""
        return Reading.of(self.program, unit=None if self.unit == "m" else self.unit)

    @property
    def program_options(self) -> ProgramOptions:
        """How the program of a task is written, with its settings; the control is the one that holds."""
        return ProgramOptions.of(self, settings=self.nc, header=None)

    @property
    def planning(self) -> Planning:
        """How passes are planned."""
        return Planning.of(self.plan)

    @property
    def constraints(self) -> Constraints:
        """The bounds on postures and turns as one record; `SettingError` for one out of its range."""
        return Constraints.of(self.bounds)

    @model_validator(mode="after")
    def _turns_at_one_speed(self) -> Job:
        own, program = Bounds.of(self).spindle_speed, self.nc.spindle_rpm
        if own is not None and program is not None and own != program:
            raise ValueError(
                f"spindle_speed = {own:g}, and nc.spindle_rpm = {program:g} rev/min; the cutting speed is "
                "that of the program: leave spindle_speed out, or give both the same"
            )
        return self

    @field_validator("tilt", "override", "tool", "control")
    @classmethod
    def _admissible(cls, value: Any, info: ValidationInfo) -> Any:
        try:
            if info.field_name == "override":
                return require_codes(value)
            if info.field_name == "tilt" and value is not None:
                require_range(*value)
            elif isinstance(value, str):
                is_tool = info.field_name == "tool"
                for name in tools_by_number(value).values() if is_tool else (value,):
                    # A file is read when its folder is known.
                    if not name.lower().endswith(TOOL_FILE):
                        parse_tool(name) if is_tool else find_dialect(name)
        except FiveAxisError as fault:
            raise ValueError(str(fault)) from None
        return value
