"""The tables of a machine file: the figures of the machine itself, its bodies, and the file."""

from __future__ import annotations

import math
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np
from pydantic import Field

from fiveaxis.base import Array, MachineError, SettingError, StrictModel, frame_along, require_file
from fiveaxis.model.machine.axis_tables import AxisTable
from fiveaxis.model.machine.bodies import Body, Box, Cylinder, MeshShape, Shape
from fiveaxis.model.machine.chain import UNIT_DIRECTION, Triple
from fiveaxis.model.machine.figures import (
    DECIMALS,
    MOST_MASS,
    Directed,
    Figure,
    Plausible,
    Point,
    Positive,
    Question,
    Stage,
    Table,
    direction_numbers,
    neat,
    parse_point,
    rounded,
)
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.provenance import Size
from fiveaxis.model.machine.setup import Load

UPRIGHT = (0.0, 0.0, 1.0)
SIZES = ("desktop", "machining-centre", "portal")


class StructureTable(Figure):
    """Order of the axes, from the workpiece (first digit of the code) to the tool; 0 is the bed."""


@Question("spindle", Stage.PIVOTS, "gauge point with every axis at 0", "X,Y,Z, mm")
class SpindleTable(Directed):
    """Gauge point of the spindle in mm, where a tool of length 0 has its tip, with every axis at 0."""

    field = "tool_home"

    point: Point = Field((0.0, 0.0, 0.0), description="gauge point: the tip of a tool of length 0, mm")
    direction: Triple = Field(UPRIGHT, description="from tip to shank")

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        return parse_point(answer)

    def _value(self, letter: str) -> Array:
        return frame_along(self._inside("direction", self.direction, letter), self.point)

    @classmethod
    def write(cls, machine: Machine, letter: str, stated: bool) -> Table | None:
        """Write a spindle that isn't upright at the origin; as `Figure.write`."""
        home = machine.chain.tool_home
        if not stated and np.allclose(home, np.eye(4), rtol=0.0, atol=10.0**-DECIMALS):
            return None
        return {"point": rounded(home[:3, 3]), "direction": direction_numbers(home[:3, 2])}


@Question(
    "vertical", Stage.FRAME, "axis that is vertical", "X, Y or Z; -Z if it counts downwards", default="Z"
)
class VerticalTable(Directed):
    """Direction that is up: the axis along it lifts the weight that it moves."""

    field = "vertical"

    direction: Triple = Field(UPRIGHT, description="up, against gravity, in the machine frame")

    @classmethod
    def _answer(cls, letter: str, answer: str) -> Table:
        if re.fullmatch(r"\s*[-+]?[XYZ]\s*([,; ]\s*[-+]?[XYZ]\s*)+", answer):
            raise SettingError(f"{answer!r} names several axes; one is vertical")
        if not re.fullmatch(r"[-+]?[XYZ]", answer):
            raise SettingError(
                f"{answer!r} is none of X, Y, Z, or -X, -Y, -Z where the axis counts downwards"
            )
        sign = -1.0 if answer.startswith("-") else 1.0
        return {"direction": [neat(sign * v + 0.0) for v in UNIT_DIRECTION[answer[-1]]]}


@Question("base-power", Stage.STANDSTILL, "power at standstill, with everything switched on", "W")
class PowerTable(Figure):
    """Power at standstill, with everything switched on."""

    field = "base_power"
    plausible: ClassVar = {"value": Plausible("base power", 20.0, 200_000.0, "W", "kW")}
    answered: ClassVar = {"W": 1.0, "kW": 1000.0}
    lack = "the energy of the machine at standstill isn't counted"

    value: float = Field(ge=0.0, description="power")
    unit: Literal["W"] = Field("W", description="unit of the power")

    @classmethod
    def _table(cls, value: float, letter: str) -> Table:
        return super()._table(value, letter) | {"unit": "W"}


class SpindleIdleTable(Figure):
    """Power of the turning spindle without a cut, on top of the base power: a quadratic of its speed."""

    field = "spindle_idle"
    # Powers of the speed.
    speeds: ClassVar = {"constant": 0, "linear": 1, "quadratic": 2}

    constant: float = Field(0.0, ge=0.0, description="part that doesn't depend on speed, W")
    linear: float = Field(0.0, description="part in proportion to speed, W per rev/min")
    quadratic: float = Field(0.0, description="part in proportion to the square of speed, W per (rev/min)2")

    def _inside(self, key: str, value: float, letter: str) -> float:
        return value * (60.0 / (2.0 * math.pi)) ** self.speeds[key]

    @classmethod
    def _outside(cls, key: str, value: float, letter: str) -> float:
        return value * (2.0 * math.pi / 60.0) ** cls.speeds[key]


class AuxiliaryTable(Figure):
    """Load loss of the spindle drive: linear and quadratic in the cutting power."""

    field = "auxiliary"

    linear: float = Field(0.0, ge=0.0, description="loss in proportion to the cutting power, W/W")
    quadratic: float = Field(0.0, ge=0.0, description="loss in proportion to that power's square, 1/W")


class LoadTable(Figure):
    """Load of the table where a job doesn't state it: vice, fixture, workpiece."""

    field, record = "load", Load

    mass: float = Field(ge=0.0, description="mass of everything on the table, kg")
    centre: Triple = Field((0.0, 0.0, 0.0), description="mm, centre of mass, machine frame at home")


def _answer_size(letter: str, answer: str) -> Table:
    if answer not in SIZES:
        raise SettingError(f"{answer!r} is none of {', '.join(SIZES)}")
    return {"kind": answer}


@Question("mass", Stage.MASSES, "mass of the whole machine", "kg, or t")
@Question("size", Stage.MASSES, "size of the machine", ", ".join(SIZES), answer=_answer_size)
class SizeTable(Figure):
    """Size of the machine, from which masses that aren't stated are estimated."""

    field, record = "size", Size
    plausible: ClassVar = {"mass": Plausible("the machine's mass", 10.0, MOST_MASS, "kg", "g or t")}
    answered: ClassVar = {"kg": 1.0, "t": 1000.0}

    kind: Literal["desktop", "machining-centre", "portal"] | None = Field(
        None, description="size of machine, where travels aren't known"
    )
    mass: float | None = Field(None, gt=0.0, le=MOST_MASS, description="of the whole machine, kg")


class BodyTable(Figure):
    """A body, with its shape at home."""

    field = "shape"

    link: str = Field(description="bed, or the letter of the axis that carries the body")

    def body(self, folder: Path) -> Body:
        """Make the body, whose mesh file is named relative to a folder; `MachineError` if it isn't there."""
        shape: Shape = self._value("")
        if isinstance(shape, MeshShape):
            shape = replace(shape, file=folder / shape.file)
            require_file(shape.file, MachineError)
        return Body(self.link, shape)

    @classmethod
    def of(cls, body: Body, folder: Path | None) -> Table:
        """Write a body, its mesh file named relative to a folder; None names it by its absolute path."""
        model = next(m for m in cls.__subclasses__() if isinstance(body.shape, m.record or ()))
        [shape] = get_args(model.model_fields["shape"].annotation)
        table = {"link": body.link, "shape": shape} | model._table(body.shape, "")
        return table | ({"file": path_from(folder, table["file"])} if "file" in table else {})


class BoxTable(BodyTable):
    """A box along the machine's axes at home."""

    record = Box

    shape: Literal["box"] = Field(description="a box")
    size: tuple[Positive, Positive, Positive] = Field(description="sides along X, Y and Z, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="middle of the box, mm")


class CylinderTable(BodyTable, Directed):
    """A cylinder at home."""

    record = Cylinder

    shape: Literal["cylinder"] = Field(description="a cylinder")
    radius: float = Field(gt=0.0, description="half the diameter, mm")
    height: float = Field(gt=0.0, description="length along the axis, mm")
    center: Triple = Field((0.0, 0.0, 0.0), description="mm, middle of its axis")
    direction: Triple = Field(UPRIGHT, description="direction of the axis")


class MeshTable(BodyTable):
    """A mesh in the machine frame at home."""

    record = MeshShape

    shape: Literal["mesh"] = Field(description="a mesh from a file")
    file: str = Field(min_length=1, description="relative to the machine file")
    scale: float = Field(1.0, gt=0.0, description="mm in one unit of the file")


def path_from(folder: Path | None, file: Path) -> str:
    """Name a file relative to a folder; by its absolute path where there is none, or on another drive."""
    whole = file.resolve()
    if folder is None:
        return whole.as_posix()
    try:
        return Path(os.path.relpath(whole, folder.resolve())).as_posix()
    except ValueError:  # another drive, on Windows
        return whole.as_posix()


class MachineFile(StrictModel):
    """A machine file."""

    name: str = Field(min_length=1, description="name of the machine in lists and reports")
    code: str = Field(description="form-shaping code, workpiece to tool: 1…6 for X Y Z A B C, 0 for the bed")
    description: str = Field("", description="one sentence on what is known of the machine and what isn't")
    control: str = Field(
        "",
        description="that programs for the machine are for, unless a job names another: a name that "
        "`fiveaxis controls` lists, or a control table (.toml), relative to this file",
    )
    structure: StructureTable | None = None
    spindle: SpindleTable | None = None
    vertical: VerticalTable | None = None
    base_power: PowerTable | None = None
    spindle_idle: SpindleIdleTable | None = None
    auxiliary: AuxiliaryTable | None = None
    load: LoadTable | None = None
    size: SizeTable | None = None
    axes: dict[Literal["X", "Y", "Z", "A", "B", "C"], AxisTable] = Field(
        default_factory=dict, description="one table per axis of the code"
    )
    bodies: list[Annotated[BoxTable | CylinderTable | MeshTable, Field(discriminator="shape")]] = Field(
        default_factory=list, description="shapes of the machine, for collision checks"
    )
