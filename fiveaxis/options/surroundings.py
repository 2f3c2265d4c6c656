"""What stands around a cut, and how near the tool may come to it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from fiveaxis.options.option import Group, Option

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

    part: Annotated[
        MeshSource | None,
        Option(
            "mesh of the finished part: for missing surface normals, the gouge check and the preview",
            example="part.stl",
            rank=8,
        ),
    ] = None
    stock: Annotated[
        MeshSource | None,
        Option(
            "the stock, for collisions and, with a closed part, to be cut by the program: a mesh, an .npz "
            "file of an earlier program's result, box:X:Y:Z or cylinder:DIAMETER:HEIGHT about the part, or "
            "part+ALLOWANCE (mm)",
            example="stock.stl",
            rank=9,
        ),
    ] = None
    stock_resolution: Annotated[
        float | None,
        Option(
            "distance of the rays by which the stock is cut; by default a 600th of the part's longest side",
            unit="mm",
            above=0.0,
            example=0.1,
        ),
    ] = None
    stock_tolerance: Annotated[
        float,
        Option(
            "distance of the cut stock from the part that counts as finished: in the check of what is left, "
            "and in the maps of report and preview",
            unit="mm",
            above=0.0,
        ),
    ] = STOCK_TOLERANCE
    above_table: Annotated[
        float | None,
        Option(
            "height of the lowest point of part, stock and fixtures over the table's face (packers, vice, "
            "riser), where the machine's file has no [[bodies]] under the part",
            unit="mm",
            least=0.0,
            example=60,
        ),
    ] = None
    part_unit: Annotated[
        Unit | None,
        Option(
            "unit of the files of part and stock; by default that of an input mesh, else mm", example="mm"
        ),
    ] = None
    surface_tolerance: Annotated[
        float,
        Option(
            "gap between cutter and part that counts as touching",
            unit="mm",
            above=0.0,
        ),
    ] = SURFACE_TOLERANCE
    gouge_tolerance: Annotated[
        float,
        Option(
            "how deep the cutter may reach into the part at a location; 0.01 deeper in between",
            unit="mm",
            above=0.0,
        ),
    ] = GOUGE_TOLERANCE


@dataclass(frozen=True, kw_only=True)
class Surrounding(Workpiece):
    """Part and stock, and how near the tool comes to what stands around it."""

    keep_clear: Annotated[
        bool,
        Option(
            "choose postures clear of collisions, or only report collisions",
            flags="--keep-clear/--only-verify",
        ),
    ] = True
