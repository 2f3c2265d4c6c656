"""Machine files: TOML in, `Machine` out, every figure with its source."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from fiveaxis.errors import MachineError, UnknownMachine
from fiveaxis.machine.axes import Axis, DirectionalDrive, Limits
from fiveaxis.machine.chain import UNIT_DIRECTION, Chain, Line, Triple
from fiveaxis.machine.code import AXIS_ORDER, parse_code
from fiveaxis.machine.model import Machine, Provenance
from fiveaxis.settings import StrictModel, read_settings

LINEAR_UNITS = {"mm": 1.0, "inch": 25.4}
ANGLE_UNITS = {"deg": math.radians(1.0), "rad": 1.0}


class Figure(StrictModel):
    """A figure or a few that belong together, and where they come from."""

    source: str | None = Field(None, description="where the figure is printed or was measured")
    assumed: bool = Field(False, description="no source; then `note` says why this value")
    note: str | None = Field(None, description="a sentence")

    @model_validator(mode="after")
    def _has_provenance(self) -> Figure:
        if self.assumed and not self.note:
            raise ValueError("assumed = true needs a note that says why this value")
        if not self.assumed and not self.source:
            raise ValueError("needs a source, or assumed = true with a note")
        return self

    @property
    def origin(self) -> str:
        """The source or the assumption, as a sentence."""
        return "; ".join(part for part in (self.source, self.note) if part)


class LimitsTable(Figure):
    """Range of an axis value, tool relative to workpiece."""

    min: float | None = Field(None, description="lower end; leave out where there is none")
    max: float | None = Field(None, description="upper end; leave out where there is none")
    unit: Literal["mm", "inch", "deg", "rad"]

    @model_validator(mode="after")
    def _in_order(self) -> LimitsTable:
        if self.min is not None and self.max is not None and not self.min < self.max:
            raise ValueError(f"min {self.min:g} {self.unit} is not below max {self.max:g} {self.unit}")
        return self


class LineTable(Figure):
    """Where the axis lies in the machine frame at home."""

    point: Triple = (0.0, 0.0, 0.0)
    direction: Triple | None = None

    @model_validator(mode="after")
    def _points_somewhere(self) -> LineTable:
        if self.direction is not None and not any(self.direction):
            raise ValueError("direction has length 0; give three numbers, not all zero")
        return self


class DirectionalTable(Figure):
    """Measured power by direction."""

    model: Literal["directional"]
    plus: float = Field(ge=0.0, description="power while the value grows")
    minus: float = Field(ge=0.0, description="power while the value falls")
    unit: Literal["W", "W/(mm/min)", "W/(deg/min)"]


class RateTable(Figure):
    """Highest speed or acceleration."""

    value: float = Field(gt=0.0)
    unit: Literal["mm/s", "mm/min", "deg/s", "deg/min", "rad/s", "mm/s2", "deg/s2", "rad/s2"]


class PowerTable(Figure):
    """A power in W."""

    value: float = Field(ge=0.0)
    unit: Literal["W"] = "W"


class AxisTable(StrictModel):
    """Everything a machine file says about one axis."""

    limits: LimitsTable | None = None
    line: LineTable | None = None
    drive: DirectionalTable | None = None
    max_speed: RateTable | None = None
    max_acceleration: RateTable | None = None
    reversed: bool = Field(False, description="the control counts this axis the other way")


class MachineFile(StrictModel):
    """A machine file."""

    name: str
    code: str
    description: str = ""
    base_power: PowerTable | None = None
    axes: dict[Annotated[str, Field(pattern="^[XYZABC]$")], AxisTable] = Field(default_factory=dict)


def load_machine(name: str | Path) -> Machine:
    """Load a machine by name or from a file.

    Parameters
    ----------
    name : name of a machine in the library (`machine_names`), or the path of a ``.toml`` file

    Raises
    ------
    UnknownMachine
        No machine of that name; the nearest names are listed.
    MachineError
        The file can't be read or says something impossible; the message has file and line.
    """
    text = str(name)
    path = Path(name)
    if path.suffix != ".toml" and len(path.parts) == 1:
        known = {p.stem: p for p in library_files()}
        if text not in known:
            raise UnknownMachine(text, difflib.get_close_matches(text, known, n=3, cutoff=0.4), sorted(known))
        path = known[text]
    return _build(read_settings(path, MachineFile, MachineError), path)


def machine_names() -> list[str]:
    """List the machines of the library, sorted."""
    return [p.stem for p in library_files()]


def library_files() -> list[Path]:
    """List the library's files: in the installed package, else beside it in a checkout."""
    package = Path(__file__).parents[1]
    for folder in (package / "machines", package.parent / "machines"):
        if folder.is_dir():
            return sorted(folder.glob("*.toml"))
    return []


def _build(file: MachineFile, path: Path) -> Machine:
    code = parse_code(file.code)
    strangers = sorted(set(file.axes) - set(code.letters))
    if strangers:
        raise MachineError(
            f"[axes.{strangers[0]}] is not an axis of code {code}, which has {', '.join(code.letters)}",
            file=path,
        )
    letters = sorted(code.letters, key=AXIS_ORDER.index)
    tables = {c: file.axes.get(c, AxisTable()) for c in letters}
    lines = {c: _line(c, t.line) for c, t in tables.items() if t.line is not None}
    try:
        axes = tuple(_axis(c, tables[c]) for c in letters)
    except MachineError as fault:
        raise MachineError(fault.message, file=path) from None
    return Machine(
        name=file.name,
        code=code,
        chain=Chain.from_code(code, lines),
        axes=axes,
        base_power=None if file.base_power is None else file.base_power.value,
        description=file.description,
        provenance=tuple(_provenance(file, tables)),
    )


def _axis(letter: str, table: AxisTable) -> Axis:
    limits = table.limits
    low = high = None
    if limits is not None:
        low, high = (None if v is None else v * _scale(letter, limits.unit) for v in (limits.min, limits.max))
    return Axis(
        letter=letter,
        limits=Limits(-math.inf if low is None else low, math.inf if high is None else high),
        drive=None if table.drive is None else _drive(letter, table.drive),
        max_speed=_rate(letter, table.max_speed),
        max_acceleration=_rate(letter, table.max_acceleration),
        reversed=table.reversed,
    )


def _drive(letter: str, table: DirectionalTable) -> DirectionalDrive:
    if table.unit == "W":
        return DirectionalDrive(table.plus, table.minus)
    # W per (unit/min) at the border is W per (unit/s) inside: 60 times as much, per rad or mm.
    length = table.unit.removeprefix("W/(").removesuffix("/min)")
    factor = 60.0 / _scale(letter, length)
    return DirectionalDrive(table.plus * factor, table.minus * factor, proportional=True)


def _rate(letter: str, table: RateTable | None) -> float | None:
    if table is None:
        return None
    length, _, per = table.unit.partition("/")
    return table.value * _scale(letter, length) / (60.0 if per == "min" else 1.0)


def _line(letter: str, table: LineTable) -> Line:
    return Line(UNIT_DIRECTION[letter] if table.direction is None else table.direction, table.point)


def _scale(letter: str, unit: str) -> float:
    """Give the factor from a file's unit to mm or rad."""
    units = ANGLE_UNITS if letter in "ABC" else LINEAR_UNITS
    if unit not in units:
        kind = "rotary" if letter in "ABC" else "linear"
        raise MachineError(f"axis {letter} is {kind}; its unit can't be {unit}, write {' or '.join(units)}")
    return units[unit]


def _provenance(file: MachineFile, tables: dict[str, AxisTable]) -> Iterator[Provenance]:
    figures: list[tuple[str, Figure | None]] = [("base_power", file.base_power)]
    for letter, table in tables.items():
        for name in ("limits", "line", "drive", "max_speed", "max_acceleration"):
            figures.append((f"{letter} {name}", getattr(table, name)))
    for name, figure in figures:
        if figure is not None:
            yield Provenance(name, _shown(figure), figure.origin, figure.assumed)


def _shown(figure: Figure) -> str:
    """Write a figure's own values as in the file."""
    values = figure.model_dump(exclude={"source", "assumed", "note", "model"}, exclude_none=True)
    return ", ".join(f"{k} {v}" for k, v in values.items())
