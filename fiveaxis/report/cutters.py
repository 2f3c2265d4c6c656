"""Descriptions of cutters in words."""

from __future__ import annotations

from fiveaxis.toolpath import Tool
from fiveaxis.toolpath.shapes import SHAPES

NAMES = {
    "ball": "ball end mill",
    "flat": "square end mill",
    "bull": "bull-nose end mill",
    "lollipop": "lollipop cutter",
    "taper": "tapered ball end mill",
    "barrel": "barrel cutter",
    "drill": "drill",
}
DEGREES = ("half_angle", "point_angle")


def describe_cutter(tool: Tool) -> str:
    """Describe a cutter with its figures: ``bull-nose end mill, diameter 16 mm, corner radius 4 mm``."""
    cutter = tool.cutter
    if cutter.shape not in SHAPES:
        return str(tool)
    names = SHAPES[cutter.shape][1]
    figures = (
        f"{name.replace('_', ' ')} {figure:g}{'°' if name in DEGREES else ' mm'}"
        for name, figure in zip(names, cutter.figures, strict=True)
    )
    return ", ".join([NAMES.get(cutter.shape, cutter.shape), *figures])


def describe_tool(tool: Tool) -> str:
    """Describe a tool's cutter, and its shank and holder if they are known."""
    parts = [describe_cutter(tool)]
    if tool.shank_diameter is not None:
        parts.append(f"shank {tool.shank_diameter:g} mm")
    if tool.holder is not None:
        sections = " and ".join(
            f"{s.length:g} mm of {s.diameter:g} mm"
            + ("" if s.upper_diameter in (None, s.diameter) else f" to {s.upper_diameter:g} mm")
            for s in tool.holder.sections
        )
        parts.append(f"stick-out {tool.holder.stick_out:g} mm, holder {sections}")
    return "; ".join(parts)


def what_stays(tool: Tool) -> str:
    """Describe what is held while the tool leans."""
    if tool.cutter.is_ball:
        return "The ball’s centre is held, so the contact stays"
    return "The tool leans about its contact, which stays"
