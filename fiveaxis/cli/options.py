"""Options that several verbs share."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_type_hints

import typer
from rich.markup import escape

Verb = TypeVar("Verb", bound=Callable[..., None])

Input = Annotated[
    Path, typer.Argument(help="mesh (.stl .obj .ply .off), points, APT/CLSF, NC program, or a job .toml")
]
MachineName = Annotated[
    str | None, typer.Option("--machine", "-m", help="name (`fiveaxis machines`), .toml or .ini file")
]
ToolName = Annotated[
    str | None, typer.Option("--tool", help="ball:10, bull:16:4, a .toml file; else what the input says")
]
Tilt = Annotated[str | None, typer.Option("--tilt", help="angle to the surface normal, MIN:MAX, deg")]
Cone = Annotated[float | None, typer.Option("--cone", help="angle to the programmed tool axis, deg")]
Lead = Annotated[
    str | None, typer.Option("--lead", help="tipped forwards into the feed, MIN:MAX, deg; beside --tilt")
]
Lean = Annotated[str | None, typer.Option("--lean", help="tipped to the left of the feed, MIN:MAX, deg")]
ToolPlane = Annotated[
    str | None, typer.Option("--plane", help="X,Y,Z at right angles to a plane that holds the tool axis")
]
Hold = Annotated[
    str | None, typer.Option("--hold", help="rotary axes that stay: C30 (4-axis), A-20,C30 (3+2)")
]
TurnRate = Annotated[float | None, typer.Option("--turn-rate", help="largest turn along a cut, deg/mm")]
Smoothing = Annotated[float | None, typer.Option("--smoothing", help="price of bends, J/rad2")]
TimePrice = Annotated[
    float | None, typer.Option("--time-price", help="W, of time lost to slow axes; else the base power")
]
SingularCone = Annotated[
    float | None, typer.Option("--singular-cone", help="in which the first rotary axis is held, deg")
]
SingularRate = Annotated[
    float | None, typer.Option("--singular-rate", help="largest turn of it in there, deg/mm")
]
Solver = Annotated[str | None, typer.Option("--solver", help="structured, or ipopt as a second opinion")]
Effort = Annotated[str | None, typer.Option("--effort", help="quick, normal or thorough")]
FreeStart = Annotated[
    bool | None, typer.Option("--free-start", help="closed passes may begin elsewhere, with links of a plan")
]
FreeDirection = Annotated[
    bool | None, typer.Option("--free-direction", help="with --free-start: they may run backwards, too")
]
Winding = Annotated[
    str | None, typer.Option("--winding", help="unwound, modulo or rezero: how NC counts endless axes")
]
Thin = Annotated[
    bool | None, typer.Option("--thin/--keep-blocks", help="leave blocks out that NC doesn't need; else none")
]
Override = Annotated[
    list[str] | None,
    typer.Option("--override", help="CODE of errors with which NC is written all the same; repeatable"),
]
FrontSize = Annotated[
    int | None, typer.Option("--front", help="N solutions between the cheapest path and the steadiest")
]
FrontPick = Annotated[
    int | None,
    typer.Option("--pick", help="with --front: the solution that is the result; 1 is the cheapest"),
]
Feed = Annotated[float | None, typer.Option("--feed", help="mm/min, in place of the input's")]
Unit = Annotated[str | None, typer.Option("--unit", help="mm or inch, for an input that doesn't say")]
Part = Annotated[
    Path | None, typer.Option("--part", help="mesh: missing normals, gouge check and preview come from it")
]
Stock = Annotated[Path | None, typer.Option("--stock", help="mesh of what the part is cut from")]
Fixtures = Annotated[
    Path | None, typer.Option("--fixtures", help=escape("TOML with [[fixture]] and [clearance], as in a job"))
]
KeepClear = Annotated[
    bool | None,
    typer.Option("--keep-clear/--only-verify", help="choose postures clear of collisions; else only verify"),
]
SurfaceTolerance = Annotated[
    float | None, typer.Option("--surface-tolerance", help="gap to the part that counts as touching, mm")
]
GougeTolerance = Annotated[
    float | None,
    typer.Option("--gouge-tolerance", help="how deep the cutter may reach into the part, mm; else 0.01"),
]
WrittenFor = Annotated[
    str | None, typer.Option("--written-for", help="machine of an NC program, if it isn't --machine")
]
Positions = Annotated[
    str | None, typer.Option("--positions", help="table or machine: where tip positions of a program stay")
]
ProgramZero = Annotated[
    str | None, typer.Option("--program-zero", help="G54 in machine coordinates: X100,Y50,Z-20")
]
Start = Annotated[
    str | None, typer.Option("--start", help="where axes stand before: X18,Y74,Z0 in mm and deg")
]
Rapid = Annotated[float | None, typer.Option("--rapid", help="mm/min, of axes without a speed")]
BlockDelete = Annotated[bool | None, typer.Option("--block-delete", help="skip blocks that begin with /")]
Wrap = Annotated[
    Literal["unwound", "shorter", "signed"] | None,
    typer.Option("--wrap", help="how rotary words of a program count turns; else as its header says"),
]
Columns = Annotated[
    str | None, typer.Option("--columns", help="of points without header: x,y,z,nx,ny,nz or x,y,z,i,j,k")
]
Drives = Annotated[str | None, typer.Option("--drives", help="take the axis powers of this machine")]
MaxTurn = Annotated[
    float | None,
    typer.Option("--max-turn", help="largest turn in a cutting move, deg; by default 180 deg/s at the feed"),
]
Objective = Annotated[
    str | None,
    typer.Option("--objective", help="what is least: energy or time of the program, or travel (metric)"),
]
UpPenalty = Annotated[float | None, typer.Option("--up-penalty", help="extra price of moving up, J/mm")]
ToolLength = Annotated[
    float | None, typer.Option("--tool-length", help="spindle's gauge point to tool tip, mm")
]
WorkOffset = Annotated[
    str | None, typer.Option("--work-offset", help="workpiece zero in the machine frame, X,Y,Z in mm")
]
PartRotation = Annotated[
    str | None, typer.Option("--part-rotation", help="part on the table, about machine X,Y,Z in deg")
]
SetupSearch = Annotated[
    str | None,
    typer.Option("--setup", help="choose the part's place: x=-50:50,angle=0:90, or names in a job"),
]
Control = Annotated[str | None, typer.Option("--control", help="NC dialect")]
Strategy = Annotated[str | None, typer.Option("--strategy", help="waterline or raster")]
Stepdown = Annotated[float | None, typer.Option("--stepdown", help="distance of waterlines in z, mm")]
Stepover = Annotated[float | None, typer.Option("--stepover", help="distance of a raster's sections, mm")]
Scallop = Annotated[float | None, typer.Option("--scallop", help="highest ridge between passes, mm")]
RasterAngle = Annotated[
    float | None, typer.Option("--raster-angle", help="direction of a raster, from x towards y, deg")
]
Spiral = Annotated[bool | None, typer.Option("--spiral/--rings", help="join closed waterlines to spirals")]
Order = Annotated[
    str | None, typer.Option("--order", help="levels (one by one) or islands (where links are short)")
]
LeadIn = Annotated[float | None, typer.Option("--lead-in", help="radius of arcs that lead to passes, mm")]
LeadOut = Annotated[float | None, typer.Option("--lead-out", help="radius of arcs that lead away, mm")]
MinLength = Annotated[float | None, typer.Option("--min-length", help="shortest pass that is cut, mm")]
Spacing = Annotated[float | None, typer.Option("--spacing", help="distance of contact points, mm")]
Overhang = Annotated[bool | None, typer.Option("--overhang/--all-walls", help="which walls to plan")]
Direction = Annotated[str | None, typer.Option("--direction", help="climb, conventional or zigzag")]
AllowOpen = Annotated[bool | None, typer.Option("--allow-open", help="accept an open mesh")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")]

# What several verbs take, by the name of the setting; each is None where nobody says it.
PLANNING: Mapping[str, Any] = {
    "tool": ToolName,
    "feed": Feed,
    "strategy": Strategy,
    "stepdown": Stepdown,
    "stepover": Stepover,
    "scallop": Scallop,
    "raster_angle": RasterAngle,
    "spacing": Spacing,
    "overhang": Overhang,
    "spiral": Spiral,
    "direction": Direction,
    "order": Order,
    "lead_in": LeadIn,
    "lead_out": LeadOut,
    "min_length": MinLength,
    "allow_open": AllowOpen,
}
READING: Mapping[str, Any] = {
    "unit": Unit,
    "columns": Columns,
    "written_for": WrittenFor,
    "positions": Positions,
    "program_zero": ProgramZero,
    "start": Start,
    "rapid": Rapid,
    "block_delete": BlockDelete,
    "wrap": Wrap,
}
POSTURE: Mapping[str, Any] = {
    "machine": MachineName,
    "tilt": Tilt,
    "cone": Cone,
    "lead": Lead,
    "lean": Lean,
    "plane": ToolPlane,
    "hold": Hold,
    "part": Part,
    "stock": Stock,
    "fixtures": Fixtures,
    "keep_clear": KeepClear,
    "surface_tolerance": SurfaceTolerance,
    "gouge_tolerance": GougeTolerance,
    "drives": Drives,
    "objective": Objective,
    "up_penalty": UpPenalty,
    "max_turn": MaxTurn,
    "turn_rate": TurnRate,
    "smoothing": Smoothing,
    "time_price": TimePrice,
    "singular_cone": SingularCone,
    "singular_rate": SingularRate,
    "effort": Effort,
    "solver": Solver,
    "front": FrontSize,
    "pick": FrontPick,
    "free_start": FreeStart,
    "free_direction": FreeDirection,
    "tool_length": ToolLength,
    "work_offset": WorkOffset,
    "part_rotation": PartRotation,
    "setup_search": SetupSearch,
}


def takes(*groups: Mapping[str, Any]) -> Callable[[Verb], Verb]:
    """Give a verb the options of some groups, behind its arguments and before its own options.

    Typer reads a verb's options from its signature; the verb finds those of the groups in its context.

    Parameters
    ----------
    groups : annotated types by name
    """
    options = {name: kind for group in groups for name, kind in group.items()}

    def extend(verb: Verb) -> Verb:
        signature = inspect.signature(verb)
        kinds = get_type_hints(verb, include_extras=True)
        every = [p.replace(annotation=kinds[p.name]) for p in signature.parameters.values()]
        own = [p for p in every if p.kind is not p.VAR_KEYWORD]
        first = [p for p in own if p.default is p.empty]
        shared = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
            for name, kind in options.items()
        ]
        last = [p.replace(kind=p.KEYWORD_ONLY) for p in own if p.default is not p.empty]
        verb.__signature__ = signature.replace(parameters=[*first, *shared, *last])  # type: ignore[attr-defined]
        verb.__annotations__ |= options
        return verb

    return extend
