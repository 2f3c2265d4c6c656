"""Reading toolpaths, and writing and reading motions; inches, degrees and mm/min are converted here."""

from fiveaxis.nc.control.program_reader import ReadMotion as ReadMotion
from fiveaxis.nc.control.program_reader import read_program as read_program
from fiveaxis.nc.formats import read_operations as read_operations
from fiveaxis.nc.formats import read_toolpath as read_toolpath
from fiveaxis.nc.motion_table import read_motion as read_motion
from fiveaxis.nc.motion_table import write_motion as write_motion
from fiveaxis.nc.operation_facts import measure_operations as measure_operations
from fiveaxis.nc.program import NOT_VERIFIED as NOT_VERIFIED
from fiveaxis.nc.program import Program as Program
from fiveaxis.nc.program import compose_program as compose_program
from fiveaxis.nc.program import control_for as control_for
from fiveaxis.nc.program import require_motion as require_motion
from fiveaxis.nc.program import require_program as require_program
from fiveaxis.nc.table import write_toolpath as write_toolpath
from fiveaxis.nc.writing.program_settings import ProgramSettings as ProgramSettings
from fiveaxis.nc.writing.tables import DIALECTS as DIALECTS
from fiveaxis.nc.writing.tables import Dialect as Dialect
from fiveaxis.nc.writing.tables import find_dialect as find_dialect
