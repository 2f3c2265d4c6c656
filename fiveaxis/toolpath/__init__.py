"""The tool, the cutter locations, and the constraints on the tool's posture there."""

from fiveaxis.toolpath.bounds import TiltBounds, feed_directions
from fiveaxis.toolpath.constraints import Constraints, require_range, singular_turn
from fiveaxis.toolpath.cutter import Cutter, Zone, across
from fiveaxis.toolpath.dividing import (
    Band,
    divide,
    divided_rows,
    filled,
    interpolate,
    knots,
    part_places,
    refined,
    turned,
)
from fiveaxis.toolpath.operation import MoveKind, Operation, kind_names
from fiveaxis.toolpath.path import PathShape, Toolpath
from fiveaxis.toolpath.spans import longest_spans
from fiveaxis.toolpath.tool import Holder, Section, Tool, parse_tool

__all__ = [
    "Band",
    "Constraints",
    "Cutter",
    "Holder",
    "MoveKind",
    "Operation",
    "PathShape",
    "Section",
    "TiltBounds",
    "Tool",
    "Toolpath",
    "Zone",
    "across",
    "divide",
    "divided_rows",
    "feed_directions",
    "filled",
    "interpolate",
    "kind_names",
    "knots",
    "longest_spans",
    "parse_tool",
    "part_places",
    "refined",
    "require_range",
    "singular_turn",
    "turned",
]
