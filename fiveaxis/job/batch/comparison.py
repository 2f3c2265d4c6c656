"""Compare the jobs of a batch on a page, and the variants of a sweep also by a table and a figure.

The page has a table to sort and filter, and energy against time; it works offline. Text from files (names,
messages, values of a sweep) is escaped, and the browser runs no script but the page's own, which it knows by
its hash.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import numpy as np

from fiveaxis.base import csv_text, write_atomically
from fiveaxis.job.batch.ledger import own_folder
from fiveaxis.job.batch.record import COLUMNS, Column, Row, Status
from fiveaxis.posture import RESULT
from fiveaxis.show import (
    AFTER,
    BEFORE,
    BELOW,
    TOP,
    Panel,
    bar_rows,
    heading,
    number,
    page_of,
    svg,
    svg_file,
    widened,
)

TABLE = "comparison.csv"
FIGURE = "comparison.svg"
PAGE = "comparison.html"
# Of the whole batch.
RESULTS = "results.html"

# Columns of a variant's figures, and of the page.
FIGURES = (
    *("status", "energy_J", "travel_metric_J", "base_J", "time_s", "starts", "reversals"),
    *("baseline", "baseline_J", "saved", "baseline_starts", "baseline_reversals"),
)
SHOWN = (
    *("status", "energy_J", "saved", "baseline", "time_s", "starts", "reversals", "baseline_starts"),
    *("baseline_reversals", "base_J", "locations", "errors", "warnings", "message"),
)
AGAINST_FIRST = "against_first"
PAGES = {"report": "report.html", "preview": "preview.html"}
# Points: height of the plotting area, radius of a job's mark.
HEIGHT, RADIUS = 240.0, 4.5
# Bars of the figure; more aren't legible, and the table beside it has them all.
MOST_BARS = 60
# Characters from which on a cell has several lines.
LONG = 40


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

    @property
    def columns(self) -> dict[str, Column]:
        """Columns of the table by name, after the job: keys, figures, and the share against the first."""
        values = {key: Column(_value_of(key), key) for key in self.keys}
        against = Column(self.against_first, "against the first (%)", 1, 100.0, signed=True)
        return values | {name: COLUMNS[name] for name in FIGURES} | {AGAINST_FIRST: against}

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data for JSON."""
        variants = [
            {"job": row.name, "values": dict(row.values), AGAINST_FIRST: self.against_first(row)}
            | {name: COLUMNS[name].value(row) for name in FIGURES}
            for row in self.rows
        ]
        return {"sweep": self.name, "keys": list(self.keys), "variants": variants}


def write_comparison(name: str, rows: Sequence[Row], folder: Path) -> Comparison:
    """Write the page, the table and the figure of a sweep, whose variants have rows, into its folder."""
    keys = tuple(dict.fromkeys(key for row in rows for key in row.values))
    compared = Comparison(name, keys, tuple(rows))
    own = own_folder(folder, name)
    own_columns = [column for name, column in compared.columns.items() if name not in FIGURES]
    page = render_comparison(f"Sweep {name}", rows, f"{name}/", own_columns)
    files = (
        write_atomically(own / PAGE, page),
        write_atomically(own / TABLE, _table(compared)),
        write_atomically(own / FIGURE, draw_variants(name, rows)),
    )
    return replace(compared, files=files)


def write_page(rows: Sequence[Row], folder: Path) -> Path:
    """Write the page that compares all jobs into the folder of the batch."""
    return write_atomically(folder / RESULTS, render_comparison("Jobs of the batch", rows, "", ()))


def _value_of(key: str) -> Callable[[Row], Any]:
    return lambda row: row.values[key]


def format_value(value: Any) -> str:
    """Format a value of a sweep for display."""
    if isinstance(value, str):
        return value
    return json.dumps(value, default=str).replace('"', "")


def draw_variants(name: str, rows: Sequence[Row]) -> str:
    """Draw the energy of a sweep's variants beside their baseline as the text of an SVG file.

    Of more than `MOST_BARS` the first are drawn, and the title says so.
    """
    baseline = " or ".join(sorted({row.baseline for row in rows if row.baseline}))
    cut = "" if len(rows) <= MOST_BARS else f", the first {MOST_BARS} of {len(rows)}"
    shown = rows[:MOST_BARS]
    bars = {AFTER: [row.energy or 0.0 for row in shown]}
    if baseline:
        bars[BEFORE] = [row.baseline_energy or 0.0 for row in shown]
    labels = [str(row.status) if row.energy is None else f"{number(row.energy)} J" for row in shown]
    x_label = "energy of the feed drives, no base load (J)"
    names = [", ".join(f"{key} {format_value(v)}" for key, v in row.values.items()) for row in shown]
    parts, height = bar_rows(TOP, names, bars, labels, x_label)
    colours = {RESULT: AFTER} | ({baseline: BEFORE} if baseline else {})
    return svg_file(svg(height, [heading(colours, f"{name}{cut}"), *parts], name))


def _table(compared: Comparison) -> str:
    columns = compared.columns
    rows = [
        [row.name, *(format_value(row.values[key]) for key in compared.keys)]
        + [column.value(row) for name, column in columns.items() if name not in compared.keys]
        for row in compared.rows
    ]
    return csv_text([["job", *columns], *rows])


def render_comparison(title: str, rows: Sequence[Row], below: str, columns: Sequence[Column]) -> str:
    """Return the text of a page that compares jobs, with further columns after their names.

    Their folders are below the page's: names lose ``cup/`` (`below`) on the page of the sweep ``cup``.
    """
    folder = files("fiveaxis.job.batch")
    style, script, page = (
        folder.joinpath(f"comparison.{kind}").read_text(encoding="utf-8") for kind in ("css", "js", "html")
    )
    counts = {status: sum(row.status is status for row in rows) for status in Status}
    # What no job has would only push the rest out of sight.
    shown = [
        column
        for column in (*columns, *(COLUMNS[name] for name in SHOWN))
        if any(_text_of(column, row) for row in rows)
    ]
    body = Template(page).substitute(
        title=escape(title),
        counts=", ".join(f"{count} {status}" for status, count in counts.items() if count),
        scatter=_scatter(rows, below),
        heads="".join(_head(name) for name in ("job", *PAGES, *(column.heading for column in shown))),
        rows="\n".join(_row(index, row, below, shown) for index, row in enumerate(rows)),
    )
    return page_of(title, style, script, body)


def _text_of(column: Column, row: Row) -> str:
    """Format a cell of the page; what isn't known is empty."""
    value = column.value(row)
    if value is None or column.digits is None:
        return "" if value is None else format_value(value)
    return number(column.factor * value, column.digits, signed=column.signed)


def link(row: Row, page: str, below: str) -> str | None:
    """Return the address of a job's page relative to the comparison's; None where the job has none."""
    name = PAGES[page]
    return f"{quote(row.name.removeprefix(below))}/{name}" if name in row.files else None


def _head(name: str) -> str:
    if name in PAGES:
        return f'<th scope="col">{name}</th>'
    return f'<th scope="col"><button type="button">{escape(name)}</button></th>'


def _row(index: int, row: Row, below: str, columns: Sequence[Column]) -> str:
    name = escape(row.name.removeprefix(below))
    links = (_link_cell(row, page, below) for page in PAGES)
    cells = (_cell(_text_of(column, row), column.value(row)) for column in columns)
    fine = "ok" if row.status is Status.FINE else "failed"
    inside = f'<th scope="row">{name}</th>{"".join(links)}{"".join(cells)}'
    return f'<tr id="job-{index}" data-state="{fine}">{inside}</tr>'


def _cell(text: str, value: Any) -> str:
    """Return a cell; the browser sorts numbers by their values."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if is_number:
        return f'<td class="number" data-value="{value!r}">{escape(text)}</td>'
    look = ' class="long"' if len(text) > LONG else ""
    return f"<td{look}>{escape(text)}</td>"


def _link_cell(row: Row, page: str, below: str) -> str:
    address = link(row, page, below)
    if address is None:
        return "<td></td>"
    return f'<td><a href="{escape(address)}" aria-label="{page} of {escape(row.name)}">{page}</a></td>'


def _scatter(rows: Sequence[Row], below: str) -> str:
    """Draw energy against time, one mark per job that has both; each leads to the job's report."""
    drawn = [(i, row) for i, row in enumerate(rows) if row.energy is not None and row.time is not None]
    if not drawn:
        return "<p>No job has an energy to be drawn.</p>"
    spent = {key: np.array([getattr(row, key) for _, row in drawn]) for key in ("time", "energy")}
    panel = Panel(TOP, HEIGHT, widened(spent["time"]), widened(spent["energy"]))
    frame = panel.frame("energy (J)", "time of the program (s)")
    places = zip(panel.across(spent["time"]), panel.down(spent["energy"]), strict=True)
    marks = [_mark(i, row, float(x), float(y), below) for (i, row), (x, y) in zip(drawn, places, strict=True)]
    left = len(rows) - len(drawn)
    rest = f" {left} {'job has' if left == 1 else 'jobs have'} no energy and no mark." if left else ""
    return (
        f'<figure><div class="scroll">{svg(TOP + HEIGHT + BELOW, [frame, *marks])}</div>\n'
        "<figcaption>Energy against time. "
        f"A disc is a job whose program was released, a diamond one with errors.{rest}</figcaption></figure>"
    )


def _mark(index: int, row: Row, x: float, y: float, below: str) -> str:
    words = escape(", ".join(_facts(row, below)))
    fine, side = row.status is Status.FINE, 1.6 * RADIUS
    shape = (
        f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{RADIUS}"/>'
        if fine
        else f'<rect x="{x - side / 2:.2f}" y="{y - side / 2:.2f}" width="{side:g}" height="{side:g}" '
        f'transform="rotate(45 {x:.2f} {y:.2f})"/>'
    )
    look = "ok" if fine else "failed"
    address = link(row, "report", below)
    where = "" if address is None else f' href="{escape(address)}"'
    return (
        f'<a class="mark {look}" data-job="job-{index}" data-words="{words}" aria-label="{words}"{where}>'
        f"{shape}</a>"
    )


def _facts(row: Row, below: str) -> Iterator[str]:
    yield row.name.removeprefix(below)
    yield str(row.status)
    yield f"{number(row.energy)} J"
    yield f"{number(row.time, 1)} s"
