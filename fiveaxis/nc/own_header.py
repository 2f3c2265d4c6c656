"""The comments in the header of a program by this package that are read back: written and read here."""

from __future__ import annotations

import re
from typing import NamedTuple, get_args

from fiveaxis.base import Coordinates, Finding, Severity, ToolError
from fiveaxis.model import Machine, Tool, parse_tool
from fiveaxis.nc.source import Source

# mm: lengths that don't differ.
SAME_LENGTH = 1e-3
_TRIPLE = r"[\[(]([-+.0-9e]+), ([-+.0-9e]+), ([-+.0-9e]+)[\])]"


class Comment(NamedTuple):
    """A comment of the header.

    Parameters
    ----------
    name : that it begins with
    form : of its text, by `str.format`
    pattern : that reads the text, in lower case
    """

    name: str
    form: str
    pattern: str

    def write(self, *values: object) -> str:
        """Write the comment."""
        return f"{self.name}: {self.form.format(*values)}"

    def read(self, source: Source) -> tuple[str, ...]:
        """Return what the header states, in lower case; nothing where it doesn't state it."""
        found = re.fullmatch(self.pattern, source.stated(self.name) or "")
        return () if found is None else found.groups()

    def number(self, source: Source) -> float | None:
        """Return the number that the header states; None where it states none."""
        stated = self.read(source)
        return float(stated[0]) if stated else None


# On the control, and on what the words are positions of.
CONTROL = Comment("control", "{} {}", r"(.+) (.+?)")
# On rotary words from 0 to 360: their direction, and the axes by letter.
MODULO = Comment("winding", "modulo {} {}", r"modulo (shorter|signed) ([abc]+)")
# On the frame of the tip's words.
POSITIONS = Comment("positions", "{}", r"(table|machine)")
# On what F counts of a degree where linear axes move, too (`MixedFeed`).
DEGREE = Comment("degree", "counts {:.9g} in F", r"counts ([0-9.]+(?:e[-+][0-9]+)?) in f")
# On axis words that contain a tool's length, mm.
LENGTH = Comment("tool length", "{:.9g} mm, contained in the words", r"([0-9.]+) mm, contained in the words")
# On where the workpiece stands, mm and deg, to the nanometre within a metre.
SETUP = Comment(
    "setup",
    "workpiece at offset ({:.9g}, {:.9g}, {:.9g}) mm, rotation ({:.9g}, {:.9g}, {:.9g}) deg in the machine "
    "frame",
    rf"workpiece at offset {_TRIPLE} mm, rotation {_TRIPLE} deg in the machine frame.*",
)
# On how high the part stands over the table, mm.
HEIGHT = Comment(
    "table",
    "{:.7g} mm below the lowest point of the part",
    r"([0-9]+\.?[0-9]*) mm below the lowest point of the part",
)
# On the tool, and on the feed of its path, mm/min.
TOOL = Comment("tool", "{}", r"([a-z]+(?::[0-9.]+)+)")
FEED = Comment("feed", "{:.7g} mm/min along the path", r"([0-9]+\.?[0-9]*) mm/min along the path")
# Names of the caller's comments that are read back.
CALLERS_READ_BACK = (TOOL.name, FEED.name)


def tool_comments(tool: Tool, feed: float | None = None) -> dict[str, str]:
    """Return the header's comments on the tool, and on the feed of its path where that is one, by name.

    Parameters
    ----------
    feed : mm/s, the same in every cut
    """
    feeds = {} if feed is None else {FEED.name: FEED.form.format(60.0 * feed)}
    return {TOOL.name: str(tool)} | feeds


def stated_tool(source: Source) -> Tool | None:
    """Return the tool that the header states; None where it states none that is known here."""
    try:
        return next(map(parse_tool, TOOL.read(source)), None)
    except ToolError:
        return None


def stated_feed(source: Source) -> float | None:
    """Return the feed along the path that the header states, mm/s; None where it states none."""
    feed = FEED.number(source)
    return None if feed is None else feed / 60.0


def set_up_as_stated(machine: Machine, source: Source) -> tuple[Machine, tuple[Finding, ...]]:
    """Set workpiece and tool up as the header states, unless somebody has said where it stands and how long.

    Returns
    -------
    The machine, and what was taken, or contradicts what is known: words that contain another tool's length
    put the tip elsewhere.
    """
    machine, told = _with_length(machine, source)
    values = [] if machine.setup.stated else [float(value) for value in SETUP.read(source)]
    if not values:
        return machine, told
    machine = machine.with_setup((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    message = (
        f"the head says where the workpiece stands, at {machine.setup}; if it stands elsewhere, say where"
    )
    return machine, (*told, source.finding(Severity.NOTE, "setup-read", f"{message} (--work-offset)"))


def _with_length(machine: Machine, source: Source) -> tuple[Machine, tuple[Finding, ...]]:
    length = LENGTH.number(source)
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


def table_comment(height: float, *, stated: bool) -> tuple[str, str]:
    """Return name and text of the comment on how high the part stands over the table, mm.

    Only a height that somebody stated is read back: an assumed one is found again from the moves.
    """
    text = HEIGHT.form.format(height)
    return HEIGHT.name, text if stated else f"assumed, at least {text}"


def stated_height(source: Source) -> float | None:
    """Return how high the part stands over the table by the header, mm; None where it doesn't state it."""
    return HEIGHT.number(source)


def stated_control(source: Source) -> tuple[str, Coordinates]:
    """Return the control that the header states, empty if none, and the coordinates, by default ``axes``."""
    name, words = CONTROL.read(source) or ("", "")
    return name, next((known for known in get_args(Coordinates) if known == words), "axes")
