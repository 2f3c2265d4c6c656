"""What a job asks for: the settings of a job file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator

from fiveaxis.codes import require_codes
from fiveaxis.collision import ClearanceTable, FixtureTable
from fiveaxis.contour.options import Direction, Order, Strategy
from fiveaxis.errors import FiveAxisError, SettingError
from fiveaxis.machine.chain import Triple
from fiveaxis.nc import ProgramSettings, find_dialect
from fiveaxis.posture.strategy.delivery import Objective
from fiveaxis.settings import (
    StrictModel,
)
from fiveaxis.toolpath import Constraints, parse_tool, require_range
from fiveaxis.verification.check_context import GOUGE_TOLERANCE

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
# Settings that bound postures and turns, under the names that the record has for them.
BOUNDS = tuple(each.name for each in fields(Constraints))


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
    gouge_tolerance: float = Field(
        GOUGE_TOLERANCE,
        gt=0.0,
        description="how deep the cutter may reach into the part at a location, mm; 0.01 deeper between two",
    )
    drives: str | None = Field(None, min_length=1, description="machine whose axis powers are taken instead")
    up_penalty: float = Field(0.0, ge=0.0, description="extra price of moving up against gravity, J/mm")
    objective: Objective = Field(
        "energy", description="what is least: energy or time of the program, or travel metric"
    )
    max_turn: float | None = Field(
        None, gt=0.0, description="largest rotary turn in a cutting move, deg; 180 deg/s by default"
    )
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
    solver: Literal["structured", "ipopt"] = Field(
        "structured", description="refines paths: the method made for them, or IPOPT as a second opinion"
    )
    front: int | None = Field(
        None, ge=2, le=50, description="solutions between the cheapest path and the steadiest one"
    )
    pick: int | None = Field(
        None, ge=1, le=50, description="with front: the solution that is the result, by number; 1 is cheapest"
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

    def said_by(self, file: Path | None, override_by: str) -> Job:
        """Give the same job with where it comes from: its file, and who accepts errors by name."""
        said = self.model_copy()
        said._file, said._override_by = file, override_by
        return said

    @property
    def bounds(self) -> dict[str, Any]:
        """What bounds postures and turns as the job says it, in degrees."""
        return {name: getattr(self, name) for name in BOUNDS}

    @property
    def constraints(self) -> Constraints:
        """The bounds on postures and turns, as one record.

        Raises
        ------
        SettingError
            A bound out of its range.
        """
        return Constraints.of_degrees(**self.bounds)

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
