"""Sections of the page: the answers, the program, the searched setup, the front, and shares as charts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from html import escape
from itertools import groupby

import numpy as np

from fiveaxis.model import INSTANT, EdgeUse
from fiveaxis.posture import RESULT, Optimum
from fiveaxis.show.report.chart import (
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
from fiveaxis.show.report.document import ReportDocument
from fiveaxis.show.report.facts import FrontPrograms, ProgramFigures, SetupSearched, TriedSetup
from fiveaxis.show.report.figures import LOCATION_LABEL, along, band, front_chart, series_of, shifts
from fiveaxis.show.report.questions import Answer
from fiveaxis.show.report.tables import NOTHING, kinds_table, saved_table, scroll, table
from fiveaxis.show.report.words import THIN_SPACE, number, plain, plain_list, saving

# Pieces of a strip along the path; colours of the causes that take longest (Okabe & Ito).
STRIP_PIECES = 400
CAUSE_COLOURS = ("#56B4E9", "#D55E00", "#F0E442", "#009E73", "#CC79A7", "#0072B2", "#E69F00")
MOST_SHOWN = 15  # rows of the table of setups; the JSON report has all
UNITS = {"x": "mm", "y": "mm", "z": "mm", "angle": "deg"}


# What stands before the answer to the first question, for readers who see no colour.
SIGNS = {"safe": "✓", "partial": "!", "unknown": "?", "unsafe": "✗", "overridden": "✗"}


def answers_section(document: ReportDocument) -> str:
    """Write the three answers, each with its details below it, and the savings against every baseline."""
    found = document.answers
    compared = "" if document.baseline is None else scroll(saved_table(document))
    return "\n".join(
        (
            _answer(found.safe, f"verdict {found.verdict}", SIGNS[found.verdict]),
            _answer(found.saved, "saved", below=compared),
            _answer(found.next, "next"),
        )
    )


def _answer(answer: Answer, look: str, sign: str = "", below: str = "") -> str:
    mark = f'<span aria-hidden="true">{sign}</span> ' if sign else ""
    rows = []
    for about, details in groupby(answer.details, lambda detail: detail.about):
        texts = "".join(f"<dd>{escape(detail.text)}</dd>" for detail in details)
        rows.append(f"<div><dt>{escape(about)}</dt>{texts}</div>")
    listed = "<dl>\n" + "\n".join(rows) + "\n</dl>\n" if rows else ""
    if answer.folded:
        abouts = ", ".join(dict.fromkeys(detail.about.lower() for detail in answer.folded)).capitalize()
        items = "".join(f"<li>{escape(f'{about}: {text}')}</li>" for about, text in answer.folded)
        listed += f"<details><summary>{escape(abouts)} ({len(answer.folded)})</summary>"
        listed += f"<ul>{items}</ul></details>\n"
    return (
        f'<section class="answer {look}">\n<h2>{escape(answer.question)}</h2>\n'
        f'<p class="headline">{mark}{escape(answer.text)}</p>\n{listed}{below}</section>'
    )


def program_section(document: ReportDocument) -> str:
    """Describe the program's blocks and the cost of its kinds of move; empty without a program."""
    program = document.program
    if program is None:
        return ""
    text = (
        f"The program has {number(program.blocks)} blocks for {number(program.blocks_before)} locations. "
        f"{_path_shape(document)} To keep the tool on its path between locations, "
        f"{_blocks(program.inserted)} inserted (tolerance {program.path_tolerance_mm:g} mm); their postures "
        f"were optimised too. {_removed(program)} All figures are those of whole programs with their "
        "inserted blocks, without approach and retract."
    )
    if program.energy is not None:
        text += f" With these, the words of the program cost {number(program.energy.total)} J"
        text += f" ({program.energy.band})." if program.energy.band else "."
    html = f"<p>{escape(text)}</p>\n"
    if kinds := kinds_table(document):
        html += scroll(kinds)
    return html


def _path_shape(document: ReportDocument) -> str:
    curved = document.curved_moves
    if document.solution.toolpath.shape == "chord":
        return "The path goes straight from location to location."
    if not curved:
        return "No locations tell a smooth curve, so the path goes straight from one to the next."
    moves = "move follows" if curved == 1 else "moves follow"
    return f"{number(curved)} {moves} a smooth curve through the locations; the others are straight."


def _removed(program: ProgramFigures) -> str:
    if program.redundant_kept_for:
        return f"Redundant blocks were kept; without them: {', '.join(program.redundant_kept_for)}."
    if not program.removed:
        return "No block was redundant."
    return (
        f"{_blocks(program.removed, 'redundant ')} removed: without them the axes keep that tolerance, and "
        f"the tool’s axis within {program.axis_tolerance_deg:g}°. The remaining motion was "
        "verified."
    )


def _blocks(count: int, which: str = "") -> str:
    return f"{number(count)} {which}{'block was' if count == 1 else 'blocks were'}"


def setup_section(found: SetupSearched | None) -> str:
    """Compare the chosen setup with the given one; empty if none was searched for."""
    if found is None:
        return ""
    shown = found.tried[:MOST_SHOWN]
    text = f"{_setup_verdict(found)} {_setup_search(found, len(shown))}"
    heads = (
        "offset X, Y, Z (mm)",
        "rotation X, Y, Z (deg)",
        "#thinned path (J)",
        "#kept clear (J)",
        "#whole path (J)",
        "",
    )
    rows = [_setup_row(tried, found) for tried in shown]
    inner = f"<p>{escape(text)}</p>\n{scroll(table(heads, rows, 'Setups, cheapest first'))}"
    return f"<section>\n<h2>Setup of the workpiece</h2>\n{inner}\n</section>"


def _setup_verdict(found: SetupSearched) -> str:
    given, chosen = found.given, found.chosen
    if _format_setup(given) == _format_setup(chosen):
        return (
            f"No setup within the ranges was found that saves more than {100.0 * found.least_saving:.2f}"
            f"{THIN_SPACE}% against the given one; it was kept. A smaller saving isn’t significant: searches "
            "of one path end in different optima."
        )
    before = "which can’t be followed" if given.energy is None else f"with {number(given.energy)} J"
    share = "" if found.saved is None else f": {saving(found.saved)} (feed drives only)"
    return (
        f"Set the workpiece’s zero at {_format_setup(chosen)}. The path costs {number(chosen.energy)} J "
        f"there, in place of the given setup at {_format_setup(given)}, {before}{share}. All figures of this "
        "report are for the chosen setup."
    )


def _setup_search(found: SetupSearched, shown: int) -> str:
    ranges = ", ".join(
        f"{name} {plain(low)}…{plain(high)} {UNITS[name]}" for name, (low, high) in found.ranges.items()
    )
    clear = sum(tried.kept_clear is not None for tried in found.tried)
    again = f"The cheapest were evaluated again, clear of part, stock and fixtures: {clear} are feasible. "
    return (
        f"Ranges: {ranges}. {len(found.tried)} setups were evaluated at some of the path’s locations, "
        f"each with its own postures and without obstacles; the cheapest {shown} are shown. "
        f"{again if found.keeps_clear else ''}Those with a figure for the whole path were run and "
        "verified in full."
    )


def _setup_row(tried: TriedSetup, found: SetupSearched) -> list[str]:
    named = {"given": found.given, "chosen": found.chosen}
    names = [name for name, setup in named.items() if _format_setup(tried) == _format_setup(setup)]
    remark = "; ".join([*names, *([tried.why] if tried.why else [])])
    costs = (NOTHING if c is None else number(c) for c in (tried.rough, tried.kept_clear, tried.energy))
    return [plain_list(tried.offset), plain_list(tried.rotation_deg), *costs, remark]


def _format_setup(tried: TriedSetup) -> str:
    return f"({plain_list(tried.offset)}) mm, turned by ({plain_list(tried.rotation_deg)}) deg"


def edge_section(document: ReportDocument) -> str:
    """Draw where on its edge the cutter cuts; empty where that wasn't asked for."""
    use = document.edge_use
    if use is None:
        return ""
    shown = [name for name in (document.baseline, RESULT) if name is not None]
    known = "" if use.speeds is None else f", and its speed at {use.spindle_rpm:.6g} rev/min"
    words = [
        f"Length of cut by the angle between tool axis and surface normal{known}. At 0° the tip cuts, which "
        "stands still; length spread over many angles wears the edge evenly."
    ]
    low, high = (f"{math.degrees(end):.3g}" for end in use.range)
    words += [
        f"{name}: {use.peaks[name]:.0%} on one band of 5°, {math.degrees(use.unevenness[name]):.1f}° on "
        f"average from even use of {low} to {high}°."
        for name in shown
    ]
    words += [
        f"The contact of {number(use.unknown[name], 1)} mm of {name} isn’t known."
        for name in shown
        if use.unknown[name] > 0.0
    ]
    caption = f"<figcaption>{escape(' '.join(words))}</figcaption>"
    return (
        "<section>\n<h2>Where on its edge the cutter cuts</h2>\n"
        f"<figure>\n{edge_bars(use, shown)}\n{caption}\n</figure>\n</section>"
    )


def front_section(front: FrontPrograms | None) -> str:
    """List and draw the solutions of a front; empty without a front."""
    if front is None:
        return ""
    based = front.with_base
    slower = any(each.point.slowest < 1.0 for each in front.points)
    heads = (
        "#number",
        "#energy (J)",
        *["#with base power (J)"] * based,
        "#program (s)",
        "#bends Σ‖Δρ‖² (rad²)",
        "#largest turn (deg/mm)",
        *["#least share of the feed"] * slower,
        "NC program",
    )
    rows = [
        (
            str(each.number),
            number(each.point.energy.total, 1),
            *[number(each.point.energy.with_base, 1)] * based,
            number(each.point.energy.time, 1),
            number(each.point.bend, 4),
            number(math.degrees(each.point.steepest), 2),
            *[number(each.point.slowest, 2)] * slower,
            "released" if each.released else "kept back, see its report",
        )
        for each in front.points
    ]
    text = (
        f"Number {front.picked} is the optimised program of this page. Each has its files in front/<number> "
        "and underwent the same verification. Dominated solutions, which one of these beats in every figure, "
        f"and programs that were kept back are left out: {front.dominated}."
    )
    return (
        f"<section>\n<h2>Energy against {front.costs}</h2>\n"
        f"{scroll(table(heads, rows, 'Solutions of the front'))}\n<p>{escape(text)}</p>\n"
        f"<figure>\n{front_chart(front)}\n<figcaption>What {front.costs} costs: each solution by its number"
        f"{'' if based else '; feed drives only'}.</figcaption>\n</figure>\n</section>"
    )


def limit_strips(solution: Optimum, baseline: str | None) -> str:
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

    Of the programs the last is the result.
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
