"""Reading toolpaths, and writing and reading motions: the border where inches, degrees and mm/min live."""

from fiveaxis.nc.control.program_reader import ProgramMotion, read_program
from fiveaxis.nc.dialects import DIALECTS, Dialect, find_dialect
from fiveaxis.nc.formats import read_toolpath
from fiveaxis.nc.motion_table import read_motion, write_motion
from fiveaxis.nc.point_table import write_toolpath
from fiveaxis.nc.program import Program, compose_program, write_program

__all__ = [
    "DIALECTS",
    "Dialect",
    "Program",
    "ProgramMotion",
    "compose_program",
    "find_dialect",
    "read_motion",
    "read_program",
    "read_toolpath",
    "write_motion",
    "write_program",
    "write_toolpath",
]
