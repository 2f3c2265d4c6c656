"""The models of a drive's power, as tables of a machine file."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field

from fiveaxis.base import FigureError
from fiveaxis.model.machine.drives import AffineDrive, DirectionalDrive, FrictionDrive, WeightDrive
from fiveaxis.model.machine.figures import ROTARY, Figure, NotNegative, Table, neat, unit_factor
from fiveaxis.model.machine.model import Machine

ENDS = ("measured_from", "measured_to")


class MeasuredTable(Figure):
    """A drive, with the speeds at which its power was measured."""

    field = "drive"

    measured_from: float | None = Field(None, gt=0.0, description="mm/min or deg/min, slowest measured speed")
    measured_to: float | None = Field(None, gt=0.0, description="mm/min or deg/min, fastest measured speed")

    def require_fitting(self, letter: str, *, with_mass: bool) -> None:
        """Raise `FigureError` unless the model fits the axis, which has a mass if the model needs one."""

    def read(self, letter: str) -> dict[str, Any]:
        """Return the drive; as `Figure.read`."""
        unit = math.radians(1.0) if letter in ROTARY else 1.0
        ends = {key: getattr(self, key) for key in ENDS}
        known = {key: end * unit / 60.0 for key, end in ends.items() if end is not None}
        return {"drive": replace(self._value(letter), **known)}

    @classmethod
    def write(cls, machine: Machine, letter: str, stated: bool) -> Table | None:
        """Write a drive of this model; as `Figure.write`."""
        axis = machine.axis(letter)
        if not isinstance(axis.drive, cls.record or ()):
            return None
        [model] = get_args(cls.model_fields["model"].annotation)
        ends = {key: getattr(axis.drive, key) for key in ENDS}
        known = {key: neat(60.0 * axis.shown(end)) for key, end in ends.items() if end is not None}
        return {"model": model} | cls._table(axis.drive, letter) | known

    @classmethod
    def _keys(cls) -> list[str]:
        return [key for key in super()._keys() if key not in ENDS]


class DirectionalTable(MeasuredTable):
    """Measured power by direction."""

    record = DirectionalDrive

    model: Literal["directional"] = Field(
        description="power by direction, constant or in proportion to speed"
    )
    plus: float = Field(ge=0.0, description="power while the value grows")
    minus: float = Field(ge=0.0, description="power while the value falls")
    unit: Literal["W", "W/(mm/min)", "W/(deg/min)"] = Field(
        description="`W` for a constant power, the others for one in proportion to speed"
    )

    def _value(self, letter: str) -> DirectionalDrive:
        sloping = self.unit != "W"
        factor = _slope_factor(letter, self.unit) if sloping else 1.0
        return DirectionalDrive(self.plus * factor, self.minus * factor, proportional=sloping)

    @classmethod
    def _table(cls, value: DirectionalDrive, letter: str) -> Table:
        factor, unit = _slope_unit(letter) if value.proportional else (1.0, "W")
        return {"plus": neat(value.plus * factor), "minus": neat(value.minus * factor), "unit": unit}


class AffineTable(MeasuredTable):
    """Power that grows with speed from an offset."""

    record = AffineDrive

    model: Literal["affine"] = Field(description="power by direction, growing with speed from an offset")
    plus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value grows")
    minus: tuple[NotNegative, NotNegative] = Field(description="slope and offset (W) while the value falls")
    unit: Literal["W/(m/s)", "W/(mm/min)", "W/(deg/min)", "W/(rad/s)"] = Field(description="of the slopes")

    def _inside(self, key: str, value: tuple[float, float], letter: str) -> tuple[float, float]:
        return value[0] * _slope_factor(letter, self.unit), value[1]

    @classmethod
    def _outside(cls, key: str, value: tuple[float, float], letter: str) -> tuple[float, float]:
        return value[0] * _slope_unit(letter)[0], value[1]

    @classmethod
    def _table(cls, value: AffineDrive, letter: str) -> Table:
        return super()._table(value, letter) | {"unit": _slope_unit(letter)[1]}


class WeightTable(MeasuredTable):
    """Power in proportion to the moved weight; needs moved_mass."""

    record = WeightDrive

    model: Literal["weight"] = Field(description="a power in proportion to the moved weight")
    a: float = Field(ge=0.0, description="power per weight and speed, W per N and (m/s)")
    b: float = Field(ge=0.0, description="power per weight, W per N")

    def require_fitting(self, letter: str, *, with_mass: bool) -> None:
        """Check that the axis is linear and has a mass; as `MeasuredTable.require_fitting`."""
        if letter in ROTARY or not with_mass:
            need = "is for linear axes" if letter in ROTARY else f"needs [axes.{letter}.moved_mass]"
            raise FigureError((), "missing-mass", f"the weight drive of {letter} {need}")


class FrictionTable(MeasuredTable):
    """Drive from first principles, in N (N·m), m (rad), s, W."""

    record = FrictionDrive
    # Powers of the metre in the coefficients of a linear axis; N is J/m, a thousandth per mm.
    metres: ClassVar = {"friction": -1, "viscous": -2, "counterbalance": -1, "copper": 2}

    model: Literal["friction"] = Field(description="friction, gravity, inertia and losses of the motor")
    friction: float = Field(0.0, ge=0.0, description="Coulomb friction, N or N·m")
    viscous: float = Field(0.0, ge=0.0, description="viscous friction, N/(m/s) or N·m/(rad/s)")
    counterbalance: float = Field(0.0, description="N or N·m, towards growing values")
    inertia: float = Field(0.0, ge=0.0, description="kg·m2 of a rotary axis; a linear one has moved_mass")
    efficiency: float = Field(1.0, gt=0.0, le=1.0, description="mechanical over electrical power")
    regeneration: float = Field(0.0, ge=0.0, le=0.9, description="electrical over mechanical, braking")
    copper: float = Field(0.0, ge=0.0, description="losses of the motor's winding, W/N2 or W/(N·m)2")
    moving: float = Field(0.0, ge=0.0, description="W, constant part of the power in motion")
    hold: float = Field(0.0, ge=0.0, description="W, also at standstill")

    def require_fitting(self, letter: str, *, with_mass: bool) -> None:
        """Check that a linear axis has a mass and no inertia; as `MeasuredTable.require_fitting`."""
        if letter not in ROTARY and self.inertia:
            message = f"inertia is for a rotary axis; {letter} is linear and has moved_mass"
            raise FigureError(("inertia",), "wrong-unit", message)
        if letter not in ROTARY and not with_mass:
            message = f"the friction drive of {letter} needs [axes.{letter}.moved_mass]"
            raise FigureError((), "missing-mass", message)

    def _inside(self, key: str, value: float, letter: str) -> float:
        return _shifted(value, 0 if letter in ROTARY else self.metres.get(key, 0))

    @classmethod
    def _outside(cls, key: str, value: float, letter: str) -> float:
        return _shifted(value, 0 if letter in ROTARY else -cls.metres.get(key, 0))


DriveTable = Annotated[
    DirectionalTable | AffineTable | WeightTable | FrictionTable, Field(discriminator="model")
]


def _shifted(value: float, power: int) -> float:
    """Multiply by a power of 1000; a negative one divides, which doesn't round twice."""
    return value * 1000.0**power if power >= 0 else value / 1000.0**-power


def _slope_factor(letter: str, unit: str) -> float:
    """Return the factor from a file's W per (unit/min) or (unit/s) to W per (mm/s) or (rad/s)."""
    length, _, per = unit.removeprefix("W/(").removesuffix(")").partition("/")
    return (60.0 if per == "min" else 1.0) / unit_factor(letter, length)


def _slope_unit(letter: str) -> tuple[float, str]:
    """Return the factor from W per (mm/s) or (rad/s) to W per (unit/min), and this unit."""
    if letter in ROTARY:
        return 1.0 / (60.0 * math.degrees(1.0)), "W/(deg/min)"
    return 1.0 / 60.0, "W/(mm/min)"
