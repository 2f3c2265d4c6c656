"""An independent check of a motion: other kinematics than the optimiser's, the same path and machine."""

from fiveaxis.verification.model import build_model, tool_poses
from fiveaxis.verification.report import Report
from fiveaxis.verification.subject import Tolerances
from fiveaxis.verification.verdict import verify

__all__ = ["Report", "Tolerances", "build_model", "tool_poses", "verify"]
