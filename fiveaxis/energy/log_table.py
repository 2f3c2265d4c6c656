"""Columns of a log, from a CSV file with any column names.

The first line names the columns, separated by commas, semicolons or tabs. Blank lines and lines that start
with ``#`` are skipped. An empty or NaN cell is NaN; text in place of a number is an error.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections.abc import Collection, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from fiveaxis.errors import InputError
from fiveaxis.geometry import Array, IntArray

LARGEST = 1e16  # in any unit: no log has more, and the squares of fits would leave what a number can hold
EMPTY = frozenset({"", "nan", "na", "n/a", "null", "none", "unavailable"})


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
