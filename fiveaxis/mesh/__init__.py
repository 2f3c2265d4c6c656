"""Meshes of parts and bodies: files, distances, smooth normals."""

from fiveaxis.mesh.distance import TriangleTree, kept_by_mesh, tree_of
from fiveaxis.mesh.loading import (
    SUFFIXES,
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
    "SUFFIXES",
    "Surface",
    "TriangleTree",
    "Unit",
    "check_mesh",
    "facet_normals",
    "kept_by_mesh",
    "load_mesh",
    "mesh_size",
    "other_sizes",
    "read_solid",
    "require_solid",
    "size_findings",
    "size_text",
    "take_mesh",
    "tree_of",
]
