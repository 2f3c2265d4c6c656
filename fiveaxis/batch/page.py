"""The page that compares jobs: a table to sort and filter, and energy against time; it works offline.

Text from files (names, messages, values of a sweep) is escaped, and the browser runs no script but the page's
own, which it knows by its hash.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from urllib.parse import quote

import numpy as np

from fiveaxis.batch.record import Row, Status
from fiveaxis.report.chart import BELOW, TOP, Panel, svg, widened
from fiveaxis.report.page import page_of
from fiveaxis.report.words import number

PAGES = {"report": "report.html", "preview": "preview.html"}
# Points: height of the plotting area, radius of a job's mark.
HEIGHT, RADIUS = 240.0, 4.5
# Characters from which on a cell has several lines.
LONG = 40
# Cell of a column: its text, and the number by which it is sorted, if it is one.
Cell = tuple[str, float | None]
Column = Callable[[Row], Cell]


def render_comparison(title: str, rows: Sequence[Row], below: str, columns: Mapping[str, Column]) -> str:
    """Return the text of a page that compares jobs.

    Parameters
    ----------
    title : of the page
    rows : of the jobs
    below : what the names of jobs begin with that their folders are below the page's: ``cup/`` for the page
        in the folder of the sweep ``cup``, empty in the folder of the batch
    columns : further ones, by their head, after the name
    """
    style, script, page = (_text(f"comparison.{kind}") for kind in ("css", "js", "html"))
    counts = {status: sum(row.status is status for row in rows) for status in Status}
    # What no job has would only push the rest out of sight.
    shown = {
        name: column for name, column in {**columns, **FIGURES}.items() if any(column(r)[0] for r in rows)
    }
    body = Template(page).substitute(
        title=escape(title),
        counts=", ".join(f"{count} {status}" for status, count in counts.items() if count),
        scatter=_scatter(rows, below),
        heads="".join(_head(name) for name in ("job", *PAGES, *shown)),
        rows="\n".join(_row(index, row, below, shown) for index, row in enumerate(rows)),
    )
    return page_of(title, style, script, body)


def _text(name: str) -> str:
    return files("fiveaxis.batch").joinpath(name).read_text(encoding="utf-8")


def _figure(attribute: str, digits: int = 0, factor: float = 1.0) -> Column:
    """Return a column of numbers; a number that isn't known is empty."""

    def cell(row: Row) -> Cell:
        value = getattr(row, attribute)
        return ("", None) if value is None else (number(factor * value, digits), value)

    return cell


FIGURES: Mapping[str, Column] = {
    "state": lambda row: (str(row.status), None),
    "energy (J)": _figure("energy"),
    "saved (%)": _figure("saved", 1, 100.0),
    "against": lambda row: (row.baseline, None),
    "time (s)": _figure("time", 1),
    "starts": _figure("starts"),
    "reversals": _figure("reversals"),
    "starts, baseline": _figure("baseline_starts"),
    "reversals, baseline": _figure("baseline_reversals"),
    "base load (J)": _figure("base"),
    "locations": _figure("locations"),
    "errors": _figure("errors"),
    "warnings": _figure("warnings"),
    "message": lambda row: (row.message, None),
}


def link(row: Row, page: str, below: str) -> str | None:
    """Return the address of a job's page relative to the comparison's; None where the job has none."""
    name = PAGES[page]
    return f"{quote(row.name.removeprefix(below))}/{name}" if name in row.files else None


def _head(name: str) -> str:
    if name in PAGES:
        return f'<th scope="col">{name}</th>'
    return f'<th scope="col"><button type="button">{escape(name)}</button></th>'


def _row(index: int, row: Row, below: str, columns: Mapping[str, Column]) -> str:
    name = escape(row.name.removeprefix(below))
    links = (_link_cell(row, page, below) for page in PAGES)
    cells = (_cell(*column(row)) for column in columns.values())
    fine = "ok" if row.status is Status.FINE else "failed"
    inside = f'<th scope="row">{name}</th>{"".join(links)}{"".join(cells)}'
    return f'<tr id="job-{index}" data-state="{fine}">{inside}</tr>'


def _cell(text: str, value: float | None) -> str:
    if value is not None:
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
