"""The table and the picture of a comparison of machines, on a page of their own."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.base import write_atomically
from fiveaxis.show import TOP, page_of, range_rows, scroll, svg, svg_file, table

if TYPE_CHECKING:
    from fiveaxis.job.batch.machines import Candidate

PAGE, PICTURE = "machines.html", "machines.svg"
HEADS = (
    *("machine", "place", "#s", "#J", "#from", "#to", "#with base", "#cost", "#CO2 (kg)", "travel"),
    *("to a limit", "#deg/s", "verdict"),
)


def cells(candidate: Candidate) -> list[str]:
    """Format the row of a candidate below `HEADS`; what isn't known is empty."""
    row, known = candidate.row, candidate.figures
    if candidate.energy is None or not known:
        return [candidate.machine, *[""] * (len(HEADS) - 2), str(row.status)]

    def shown(name: str, form: str) -> str:
        return "" if known.get(name) is None else format(known[name], form)

    place = known["place"]
    x, y, z = place["offset"]
    turn = place["rotation"][2]
    travel = {name.split("_")[1]: far for name, far in known.items() if name.endswith(("_mm", "_deg"))}
    ways = " ".join(f"{letter}{far:.0f}" for letter, far in travel.items())
    cost = f"{known['cost']:.3g} {known['currency']}" if known.get("cost") is not None else ""
    return [
        candidate.machine,
        f"X{x:g} Y{y:g} Z{z:g}" + (f" turned {turn:g} deg" if turn else ""),
        f"{row.time:.1f}",
        *(f"{joule:.0f}" for joule in (row.energy or 0.0, *candidate.energy)),
        shown("with_base_J", ".0f"),
        cost,
        shown("co2_kg", ".3g"),
        ways,
        f"{known['margin_axis'] or ''} {shown('margin', '.1f')} {known['margin_unit'] or ''}".strip(),
        f"{shown('largest_rotary_deg_s', '.0f')} {known['fastest_axis'] or ''}".strip(),
        str(row.status),
    ]


def write_machines(
    job: str, candidates: Sequence[Candidate], claims: Sequence[str], folder: Path
) -> tuple[Path, ...]:
    """Write the page of a comparison and its picture: the ranges of energy and time of each machine."""
    title = f"{job} on {len(candidates)} machines"
    chart = draw(candidates, title)
    words = "".join(f"<p>{escape(claim)}</p>" for claim in claims)
    reasons = [(c.machine, c.row.message) for c in candidates if c.row.message]
    body = (
        f"<h1>{escape(title)}</h1>\n{words}\n<figure>{chart}</figure>\n"
        + scroll(
            table(HEADS, [cells(c) for c in candidates], "Machines, cheapest first; travel in mm and deg")
        )
        + (
            scroll(table(("machine", "why not"), reasons, "Machines without a released program"))
            if reasons
            else ""
        )
    )
    style = files("fiveaxis.job.batch").joinpath("comparison.css").read_text(encoding="utf-8")
    return (
        write_atomically(folder / PAGE, page_of(title, style, "", body)),
        write_atomically(folder / PICTURE, svg_file(chart)),
    )


def draw(candidates: Sequence[Candidate], title: str) -> str:
    """Draw the ranges of energy, without and with base power, time and cost, of machines with a program."""
    able = [c for c in candidates if c.energy is not None]
    names, parts, top = [c.machine for c in able], list[str](), TOP
    panels = {
        "energy of the feed drives (J)": [c.energy for c in able],
        "energy with base power (J); open: the base power isn't known": [c.with_base for c in able],
        "time (s); open: accelerations aren't known": [c.time for c in able],
    }
    if any(c.cost for c in able):
        panels[f"cost ({able[0].factors.currency}); open: energy or time isn't known"] = [
            c.cost for c in able
        ]
    for label, ranges in panels.items() if able else ():
        drawn, bottom = range_rows(top, names, ranges, label)
        parts += drawn
        top = bottom + TOP
    return svg(top, parts, title)
