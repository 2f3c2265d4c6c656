"""Options, each said once: a field of a group, with type, default, unit, range and one sentence.

A group is a `TypedDict`, or a dataclass where its options are passed on as one record. From it come the
keywords of functions (`spelled_out`), which editors complete and mypy checks, the tables of job files
(`table_of`), the flags of commands and the tables of the documentation.
"""

from fiveaxis.options.bounds import USUAL_CONE, Bounds, LeanBounds, ProgramBounds
from fiveaxis.options.calibration import Calibrate, FitDrive, ReadLog
from fiveaxis.options.costs import Costs
from fiveaxis.options.machines import OnMachine, Placing
from fiveaxis.options.meshes import CREASE, MESH_TOLERANCE, CadFile, Meshes
from fiveaxis.options.option import (
    Option,
    as_list,
    completed,
    defaults,
    is_one_or_more,
    options_of,
    parted,
    section_of,
    spelled_out,
    table_of,
    words_of,
)
from fiveaxis.options.planning import (
    HIGHEST_FEED,
    Direction,
    FlowAlong,
    Order,
    PlanContour,
    Planning,
    Strategy,
)
from fiveaxis.options.reading import Positions, ProgramLanguage, Reading, ReadProgram, Wrap
from fiveaxis.options.search import Objective, Search
from fiveaxis.options.surroundings import (
    GOUGE_TOLERANCE,
    STOCK_TOLERANCE,
    SURFACE_TOLERANCE,
    MeshSource,
    Surrounding,
    Unit,
    Workpiece,
)
from fiveaxis.options.writing import Coordinates, Framing, Winding, Writing

__all__ = [
    "CREASE",
    "GOUGE_TOLERANCE",
    "HIGHEST_FEED",
    "MESH_TOLERANCE",
    "STOCK_TOLERANCE",
    "SURFACE_TOLERANCE",
    "USUAL_CONE",
    "Bounds",
    "CadFile",
    "Calibrate",
    "Coordinates",
    "Costs",
    "Direction",
    "FitDrive",
    "FlowAlong",
    "Framing",
    "LeanBounds",
    "MeshSource",
    "Meshes",
    "Objective",
    "OnMachine",
    "Option",
    "Order",
    "Placing",
    "PlanContour",
    "Planning",
    "Positions",
    "ProgramBounds",
    "ProgramLanguage",
    "ReadLog",
    "ReadProgram",
    "Reading",
    "Search",
    "Strategy",
    "Surrounding",
    "Unit",
    "Winding",
    "Workpiece",
    "Wrap",
    "Writing",
    "as_list",
    "completed",
    "defaults",
    "is_one_or_more",
    "options_of",
    "parted",
    "section_of",
    "spelled_out",
    "table_of",
    "words_of",
]
