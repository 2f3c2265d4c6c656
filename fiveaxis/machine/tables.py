"""The tables of a machine file."""

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
MOST_MASS = 500_000.0  # kg, of the largest portal mills
LOOKS_LIKE_RADIANS = 6.3  # limits of a rotary axis up to this value, a whole turn, are likely in radians


def fault(code: str, message: str) -> PydanticCustomError:
    """Make a validation fault with its own code, which `check_machine` reports."""
    return PydanticCustomError(code, "{text}", {"text": message})  # type: ignore[arg-type, unused-ignore]


class Figure(StrictModel):
    """One or several related figures, and their origin."""

    source: str | None = Field(None, description="where the figure is printed or was measured")
    assumed: bool = Field(False, description="no source; then `note` says why this value")
    fitted: bool = Field(False, description="computed from measurements, which the source names")
    band: tuple[Positive, Positive] | None = Field(
        None, description="of an estimate: lowest and highest plausible value, as shares of it"
    )
    note: str | None = Field(None, description="a sentence")

    @model_validator(mode="after")
    def _has_provenance(self) -> Figure:
        if self.assumed and not self.note:
            raise fault("missing_source", "assumed = true needs a note that says why this value")
        if not self.assumed and not self.source:
            raise fault("missing_source", "needs a source, or assumed = true with a note")
        if self.band is not None and not self.band[0] <= 1.0 <= self.band[1]:
            low, high = self.band
            raise fault("reversed_range", f"band is {low:g}…{high:g}; the value itself, 1, must lie inside")
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
    """The direction that is up in the machine frame."""

    direction: Triple = Field((0.0, 0.0, 1.0), description="up, against gravity, in the machine frame")


class StructureTable(Figure):
    """Publication of the structure: the code, with the order of its axes."""


class SpindleTable(Directed):
    """Position of the spindle with every axis at 0, machine frame."""

    point: Triple = Field((0.0, 0.0, 0.0), description="gauge point: the tip of a tool of length 0, mm")
    direction: Triple = Field((0.0, 0.0, 1.0), description="from tip to shank")


class LimitsTable(Figure):
    """Range of an axis value, tool relative to workpiece."""

    min: float | None = Field(None, description="lower end; leave out where there is none")
    max: float | None = Field(None, description="upper end; leave out where there is none")
    unit: Literal["mm", "inch", "deg", "rad"] | None = Field(None, description="unit of both ends; required")

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
    """Line of the axis in the machine frame at home."""

    direction: Triple | None = Field(
        None, description="direction of the axis in the machine frame; by default that of its letter"
    )
    point: Triple | None = Field(None, description="mm, a point on a rotary axis")


class LocationErrorTable(Figure):
    """Deviation of an axis from its nominal line, machine frame (ISO 230-7)."""

    offset: Triple = Field((0.0, 0.0, 0.0), description="mm at the line's point; of axis C: X0C, Y0C, Z0C")
    tilt: Triple = Field((0.0, 0.0, 0.0), description="rotation vector; of axis C: A0C, B0C, C0C")
    tilt_unit: Literal["deg", "rad", "arcsec"] | None = Field(
        None, description="required if `tilt` isn't zero"
    )

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
                "reversed_range", f"measured_from is {slowest:g} and measured_to {fastest:g}; exchange them"
            )
        return self


class DirectionalTable(MeasuredTable):
    """Measured power by direction."""

    model: Literal["directional"] = Field(
        description="power by direction, constant or in proportion to speed"
    )
    plus: float = Field(ge=0.0, description="power while the value grows")
    minus: float = Field(ge=0.0, description="power while the value falls")
    unit: Literal["W", "W/(mm/min)", "W/(deg/min)"] = Field(
        description="`W` for a constant power, the others for one in proportion to speed"
    )


class AffineTable(MeasuredTable):
    """Power that grows with speed from an offset."""

    model: Literal["affine"] = Field(description="power by direction, growing with speed from an offset")
    plus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value grows")
    minus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value falls")
    unit: Literal["W/(m/s)", "W/(mm/min)", "W/(deg/min)", "W/(rad/s)"] = Field(description="of the slopes")


class WeightTable(MeasuredTable):
    """Power in proportion to the moved weight; needs moved_mass."""

    model: Literal["weight"] = Field(description="a power in proportion to the moved weight")
    a: float = Field(ge=0.0, description="power per weight and speed, W per N and (m/s)")
    b: float = Field(ge=0.0, description="power per weight, W per N")


class FrictionTable(MeasuredTable):
    """Drive from first principles, in N (N·m), m (rad), s, W."""

    model: Literal["friction"] = Field(description="friction, gravity, inertia and losses of the motor")
    friction: float = Field(0.0, ge=0.0, description="Coulomb friction, N or N·m")
    viscous: float = Field(0.0, ge=0.0, description="viscous friction, N/(m/s) or N·m/(rad/s)")
    counterbalance: float = Field(0.0, description="N or N·m, towards growing values")
    inertia: float = Field(0.0, ge=0.0, description="kg·m2 of a rotary axis; a linear one has moved_mass")
    efficiency: float = Field(1.0, gt=0.0, le=1.0, description="mechanical over electrical power")
    regeneration: float = Field(0.0, ge=0.0, le=0.9, description="electrical over mechanical, braking")
    copper: float = Field(0.0, ge=0.0, description="losses of the motor's winding, W/N2 or W/(N·m)2")
    moving: float = Field(0.0, ge=0.0, description="W, at any speed but standstill")
    hold: float = Field(0.0, ge=0.0, description="W, also at standstill")


class RateTable(Figure):
    """Highest speed."""

    value: float = Field(gt=0.0, description="highest speed of the axis")
    unit: Literal["mm/s", "mm/min", "m/min", "inch/s", "deg/s", "deg/min", "rad/s", "rpm"] = Field(
        description="unit of the speed"
    )


class AccelerationTable(Figure):
    """Highest acceleration."""

    value: float = Field(gt=0.0, description="highest acceleration of the axis")
    unit: Literal["mm/s2", "m/s2", "inch/s2", "deg/s2", "rad/s2"] = Field(
        description="unit of the acceleration"
    )


class PowerTable(Figure):
    """A power in W."""

    value: float = Field(ge=0.0, description="power")
    unit: Literal["W"] = Field("W", description="unit of the power")


class SpindleIdleTable(Figure):
    """Power of the turning spindle without a cut, on top of the base power: a quadratic of its speed."""

    constant: float = Field(0.0, ge=0.0, description="part that doesn't depend on speed, W")
    linear: float = Field(0.0, description="part in proportion to speed, W per rev/min")
    quadratic: float = Field(0.0, description="part in proportion to the square of speed, W per (rev/min)2")


class AuxiliaryTable(Figure):
    """Load loss of the spindle drive: linear and quadratic in the cutting power."""

    linear: float = Field(0.0, ge=0.0, description="loss in proportion to the cutting power, W/W")
    quadratic: float = Field(0.0, ge=0.0, description="loss in proportion to that power's square, 1/W")


class MassTable(Figure):
    """A mass in kg."""

    value: float = Field(gt=0.0, le=MOST_MASS, description="mass that the axis moves")
    unit: Literal["kg"] = Field("kg", description="unit of the mass")
    centre: Triple | None = Field(None, description="mm, machine frame at home; of a rotary axis")


DriveTable = Annotated[
    DirectionalTable | AffineTable | WeightTable | FrictionTable, Field(discriminator="model")
]


class MotorTable(Figure):
    """Nameplate of an axis's motor, from which a missing drive is estimated."""

    power: float | None = Field(None, gt=0.0, le=200.0, description="rated power, kW")
    current: float | None = Field(None, gt=0.0, le=500.0, description="rated current, A; with `voltage`")
    voltage: float | None = Field(None, gt=0.0, le=1000.0, description="rated voltage between phases, V")

    @model_validator(mode="after")
    def _states_a_power(self) -> MotorTable:
        if (self.power is None) == (self.current is None) or (self.current is None) != (self.voltage is None):
            raise fault("missing_key", "needs the rated power (kW), or the rated current (A) and voltage (V)")
        return self


class LoadTable(Figure):
    """Load of the table where a job doesn't state it: vice, fixture, workpiece."""

    mass: float = Field(ge=0.0, description="mass of everything on the table, kg")
    centre: Triple = Field((0.0, 0.0, 0.0), description="mm, centre of mass, machine frame at home")


class SizeTable(Figure):
    """What is known of a machine's size, from which missing masses are estimated."""

    kind: Literal["desktop", "machining-centre", "portal"] | None = Field(
        None, description="size of machine, where travels aren't known"
    )
    mass: float | None = Field(None, gt=0.0, le=MOST_MASS, description="of the whole machine, kg")


class AxisTable(StrictModel):
    """One axis."""

    limits: LimitsTable | None = None
    line: LineTable | None = None
    location_error: LocationErrorTable | None = None
    drive: DriveTable | None = Field(None, description="model of the drive's power")
    max_speed: RateTable | None = None
    max_acceleration: AccelerationTable | None = None
    moved_mass: MassTable | None = Field(None, description="without workpiece and fixture")
    motor: MotorTable | None = None
    carries: Literal["workpiece", "tool"] | None = Field(None, description="checked against the code")
    reversed: bool = Field(False, description="the control counts this axis in the opposite direction")


class BoxTable(Figure):
    """A box along the machine's axes at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["box"] = Field(description="a box")
    size: tuple[Positive, Positive, Positive] = Field(description="sides along X, Y and Z, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="middle of the box, mm")


class CylinderTable(Directed):
    """A cylinder at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["cylinder"] = Field(description="a cylinder")
    radius: float = Field(gt=0.0, description="half the diameter, mm")
    height: float = Field(gt=0.0, description="length along the axis, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="mm, middle of its axis")
    direction: Triple = Field((0.0, 0.0, 1.0), description="direction of the axis")


class MeshTable(Figure):
    """A mesh in the machine frame at home."""

    link: str = Field(description="bed, or the letter of the axis that carries the body")
    shape: Literal["mesh"] = Field(description="a mesh from a file")
    file: str = Field(min_length=1, description="relative to the machine file")
    scale: float = Field(1.0, gt=0.0, description="mm in one unit of the file")


BodyTable = Annotated[BoxTable | CylinderTable | MeshTable, Field(discriminator="shape")]


class MachineFile(StrictModel):
    """A machine file."""

    name: str = Field(min_length=1, description="name of the machine in lists and reports")
    code: str = Field(description="form-shaping code, workpiece to tool: 1…6 for X Y Z A B C, 0 for the bed")
    description: str = Field("", description="one sentence on what is known of the machine and what isn't")
    structure: StructureTable | None = None
    spindle: SpindleTable | None = None
    vertical: VerticalTable | None = None
    base_power: PowerTable | None = Field(None, description="power of the machine at standstill")
    spindle_idle: SpindleIdleTable | None = None
    auxiliary: AuxiliaryTable | None = None
    load: LoadTable | None = None
    size: SizeTable | None = None
    axes: dict[Literal["X", "Y", "Z", "A", "B", "C"], AxisTable] = Field(
        default_factory=dict, description="one table per axis of the code"
    )
    bodies: list[BodyTable] = Field(
        default_factory=list, description="shapes of the machine, for collision checks"
    )
