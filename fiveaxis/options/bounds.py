"""Bounds on postures and turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from fiveaxis.options.option import Group, Option

# deg: cone of a path with tool axes whose lean nothing bounds.
USUAL_CONE = 15.0

# Two options with other defaults where programs are checked.
SingularCone: TypeAlias = Annotated[
    float | None,
    Option(
        "half angle of a cone about the first rotary axis; with the tool inside, that axis is held",
        unit="deg",
        above=0.0,
        below=90.0,
        example=5,
    ),
]
SingularRate: TypeAlias = Annotated[
    float, Option("largest turn of that axis in the cone", unit="deg/mm", least=0.0)
]


@dataclass(frozen=True, kw_only=True)
class LeanBounds(Group):
    """Bounds on the tool's lean against the surface."""

    tilt: Annotated[
        tuple[float, float] | None,
        Option("smallest and largest angle to the surface normal", unit="deg", written="MIN:MAX", rank=6),
    ] = None
    lead: Annotated[
        tuple[float, float] | None,
        Option(
            "smallest and largest angle by which the tool tips forwards along the feed",
            unit="deg",
            written="MIN:MAX",
            example=(0, 10),
        ),
    ] = None
    lean: Annotated[
        tuple[float, float] | None,
        Option(
            "smallest and largest angle by which the tool tips to the left of the feed",
            unit="deg",
            written="MIN:MAX",
            example=(-5, 5),
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ProgramBounds(LeanBounds):
    """Bounds on postures and turns, as far as they can be checked in a program of any source."""

    cone: Annotated[
        float | None,
        Option(
            "largest angle to the programmed tool axis; 15 by default where a path to optimise has axes and "
            "nothing bounds its lean",
            unit="deg",
            above=0.0,
            most=180.0,
            example=20,
            rank=7,
        ),
    ] = None
    plane: Annotated[
        tuple[float, float, float] | None,
        Option("vector normal to a plane that the tool axis stays in", written="X,Y,Z", example=(0, 1, 0)),
    ] = None
    hold: Annotated[
        Mapping[str, float] | None,
        Option(
            "rotary axes held at an angle, by letter",
            unit="deg",
            written="C30 (4-axis) or A-20,C30 (3+2)",
            example={"C": 30},
        ),
    ] = None
    max_turn: Annotated[
        float | None,
        Option(
            "largest rotary turn in a cutting move; 180 deg/s by default", unit="deg", above=0.0, example=15
        ),
    ] = None
    singular_cone: SingularCone = None
    singular_rate: SingularRate = 0.0


@dataclass(frozen=True, kw_only=True)
class Bounds(ProgramBounds):
    """Bounds on postures and turns."""

    turn_rate: Annotated[
        float | None, Option("largest rotary turn along a cut", unit="deg/mm", above=0.0, example=5)
    ] = None
    least_cutting_speed: Annotated[
        float | None,
        Option(
            "lowest speed of the cutting edge at the contact, so that the tool leans away from its tip",
            unit="m/min",
            above=0.0,
            example=60,
        ),
    ] = None
    spindle_speed: Annotated[
        float | None,
        Option(
            "speed of the spindle that least_cutting_speed is of; by default that of [nc] or [process]",
            unit="rev/min",
            above=0.0,
            most=200000.0,
            example=8000,
        ),
    ] = None
