"""How passes are planned on a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fiveaxis.base.options.bounds import LeanBounds
from fiveaxis.base.options.group import Group, option
from fiveaxis.base.options.meshes import Meshes

Strategy = Literal["waterline", "raster", "flow"]
FlowAlong = Literal["u", "v"]
Direction = Literal["climb", "conventional", "zigzag"]
Order = Literal["levels", "islands"]
# mm/min: beyond the fastest machines, so that a number above it has another unit, or digits too many.
HIGHEST_FEED = 200_000.0


@dataclass(frozen=True, kw_only=True)
class Planning(Group):
    """How passes are planned on a mesh."""

    strategy: Strategy = option(
        "waterline",
        "horizontal sections, vertical parallel ones, or lines along the faces of a CAD file",
        rank=14,
    )
    stepdown: float | None = option(
        None,
        "distance of waterlines in z; 1 unless a scallop is given",
        unit="mm",
        above=0.0,
        example=1,
        rank=15,
    )
    stepover: float | None = option(
        None,
        "distance of the sections of a raster, or of flow's passes on the surface; 1 unless a scallop is "
        "given",
        unit="mm",
        above=0.0,
        example=1,
        rank=16,
    )
    scallop: float | None = option(
        None,
        "highest ridge between passes; it sets their distance by slope and curvature of the walls and, "
        "unless the cutter is a ball, by the leans that tilt, lead and lean allow",
        unit="mm",
        above=0.0,
        example=0.01,
        rank=17,
    )
    raster_angle: float | None = option(
        None, "direction of a raster, from X towards Y; by default 0", unit="deg", example=0
    )
    flow_along: FlowAlong | None = option(
        None,
        "parameter of the faces along which flow's passes run; by default the one with the longer "
        "passes, or with the straighter ones where neither are longer by a quarter",
        example="u",
    )
    faces: str | None = option(
        None,
        "faces of a CAD file that are cut: numbers as fiveaxis info shows them, #rrggbb or a layer; the "
        "others are only kept clear of",
        written="12,13",
        example="12,13",
    )
    spacing: float = option(
        0.5, "largest distance of contact points along a pass", unit="mm", above=0.0, rank=18
    )
    overhang: bool = option(False, "plan overhanging walls only", flags="--overhang/--all-walls")
    spiral: bool = option(
        False, "join closed passes of waterlines or flow into spirals", flags="--spiral/--rings", rank=19
    )
    direction: Direction = option(
        "climb",
        "cutting direction along the passes, for a spindle that turns clockwise; with zigzag open passes "
        "are cut in the direction with the shorter link",
        rank=20,
    )
    order: Order = option("levels", "level by level, or island by island, with short links")
    lead_in: float = option(0.0, "radius of the arc at the start of a pass", unit="mm", least=0.0)
    lead_out: float = option(0.0, "radius of the arc at the end of a pass", unit="mm", least=0.0)
    allow_open: bool = option(False, "plan on a mesh that isn't watertight", flags="--allow-open")


@dataclass(frozen=True, kw_only=True)
class PlanContour(Planning, Meshes, LeanBounds):
    """How passes are planned on a mesh, and cut; the bounds are those that the postures will keep."""

    feed_mm_min: float = option(1000.0, "of cuts and links", unit="mm/min", above=0.0, most=HIGHEST_FEED)
    clearance: float = option(
        5.0,
        "between the part's top and the cutter while it crosses over; where there is room, it also "
        "lifts off the surface by this, but at most by its diameter",
        unit="mm",
        above=0.0,
    )
