"""What the header of a program by this package states for its readers, who find it here.

Tool and feed are written and read below; control, winding and positions are written by `writing.header`.
"""

from __future__ import annotations

import re

from fiveaxis.errors import ToolError
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import Tool, parse_tool

# Lines that are searched.
HEAD = 100
# A comment of any control; a second blank begins the continuation of a longer one.
_COMMENT = r"\s*(?:N?[0-9]+ )?[(;] ?{}: ([^)]*?)\W*"


def stated(source: Source, name: str) -> str | None:
    """Return what the header states under a name, in lower case; None if it states nothing.

    Only a comment of its own counts, not the same words in the name of a file or a machine.
    """
    pattern = re.compile(_COMMENT.format(re.escape(name)), re.IGNORECASE)
    found = (pattern.fullmatch(text[:200]) for text in source.lines[:HEAD])
    return next((match[1].lower() for match in found if match is not None), None)


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
    found = _SHAPE.fullmatch(stated(source, _TOOL) or "")
    try:
        return None if found is None else parse_tool(found[0])
    except ToolError:
        return None


def stated_feed(source: Source) -> float | None:
    """Return the feed along the path that the header states, mm/s; None where it states none."""
    found = _SPEED.fullmatch(stated(source, _FEED) or "")
    return None if found is None else float(found[1]) / 60.0
