"""The page's tables: rows of text in, HTML out, every cell escaped."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from fiveaxis.base import Cause
from fiveaxis.lab import Budget
from fiveaxis.model import Energy, Provenance
from fiveaxis.posture import RESULT, SolverStep
from fiveaxis.show.report.document import Measure, ReportDocument
from fiveaxis.show.report.facts import InputFile
from fiveaxis.show.report.words import MINUS, THIN_SPACE, number, saving, speed_change

NOTHING = "–"
NOT_CHECKED = "not checked"
KINDS = {"cut": "cuts", "link": "links", "rapid": "rapid moves"}

# Figures of verification by name: description and unit.
WORDS = {
    "limit_overrun_mm": ("linear axis beyond its travel", "mm"),
    "limit_overrun_deg": ("rotary axis beyond its travel", "°"),
    "held_axis_off_deg": ("held axis off its angle", "°"),
    "contact_error_mm": ("tool off its path", "mm"),
    "tilt_min_deg": ("smallest angle of the tool axis", "°"),
    "tilt_max_deg": ("largest angle of the tool axis", "°"),
    "rotary_step_deg": ("largest turn in a cutting block", "°"),
    "turn_rate_deg_mm": ("largest turn along the cut", "°/mm"),
    "singular_turn_deg": ("turn of the first rotary axis near the singular direction", "°"),
    "speed_share": ("speed, of an axis’s highest", "%"),
    "rotary_acceleration_share": ("acceleration of rotary axes, of their highest", "%"),
    "linear_acceleration_share": ("acceleration of linear axes, of their highest", "%"),
    "tip_deviation_mm": ("tool off its straight line between two rows", "mm"),
    "axis_off_plane_deg": ("tool axis off the plane of its directions", "°"),
    "gouge_depth_mm": ("cutter in the part", "mm"),
    "stock_gouge_mm": ("material of the part that the cut stock lacks, deepest", "mm"),
    "left_over_mm": ("ridge of the stock between finished places, highest", "mm"),
    "finished_share": ("area of the part that is finished", "%"),
    "left_volume_mm3": ("stock left beyond the part", "mm³"),
    "shank_in_stock_mm3": ("stock that the shank reaches into, of a move", "mm³"),
    "holder_in_stock_mm3": ("stock that the holder reaches into, of a move", "mm³"),
    "shank_overlap_mm": ("shank in part, stock, fixture or table", "mm"),
    "shank_clearance_lacking_mm": ("shortfall of the shank’s clearance", "mm"),
    "holder_overlap_mm": ("holder in part, stock, fixture or table", "mm"),
    "holder_clearance_lacking_mm": ("shortfall of the holder’s clearance", "mm"),
    "fixture_overlap_mm": ("cutter in fixture or table", "mm"),
    "fixture_clearance_lacking_mm": ("shortfall of the cutter’s clearance", "mm"),
    "machine_overlap_mm": ("overlap of the machine’s bodies", "mm"),
    "machine_clearance_lacking_mm": ("shortfall of the machine’s clearance", "mm"),
    "text_off_mm": ("linear axes in the text off their planned positions", "mm"),
    "text_off_deg": ("rotary axes in the text off their planned positions", "°"),
    "feed_off_share": ("time of the cuts off what the path's feed asks for", "%"),
    "duration_off_share": ("time of the cuts in the text off the planned time", "%"),
    "off_path_mm": ("program off the path to follow", "mm"),
}


@dataclass(frozen=True)
class Cell:
    """One cell: unescaped text, its CSS class, and texts that are folded below it."""

    text: str
    look: str = ""
    folded: tuple[str, ...] = ()


def table(heads: Sequence[str], rows: Iterable[Sequence[str | Cell]], caption: str, look: str = "") -> str:
    """Write a table; a plain string is a cell with its column's class.

    Parameters
    ----------
    heads : column heads with their units; ``#`` in front marks a column of numbers
    rows : one cell per column; the first one names the row
    caption : what the table shows
    look : CSS class of the table
    """
    looks = ["number" if head.startswith("#") else "" for head in heads]
    opening = f'<table class="{look}">' if look else "<table>"
    top = "".join(
        _tag("th", Cell(h.lstrip("#"), k), ' scope="col"') for h, k in zip(heads, looks, strict=True)
    )
    body = "\n".join(f"<tr>{_row(row, looks)}</tr>" for row in rows)
    return (
        f"{opening}\n<caption>{escape(caption)}</caption>\n<thead><tr>{top}</tr></thead>\n"
        f"<tbody>\n{body}\n</tbody>\n</table>"
    )


def scroll(content: str) -> str:
    """Make a wide table scrollable on a narrow screen, also by keys."""
    return f'<div class="scroll" tabindex="0">\n{content}\n</div>\n'


def saved_table(document: ReportDocument) -> str:
    """List the energy of the program and of every baseline by the measure of the document, cheapest first."""
    measure = document.measure

    def cost(energy: Energy) -> float:
        value: float = getattr(energy, measure)
        return value

    energy = document.solution.energy
    rows = [(RESULT, number(cost(energy)), NOTHING, number(energy.time, 1))]
    rows += [
        (name, number(cost(e)), saving(document.saved(name, measure)), number(e.time, 1))
        for name, e in sorted(document.solution.baselines.items(), key=lambda item: cost(item[1]))
    ]
    heads = ("posture", "#energy (J)", "#saved", "#time (s)")
    return table(heads, rows, "Energy of whole programs, and what the optimised one saves")


def baseline_table(document: ReportDocument) -> str:
    """Compare the result with every baseline by every measure."""

    def share(name: str, measure: Measure) -> str:
        return NOTHING if name == RESULT else saving(document.saved(name, measure))

    columns: dict[str, Callable[[str, Energy], str]] = {
        "#feed drives (J)": lambda _, energy: number(energy.total),
        "#saved": lambda name, _: share(name, "total"),
        "#at whole power when slow (J)": lambda _, energy: number(energy.most or energy.total),
        "#travel metric (J)": lambda _, energy: number(energy.travel),
        "#saved, travel metric": lambda name, _: share(name, "travel"),
        "#feed drives and base power (J)": lambda _, energy: number(energy.with_base),
        "#saved, with base power": lambda name, _: share(name, "with_base"),
        "#time (s)": lambda _, energy: number(energy.time, 1),
        "#saved, time": lambda name, _: share(name, "time"),
        "#time at the feed (s)": lambda _, energy: number(energy.feed_time, 1),
        "#starts": lambda _, energy: number(energy.starts),
        "#reversals": lambda _, energy: number(energy.reversals),
    }
    rows = [
        [name, *(column(name, energy) for column in columns.values())]
        for name, energy in document.solution.energies.items()
    ]
    return table(("posture", *columns), rows, "Every measure of whole programs")


def kinds_table(document: ReportDocument) -> str:
    """List cuts, links and rapid moves of all programs separately; empty if there are cuts only."""
    spent = {name: energy.by_kind for name, energy in document.solution.energies.items()}
    kinds = [kind for kind in KINDS if any(kind in shares for shares in spent.values())]
    if kinds == ["cut"]:
        return ""
    heads = [f"#{KINDS[kind]} ({unit})" for kind in kinds for unit in ("J", "s")]
    rows = []
    for name, shares in spent.items():
        cells = [name]
        for kind in kinds:
            share = shares.get(kind)
            cells += [NOTHING, NOTHING] if share is None else [number(share.total), number(share.time, 1)]
        rows.append(cells)
    return table(("program", *heads), rows, "Energy of the feed drives and time by kind of move")


def missing_list(document: ReportDocument) -> str:
    """List which baselines were moved or are missing, and why, as list items; empty if there are none."""
    moved = [(name, f": {note}") for name, note in document.moved_baselines.items()]
    missing = [(name, f" isn’t shown: {reason}") for name, reason in document.solution.missing.items()]
    return "\n".join(f"<li><b>{escape(name)}</b>{escape(text)}</li>" for name, text in moved + missing)


def axis_table(document: ReportDocument) -> str:
    """List the energy of each axis, before and after."""
    after, name = document.solution.energy.by_axis, document.baseline
    heads, rows = ["axis", f"#{RESULT} (J)"], [[a, number(joules)] for a, joules in after.items()]
    if name is not None:
        before = document.solution.baselines[name].by_axis
        heads = ["axis", f"#{name} (J)", f"#{RESULT} (J)", "#change (J)"]
        rows = [[a, number(before[a]), j, number(after[a] - before[a], signed=True)] for a, j in rows]
    return table(heads, rows, "Energy of each axis, feed drives only")


def steadiness_table(document: ReportDocument) -> str:
    """List starts, reversals and the largest change of speed of each axis, before and after."""
    result, name = document.solution.energy, document.baseline
    programs = {} if name is None else {name: document.solution.baselines[name]}
    programs[RESULT] = result
    heads = [f"#{what}, {name}" for what in ("starts", "reversals") for name in programs]
    counts = [energy.steadiness.starts for energy in programs.values()]
    counts += [energy.steadiness.reversals for energy in programs.values()]
    changes = result.steadiness.changes
    rows = [
        (
            axis,
            *(number(each[axis]) for each in counts),
            speed_change(axis, changes[axis], document.lines.get(axis)) if axis in changes else NOTHING,
        )
        for axis in result.by_axis
    ]
    rows.append(("all", *(number(sum(each.values())) for each in counts), ""))
    caption = "Starts, reversals and largest change of speed of each axis"
    return table(("axis", *heads, f"#change of speed, {RESULT}"), rows, caption)


def causes_table(summary: Sequence[Cause]) -> str:
    """List the findings, one row per severity and code, worst severity first.

    What has no place on the path is folded under the first of its code.
    """
    heads = ("severity", "code", "#places", "worst", "what", "first")
    alike: dict[tuple[str, str], list[Cause]] = {}
    for cause in summary:
        alike.setdefault((cause.severity, cause.code), []).append(cause)
    rows = [_cause_row(causes) for causes in alike.values()]
    return table(heads, rows, "Findings by cause, errors first", "causes")


def _cause_row(causes: Sequence[Cause]) -> list[str | Cell]:
    cause, *others = causes
    what = Cell(cause.worst.message, folded=tuple(other.worst.message for other in others))
    count = number(sum(each.count for each in causes))
    severity = Cell(cause.severity, cause.severity)
    return [severity, cause.code, count, str(cause.worst.place), what, str(cause.first)]


def measured_table(figures: Mapping[str, float | None]) -> str:
    """List the worst figures that verification measured, by name, and what no check measured."""
    rows = [(_words(name)[0], _measured(name, value)) for name, value in figures.items()]
    caption = "The worst that was measured in the program"
    return table(("measured in the program, the worst", "#value"), rows, caption, "narrow")


def solver_table(stages: Sequence[SolverStep]) -> str:
    """List the solver's stages in order."""
    rows = [
        (
            s.name,
            s.status,
            NOTHING if s.before is None else number(s.before),  # a search starts from nothing
            number(s.after),
        )
        for s in stages
    ]
    heads = ("stage", "status", "#objective before (J)", "#after (J)")
    return table(heads, rows, "Stages of the solver in order")


def budget_table(budget: Budget) -> str:
    """List a job's consumers with their shares, and the basis of each figure."""
    rows, total = [], budget.total
    for share in budget.shares:
        joules, basis = share.energy, share.basis
        part = "" if joules is None or not total else f"{100.0 * joules / total:.1f}{THIN_SPACE}%"
        shown = Cell(basis, "warning") if basis in ("assumed", "unknown") else basis
        rows.append((share.name, number(joules), part, shown, share.source))
    return table(("consumer", "#J", "#share", "basis", "source, or why"), rows, "Consumers of the whole job")


def machine_table(figures: Sequence[Provenance]) -> str:
    """List the machine's figures with their sources; assumptions are marked."""
    rows = [
        (f.figure, f.value, Cell("assumed", "warning") if f.assumed else "sourced", f.text) for f in figures
    ]
    heads = ("figure", "value", "basis", "source, or why assumed")
    return table(heads, rows, "The machine’s figures and their sources")


def input_table(inputs: Sequence[InputFile]) -> str:
    """List the files that were read."""
    rows = [(i["name"], i.get("used_as", ""), number(i["size"]), Cell(i["sha256"], "hash")) for i in inputs]
    return table(("file", "used as", "#bytes", "SHA-256"), rows, "Files that were read")


def _words(name: str) -> tuple[str, str]:
    """Find a figure's description and unit; the description defaults to its name."""
    return WORDS.get(name, (name.replace("_", " "), ""))


def _measured(name: str, value: float | None) -> str:
    """Format a figure with its unit, to four digits and at most six decimals."""
    if value is None or not math.isfinite(value):
        return NOT_CHECKED
    unit = _words(name)[1]
    scaled = round(100.0 * value if unit == "%" else value, 6) + 0.0
    text = np.format_float_positional(float(f"{scaled:.4g}"), trim="-").replace("-", MINUS)
    return f"{text}{'' if unit.startswith('°') or not unit else THIN_SPACE}{unit}"


def _row(row: Sequence[str | Cell], looks: Sequence[str]) -> str:
    cells = (c if isinstance(c, Cell) else Cell(c, look) for c, look in zip(row, looks, strict=True))
    first, *others = cells
    return _tag("th", first, ' scope="row"') + "".join(_tag("td", cell) for cell in others)


def _tag(tag: str, cell: Cell, more: str = "") -> str:
    look = f' class="{cell.look}"' if cell.look else ""
    return f"<{tag}{look}{more}>{escape(cell.text)}{_folded(cell.folded)}</{tag}>"


def _folded(texts: Sequence[str]) -> str:
    if not texts:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<details><summary>{len(texts)} more</summary><ul>{items}</ul></details>"
