"""The size of a part, and whether its unit can be right."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array
from fiveaxis.options import Unit

if TYPE_CHECKING:
    import trimesh

    from fiveaxis.mesh.surface import Surface

MILLIMETRES: Mapping[Unit, float] = {"mm": 1.0, "inch": 25.4, "m": 1000.0}
# mm: parts of five-axis machines are larger than the first, and smaller than the second.
SMALLEST_PART, LARGEST_PART = 5.0, 5000.0


def mesh_size(mesh: trimesh.Trimesh | Surface) -> Array:
    """Return the extents of a mesh along X, Y and Z, (3,) mm."""
    return np.asarray(np.ptp(mesh.vertices, axis=0), dtype=float)


def size_text(size: Array) -> str:
    """Write extents, (3,) mm: ``50.8 × 50.8 × 25.4 mm``."""
    return " × ".join(f"{extent:.4g}" for extent in size) + " mm"


def size_findings(size: Array, *, unit: Unit, diameter: float, name: str) -> tuple[Finding, ...]:
    """Return the finding on a part whose size is implausible, with its sizes in the other units.

    Parameters
    ----------
    size : (3,), mm, its extents
    unit : in which its coordinates were read
    diameter : mm, of the cutter: a part is hardly ever smaller
    name : of the part's file
    """
    extent = float(size.max())
    least, what = max((SMALLEST_PART, "parts of 5-axis machines"), (diameter, "the cutter's diameter"))
    if least <= extent <= LARGEST_PART:
        return ()
    side = f"below {least:g} mm ({what})" if extent < least else f"above {LARGEST_PART:g} mm"
    others = ", ".join(
        f"{other} makes it {size_text(size * MILLIMETRES[other] / MILLIMETRES[unit])}"
        for other in MILLIMETRES
        if other != unit
    )
    message = (
        f"the part measures {size_text(size)}, read in {unit}, and its longest side is {side}; if its file "
        f"has another unit, say which (unit for an input, part_unit for a part): {others}"
    )
    return (Finding(Severity.WARNING, "part-size", message, Place(file=name), extent),)
