"""What is minimised, and how hard the optimiser searches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fiveaxis.base.options.group import Group, option

Objective = Literal["energy", "travel", "time"]


@dataclass(frozen=True, kw_only=True)
class Search(Group):
    """What is minimised, and how it is searched."""

    objective: Objective = option(
        "energy", "what to minimise: energy or time of the program, or the travel metric", rank=11
    )
    up_penalty: float = option(
        0.0, "extra price of what linear axes lift against gravity, tool or table", unit="J/mm", least=0.0
    )
    smoothing: float = option(
        0.0, "price of squared turns of the rotary axes, for steadier postures", unit="J/rad2", least=0.0
    )
    steady: float = option(
        0.005,
        "share of the energy that may be spent on fewer starts and reversals of axes; 0 for none",
        least=0.0,
        most=1.0,
    )
    time_price: float | None = option(
        None,
        "price of time lost to slow axes, not with objective time; by default the base power",
        unit="W",
        least=0.0,
        example=0,
    )
    effort: Literal["quick", "normal", "thorough"] = option(
        "normal", "how thorough the search for the best postures is", rank=12
    )
    solver: Literal["structured", "ipopt"] = option(
        "structured", "solver that refines the postures; ipopt as a second opinion"
    )
    bound: bool | None = option(
        None,
        "compute a lower bound of what any posture costs, about a minute; by default only with effort "
        "thorough",
        flags="--bound/--no-bound",
        example=True,
    )
