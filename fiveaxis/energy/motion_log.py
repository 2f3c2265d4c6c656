"""Logs of the motion and power of one axis, from CSV files with any column names (`log_table`).

A row with an empty cell is dropped and counted. Time may step unevenly; steps far longer than the others are
gaps, and so are jumps of position: nothing is differentiated across them (`log_pieces`).
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.energy.log_columns import LogColumns
from fiveaxis.energy.log_pieces import Pieces, require_growing, split_at_jumps
from fiveaxis.energy.log_table import LARGEST, read_columns
from fiveaxis.energy.log_units import (
    DATES,
    require_large_enough,
    require_plausible,
    require_plausible_step,
    require_unit,
)
from fiveaxis.errors import InputError
from fiveaxis.files import MOST_PATH_BYTES, read_input
from fiveaxis.geometry import Array, BoolArray, IntArray

MOST_LOST = 0.5  # share of dropped rows above which the columns are hardly the right ones
ALONE = "alone between gaps"


@dataclass(frozen=True, eq=False)
class AxisLog:
    """Motion and power of one axis.

    Parameters
    ----------
    file : from which it was read; several, if it was joined
    source : name of the file with its digest
    speed : (n,), mm/s or rad/s, signed
    acceleration : (n,), mm/s² or rad/s²; None if the log doesn't contain it
    power : (n,), W; % of a load whose nominal power isn't known
    duration : (n,), s, of each row; NaN without time
    dropped : reason → number of rows of the file that were dropped
    gaps : reason → number of steps that are gaps
    """

    file: str
    source: str
    speed: Array
    acceleration: Array | None
    power: Array
    duration: Array
    dropped: Mapping[str, int]
    gaps: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.power)

    def without(self, rows: BoolArray, reason: str) -> AxisLog:
        """Return the log without some rows, (n,), counted under a reason."""
        count, kept = int(rows.sum()), ~rows
        if not count:
            return self
        return replace(
            self,
            speed=self.speed[kept],
            acceleration=None if self.acceleration is None else self.acceleration[kept],
            power=self.power[kept],
            duration=self.duration[kept],
            dropped=dict(self.dropped) | {reason: count},
        )


def join_logs(logs: Sequence[AxisLog]) -> AxisLog:
    """Join the rows of logs that were read from the same columns."""
    accelerations = [log.acceleration for log in logs if log.acceleration is not None]
    return AxisLog(
        file=", ".join(log.file for log in logs),
        source="; ".join(log.source for log in logs),
        speed=np.concatenate([log.speed for log in logs]),
        acceleration=np.concatenate(accelerations) if accelerations else None,
        power=np.concatenate([log.power for log in logs]),
        duration=np.concatenate([log.duration for log in logs]),
        dropped=_sum_counts([log.dropped for log in logs]),
        gaps=_sum_counts([log.gaps for log in logs]),
    )


def _sum_counts(counts: Sequence[Mapping[str, int]]) -> dict[str, int]:
    return dict(sum(map(Counter, counts), Counter()))


def read_axis_log(log: str | Path, columns: LogColumns, *, rotary: bool) -> AxisLog:
    """Read the motion and power of an axis.

    Without a velocity column, velocity is the derivative of position by time; without an acceleration column,
    acceleration is that of velocity. They aren't smoothed: noise of amplitude e in position becomes e/Δt in
    velocity, so a coarse position needs a slower log or a velocity column. Position beside velocity and time
    checks the velocity, and shows where rows are missing.

    Parameters
    ----------
    log : CSV file
    columns : its columns, of which `require_columns` has nothing to say
    rotary : whether the axis turns, so that its unit is an angle

    Raises
    ------
    InputError
        The file can't be read or isn't a table with these columns; values aren't plausible in their units;
        time doesn't grow; more rows lack a number than don't. The message has line and column.
    """
    file = Path(log)
    content = read_input(file, MOST_PATH_BYTES, InputError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("isn't text in UTF-8; export it as CSV", file=file) from None
    dates = ("time",) if columns.time_unit == DATES else ()
    values, lines = read_columns(text, columns.named, file, dates=dates)
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
    values = _in_our_units(values, lines, columns, file, rotary=rotary)
    pieces = _pieces(values, lines, columns, file, rotary=rotary)
    speed, acceleration = _motion(values, lines, pieces, columns, file, rotary=rotary)
    read = AxisLog(
        file=str(log),
        source=f"{file.name} (sha256 {hashlib.sha256(content).hexdigest()})",
        speed=speed,
        acceleration=acceleration,
        power=values["power"],
        duration=np.full(len(lines), np.nan) if pieces is None else pieces.durations,
        dropped={"a cell without a number": lost} if lost else {},
        gaps={} if pieces is None else pieces.reasons,
    )
    alone = np.isnan(speed) if acceleration is None else np.isnan(speed) | np.isnan(acceleration)
    return read.without(alone, ALONE)


def require_motion(logs: AxisLog, columns: LogColumns, *, rotary: bool) -> None:
    """Raise if logs, joined, reach no speed or no power of a machine tool in the stated units."""
    column, unit = columns.speed_column
    require_large_enough("velocity", logs.speed, unit, rotary=rotary, column=column, files=logs.file)
    require_large_enough(
        columns.power_kind,
        logs.power / columns.watts,
        columns.power_unit,
        rotary=rotary,
        column=columns.power,
        files=logs.file,
    )


def _in_our_units(
    values: Mapping[str, Array], lines: IntArray, columns: LogColumns, file: Path, *, rotary: bool
) -> dict[str, Array]:
    """Convert the columns to mm, rad, s and W, and check that they are plausible."""
    ours = dict(values)
    for quantity, column in columns.named.items():
        unit = getattr(columns, f"{quantity}_unit")
        ours[quantity] = values[quantity] * require_unit(quantity, unit, rotary=rotary)
        if quantity == "time":
            continue
        kind = columns.power_kind if quantity == "power" else quantity
        require_plausible(kind, ours[quantity], unit, rotary=rotary, column=column, lines=lines, file=file)
    return ours | {"power": ours["power"] * columns.watts}


def _pieces(
    values: Mapping[str, Array], lines: IntArray, columns: LogColumns, file: Path, *, rotary: bool
) -> Pieces | None:
    """Split the log at its gaps; None if it has no time."""
    if "time" not in values:
        return None
    time = values["time"]
    if len(time) < 3:
        raise InputError(f"{len(time)} rows with numbers are too few to differentiate", file=file)
    if columns.time is not None:
        require_growing(time, lines, columns.time, file)
        require_plausible_step(float(np.median(np.diff(time))), str(columns.time_unit), columns.time, file)
    pieces = Pieces.of_time(time, columns.longest_step)
    if "position" in values and columns.velocity is not None:
        unit = str(columns.velocity_unit)
        return split_at_jumps(
            pieces, values["position"], values["velocity"], unit=unit, rotary=rotary, file=file
        )
    return pieces


def _motion(
    values: Mapping[str, Array],
    lines: IntArray,
    pieces: Pieces | None,
    columns: LogColumns,
    file: Path,
    *,
    rotary: bool,
) -> tuple[Array, Array | None]:
    """Return velocity and acceleration, derived where a column is missing; NaN for rows alone."""
    if pieces is None:
        return values["velocity"], values.get("acceleration")
    speed = values["velocity"] if "velocity" in values else pieces.derivative(values["position"])
    acceleration = values["acceleration"] if "acceleration" in values else pieces.derivative(speed)
    bad = np.flatnonzero((np.abs(speed) > LARGEST) | (np.abs(acceleration) > LARGEST))
    if len(bad):
        raise InputError(
            f"speed or acceleration is beyond {LARGEST:g}; correct position and time",
            file=file,
            line=int(lines[bad[0]]),
        )
    if "velocity" not in values:
        known, (column, unit) = np.isfinite(speed), columns.speed_column
        require_plausible(
            "velocity", speed[known], unit, rotary=rotary, column=column, lines=lines[known], file=file
        )
    return speed, acceleration
