"""What a machine file may say, table by table."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from fiveaxis.machine.chain import Triple
from fiveaxis.settings import StrictModel

NotNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0)]

# Unit of a file -> factor to mm, rad and seconds.
LINEAR_UNITS = {"mm": 1.0, "inch": 25.4, "m": 1000.0}
ANGLE_UNITS = {"deg": math.radians(1.0), "rad": 1.0, "arcsec": math.radians(1.0 / 3600.0)}
# Angles of a rotary axis's limits up to this value, a whole turn in radians, are radians by mistake.
LOOKS_LIKE_RADIANS = 6.3


def fault(code: str, message: str) -> PydanticCustomError:
    """Make a fault with a code of its own, by which `check_machine` names it."""
    return PydanticCustomError(code, "{text}", {"text": message})  # type: ignore[arg-type, unused-ignore]


class Figure(StrictModel):
    """A figure or a few that belong together, and where they come from."""

    source: str | None = Field(None, description="where the figure is printed or was measured")
    assumed: bool = Field(False, description="no source; then `note` says why this value")
    fitted: bool = Field(False, description="worked out of measurements, which the source names")
    note: str | None = Field(None, description="a sentence")

    @model_validator(mode="after")
    def _has_provenance(self) -> Figure:
        if self.assumed and not self.note:
            raise fault("missing_source", "assumed = true needs a note that says why this value")
        if not self.assumed and not self.source:
            raise fault("missing_source", "needs a source, or assumed = true with a note")
        return self


class Directed(Figure):
    """A figure that has a direction."""

    direction: Triple | None = None

    @model_validator(mode="after")
    def _points_somewhere(self) -> Directed:
        if self.direction is not None and not any(self.direction):
            raise fault("zero_direction", "direction has length 0; give three numbers, not all zero")
        return self


class VerticalTable(Directed):
    """Which direction is up in the machine frame."""

    direction: Triple = (0.0, 0.0, 1.0)


class StructureTable(Figure):
    """Where the structure (the code, with the order of its axes) is published."""


class SpindleTable(Directed):
    """Where the spindle is with every axis at 0, machine frame."""

    point: Triple = Field((0.0, 0.0, 0.0), description="gauge point: the tip of a tool of length 0, mm")
    direction: Triple = Field((0.0, 0.0, 1.0), description="from tip to shank")


class LimitsTable(Figure):
    """Range of an axis value, tool relative to workpiece."""

    min: float | None = Field(None, description="lower end; leave out where there is none")
    max: float | None = Field(None, description="upper end; leave out where there is none")
    unit: Literal["mm", "inch", "deg", "rad"] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> LimitsTable:
        ends = [v for v in (self.min, self.max) if v is not None]
        if self.unit is None:
            hint = "write unit = 'mm' or 'inch' for a linear axis, 'deg' or 'rad' for a rotary one"
            if ends and max(map(abs, ends)) <= LOOKS_LIKE_RADIANS:
                shown = " … ".join(f"{v:g}" for v in ends)
                degrees = " … ".join(f"{math.degrees(v):.6g}" for v in ends)
                hint = (
                    f"{shown} of a rotary axis looks like radians: write unit = 'rad', or {degrees} with "
                    "unit = 'deg'; a linear axis has 'mm' or 'inch'"
                )
            raise fault("missing_unit", f"has no unit; {hint}")
        if self.min is not None and self.max is not None and not self.min < self.max:
            raise fault(
                "reversed_limits",
                f"min {self.min:g} {self.unit} is not below max {self.max:g} {self.unit}; exchange them",
            )
        return self


class LineTable(Directed):
    """Where the axis lies in the machine frame at home."""

    point: Triple | None = Field(None, description="mm, a point of a rotary axis")


class LocationErrorTable(Figure):
    """How far an axis lies from where it should, machine frame (ISO 230-7)."""

    offset: Triple = Field((0.0, 0.0, 0.0), description="mm at the line's point; of axis C: X0C, Y0C, Z0C")
    tilt: Triple = Field((0.0, 0.0, 0.0), description="rotation vector; of axis C: A0C, B0C, C0C")
    tilt_unit: Literal["deg", "rad", "arcsec"] | None = None

    @model_validator(mode="after")
    def _has_unit(self) -> LocationErrorTable:
        if any(self.tilt) and self.tilt_unit is None:
            raise fault("missing_unit", "tilt needs tilt_unit = 'deg', 'rad' or 'arcsec'")
        return self


class MeasuredTable(Figure):
    """A drive, with the speeds at which its power was measured."""

    measured_from: float | None = Field(None, gt=0.0, description="mm/min or deg/min, slowest measured speed")
    measured_to: float | None = Field(None, gt=0.0, description="mm/min or deg/min, fastest measured speed")

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        slowest, fastest = self.measured_from, self.measured_to
        if slowest is not None and fastest is not None and slowest > fastest:
            raise fault(
                "reversed_range", f"measured_from is {slowest:g} and measured_to {fastest:g}: swap them"
            )
        return self


class DirectionalTable(MeasuredTable):
    """Measured power by direction."""

    model: Literal["directional"]
    plus: float = Field(ge=0.0, description="power while the value grows")
    minus: float = Field(ge=0.0, description="power while the value falls")
    unit: Literal["W", "W/(mm/min)", "W/(deg/min)"]


class AffineTable(MeasuredTable):
    """Power that grows with speed from an offset."""

    model: Literal["affine"]
    plus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value grows")
    minus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value falls")
    unit: Literal["W/(m/s)", "W/(mm/min)", "W/(deg/min)", "W/(rad/s)"] = Field(description="of the slopes")


class WeightTable(MeasuredTable):
    """Power in proportion to the moved weight; needs moved_mass."""

    model: Literal["weight"]
    a: float = Field(ge=0.0, description="W per N and (m/s)")
    b: float = Field(ge=0.0, description="W per N")


class FrictionTable(MeasuredTable):
    """Drive from first principles, in N (N·m), m (rad), s, W."""

    model: Literal["friction"]
    friction: float = Field(0.0, ge=0.0, description="Coulomb friction, N or N·m")
    viscous: float = Field(0.0, ge=0.0, description="N/(m/s) or N·m/(rad/s)")
    counterbalance: float = Field(0.0, description="N or N·m, towards growing values")
    inertia: float = Field(0.0, ge=0.0, description="kg·m2 of a rotary axis; a linear one has moved_mass")
    efficiency: float = Field(1.0, gt=0.0, le=1.0, description="mechanical over electrical power")
    regeneration: float = Field(0.0, ge=0.0, le=0.9, description="electrical over mechanical, braking")
    copper: float = Field(0.0, ge=0.0, description="W/N2 or W/(N·m)2")
    hold: float = Field(0.0, ge=0.0, description="W, also at standstill")


class RateTable(Figure):
    """Highest speed."""

    value: float = Field(gt=0.0)
    unit: Literal["mm/s", "mm/min", "m/min", "inch/s", "deg/s", "deg/min", "rad/s", "rpm"]


class AccelerationTable(Figure):
    """Highest acceleration."""

    value: float = Field(gt=0.0)
    unit: Literal["mm/s2", "m/s2", "inch/s2", "deg/s2", "rad/s2"]


class PowerTable(Figure):
    """A power in W."""

    value: float = Field(ge=0.0)
    unit: Literal["W"] = "W"


class SpindleIdleTable(Figure):
    """Power of the turning spindle without a cut, on top of the base power: a quadratic of its speed."""

    constant: float = Field(0.0, ge=0.0, description="W")
    linear: float = Field(0.0, description="W per rev/min")
    quadratic: float = Field(0.0, description="W per (rev/min)2")


class AuxiliaryTable(Figure):
    """Load loss that comes with a cut: linear and quadratic in its power."""

    linear: float = Field(0.0, ge=0.0, description="W/W")
    quadratic: float = Field(0.0, ge=0.0, description="1/W")


class MassTable(Figure):
    """A mass in kg."""

    value: float = Field(gt=0.0)
    unit: Literal["kg"] = "kg"
    centre: Triple | None = Field(None, description="mm, machine frame at home; of a rotary axis")


DriveTable = Annotated[
    DirectionalTable | AffineTable | WeightTable | FrictionTable, Field(discriminator="model")
]


class LoadTable(Figure):
    """What stands on the table when a job doesn't say: vice, fixture, workpiece."""

    mass: float = Field(ge=0.0, description="kg")
    centre: Triple = Field((0.0, 0.0, 0.0), description="mm, centre of mass, machine frame at home")


class AxisTable(StrictModel):
    """Everything a machine file says about one axis."""

    limits: LimitsTable | None = None
    line: LineTable | None = None
    location_error: LocationErrorTable | None = None
    drive: DriveTable | None = None
    max_speed: RateTable | None = None
    max_acceleration: AccelerationTable | None = None
    moved_mass: MassTable | None = Field(None, description="without workpiece and fixture")
    carries: Literal["workpiece", "tool"] | None = Field(None, description="checked against the code")
    reversed: bool = Field(False, description="the control counts this axis the other way")


class BoxTable(Figure):
    """A box along the machine's axes at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["box"]
    size: tuple[Positive, Positive, Positive] = Field(description="mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="mm")


class CylinderTable(Directed):
    """A cylinder at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["cylinder"]
    radius: float = Field(gt=0.0, description="mm")
    height: float = Field(gt=0.0, description="mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="mm, middle of its axis")
    direction: Triple = (0.0, 0.0, 1.0)


class MeshTable(Figure):
    """A mesh in the machine frame at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["mesh"]
    file: str = Field(min_length=1, description="relative to the machine file")
    scale: float = Field(1.0, gt=0.0, description="mm in one unit of the file")


BodyTable = Annotated[BoxTable | CylinderTable | MeshTable, Field(discriminator="shape")]


class MachineFile(StrictModel):
    """A machine file."""

    name: str = Field(min_length=1)
    code: str
    description: str = ""
    structure: StructureTable | None = None
    spindle: SpindleTable | None = None
    vertical: VerticalTable | None = None
    base_power: PowerTable | None = None
    spindle_idle: SpindleIdleTable | None = None
    auxiliary: AuxiliaryTable | None = None
    load: LoadTable | None = None
    axes: dict[Literal["X", "Y", "Z", "A", "B", "C"], AxisTable] = Field(default_factory=dict)
    bodies: list[BodyTable] = Field(default_factory=list)
