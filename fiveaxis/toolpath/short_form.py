"""Tools by their short form, for example ``ball:10``, or by the name of their file."""

from __future__ import annotations

from pathlib import Path

from fiveaxis.errors import ToolError
from fiveaxis.toolpath import shapes
from fiveaxis.toolpath.tool import Tool
from fiveaxis.toolpath.tool_file import load_tool


def parse_tool(text: str) -> Tool:
    """Read a tool from its short form, or from a file.

    Parameters
    ----------
    text : ``ball:10``, ``flat:10``, ``bull:16:4`` (diameter, corner radius), ``lollipop:8:5`` (ball, neck),
        ``taper:4:5:10`` (ball, half angle in degrees, upper diameter), ``barrel:16:85:3`` (diameter, barrel
        radius, nose radius), ``drill:8:118`` (diameter, point angle in degrees), mm; or a ``.toml`` file as
        described in `fiveaxis.toolpath.tool_file`

    Raises
    ------
    ToolError
        Another shape, figures that are missing or impossible, a file that can't be read.
    """
    if text.lower().endswith(".toml"):
        return load_tool(Path(text))
    shape, *figures = (part.strip() for part in text.split(":"))
    if shape.lower() not in shapes.SHAPES:
        forms = ", ".join(":".join([s, *names]) for s, (_, names) in shapes.SHAPES.items())
        raise ToolError(f"tool {text!r}: write {forms} (mm, deg), or a .toml file; for example ball:10")
    make, names = shapes.SHAPES[shape.lower()]
    if len(figures) != len(names):
        raise ToolError(
            f"tool {text!r}: {len(figures)} figures where {shape} has {len(names)}; write "
            f"{':'.join([shape, *names])}"
        )
    return Tool(make(*(_figure(f, name, text) for f, name in zip(figures, names, strict=True))))


def _figure(field: str, name: str, text: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise ToolError(f"tool {text!r}: {field!r} is no {name}; write for example ball:10 (mm)") from None
