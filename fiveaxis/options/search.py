"""What is minimised, and how hard the optimiser searches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from fiveaxis.options.option import Group, Option

Objective = Literal["energy", "travel", "time"]


@dataclass(frozen=True, kw_only=True)
class Search(Group):
    """What is minimised, and how it is searched."""

    objective: Annotated[
        Objective,
        Option("what to minimise: energy or time of the program, or the travel metric", rank=11),
    ] = "energy"
    up_penalty: Annotated[
        float,
        Option(
            "extra price of what linear axes lift against gravity, tool or table",
            unit="J/mm",
            least=0.0,
        ),
    ] = 0.0
    smoothing: Annotated[
        float,
        Option(
            "price of squared turns of the rotary axes, for steadier postures",
            unit="J/rad2",
            least=0.0,
        ),
    ] = 0.0
    steady: Annotated[
        float,
        Option(
            "share of the energy that may be spent on fewer starts and reversals of axes; 0 for none",
            least=0.0,
            most=1.0,
        ),
    ] = 0.005
    time_price: Annotated[
        float | None,
        Option(
            "price of time lost to slow axes, not with objective time; by default the base power",
            unit="W",
            least=0.0,
            example=0,
        ),
    ] = None
    effort: Annotated[
        Literal["quick", "normal", "thorough"],
        Option("how thorough the search for the best postures is", rank=12),
    ] = "normal"
    solver: Annotated[
        Literal["structured", "ipopt"],
        Option("solver that refines the postures; ipopt as a second opinion"),
    ] = "structured"
    bound: Annotated[
        bool | None,
        Option(
            "compute a lower bound of what any posture costs, about a minute; by default only with effort "
            "thorough",
            flags="--bound/--no-bound",
            example=True,
        ),
    ] = None
