"""Finishing passes of a ball end mill on a mesh, and contacts of programmed paths."""

from fiveaxis.contour.options import PlanOptions as PlanOptions
from fiveaxis.contour.planner import Plan as Plan
from fiveaxis.contour.planner import plan_contour as plan_contour
from fiveaxis.contour.planner import plan_passes as plan_passes
from fiveaxis.contour.quality import PlanReport as PlanReport
from fiveaxis.contour.quality import path_quality as path_quality
from fiveaxis.contour.touching import find_contacts as find_contacts
from fiveaxis.contour.touching import on_part as on_part
