"""Writing a `Machine` as a machine file: the inverse of `building`."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from fiveaxis.errors import MachineError
from fiveaxis.files import require_suffix, write_atomically
from fiveaxis.geometry import Array
from fiveaxis.machine.axes import Axis, LocationError
from fiveaxis.machine.bodies import Body, Box, Cylinder
from fiveaxis.machine.chain import UNIT_DIRECTION, Line
from fiveaxis.machine.drives import AffineDrive, DirectionalDrive, Drive, Measured, WeightDrive
from fiveaxis.machine.model import Machine
from fiveaxis.machine.provenance import Provenance

UNSTATED = "set in code, which doesn't say where it comes from"
# Values of missing keys; a file leaves these keys out.
DEFAULTS: dict[str, object] = {
    **{"source": "", "note": "", "band": None},
    **{"assumed": False, "fitted": False, "reversed": False},
}
NUMBERS = re.compile(r"\[\n((?:    [-+.e\d]+,\n)+)\]")
DECIMALS = 12  # of mm, or of a direction whose largest component is 1
MEASURED = tuple(f.name for f in fields(Measured))
RELATIVE = 2e-15  # a few units in the last place: rounding of a unit converted there and back

Table = dict[str, Any]
Origin = Callable[[str], Table]


def save_machine(machine: Machine, path: str | Path) -> Path:
    """Write a machine to a file that `load_machine` reads back as the same machine.

    Parameters
    ----------
    machine : its setup and tool length belong to a job and aren't written
    path : a ``.toml`` file, replaced in one step; mesh files are named relative to its folder if possible

    Raises
    ------
    SettingError
        The file can't be written, or has another suffix.
    """
    require_suffix(path, [".toml"], "a machine file")
    return write_atomically(path, machine_text(machine, Path(path).parent))


def machine_text(machine: Machine, folder: Path | None = None) -> str:
    """Write a machine in the format of machine files.

    Parameters
    ----------
    machine : its setup and tool length belong to a job and aren't written
    folder : to which mesh files are named relative; None names them by their absolute path

    Returns
    -------
    TOML in mm, deg, s, W and kg, without keys that have their default value
    """
    return toml_text(without_defaults(machine_document(machine, folder)))


def toml_text(document: Table) -> str:
    """Write tables as TOML, with the numbers of a list on one line."""
    text = tomli_w.dumps(document)
    return NUMBERS.sub(lambda found: "[" + ", ".join(found[1].replace(",", " ").split()) + "]", text)


def machine_document(machine: Machine, folder: Path | None = None) -> Table:
    """Convert a machine to the tables of a machine file.

    A key of a file that is missing here, in the document of the machine loaded from it, has no effect.

    Parameters
    ----------
    machine, folder : as for `machine_text`

    Returns
    -------
    Tables with every key that applies, defaults included. Each figure has a provenance: one of unknown origin
    is marked as assumed.

    Raises
    ------
    MachineError
        An axis is clamped (`Machine.holding`).
    """
    if machine.clamped:
        held = ", ".join(axis.letter for axis, _ in machine.clamped)
        raise MachineError(f"machine {machine.name!r} has {held} clamped, which a machine file can't state")
    nominal = nominal_machine(machine)
    origin = _origins(machine.provenance)
    stated = {p.figure for p in machine.provenance}
    document: Table = {"name": machine.name, "code": str(machine.code), "description": machine.description}
    if "structure" in stated:
        document["structure"] = origin("structure")
    home = nominal.chain.tool_home
    if "spindle" in stated or not np.allclose(home, np.eye(4), rtol=0.0, atol=10.0**-DECIMALS):
        line = {"point": rounded(home[:3, 3]), "direction": direction_numbers(home[:3, 2])}
        document["spindle"] = line | origin("spindle")
    if "vertical" in stated or machine.vertical != (0.0, 0.0, 1.0):
        document["vertical"] = {"direction": direction_numbers(machine.vertical)} | origin("vertical")
    if machine.base_power is not None:
        document["base_power"] = {"value": neat(machine.base_power), "unit": "W"} | origin("base_power")
    if machine.spindle_idle is not None:
        turn = 2.0 * math.pi / 60.0  # rad/s of 1 rev/min
        names = ("constant", "linear", "quadratic")
        idle = enumerate(zip(names, machine.spindle_idle, strict=True))
        terms = {name: neat(value * turn**power) for power, (name, value) in idle}
        document["spindle_idle"] = terms | origin("spindle_idle")
    if machine.auxiliary is not None:
        linear, quadratic = machine.auxiliary
        document["auxiliary"] = {"linear": linear, "quadratic": quadratic} | origin("auxiliary")
    if machine.load.mass:
        load = {"mass": neat(machine.load.mass), "centre": [neat(v) for v in machine.load.centre]}
        document["load"] = load | origin("load")
    if "size" in stated:
        known = {"kind": machine.size.kind, "mass": machine.size.mass}
        document["size"] = {key: value for key, value in known.items() if value} | origin("size")
    lines = {j.letter: j.line for j in nominal.chain.joints}
    table_side = machine.code.table
    document["axes"] = {
        a.letter: _axis(a, lines[a.letter], "workpiece" if a.letter in table_side else "tool", stated, origin)
        for a in machine.axes
    }
    document["bodies"] = [
        _body(body, folder) | origin(f"body {i}") for i, body in enumerate(machine.bodies, start=1)
    ]
    return document


def nominal_machine(machine: Machine) -> Machine:
    """Return the machine of the data sheet: without setup, tool and location errors."""
    erring = {a.letter: LocationError() for a in machine.axes if a.location_error is not None}
    return machine.with_setup().with_tool_length(0.0).with_location_errors(erring)


def _origins(provenance: tuple[Provenance, ...]) -> Origin:
    known = {p.figure: p for p in provenance}

    def origin(figure: str) -> Table:
        p = known.get(figure, Provenance(figure, "", "", assumed=True))
        # A figure without a source counts as assumed: the format knows no third kind.
        assumed = p.assumed or not p.source
        return {
            "source": p.source,
            "assumed": assumed,
            "note": p.note or (UNSTATED if assumed else ""),
            "fitted": p.fitted,
            "band": None if p.band is None else list(p.band),
        }

    return origin


def _axis(axis: Axis, line: Line, carries: str, stated: set[str], origin: Origin) -> Table:
    letter, unit = axis.letter, axis.unit
    table: Table = {"carries": carries, "reversed": axis.reversed}
    if not axis.limits.unlimited or f"{letter} limits" in stated:
        ends = zip(("min", "max"), axis.limits.ends, strict=True)
        values = {key: neat(axis.shown(v)) for key, v in ends if v is not None}
        table["limits"] = values | {"unit": unit} | origin(f"{letter} limits")
    if f"{letter} line" in stated or not _is_ideal(axis, line):
        point = {"point": rounded(line.point)} if axis.is_rotary else {}
        table["line"] = {"direction": direction_numbers(line.direction)} | point | origin(f"{letter} line")
    if axis.location_error is not None:
        error = _location_error(axis)
        table["location_error"] = error | origin(f"{letter} location_error")
    if axis.drive is not None:
        table["drive"] = drive_table(axis, axis.drive) | origin(f"{letter} drive")
    for key, value, per in (
        ("max_speed", axis.max_speed, "s"),
        ("max_acceleration", axis.max_acceleration, "s2"),
    ):
        if value is not None:
            figure = {"value": neat(axis.shown(value)), "unit": f"{unit}/{per}"}
            table[key] = figure | origin(f"{letter} {key}")
    if axis.moved_mass is not None:
        figure = {"value": neat(axis.moved_mass), "unit": "kg"}
        if axis.mass_centre is not None:
            figure["centre"] = [neat(v) for v in axis.mass_centre]
        table["moved_mass"] = figure | origin(f"{letter} moved_mass")
    if axis.motor_power is not None:
        table["motor"] = {"power": neat(axis.motor_power / 1000.0)} | origin(f"{letter} motor")
    return table


def _is_ideal(axis: Axis, line: Line) -> bool:
    """Check whether an axis lies in its letter's direction through the origin, the file's default."""
    direction = direction_numbers(line.direction) == list(UNIT_DIRECTION[axis.letter])
    return direction and (not axis.is_rotary or not any(rounded(line.point)))


def _location_error(axis: Axis) -> Table:
    """Write an axis's location error; the offset of a linear axis has no meaning."""
    error = axis.location_error or LocationError()
    tilt = {"tilt": [neat(math.degrees(v)) for v in error.tilt], "tilt_unit": "deg"}
    return {"offset": [neat(v) for v in error.offset]} | tilt if axis.is_rotary else tilt


def drive_table(axis: Axis, drive: Drive) -> Table:
    """Write a drive as the table of a machine file: its model and figures in the file's units."""
    ends = {name: getattr(drive, name) for name in MEASURED}
    known = {name: neat(60.0 * axis.shown(end)) for name, end in ends.items() if end is not None}
    return _bare_drive(axis, drive) | known


def _bare_drive(axis: Axis, drive: Drive) -> Table:
    # W per (unit/s) internally, W per (unit/min) in files.
    factor, unit = 1.0 / (60.0 * axis.shown(1.0)), f"W/({axis.unit}/min)"
    if isinstance(drive, DirectionalDrive):
        factor, unit = (factor, unit) if drive.proportional else (1.0, "W")
        powers = {"plus": neat(drive.plus * factor), "minus": neat(drive.minus * factor)}
        return {"model": "directional"} | powers | {"unit": unit}
    if isinstance(drive, AffineDrive):
        sides = {"plus": drive.plus, "minus": drive.minus}
        lines = {side: [neat(slope * factor), neat(offset)] for side, (slope, offset) in sides.items()}
        return {"model": "affine"} | lines | {"unit": unit}
    if isinstance(drive, WeightDrive):
        return {"model": "weight", "a": neat(drive.a), "b": neat(drive.b)}
    metre = 1.0 if axis.is_rotary else 1000.0
    factors = {"friction": metre, "viscous": metre**2, "counterbalance": metre, "copper": 1.0 / metre**2}
    own = [f.name for f in fields(drive) if f.name not in MEASURED]
    figures = {name: getattr(drive, name) * factors.get(name, 1.0) for name in own}
    return {"model": "friction"} | {key: neat(value) for key, value in figures.items()}


def _body(body: Body, folder: Path | None) -> Table:
    shape = body.shape
    if isinstance(shape, Box):
        size, center = [neat(v) for v in shape.size], [neat(v) for v in shape.center]
        return {"link": body.link, "shape": "box", "size": size, "center": center}
    if isinstance(shape, Cylinder):
        lengths = {"radius": neat(shape.radius), "height": neat(shape.height)}
        line = {"center": [neat(v) for v in shape.center], "direction": direction_numbers(shape.direction)}
        return {"link": body.link, "shape": "cylinder"} | lengths | line
    file = _path_from(folder, shape.file)
    return {"link": body.link, "shape": "mesh", "file": file, "scale": neat(shape.scale)}


def _path_from(folder: Path | None, file: Path) -> str:
    whole = file.resolve()
    if folder is None:
        return whole.as_posix()
    try:
        return Path(os.path.relpath(whole, folder.resolve())).as_posix()
    except ValueError:  # another drive, on Windows
        return whole.as_posix()


def direction_numbers(vector: Array | tuple[float, float, float]) -> list[float]:
    """Write a direction with 1 as its largest component: (0, 1, 1), not (0, 0.7071…, 0.7071…)."""
    components = np.asarray(vector, dtype=float)
    return rounded(components / np.abs(components).max())


def rounded(vector: Array | tuple[float, float, float]) -> list[float]:
    """Remove the rounding left by undoing a setup: exact zeros keep the chain's equations short."""
    return [_integer(round(float(v), DECIMALS)) for v in vector]


def neat(value: float) -> float:
    """Return the shortest number that is the value: 30 deg come back from radians as 29.999999999999996."""
    close = (float(f"{value:.{digits}g}") for digits in range(1, 17))
    return _integer(next((v for v in close if abs(v - value) <= RELATIVE * abs(value)), value))


def _integer(value: float) -> float:
    """Convert a whole number to an int, which TOML writes without a decimal point."""
    return int(value) if value.is_integer() else value


def without_defaults(table: Mapping[str, Any]) -> Table:
    """Leave out keys that have their default value."""
    kept: Table = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            kept[key] = without_defaults(value)
        elif value and isinstance(value, list) and isinstance(value[0], Mapping):
            kept[key] = [without_defaults(entry) for entry in value]
        elif value != [] and (key not in DEFAULTS or value != DEFAULTS[key]):
            kept[key] = value
    return kept
