"""What stands around the tool: part, stock and fixtures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis.collision import Surroundings
from fiveaxis.mesh import load_mesh
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.solids import is_flat, make_geometry, mesh_geometry, place

if TYPE_CHECKING:
    import trimesh

PART_COLOUR, STOCK_COLOUR, FIXTURE_COLOUR = 0xB8BEC8, 0x8FB89A, 0xA77BCA
# Triangles to which part and stock are thinned.
MOST_TRIANGLES = 150_000
# A clamp's mesh is there for orientation only.
MOST_FIXTURE_TRIANGLES = 20_000


def gather(
    part: str | Path | trimesh.Trimesh | None, surroundings: Surroundings | None
) -> tuple[trimesh.Trimesh | None, Surroundings]:
    """Put together what was given.

    Parameters
    ----------
    part : mesh of the part in mm, or its file; goes before that of the surroundings
    surroundings : what the job kept clear of

    Returns
    -------
    The part, and the surroundings without it.

    Raises
    ------
    MeshError
        The part can't be read.
    """
    around = surroundings or Surroundings()
    shown = around.part if part is None else part
    mesh = load_mesh(shown, allow_open=True) if isinstance(shown, str | Path) else shown
    return mesh, replace(around, part=None)


def add_part(vis: Any, root: str, mesh: trimesh.Trimesh) -> None:
    """Add the finished part, half transparent."""
    _add_mesh(vis, root, "part", mesh, colour=PART_COLOUR, opacity=0.55)


def add_surroundings(vis: Any, root: str, around: Surroundings) -> None:
    """Add stock, hidden at first, and fixtures.

    Raises
    ------
    MeshError
        A fixture's mesh can't be read.
    """
    if around.stock is not None:
        _add_mesh(vis, root, "stock", around.stock, colour=STOCK_COLOUR, opacity=0.25)
        vis[f"{root}/stock"].set_property("visible", False)
    shapes = load_meshcat().geometry
    for i, fixture in enumerate(around.fixtures):
        # By number: a name may hold anything.
        name = f"fixtures/{i}"
        material = shapes.MeshPhongMaterial(color=FIXTURE_COLOUR, flatShading=is_flat(fixture.shape))
        body = shapes.Mesh(make_geometry(fixture.shape, MOST_FIXTURE_TRIANGLES), material)
        vis[f"{root}/{name}"].set_object(identify(body, name))
        vis[f"{root}/{name}"].set_transform(place(fixture.shape))


def _add_mesh(vis: Any, root: str, name: str, mesh: trimesh.Trimesh, **look: Any) -> None:
    shapes = load_meshcat().geometry
    material = shapes.MeshPhongMaterial(flatShading=True, depthWrite=False, **look)
    body = shapes.Mesh(mesh_geometry(mesh.vertices, mesh.faces, MOST_TRIANGLES), material)
    vis[f"{root}/{name}"].set_object(identify(body, name))
