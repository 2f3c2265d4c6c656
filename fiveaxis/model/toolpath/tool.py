"""The tool: cutter, shank and holder; by a short form, for example ``ball:10``, or as a TOML file.

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

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from fiveaxis.base import Array, StrictModel, ToolError, read_settings
from fiveaxis.model.toolpath import shapes
from fiveaxis.model.toolpath.cutter import Cutter, Zone, require_dimension

CUTTER, SHANK, HOLDER = "cutter", "shank", "holder"
# mm: lower sections of an outline are omitted.
LOWEST = 1e-9
# Points at which the upper half of a ball is sampled.
UPPER_HALF = 19


@dataclass(frozen=True)
class Section:
    """A cylinder or cone of a holder.

    Parameters
    ----------
    length, diameter : mm, along the axis and at the lower end
    upper_diameter : mm, at the upper end; None for a cylinder
    """

    length: float
    diameter: float
    upper_diameter: float | None = None

    def __post_init__(self) -> None:
        figures = {"length": self.length, "diameter": self.diameter}
        if self.upper_diameter is not None:
            figures["upper_diameter"] = self.upper_diameter
        for name, value in figures.items():
            require_dimension(f"holder section: {name}", value)


@dataclass(frozen=True)
class Holder:
    """Cylinders and cones stacked upwards from the face into which the tool is clamped.

    Parameters
    ----------
    stick_out : mm, from the tool's tip to that face
    sections : from the face upwards
    """

    stick_out: float
    sections: tuple[Section, ...]

    def __post_init__(self) -> None:
        require_dimension("holder: stick-out", self.stick_out)
        if not self.sections:
            raise ToolError("holder: it has no sections; give at least one, from its face upwards")

    def outline(self) -> Array:
        """Return the profile, (m, 2) mm: distance from the axis, height above the tip; two rows a section."""
        rows, height = [], self.stick_out
        for section in self.sections:
            upper = section.diameter if section.upper_diameter is None else section.upper_diameter
            rows += [[section.diameter / 2.0, height], [upper / 2.0, height + section.length]]
            height += section.length
        return np.array(rows)


@dataclass(frozen=True, eq=False)
class ToolPart:
    """A part of a tool, `CUTTER`, `SHANK` or `HOLDER`, as a body of revolution.

    The outline, (m, 2) mm from the bottom up, is distance from the axis and height above the tip.
    """

    name: str
    outline: Array


@dataclass(frozen=True)
class Tool:
    """A cutter with its shank and holder.

    The cutter reference point is the tool tip. The contact stays fixed while the tool leans
    (`fiveaxis.model.toolpath.cutter`), and with it a ball's centre.

    Parameters
    ----------
    cutter : its profile
    shank_diameter : mm, above the cutting edges; None if unknown
    holder : None if unknown
    """

    cutter: Cutter
    shank_diameter: float | None = None
    holder: Holder | None = None

    def __post_init__(self) -> None:
        shank, holder = self.shank_diameter, self.holder
        if shank is not None:
            require_dimension(f"tool {self}: shank diameter", shank)
        top = self.cutter.outline()[-1, 1]
        if holder is not None and holder.stick_out < top:
            raise ToolError(
                f"tool {self}: stick-out {holder.stick_out:g} mm must be at least {top:g} mm, or the holder "
                "covers cutting edges"
            )

    @classmethod
    def ball(cls, diameter: float, **parts: Any) -> Tool:
        """Create a ball end mill of a diameter in mm; `parts` are the other parameters of `Tool`."""
        return cls(shapes.ball(float(diameter)), **parts)

    @classmethod
    def flat(cls, diameter: float, **parts: Any) -> Tool:
        """Create a square end mill of a diameter in mm."""
        return cls(shapes.flat(float(diameter)), **parts)

    @classmethod
    def bull(cls, diameter: float, corner_radius: float, **parts: Any) -> Tool:
        """Create a bull-nose end mill, mm."""
        return cls(shapes.bull(float(diameter), float(corner_radius)), **parts)

    @classmethod
    def lollipop(cls, diameter: float, neck_diameter: float, **parts: Any) -> Tool:
        """Create a ball on a thinner neck, mm."""
        return cls(shapes.lollipop(float(diameter), float(neck_diameter)), **parts)

    @classmethod
    def taper(cls, tip_diameter: float, half_angle: float, diameter: float, **parts: Any) -> Tool:
        """Create a tapered ball end mill: diameters of the ball and of the cone's upper end, mm; degrees."""
        return cls(shapes.taper(float(tip_diameter), float(half_angle), float(diameter)), **parts)

    @classmethod
    def barrel(cls, diameter: float, barrel_radius: float, nose_radius: float, **parts: Any) -> Tool:
        """Create a tangential barrel cutter with a ball nose, mm."""
        return cls(shapes.barrel(float(diameter), float(barrel_radius), float(nose_radius)), **parts)

    @property
    def diameter(self) -> float:
        """Largest diameter of the cutter, mm."""
        return self.cutter.diameter

    @property
    def radius(self) -> float:
        """Half of `diameter`, mm."""
        return self.cutter.diameter / 2.0

    @property
    def zone(self) -> Zone:
        """The zone of the profile that is meant to cut."""
        return self.cutter.zones[self.cutter.main]

    def parts(self) -> tuple[ToolPart, ...]:
        """Return cutter, shank and holder, as far as they are known, from the tip upwards.

        A cutter without a cutting length extends to the end of its profile, at least to the height of its
        radius; a ball is a full sphere. Without `shank_diameter` the shank is as thick as the cutter's upper
        end; without a holder its length is unknown, and it is omitted.
        """
        outline, holder = self.cutter.outline(), self.holder
        thick, top = outline[-1].tolist()
        if self.cutter.length is None:
            if self.cutter.is_ball:
                turn = np.linspace(math.asin(min(1.0, thick / self.radius)), 0.0, UPPER_HALF)
                above = self.radius * np.column_stack([np.sin(turn), 1.0 + np.cos(turn)])
                outline = np.vstack([outline, above[1:]])
            elif self.radius - top > LOWEST:
                top = self.radius
                outline = np.vstack([outline, [[thick, top]]])
        found = [ToolPart(CUTTER, outline)]
        if holder is None:
            return tuple(found)
        if holder.stick_out - top > LOWEST:
            thick = thick if self.shank_diameter is None else self.shank_diameter / 2.0
            found.append(ToolPart(SHANK, np.array([[thick, top], [thick, holder.stick_out]])))
        return (*found, ToolPart(HOLDER, holder.outline()))

    def __repr__(self) -> str:
        return f"<Tool {self}>"

    def __str__(self) -> str:
        return str(self.cutter)


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
    """Read a tool file; `ToolError` for a dimension that is missing, invalid or not one of the shape."""
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


def tools_by_number(text: str) -> dict[str, str]:
    """Part ``3=ball:6,5=bull:10:2`` into the short form of each tool, by its number or name in a program.

    A short form or a file without a number is that of every tool, under an empty one. `ToolError` for a part
    that isn't written so, or a number twice.
    """
    if "=" not in text:
        return {"": text}
    tools: dict[str, str] = {}
    for part in text.split(","):
        number, sign, tool = (word.strip() for word in part.partition("="))
        if not (number and sign and tool) or number in tools:
            raise ToolError(f"tool {text!r}: write each number once, as 3=ball:6,5=bull:10:2")
        tools[number] = tool
    return tools


def _parse_figure(field: str, name: str, text: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise ToolError(f"tool {text!r}: {field!r} is no {name}; write for example ball:10 (mm)") from None
