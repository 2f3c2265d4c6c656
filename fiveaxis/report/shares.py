"""Charts of shares: what limits the speed along the path, and where on its edge the cutter cuts, as SVG."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fiveaxis.motion.time_law import INSTANT
from fiveaxis.posture import Solution
from fiveaxis.report.chart import (
    AFTER,
    BEFORE,
    BELOW,
    GRID,
    LEFT,
    RIGHT,
    TOP,
    WIDTH,
    Panel,
    heading,
    legend,
    svg,
    text,
)
from fiveaxis.report.figures import LOCATION_LABEL, along, band, series_of, shifts
from fiveaxis.toolpath.edge import EdgeUse

# Pieces of a strip along the path; colours of the causes that take longest (Okabe & Ito).
STRIP_PIECES = 400
CAUSE_COLOURS = ("#56B4E9", "#D55E00", "#F0E442", "#009E73", "#CC79A7", "#0072B2", "#E69F00")


def limit_strips(solution: Solution, baseline: str | None) -> str:
    """Draw along the path for which share of its time each cause limits the speed, one strip per program."""
    runs = {name: solution.limiting(name) for name in series_of(solution, baseline)}
    totals = dict(sum((Counter(run.by_cause) for run in runs.values()), Counter()).most_common())
    shown = list(totals)[: len(CAUSE_COLOURS)]
    colours = dict(zip(shown, CAUSE_COLOURS, strict=False)) | (
        {"others": GRID} if totals.keys() - shown else {}
    )
    parts = [text("What limits the speed along the path, as a share of the time", LEFT, 12.0, bold=True)]
    for k, (name, run) in enumerate(runs.items()):
        panel = band(k, along(solution), (0.0, 1.0))
        last = k == len(runs) - 1
        drawn = [
            panel.frame(name, LOCATION_LABEL if last else "", y_ticks={0.0: "0", 1.0: "100 %"}, grid=False)
        ]
        n = len(run.time)
        starts = np.unique(np.linspace(0, n, min(n, STRIP_PIECES), endpoint=False).astype(np.int64))
        spent = np.add.reduceat(run.time, starts, axis=0)
        shares = spent / np.maximum(spent.sum(axis=1, keepdims=True), INSTANT)
        edges = np.append(starts, n) * ((len(solution.toolpath) - 1) / n)
        columns = [shares[:, run.causes.index(cause)] for cause in shown]
        tops = np.cumsum([*columns, np.maximum(1.0 - sum(columns, np.zeros(len(starts))), 0.0)], axis=0)
        tops *= spent.sum(axis=1) > 0.0
        for low, high, colour in zip(np.vstack([0.0 * tops[:1], tops]), tops, colours.values(), strict=False):
            drawn.append(panel.area(edges, low, high, colour))
        parts.append(panel.group(name, drawn))
    names = list(colours.items())
    for row, few in enumerate((names[:4], names[4:])):
        parts.append(legend(dict(few), WIDTH - RIGHT, panel.bottom + BELOW + 8.0 + 13.0 * row))
    words = f"Chart: what limits the speed along the path, {' and '.join(runs)}"
    return svg(panel.bottom + BELOW + 26.0, parts, words)


def edge_bars(use: EdgeUse, programs: Sequence[str]) -> str:
    """Draw the length of cut by contact angle, with effective diameter and speed of the edge below.

    Parameters
    ----------
    programs : that are shown; the last is the result
    """
    colours = dict(zip(reversed(programs), (AFTER, BEFORE), strict=False))
    angles = np.degrees(use.edges)
    most = max(float(use.lengths[name].max(initial=0.0)) for name in programs)
    # Words about the last angle stand half beyond the panel.
    width = WIDTH - LEFT - RIGHT - 24.0
    panel = Panel(TOP, 140.0, (angles[0], angles[-1]), (0.0, 1.05 * most or 1.0), width)
    # No more words than have room beside each other.
    kept = range(0, len(angles), -(-len(angles) // 8))
    figures = [(angles, "°"), (use.diameters, " mm")]
    figures += [] if use.speeds is None else [(60e-3 * use.speeds, " m/min")]
    label = "angle to the normal; effective diameter" + ("" if use.speeds is None else "; speed of the edge")
    parts = [
        heading({name: colours[name] for name in programs}, "Length of cut by contact angle"),
        panel.frame("length (mm)", x_ticks={}),
    ]
    for line, (values, unit) in enumerate(figures):
        below = panel.bottom + 12.0 * (line + 1)
        parts += [
            text(f"{values[k]:.3g}{unit}", float(panel.across(angles[k])), below, anchor="middle")
            for k in kept
        ]
    below = panel.bottom + 12.0 * len(figures) + 15.0
    parts.append(text(label, LEFT + 0.5 * panel.width, below, anchor="middle"))
    width = (angles[1] - angles[0]) / (len(programs) + 0.2)
    middles = 0.5 * (angles[1:] + angles[:-1])
    for name, shift in zip(programs, shifts(len(programs)), strict=True):
        ends = middles + shift / 0.8 * len(programs) * width - 0.5 * width
        parts += [
            panel.span((end, end + width), (0.0, float(length)), colours[name])
            for end, length in zip(ends, use.lengths[name], strict=True)
            if length > 0.0
        ]
    return svg(below + 8.0, parts, f"Bar chart: length of cut by contact angle, {' and '.join(programs)}")
