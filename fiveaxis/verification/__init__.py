"""An independent check of motions and programs, with other kinematics than the optimiser's."""

from fiveaxis.verification.approach import Leads as Leads
from fiveaxis.verification.approach import choose_leads as choose_leads
from fiveaxis.verification.between import CheckedInterpolation as CheckedInterpolation
from fiveaxis.verification.check_context import DEFAULT_TOLERANCES as DEFAULT_TOLERANCES
from fiveaxis.verification.check_context import PathConstraints as PathConstraints
from fiveaxis.verification.check_context import Tolerances as Tolerances
from fiveaxis.verification.model import build_model as build_model
from fiveaxis.verification.model import tool_poses as tool_poses
from fiveaxis.verification.program import check_program as check_program
from fiveaxis.verification.program import check_read as check_read
from fiveaxis.verification.program import check_table as check_table
from fiveaxis.verification.program import verify_text as verify_text
from fiveaxis.verification.program_rows import NOTHING as NOTHING
from fiveaxis.verification.program_rows import Against as Against
from fiveaxis.verification.read_back import ReadBack as ReadBack
from fiveaxis.verification.read_back import WrittenText as WrittenText
from fiveaxis.verification.read_back import check_text as check_text
from fiveaxis.verification.read_back import unsaid as unsaid
from fiveaxis.verification.report import Report as Report
from fiveaxis.verification.verdict import CHECKS as CHECKS
from fiveaxis.verification.verdict import Examination as Examination
from fiveaxis.verification.verdict import examine as examine
from fiveaxis.verification.verdict import verify as verify
