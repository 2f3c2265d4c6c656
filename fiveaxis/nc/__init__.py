"""Reading toolpaths, and writing and reading motions; inches, degrees and mm/min are converted here."""

from fiveaxis.nc.control.program_reader import ReadMotion, read_program
from fiveaxis.nc.formats import read_operations, read_toolpath
from fiveaxis.nc.motion_table import read_motion, write_motion
from fiveaxis.nc.operation_facts import measure_operations
from fiveaxis.nc.program import (
    NOT_VERIFIED,
    Program,
    clock_of,
    compose_program,
    control_for,
    require_motion,
    require_program,
)
from fiveaxis.nc.table import write_toolpath
from fiveaxis.nc.writing.program_settings import ProgramSettings
from fiveaxis.nc.writing.tables import DIALECTS, Dialect, find_dialect

__all__ = [
    "DIALECTS",
    "NOT_VERIFIED",
    "Dialect",
    "Program",
    "ProgramSettings",
    "ReadMotion",
    "clock_of",
    "compose_program",
    "control_for",
    "find_dialect",
    "measure_operations",
    "read_motion",
    "read_operations",
    "read_program",
    "read_toolpath",
    "require_motion",
    "require_program",
    "write_motion",
    "write_toolpath",
]
