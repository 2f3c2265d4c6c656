"""The tool: cutter, shank and holder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.errors import ToolError
from fiveaxis.geometry import Array
from fiveaxis.toolpath import shapes
from fiveaxis.toolpath.cutter import Cutter, Zone, require_dimension

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
    """A part of a tool as a body of revolution.

    Parameters
    ----------
    name : `CUTTER`, `SHANK` or `HOLDER`
    outline : (m, 2), mm, from the bottom up: distance from the axis, height above the tip
    """

    name: str
    outline: Array


@dataclass(frozen=True)
class Tool:
    """A cutter with its shank and holder.

    The cutter reference point is the tool tip. The contact stays fixed while the tool leans
    (`fiveaxis.toolpath.cutter`), and with it a ball's centre.

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

    def outline(self) -> Array:
        """Sample the profile of cutter, shank and holder from the tip upwards.

        Returns
        -------
        (m, 2), mm: distance from the axis, height above the tip; two rows at a step. The shank extends to the
        holder; without a holder it is omitted.
        """
        cutter, holder = self.cutter.outline(), self.holder
        if holder is None:
            return cutter
        thick, top = cutter[-1].tolist()
        radius = (self.shank_diameter or 2.0 * thick) / 2.0
        return np.vstack([cutter, [[radius, top], [radius, holder.stick_out]], holder.outline()])

    def __repr__(self) -> str:
        return f"<Tool {self}>"

    def __str__(self) -> str:
        return str(self.cutter)
