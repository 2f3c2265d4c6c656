"""Reading toolpaths, and writing and reading motions: the border where inches, degrees and mm/min live."""

from fiveaxis.nc.control.program_reader import ProgramMotion, read_program
from fiveaxis.nc.formats import read_toolpath
from fiveaxis.nc.motion_table import read_motion, write_motion
from fiveaxis.nc.point_table import write_toolpath
from fiveaxis.nc.program import Program, compose_program, require_program, write_program
from fiveaxis.nc.run_time import PredictedTime, predicted_time
from fiveaxis.nc.writing.catalogue import DIALECTS, find_dialect
from fiveaxis.nc.writing.program_settings import ProgramSettings, make_settings
from fiveaxis.nc.writing.table_parts import Coordinates
from fiveaxis.nc.writing.tables import Dialect

__all__ = [
    "DIALECTS",
    "Coordinates",
    "Dialect",
    "PredictedTime",
    "Program",
    "ProgramMotion",
    "ProgramSettings",
    "compose_program",
    "find_dialect",
    "make_settings",
    "predicted_time",
    "read_motion",
    "read_program",
    "read_toolpath",
    "require_program",
    "write_motion",
    "write_program",
    "write_toolpath",
]
