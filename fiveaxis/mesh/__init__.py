"""Meshes of parts and bodies: files, distances, smooth normals, exact surfaces of CAD files."""

from fiveaxis.mesh.cad.model import Model as Model
from fiveaxis.mesh.cad.model import model_of as model_of
from fiveaxis.mesh.cad.records import Face as Face
from fiveaxis.mesh.cad.records import Foot as Foot
from fiveaxis.mesh.distance import TriangleTree as TriangleTree
from fiveaxis.mesh.distance import kept_by_mesh as kept_by_mesh
from fiveaxis.mesh.distance import tree_of as tree_of
from fiveaxis.mesh.loading import body_findings as body_findings
from fiveaxis.mesh.loading import check_mesh as check_mesh
from fiveaxis.mesh.loading import load_mesh as load_mesh
from fiveaxis.mesh.loading import mesh_size as mesh_size
from fiveaxis.mesh.loading import other_sizes as other_sizes
from fiveaxis.mesh.loading import read_solid as read_solid
from fiveaxis.mesh.loading import require_solid as require_solid
from fiveaxis.mesh.loading import size_findings as size_findings
from fiveaxis.mesh.loading import size_text as size_text
from fiveaxis.mesh.loading import take_mesh as take_mesh
from fiveaxis.mesh.surface import Surface as Surface
from fiveaxis.mesh.surface import facet_normals as facet_normals
from fiveaxis.options import Unit as Unit
