"""What stands around a cut, and how near the tool may come to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from fiveaxis.base.options.group import Group, option

if TYPE_CHECKING:
    import trimesh

    MeshSource: TypeAlias = str | Path | trimesh.Trimesh
else:
    # Jobs and flags name files; only functions take meshes, too.
    MeshSource = Path

# Units of mesh files; none of the formats states its own.
Unit = Literal["mm", "inch", "m"]
# mm: gap between cutter and part that counts as touching; allowed depth of the cutter in the part; distance
# from the part within which a cut stock is finished.
SURFACE_TOLERANCE, GOUGE_TOLERANCE, STOCK_TOLERANCE = 0.05, 0.01, 0.05


@dataclass(frozen=True, kw_only=True)
class Workpiece(Group):
    """Part and stock, and how near the cutter comes to the part."""

    part: MeshSource | None = option(
        None,
        "mesh of the finished part: for missing surface normals, the gouge check and the preview",
        example="part.stl",
        rank=8,
    )
    stock: MeshSource | None = option(
        None,
        "the stock, for collisions and, with a closed part, to be cut by the program: a mesh, an .npz "
        "file of an earlier program's result, box:X:Y:Z or cylinder:DIAMETER:HEIGHT about the part, or "
        "part+ALLOWANCE (mm)",
        example="stock.stl",
        rank=9,
    )
    stock_resolution: float | None = option(
        None,
        "distance of the rays by which the stock is cut; by default a 600th of the part's longest side",
        unit="mm",
        above=0.0,
        example=0.1,
    )
    stock_tolerance: float = option(
        STOCK_TOLERANCE,
        "distance of the cut stock from the part that counts as finished: in the check of what is left, "
        "and in the maps of report and preview",
        unit="mm",
        above=0.0,
    )
    above_table: float | None = option(
        None,
        "height of the lowest point of part, stock and fixtures over the table's face (packers, vice, "
        "riser), where the machine's file has no [[bodies]] under the part",
        unit="mm",
        least=0.0,
        example=60,
    )
    part_unit: Unit | None = option(
        None, "unit of the files of part and stock; by default that of an input mesh, else mm", example="mm"
    )
    surface_tolerance: float = option(
        SURFACE_TOLERANCE, "gap between cutter and part that counts as touching", unit="mm", above=0.0
    )
    gouge_tolerance: float = option(
        GOUGE_TOLERANCE,
        "how deep the cutter may reach into the part at a location; 0.01 deeper in between",
        unit="mm",
        above=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class Surrounding(Workpiece):
    """Part and stock, and how near the tool comes to what stands around it."""

    keep_clear: bool = option(
        True,
        "choose postures clear of collisions, or only report collisions",
        flags="--keep-clear/--only-verify",
    )
