"""How meshes are taken."""

from __future__ import annotations

from typing import Annotated, TypedDict

from fiveaxis.options.option import Option

# deg
CREASE = 30.0


class Meshes(TypedDict, total=False):
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
