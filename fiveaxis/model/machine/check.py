"""Findings about a machine file: errors, likely slips, unknown figures."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from fiveaxis.base import (
    FigureError,
    Finding,
    MachineError,
    Place,
    Severity,
    explain_one,
    line_of,
    list_faults,
    product,
    read_document,
)
from fiveaxis.model.machine.axes import Axis
from fiveaxis.model.machine.axis_tables import LOOKS_LIKE_RADIANS, AxisTable, LimitsTable
from fiveaxis.model.machine.building import build_machine, machine_document, most_astray, nominal_machine
from fiveaxis.model.machine.chain import FLAT, UNIT_DIRECTION, why_not_orienting, why_not_positioning
from fiveaxis.model.machine.figures import stated_figures
from fiveaxis.model.machine.files import find_machine, load_machine
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.machine.tables import MachineFile

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

# Codes of pydantic's faults; faults raised in `tables` are named like their code, any other is a wrong value.
FAULT_CODES = {"extra_forbidden": "unknown-key", "missing": "missing-key"}
OWN_FAULTS = ("missing_source", "missing_unit", "reversed_limits", "zero_direction")

MOST_RADIANS = 20.0 * math.pi  # rad, limit above which a figure in rad is more likely in degrees
SQUARE = 0.1  # deg, deviation from a right angle that is more than an error of squareness

Where = tuple[str | int, ...]
Located = tuple[Where, Finding]


def check_machine(name: str | Path) -> tuple[Finding, ...]:
    """Check a machine file, or a machine of the library, for faults and likely slips.

    Errors prevent the machine from being loaded or used; warnings are likely slips; notes are about unknown
    or assumed figures. All faulty keys are reported at once, but only the first contradiction between keys.

    Parameters
    ----------
    name : as for `load_machine`

    Returns
    -------
    Findings, errors first, each with its line. Codes: ``unknown-key``, ``missing-key``,
    ``invalid-value``, ``missing-unit``, ``missing-source``, ``reversed-limits``, ``zero-direction``,
    ``invalid-code``, ``unknown-axis``, ``wrong-side``, ``wrong-unit``, ``flat-axes``, ``unknown-link``,
    ``no-such-file``, ``no-orientation``, ``few-axes``, ``unit-slip``, ``non-orthogonal``, ``left-handed``,
    ``against-letter``, ``unread-key``, ``home-outside``, ``no-limits``, ``assumed-figure``, ``no-powers``.

    Raises
    ------
    UnknownMachine
        There is no machine of that name.
    MachineError
        The file can't be read, or isn't TOML.
    """
    path = find_machine(name)
    if path.suffix.lower() != ".toml":
        machine = load_machine(path)
        file = MachineFile.model_validate(machine_document(machine))
        return _sort(replace(f, place=Place(file=str(path))) for _, f in _check(machine, file))
    return check_text(read_document(path, MachineError)[0], path)


def check_text(text: str, path: Path) -> tuple[Finding, ...]:
    """Check the text of a machine file that needn't exist yet, as `check_machine`.

    Names of mesh files in it are relative to the folder of the path where it is, or will be.
    """
    found = _check_document(tomllib.loads(text), path.parent)
    return _sort(replace(f, place=Place(line=line_of(text, where), file=str(path))) for where, f in found)


def _sort(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(findings, key=lambda f: f.severity.rank))


def _check_document(data: dict[str, Any], folder: Path) -> list[Located]:
    try:
        file = MachineFile.model_validate(data)
        machine = build_machine(file, folder)
    except ValidationError as fault:
        return [_explain_key(f) for f in list_faults(fault, data)]
    except FigureError as fault:
        return [_error(fault.code, fault.location, fault.message)]
    return [*_check(machine, file), *_unread(file, machine_document(machine, folder))]


def _explain_key(fault: ErrorDetails) -> Located:
    kind = "extra_forbidden" if fault["loc"][-1:] == ("[key]",) else fault["type"]
    code = kind.replace("_", "-") if kind in OWN_FAULTS else FAULT_CODES.get(kind, "invalid-value")
    return _error(code, fault["loc"], explain_one(fault, MachineFile))


def _found(severity: Severity, code: str, where: Where, message: str, value: float | None = None) -> Located:
    return where, Finding(severity, code, message, value=value)


_error, _warning, _note = (partial(_found, severity) for severity in Severity)


def _check(machine: Machine, file: MachineFile) -> Iterator[Located]:
    yield from _check_freedom(machine)
    yield from _check_directions(nominal_machine(machine))
    yield from _check_spindle(machine)
    yield from _check_provenance(machine, file)
    yield from _check_magnitudes(file, "")
    tables = {str(letter): table for letter, table in file.axes.items()}
    for axis in machine.axes:
        table = tables.get(axis.letter, AxisTable())
        share = machine.size.explain_share(axis.moved_mass)
        if share is not None:
            where = ("axes", axis.letter, "moved_mass")
            yield _warning("unit-slip", where, f"{axis.letter} {share}", axis.moved_mass)
        yield from _check_magnitudes(table, axis.letter)
        yield from _check_limits(axis, table)
    if not machine.has_powers:
        unknown = ", ".join(a.letter for a in machine.axes if a.drive is None)
        yield _note(
            "no-powers",
            ("axes",),
            f"no drive power of {unknown}: it is estimated, unless --drives names a machine",
        )


def _check_freedom(machine: Machine) -> Iterator[Located]:
    reason = why_not_positioning(machine.chain)
    if reason is not None:
        yield _warning("few-axes", ("code",), f"code {machine.code}: {reason}")
    rotaries = machine.rotaries
    if len(rotaries) < 2:
        yield _note("few-axes", ("code",), f"{len(rotaries)} rotary axes: the posture can't be chosen")
    elif len(rotaries) == 2:
        reason = why_not_orienting(machine.chain)
        if reason is not None:
            yield _error("no-orientation", ("code",), f"code {machine.code}: {reason}")


def _check_directions(machine: Machine) -> Iterator[Located]:
    """Compare the axes' directions with their letters and with one another (ISO 841)."""
    lines = {j.letter: np.array(j.line.direction) for j in machine.chain.joints}
    for letter, direction in lines.items():
        if product(direction, np.array(UNIT_DIRECTION[letter])) < -FLAT:
            yield _warning(
                "against-letter",
                ("axes", letter, "line", "direction"),
                f"{letter} points against its letter's direction in ISO 841; if the control counts in the "
                "opposite direction, write reversed = true and the direction of ISO 841",
            )
    linear = [c for c in "XYZ" if c in lines]
    for one, other in itertools.combinations(linear, 2):
        off = math.degrees(math.asin(float(np.clip(product(lines[one], lines[other]), -1.0, 1.0))))
        if abs(off) > SQUARE:
            yield _warning(
                "non-orthogonal",
                ("axes", most_astray(machine.chain, (one, other)), "line", "direction"),
                f"{one} and {other} are at {90.0 - off:.4g} deg; linear axes are at 90 deg, and a small "
                "squareness error belongs in location_error",
                abs(off),
            )
    if len(linear) == 3 and product(np.cross(lines["X"], lines["Y"]), lines["Z"]) < 0.0:
        yield _warning(
            "left-handed",
            ("axes", "Z", "line"),
            "X, Y, Z form a left-handed frame; that of ISO 841 is right-handed",
        )


def _check_spindle(machine: Machine) -> Iterator[Located]:
    if machine.chain.tool_home[2, 2] < -FLAT:
        yield _warning(
            "against-letter",
            ("spindle", "direction"),
            "the spindle points down; its direction is from the tool's tip to its shank, up on most machines",
        )


def _check_provenance(machine: Machine, file: MachineFile) -> Iterator[Located]:
    if file.structure is None:
        yield _warning(
            "missing-source",
            ("code",),
            f"code {machine.code} has no source; write [structure] with a source, or with assumed = true and "
            "a note",
        )
    for entry in machine.provenance:
        if entry.assumed:
            yield _note("assumed-figure", _table_of(entry.figure), f"{entry.figure} is assumed: {entry.note}")


def _table_of(figure: str) -> Where:
    """Locate a figure in the file by its name in the provenance."""
    first, _, key = figure.partition(" ")
    if not key:
        return (first,)
    return ("bodies", int(key) - 1) if first == "body" else ("axes", first, key)


def _check_magnitudes(tables: MachineFile | AxisTable, letter: str) -> Iterator[Located]:
    """Compare the figures of an axis, or of the machine, with those of other machines."""
    for name, figure in stated_figures(tables):
        for key, value, usual in figure.doubts(letter):
            where = (*(("axes", letter) if letter else ()), name, key)
            text = f"{usual.name} of {letter}" if letter else usual.name
            yield _warning("unit-slip", where, f"{text} is {value:.6g} {usual.unit}; {usual}", value)


def _check_limits(axis: Axis, table: AxisTable) -> Iterator[Located]:
    where: Where = ("axes", axis.letter)
    if table.limits is None:
        if not axis.is_rotary:
            yield _note("no-limits", where, f"no limits of {axis.letter}: its travel isn't checked")
        return
    if axis.is_rotary:
        yield from _check_angles(axis, table.limits)
    if not axis.limits.contains(0.0):
        yield _note(
            "home-outside",
            (*where, "limits"),
            f"0 is outside the limits of {axis.letter}, and the chain is described with every axis at 0",
        )


def _check_angles(axis: Axis, limits: LimitsTable) -> Iterator[Located]:
    """Find angles in radians that are stated in degrees, and the reverse."""
    ends = [v for v in (limits.min, limits.max) if v is not None]
    if not ends:
        return
    largest, where = max(map(abs, ends)), ("axes", axis.letter, "limits")
    shown = " … ".join(f"{v:g}" for v in ends)
    if limits.unit == "deg" and largest <= LOOKS_LIKE_RADIANS:
        message = f"limits {shown} deg of {axis.letter} look like radians; if they are, write unit = 'rad'"
        yield _warning("unit-slip", where, message, largest)
    if limits.unit == "rad" and largest > MOST_RADIANS:
        message = f"limits {shown} rad of {axis.letter} look like degrees; if they are, write unit = 'deg'"
        yield _warning("unit-slip", where, message, largest)


def _unread(file: MachineFile, written: dict[str, Any]) -> Iterator[Located]:
    """Find keys that were accepted but not used: keys of the file that the dumped machine lacks."""
    known = set(_key_paths(written))
    for where in _key_paths(file.model_dump(exclude_defaults=True, exclude_none=True)):
        # A nameplate is kept as the power that follows from it.
        if where not in known and where[2:3] != ("motor",):
            name = ".".join(map(str, where))
            yield _warning("unread-key", where, f"{name} has no effect here; remove it")


def _key_paths(document: Any, where: Where = ()) -> Iterator[Where]:
    """List the key paths of all values in nested tables."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield from _key_paths(value, (*where, key))
    elif isinstance(document, list) and document and isinstance(document[0], dict):
        for i, entry in enumerate(document):
            yield from _key_paths(entry, (*where, i))
    else:
        yield where
