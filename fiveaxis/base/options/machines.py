"""The machine, where the workpiece stands on it, and what electricity and its time cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fiveaxis.base.options.group import Group, option


@dataclass(frozen=True, kw_only=True)
class OnMachine(Group):
    """The machine, and what isn't in its file."""

    machine: str | None = option(
        None,
        "a machine of the library (`fiveaxis machines`), or its file: .toml, .ini, .urdf, .mch",
        flags="--machine -m",
        rank=1,
    )
    assume: Mapping[str, str] = option(
        {},
        "figures that the machine doesn't state, assumed for this run, as answers to questions of "
        "`fiveaxis machine new`; program and report name them",
        written="A.points=0,0,50",
        example={"A.points": "0,0,50", "C.counts": "table"},
    )
    drives: str | None = option(
        None,
        "machine whose axis powers are used in place of the machine's own, by role or as named "
        "(`NAME:B=A`); `estimated` for estimates. By default missing powers are estimated",
        example="hayashi-640123",
        rank=20,
    )
    tool_length: float | None = option(
        None, "from the spindle's gauge point to the tool tip", unit="mm", least=0.0, example=120, rank=25
    )
    load: float | None = option(
        None, "mass of workpiece, vice and fixture", unit="kg", least=0.0, example=12, rank=24
    )


@dataclass(frozen=True, kw_only=True)
class Placing(Group):
    """Where the workpiece stands on the table, with every axis at 0."""

    offset: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0),
        "workpiece zero in the machine frame",
        unit="mm",
        written="X,Y,Z",
        flags="--work-offset",
        rank=10,
    )
    rotation: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0),
        "of the part: about the machine's X, then Y, then Z",
        unit="deg",
        written="X,Y,Z",
        flags="--part-rotation",
    )


@dataclass(frozen=True, kw_only=True)
class Costs(Group):
    """Prices and emission, for the cost of a job."""

    price: float | None = option(
        None, "price of 1 kWh, in the currency", least=0.0, example=0.3, flags="--kwh-price"
    )
    hour: float | None = option(
        None, "rate of the machine per hour, in the currency", least=0.0, example=60, flags="--hour-rate"
    )
    currency: str | None = option(None, "currency of the prices; EUR by default", example="EUR")
    co2: float | None = option(
        None, "emission of the electricity", unit="kg of CO2 per kWh", least=0.0, example=0.35
    )
