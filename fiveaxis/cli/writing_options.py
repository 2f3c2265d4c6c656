"""Options about the text of a program, shared by the commands that write one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from fiveaxis.nc import Coordinates, ProgramSettings

Tcp = Annotated[
    bool | None, typer.Option("--tcp", help="NC with tool tip and rotary angles (TCP), not axis positions")
]
Vectors = Annotated[
    bool | None,
    typer.Option("--vectors", help="NC with tool tip and tool direction; the control picks the angles"),
]
ToolNumber = Annotated[
    int | None, typer.Option("--tool-number", help="number of the tool in NC")
]
LengthOffset = Annotated[
    int | None, typer.Option("--length-offset", help="number of the tool length (H); default: tool number")
]
SpindleSpeed = Annotated[
    float | None, typer.Option("--spindle-rpm", help="spindle speed that NC sets, rev/min")
]
SpindleDirection = Annotated[
    str | None, typer.Option("--spindle-direction", help="right or left; default: right")
]
Coolant = Annotated[str | None, typer.Option("--coolant", help="coolant that NC switches on: flood, mist, …")]
ZeroWord = Annotated[str | None, typer.Option("--zero-word", help="work offset that NC selects: G55, …")]
LineNumbers = Annotated[int | None, typer.Option("--line-numbers", help="step of the block numbers")]
Retract = Annotated[
    float | None,
    typer.Option("--retract", help="Z in machine coordinates where NC begins and ends, mm"),
]
LeadOutAtEnd = Annotated[
    bool | None,
    typer.Option("--way-out/--end-in-cut", help="lead the tool out of the last cut (default), or end in it"),
]
Home = Annotated[str | None, typer.Option("--home", help="axes that NC sends home at the end: 'Z XY AC'")]
NcUnit = Annotated[str | None, typer.Option("--nc-unit", help="unit of NC: mm or inch")]
ProgramNumber = Annotated[
    int | None, typer.Option("--program-number", help="number (O) of Fanuc and Haas programs")
]
ProgramName = Annotated[
    str | None, typer.Option("--program-name", help="name of Klartext programs; default: the file's")
]

WRITING: Mapping[str, Any] = {
    "tcp": Tcp,
    "vectors": Vectors,
    "tool_number": ToolNumber,
    "length_offset": LengthOffset,
    "spindle_rpm": SpindleSpeed,
    "spindle_direction": SpindleDirection,
    "coolant": Coolant,
    "zero_word": ZeroWord,
    "line_numbers": LineNumbers,
    "retract": Retract,
    "way_out": LeadOutAtEnd,
    "home": Home,
    "nc_unit": NcUnit,
    "program_number": ProgramNumber,
    "program_name": ProgramName,
}
# Option -> key of `ProgramSettings`, where they differ.
_KEYS = {"zero_word": "work_offset", "nc_unit": "unit", "program_number": "number", "program_name": "name"}


def coordinates_of(options: Mapping[str, Any]) -> Coordinates | None:
    """Return the coordinates that the options select; None leaves the choice to the control.

    Raises
    ------
    SettingError
        Both options.
    """
    if options.get("tcp") and options.get("vectors"):
        raise SettingError("--tcp writes angles and --vectors directions; give one of them")
    if options.get("vectors"):
        return "vector"
    return "tip" if options.get("tcp") else None


def given_settings(options: Mapping[str, Any]) -> dict[str, Any]:
    """Collect the options that are given, by key of `ProgramSettings`."""
    names = [name for name in WRITING if name not in ("tcp", "vectors")]
    return {_KEYS.get(n, n): options[n] for n in names if options.get(n) is not None}


def settings_of(options: Mapping[str, Any]) -> ProgramSettings:
    """Make the settings of a program from the options.

    Raises
    ------
    SettingError
        One that is out of range.
    """
    from fiveaxis.nc import make_settings

    return make_settings(**given_settings(options))
