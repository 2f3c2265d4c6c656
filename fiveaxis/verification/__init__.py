"""An independent check of a motion, with other kinematics than the optimiser's."""

from fiveaxis.verification.approach import Leads, choose_leads
from fiveaxis.verification.between import CheckedInterpolation
from fiveaxis.verification.check_context import DEFAULT_TOLERANCES, PathConstraints, Tolerances
from fiveaxis.verification.model import build_model, tool_poses
from fiveaxis.verification.program import LEAN_BETWEEN, verify_text
from fiveaxis.verification.read_back import ExpectedText, ReadBack, check_text
from fiveaxis.verification.report import Report
from fiveaxis.verification.verdict import CHECKS, Examination, OwnRows, examine, verify

__all__ = [
    "CHECKS",
    "DEFAULT_TOLERANCES",
    "LEAN_BETWEEN",
    "CheckedInterpolation",
    "Examination",
    "ExpectedText",
    "Leads",
    "OwnRows",
    "PathConstraints",
    "ReadBack",
    "Report",
    "Tolerances",
    "build_model",
    "check_text",
    "choose_leads",
    "examine",
    "tool_poses",
    "verify",
    "verify_text",
]
