"""What the NC program's own moves cost, and which blocks it has more or less than the path has locations."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from fiveaxis.report.tables import kinds_table, number


def program_section(document: Mapping[str, Any]) -> str:
    """Say which blocks the program has, and what its kinds of move cost; nothing without a program."""
    program = document["program"]
    if program is None:
        return ""
    inserted, blocks, before = (number(program[key]) for key in ("inserted", "blocks", "blocks_before"))
    tolerance = f"{program['path_tolerance_mm']:g} mm"
    text = (
        f"The program has {blocks} blocks for {before} locations. Between these the axes have to hold the "
        f"tool on its path: that takes {inserted} inserted {_blocks(program['inserted'])} (tolerance "
        f"{tolerance}), whose postures were chosen as the others were. {_removed(program)} All figures are "
        "those of whole programs, each with the blocks that it needs, without approach and retract."
    )
    apart = kinds_table(document)
    shown = f"<p>{escape(text)}</p>\n"
    if apart:
        said = "Of the feed drives’ energy, and of the time, by kind of move:"
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
