"""How meshes are taken."""

from __future__ import annotations

from typing import Annotated, TypedDict

from fiveaxis.options.option import Option

# deg; mm
CREASE, MESH_TOLERANCE = 30.0, 0.01


class CadFile(TypedDict, total=False):
    """How a CAD file is taken."""

    mesh_tolerance: Annotated[
        float,
        Option(
            "how far the mesh of a CAD file may be off its surfaces; contacts and normals stay exact",
            unit="mm",
            default=MESH_TOLERANCE,
            least=0.001,
        ),
    ]
    body: Annotated[
        str | None,
        Option("name or number of the body of a CAD file that is the part; by default all", example="blade"),
    ]


class Meshes(CadFile, total=False):
    """How meshes are taken."""

    crease: Annotated[
        float,
        Option(
            "facets of a mesh that meet at a smaller angle are one smooth surface",
            unit="deg",
            default=CREASE,
            above=0.0,
            most=90.0,
        ),
    ]
