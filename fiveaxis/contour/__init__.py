"""Waterline finishing of walls with a ball end mill: from a mesh to passes of contact points."""

from fiveaxis.contour.mesh import load_mesh
from fiveaxis.contour.planner import plan_contour
from fiveaxis.contour.touching import find_contacts

__all__ = ["find_contacts", "load_mesh", "plan_contour"]
