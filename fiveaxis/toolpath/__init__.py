"""The tool and the list of cutter locations."""

from fiveaxis.toolpath.path import MoveKind, Toolpath
from fiveaxis.toolpath.tool import Tool, parse_tool

__all__ = ["MoveKind", "Tool", "Toolpath", "parse_tool"]
