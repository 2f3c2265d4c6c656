"""Finishing passes of a ball end mill on a mesh, and contacts of programmed paths."""

from fiveaxis.contour.options import PlanOptions
from fiveaxis.contour.planner import Plan, plan_contour, plan_passes
from fiveaxis.contour.quality import PlanReport, path_quality
from fiveaxis.contour.touching import find_contacts, on_part

__all__ = [
    "Plan",
    "PlanOptions",
    "PlanReport",
    "find_contacts",
    "on_part",
    "path_quality",
    "plan_contour",
    "plan_passes",
]
