"""Meshes of parts and bodies: files, distances, smooth normals, exact surfaces of CAD files."""

from fiveaxis.mesh.cad.loading import CAD_SUFFIXES
from fiveaxis.mesh.cad.model import Model, model_of
from fiveaxis.mesh.cad.records import Face, Foot
from fiveaxis.mesh.distance import TriangleTree, kept_by_mesh, tree_of
from fiveaxis.mesh.loading import (
    SUFFIXES,
    body_findings,
    check_mesh,
    load_mesh,
    mesh_size,
    other_sizes,
    read_solid,
    require_solid,
    size_findings,
    size_text,
    take_mesh,
)
from fiveaxis.mesh.surface import Surface, facet_normals
from fiveaxis.options import Unit

__all__ = [
    "CAD_SUFFIXES",
    "SUFFIXES",
    "Face",
    "Foot",
    "Model",
    "Surface",
    "TriangleTree",
    "Unit",
    "body_findings",
    "check_mesh",
    "facet_normals",
    "kept_by_mesh",
    "load_mesh",
    "mesh_size",
    "model_of",
    "other_sizes",
    "read_solid",
    "require_solid",
    "size_findings",
    "size_text",
    "take_mesh",
    "tree_of",
]
