"""An independent check of a motion: other kinematics than the optimiser's, the same path and machine."""

from fiveaxis.verification.approach import with_approach
from fiveaxis.verification.asked import Asked
from fiveaxis.verification.between import Ways
from fiveaxis.verification.model import build_model, tool_poses
from fiveaxis.verification.report import Report
from fiveaxis.verification.subject import Tolerances
from fiveaxis.verification.verdict import examine, verify

__all__ = [
    "Asked",
    "Report",
    "Tolerances",
    "Ways",
    "build_model",
    "examine",
    "tool_poses",
    "verify",
    "with_approach",
]
