"""Options, each said once: a field of a group, with type, default, unit, range and one sentence.

A group is a `TypedDict`. From it come the keywords of functions (`spelled_out`), which editors complete and
mypy checks, the tables of job files (`table_of`), the flags of commands and the tables of the documentation.
"""

from fiveaxis.options.bounds import Bounds, ProgramBounds
from fiveaxis.options.calibration import Calibrate, FitDrive, ReadLog
from fiveaxis.options.meshes import CREASE, Meshes
from fiveaxis.options.option import (
    Option,
    completed,
    defaults,
    options_of,
    require_known,
    spelled_out,
    table_of,
    words_of,
)
from fiveaxis.options.planning import Direction, Order, PlanContour, Planning, Strategy
from fiveaxis.options.reading import Positions, Reading, ReadProgram, Wrap
from fiveaxis.options.search import Objective, Search

__all__ = [
    "CREASE",
    "Bounds",
    "Calibrate",
    "Direction",
    "FitDrive",
    "Meshes",
    "Objective",
    "Option",
    "Order",
    "PlanContour",
    "Planning",
    "Positions",
    "ProgramBounds",
    "ReadLog",
    "ReadProgram",
    "Reading",
    "Search",
    "Strategy",
    "Wrap",
    "completed",
    "defaults",
    "options_of",
    "require_known",
    "spelled_out",
    "table_of",
    "words_of",
]
