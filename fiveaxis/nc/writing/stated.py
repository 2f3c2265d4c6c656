"""What a program states besides its path, as settings of a program that is made of it."""

from __future__ import annotations

import re
from typing import Any

from fiveaxis.base import Finding, Place, Severity
from fiveaxis.model import Operation
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.tables import Dialect

# Code of the finding on what can't be kept.
NOT_KEPT = "not-kept"
# Digits of the longest number of a tool.
LONGEST_NUMBER = 8


def stated_settings(
    operation: Operation, dialect: Dialect, given: ProgramSettings, file: str
) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Return an operation's tool, length offset, spindle, coolant and work offset as settings of a program.

    Parameters
    ----------
    given : settings that override what the operation states
    file : that states it

    Returns
    -------
    The settings that aren't given, and the finding on what a control can't write of them.
    """
    if dialect.language != "blocks":
        return {}, ()
    known = {word: name for name, block in dialect.coolant.items() for word in (*block.split(), name.upper())}
    coolant, zero = known.get(operation.coolant), operation.work_offset
    speed = operation.spindle or 0.0
    spindle = dialect.spindle if speed > 0.0 else dialect.spindle_left
    stated: dict[str, tuple[object, Any]] = {
        "tool_number": (operation.tool, _number(operation.tool) if dialect.tool_change else None),
        "length_offset": (
            operation.length_offset if operation.length_offset != operation.tool else "",
            _number(operation.length_offset) if dialect.uses("offset") else None,
        ),
        "spindle_rpm": (speed, abs(speed) if spindle else None),
        "coolant": (operation.coolant, coolant),
        "work_offset": (zero, zero if re.fullmatch(dialect.work_offsets, zero) else None),
    }
    unset = {name: pair for name, pair in stated.items() if name not in _set(given)}
    kept = {name: value for name, (said, value) in unset.items() if said and value is not None}
    if speed < 0.0 and "spindle_rpm" in kept and "spindle_direction" not in _set(given):
        kept["spindle_direction"] = "left"
    lost = ", ".join(f"{name} {said}" for name, (said, value) in unset.items() if said and value is None)
    text = f"control {dialect.name} isn't given the input's {lost}; see that it is in force"
    place = Place(line=operation.first_line, file=file)
    return kept, (Finding(Severity.WARNING, NOT_KEPT, text, place),) if lost else ()


def with_stated(settings: ProgramSettings, stated: dict[str, Any]) -> ProgramSettings:
    """Add what an input states to the settings of a program."""
    given = {name: getattr(settings, name) for name in _set(settings)}
    return ProgramSettings(**given | stated)


def _set(settings: ProgramSettings) -> set[str]:
    """Return the names of the settings that are given."""
    model: Any = settings
    return set(model.model_fields_set)


def _number(text: str) -> int | None:
    return int(text) if text.isdigit() and len(text) <= LONGEST_NUMBER else None
