"""How logs of an axis are read, and how a drive is fitted to them."""

from __future__ import annotations

from dataclasses import dataclass

from fiveaxis.base.options.group import Group, option


@dataclass(frozen=True, kw_only=True)
class ReadLog(Group):
    """Columns of a log, and their units."""

    velocity: str | None = option(None, "column of the velocity; by default derived from position", rank=13)
    velocity_unit: str | None = option(
        None, "mm/s, mm/min, m/min, m/s, inch/min or inch/s; deg/s, deg/min, rad/s or rev/min", rank=14
    )
    acceleration: str | None = option(None, "column of the acceleration; by default derived from velocity")
    acceleration_unit: str | None = option(None, "mm/s2, m/s2, inch/s2 or g; deg/s2 or rad/s2")
    position: str | None = option(
        None, "column of the position; beside velocity and time it checks them and shows gaps"
    )
    position_unit: str | None = option(None, "mm, inch, m or um; deg, rad or rev")
    time: str | None = option(None, "column of the time; steps may differ", rank=15)
    time_unit: str | None = option(None, "s, ms, us or min; iso for dates and times", rank=16)
    rate: float | None = option(
        None, "rows per second, in place of a time column", unit="Hz", above=0.0, rank=17
    )
    longest_step: float | None = option(
        None, "a longer step between rows is a gap; by default 10 median steps", unit="s", above=0.0
    )
    nominal_power: float | None = option(None, "power of 100 % load", unit="W", above=0.0)
    nominal_current: float | None = option(
        None, "current of 100 % load; the voltage is needed with it", unit="A", above=0.0
    )
    voltage: float | None = option(None, "of a DC supply, or √3 U cos φ of three phases", unit="V", above=0.0)


@dataclass(frozen=True, kw_only=True)
class FitDrive(Group):
    """The axis, and which terms of its drive are fitted."""

    moved_mass: float | None = option(
        None,
        "all that a linear axis moves, with workpiece and fixture; the weight model needs it, and so "
        "does friction unless max_acceleration keeps steady rows only",
        unit="kg",
        above=0.0,
    )
    gravity: float | None = option(
        None,
        "gravity's load on a friction drive, positive where it opposes the + direction; 9.81 N per kg "
        "of a Z that lifts its mass, by default 0 for the other axes",
        unit="N or N·m",
    )
    max_acceleration: float | None = option(
        None, "rows that accelerate more aren't fitted", unit="mm/s² or deg/s²", above=0.0
    )
    efficiency: float = option(
        1.0, "of a friction drive; a log doesn't show it", unit="W/W", above=0.0, most=1.0
    )
    terms: tuple[str, ...] | None = option(
        None,
        "of a friction drive; by default friction and viscous, counterbalance if there is gravity, "
        "inertia of a rotary axis without max_acceleration, and hold if there are rows at standstill; "
        "copper and regeneration only if named",
        written="friction,viscous",
    )
    proportional: bool = option(
        False, "a directional drive's power is in proportion to its speed", flags="--proportional/--constant"
    )


@dataclass(frozen=True, kw_only=True)
class Calibrate(ReadLog, FitDrive):
    """How logs of an axis are read, and how a drive is fitted to them."""
