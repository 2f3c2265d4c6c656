"""The tool, the list of cutter locations, and how far the tool may lean there."""

from fiveaxis.toolpath.dividing import divide, divided_rows, interpolate, part_places
from fiveaxis.toolpath.path import MoveKind, Toolpath
from fiveaxis.toolpath.tilt import TiltBounds, require_range, tilt_bounds
from fiveaxis.toolpath.tool import Tool, parse_tool

__all__ = [
    "MoveKind",
    "TiltBounds",
    "Tool",
    "Toolpath",
    "divide",
    "divided_rows",
    "interpolate",
    "parse_tool",
    "part_places",
    "require_range",
    "tilt_bounds",
]
