"""The comments on tool and feed in the header of a program by this package: written and read here."""

from __future__ import annotations

import re

from fiveaxis.errors import ToolError
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import Tool, parse_tool

# Names of the comments, and the forms of what they state, in lower case.
_TOOL, _FEED, _ALONG = "tool", "feed", "mm/min along the path"
_SHAPE = re.compile(r"[a-z]+(?::[0-9.]+)+")
_SPEED = re.compile(rf"([0-9]+\.?[0-9]*) {_ALONG}")


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
