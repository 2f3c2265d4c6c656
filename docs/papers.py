"""Tables, misprints and what doesn't reproduce of each paper, as its script in `examples/papers` has them."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

SCRIPTS = Path(__file__).parents[1] / "examples" / "papers"
NAMES = ("form_shaping", "nc_programs", "milling", "drilling", "cutting_forces")

if TYPE_CHECKING:
    from showing import Paper


def pages() -> dict[str, str]:
    """Write what the page of papers includes: name of the script → Markdown."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return {name: "\n".join(_lines(import_module(name).paper())) for name in NAMES}
    finally:
        sys.path.remove(str(SCRIPTS))


def _lines(paper: Paper) -> Iterator[str]:
    for table in paper.tables:
        yield f"{table.title}:\n"
        yield from _grid((table.unit, "ours", table.beside, "difference"), table.cells())
    if paper.misprints:
        yield "### Misprints\n"
        rows = [(one.where, one.printed, one.ours, one.why) for one in paper.misprints]
        yield from _grid(("where", "printed", "ours", "why"), rows)
    if paper.missing:
        yield "### Not reproduced\n"
        yield from (f"- {text}" for text in paper.missing)


def _grid(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    for cells in (head, ["---"] * len(head), *rows):
        yield f"| {' | '.join(cells)} |"
    yield ""
