"""Which columns a log has, in which units, and what its power is a share of."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fiveaxis.energy.bounds import require_positive
from fiveaxis.energy.log_units import require_unit
from fiveaxis.errors import SettingError

QUANTITIES = ("power", "velocity", "acceleration", "position", "time")


@dataclass(frozen=True)
class LogColumns:
    """The columns of a log, and their units; `calibrate_drive` explains them."""

    power: str
    power_unit: str | None
    velocity: str | None = None
    velocity_unit: str | None = None
    acceleration: str | None = None
    acceleration_unit: str | None = None
    position: str | None = None
    position_unit: str | None = None
    time: str | None = None
    time_unit: str | None = None
    rate: float | None = None
    longest_step: float | None = None
    nominal_power: float | None = None
    nominal_current: float | None = None
    voltage: float | None = None

    @property
    def named(self) -> dict[str, str]:
        """Quantities that have a column: quantity → column name."""
        names = {quantity: getattr(self, quantity) for quantity in QUANTITIES}
        return {quantity: name for quantity, name in names.items() if name is not None}

    @property
    def is_load(self) -> bool:
        """Whether the power is a load in percent."""
        return self.power_unit == "%"

    @property
    def signed(self) -> bool:
        """Whether the power's column can tell a braking drive from one that pushes."""
        return self.power_unit in ("W", "kW")

    @property
    def power_kind(self) -> str:
        """The quantity of the power's column: power, load or current."""
        return "power" if self.signed else "load" if self.is_load else "current"

    @property
    def speed_column(self) -> tuple[str, str | None]:
        """Where the speed comes from, and its unit; None if it is derived."""
        if self.velocity is None:
            return f"{self.position} by time", None
        return self.velocity, self.velocity_unit

    @property
    def nominal(self) -> float | None:
        """Power of 100 % load, W; None if it isn't known."""
        if self.nominal_power is not None or self.nominal_current is None or self.voltage is None:
            return self.nominal_power
        return self.nominal_current * self.voltage

    @property
    def watts(self) -> float:
        """W per unit of the power's column, W, % or A; 1 of a load whose nominal power isn't known."""
        if self.signed:
            return 1.0
        if self.is_load:
            return 1.0 if self.nominal is None else self.nominal / 100.0
        return self.voltage or 1.0


def require_columns(columns: LogColumns, *, rotary: bool) -> None:
    """Check columns and units, before any log is read.

    Raises
    ------
    SettingError
        A column lacks its unit or a unit its column; the columns don't determine the velocity, or give the
        time twice; nominal values don't fit the unit of the power.
    """
    for quantity in QUANTITIES:
        unit = getattr(columns, f"{quantity}_unit")
        if quantity in columns.named:
            require_unit(quantity, unit, rotary=rotary)
        elif unit is not None:
            raise SettingError(f"the {quantity} has a unit, {unit}, but no column; name its column")
    if columns.longest_step is not None:
        require_positive("longest step", columns.longest_step, "s")
    _require_time(columns)
    _require_nominal(columns)


def _require_time(columns: LogColumns) -> None:
    if columns.time is not None and columns.rate is not None:
        raise SettingError("both a time column and a rate are given; the time is one or the other")
    if columns.rate is not None and not (math.isfinite(columns.rate) and columns.rate > 0.0):
        raise SettingError(f"the rate is {columns.rate:g} Hz; it must be above 0 Hz")
    if columns.velocity is not None:
        return
    if columns.position is None:
        raise SettingError("no column has the velocity; name one, or a position with a time or a rate")
    if columns.time is None and columns.rate is None:
        raise SettingError("velocity from position needs the time; name its column, or give the rate in Hz")


def _require_nominal(columns: LogColumns) -> None:
    """Raise if nominal values are too many or too few; a load without any is refused when it was read."""
    given = {
        name: value
        for name in ("nominal_power", "nominal_current", "voltage")
        if (value := getattr(columns, name)) is not None
    }
    for name, unit in (("nominal_power", "W"), ("nominal_current", "A"), ("voltage", "V")):
        if name in given:
            require_positive(name.replace("_", " "), given[name], unit)
    wanted: tuple[set[str], ...] = (set(),)
    if columns.is_load:
        wanted = (set(), {"nominal_power"}, {"nominal_current", "voltage"})
    elif not columns.signed:
        wanted = ({"voltage"},)
    if set(given) not in wanted:
        ways = " or ".join(" and ".join(sorted(one)).replace("_", " ") for one in wanted if one)
        had = ", ".join(sorted(given)).replace("_", " ") or "none"
        raise SettingError(
            f"a power in {columns.power_unit} needs {ways or 'no nominal value'}; given: {had}"
        )
