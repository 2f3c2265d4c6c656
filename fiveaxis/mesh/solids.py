"""Meshes of bodies that can be met: read as they are, and refused where inside and outside are mixed up."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.errors import MeshError
from fiveaxis.mesh.loading import load_mesh

if TYPE_CHECKING:
    import trimesh

# A mesh of more triangles is refused: the trees of such a one take more memory than many computers have.
MOST_TRIANGLES = 5_000_000


def read_solid(file: str | Path) -> trimesh.Trimesh:
    """Read a mesh as it is: normals aren't turned, holes are allowed.

    Raises
    ------
    MeshError
        A file that can't be read, or a mesh that is refused (`require_solid`).
    """
    mesh = load_mesh(file, allow_open=True, turn=False)
    require_solid(mesh, str(file))
    return mesh


def require_solid(mesh: trimesh.Trimesh, name: str) -> None:
    """Refuse a mesh that can't tell inside from outside, though it is closed, and one that is too large.

    Parameters
    ----------
    mesh : mm
    name : what to call it in messages

    Raises
    ------
    MeshError
        No triangles, vertices that aren't finite, more than `MOST_TRIANGLES` triangles, normals that point
        into the material, or neighbouring triangles that face opposite sides.
    """
    if len(mesh.faces) == 0:
        raise MeshError("has no triangles", file=name)
    if not np.isfinite(mesh.vertices).all():
        raise MeshError("has vertices with coordinates that aren't finite numbers", file=name)
    if len(mesh.faces) > MOST_TRIANGLES:
        raise MeshError(
            f"has {len(mesh.faces):,} triangles, more than {MOST_TRIANGLES:,}; collisions need a coarser "
            "one: export it with a larger chord tolerance",
            file=name,
        )
    if not mesh.is_watertight:
        return
    mend = "turn them outwards where the mesh was made (Flip or Harmonise normals; in trimesh fix_normals)"
    if not mesh.is_winding_consistent:
        raise MeshError(f"neighbouring triangles face opposite sides; {mend}", file=name)
    if mesh.volume < 0.0:
        raise MeshError(
            f"its normals point into the material: its volume is {mesh.volume:.6g} mm3; {mend}", file=name
        )
