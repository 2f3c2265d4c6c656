"""Options about the text of a program, shared by the commands that write one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fiveaxis.cli.options import optional
from fiveaxis.errors import SettingError

if TYPE_CHECKING:
    from fiveaxis.motion import Coordinates
    from fiveaxis.nc import ProgramSettings

WRITING: Mapping[str, Any] = {
    "tcp": optional(bool, "NC with tool tip and rotary angles (TCP), not axis positions", "--tcp"),
    "vectors": optional(
        bool, "NC with tool tip and tool direction; the control picks the angles", "--vectors"
    ),
    "tool_number": optional(int, "number of the tool that NC changes to"),
    "length_offset": optional(int, "number of the tool length (H); default: tool number"),
    "spindle_rpm": optional(float, "spindle speed that NC sets, rev/min"),
    "spindle_direction": optional(str, "right or left; default: right"),
    "coolant": optional(str, "coolant that NC switches on: flood, mist, …"),
    "zero_word": optional(str, "work offset that NC selects: G55, …"),
    "line_numbers": optional(int, "step of the block numbers"),
    "retract": optional(float, "Z in machine coordinates where NC begins and ends, mm"),
    "way_out": optional(
        bool, "lead the tool out of the last cut (default), or end in it", "--way-out/--end-in-cut"
    ),
    "home": optional(str, "axes that NC sends home at the end: 'Z XY AC'"),
    "nc_unit": optional(str, "unit of NC: mm or inch"),
    "program_number": optional(int, "number (O) of Fanuc and Haas programs"),
    "program_name": optional(str, "name of Klartext programs; default: the file's"),
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
