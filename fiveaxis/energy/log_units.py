"""Units of a log's columns: each is stated, and its values must be plausible in it.

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

from fiveaxis.errors import InputError, SettingError
from fiveaxis.geometry import Array, IntArray

TURN = 2.0 * math.pi
DEGREE = math.radians(1.0)
SPIKES = 0.01  # share of rows above the bound up to which these rows are wrong, and not the unit
DATES = "iso"  # the unit of a column of dates and times


@dataclass(frozen=True)
class Quantity:
    """A quantity that a column of a log can have.

    Parameters
    ----------
    units : unit → its size in ours, likeliest first
    shown : unit of messages
    least, most : of a log's peak, in the unit of messages
    usual : range of most logs' peaks, by which the likely unit is found
    """

    units: Mapping[str, float]
    shown: str
    least: float = 0.0
    most: float = math.inf
    usual: tuple[float, float] = (0.0, math.inf)


LINEAR = {
    "position": Quantity({"mm": 1.0, "inch": 25.4, "m": 1000.0, "um": 1e-3}, "mm", most=1e5),
    # 120 m/min is more than nearly all machine tools have.
    "velocity": Quantity(
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
        {"mm/s2": 1.0, "m/s2": 1000.0, "inch/s2": 25.4, "g": 9806.65}, "mm/s2", most=5e4, usual=(10.0, 2e4)
    ),
}
ROTARY = {
    "position": Quantity({"deg": DEGREE, "rad": 1.0, "rev": TURN}, "deg"),
    # 1 200 rev/min: a table that turns too.
    "velocity": Quantity(
        {"deg/s": DEGREE, "deg/min": DEGREE / 60.0, "rad/s": 1.0, "rev/min": TURN / 60.0},
        "deg/s",
        least=0.1,
        most=7200.0,
        usual=(5.0, 3000.0),
    ),
    "acceleration": Quantity({"deg/s2": DEGREE, "rad/s2": 1.0}, "deg/s2", most=1e5, usual=(10.0, 5e4)),
}
COMMON = {
    "time": Quantity({"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, DATES: 1.0}, "s"),
    "power": Quantity({"W": 1.0, "kW": 1000.0}, "W", least=1.0, most=1e5, usual=(5.0, 2e4)),
    "load": Quantity({"%": 1.0}, "%", least=2.0, most=500.0, usual=(5.0, 200.0)),
    "current": Quantity({"A": 1.0}, "A", least=0.02, most=1000.0),
}
# A step between rows, not a peak: slower logs don't show how an axis moves.
STEP = Quantity({u: f for u, f in COMMON["time"].units.items() if u != DATES}, "s", 2e-5, 5.0, (2e-4, 2.0))


def quantities(*, rotary: bool) -> dict[str, Quantity]:
    """Return the quantities of a linear or a rotary axis, by name."""
    return COMMON | (ROTARY if rotary else LINEAR)


def require_unit(name: str, unit: str | None, *, rotary: bool) -> float:
    """Return the size of a unit in ours; of power, load and current in W, % and A.

    Raises
    ------
    SettingError
        No unit is stated, it is unknown, or it belongs to the other kind of axis.
    """
    known = dict(quantities(rotary=rotary)[name].units)
    others = quantities(rotary=not rotary)[name].units
    if name == "power":
        known.update({**COMMON["load"].units, **COMMON["current"].units})
    if unit is None:
        raise SettingError(f"the {name} has no unit; state the one of its column: {', '.join(known)}")
    if (spelt := _spell(unit)) in known:
        return known[spelt]
    kind = "rotary" if rotary else "linear"
    if spelt in others:
        raise SettingError(
            f"the {name} unit is {unit}, but the axis is {kind}; state one of {', '.join(known)}"
        )
    near = difflib.get_close_matches(unit, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"
    raise SettingError(f"unknown {name} unit {unit!r} of a {kind} axis; {hint}")


def _spell(unit: str) -> str:
    return unit.replace("²", "2").replace("µ", "u")


def require_plausible(
    name: str, values: Array, unit: str | None, *, rotary: bool, column: str, lines: IntArray, file: Path
) -> None:
    """Raise if a column's peak is above that of machine tools in the stated unit.

    Parameters
    ----------
    name : the quantity
    values : (n,), in our units
    unit : as stated; None for a quantity that other columns gave
    column : its name
    lines : (n,), of the file

    Raises
    ------
    InputError
        With the likely unit; or, if few rows are above the bound, with the first of them.
    """
    quantity = quantities(rotary=rotary)[name]
    sizes = np.abs(values) / quantity.units[quantity.shown]
    peak, above = float(sizes.max(initial=0.0)), np.flatnonzero(sizes > quantity.most)
    if 0 < len(above) <= SPIKES * len(sizes):
        first = int(above[0])
        raise InputError(
            f"{name} in column {column!r} is {sizes[first]:.4g} {quantity.shown}, above the "
            f"{quantity.most:g} {quantity.shown} of machine tools, as in {len(above)} of {len(sizes)} rows; "
            "correct these cells or leave them empty",
            file=file,
            line=int(lines[first]),
        )
    if len(above):
        _refuse_peak(name, quantity, peak, unit, f"above the {quantity.most:g}", column, str(file))


def require_large_enough(
    name: str, values: Array, unit: str | None, *, rotary: bool, column: str, files: str
) -> None:
    """Raise if a column's peak in all logs is below that of machine tools; parameters as above.

    It is 0 where nothing moves, and small in a log of a standstill alone, so the logs are looked at together.
    """
    quantity = quantities(rotary=rotary)[name]
    peak = float(np.abs(values).max(initial=0.0)) / quantity.units[quantity.shown]
    if 0.0 < peak < quantity.least:
        _refuse_peak(name, quantity, peak, unit, f"below the {quantity.least:g}", column, files)


def _refuse_peak(
    name: str, quantity: Quantity, peak: float, unit: str | None, bound: str, column: str, files: str
) -> None:
    raise InputError(
        f"{name} in column {column!r} peaks at {peak:.4g} {quantity.shown}, {bound} {quantity.shown} of "
        f"machine tools; {_hint(quantity, peak, unit)}",
        file=files,
    )


def require_plausible_step(step: float, unit: str, column: str, file: Path) -> None:
    """Raise if the median step between rows, s, isn't one of a log of motion."""
    if STEP.least <= step <= STEP.most:
        return
    which = "above the 5 s within which an axis moves" if step > STEP.most else "below 20 µs"
    raise InputError(
        f"time in column {column!r} has a median step of {step:.4g} s, {which}; {_hint(STEP, step, unit)}",
        file=file,
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
