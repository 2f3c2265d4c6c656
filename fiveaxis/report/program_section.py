"""What the NC program's own moves cost, and which blocks it has more or less than the path has locations."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from fiveaxis.report.tables import kinds_table, number, program_table


def program_section(program: Mapping[str, Any] | None) -> str:
    """Say what the program's own moves cost: a solution's figures see the path's locations only.

    Parameters
    ----------
    program : as `report_document` takes it; nothing is said where there is none
    """
    if program is None:
        return ""
    inserted, blocks, before = (number(program[key]) for key in ("inserted", "blocks", "blocks_before"))
    tolerance = f"{program['path_tolerance_mm']:g} mm"
    text = (
        "The figures above see the cutter locations only. Between them the axes have to hold the tool on its "
        f"path: that takes {inserted} inserted {_blocks(program['inserted'])} (tolerance {tolerance}). "
        f"{_removed(program)} The program has {blocks} blocks for {before} locations, and its own moves "
        "cost, without approach and retract:"
    )
    apart = kinds_table(program)
    shown = f'<p>{escape(text)}</p>\n<div class="scroll">\n{program_table(program)}\n</div>\n'
    if apart:
        said = "Of that power integral, and of the time, by kind of move:"
        shown += f'<p>{said}</p>\n<div class="scroll">\n{apart}\n</div>\n'
    return shown


def _removed(program: Mapping[str, Any]) -> str:
    """Say how many redundant blocks were removed, or why none was."""
    if program["redundant_kept_for"]:
        return (
            f"Redundant blocks stay in it, because without them: {', '.join(program['redundant_kept_for'])}."
        )
    count = program["removed"]
    if not count:
        return "No block was redundant."
    return (
        f"{number(count)} {_blocks(count)} {'was' if count == 1 else 'were'} removed, as the axes run there "
        f"by themselves (within that tolerance, and {program['axis_tolerance_deg']:g}° of the tool’s axis); "
        "the motion that is left was verified."
    )


def _blocks(count: int) -> str:
    return "block" if count == 1 else "blocks"
