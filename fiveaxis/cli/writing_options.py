"""Options about what a program says, shared by the verbs that write one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from fiveaxis.nc import Coordinates, ProgramSettings

Tcp = Annotated[
    bool | None, typer.Option("--tcp", help="NC of the tool's tip and rotary angles, not of axis positions")
]
Vectors = Annotated[
    bool | None, typer.Option("--vectors", help="NC of the tip and tool directions: the control picks angles")
]
ToolNumber = Annotated[int | None, typer.Option("--tool-number", help="NC changes this tool in")]
LengthOffset = Annotated[
    int | None, typer.Option("--length-offset", help="NC's number of the tool length, H; else the tool's")
]
SpindleSpeed = Annotated[float | None, typer.Option("--spindle-rpm", help="NC starts the spindle, rev/min")]
SpindleDirection = Annotated[
    str | None, typer.Option("--spindle-direction", help="right or left; right by default")
]
Coolant = Annotated[str | None, typer.Option("--coolant", help="NC's coolant: flood, mist, …")]
ZeroWord = Annotated[str | None, typer.Option("--zero-word", help="NC's work offset: G55, …")]
LineNumbers = Annotated[int | None, typer.Option("--line-numbers", help="step of NC's block numbers")]
Retract = Annotated[
    float | None, typer.Option("--retract", help="Z in machine coordinates, mm: NC's first and last place")
]
WayOut = Annotated[
    bool | None, typer.Option("--way-out/--end-in-cut", help="whether NC leads the tool out of a last cut")
]
Home = Annotated[str | None, typer.Option("--home", help="axes that NC sends home at the end: 'Z XY AC'")]
NcUnit = Annotated[str | None, typer.Option("--nc-unit", help="mm or inch, of NC")]
ProgramNumber = Annotated[int | None, typer.Option("--program-number", help="O of Fanuc and Haas programs")]
ProgramName = Annotated[str | None, typer.Option("--program-name", help="of Klartext; else the file's")]

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
    "way_out": WayOut,
    "home": Home,
    "nc_unit": NcUnit,
    "program_number": ProgramNumber,
    "program_name": ProgramName,
}
# Option -> key of `ProgramSettings`, where they differ.
_KEYS = {"zero_word": "work_offset", "nc_unit": "unit", "program_number": "number", "program_name": "name"}


def coordinates_of(options: Mapping[str, Any]) -> Coordinates | None:
    """Tell which coordinates the options ask for; None leaves them to the control.

    Raises
    ------
    SettingError
        Both kinds.
    """
    if options.get("tcp") and options.get("vectors"):
        raise SettingError("--tcp writes angles and --vectors directions; give one of them")
    if options.get("vectors"):
        return "vector"
    return "tip" if options.get("tcp") else None


def given_settings(options: Mapping[str, Any]) -> dict[str, Any]:
    """Pick what the options say about a program, by key of `ProgramSettings`."""
    names = [name for name in WRITING if name not in ("tcp", "vectors")]
    return {_KEYS.get(n, n): options[n] for n in names if options.get(n) is not None}


def settings_of(options: Mapping[str, Any]) -> ProgramSettings:
    """Make the settings of a program.

    Raises
    ------
    SettingError
        One that is out of range.
    """
    from fiveaxis.nc import make_settings

    return make_settings(**given_settings(options))
