"""The page's tables: rows of text in, HTML out, every cell escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from fiveaxis.findings import Place

THIN_SPACE = "\u2009"
MINUS = "\u2212"
UNKNOWN = "unknown"
NOTHING = "–"
KINDS = {"cut": "cuts", "link": "links", "rapid": "rapid moves"}


@dataclass(frozen=True)
class Cell:
    """One cell: text that isn't escaped yet, and a class for its look."""

    text: str
    look: str = ""


def table(heads: Sequence[str], rows: Iterable[Sequence[str | Cell]], look: str = "") -> str:
    """Write a table; a bare string is a cell without a look of its own.

    Parameters
    ----------
    heads : column heads with their units; one that starts with ``#`` is a column of numbers
    rows : one cell per column
    look : class of the table
    """
    looks = ["number" if head.startswith("#") else "" for head in heads]
    opening = f'<table class="{look}">' if look else "<table>"
    top = "".join(_tag("th", Cell(h.lstrip("#"), k)) for h, k in zip(heads, looks, strict=True))
    body = "\n".join(f"<tr>{_row(row, looks)}</tr>" for row in rows)
    return f"{opening}\n<thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>"


def baseline_table(document: Mapping[str, Any]) -> str:
    """Compare the result with every baseline by every measure."""
    heads: tuple[str, ...] = (
        "posture",
        "#feed drives (J)",
        "#saved",
        "#if power falls with speed (J)",
        "#travel metric (J)",
        "#saved, travel metric",
        "#feed drives and base power (J)",
        "#saved, with base power",
        "#time (s)",
    )
    timed = document["energy"]["run_time"] is not None
    heads += ("#with accelerations (s)", "#saved, time") if timed else ()
    nothing = dict.fromkeys(("total", "travel", "with_base", "run_time"), NOTHING)
    rows = [_energy_row("optimised", document["energy"], nothing)]
    for name, energy in document["baselines"].items():
        shares = {k: saving(v) for k, v in document["savings"][name].items()}
        rows.append(_energy_row(name, energy, shares))
    return table(heads, rows)


def kinds_table(document: Mapping[str, Any]) -> str:
    """Show cuts, links and rapid moves of all programs apart; empty where there are cuts only."""
    energies = {"optimised": document["energy"], **document["baselines"]}
    spent = {name: energy["by_kind"] for name, energy in energies.items()}
    kinds = [kind for kind in KINDS if any(kind in shares for shares in spent.values())]
    if kinds == ["cut"]:
        return ""
    heads = [f"#{KINDS[kind]} ({unit})" for kind in kinds for unit in ("J", "s")]
    rows = []
    for name, shares in spent.items():
        cells = [name]
        for kind in kinds:
            share = shares.get(kind)
            cells += (
                [NOTHING, NOTHING] if share is None else [number(share["total"]), number(share["time"], 1)]
            )
        rows.append(cells)
    return table(("program", *heads), rows)


def missing_list(document: Mapping[str, Any]) -> str:
    """Say which baselines were moved or don't exist, and why, as list items; empty where there are none."""
    moved = [(n, f": {note}") for n, note in document["moved_baselines"].items()]
    missing = [(n, f" isn’t shown: {reason}") for n, reason in document["missing_baselines"].items()]
    return "\n".join(f"<li><b>{escape(n)}</b>{escape(said)}</li>" for n, said in moved + missing)


def axis_table(document: Mapping[str, Any], baseline: str | None) -> str:
    """List what each axis spends, before and after."""
    after = document["energy"]["by_axis"]
    if baseline is None:
        return table(("axis", "#optimised (J)"), [(a, number(j)) for a, j in after.items()])
    before = document["baselines"][baseline]["by_axis"]
    rows = [
        (a, number(before[a]), number(after[a]), number(after[a] - before[a], signed=True)) for a in after
    ]
    return table(("axis", f"#{baseline} (J)", "#optimised (J)", "#change (J)"), rows)


def causes_table(summary: Sequence[Mapping[str, Any]]) -> str:
    """List what was found, one row a cause, worst severity first."""
    heads = ("severity", "code", "#places", "worst", "what", "first")
    return table(heads, [_cause_row(cause) for cause in summary])


def solver_table(stages: Sequence[Mapping[str, Any]]) -> str:
    """List what the solver did, in order."""
    rows = [
        (s["name"], s["status"], number(s["iterations"]), _start(s["before"]), number(s["after"]))
        for s in stages
    ]
    return table(("stage", "status", "#iterations", "#objective before (J)", "#after (J)"), rows)


def budget_table(budget: Mapping[str, Any]) -> str:
    """List a job's consumers with their shares, and on what each figure rests."""
    total = budget["total"]
    rows = []
    for share in budget["shares"]:
        joules = share["energy"]
        part = "" if joules is None or not total else f"{100.0 * joules / total:.1f}{THIN_SPACE}%"
        basis = share["basis"]
        shown = Cell(basis, "warning") if basis in ("assumed", "unknown") else basis
        rows.append((share["name"], number(joules), part, shown, share["said"]))
    return table(("consumer", "#J", "#share", "basis", "source, or why"), rows)


def machine_table(figures: Sequence[Mapping[str, Any]]) -> str:
    """List the machine's figures with their sources, assumptions marked."""
    rows = [
        (f["figure"], f["value"], Cell("assumed", "warning") if f["assumed"] else "sourced", f["source"])
        for f in figures
    ]
    return table(("figure", "value", "basis", "source, or why assumed"), rows)


def input_table(inputs: Sequence[Mapping[str, Any]]) -> str:
    """List the files that were read."""
    rows = [(i["name"], i.get("used_as", ""), number(i["size"]), Cell(i["sha256"], "hash")) for i in inputs]
    return table(("file", "used as", "#bytes", "SHA-256"), rows)


def number(value: float | None, digits: int = 0, *, signed: bool = False) -> str:
    """Write a number with thin spaces between thousands and a true minus sign."""
    if value is None:
        return UNKNOWN
    # Adding 0 after rounding turns −0 into 0.
    rounded = round(value, digits) + 0.0
    text = f"{rounded:{'+' if signed and rounded else ''},.{digits}f}"
    return text.replace(",", THIN_SPACE).replace("-", MINUS)


def plain(value: float) -> str:
    """Write a number as short as it goes, with a true minus sign."""
    return f"{value + 0.0:g}".replace("-", MINUS)


def saving(share: float | None) -> str:
    """Say a saved share as people do: ``20.5 % less``, ``3.1 % more``."""
    if share is None:
        return UNKNOWN
    percent = round(100.0 * share, 1)
    if percent == 0.0:
        return "no change"
    return f"{abs(percent):.1f}{THIN_SPACE}% {'less' if percent > 0.0 else 'more'}"


def _energy_row(name: str, energy: Mapping[str, Any], shares: Mapping[str, str]) -> list[str]:
    timed = energy["run_time"] is not None
    return [
        name,
        number(energy["total"]),
        shares["total"],
        number(energy["least"]),
        number(energy["travel"]),
        shares["travel"],
        number(energy["with_base"]),
        shares["with_base"],
        number(energy["time"], 1),
        *((number(energy["run_time"], 1), shares["run_time"]) if timed else ()),
    ]


def _cause_row(cause: Mapping[str, Any]) -> list[str | Cell]:
    severity, worst = Cell(cause["severity"], cause["severity"]), cause["worst"]
    place, first = (str(Place(**place)) for place in (worst["place"], cause["first"]))
    return [severity, cause["code"], number(cause["count"]), place, worst["message"], first]


def _start(before: float | None) -> str:
    """Write the objective that a stage started from; a search starts from nothing."""
    return NOTHING if before is None else number(before)


def _row(row: Sequence[str | Cell], looks: Sequence[str]) -> str:
    cells = (c if isinstance(c, Cell) else Cell(c, look) for c, look in zip(row, looks, strict=True))
    return "".join(_tag("td", cell) for cell in cells)


def _tag(tag: str, cell: Cell) -> str:
    look = f' class="{cell.look}"' if cell.look else ""
    return f"<{tag}{look}>{escape(cell.text)}</{tag}>"
