"""The comments in the header of a program by this package that are read back: written and read here."""

from __future__ import annotations

import re
from typing import get_args

from fiveaxis.base import Coordinates, Finding, Positions, Severity, ToolError, Wrap
from fiveaxis.model import Machine, Setup, Tool, parse_tool
from fiveaxis.nc.source import Source

# Names of the comments, and the forms of what they state, in lower case.
_CONTROL, _WINDING, _POSITIONS = "control", "winding", "positions"
_TOOL, _FEED, _ALONG = "tool", "feed", "mm/min along the path"
_SETUP, _DEGREE, _TABLE, _LENGTH = "setup", "degree", "table", "tool length"
_CONTAINED = re.compile(r"([0-9.]+) mm, contained in the words")
_COUNTED = re.compile(r"counts ([0-9.]+(?:e[-+][0-9]+)?) in f")
_MODULO = re.compile(r"modulo (shorter|signed) ([abc]+)")
_SHAPE = re.compile(r"[a-z]+(?::[0-9.]+)+")
_TRIPLE = r"[\[(]([-+.0-9e]+), ([-+.0-9e]+), ([-+.0-9e]+)[\])]"
_STANDS = re.compile(rf"workpiece at offset {_TRIPLE} mm, rotation {_TRIPLE} deg in the machine frame")
_HEIGHT = re.compile(r"([0-9]+\.?[0-9]*) mm below the lowest point of the part")
_SPEED = re.compile(rf"([0-9]+\.?[0-9]*) {_ALONG}")
# mm: lengths that don't differ.
SAME_LENGTH = 1e-3
# Names of the caller's comments that are read back.
CALLERS_READ_BACK = (_TOOL, _FEED)


def tool_comments(tool: Tool, feed: float | None = None) -> dict[str, str]:
    """Return the header's comments on the tool, and on the feed of its path where that is one, by name.

    Parameters
    ----------
    feed : mm/s, the same in every cut
    """
    return {_TOOL: str(tool)} | ({} if feed is None else {_FEED: f"{60.0 * feed:.7g} {_ALONG}"})


def stated_tool(source: Source) -> Tool | None:
    """Return the tool that the header states; None where it states none that is known here."""
    found = _SHAPE.fullmatch(source.stated(_TOOL) or "")
    try:
        return None if found is None else parse_tool(found[0])
    except ToolError:
        return None


def stated_feed(source: Source) -> float | None:
    """Return the feed along the path that the header states, mm/s; None where it states none."""
    found = _SPEED.fullmatch(source.stated(_FEED) or "")
    return None if found is None else float(found[1]) / 60.0


def setup_comment(setup: Setup) -> str:
    """Return the comment on where the workpiece stands, to the nanometre within a metre."""
    offset, turn = (", ".join(f"{v:.9g}" for v in values) for values in (setup.offset, setup.rotation_deg))
    return f"{_SETUP}: workpiece at offset ({offset}) mm, rotation ({turn}) deg in the machine frame"


def set_up_as_stated(machine: Machine, source: Source) -> tuple[Machine, tuple[Finding, ...]]:
    """Set workpiece and tool up as the header states, unless somebody has said where it stands and how long.

    Returns
    -------
    The machine, and what was taken, or contradicts what is known: words that contain another tool's length
    put the tip elsewhere.
    """
    machine, told = _with_length(machine, source)
    found = None if machine.setup.stated else _STANDS.match(source.stated(_SETUP) or "")
    if found is None:
        return machine, told
    values = [float(value) for value in found.groups()]
    machine = machine.with_setup((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    message = (
        f"the head says where the workpiece stands, at {machine.setup}; if it stands elsewhere, say where"
    )
    return machine, (*told, source.finding(Severity.NOTE, "setup-read", f"{message} (--work-offset)"))


def _with_length(machine: Machine, source: Source) -> tuple[Machine, tuple[Finding, ...]]:
    length = stated_length(source)
    if length is None or abs(length - machine.tool_length) <= SAME_LENGTH:
        return machine, ()
    if machine.has_tool_length:
        text = (
            f"the head says that its words contain a tool length of {length:g} mm, and the machine's tool is "
            f"{machine.tool_length:g} mm long: the tip is elsewhere by the difference; post the program for "
            f"this tool, or give --tool-length {length:g}"
        )
        return machine, (source.finding(Severity.ERROR, "tool-length-differs", text),)
    text = f"the head says that its words contain a tool length of {length:g} mm, which is taken"
    note = source.finding(Severity.NOTE, "setup-read", f"{text}; if it is another, say so (--tool-length)")
    return machine.with_tool_length(length), (note,)


def length_comment(length: float) -> str:
    """Return the comment on axis words that contain a tool's length, mm."""
    return f"{_LENGTH}: {length:.9g} mm, contained in the words"


def stated_length(source: Source) -> float | None:
    """Return the tool length that the header says the axis words contain, mm; None where it says none."""
    found = _CONTAINED.fullmatch(source.stated(_LENGTH) or "")
    return None if found is None else float(found[1])


def table_comment(height: float, *, stated: bool) -> tuple[str, str]:
    """Return name and text of the comment on how high the part stands over the table, mm.

    Only a height that somebody stated is read back: an assumed one is found again from the moves.
    """
    text = f"{height:.7g} mm below the lowest point of the part"
    return _TABLE, text if stated else f"assumed, at least {text}"


def stated_height(source: Source) -> float | None:
    """Return how high the part stands over the table by the header, mm; None where it doesn't state it."""
    found = _HEIGHT.fullmatch(source.stated(_TABLE) or "")
    return None if found is None else float(found[1])


def control_comment(control: str, coordinates: Coordinates) -> str:
    """Return the comment on the control, and on what the words are positions of."""
    return f"{_CONTROL}: {control} {coordinates}"


def stated_control(source: Source) -> tuple[str, Coordinates]:
    """Return the control that the header states, empty if none, and the coordinates, by default ``axes``."""
    name, _, words = (source.stated(_CONTROL) or "").rpartition(" ")
    return name, next((known for known in get_args(Coordinates) if known == words), "axes")


def degree_comment(degree: float) -> str:
    """Return the comment on what F counts of a degree where linear axes move, too (`MixedFeed`)."""
    return f"{_DEGREE}: counts {degree:.9g} in F"


def stated_degree(source: Source) -> float | None:
    """Return what F counts of a degree, if stated."""
    found = _COUNTED.fullmatch(source.stated(_DEGREE) or "")
    return None if found is None else float(found[1])


def modulo_comment(direction: Wrap, letters: str) -> str:
    """Return the comment on rotary words from 0 to 360, of axes by letter."""
    return f"{_WINDING}: modulo {direction} {letters}"


def stated_modulo(source: Source) -> tuple[Wrap, str] | None:
    """Return the direction of rotary words from 0 to 360, and the letters of their axes, if stated."""
    found = _MODULO.fullmatch(source.stated(_WINDING) or "")
    return None if found is None else ("signed" if found[1] == "signed" else "shorter", found[2].upper())


def positions_comment(frame: Positions) -> str:
    """Return the comment on the frame of the tip's words."""
    return f"{_POSITIONS}: {frame}"


def stated_positions(source: Source) -> Positions | None:
    """Return the frame of the tip's words, if stated."""
    found = source.stated(_POSITIONS)
    return next((known for known in get_args(Positions) if known == found), None)
