"""Tools by their short form, for example ``ball:10``, or as TOML files.

::

    shape = "bull"            # ball, flat, bull, lollipop, taper, barrel or drill
    diameter = 16             # mm; the figures of the shape
    corner_radius = 4
    length = 30               # mm, of the cutting edges; optional
    shank_diameter = 16       # mm; optional

    [holder]                  # optional
    stick_out = 60            # mm, from the tip to the holder's face
    sections = [              # from the face upwards: cylinders, or cones with an upper_diameter
      { length = 20, diameter = 32 },
      { length = 40, diameter = 50, upper_diameter = 63 },
    ]
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from fiveaxis.errors import ToolError
from fiveaxis.settings import StrictModel, read_settings
from fiveaxis.toolpath import shapes
from fiveaxis.toolpath.tool import Holder, Section, Tool


class SectionTable(StrictModel):
    """A cylinder or cone of the holder."""

    length: float = Field(gt=0.0, description="mm, along the axis")
    diameter: float = Field(gt=0.0, description="mm, at the lower end")
    upper_diameter: float | None = Field(None, gt=0.0, description="mm, at the upper end")


class HolderTable(StrictModel):
    """The holder, from its face upwards."""

    stick_out: float = Field(gt=0.0, description="mm, from the tip to the holder's face")
    sections: list[SectionTable] = Field(min_length=1, description="from the face upwards")


class ToolTable(StrictModel):
    """A tool file; the shape has the dimensions of its short form."""

    shape: Literal["ball", "flat", "bull", "lollipop", "taper", "barrel", "drill"] = Field(
        description="shape of the cutter; it decides which of the figures below apply"
    )
    diameter: float | None = Field(None, gt=0.0, description="mm, the largest")
    corner_radius: float | None = Field(None, gt=0.0, description="radius of a bull-nose corner, mm")
    neck_diameter: float | None = Field(None, gt=0.0, description="diameter of a lollipop's neck, mm")
    tip_diameter: float | None = Field(None, gt=0.0, description="mm, of the ball at the tip")
    half_angle: float | None = Field(None, gt=0.0, lt=90.0, description="deg, of the cone to the axis")
    barrel_radius: float | None = Field(None, gt=0.0, description="radius of a barrel's flank, mm")
    nose_radius: float | None = Field(None, gt=0.0, description="radius of a barrel's ball nose, mm")
    point_angle: float | None = Field(None, gt=0.0, lt=180.0, description="angle of a drill's point, deg")
    length: float | None = Field(None, gt=0.0, description="mm, of the cutting edges, from the tip")
    shank_diameter: float | None = Field(None, gt=0.0, description="diameter above the cutting edges, mm")
    holder: HolderTable | None = None


FIGURES = sorted({name for _, names in shapes.SHAPES.values() for name in names})


def load_tool(path: Path) -> Tool:
    """Read a tool file.

    Raises
    ------
    ToolError
        Missing file, unknown key, a dimension that is missing, invalid or not one of the shape.
    """
    table = read_settings(path, ToolTable, ToolError)
    make, names = shapes.SHAPES[table.shape]
    missing = [name for name in names if getattr(table, name) is None]
    foreign = [n for n in FIGURES if n not in names and getattr(table, n) is not None]
    if missing or foreign:
        facts = [f"lacks {', '.join(missing)}"] * bool(missing)
        facts += [f"has {', '.join(foreign)}, which it doesn't use"] * bool(foreign)
        raise ToolError(f"shape {table.shape!r} {' and '.join(facts)}; it has {', '.join(names)}", file=path)
    holder = table.holder
    try:
        cutter = make(*(getattr(table, name) for name in names), length=table.length)
        sections = [] if holder is None else [Section(**s.model_dump()) for s in holder.sections]
        held = None if holder is None else Holder(holder.stick_out, tuple(sections))
        return Tool(cutter, table.shank_diameter, held)
    except ToolError as fault:
        raise ToolError(fault.message, file=path) from None


def parse_tool(text: str) -> Tool:
    """Read a tool from its short form or from a file.

    Parameters
    ----------
    text : ``ball:10``, ``flat:10``, ``bull:16:4`` (diameter, corner radius), ``lollipop:8:5`` (ball, neck),
        ``taper:4:5:10`` (ball, half angle in degrees, upper diameter), ``barrel:16:85:3`` (diameter, barrel
        radius, nose radius), ``drill:8:118`` (diameter, point angle in degrees), mm; or a ``.toml`` file

    Raises
    ------
    ToolError
        An unknown shape, missing or invalid dimensions, a file that can't be read.
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
    return Tool(make(*(_parse_figure(f, name, text) for f, name in zip(figures, names, strict=True))))


def _parse_figure(field: str, name: str, text: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise ToolError(f"tool {text!r}: {field!r} is no {name}; write for example ball:10 (mm)") from None
