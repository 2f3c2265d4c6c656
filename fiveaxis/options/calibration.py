"""How logs of an axis are read, and how a drive is fitted to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fiveaxis.options.option import Group, Option


@dataclass(frozen=True, kw_only=True)
class ReadLog(Group):
    """Columns of a log, and their units."""

    velocity: Annotated[
        str | None, Option("column of the velocity; by default derived from position", rank=13)
    ] = None
    velocity_unit: Annotated[
        str | None,
        Option("mm/s, mm/min, m/min, m/s, inch/min or inch/s; deg/s, deg/min, rad/s or rev/min", rank=14),
    ] = None
    acceleration: Annotated[
        str | None, Option("column of the acceleration; by default derived from velocity")
    ] = None
    acceleration_unit: Annotated[str | None, Option("mm/s2, m/s2, inch/s2 or g; deg/s2 or rad/s2")] = None
    position: Annotated[
        str | None, Option("column of the position; beside velocity and time it checks them and shows gaps")
    ] = None
    position_unit: Annotated[str | None, Option("mm, inch, m or um; deg, rad or rev")] = None
    time: Annotated[str | None, Option("column of the time; steps may differ", rank=15)] = None
    time_unit: Annotated[str | None, Option("s, ms, us or min; iso for dates and times", rank=16)] = None
    rate: Annotated[
        float | None, Option("rows per second, in place of a time column", unit="Hz", above=0.0, rank=17)
    ] = None
    longest_step: Annotated[
        float | None,
        Option("a longer step between rows is a gap; by default 10 median steps", unit="s", above=0.0),
    ] = None
    nominal_power: Annotated[float | None, Option("power of 100 % load", unit="W", above=0.0)] = None
    nominal_current: Annotated[
        float | None, Option("current of 100 % load; the voltage is needed with it", unit="A", above=0.0)
    ] = None
    voltage: Annotated[
        float | None, Option("of a DC supply, or √3 U cos φ of three phases", unit="V", above=0.0)
    ] = None


@dataclass(frozen=True, kw_only=True)
class FitDrive(Group):
    """The axis, and which terms of its drive are fitted."""

    moved_mass: Annotated[
        float | None,
        Option(
            "all that a linear axis moves, with workpiece and fixture; the weight model needs it, and so "
            "does friction unless max_acceleration keeps steady rows only",
            unit="kg",
            above=0.0,
        ),
    ] = None
    gravity: Annotated[
        float | None,
        Option(
            "gravity's load on a friction drive, positive where it opposes the + direction; 9.81 N per kg "
            "of a Z that lifts its mass, by default 0 for the other axes",
            unit="N or N·m",
        ),
    ] = None
    max_acceleration: Annotated[
        float | None, Option("rows that accelerate more aren't fitted", unit="mm/s² or deg/s²", above=0.0)
    ] = None
    standstill: Annotated[
        float | None,
        Option(
            "speed up to which the axis stands; by default 0.5 % of the highest",
            unit="mm/s or deg/s",
            least=0.0,
        ),
    ] = None
    efficiency: Annotated[
        float,
        Option("of a friction drive; a log doesn't show it", unit="W/W", above=0.0, most=1.0),
    ] = 1.0
    terms: Annotated[
        tuple[str, ...] | None,
        Option(
            "of a friction drive; by default friction and viscous, counterbalance if there is gravity, "
            "inertia of a rotary axis without max_acceleration, and hold if there are rows at standstill; "
            "copper and regeneration only if named",
            written="friction,viscous",
        ),
    ] = None
    proportional: Annotated[
        bool,
        Option(
            "a directional drive's power is in proportion to its speed",
            flags="--proportional/--constant",
        ),
    ] = False


@dataclass(frozen=True, kw_only=True)
class Calibrate(ReadLog, FitDrive):
    """How logs of an axis are read, and how a drive is fitted to them."""
