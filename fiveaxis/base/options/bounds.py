"""Bounds on postures and turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fiveaxis.base.options.group import Group, option

# deg: cone of a path with tool axes whose lean nothing bounds.
USUAL_CONE = 15.0


@dataclass(frozen=True, kw_only=True)
class LeanBounds(Group):
    """Bounds on the tool's lean against the surface."""

    tilt: tuple[float, float] | None = option(
        None, "smallest and largest angle to the surface normal", unit="deg", written="MIN:MAX", rank=6
    )
    lead: tuple[float, float] | None = option(
        None,
        "smallest and largest angle by which the tool tips forwards along the feed",
        unit="deg",
        written="MIN:MAX",
        example=(0, 10),
    )
    lean: tuple[float, float] | None = option(
        None,
        "smallest and largest angle by which the tool tips to the left of the feed",
        unit="deg",
        written="MIN:MAX",
        example=(-5, 5),
    )


@dataclass(frozen=True, kw_only=True)
class ProgramBounds(LeanBounds):
    """Bounds on postures and turns, as far as they can be checked in a program of any source."""

    cone: float | None = option(
        None,
        "largest angle to the programmed tool axis; 15 by default where a path to optimise has axes and "
        "nothing bounds its lean",
        unit="deg",
        above=0.0,
        most=180.0,
        example=20,
        rank=7,
    )
    plane: tuple[float, float, float] | None = option(
        None, "vector normal to a plane that the tool axis stays in", written="X,Y,Z", example=(0, 1, 0)
    )
    hold: Mapping[str, float] | None = option(
        None,
        "rotary axes held at an angle, by letter",
        unit="deg",
        written="C30 (4-axis) or A-20,C30 (3+2)",
        example={"C": 30},
    )
    max_turn: float | None = option(
        None, "largest rotary turn in a cutting move; 180 deg/s by default", unit="deg", above=0.0, example=15
    )
    singular_cone: float | None = option(
        None,
        "half angle of a cone about the first rotary axis; with the tool inside, that axis is held",
        unit="deg",
        above=0.0,
        below=90.0,
        example=5,
    )
    singular_rate: float = option(0.0, "largest turn of that axis in the cone", unit="deg/mm", least=0.0)


@dataclass(frozen=True, kw_only=True)
class Bounds(ProgramBounds):
    """Bounds on postures and turns."""

    turn_rate: float | None = option(
        None, "largest rotary turn along a cut", unit="deg/mm", above=0.0, example=5
    )
    least_cutting_speed: float | None = option(
        None,
        "lowest speed of the cutting edge at the contact, so that the tool leans away from its tip",
        unit="m/min",
        above=0.0,
        example=60,
    )
    spindle_speed: float | None = option(
        None,
        "speed of the spindle that least_cutting_speed is of; by default that of [nc] or [process]",
        unit="rev/min",
        above=0.0,
        most=200000.0,
        example=8000,
    )
