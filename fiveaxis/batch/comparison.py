"""A sweep's variants side by side."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fiveaxis.batch.ledger import own_folder
from fiveaxis.batch.record import Row
from fiveaxis.files import write_atomically
from fiveaxis.report.plots import Bar, comparison_figure

TABLE = "comparison.csv"
FIGURE = "comparison.svg"

FIGURES = {
    "status": "status",
    "energy_J": "energy",
    "travel_metric_J": "travel",
    "base_J": "base",
    "time_s": "time",
    "baseline": "baseline",
    "baseline_J": "baseline_energy",
    "saved": "saved",
}
AGAINST_FIRST = "against_first"


@dataclass(frozen=True)
class Comparison:
    """A sweep's variants side by side.

    Parameters
    ----------
    name : of the sweep
    keys : that it varies
    rows : of its variants, in its order
    files : table and figure
    """

    name: str
    keys: tuple[str, ...]
    rows: tuple[Row, ...]
    files: tuple[Path, ...] = ()

    def against_first(self, row: Row) -> float | None:
        """Give the share by which a variant's energy differs from the first one's; 0.1 is dearer."""
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
    """Write the table and the figure of a sweep into its folder.

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
    bars = [Bar(_variant(row), row.energy, row.baseline_energy, str(row.status)) for row in rows]
    baselines = sorted({row.baseline for row in rows if row.baseline})
    own = own_folder(folder, name)
    files = (
        write_atomically(own / TABLE, _table(compared)),
        write_atomically(own / FIGURE, comparison_figure(name, bars, " or ".join(baselines))),
    )
    return Comparison(name, keys, tuple(rows), files)


def _variant(row: Row) -> str:
    """Name a variant by what it sets."""
    return ", ".join(f"{key} {shown_value(value)}" for key, value in row.values.items())


def shown_value(value: Any) -> str:
    """Write a value for people."""
    if isinstance(value, str):
        return value
    return json.dumps(value, default=str).replace('"', "")


def _table(compared: Comparison) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["job", *compared.keys, *FIGURES, AGAINST_FIRST])
    for row in compared.rows:
        values = [shown_value(row.values[key]) for key in compared.keys]
        figures = [getattr(row, attribute) for attribute in FIGURES.values()]
        writer.writerow([row.name, *values, *figures, compared.against_first(row)])
    return text.getvalue()
