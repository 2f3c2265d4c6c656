"""The figures of an axis, as tables of a machine file."""

from __future__ import annotations

import math
import re
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import Field, model_validator

from fiveaxis.base import FigureError, MachineError, SettingError, StrictModel
from fiveaxis.model.machine.axes import Limits, LocationError
from fiveaxis.model.machine.chain import UNIT_DIRECTION, Line, Triple
from fiveaxis.model.machine.drive_tables import DriveTable
from fiveaxis.model.machine.figures import (
    ANGLE_UNITS,
    LINEAR,
    LINEAR_UNITS,
    LONGEST,
    MOST_MASS,
    NUMBER,
    ROTARY,
    TURNING_UNITS,
    Directed,
    Figure,
    Plausible,
    Point,
    Question,
    Stage,
    Table,
    direction_numbers,
    fault,
    neat,
    parse_point,
    parse_quantity,
    plain,
    rounded,
    unit_factor,
)
from fiveaxis.model.machine.model import Machine

EVERY = LINEAR + ROTARY
ENDLESS = "endless"
LOOKS_LIKE_RADIANS = 6.3  # limits of a rotary axis up to this value, a whole turn, are likely in radians
# Of servo motors at their rated load.
POWER_FACTOR = 0.8
# Figures of an axis from which its power follows: one of them is enough.
POWERED = ("moved_mass", "motor", "drive")


@Question(
    "limits",
    Stage.TRAVEL,
    "travel, as the control shows it",
    ("MIN:MAX, mm", "MIN:MAX, deg, or endless"),
    "X=-300:300,A=-120:30,C=endless",
)
class LimitsTable(Figure):
    """Travel of the axis, as the tool moves relative to the workpiece."""

    field = "limits"
    plausible: ClassVar = {"travel": Plausible("travel", 1.0, LONGEST, "mm", "m, µm or inch")}
    lack = "its travel isn't checked, and a rotary axis counts as endless"

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

    def _value(self, letter: str) -> Limits:
        unit = unit_factor(letter, str(self.unit))
        low = -math.inf if self.min is None else self.min * unit
        return Limits(low, math.inf if self.max is None else self.max * unit)

    @classmethod
    def _table(cls, value: Limits, letter: str) -> Table:
        unit, factor = ("deg", math.degrees(1.0)) if letter in ROTARY else ("mm", 1.0)
        ends = zip(("min", "max"), value.ends, strict=True)
        return {key: neat(v * factor) for key, v in ends if v is not None} | {"unit": unit}

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        rotary = letter in ROTARY
        if answer == ENDLESS and rotary:
            return {"unit": "deg"}
        units = _units_of(cls, letter)
        found = re.fullmatch(rf"({NUMBER})\s*(?::|…|\.\.|to)\s*({NUMBER})\s*(\S*)", answer)
        unit = units[0] if found is None or not found[3] else found[3]
        if found is None or unit not in units:
            form = "MIN:MAX or endless" if rotary else "MIN:MAX"
            raise SettingError(f"{answer!r} isn't of the form {form}, in {' or '.join(units)}")
        low, high = float(found[1]), float(found[2])
        if low >= high:
            raise SettingError(f"{low:g} {unit} is not below {high:g} {unit}; exchange them")
        if rotary and not found[3] and max(abs(low), abs(high)) <= LOOKS_LIKE_RADIANS:
            raise SettingError(f"{answer} looks like radians; write {answer} rad or {answer} deg")
        return {"min": neat(low), "max": neat(high), "unit": unit}

    def _magnitude(self, key: str, letter: str) -> float | None:
        if letter in ROTARY or self.min is None or self.max is None:
            return None
        return (self.max - self.min) * LINEAR_UNITS[str(self.unit)]


@Question("points", Stage.PIVOTS, "a point on its line", "X,Y,Z, mm", "A=0,12.5,50,C=0,0,0", ROTARY)
class LineTable(Directed):
    """Line of the axis: its direction and, of a rotary axis, a point on it in mm, with every axis at 0."""

    field = "line"

    direction: Triple | None = Field(
        None, description="direction of the axis in the machine frame; by default that of its letter"
    )
    point: Point | None = Field(None, description="mm, a point on a rotary axis")

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        return parse_point(answer)

    def _value(self, letter: str) -> Line:
        nominal = Line(UNIT_DIRECTION[letter])
        point = self.point if self.point is not None and letter in ROTARY else nominal.point
        try:
            return Line(self.direction or nominal.direction, point)
        except MachineError as wrong:
            raise FigureError((), "zero-direction", wrong.message) from None

    @classmethod
    def write(cls, machine: Machine, letter: str, stated: bool) -> Table | None:
        """Write a line that isn't in its letter's direction through the origin; as `Figure.write`."""
        line = next(j.line for j in machine.chain.joints if j.letter == letter)
        table: Table = {"direction": direction_numbers(line.direction)}
        if letter in ROTARY:
            table["point"] = rounded(line.point)
        ideal = table["direction"] == list(UNIT_DIRECTION[letter]) and not any(table.get("point", ()))
        return None if ideal and not stated else table


class LocationErrorTable(Figure):
    """Deviation of the axis from its nominal line, machine frame (ISO 230-7)."""

    field = "location_error"
    plausible: ClassVar = {
        "offset": Plausible("offset in the location error", 0.0, 1.0, "mm", "µm"),
        "tilt": Plausible("tilt in the location error", 0.0, 1.0, "deg", "arcsec"),
    }

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

    def _value(self, letter: str) -> LocationError:
        unit = 1.0 if self.tilt_unit is None else ANGLE_UNITS[self.tilt_unit]
        a, b, c = self.tilt
        return LocationError(self.offset, (a * unit, b * unit, c * unit))

    @classmethod
    def _table(cls, value: LocationError, letter: str) -> Table:
        # The offset of a linear axis has no meaning.
        offset = {"offset": plain(value.offset)} if letter in ROTARY else {}
        return offset | {"tilt": [neat(math.degrees(v)) for v in value.tilt], "tilt_unit": "deg"}

    def _magnitude(self, key: str, letter: str) -> float:
        length = float(np.linalg.norm(getattr(self._value(letter), key), axis=-1))
        return math.degrees(length) if key == "tilt" else length


def _units_of(model: type[Figure], letter: str) -> list[str]:
    """List the units of a figure that fit an axis, the usual one first."""
    kind = model.model_fields["unit"].annotation
    names = [name for part in (kind, *get_args(kind)) for name in get_args(part) if isinstance(name, str)]
    known = TURNING_UNITS if letter in ROTARY else LINEAR_UNITS
    return [name for name in names if name.partition("/")[0] in known]


class RateTable(Figure):
    """A figure of the axis per second, squared or cubed; its ranges are those of both kinds of axes."""

    value: float
    unit: str

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        value, unit = parse_quantity(answer, _units_of(cls, letter))
        return {"value": neat(value), "unit": unit}

    def _inside(self, key: str, value: float, letter: str) -> float:
        length, _, per = self.unit.partition("/")
        rate = value * unit_factor(letter, length)
        return rate * 2.0 * math.pi / 60.0 if length == "rpm" else rate / (60.0 if per == "min" else 1.0)

    @classmethod
    def _table(cls, value: float, letter: str) -> Table:
        rotary = letter in ROTARY
        power = {"max_speed": "", "max_acceleration": "2", "max_jerk": "3"}[cls.field]
        unit = f"{'deg' if rotary else 'mm'}/s{power}"
        return {"value": neat(math.degrees(value) if rotary else value), "unit": unit}

    def _magnitude(self, key: str, letter: str) -> float | None:
        value = self._value(letter)
        if key != ("rotary" if letter in ROTARY else "linear"):
            return None
        return math.degrees(value) if letter in ROTARY else float(value)


@Question("speeds", Stage.MOTION, "highest speed", ("m/min", "rpm"), "X=40,A=20", again=True)
class SpeedTable(RateTable):
    """Highest speed of the axis."""

    field = "max_speed"
    plausible: ClassVar = {
        "linear": Plausible("max_speed", 1.0, 2_500.0, "mm/s", "mm/min"),
        "rotary": Plausible("max_speed", 1.0, 9_000.0, "deg/s", "deg/min or rpm"),
    }
    lack = "speeds aren't checked, and times are too short"

    value: float = Field(gt=0.0, description="highest speed of the axis")
    unit: Literal["m/min", "mm/min", "mm/s", "inch/s", "rpm", "deg/s", "deg/min", "rad/s"] = Field(
        description="unit of the speed"
    )


@Question("accelerations", Stage.MOTION, "highest acceleration", ("m/s2", "deg/s2"), "X=5,A=500", again=True)
class AccelerationTable(RateTable):
    """Highest acceleration of the axis."""

    field = "max_acceleration"
    plausible: ClassVar = {
        "linear": Plausible("max_acceleration", 10.0, 50_000.0, "mm/s2", "m/s2"),
        "rotary": Plausible("max_acceleration", 10.0, 200_000.0, "deg/s2", "rad/s2"),
    }
    lack = "accelerations aren't checked"

    value: float = Field(gt=0.0, description="highest acceleration of the axis")
    unit: Literal["m/s2", "mm/s2", "inch/s2", "deg/s2", "rad/s2"] = Field(
        description="unit of the acceleration"
    )


@Question("jerks", Stage.MOTION, "highest jerk", ("m/s3", "deg/s3"), "X=50,A=5000", again=True)
class JerkTable(RateTable):
    """Highest jerk of the axis, of a control that limits it."""

    field = "max_jerk"
    plausible: ClassVar = {
        "linear": Plausible("max_jerk", 10.0, 5_000_000.0, "mm/s3", "m/s3"),
        "rotary": Plausible("max_jerk", 10.0, 50_000_000.0, "deg/s3", "rad/s3"),
    }

    value: float = Field(gt=0.0, description="highest jerk of the axis")
    unit: Literal["m/s3", "mm/s3", "inch/s3", "deg/s3", "rad/s3"] = Field(description="unit of the jerk")


@Question(
    "masses", Stage.MASSES, "mass that it moves, without the part", "kg", "X=800,Y=1200", instead=POWERED
)
class MassTable(Figure):
    """Mass that the axis moves, without workpiece and fixture; its power is estimated from it."""

    field = "moved_mass"
    plausible: ClassVar = {"value": Plausible("mass", 0.1, 100_000.0, "kg", "g or t")}
    answered: ClassVar = {"kg": 1.0, "t": 1000.0}

    value: float = Field(gt=0.0, le=MOST_MASS, description="mass that the axis moves")
    unit: Literal["kg"] = Field("kg", description="unit of the mass")
    centre: Triple | None = Field(None, description="mm, machine frame at home; of a rotary axis")

    def read(self, letter: str) -> dict[str, Any]:
        """Return the mass and, of a rotary axis, its centre; as `Figure.read`."""
        return {"moved_mass": self.value, "mass_centre": self.centre if letter in ROTARY else None}

    @classmethod
    def write(cls, machine: Machine, letter: str, stated: bool) -> Table | None:
        """Write the mass and its centre, where it is known; as `Figure.write`."""
        axis = machine.axis(letter)
        if axis.moved_mass is None:
            return None
        centre = {} if axis.mass_centre is None else {"centre": plain(axis.mass_centre)}
        return {"value": neat(axis.moved_mass), "unit": "kg"} | centre


@Question(
    "motors",
    Stage.MASSES,
    "nameplate of its motor",
    "kW, or 8.5 A 400 V",
    "X=3.1,Y=8.5 A 400 V",
    instead=POWERED,
)
class MotorTable(Figure):
    """Nameplate of the motor of the axis, from which its power is estimated."""

    field = "motor_power"
    plausible: ClassVar = {"power": Plausible("motor", 5.0, 200_000.0, "W", "kW")}
    answered: ClassVar = {"kW": 1.0, "W": 1.0 / 1000.0}

    power: float | None = Field(None, gt=0.0, le=200.0, description="rated power, kW")
    current: float | None = Field(None, gt=0.0, le=500.0, description="rated current, A; with `voltage`")
    voltage: float | None = Field(None, gt=0.0, le=1000.0, description="rated voltage between phases, V")

    @model_validator(mode="after")
    def _states_a_power(self) -> MotorTable:
        if (self.power is None) == (self.current is None) or (self.current is None) != (self.voltage is None):
            raise fault("missing_key", "needs the rated power (kW), or the rated current (A) and voltage (V)")
        return self

    def _value(self, letter: str) -> float:
        if self.power is not None:
            return 1000.0 * self.power
        # Of three phases at a usual power factor.
        return math.sqrt(3.0) * POWER_FACTOR * (self.current or 0.0) * (self.voltage or 0.0)

    @classmethod
    def _table(cls, value: float, letter: str) -> Table:
        return {"power": neat(value / 1000.0)}

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        rated = re.fullmatch(rf"({NUMBER})\s*A\s*({NUMBER})\s*V", answer)
        if rated is None:
            return super()._answer(letter, answer)
        return {"current": neat(float(rated[1])), "voltage": neat(float(rated[2]))}

    def _magnitude(self, key: str, letter: str) -> float:
        return self._value(letter)


class AxisTable(StrictModel):
    """One axis."""

    limits: LimitsTable | None = None
    line: LineTable | None = None
    location_error: LocationErrorTable | None = None
    drive: DriveTable | None = Field(None, description="Power of the drive of the axis.")
    max_speed: SpeedTable | None = None
    max_acceleration: AccelerationTable | None = None
    max_jerk: JerkTable | None = None
    moved_mass: MassTable | None = None
    motor: MotorTable | None = None
    carries: Literal["workpiece", "tool"] | None = Field(None, description="checked against the code")
    reversed: bool | Literal["unknown"] = Field(
        False,
        description="the control counts this axis in the opposite direction; unknown if that isn't settled",
    )
