"""Options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Input = Annotated[Path, typer.Argument(help="mesh (.stl .obj .ply .off), CSV, APT/CLSF, or a job .toml")]
MachineName = Annotated[
    str | None, typer.Option("--machine", "-m", help="name (`fiveaxis machines`), .toml or .ini file")
]
ToolName = Annotated[str | None, typer.Option("--tool", help="ball:10 is a ball end mill of 10 mm diameter")]
Tilt = Annotated[str | None, typer.Option("--tilt", help="angle to the surface normal, MIN:MAX, deg")]
Cone = Annotated[float | None, typer.Option("--cone", help="angle to the programmed tool axis, deg")]
Feed = Annotated[float | None, typer.Option("--feed", help="mm/min, in place of the input's")]
Unit = Annotated[str | None, typer.Option("--unit", help="mm or inch, for an input that doesn't say")]
Part = Annotated[Path | None, typer.Option("--part", help="mesh for the gouge check and the preview")]
Drives = Annotated[str | None, typer.Option("--drives", help="take the axis powers of this machine")]
MaxTurn = Annotated[float | None, typer.Option("--max-turn", help="largest turn in a cutting move, deg")]
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
Control = Annotated[str | None, typer.Option("--control", help="NC dialect")]
Stepdown = Annotated[float | None, typer.Option("--stepdown", help="distance of passes in z, mm")]
Spacing = Annotated[float | None, typer.Option("--spacing", help="distance of contact points, mm")]
Overhang = Annotated[bool | None, typer.Option("--overhang/--all-walls", help="which walls to plan")]
Direction = Annotated[str | None, typer.Option("--direction", help="climb or conventional")]
AllowOpen = Annotated[bool | None, typer.Option("--allow-open", help="accept an open mesh")]
AsJson = Annotated[bool, typer.Option("--json", help="print one JSON document and nothing else")]
