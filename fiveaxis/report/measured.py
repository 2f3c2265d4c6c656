"""What verification measured in the program's text, in words and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fiveaxis.report.tables import MINUS, NOTHING, THIN_SPACE, table

# Figures of verification by name: what they are, and their unit.
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
    "tip_deviation_mm": ("tool off its straight way between two rows", "mm"),
    "axis_off_plane_deg": ("tool axis off the plane of its directions", "°"),
    "gouge_depth_mm": ("cutter in the part", "mm"),
    "shank_overlap_mm": ("shank in part, stock, fixture or table", "mm"),
    "shank_clearance_lacking_mm": ("lacking of the shank’s clearance", "mm"),
    "holder_overlap_mm": ("holder in part, stock, fixture or table", "mm"),
    "holder_clearance_lacking_mm": ("lacking of the holder’s clearance", "mm"),
    "fixture_overlap_mm": ("cutter in fixture or table", "mm"),
    "fixture_clearance_lacking_mm": ("lacking of the cutter’s clearance", "mm"),
    "machine_overlap_mm": ("bodies of the machine in each other", "mm"),
    "machine_clearance_lacking_mm": ("lacking of the machine’s clearance", "mm"),
    "text_off_mm": ("linear axes in the text off their planned places", "mm"),
    "text_off_deg": ("rotary axes in the text off their planned places", "°"),
    "duration_off_share": ("time of the cuts by the text, off the planned", "%"),
    "off_path_mm": ("program off the path that it should follow", "mm"),
}


def measured_table(figures: Mapping[str, Any]) -> str:
    """List the worst figures that verification measured; a dash where there was nothing to measure.

    Parameters
    ----------
    figures : by name
    """
    rows = [(_words(name)[0], _shown(name, value)) for name, value in figures.items()]
    return table(("measured in the program, the worst", "#value"), rows, "narrow")


def _words(name: str) -> tuple[str, str]:
    """Give words and unit of a figure; of one without words its name."""
    return WORDS.get(name, (name.replace("_", " "), ""))


def _shown(name: str, value: Any) -> str:
    """Write a figure with its unit, to four digits and no finer than a nanometre."""
    if value is None:
        return NOTHING
    unit = _words(name)[1]
    if not isinstance(value, float | int):
        return str(value)
    scaled = round(100.0 * value if unit == "%" else value, 6) + 0.0
    text = f"{scaled:.4g}".replace("-", MINUS)
    return f"{text}{'' if unit.startswith('°') or not unit else THIN_SPACE}{unit}"
