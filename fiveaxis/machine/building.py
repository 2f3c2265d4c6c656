"""Building a `Machine` from the tables of a machine file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fiveaxis.errors import CodeError, FigureError, MachineError
from fiveaxis.files import require_file
from fiveaxis.geometry import frame_along, normalise, product
from fiveaxis.machine.axes import Axis, Limits, LocationError
from fiveaxis.machine.bodies import BED, Body, Box, Cylinder, MeshShape, Shape
from fiveaxis.machine.chain import UNIT_DIRECTION, Chain, Line, Triple, as_triple
from fiveaxis.machine.code import AXIS_ORDER, FormShapingCode, parse_code
from fiveaxis.machine.drives import AffineDrive, DirectionalDrive, Drive, FrictionDrive, WeightDrive
from fiveaxis.machine.freedom import why_not_positioning
from fiveaxis.machine.model import Machine
from fiveaxis.machine.provenance import Provenance, Size
from fiveaxis.machine.setup import Load
from fiveaxis.machine.tables import (
    ANGLE_UNITS,
    LINEAR_UNITS,
    AccelerationTable,
    AffineTable,
    AxisTable,
    BodyTable,
    BoxTable,
    CylinderTable,
    DirectionalTable,
    DriveTable,
    Figure,
    FrictionTable,
    LineTable,
    LocationErrorTable,
    MachineFile,
    MotorTable,
    RateTable,
    SpindleIdleTable,
    WeightTable,
)

# The figures of a machine and of an axis, in display order.
MACHINE_FIGURES = (
    "structure",
    "spindle",
    "vertical",
    "base_power",
    "spindle_idle",
    "auxiliary",
    "load",
    "size",
)
AXIS_FIGURES = (
    *("limits", "line", "location_error", "drive", "max_speed", "max_acceleration", "moved_mass", "motor"),
)
# Of servo motors at their rated load.
POWER_FACTOR = 0.8
SIDES = {"workpiece": "table", "tool": "head"}


def build_machine(file: MachineFile, folder: Path) -> Machine:
    """Build the machine that a file describes.

    Parameters
    ----------
    file : its tables
    folder : to which the names of mesh files are relative

    Raises
    ------
    FigureError
        A figure contradicts the code, its axis or another figure; `location` names the table.
    """
    try:
        code = parse_code(file.code)
    except CodeError as fault:
        raise FigureError(("code",), "invalid-code", fault.message) from None
    _require_known_axes(file, code)
    letters = sorted(code.letters, key=AXIS_ORDER.index)
    given = {str(letter): table for letter, table in file.axes.items()}
    tables = {c: given.get(c, AxisTable()) for c in letters}
    chain = Chain.from_code(code, {c: _line(c, t.line) for c, t in tables.items()})
    if file.spindle is not None:
        direction = normalise_triple(file.spindle.direction)
        chain = Chain(chain.joints, frame_along(direction, file.spindle.point))
    reason = why_not_positioning(chain) if len(chain.linears) == 3 else None
    if reason is not None:
        raise FigureError(("axes", most_astray(chain, chain.linears), "line"), "flat-axes", reason)
    machine = Machine(
        name=file.name,
        code=code,
        chain=chain,
        axes=tuple(_axis(c, tables[c]) for c in letters),
        base_power=None if file.base_power is None else file.base_power.value,
        description=file.description,
        spindle_idle=None if file.spindle_idle is None else _idle(file.spindle_idle),
        auxiliary=None if file.auxiliary is None else (file.auxiliary.linear, file.auxiliary.quadratic),
        load=Load() if file.load is None else Load(file.load.mass, file.load.centre),
        size=Size() if file.size is None else Size(file.size.kind, file.size.mass),
        vertical=(0.0, 0.0, 1.0) if file.vertical is None else normalise_triple(file.vertical.direction),
        provenance=tuple(_provenance(file, tables)),
        bodies=tuple(_body(i, table, code, folder) for i, table in enumerate(file.bodies)),
    )
    # `with_location_errors` drops the provenance that the file gives for them.
    return replace(_with_location_errors(machine, tables), provenance=machine.provenance)


def most_astray(chain: Chain, letters: Sequence[str]) -> str:
    """Find the axis that deviates most from its letter's direction (ISO 841): most likely the wrong one."""
    along = {j.letter: float(product(j.line.direction, UNIT_DIRECTION[j.letter])) for j in chain.joints}
    return min(letters, key=lambda letter: along[letter])


def normalise_triple(direction: Triple) -> Triple:
    """Scale a direction, (3,), to length 1."""
    return as_triple(normalise(np.array(direction)))


def _require_known_axes(file: MachineFile, code: FormShapingCode) -> None:
    for letter, table in file.axes.items():
        if letter not in code.letters:
            raise FigureError(
                ("axes", letter),
                "unknown-axis",
                f"[axes.{letter}] is not an axis of code {code}, which has {', '.join(code.letters)}",
            )
        side = "workpiece" if letter in code.table else "tool"
        if table.carries not in (None, side):
            raise FigureError(("axes", letter, "carries"), "wrong-side", _explain_side(letter, table, code))


def _explain_side(letter: str, table: AxisTable, code: FormShapingCode) -> str:
    digit = code.text[[*code.table, "0", *code.head].index(letter)]
    rest = code.text.replace(digit, "")
    at = rest.index("0")
    moved = (
        rest[:at] + digit + rest[at:]
        if table.carries == "workpiece"
        else rest[: at + 1] + digit + rest[at + 1 :]
    )
    stated, found = SIDES[str(table.carries)], "table" if letter in code.table else "head"
    return (
        f"{letter} carries the {table.carries}, so it belongs to the {stated}, but code {code} has it in the "
        f"{found}; codes are read from the workpiece to the tool, with 0 for the bed: write for example "
        f"{moved}, or {code.text[::-1]} if the code was written from the tool"
    )


def _idle(table: SpindleIdleTable) -> Triple:
    turn = 60.0 / (2.0 * math.pi)  # rev/min of 1 rad/s
    return table.constant, table.linear * turn, table.quadratic * turn**2


def _with_location_errors(machine: Machine, tables: dict[str, AxisTable]) -> Machine:
    for letter, table in tables.items():
        if table.location_error is not None:
            try:
                machine = machine.with_location_errors({letter: _location_error(table.location_error)})
            except MachineError as fault:
                where = ("axes", letter, "location_error")
                raise FigureError(where, "invalid-value", f"axis {letter}: {fault.message}") from None
    return machine


def _location_error(table: LocationErrorTable) -> LocationError:
    unit = 1.0 if table.tilt_unit is None else ANGLE_UNITS[table.tilt_unit]
    a, b, c = table.tilt
    return LocationError(table.offset, (a * unit, b * unit, c * unit))


def _axis(letter: str, table: AxisTable) -> Axis:
    _require_masses(letter, table)
    mass = table.moved_mass
    limits = table.limits
    low = high = None
    if limits is not None and limits.unit is not None:
        unit = _scale(letter, "limits", limits.unit)
        low, high = (None if v is None else v * unit for v in (limits.min, limits.max))
    return Axis(
        letter=letter,
        limits=Limits(-math.inf if low is None else low, math.inf if high is None else high),
        drive=None if table.drive is None else _drive(letter, table.drive),
        max_speed=_rate(letter, "max_speed", table.max_speed),
        max_acceleration=_rate(letter, "max_acceleration", table.max_acceleration),
        reversed=table.reversed,
        moved_mass=None if mass is None else mass.value,
        mass_centre=None if mass is None or letter not in "ABC" else mass.centre,
        motor_power=None if table.motor is None else _motor_power(table.motor),
    )


def _motor_power(table: MotorTable) -> float:
    """Return a motor's rated power, W; of its current, that of three phases at a usual power factor."""
    if table.power is not None:
        return 1000.0 * table.power
    return math.sqrt(3.0) * POWER_FACTOR * (table.current or 0.0) * (table.voltage or 0.0)


def _drive(letter: str, table: DriveTable) -> Drive:
    unit = math.radians(1.0) if letter in "ABC" else 1.0
    ends = table.measured_from, table.measured_to
    slowest, fastest = (None if end is None else end * unit / 60.0 for end in ends)
    return replace(_bare_drive(letter, table), measured_from=slowest, measured_to=fastest)


def _bare_drive(letter: str, table: DriveTable) -> Drive:
    if isinstance(table, DirectionalTable):
        if table.unit == "W":
            return DirectionalDrive(table.plus, table.minus)
        factor = _slope_factor(letter, table.unit)
        return DirectionalDrive(table.plus * factor, table.minus * factor, proportional=True)
    if isinstance(table, AffineTable):
        factor = _slope_factor(letter, table.unit)
        plus, minus = ((slope * factor, offset) for slope, offset in (table.plus, table.minus))
        return AffineDrive(plus, minus)
    if isinstance(table, WeightTable):
        return WeightDrive(table.a, table.b)
    # N is J/m: a thousandth per mm, squared where the metre is squared.
    metre = 1.0 if letter in "ABC" else 1000.0
    return FrictionDrive(
        friction=table.friction / metre,
        viscous=table.viscous / metre**2,
        counterbalance=table.counterbalance / metre,
        inertia=table.inertia,
        efficiency=table.efficiency,
        regeneration=table.regeneration,
        copper=table.copper * metre**2,
        moving=table.moving,
        hold=table.hold,
    )


def _slope_factor(letter: str, unit: str) -> float:
    """Return the factor from a file's W per (unit/min) or (unit/s) to W per (mm/s) or (rad/s)."""
    length, _, per = unit.removeprefix("W/(").removesuffix(")").partition("/")
    return (60.0 if per == "min" else 1.0) / _scale(letter, "drive", length)


def _require_masses(letter: str, table: AxisTable) -> None:
    """Raise if a drive needs figures that the axis lacks, or has figures that don't apply to it."""
    where = ("axes", letter, "drive")
    drive, rotary = table.drive, letter in "ABC"
    if isinstance(drive, WeightTable) and (rotary or table.moved_mass is None):
        need = "is for linear axes" if rotary else f"needs [axes.{letter}.moved_mass]"
        raise FigureError(where, "missing-mass", f"the weight drive of {letter} {need}")
    if isinstance(drive, FrictionTable) and not rotary:
        if drive.inertia:
            message = f"inertia is for a rotary axis; {letter} is linear and has moved_mass"
            raise FigureError((*where, "inertia"), "wrong-unit", message)
        if table.moved_mass is None:
            message = f"the friction drive of {letter} needs [axes.{letter}.moved_mass]"
            raise FigureError(where, "missing-mass", message)


def _rate(letter: str, key: str, table: RateTable | AccelerationTable | None) -> float | None:
    if table is None:
        return None
    if table.unit == "rpm":
        return table.value * _scale(letter, key, "rpm") * 2.0 * math.pi / 60.0
    length, _, per = table.unit.partition("/")
    return table.value * _scale(letter, key, length) / (60.0 if per == "min" else 1.0)


def _line(letter: str, table: LineTable | None) -> Line:
    nominal = Line(UNIT_DIRECTION[letter])
    if table is None:
        return nominal
    point = table.point if table.point is not None and letter in "ABC" else nominal.point
    try:
        return Line(nominal.direction if table.direction is None else table.direction, point)
    except MachineError as fault:
        raise FigureError(("axes", letter, "line"), "zero-direction", fault.message) from None


def _scale(letter: str, key: str, unit: str) -> float:
    """Return the factor from a file's unit to mm or rad."""
    rotary = letter in "ABC"
    units = ANGLE_UNITS | {"rpm": 1.0} if rotary else LINEAR_UNITS
    if unit not in units:
        kind, offered = ("rotary", "deg or rad") if rotary else ("linear", "mm or inch")
        message = f"axis {letter} is {kind}; its unit can't be {unit}, write {offered}"
        raise FigureError(("axes", letter, key), "wrong-unit", message)
    return units[unit]


def _body(index: int, table: BodyTable, code: FormShapingCode, folder: Path) -> Body:
    if table.link not in (BED, *code.letters):
        known = ", ".join((BED, *code.letters))
        message = f"body {index + 1}: no link {table.link!r}; code {code} has {known}"
        raise FigureError(("bodies", index), "unknown-link", message)
    return Body(table.link, _shape(index, table, folder))


def _shape(index: int, table: BodyTable, folder: Path) -> Shape:
    if isinstance(table, BoxTable):
        return Box(table.size, table.center)
    if isinstance(table, CylinderTable):
        return Cylinder(table.radius, table.height, table.center, normalise_triple(table.direction))
    file = folder / table.file
    try:
        require_file(file, MachineError)
    except MachineError as fault:
        raise FigureError(("bodies", index), "no-such-file", f"body {index + 1}: {fault}") from None
    return MeshShape(file, table.scale)


def _provenance(file: MachineFile, tables: dict[str, AxisTable]) -> Iterator[Provenance]:
    figures: list[tuple[str, Figure | None]] = [(name, getattr(file, name)) for name in MACHINE_FIGURES]
    for letter, table in tables.items():
        figures.extend((f"{letter} {name}", getattr(table, name)) for name in AXIS_FIGURES)
    figures.extend((f"body {i + 1}", table) for i, table in enumerate(file.bodies))
    for name, figure in figures:
        if figure is not None:
            value = f"code {file.code}" if figure is file.structure else _format_figure(figure)
            yield Provenance(
                name,
                value,
                figure.source or "",
                figure.assumed,
                figure.note or "",
                figure.fitted,
                figure.band,
            )


def _format_figure(figure: Figure) -> str:
    """Format a figure's own values as in the file."""
    values = figure.model_dump(
        exclude={"source", "assumed", "fitted", "note", "band", "model"}, exclude_none=True
    )
    texts = {
        key: "(" + ", ".join(f"{v:g}" for v in value) + ")" if isinstance(value, tuple) else str(value)
        for key, value in values.items()
    }
    return ", ".join(f"{key} {text}" for key, text in texts.items())
