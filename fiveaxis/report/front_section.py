"""The solutions between the cheapest path and the steadiest one, on the page."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from fiveaxis.report.canvas import AFTER
from fiveaxis.report.chart import BELOW, LEFT, TOP, Panel, svg, text, widened
from fiveaxis.report.tables import number, table


def front_section(front: Mapping[str, Any] | None) -> str:
    """List and draw the solutions of a front; nothing where none was asked for.

    Parameters
    ----------
    front : ``points`` with their figures, ``picked`` and ``dominated``, as plain data
    """
    if front is None:
        return ""
    heads = (
        "#number",
        "#energy (J)",
        "#bends Σ‖Δρ‖² (rad²)",
        "#largest turn (deg/mm)",
        "#program (s)",
        "NC program",
    )
    rows = [
        (
            str(point["number"]),
            number(point["energy_J"], 1),
            number(point["bend_rad2"], 4),
            number(point["steepest_deg_mm"], 2),
            number(point["program_time_s"], 1),
            "released" if point["released"] else "kept back, see its report",
        )
        for point in front["points"]
    ]
    said = (
        f"Number {front['picked']} is the result of this page. Each has its files in front/<number>, and "
        f"passed through the same verification. Solutions that one of these beats in everything are left "
        f"out: {front['dominated']}."
    )
    return (
        "<section>\n<h2>Energy against steadiness</h2>\n"
        f'<div class="scroll">\n{table(heads, rows)}\n</div>\n<p>{escape(said)}</p>\n'
        f"<figure>\n{_drawn(front)}\n<figcaption>What steadiness costs: each solution by its number; feed "
        "drives only.</figcaption>\n</figure>\n</section>"
    )


def _drawn(front: Mapping[str, Any]) -> str:
    bend, energy = (np.array([point[k] for point in front["points"]]) for k in ("bend_rad2", "energy_J"))
    panel = Panel(TOP, 150.0, widened(bend), widened(energy, margin=0.1))
    parts = [
        text("What steadiness costs", LEFT, 12.0, bold=True),
        panel.frame("travel metric (J)", "bends Σ‖Δρ‖² (rad²)"),
        panel.line(bend, energy, AFTER, 1.0),
    ]
    for point, x, y in zip(front["points"], panel.across(bend), panel.down(energy), strict=True):
        size = 5.0 if point["number"] == front["picked"] else 3.0
        parts.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{size:g}" fill="{AFTER}"/>')
        parts.append(text(str(point["number"]), x + 6.0, y - 5.0))
    return svg(panel.bottom + BELOW, parts)
