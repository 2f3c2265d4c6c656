"""Logs of the motion and power of one axis, from CSV files with any column names.

A row with an empty cell is dropped and counted. Time may step unevenly; steps far longer than the others are
gaps, and so are jumps of position: nothing is differentiated across them.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import io
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

from fiveaxis.base import MOST_PATH_BYTES, Array, BoolArray, InputError, IntArray, product, read_input
from fiveaxis.lab.calibration.log_columns import DATES, LogColumns

LARGEST = 1e16  # in any unit: no log has more, and the squares of fits would leave what a number can hold
EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none", "unavailable"})
MOST_LOST = 0.5  # share of dropped rows above which the columns are hardly the right ones
ALONE = "alone between gaps"
GAP = 10.0  # multiple of the median step above which rows are missing
FASTER = 1.5  # multiple of the log's highest speed; where a position changes faster, rows are missing too
FAST = 0.25  # share of the longest step: travel of shorter ones is often below a position's last digit


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

    @property
    def moving(self) -> BoolArray:
        """Rows in motion, (n,)."""
        return self.speed != 0.0

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


@dataclass(frozen=True, eq=False)
class Pieces:
    """Rows of a log, in pieces without gaps.

    Parameters
    ----------
    time : (n,), s
    broken : (n − 1,), steps that are gaps
    reasons : why steps are gaps → how many
    """

    time: Array
    broken: BoolArray
    reasons: Mapping[str, int]

    @classmethod
    def of_time(cls, time: Array, longest: float | None) -> Pieces:
        """Split where a step is longer than a bound, s; by default `GAP` median steps."""
        steps = np.diff(time)
        bound = GAP * float(np.median(steps)) if longest is None else longest
        broken = steps > bound
        reason = f"steps longer than {bound:.3g} s, {float(steps[broken].sum()):.4g} s in all"
        return cls(time, np.zeros(len(steps), dtype=bool), {}).split(broken, reason)

    def split(self, broken: BoolArray, reason: str) -> Pieces:
        """Split at more steps, (n − 1,)."""
        count = int((broken & ~self.broken).sum())
        return Pieces(
            self.time, self.broken | broken, dict(self.reasons) | ({reason: count} if count else {})
        )

    @property
    def durations(self) -> Array:
        """Time of each row, (n,) s: half of the steps on both sides; beside a gap, half a median step."""
        steps = np.diff(self.time)
        whole = steps[~self.broken]
        usual = float(np.median(whole if len(whole) else steps))
        inner = np.where(self.broken, usual, steps)
        return 0.5 * (np.concatenate([[usual], inner]) + np.concatenate([inner, [usual]]))

    def derivative(self, values: Array) -> Array:
        """Differentiate within pieces, (n,); NaN where a row stands alone between gaps.

        Central differences of second order for uneven steps, one-sided at the ends of a piece.
        """
        result = np.full(len(values), np.nan)
        ends = [0, *(np.flatnonzero(self.broken) + 1), len(values)]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for start, end in pairwise(ends):
                if end - start > 1:
                    result[start:end] = np.gradient(values[start:end], self.time[start:end])
        return result


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


def read_axis_log(log: str | Path, columns: LogColumns) -> AxisLog:
    """Read the motion and power of an axis.

    Without a velocity column, velocity is the derivative of position by time; without an acceleration column,
    acceleration is that of velocity. They aren't smoothed: noise of amplitude e in position becomes e/Δt in
    velocity, so a coarse position needs a slower log or a velocity column. Position beside velocity and time
    checks the velocity, and shows where rows are missing.

    Parameters
    ----------
    log : CSV file
    columns : its columns

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
    dates = ("time",) if columns.units.get("time") == DATES else ()
    values, lines = read_columns(text, columns.names, file, dates=dates)
    if columns.rate is not None:
        values["time"] = np.arange(len(lines)) / columns.rate
    whole = np.all([np.isfinite(v) for v in values.values()], axis=0)
    lost = int((~whole).sum())
    if lost > MOST_LOST * len(lines):
        worst = max(columns.names, key=lambda q: int(np.isnan(values[q]).sum()))
        raise InputError(
            f"{lost} of {len(lines)} rows lack a number, most in column {columns.names[worst]!r}; "
            f"name another column for {worst}, or clean the log",
            file=file,
        )
    values, lines = {q: v[whole] for q, v in values.items()}, lines[whole]
    for quantity in columns.names:
        values[quantity] = values[quantity] * columns.size(quantity)
        if quantity != "time":
            columns.require_plausible(quantity, values[quantity], lines, file)
    pieces = _pieces(values, lines, columns, file)
    speed, acceleration = _motion(values, lines, pieces, columns, file)
    read = AxisLog(
        file=str(log),
        source=f"{file.name} (sha256 {hashlib.sha256(content).hexdigest()})",
        speed=speed,
        acceleration=acceleration,
        power=values["power"] * columns.watts,
        duration=np.full(len(lines), np.nan) if pieces is None else pieces.durations,
        dropped={"a cell without a number": lost} if lost else {},
        gaps={} if pieces is None else pieces.reasons,
    )
    alone = np.isnan(speed) if acceleration is None else np.isnan(speed) | np.isnan(acceleration)
    return read.without(alone, ALONE)


def require_motion(logs: AxisLog, columns: LogColumns) -> None:
    """Raise if logs, joined, reach no speed or no power of a machine tool in the stated units."""
    columns.require_large_enough("velocity", logs.speed, logs.file)
    columns.require_large_enough("power", logs.power / columns.watts, logs.file)


def _pieces(values: Mapping[str, Array], lines: IntArray, columns: LogColumns, file: Path) -> Pieces | None:
    """Split the log at its gaps; None if it has no time."""
    if "time" not in values:
        return None
    time = values["time"]
    if len(time) < 3:
        raise InputError(f"{len(time)} rows with numbers are too few to differentiate", file=file)
    if "time" in columns.names:
        _require_growing(time, lines, columns.names["time"], file)
        columns.require_plausible_step(float(np.median(np.diff(time))), file)
    pieces = Pieces.of_time(time, columns.longest_step)
    if "position" in values and "velocity" in values:
        return _split_at_jumps(pieces, values["position"], values["velocity"], columns, file)
    return pieces


def _require_growing(time: Array, lines: IntArray, name: str, file: Path) -> None:
    """Raise if time, (n,) s, doesn't grow from row to row."""
    stuck = np.flatnonzero(np.diff(time) <= 0.0)
    if len(stuck):
        i = int(stuck[0])
        raise InputError(
            f"{name} goes from {time[i]:g} to {time[i + 1]:g} s; time must grow from row to row: sort the "
            "log, or split it where the clock was set",
            file=file,
            line=int(lines[i + 1]),
        )


def _split_at_jumps(pieces: Pieces, position: Array, speed: Array, columns: LogColumns, file: Path) -> Pieces:
    """Split where a position, mm or rad, changes faster than the log's highest speed.

    A column of the speed, mm/s or rad/s, is checked by it: `InputError` if they disagree.
    """
    least = np.radians(1.0) if columns.rotary else 1.0
    if np.ptp(position) < least and np.abs(speed).max() < least:
        return pieces  # a log of a standstill has noise only
    time = np.diff(pieces.time)
    travel, mean = np.diff(position), 0.5 * (speed[1:] + speed[:-1]) * time
    fast = ~pieces.broken & (np.abs(mean) > FAST * np.abs(mean[~pieces.broken]).max(initial=0.0))
    if not fast.any():
        return pieces
    # A rounded position changes by its last digit.
    finest = float(np.abs(travel[travel != 0.0]).min()) if travel.any() else 0.0
    jumps = ~pieces.broken & (np.abs(travel) > FASTER * np.abs(speed).max() * time + finest)
    # Where most steps are jumps the speed is too small throughout.
    whole = fast if (fast & jumps).sum() > 0.5 * fast.sum() else fast & ~jumps
    ratio = float(np.abs(travel[whole]).sum() / np.abs(mean[whole]).sum())
    columns.require_agreeing(ratio, file)
    if float(product(travel[whole], mean[whole])) < 0.0:
        raise InputError("position falls while velocity is positive; reverse the sign of one", file=file)
    return pieces.split(jumps, "jumps of position that the velocity doesn't explain")


def _motion(
    values: Mapping[str, Array], lines: IntArray, pieces: Pieces | None, columns: LogColumns, file: Path
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
        known = np.isfinite(speed)
        columns.require_plausible("velocity", speed[known], lines[known], file)
    return speed, acceleration


def read_columns(
    text: str, named: Mapping[str, str], file: Path, *, dates: Collection[str] = ()
) -> tuple[dict[str, Array], IntArray]:
    """Read the named columns of a CSV text.

    Parameters
    ----------
    text : of the file
    named : quantity → name of its column
    file : for messages
    dates : quantities whose cells are dates and times of ISO 8601, in place of numbers

    Returns
    -------
    columns : quantity → (n,), NaN for an empty cell; dates in s, from 1970
    lines : (n,), of the file, from 1

    Raises
    ------
    InputError
        The text isn't a table with these columns. The message has line and column.
    """
    first = next((line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"), "")
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
    if not rows:
        raise InputError("is empty; a line with the names of the columns is needed", file=file)
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
        quantity: np.array(
            [
                (_instant if quantity in dates else _number)(row[i], header[i], number, file)
                for number, row in rows[1:]
            ]
        )
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
        if _date(text) is not None:
            hint = "for dates and times the time unit is iso"
        raise InputError(f"{column} is {text!r}, not a number; {hint}", file=file, line=line) from None
    if math.isinf(value):
        raise InputError(f"{column} is infinite; correct it or leave it empty", file=file, line=line)
    if abs(value) > LARGEST:
        raise InputError(
            f"{column} is {value:g}, beyond {LARGEST:g}; correct it or leave it empty", file=file, line=line
        )
    return value


def _instant(cell: str, column: str, line: int, file: Path) -> float:
    text = cell.strip()
    if text.lower() in EMPTY:
        return math.nan
    date = _date(text)
    if date is None:
        raise InputError(
            f"{column} is {text!r}, not a date and time such as 2026-01-31T12:00:00.250Z; state another "
            "time unit, or correct it",
            file=file,
            line=line,
        )
    # Without a zone it is taken as UTC: only differences count, and local time jumps in spring.
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()


def _date(text: str) -> datetime | None:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        return None
