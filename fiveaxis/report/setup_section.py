"""Where the optimiser chose to set the workpiece up: what that saves, and what else was tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from fiveaxis.report.tables import NOTHING, THIN_SPACE, number, plain, saving, table

# Rows of the table; the JSON report has all.
MOST_SHOWN = 15
UNITS = {"x": "mm", "y": "mm", "z": "mm", "angle": "deg"}


def setup_section(found: Mapping[str, Any] | None) -> str:
    """Tell the chosen setup against the given one; nothing where none was searched for.

    Parameters
    ----------
    found : ``ranges``, ``given``, ``chosen``, ``saved`` and ``tried``, cheapest first, as plain data
    """
    if found is None:
        return ""
    shown = found["tried"][:MOST_SHOWN]
    text = f"{_verdict(found)} {_how(found, len(shown))}"
    heads = (
        "offset X, Y, Z (mm)",
        "rotation X, Y, Z (deg)",
        "#thinned path (J)",
        "#kept clear (J)",
        "#whole path (J)",
        "",
    )
    rows = [_row(tried, found) for tried in shown]
    inner = f'<p>{escape(text)}</p>\n<div class="scroll">\n{table(heads, rows)}\n</div>'
    return f"<section>\n<h2>Where the workpiece stands</h2>\n{inner}\n</section>"


def _verdict(found: Mapping[str, Any]) -> str:
    given, chosen = found["given"], found["chosen"]
    if _place(given) == _place(chosen):
        return (
            f"No setup within the ranges was found that saves more than {100.0 * found['least_saving']:.2f}"
            f"{THIN_SPACE}% against the given one; it was kept. Less than that can’t be told from chance: "
            "searches of one path end in different optima."
        )
    before = "which can’t be followed" if given["energy"] is None else f"with {number(given['energy'])} J"
    share = "" if found["saved"] is None else f": {saving(found['saved'])} (feed drives only)"
    return (
        f"Set the workpiece’s zero at {_place(chosen)}. The path costs {number(chosen['energy'])} J there, "
        f"in place of the given setup at {_place(given)}, {before}{share}. Every figure of this report is "
        "for the chosen setup."
    )


def _how(found: Mapping[str, Any], shown: int) -> str:
    ranges = ", ".join(
        f"{name} {plain(low)}…{plain(high)} {UNITS[name]}" for name, (low, high) in found["ranges"].items()
    )
    clear = sum(tried["kept_clear"] is not None for tried in found["tried"])
    checked = clear or any("kept clear" in tried["why"] for tried in found["tried"])
    again = f"The cheapest were looked at again, clear of part, stock and fixtures: {clear} can be used so. "
    return (
        f"Ranges: {ranges}. {len(found['tried'])} setups were looked at on some of the path’s locations, "
        f"with postures chosen anew for each and nothing in the way; the cheapest {shown} are shown. "
        f"{again if checked else ''}Those with a figure for the whole path were run and verified in full."
    )


def _row(tried: Mapping[str, Any], found: Mapping[str, Any]) -> list[str]:
    names = [name for name in ("given", "chosen") if _place(tried) == _place(found[name])]
    remark = "; ".join([*names, *([tried["why"]] if tried["why"] else [])])
    whole = NOTHING if tried["energy"] is None else number(tried["energy"])
    rough, clear = (NOTHING if tried[k] is None else number(tried[k]) for k in ("rough", "kept_clear"))
    return [_triple(tried["offset"]), _triple(tried["rotation_deg"]), rough, clear, whole, remark]


def _place(tried: Mapping[str, Any]) -> str:
    return f"({_triple(tried['offset'])}) mm, turned by ({_triple(tried['rotation_deg'])}) deg"


def _triple(numbers: Sequence[float]) -> str:
    return ", ".join(plain(v) for v in numbers)
