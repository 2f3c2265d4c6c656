"""Options that several commands share."""

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
    str | None, typer.Option("--tool", help="ball:10, bull:16:4 or a .toml file; default: the input's tool")
]
Tilt = Annotated[str | None, typer.Option("--tilt", help="angle to the surface normal, MIN:MAX in deg")]
Cone = Annotated[float | None, typer.Option("--cone", help="largest angle to the programmed tool axis, deg")]
Lead = Annotated[
    str | None, typer.Option("--lead", help="tip the tool forwards along the feed, MIN:MAX in deg")
]
Lean = Annotated[
    str | None, typer.Option("--lean", help="tip the tool to the left of the feed, MIN:MAX in deg")
]
ToolPlane = Annotated[
    str | None, typer.Option("--plane", help="X,Y,Z: normal of a plane that the tool axis stays in")
]
Hold = Annotated[
    str | None, typer.Option("--hold", help="hold rotary axes at an angle: C30 (4-axis), A-20,C30 (3+2)")
]
TurnRate = Annotated[
    float | None, typer.Option("--turn-rate", help="largest rotary turn along a cut, deg/mm")
]
Smoothing = Annotated[
    float | None, typer.Option("--smoothing", help="price of squared rotary turns, J/rad2; steadier postures")
]
TimePrice = Annotated[
    float | None, typer.Option("--time-price", help="W, for time lost to slow axes; default: base power")
]
SingularCone = Annotated[
    float | None,
    typer.Option("--singular-cone", help="hold the first rotary axis within this angle of it, deg"),
]
SingularRate = Annotated[
    float | None, typer.Option("--singular-rate", help="largest turn of that axis in the cone, deg/mm")
]
Solver = Annotated[str | None, typer.Option("--solver", help="structured, or ipopt as a second opinion")]
Effort = Annotated[str | None, typer.Option("--effort", help="quick, normal or thorough search")]
FreeStart = Annotated[
    bool | None, typer.Option("--free-start", help="let closed passes begin elsewhere, with new links")
]
FreeDirection = Annotated[
    bool | None, typer.Option("--free-direction", help="with --free-start: let passes run backwards too")
]
Winding = Annotated[
    str | None,
    typer.Option("--winding", help="how NC counts turns of endless axes: unwound, modulo or rezero"),
]
Thin = Annotated[
    bool | None,
    typer.Option("--thin/--keep-blocks", help="remove redundant NC blocks, or keep all"),
]
Override = Annotated[
    list[str] | None,
    typer.Option("--override", help="CODE of an error to accept: NC is written despite it; repeatable"),
]
FrontSize = Annotated[
    int | None, typer.Option("--front", help="find N solutions, from the cheapest path to the steadiest")
]
FrontPick = Annotated[
    int | None,
    typer.Option("--pick", help="with --front: number of the solution to deliver; 1 is the cheapest"),
]
Feed = Annotated[float | None, typer.Option("--feed", help="mm/min, replaces the input's feed")]
Unit = Annotated[str | None, typer.Option("--unit", help="mm or inch, for an input that doesn't state it")]
Part = Annotated[
    Path | None, typer.Option("--part", help="mesh of the part: surface normals, gouge check, preview")
]
Stock = Annotated[Path | None, typer.Option("--stock", help="mesh of the stock, for collisions")]
Fixtures = Annotated[
    Path | None, typer.Option("--fixtures", help=escape("TOML with [[fixture]] and [clearance], as in a job"))
]
KeepClear = Annotated[
    bool | None,
    typer.Option(
        "--keep-clear/--only-verify", help="choose postures clear of collisions, or only report collisions"
    ),
]
SurfaceTolerance = Annotated[
    float | None,
    typer.Option("--surface-tolerance", help="gap between cutter and part that counts as touching, mm"),
]
GougeTolerance = Annotated[
    float | None,
    typer.Option("--gouge-tolerance", help="how deep the cutter may reach into the part, mm; default: 0.01"),
]
WrittenFor = Annotated[
    str | None, typer.Option("--written-for", help="machine of an input program, if it isn't --machine")
]
Positions = Annotated[
    str | None,
    typer.Option("--positions", help="table (tip positions of a program turn with it) or machine"),
]
ProgramZero = Annotated[
    str | None,
    typer.Option("--program-zero", help="zero (G54) in machine coordinates: X100,Y50,Z-20"),
]
Start = Annotated[
    str | None, typer.Option("--start", help="axis positions before the program: X18,Y74,Z0 in mm and deg")
]
Rapid = Annotated[
    float | None, typer.Option("--rapid", help="rapid speed of axes whose speed isn't known, mm/min")
]
BlockDelete = Annotated[bool | None, typer.Option("--block-delete", help="skip blocks that begin with /")]
Wrap = Annotated[
    Literal["unwound", "shorter", "signed"] | None,
    typer.Option("--wrap", help="how rotary words of a program count turns; default: as its header says"),
]
Columns = Annotated[
    str | None,
    typer.Option("--columns", help="columns of points without header: x,y,z,nx,ny,nz or x,y,z,i,j,k"),
]
Drives = Annotated[str | None, typer.Option("--drives", help="use the axis powers of this machine")]
MaxTurn = Annotated[
    float | None,
    typer.Option("--max-turn", help="largest rotary turn in a cutting move, deg; default: 180 deg/s"),
]
Objective = Annotated[
    str | None,
    typer.Option("--objective", help="what to minimise: energy or time of the program, or travel (metric)"),
]
UpPenalty = Annotated[float | None, typer.Option("--up-penalty", help="extra cost of moving up, J/mm")]
ToolLength = Annotated[
    float | None, typer.Option("--tool-length", help="from the spindle's gauge point to the tool tip, mm")
]
WorkOffset = Annotated[
    str | None, typer.Option("--work-offset", help="workpiece zero in the machine frame: X,Y,Z in mm")
]
PartRotation = Annotated[
    str | None,
    typer.Option("--part-rotation", help="rotation of the part on the table: about machine X,Y,Z in deg"),
]
SetupSearch = Annotated[
    str | None,
    typer.Option("--setup", help="choose the setup too: x=-50:50,angle=0:90, or x,angle with a job's ranges"),
]
Control = Annotated[str | None, typer.Option("--control", help="NC dialect (`fiveaxis controls`)")]
Strategy = Annotated[str | None, typer.Option("--strategy", help="waterline or raster passes")]
Stepdown = Annotated[float | None, typer.Option("--stepdown", help="distance of waterlines in Z, mm")]
Stepover = Annotated[
    float | None, typer.Option("--stepover", help="distance of the sections of a raster, mm")
]
Scallop = Annotated[float | None, typer.Option("--scallop", help="highest ridge between passes, mm")]
RasterAngle = Annotated[
    float | None, typer.Option("--raster-angle", help="direction of a raster, from X towards Y, deg")
]
Spiral = Annotated[
    bool | None,
    typer.Option("--spiral/--rings", help="join closed waterlines into spirals, or not (default)"),
]
Order = Annotated[
    str | None, typer.Option("--order", help="levels (level by level) or islands (shorter links)")
]
LeadIn = Annotated[
    float | None, typer.Option("--lead-in", help="radius of the arc at the start of a pass, mm")
]
LeadOut = Annotated[
    float | None, typer.Option("--lead-out", help="radius of the arc at the end of a pass, mm")
]
MinLength = Annotated[float | None, typer.Option("--min-length", help="shortest pass that is cut, mm")]
Spacing = Annotated[float | None, typer.Option("--spacing", help="largest distance of contact points, mm")]
Overhang = Annotated[
    bool | None, typer.Option("--overhang/--all-walls", help="plan overhanging walls only, or all (default)")
]
Direction = Annotated[
    str | None, typer.Option("--direction", help="cutting direction: climb, conventional or zigzag")
]
AllowOpen = Annotated[bool | None, typer.Option("--allow-open", help="accept a mesh that isn't watertight")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")]

# Options of several commands, by the name of the setting; None where they aren't given.
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
    """Add groups of options to a command, after its arguments and before its own options.

    Typer reads a command's options from its signature; the command finds those of the groups in its context.

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
