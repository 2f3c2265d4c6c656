"""The columns of an axis's log: names, stated units, and values that are plausible in them.

A log in mm/min that is read as mm/s fits as well as any other, with coefficients 60 times too small; so a
peak beyond what axes of machine tools reach is refused, with the unit in which it would be an ordinary one.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, InputError, IntArray, ReadLog, SettingError

TURN = 2.0 * math.pi
DEGREE = math.radians(1.0)
SPIKES = 0.01  # share of rows above the bound up to which these rows are wrong, and not the unit
DATES = "iso"  # the unit of a column of dates and times


@dataclass(frozen=True)
class Quantity:
    """A quantity that a column of a log can have.

    Parameters
    ----------
    name : of it
    units : unit → its size in ours, likeliest first
    shown : unit of messages
    least, most : of a log's peak, in the unit of messages
    usual : range of most logs' peaks, by which the likely unit is found
    """

    name: str
    units: Mapping[str, float]
    shown: str
    least: float = 0.0
    most: float = math.inf
    usual: tuple[float, float] = (0.0, math.inf)


LINEAR = {
    "position": Quantity("position", {"mm": 1.0, "inch": 25.4, "m": 1000.0, "um": 1e-3}, "mm", most=1e5),
    # 120 m/min is more than nearly all machine tools have.
    "velocity": Quantity(
        "velocity",
        {
            "mm/s": 1.0,
            "mm/min": 1.0 / 60.0,
            "m/min": 1000.0 / 60.0,
            "m/s": 1000.0,
            "inch/min": 25.4 / 60.0,
            "inch/s": 25.4,
        },
        "mm/s",
        least=0.1,
        most=2000.0,
        usual=(5.0, 1500.0),
    ),
    "acceleration": Quantity(
        "acceleration",
        {"mm/s2": 1.0, "m/s2": 1000.0, "inch/s2": 25.4, "g": 9806.65},
        "mm/s2",
        most=5e4,
        usual=(10.0, 2e4),
    ),
}
ROTARY = {
    "position": Quantity("position", {"deg": DEGREE, "rad": 1.0, "rev": TURN}, "deg"),
    # 1 200 rev/min: a table that turns too.
    "velocity": Quantity(
        "velocity",
        {"deg/s": DEGREE, "deg/min": DEGREE / 60.0, "rad/s": 1.0, "rev/min": TURN / 60.0},
        "deg/s",
        least=0.1,
        most=7200.0,
        usual=(5.0, 3000.0),
    ),
    "acceleration": Quantity(
        "acceleration", {"deg/s2": DEGREE, "rad/s2": 1.0}, "deg/s2", most=1e5, usual=(10.0, 5e4)
    ),
}
COMMON = {
    "time": Quantity("time", {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, DATES: 1.0}, "s"),
    "power": Quantity("power", {"W": 1.0, "kW": 1000.0}, "W", least=1.0, most=1e5, usual=(5.0, 2e4)),
    "load": Quantity("load", {"%": 1.0}, "%", least=2.0, most=500.0, usual=(5.0, 200.0)),
    "current": Quantity("current", {"A": 1.0}, "A", least=0.02, most=1000.0),
}
# A step between rows, not a peak: slower logs don't show how an axis moves.
STEP = Quantity(
    "time", {u: f for u, f in COMMON["time"].units.items() if u != DATES}, "s", 2e-5, 5.0, (2e-4, 2.0)
)


# Travel by position over travel by velocity, which is sampled, where both have the right unit.
AGREEING = (0.6, 1.6)


@dataclass(frozen=True)
class LogColumns:
    """The columns of an axis's log, and what its power is a share of.

    Parameters
    ----------
    names : quantity → its column
    units : quantity → its unit, as stated
    rotary : whether the axis turns, so that its units are those of angles
    rate : Hz, of the rows, where no column has the time
    longest_step : s, above which a step is a gap; None for a multiple of the median step
    nominal : W, of 100 % load; None where it isn't known
    voltage : W per A
    """

    names: Mapping[str, str]
    units: Mapping[str, str]
    rotary: bool
    rate: float | None
    longest_step: float | None
    nominal: float | None
    voltage: float | None

    @classmethod
    def of(cls, power: str, power_unit: str | None, log: ReadLog, *, rotary: bool) -> LogColumns:
        """Check columns and units, before any log is read.

        Parameters
        ----------
        power, power_unit : column of the power, load or current, and its unit
        log : the other columns and their units
        rotary : whether the axis turns

        Raises
        ------
        SettingError
            An option is out of its range; a column lacks its unit or a unit its column; the columns don't
            determine the velocity, or give the time twice; nominal values don't fit the unit of the power.
        """
        named = {
            "power": (power, power_unit),
            "velocity": (log.velocity, log.velocity_unit),
            "acceleration": (log.acceleration, log.acceleration_unit),
            "position": (log.position, log.position_unit),
            "time": (log.time, log.time_unit),
        }
        nominal, current, voltage = log.nominal_power, log.nominal_current, log.voltage
        of_current = None if current is None or voltage is None else current * voltage
        columns = cls(
            names={quantity: name for quantity, (name, _) in named.items() if name is not None},
            units={quantity: unit for quantity, (_, unit) in named.items() if unit is not None},
            rotary=rotary,
            rate=log.rate,
            longest_step=log.longest_step,
            nominal=of_current if nominal is None else nominal,
            voltage=voltage,
        )
        for quantity in named:
            if quantity in columns.names:
                columns.size(quantity)
            elif quantity in columns.units:
                unit = columns.units[quantity]
                raise SettingError(f"the {quantity} has a unit, {unit}, but no column; name its column")
        columns._require_time()
        figures = {"nominal_power": nominal, "nominal_current": current, "voltage": voltage}
        columns._require_nominal({name for name, figure in figures.items() if figure is not None})
        return columns

    @property
    def is_load(self) -> bool:
        """Whether the power is a load in percent."""
        return self.units["power"] == "%"

    @property
    def signed(self) -> bool:
        """Whether the power's column can tell a braking drive from one that pushes."""
        return self.units["power"] in COMMON["power"].units

    @property
    def has_time(self) -> bool:
        """Whether the time of the rows is known."""
        return "time" in self.names or self.rate is not None

    @property
    def watts(self) -> float:
        """W per unit of the power's column, W, % or A; 1 of a load whose nominal power isn't known."""
        if self.signed:
            return 1.0
        if self.is_load:
            return 1.0 if self.nominal is None else self.nominal / 100.0
        return self.voltage or 1.0

    def size(self, quantity: str) -> float:
        """Return the size of a column's unit in ours; of power, load and current in W, % and A.

        `SettingError` if no unit is stated, it is unknown, or it belongs to the other kind of axis.
        """
        known = dict(_quantities(rotary=self.rotary)[quantity].units)
        others = _quantities(rotary=not self.rotary)[quantity].units
        if quantity == "power":
            known.update({**COMMON["load"].units, **COMMON["current"].units})
        unit = self.units.get(quantity)
        if unit is None:
            raise SettingError(f"the {quantity} has no unit; state the one of its column: {', '.join(known)}")
        if (spelt := _spell(unit)) in known:
            return known[spelt]
        kind = "rotary" if self.rotary else "linear"
        if spelt in others:
            raise SettingError(
                f"the {quantity} unit is {unit}, but the axis is {kind}; state one of {', '.join(known)}"
            )
        near = difflib.get_close_matches(unit, known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"
        raise SettingError(f"unknown {quantity} unit {unit!r} of a {kind} axis; {hint}")

    def require_plausible(self, quantity: str, values: Array, lines: IntArray, file: Path) -> None:
        """Raise if a column's peak is above that of machine tools in the stated unit.

        The quantity may also be the velocity that other columns gave. Values, (n,), are in our units, those
        of power in the unit of its column; lines, (n,), are of the file. The `InputError` has the likely
        unit; or, if few rows are above the bound, the first of them.
        """
        known, column, unit = self._source(quantity)
        sizes = np.abs(values) / known.units[known.shown]
        peak, above = float(sizes.max(initial=0.0)), np.flatnonzero(sizes > known.most)
        if 0 < len(above) <= SPIKES * len(sizes):
            first = int(above[0])
            raise InputError(
                f"{known.name} in column {column!r} is {sizes[first]:.4g} {known.shown}, above the "
                f"{known.most:g} {known.shown} of machine tools, as in {len(above)} of {len(sizes)} rows; "
                "correct these cells or leave them empty",
                file=file,
                line=int(lines[first]),
            )
        if len(above):
            raise _refuse_peak(known, peak, unit, f"above the {known.most:g}", column, str(file))

    def require_large_enough(self, quantity: str, values: Array, files: str) -> None:
        """Raise if a column's peak in all logs is below that of machine tools; parameters as above.

        It is 0 where nothing moves, and small in a log of a standstill alone, so the logs are looked at
        together.
        """
        known, column, unit = self._source(quantity)
        peak = float(np.abs(values).max(initial=0.0)) / known.units[known.shown]
        if 0.0 < peak < known.least:
            raise _refuse_peak(known, peak, unit, f"below the {known.least:g}", column, files)

    def require_plausible_step(self, step: float, file: Path) -> None:
        """Raise if the median step between rows, s, isn't one of a log of motion."""
        if STEP.least <= step <= STEP.most:
            return
        which = "above the 5 s within which an axis moves" if step > STEP.most else "below 20 µs"
        raise InputError(
            f"time in column {self.names['time']!r} has a median step of {step:.4g} s, {which}; "
            f"{_hint(STEP, step, self.units['time'])}",
            file=file,
        )

    def require_agreeing(self, ratio: float, file: Path) -> None:
        """Raise if the travel by position isn't about that by the velocity's column, with the likely unit."""
        if AGREEING[0] <= ratio <= AGREEING[1]:
            return
        units, unit = _quantities(rotary=self.rotary)["velocity"].units, self.units["velocity"]
        nearest = (
            min(units, key=lambda other: abs(math.log(ratio * units[unit] / units[other]))) if ratio else unit
        )
        hint = "check the columns and units of position, velocity and time"
        if nearest != unit and AGREEING[0] <= ratio * units[unit] / units[nearest] <= AGREEING[1]:
            hint = f"the likely unit of the velocity is {nearest}, not {unit}"
        raise InputError(
            f"position and velocity disagree: the axis travels {ratio:.3g} times what its velocity gives; "
            f"{hint}",
            file=file,
        )

    def _source(self, quantity: str) -> tuple[Quantity, str, str | None]:
        """Return what a quantity is, where it comes from, and its unit; None if it is derived."""
        if quantity == "power":
            kind = "power" if self.signed else "load" if self.is_load else "current"
            return COMMON[kind], self.names["power"], self.units["power"]
        known = _quantities(rotary=self.rotary)[quantity]
        if quantity not in self.names:
            return known, f"{self.names['position']} by time", None
        return known, self.names[quantity], self.units[quantity]

    def _require_time(self) -> None:
        if "time" in self.names and self.rate is not None:
            raise SettingError("both a time column and a rate are given; the time is one or the other")
        if "velocity" in self.names:
            return
        if "position" not in self.names:
            raise SettingError("no column has the velocity; name one, or a position with a time or a rate")
        if not self.has_time:
            raise SettingError(
                "velocity from position needs the time; name its column, or give the rate in Hz"
            )

    def _require_nominal(self, given: set[str]) -> None:
        """Raise if nominal values are too many or too few; a load without any is refused when it was read."""
        wanted: tuple[set[str], ...] = (set(),)
        if self.is_load:
            wanted = (set(), {"nominal_power"}, {"nominal_current", "voltage"})
        elif not self.signed:
            wanted = ({"voltage"},)
        if given not in wanted:
            ways = " or ".join(" and ".join(sorted(one)).replace("_", " ") for one in wanted if one)
            had = ", ".join(sorted(given)).replace("_", " ") or "none"
            raise SettingError(
                f"a power in {self.units['power']} needs {ways or 'no nominal value'}; given: {had}"
            )


def _quantities(*, rotary: bool) -> dict[str, Quantity]:
    """Return the quantities of a linear or a rotary axis, by name."""
    return COMMON | (ROTARY if rotary else LINEAR)


def _spell(unit: str) -> str:
    return unit.replace("²", "2").replace("µ", "u")


def _refuse_peak(
    quantity: Quantity, peak: float, unit: str | None, bound: str, column: str, files: str
) -> InputError:
    return InputError(
        f"{quantity.name} in column {column!r} peaks at {peak:.4g} {quantity.shown}, {bound} "
        f"{quantity.shown} of machine tools; {_hint(quantity, peak, unit)}",
        file=files,
    )


def _hint(quantity: Quantity, peak: float, unit: str | None) -> str:
    """Name the likeliest unit in which a peak, given in the shown unit, is an ordinary one."""
    if unit is None:
        return "check the units of position and time"
    unit = _spell(unit)
    written = peak * quantity.units[quantity.shown] / quantity.units.get(unit, 1.0)
    for other, size in quantity.units.items():
        value = written * size / quantity.units[quantity.shown]
        if other != unit and quantity.usual[0] <= value <= quantity.usual[1]:
            return f"the likely unit is {other} (not {unit}), which makes it {value:.4g} {quantity.shown}"
    return f"{unit} is hardly its unit; look at the column"
