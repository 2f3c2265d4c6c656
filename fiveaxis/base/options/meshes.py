"""How meshes are taken."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.base.options.group import Group, option

# deg; mm
CREASE, MESH_TOLERANCE = 30.0, 0.01


@dataclass(frozen=True, kw_only=True)
class CadFile(Group):
    """How a CAD file is taken."""

    mesh_tolerance: float = option(
        MESH_TOLERANCE,
        "how far the mesh of a CAD file may be off its surfaces; contacts and normals stay exact",
        unit="mm",
        least=0.001,
    )
    body: str | None = option(
        None, "name or number of the body of a CAD file that is the part; by default all", example="blade"
    )


@dataclass(frozen=True, kw_only=True)
class Meshes(CadFile):
    """How meshes are taken."""

    crease: float = option(
        CREASE,
        "facets of a mesh that meet at a smaller angle are one smooth surface",
        unit="deg",
        above=0.0,
        most=90.0,
    )
