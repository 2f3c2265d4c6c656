"""Logs of the motion and power of one axis, from a CSV file with any column names.

The first line names the columns, separated by commas, semicolons or tabs. Blank lines and lines that start
with ``#`` are skipped. A row with an empty or NaN cell is dropped and counted; text in place of a number is
an error.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.errors import InputError, SettingError
from fiveaxis.files import MOST_PATH_BYTES, read_input
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine.tables import ANGLE_UNITS, LINEAR_UNITS

POWER_UNITS = {"W": 1.0, "kW": 1000.0}
MOST_LOST = 0.5  # share of dropped rows above which the columns are hardly the right ones
LARGEST = 1e15  # in any unit: no log has more, and the squares of fits would leave what a number can hold
EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none"})


@dataclass(frozen=True)
class LogColumns:
    """The columns of a log, and their units.

    Parameters
    ----------
    power, velocity, acceleration, position, time : names of columns; None if missing
    rate : rows per second, in place of a time column
    power_unit : W or kW
    length_unit : unit of position, of velocity per s and of acceleration per s²; None for mm or deg
    """

    power: str
    velocity: str | None = None
    acceleration: str | None = None
    position: str | None = None
    time: str | None = None
    rate: float | None = None
    power_unit: str = "W"
    length_unit: str | None = None

    @property
    def named(self) -> dict[str, str]:
        """Quantities that have a column: quantity → column name."""
        names = {q: getattr(self, q) for q in ("power", "velocity", "acceleration", "position", "time")}
        return {quantity: name for quantity, name in names.items() if name is not None}


@dataclass(frozen=True, eq=False)
class AxisLog:
    """Motion and power of one axis.

    Parameters
    ----------
    file : from which it was read
    sha256 : of the file's bytes
    lines : (n,), line of each row, from 1
    speed : (n,), mm/s or rad/s, signed
    acceleration : (n,), mm/s² or rad/s²; None if the log doesn't contain it
    power : (n,), W
    dropped : reason → number of rows of the file that were dropped
    """

    file: str
    sha256: str
    lines: IntArray
    speed: Array
    acceleration: Array | None
    power: Array
    dropped: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.lines)

    def without(self, rows: BoolArray, reason: str) -> AxisLog:
        """Return the log without some rows, (n,), counted under a reason."""
        count, kept = int(rows.sum()), ~rows
        if not count:
            return self
        return replace(
            self,
            lines=self.lines[kept],
            speed=self.speed[kept],
            acceleration=None if self.acceleration is None else self.acceleration[kept],
            power=self.power[kept],
            dropped=dict(self.dropped) | {reason: count},
        )


def read_axis_log(log: str | Path, columns: LogColumns, *, rotary: bool) -> AxisLog:
    """Read the motion and power of an axis.

    Without a velocity column, velocity is the derivative of position by time; without an acceleration column,
    acceleration is that of velocity. Both are central differences of second order for uneven time steps,
    one-sided at the ends (`numpy.gradient`). They aren't smoothed: noise of amplitude e in position becomes
    e/Δt in velocity, so a coarse position needs a slower log or a velocity column.

    Parameters
    ----------
    log : CSV file
    columns : its columns
    rotary : whether the axis turns, so that its unit is an angle

    Raises
    ------
    SettingError
        Units, rate or the choice of columns are wrong.
    InputError
        The file can't be read or isn't a table with these columns; time doesn't grow; more rows lack a number
        than don't. The message has line and column.
    """
    power_scale, length_scale = _require_units(columns, rotary)
    _require_choice(columns)
    file = Path(log)
    content = read_input(file, MOST_PATH_BYTES, InputError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("isn't text in UTF-8; export it as CSV", file=file) from None
    values, lines = _read_columns(text, columns.named, file)
    if columns.rate is not None:
        values["time"] = np.arange(len(lines)) / columns.rate
    whole = np.all([np.isfinite(v) for v in values.values()], axis=0)
    lost = int((~whole).sum())
    if lost > MOST_LOST * len(lines):
        worst = max(columns.named, key=lambda q: int(np.isnan(values[q]).sum()))
        raise InputError(
            f"{lost} of {len(lines)} rows lack a number, most in column {columns.named[worst]!r}; "
            f"name another column for {worst}, or clean the log",
            file=file,
        )
    values, lines = {q: v[whole] for q, v in values.items()}, lines[whole]
    speed, acceleration = _motion(values, lines, columns, file)
    return AxisLog(
        file=str(log),
        sha256=hashlib.sha256(content).hexdigest(),
        lines=lines,
        speed=speed * length_scale,
        acceleration=None if acceleration is None else acceleration * length_scale,
        power=values["power"] * power_scale,
        dropped={"a cell without a number": lost} if lost else {},
    )


def length_factor(unit: str | None, *, rotary: bool) -> float:
    """Return the factor from a unit of length or angle to mm or rad; None means mm or deg.

    Raises
    ------
    SettingError
        The unit is unknown, or belongs to the other kind of axis.
    """
    units, others = (ANGLE_UNITS, LINEAR_UNITS) if rotary else (LINEAR_UNITS, ANGLE_UNITS)
    chosen = unit or ("deg" if rotary else "mm")
    if chosen in units:
        return units[chosen]
    kind = "rotary" if rotary else "linear"
    if chosen in others:
        raise SettingError(f"the length unit is {chosen}, but the axis is {kind}; write {' or '.join(units)}")
    raise SettingError(f"unknown length unit {chosen!r}; a {kind} axis has {', '.join(units)}")


def _require_units(columns: LogColumns, rotary: bool) -> tuple[float, float]:
    if columns.power_unit not in POWER_UNITS:
        raise SettingError(f"unknown power unit {columns.power_unit!r}; write {' or '.join(POWER_UNITS)}")
    return POWER_UNITS[columns.power_unit], length_factor(columns.length_unit, rotary=rotary)


def _require_choice(columns: LogColumns) -> None:
    """Raise if the columns don't determine the velocity, or give the time twice."""
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


def _read_columns(text: str, named: Mapping[str, str], file: Path) -> tuple[dict[str, Array], IntArray]:
    """Read the named columns, NaN for an empty cell, and the line of each row."""
    first = next((line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"), "")
    if not first:
        raise InputError("is empty; a line with the names of the columns is needed", file=file)
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text), delimiter=delimiter)
    try:
        rows = [
            (reader.line_num, row)
            for row in reader
            if any(map(str.strip, row)) and row[0].lstrip()[:1] != "#"
        ]
    except csv.Error as fault:
        raise InputError(f"can't be read as CSV: {fault}", file=file, line=reader.line_num) from None
    line, header = rows[0][0], [name.strip() for name in rows[0][1]]
    if len(rows) == 1:
        raise InputError("has a header but no rows", file=file, line=line)
    for number, row in rows[1:]:
        if len(row) != len(header):
            raise InputError(
                f"has {len(row)} fields, the header {len(header)}; correct the row", file=file, line=number
            )
    at = {quantity: _find_column(quantity, name, header, file, line) for quantity, name in named.items()}
    values = {
        quantity: np.array([_number(row[i], header[i], number, file) for number, row in rows[1:]])
        for quantity, i in at.items()
    }
    return values, np.array([number for number, _ in rows[1:]], dtype=np.int64)


def _find_column(quantity: str, name: str, header: list[str], file: Path, line: int) -> int:
    count = header.count(name)
    if count == 1:
        return header.index(name)
    if count:
        raise InputError(f"has {count} columns named {name!r}; rename them", file=file, line=line)
    lower = {known.lower(): known for known in header}
    near = [lower[key] for key in difflib.get_close_matches(name.lower(), lower, n=3, cutoff=0.5)]
    hint = f"did you mean {', '.join(near)}?" if near else f"it has {', '.join(header[:12])}"
    raise InputError(f"has no column {name!r} for {quantity}; {hint}", file=file, line=line)


def _number(cell: str, column: str, line: int, file: Path) -> float:
    text = cell.strip()
    if text.lower() in EMPTY:
        return math.nan
    try:
        value = float(text)
    except ValueError:
        hint = "write a decimal point" if text.count(",") == 1 else "correct it or leave it empty"
        raise InputError(f"{column} is {text!r}, not a number; {hint}", file=file, line=line) from None
    if math.isinf(value):
        raise InputError(f"{column} is infinite; correct it or leave it empty", file=file, line=line)
    if abs(value) > LARGEST:
        raise InputError(
            f"{column} is {value:g}, beyond {LARGEST:g}; correct it or leave it empty", file=file, line=line
        )
    return value


def _motion(
    values: Mapping[str, Array], lines: IntArray, columns: LogColumns, file: Path
) -> tuple[Array, Array | None]:
    """Return velocity and acceleration in the log's units, derived where a column is missing."""
    time = values.get("time")
    if time is None:
        return values["velocity"], values.get("acceleration")
    _require_growing(time, lines, columns.time, file)
    if len(time) < 3:
        raise InputError(f"{len(time)} rows with numbers are too few to differentiate", file=file)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        speed = values["velocity"] if "velocity" in values else np.gradient(values["position"], time)
        acceleration = values["acceleration"] if "acceleration" in values else np.gradient(speed, time)
    bad = np.flatnonzero(~((np.abs(speed) <= LARGEST) & (np.abs(acceleration) <= LARGEST)))
    if len(bad):
        raise InputError(
            f"speed or acceleration is beyond {LARGEST:g}; correct position and time",
            file=file,
            line=int(lines[bad[0]]),
        )
    return speed, acceleration


def _require_growing(time: Array, lines: IntArray, name: str | None, file: Path) -> None:
    stuck = np.flatnonzero(np.diff(time) <= 0.0)
    if len(stuck):
        i = int(stuck[0])
        raise InputError(
            f"{name} goes from {time[i]:g} to {time[i + 1]:g} s; time must grow from row to row: sort the "
            "log, or split it where the clock was set",
            file=file,
            line=int(lines[i + 1]),
        )
