"""Settings of a program besides its moves: tool, spindle, coolant, offset; given, or stated by an input."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError, field_validator

from fiveaxis.base import (
    Finding,
    Framing,
    Place,
    SettingError,
    Severity,
    StrictModel,
    explain,
    section_of,
    table_of,
)
from fiveaxis.model import Operation
from fiveaxis.nc.writing.tables import Dialect

# Characters of a program's name.
LONGEST_NAME = 60

if TYPE_CHECKING:
    _Settings = Framing
else:
    _Settings = table_of(Framing, StrictModel)


class ProgramSettings(_Settings):
    """Settings of a program besides its moves; what isn't set isn't written."""

    if not TYPE_CHECKING:  # type checkers derive the signature from the fields

        def __init__(self, **given: Any) -> None:
            """Raise `SettingError`, in one line, for an invalid value."""
            try:
                super().__init__(**given)
            except ValidationError as fault:
                raise SettingError(explain(fault, type(self), given)) from None

        # Settings in a file are validated by pydantic directly: their reader reports a fault with its line.
        __init__.__pydantic_base_init__ = True

    @field_validator("name")
    @classmethod
    def _fits(cls, name: str | None) -> str | None:
        if name is not None and not 0 < len(name) <= LONGEST_NAME:
            raise ValueError(f"name = {name!r} must be text of 1 to {LONGEST_NAME} characters")
        return name

    @field_validator("home")
    @classmethod
    def _names_axes_once(cls, home: str) -> str:
        letters = home.replace(" ", "")
        if len(set(letters)) < len(letters) or not set(letters) <= set("XYZABC"):
            raise ValueError(f"home = {home!r} must be groups of axis letters, each once, like 'Z XY AC'")
        return home

    def named(self, name: str) -> ProgramSettings:
        """Name the program, unless it has a name."""
        settings: Any = self  # type checkers see the options only
        return self if self.name else settings.model_copy(update={"name": name[:LONGEST_NAME] or None})

    @property
    def goes_clear(self) -> bool:
        """Whether the program ends with the tool clear: with a retract, or Z alone first in `home`."""
        return self.retract is not None or self.home.split()[:1] == ["Z"]

    @property
    def missing(self) -> list[str]:
        """Names of what isn't written."""
        given = {
            "tool change": self.tool_number,
            "spindle speed": self.spindle_rpm,
            "coolant": self.coolant,
            "safe retract": self.retract,
        }
        return [what for what, value in given.items() if value is None]


ProgramSettings.__doc__ = f"{ProgramSettings.__doc__}\n\n{section_of(Framing, 'Parameters')}"


def require_writable(settings: ProgramSettings, dialect: Dialect, letters: str) -> None:
    """Check that a control can write all settings, for a machine with axes of these letters.

    `SettingError` for a setting that the control doesn't support, with what it does.
    """
    _require_names(settings, dialect)
    _require_room(settings, dialect)
    spindle = dialect.spindle_left if settings.spindle_direction == "left" else dialect.spindle
    wanted = (
        ("tool_number", settings.tool_number, dialect.tool_change),
        ("spindle_rpm", settings.spindle_rpm, spindle),
        ("retract", settings.retract, dialect.machine_move),
        ("home", settings.home or None, dialect.machine_move),
        ("line_numbers", settings.line_numbers, dialect.line_number),
        ("length_offset", settings.length_offset, dialect.uses("offset")),
        ("number", settings.number, dialect.uses("number")),
    )
    for what, value, has_words in wanted:
        if value is not None and not has_words:
            raise SettingError(f"control {dialect.name!r} has no words for {what} = {value}; leave it out")
    strange = [c for c in settings.home if c not in f"{letters} "]
    if strange:
        raise SettingError(
            f"home = {settings.home!r} names {strange[0]}, and the machine has {', '.join(letters)}"
        )
    if settings.home and not settings.goes_clear:
        raise SettingError(
            f"home = {settings.home!r} would move {settings.home.split()[0]} in rapid from where the path "
            "ends; set a retract, or begin with Z alone ('Z XY')"
        )


def spindle_text(rpm: float, dialect: Dialect) -> str:
    """Format the number of S with the control's decimals."""
    text = f"{rpm:.{dialect.spindle_decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _require_room(settings: ProgramSettings, dialect: Dialect) -> None:
    """Check that numbers are within the control's range."""
    name = dialect.name
    for what, most in dialect.most.items():
        value = getattr(settings, what)
        if what == "length_offset" and value is None and dialect.uses("offset"):
            value = settings.tool_number
        if value is not None and value > most:
            raise SettingError(
                f"{what} = {value:.12g} is beyond {most:.12g}, the most that control {name!r} reads; "
                "use a smaller one, or a custom table for a control with a larger range"
            )
    if settings.spindle_rpm is not None and float(spindle_text(settings.spindle_rpm, dialect)) == 0.0:
        raise SettingError(
            f"spindle_rpm = {settings.spindle_rpm:g} is S0 for control {name!r}, which reads "
            f"{dialect.spindle_decimals} decimals; set a higher speed"
        )
    retract, most = settings.retract, dialect.number.most
    if retract is not None and abs(retract) > most:
        raise SettingError(
            f"retract = {retract:.12g} mm is beyond {most:.12g}, the most that control {name!r} reads in a "
            "word; choose one inside the travel of Z"
        )


def _require_names(settings: ProgramSettings, dialect: Dialect) -> None:
    """Check the settings that are names: unit, coolant, work offset."""
    name = dialect.name
    if settings.unit not in dialect.unit:
        raise SettingError(
            f"control {name!r} isn't written in {settings.unit}; it has {', '.join(dialect.unit)}"
        )
    if settings.coolant is not None and settings.coolant not in dialect.coolant:
        known = ", ".join(dialect.coolant) or "none"
        raise SettingError(f"control {name!r} has no coolant {settings.coolant!r}; known: {known}")
    offset = settings.work_offset
    if offset is not None and not (dialect.work_offset and re.fullmatch(dialect.work_offsets, offset)):
        raise SettingError(
            f"control {name!r} has no work offset {offset!r}; known ones are like "
            f"{dialect.default_offset or dialect.work_offsets or 'none'}"
        )


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
