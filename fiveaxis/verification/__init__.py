"""An independent check of motions and programs, with other kinematics than the optimiser's."""

from fiveaxis.verification.approach import Leads, choose_leads
from fiveaxis.verification.between import CheckedInterpolation
from fiveaxis.verification.check_context import DEFAULT_TOLERANCES, PathConstraints, Tolerances
from fiveaxis.verification.model import build_model, tool_poses
from fiveaxis.verification.program import check_program, check_read, check_table, verify_text
from fiveaxis.verification.program_rows import NOTHING, Against
from fiveaxis.verification.read_back import ReadBack, WrittenText, check_text, unsaid
from fiveaxis.verification.report import Report
from fiveaxis.verification.verdict import CHECKS, Examination, examine, verify

__all__ = [
    "CHECKS",
    "DEFAULT_TOLERANCES",
    "NOTHING",
    "Against",
    "CheckedInterpolation",
    "Examination",
    "Leads",
    "PathConstraints",
    "ReadBack",
    "Report",
    "Tolerances",
    "WrittenText",
    "build_model",
    "check_program",
    "check_read",
    "check_table",
    "check_text",
    "choose_leads",
    "examine",
    "tool_poses",
    "unsaid",
    "verify",
    "verify_text",
]
