"""Compare the jobs of a batch on a page, and the variants of a sweep also by a table and a figure."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fiveaxis.batch.ledger import COLUMNS, own_folder
from fiveaxis.batch.page import Cell, Column, render_comparison
from fiveaxis.batch.record import Row
from fiveaxis.files import csv_text, write_atomically
from fiveaxis.report.plots import Bar, comparison_figure
from fiveaxis.report.words import number

TABLE = "comparison.csv"
FIGURE = "comparison.svg"
PAGE = "comparison.html"
# Of the whole batch.
RESULTS = "results.html"

# Columns of a variant's figures, as in the table of the batch.
_NAMES = (
    *("status", "energy_J", "travel_metric_J", "base_J", "time_s", "starts", "reversals"),
    *("baseline", "baseline_J", "saved", "baseline_starts", "baseline_reversals"),
)
FIGURES = {name: COLUMNS[name] for name in _NAMES}
AGAINST_FIRST = "against_first"


@dataclass(frozen=True)
class Comparison:
    """The variants of a sweep side by side.

    Parameters
    ----------
    name : of the sweep
    keys : that it varies
    rows : of its variants, in its order
    files : page, table and figure
    """

    name: str
    keys: tuple[str, ...]
    rows: tuple[Row, ...]
    files: tuple[Path, ...] = ()

    def against_first(self, row: Row) -> float | None:
        """Compute the share by which a variant's energy differs from the first one's; 0.1 is 10 % more."""
        first = self.rows[0].energy
        return None if row.energy is None or not first else row.energy / first - 1.0

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data for JSON."""
        variants = [
            {"job": row.name, "values": dict(row.values), AGAINST_FIRST: self.against_first(row)}
            | {key: getattr(row, attribute) for key, attribute in FIGURES.items()}
            for row in self.rows
        ]
        return {"sweep": self.name, "keys": list(self.keys), "variants": variants}


def write_comparison(name: str, rows: Sequence[Row], folder: Path) -> Comparison:
    """Write the page, the table and the figure of a sweep into its folder.

    Parameters
    ----------
    name : of the sweep
    rows : of its variants, in its order
    folder : of the batch

    Raises
    ------
    SettingError
        They can't be written.
    """
    keys = tuple(dict.fromkeys(key for row in rows for key in row.values))
    compared = Comparison(name, keys, tuple(rows))
    bars = [Bar(_name(row), row.energy, row.baseline_energy, str(row.status)) for row in rows]
    baselines = sorted({row.baseline for row in rows if row.baseline})
    own = own_folder(folder, name)
    columns = {key: _column(key) for key in keys} | {"against the first (%)": _against(compared)}
    page = render_comparison(f"Sweep {name}", rows, f"{name}/", columns)
    files = (
        write_atomically(own / PAGE, page),
        write_atomically(own / TABLE, _table(compared)),
        write_atomically(own / FIGURE, comparison_figure(name, bars, " or ".join(baselines))),
    )
    return replace(compared, files=files)


def write_page(rows: Sequence[Row], folder: Path) -> Path:
    """Write the page that compares all jobs into the folder of the batch.

    Raises
    ------
    SettingError
        It can't be written.
    """
    return write_atomically(folder / RESULTS, render_comparison("Jobs of the batch", rows, "", {}))


def _column(key: str) -> Column:
    """Return the column of a value that a sweep sets."""

    def cell(row: Row) -> Cell:
        value = row.values[key]
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        return format_value(value), value if is_number else None

    return cell


def _against(compared: Comparison) -> Column:
    def cell(row: Row) -> Cell:
        share = compared.against_first(row)
        return ("", None) if share is None else (number(100.0 * share, 1, signed=True), share)

    return cell


def _name(row: Row) -> str:
    """Name a variant by the values it sets."""
    return ", ".join(f"{key} {format_value(value)}" for key, value in row.values.items())


def format_value(value: Any) -> str:
    """Format a value of a sweep for display."""
    if isinstance(value, str):
        return value
    return json.dumps(value, default=str).replace('"', "")


def _table(compared: Comparison) -> str:
    rows: list[list[object]] = [["job", *compared.keys, *FIGURES, AGAINST_FIRST]]
    for row in compared.rows:
        values = [format_value(row.values[key]) for key in compared.keys]
        figures = [getattr(row, attribute) for attribute in FIGURES.values()]
        rows.append([row.name, *values, *figures, compared.against_first(row)])
    return csv_text(rows)
