"""Building a `Machine` from the tables of a machine file, and the inverse: the tables of a `Machine`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel

from fiveaxis.base import CodeError, FigureError, MachineError, product
from fiveaxis.model.machine.axes import Axis, LocationError
from fiveaxis.model.machine.axis_tables import AxisTable
from fiveaxis.model.machine.bodies import Body
from fiveaxis.model.machine.chain import UNIT_DIRECTION, Chain, why_not_positioning
from fiveaxis.model.machine.code import AXIS_ORDER, BED, FormShapingCode, parse_code
from fiveaxis.model.machine.drive_tables import MeasuredTable
from fiveaxis.model.machine.figures import Figure, Table, figure_models, neat, stated_figures
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.provenance import Provenance
from fiveaxis.model.machine.tables import BodyTable, MachineFile, path_from

SIDES = {"workpiece": "table", "tool": "head"}
# Values of missing keys; a file leaves these keys out.
DEFAULTS: dict[str, object] = {
    **{"source": "", "note": "", "band": None},
    **{"assumed": False, "fitted": False, "reversed": False},
}
NUMBERS = re.compile(r"\[\n((?:    [-+.e\d]+,\n)+)\]")
# In which sense an axis counts, where nobody knows.
UNSETTLED = "unknown"
# A figure so many times beyond the range on machines is a mistake.
FAR = 100.0
CONTROL_TABLE = ".toml"
UNSTATED = "set in code, which doesn't say where it comes from"

Origin = Callable[[str], Table]


def build_machine(file: MachineFile, folder: Path) -> Machine:
    """Build the machine that a file describes; its mesh files are named relative to a folder.

    `FigureError` for a figure that contradicts the code, its axis or another one; `location` names the table.
    """
    try:
        code = parse_code(file.code)
    except CodeError as fault:
        raise FigureError(("code",), "invalid-code", fault.message) from None
    _require_known_axes(file, code)
    letters = sorted(code.letters, key=AXIS_ORDER.index)
    given = {str(letter): table for letter, table in file.axes.items()}
    tables = {c: given.get(c, AxisTable()) for c in letters}
    by_axis = {c: _read(table, c) for c, table in tables.items()}
    lines = {c: figures.pop("line") for c, figures in by_axis.items() if "line" in figures}
    errors = {c: fs.pop("location_error") for c, fs in by_axis.items() if "location_error" in fs}
    own = _read(file)
    _require_plausible(file)
    axes = tuple(Axis(c, reversed=_sense(tables[c]), **by_axis[c]) for c in letters)
    for axis in axes:
        _require_as_slow(axis)
    chain = Chain.from_code(code, lines)
    if "tool_home" in own:
        chain = replace(chain, tool_home=own.pop("tool_home"))
    reason = why_not_positioning(chain) if len(chain.linears) == 3 else None
    if reason is not None:
        raise FigureError(("axes", most_astray(chain, chain.linears), "line"), "flat-axes", reason)
    machine = Machine(
        name=file.name,
        code=code,
        chain=chain,
        axes=axes,
        description=file.description,
        control=str(folder / file.control) if file.control.lower().endswith(CONTROL_TABLE) else file.control,
        provenance=tuple(_provenance(file, tables)),
        bodies=tuple(_body(i, table, code, folder) for i, table in enumerate(file.bodies)),
        **own,
    )
    # `with_location_errors` drops the provenance that the file gives for them.
    return replace(_with_location_errors(machine, errors), provenance=machine.provenance)


def _require_plausible(file: MachineFile) -> None:
    """Raise at a figure that no unit of its kind explains; `check_machine` doubts nearer ones."""
    for letter, tables in (("", file), *((str(c), table) for c, table in file.axes.items())):
        for name, figure in stated_figures(tables):
            for key, value, usual in figure.doubts(letter):
                if value > FAR * usual.high:
                    text = f"{usual.name} of {letter}" if letter else usual.name
                    where = (*(("axes", letter) if letter else ()), name, key)
                    fact = f"{text} is {value:.6g} {usual.unit}, which no machine has"
                    raise FigureError(where, "unit-slip", f"{fact}; {usual}")


def _require_as_slow(axis: Axis) -> None:
    """Raise where a drive's slowest measured speed is above its fastest one, or above that of the axis."""
    if axis.drive is None or axis.drive.measured_from is None:
        return
    remedies = {"measured_to": "exchange them", "max_speed": "correct the unit of one of them"}
    for (name, remedy), end in zip(remedies.items(), (axis.drive.measured_to, axis.max_speed), strict=True):
        slowest, highest = (neat(60.0 * axis.shown(v)) for v in (axis.drive.measured_from, end or math.inf))
        if slowest > highest:
            unit = f"{axis.unit}/min"
            fact = f"measured_from of {axis.letter} is {slowest:g} {unit}, above {name}, {highest:g} {unit}"
            where = ("axes", axis.letter, "drive", "measured_from")
            raise FigureError(where, "reversed-range", f"{fact}; {remedy}")


def machine_document(machine: Machine, folder: Path | None = None) -> Table:
    """Convert a machine to the tables of a machine file, with every key that applies, defaults included.

    A key of a file that is missing here, in the document of the machine loaded from it, has no effect. Each
    figure has a provenance: one of unknown origin is marked as assumed. Setup and tool length belong to a job
    and aren't written; mesh files are named as by `machine_text`. `MachineError` if an axis is clamped.
    """
    if machine.clamped:
        held = ", ".join(axis.letter for axis, _ in machine.clamped)
        raise MachineError(f"machine {machine.name!r} has {held} clamped, which a machine file can't state")
    # The axes keep the location errors that the chain is without.
    shown = replace(nominal_machine(machine), axes=machine.axes, provenance=machine.provenance)
    origin = _origins(machine.provenance)
    document: Table = {"name": machine.name, "code": str(machine.code), "description": machine.description}
    if machine.control:
        is_table = machine.control.lower().endswith(CONTROL_TABLE)
        document["control"] = path_from(folder, Path(machine.control)) if is_table else machine.control
    document |= _write(MachineFile, shown, "", origin)
    document["axes"] = {
        a.letter: {"carries": _carried(a.letter, machine.code), "reversed": _outside(a.reversed)}
        | _write(AxisTable, shown, a.letter, origin)
        for a in machine.axes
    }
    document["bodies"] = [
        BodyTable.of(body, folder) | origin(f"body {i}") for i, body in enumerate(machine.bodies, start=1)
    ]
    return document


def toml_text(document: Table) -> str:
    """Write tables as TOML, with the numbers of a list on one line."""
    text = tomli_w.dumps(document)
    return NUMBERS.sub(lambda found: "[" + ", ".join(found[1].replace(",", " ").split()) + "]", text)


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


def nominal_machine(machine: Machine) -> Machine:
    """Return the machine of the data sheet: without setup, tool and location errors."""
    erring = {a.letter: LocationError() for a in machine.axes if a.location_error is not None}
    return machine.with_setup().with_tool_length(0.0).with_location_errors(erring)


def drive_table(machine: Machine, letter: str) -> Table | None:
    """Write the drive of an axis as in a machine file, without its origin; None where it is unknown."""
    tables = (model.write(machine, letter, False) for model in figure_models(AxisTable)["drive"])
    return next((table for table in tables if table is not None), None)


def most_astray(chain: Chain, letters: Sequence[str]) -> str:
    """Find the axis that deviates most from its letter's direction (ISO 841): most likely the wrong one."""
    along = {j.letter: float(product(j.line.direction, UNIT_DIRECTION[j.letter])) for j in chain.joints}
    return min(letters, key=lambda letter: along[letter])


def _read(tables: MachineFile | AxisTable, letter: str = "") -> dict[str, Any]:
    """Read the figures of an axis, or of the machine, into fields of their records."""
    where = ("axes", letter) if letter else ()
    fields: dict[str, Any] = {}
    for key, figure in stated_figures(tables):
        try:
            if isinstance(tables, AxisTable) and isinstance(figure, MeasuredTable):
                figure.require_fitting(letter, with_mass=tables.moved_mass is not None)
            fields |= figure.read(letter)
        except FigureError as fault:
            raise FigureError((*where, key, *fault.location), fault.code, fault.message) from None
    return fields


def _write(tables: type[BaseModel], machine: Machine, letter: str, origin: Origin) -> Table:
    """Write the figures of an axis, or of the machine, in the order of the file."""
    stated = {p.figure for p in machine.provenance}
    written: Table = {}
    for key, models in figure_models(tables).items():
        name = f"{letter} {key}".strip()
        for model in models:
            table = model.write(machine, letter, name in stated)
            if table is not None:
                written[key] = table | origin(name)
    return written


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


def _outside(counts: bool | None) -> bool | str:
    return UNSETTLED if counts is None else counts


def _sense(table: AxisTable) -> bool | None:
    return None if table.reversed == UNSETTLED else bool(table.reversed)


def _carried(letter: str, code: FormShapingCode) -> str:
    return "workpiece" if letter in code.table else "tool"


def _require_known_axes(file: MachineFile, code: FormShapingCode) -> None:
    for letter, table in file.axes.items():
        if letter not in code.letters:
            raise FigureError(
                ("axes", letter),
                "unknown-axis",
                f"[axes.{letter}] is not an axis of code {code}, which has {', '.join(code.letters)}",
            )
        if table.carries not in (None, _carried(letter, code)):
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
    stated, found = SIDES[str(table.carries)], SIDES[_carried(letter, code)]
    return (
        f"{letter} carries the {table.carries}, so it belongs to the {stated}, but code {code} has it in the "
        f"{found}; codes are read from the workpiece to the tool, with 0 for the bed: write for example "
        f"{moved}, or {code.text[::-1]} if the code was written from the tool"
    )


def _with_location_errors(machine: Machine, errors: dict[str, LocationError]) -> Machine:
    for letter, error in errors.items():
        try:
            machine = machine.with_location_errors({letter: error})
        except MachineError as fault:
            where = ("axes", letter, "location_error")
            raise FigureError(where, "invalid-value", f"axis {letter}: {fault.message}") from None
    return machine


def _body(index: int, table: BodyTable, code: FormShapingCode, folder: Path) -> Body:
    where = ("bodies", index)
    if table.link not in (BED, *code.letters):
        known = ", ".join((BED, *code.letters))
        message = f"body {index + 1}: no link {table.link!r}; code {code} has {known}"
        raise FigureError(where, "unknown-link", message)
    try:
        return table.body(folder)
    except MachineError as fault:
        raise FigureError(where, "no-such-file", f"body {index + 1}: {fault}") from None


def _provenance(file: MachineFile, tables: dict[str, AxisTable]) -> Iterator[Provenance]:
    figures = list(stated_figures(file))
    for letter, table in tables.items():
        figures.extend((f"{letter} {key}", figure) for key, figure in stated_figures(table))
    figures.extend((f"body {i}", table) for i, table in enumerate(file.bodies, start=1))
    for name, figure in figures:
        value = f"code {file.code}" if figure is file.structure else _format_figure(figure)
        yield Provenance(
            name, value, figure.source or "", figure.assumed, figure.note or "", figure.fitted, figure.band
        )


def _format_figure(figure: Figure) -> str:
    """Format a figure's own values as in the file."""
    values = figure.model_dump(exclude={*Figure.model_fields, "model"}, exclude_none=True)
    texts = {
        key: "(" + ", ".join(f"{v:g}" for v in value) + ")" if isinstance(value, tuple) else str(value)
        for key, value in values.items()
    }
    return ", ".join(f"{key} {text}" for key, text in texts.items())
