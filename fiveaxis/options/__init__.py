"""Options, each said once: a field of a group, with type, default, unit, range and one sentence.

A group is a frozen record, which is passed on as it is. From it come the keywords of functions
(`keywords_of`), which editors complete and mypy checks, the tables of job files (`table_of`), the flags of
commands and the tables of the documentation.
"""

from fiveaxis.options.bounds import USUAL_CONE as USUAL_CONE
from fiveaxis.options.bounds import Bounds as Bounds
from fiveaxis.options.bounds import LeanBounds as LeanBounds
from fiveaxis.options.bounds import ProgramBounds as ProgramBounds
from fiveaxis.options.calibration import Calibrate as Calibrate
from fiveaxis.options.calibration import FitDrive as FitDrive
from fiveaxis.options.calibration import ReadLog as ReadLog
from fiveaxis.options.group import Group as Group
from fiveaxis.options.group import Option as Option
from fiveaxis.options.group import as_list as as_list
from fiveaxis.options.group import is_one_or_more as is_one_or_more
from fiveaxis.options.group import keywords_of as keywords_of
from fiveaxis.options.group import option as option
from fiveaxis.options.group import options_of as options_of
from fiveaxis.options.group import section_of as section_of
from fiveaxis.options.group import table_of as table_of
from fiveaxis.options.group import with_default as with_default
from fiveaxis.options.group import words_of as words_of
from fiveaxis.options.machines import Costs as Costs
from fiveaxis.options.machines import OnMachine as OnMachine
from fiveaxis.options.machines import Placing as Placing
from fiveaxis.options.meshes import CREASE as CREASE
from fiveaxis.options.meshes import MESH_TOLERANCE as MESH_TOLERANCE
from fiveaxis.options.meshes import CadFile as CadFile
from fiveaxis.options.meshes import Meshes as Meshes
from fiveaxis.options.planning import HIGHEST_FEED as HIGHEST_FEED
from fiveaxis.options.planning import Direction as Direction
from fiveaxis.options.planning import FlowAlong as FlowAlong
from fiveaxis.options.planning import Order as Order
from fiveaxis.options.planning import PlanContour as PlanContour
from fiveaxis.options.planning import Planning as Planning
from fiveaxis.options.planning import Strategy as Strategy
from fiveaxis.options.reading import LengthUnit as LengthUnit
from fiveaxis.options.reading import Positions as Positions
from fiveaxis.options.reading import ProgramLanguage as ProgramLanguage
from fiveaxis.options.reading import Reading as Reading
from fiveaxis.options.reading import ReadProgram as ReadProgram
from fiveaxis.options.reading import Wrap as Wrap
from fiveaxis.options.search import Objective as Objective
from fiveaxis.options.search import Search as Search
from fiveaxis.options.surroundings import GOUGE_TOLERANCE as GOUGE_TOLERANCE
from fiveaxis.options.surroundings import STOCK_TOLERANCE as STOCK_TOLERANCE
from fiveaxis.options.surroundings import SURFACE_TOLERANCE as SURFACE_TOLERANCE
from fiveaxis.options.surroundings import MeshSource as MeshSource
from fiveaxis.options.surroundings import Surrounding as Surrounding
from fiveaxis.options.surroundings import Unit as Unit
from fiveaxis.options.surroundings import Workpiece as Workpiece
from fiveaxis.options.writing import USUAL_CONTROL as USUAL_CONTROL
from fiveaxis.options.writing import Coordinates as Coordinates
from fiveaxis.options.writing import Framing as Framing
from fiveaxis.options.writing import Winding as Winding
from fiveaxis.options.writing import Writing as Writing
